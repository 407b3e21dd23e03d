"""`demo`: sample data in a folder, and the commands that show what they are good for."""

from __future__ import annotations

import dataclasses
import os
import shlex
import textwrap
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorid.base.answer import COLUMNS, Answer
from rotorid.base.suggestions import one_of
from rotorid.commands.demo_samples import SAMPLES, Sample
from rotorid.report.options import file_of
from rotorid.report.outcome import Delivered, command, provenance

if TYPE_CHECKING:
    import pandas as pd

COPIED = (".csv", ".toml", ".md", ".txt", ".wav")


@dataclass(frozen=True)
class DemoOptions:
    """Options of `demo`.

    Attributes
    ----------
    sample
        One of `SAMPLES`.
    """

    sample: str = "main"


@dataclass(frozen=True, eq=False, kw_only=True)
class Samples(Delivered):
    """What the samples are."""

    samples: Mapping[str, Sample]

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, without the provenance."""
        return {"samples": [{"name": name, "about": one.about} for name, one in self.samples.items()]}

    @property
    def answer(self) -> Answer:
        """One line each."""
        width = max(map(len, self.samples))
        lines = (f"{name:{width}}  {sample.about}" for name, sample in self.samples.items())
        return Answer("\n".join(lines))

    def to_frame(self) -> pd.DataFrame:
        """One row each."""
        import pandas as pd

        return pd.DataFrame(self.to_dict()["samples"])


@dataclass(frozen=True, eq=False, kw_only=True)
class Demo(Delivered):
    """A sample in its folder.

    Attributes
    ----------
    folder, name
        Where, and which.
    documents
        What the commands gave, by the keys of their steps; empty before they have run.
    """

    folder: Path
    name: str
    documents: Mapping[str, Mapping[str, Any]] = dataclasses.field(default_factory=dict)

    @property
    def sample(self) -> Sample:
        """Its files and steps."""
        return SAMPLES[self.name]

    @property
    def commands(self) -> list[list[str]]:
        """The commands as typed, `rotorid` first."""
        return [step.command(self.folder) for step in self.sample.steps]

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, without the provenance."""
        return {
            "folder": str(self.folder),
            "sample": self.name,
            "pictures": [str(self.folder / name) for name in self.sample.pictures],
            "commands": [shlex.join(command) for command in self.commands],
            **self.documents,
        }

    def told(self) -> Iterator[tuple[str, list[str]]]:
        """The heading of each command, and the command."""
        both = zip(self.sample.steps, self.commands, strict=True)
        for number, (step, one) in enumerate(both, start=1):
            yield f"{number}. {step.title}\n{_typed(one)}", one

    def run(self, command: Callable[[list[str]], Mapping[str, Any]]) -> Demo:
        """The same with the documents that a function gives of the commands, without their provenance."""
        found = {
            step.key: {key: value for key, value in command(typed).items() if key != "provenance"}
            for step, typed in zip(self.sample.steps, self.commands, strict=True)
        }
        return dataclasses.replace(self, documents=found)

    @property
    def answer(self) -> Answer:
        """Where the pictures are."""
        return Answer(f"Pictures: {', '.join(str(self.folder / name) for name in self.sample.pictures)}")

    def to_frame(self) -> pd.DataFrame:
        """One row per command."""
        import pandas as pd

        return pd.DataFrame(
            [
                {"step": step.title, "command": shlex.join(command)}
                for step, command in zip(self.sample.steps, self.commands, strict=True)
            ]
        )


def _typed(command: list[str]) -> str:
    """The command after `$`, in lines that a shell joins again."""
    words = (shlex.quote(word).replace(" ", "\0") for word in command)  # a quoted word is not broken
    lines = textwrap.wrap(" ".join(words), COLUMNS - 6, break_long_words=False, break_on_hyphens=False)
    return "$ " + " \\\n    ".join(lines).replace("\0", " ")


def samples() -> Samples:
    """What there is to see."""
    return Samples(samples=SAMPLES, provenance=provenance([], DemoOptions()))


@command
def demo(folder: Path | str, options: DemoOptions | None = None) -> Demo:
    """Write the files of a sample; its commands are run by who wants to see them.

    Parameters
    ----------
    folder
        Where; what stands there is kept.
    options
        Those that differ from the defaults.

    Raises
    ------
    ValueError
        Where something would be overwritten, and for samples that there are not; nothing is written then.
    """
    options = options or DemoOptions()
    sample = SAMPLES[one_of(options.sample, "--sample", tuple(SAMPLES))]
    place = file_of(folder, "a folder")
    copies = _copy(place, sample)
    return Demo(folder=place, name=options.sample, provenance=provenance(copies, options))


def _copy(folder: Path, sample: Sample) -> list[Path]:
    """Write the files of a sample; refuse before anything is written."""
    from rotorid.samples import sample_data
    from rotorid.tables.reader.table_writing import write_files

    samples = sample_data()
    sources: list[Path] = []
    for name in sample.sources:
        place = samples / name
        inside = [f for f in sorted(place.iterdir()) if f.suffix in COPIED] if place.is_dir() else [place]
        sources += inside
    copies = {folder / f.relative_to(samples): f.read_bytes() for f in sources}
    _check_folder(folder, samples, copies, sample)
    for path in copies:
        path.parent.mkdir(parents=True, exist_ok=True)
    write_files({path: data for path, data in copies.items() if not path.exists()})
    return list(copies)


def _check_folder(folder: Path, samples: Path, copies: Mapping[Path, bytes], sample: Sample) -> None:
    """Refuse a folder whose files the demo would overwrite."""
    remedy = "choose another folder: rotorid demo DIR"
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"{folder}: this is a file; {remedy}")
    inside = Path(os.path.realpath(folder))
    if samples.resolve() in (inside, *inside.parents) or any(
        os.path.realpath(folder / name) == os.path.realpath(samples / name) for name in sample.sources
    ):
        raise ValueError(f"{folder}: these are the sample data themselves; {remedy}")
    own = all(path.exists() for path in copies)  # a demo of this sample ran here before
    pictures = [] if own else [str(folder / p) for p in sample.pictures if (folder / p).exists()]
    if pictures:
        raise ValueError(f"{', '.join(pictures)}: would be overwritten; delete it, or {remedy}")
    changed = [str(p) for p, data in copies.items() if p.exists() and (p.is_dir() or p.read_bytes() != data)]
    if changed:
        raise ValueError(
            f"{', '.join(changed)}: differs from the sample and would be overwritten; delete it, or {remedy}"
        )
