"""`study`: what becomes of many drawn machines, or of many starts of a calibration, on any executor."""

from __future__ import annotations

import json
import sqlite3
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from rotorid.base.versions import SCHEMA_VERSION
from rotorid.report.options import file_of
from rotorid.report.outcome import USUAL, Outcome, command, outcome_of, provenance
from rotorid.study.study_result import StudiedMachines, StudiedStarts

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from rotorid.study.chunks import Task
    from rotorid.tables.study_file import StudyFile

MACHINES, STARTS = 250, 8
"""Samples in a file: some seconds of work."""
MANIFEST = "_study.json"  # with _: who reads the folder as a table passes it over
LOCK = "_study.lock"


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
    results : FOLDER
        For the samples, as Parquet; a study that was broken off there is continued.
    """

    samples: int | None = None
    seed: int | None = None
    workers: int = 1
    results: Path | str | None = None
    panels: ClassVar[Mapping[str, str]] = {"Work": "workers results"}
    to: ClassVar[Sequence[str]] = USUAL


@command
def study(file: Path | str, options: StudyOptions | None = None, executor: Executor | None = None) -> Outcome:
    """Chance that a machine meets its limit, as built and balanced, by simulation.

    A study that was broken off is continued by the same command with --results; the samples do not
    depend on the workers. In Python it runs on any executor, such as that of a Dask cluster.

    Example: rotorid study sample_data/study/study.toml --samples 50

    Parameters
    ----------
    file : STUDY
        Study file (.toml).
    options
        How many samples, where they are kept.
    executor
        Any of `concurrent.futures`, such as `client.get_executor()` of Dask, in place of own processes.

    Raises
    ------
    ValueError
        For files that cannot be, a folder of another study, a sample that fails, and workers that die again
        and again.
    """
    try:
        import pyarrow  # noqa: F401
    except ImportError as error:
        raise ValueError("a study needs pyarrow: pip install pyarrow") from error
    from rotorid.files.input_file import sha256
    from rotorid.study.chunks import read_parts, run_study
    from rotorid.tables.study_file import read_study

    options = options or StudyOptions()
    path = file_of(file, "a study")
    read = read_study(path)
    seed = read.seed if options.seed is None else options.seed
    samples = read.samples if options.samples is None else options.samples
    if samples < 1 or seed < 0 or options.workers < 1:
        raise ValueError("--samples and --workers take a number from 1, --seed one from 0")
    task, files, words = _task(read, path.parent, seed)
    told = provenance(files, options)
    kept = {"schema_version": SCHEMA_VERSION, "version": told["version"], "seed": seed}
    with tempfile.TemporaryDirectory() as own:
        folder = Path(options.results or own)
        with _claimed(folder, {**kept, "inputs": [*map(sha256, files)]}):
            run_study(task, samples, folder, options.workers, executor)
        parts = read_parts(task, samples, folder)
        common: dict[str, Any] = {"samples": samples, "seed": seed, "warnings": words}
        if read.machine is not None:
            from rotorid.study.machine_counts import count_machines

            planes, most = len(read.machine.planes), read.machine.corrections
            machines = StudiedMachines(**common, **count_machines(parts, planes, most))
            return outcome_of(machines, told, title="Study of machines")
        from rotorid.study.calibration_starts import count_minima

        starts = StudiedStarts(**common, **count_minima(parts, tuple(task.columns)[2:]))
        return outcome_of(starts, told, title="Study of starts")


def _task(read: StudyFile, folder: Path, seed: int) -> tuple[Task, list[Path], tuple[str, ...]]:
    """What the workers get, all files that were read, and what is to be known of them."""
    from rotorid.study.chunks import Task

    if read.machine is not None:
        from rotorid.study.drawn_machine import draw_machine, nominal

        ratios = {f"ratio_{k}": "double" for k in range(read.machine.corrections + 1)}
        columns = {**ratios, "runs_needed": "int32", "held": "bool", "warned": "bool", "why": "string"}
        coefficients, words = nominal(read.machine)
        machine = read.machine, coefficients
        return Task(draw_machine, machine, seed, columns, MACHINES), [*read.files], words
    from rotorid.commands.calibrate import CalibrateOptions, prepared
    from rotorid.study.calibration_starts import draw_start

    said = dict(read.calibrate)
    data = [folder / name for name in said.pop("data")]
    given = prepared(read.rotor_file, data, CalibrateOptions(**said))
    labels = [number.label for number in given.numbers]
    if taken := {"sample", "converged", "chi_square"}.intersection(labels):
        raise ValueError(f"calibrate.estimate: {taken.pop()!r} is another column of the samples: rename it")
    columns = {"converged": "bool", "chi_square": "double", **dict.fromkeys(labels, "double")}
    files = [*read.files, *given.data_files]
    return Task(draw_start, given, seed, columns, STARTS), files, ()


@contextmanager
def _claimed(folder: Path, study: dict[str, Any]) -> Iterator[None]:
    """Say in the folder which study it holds; refuse one that holds another, or is being written."""
    manifest, lock = folder / MANIFEST, folder / LOCK
    new = manifest.with_suffix(".tmp")
    told = json.dumps(study, indent=1).encode()
    folder.mkdir(parents=True, exist_ok=True)
    if not manifest.exists() and any(file not in (new, lock) for file in folder.iterdir()):
        raise ValueError(f"{folder}: no study is kept here, but other files: name another folder")
    with closing(sqlite3.connect(lock, timeout=0, isolation_level=None)) as held:
        try:
            held.execute("BEGIN EXCLUSIVE")  # until it is closed, or the process ends
        except sqlite3.OperationalError as error:
            busy = error.sqlite_errorcode == sqlite3.SQLITE_BUSY
            why = "a study is running here: wait for its end" if busy else f"cannot be written ({error})"
            raise ValueError(f"{folder}: {why}, or name another folder") from error
        if not manifest.exists():
            new.write_bytes(told)
            new.replace(manifest)
        elif manifest.read_bytes() != told:
            raise ValueError(
                f"{folder}: another study is kept here (its file, its rotor, the seed or the version of "
                "rotorid differs): name another folder"
            )
        yield
