"""Studies: what becomes of many drawn machines, on any executor."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from rotorid.base.tables import Column, Table
from rotorid.base.text import counted
from rotorid.report.options import file_of
from rotorid.report.outcome import USUAL, Outcome, command, provenance

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["StudyOptions", "study"]

UNDETERMINED = "the readings do not determine a correction"


@dataclass(frozen=True)
class StudyOptions:
    """Options of `study`.

    Attributes
    ----------
    samples : N from 1
        How many, in place of what the file says; a finished study is continued with more.
    seed : N from 0
        In place of what the file says.
    workers : N from 1
        Processes on this machine.
    scheduler : ADDRESS
        Of a Dask cluster whose workers draw the samples, such as tcp://10.0.0.5:8786.
    results : FILE
        For the samples, .parquet; a study that was broken off there is continued.
    """

    samples: int | None = None
    seed: int | None = None
    workers: int = 1
    scheduler: str | None = None
    results: Path | str | None = None
    panels: ClassVar[Mapping[str, str]] = {"Work": "workers scheduler results"}
    to: ClassVar[Sequence[str]] = USUAL


@command
def study(file: Path | str, options: StudyOptions | None = None, executor: Executor | None = None) -> Outcome:
    """Chance that a machine meets its limit, as built and balanced, by simulation.

    A study that was broken off is continued by the same command with --results; the samples do not
    depend on the workers.

    Example: rotorid study sample_data/study/study.toml --samples 50

    Parameters
    ----------
    file : STUDY
        Study file (.toml).
    options
        How many samples, who draws them, where they are kept.
    executor
        Any of `concurrent.futures`, in place of own processes.

    Raises
    ------
    ValueError
        For files that cannot be, a result file of another study or of one that is running, a sample that
        fails, and workers that die.
    """
    from rotorid.files.disk import sha256
    from rotorid.fleet.jobs import arrow
    from rotorid.study.samples import draw_all, draw_machine, nominal
    from rotorid.study.study_file import read_study

    options = options or StudyOptions()
    read = read_study(file_of(file, "a study file"))
    seed = read.seed if options.seed is None else options.seed
    samples = read.samples if options.samples is None else options.samples
    results = None if options.results is None else Path(options.results)
    if samples < 1 or seed < 0 or options.workers < 1:
        raise ValueError("--samples and --workers take a number from 1, --seed one from 0")
    if results is not None and results.suffix != ".parquet":
        raise ValueError(f"--results {results}: the name of the file must end in .parquet")
    model, made = nominal(read), provenance(read.files, options)
    identity = {"version": made["version"], "seed": seed, "inputs": [*map(sha256, read.files)]}
    columns = {"sample": "int64"} | {f"ratio_{k}": "double" for k in range(read.corrections + 1)}
    columns |= {"runs_needed": "int32", "held": "bool", "warned": "bool", "why": "string"}
    schema = arrow("a study").schema([*columns.items()], {"study": json.dumps(identity)})
    sample = partial(draw_machine, read, model.W)
    with _cluster(options.scheduler) if options.scheduler else nullcontext(executor) as executor:
        table = draw_all(sample, seed, samples, schema, results, executor, options.workers)
    keys = {"kind": "balance", "samples": samples, "seed": seed, "warnings": list(model.warnings)}
    return _outcome(table.to_pandas(), len(read.planes), keys, made)


def _cluster(address: str) -> Any:  # noqa: ANN401 - of Dask
    """The executor of a Dask cluster."""
    try:
        from distributed import Client

        return Client(address, timeout=10).get_executor()  # type: ignore[no-untyped-call]
    except ImportError as error:
        raise ValueError("--scheduler needs Dask: pip install dask[distributed]") from error
    except (OSError, ValueError) as error:
        raise ValueError(f"--scheduler {address}: no cluster answers there ({error})") from error


def interval(k: int, n: int) -> list[float]:
    """Of a probability at 95 % where k of n samples are so, exact (Clopper and Pearson)."""
    from scipy.stats import binomtest

    return [float(end) for end in binomtest(k, n).proportion_ci()]


def _outcome(frame: pd.DataFrame, planes: int, keys: Mapping[str, Any], made: Mapping[str, Any]) -> Outcome:
    """Probabilities to meet the limit after each correction, and whether regions of weights are honest."""
    from rotorid.study.samples import UNSTABLE

    ratios, n, shown = frame.filter(like="ratio_"), len(frame), "{:.4f}".format
    most = ratios.shape[1] - 1
    runs = [1, *range(planes + 2, planes + 2 + most)]
    met = [int((frame["runs_needed"] <= one).sum()) for one in runs]
    low, high = zip(*(interval(k, n) for k in met), strict=True)
    columns = (
        Column("corrections", range(most + 1)),
        Column("runs", runs),
        Column("met", met),
        Column("probability", [k / n for k in met], shown),
        Column("low", low, shown),
        Column("high", high, shown),
    )
    table = Table("corrections", columns)
    head = f"The limit is met by {100 * met[0] / n:.4g} % as built"
    if most:
        head += f" and {100 * met[-1] / n:.4g} % after at most {counted(most, 'correction')}"
    reasons = frame["why"].dropna().where(lambda why: why == UNSTABLE, UNDETERMINED).value_counts().to_dict()
    notes = [f"{count} of {n} were not balanced: {why}" for why, count in reasons.items()]
    coverage = {}
    for name, warned in (("silent", False), ("warned", True)):
        held = frame["held"][frame["warned"] == warned]
        good, count = int((held == 1).sum()), len(held)  # unknown where there is no region
        coverage[name] = {"held": good, "corrections": count}
        if count:
            ends = (f"{100 * end:.1f}" for end in interval(good, count))
            notes.append(
                f"first corrections with {'a' if warned else 'no'} warning: {good} of {count} of the 95 % "
                f"regions hold the true one ({' to '.join(ends)} %)"
            )
    return Outcome(
        result=frame,
        sentences=(f"{head}, of {counted(n, 'drawn machine')}.",),
        tables=(table,),
        file=table,
        keys={
            **keys,
            "probability": met[-1] / n,
            "interval": [low[-1], high[-1]],
            "rows": table.records,
            "coverage": coverage,
            "not_balanced": reasons,
        },
        pictures={"Largest readings over their limit.": partial(_figure, ratios)},
        warnings=tuple(keys["warnings"]),
        notes=tuple(notes),
        title="Study of machines",
        provenance=made,
    )


def _figure(ratios: pd.DataFrame) -> Figure:
    """Below which ratio to the limit a share of the machines lies, as built and at last."""
    from rotorid.base.plot_style import look, on_figure, plain, plain_numbers

    def draw(ax: Axes) -> None:
        plain(ax)
        curves = {"as built": ratios["ratio_0"]}
        if ratios.shape[1] > 1:
            curves["after the last correction"] = ratios.ffill(axis=1).iloc[:, -1]
        for k, (name, values) in enumerate(curves.items()):
            ax.ecdf(values.dropna(), orientation="horizontal", label=name, **look(k))
        ax.axhline(1.0, color="black", linewidth=0.8, label="limit")
        ax.set(yscale="log", ylabel="largest reading over its limit", xlabel="share of machines below")
        plain_numbers(ax)
        ax.legend(frameon=False)

    return on_figure(draw)
