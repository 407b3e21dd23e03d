"""`study`: what becomes of many drawn machines, or of many starts of a calibration, on any executor."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorid.base.versions import SCHEMA_VERSION
from rotorid.workflows.input_checks import file_of
from rotorid.workflows.result_provenance import hash_of, phase, provenance, workflow
from rotorid.workflows.studies.study_result import StudiedMachines, StudiedStarts

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from rotorid.base.arrays import AnyArray
    from rotorid.tables.study_file import StudyFile
    from rotorid.workflows.studies.chunks import Task

MACHINES, STARTS = 250, 8
"""Samples in a file: some seconds of work."""
MANIFEST = "_study.json"  # with _: who reads the folder as a table passes it over


@dataclass(frozen=True)
class StudyOptions:
    """Options of `study`.

    Attributes
    ----------
    samples : N
        How many, in place of what the file says; a finished study is continued with more.
    seed : N
        In place of what the file says.
    workers : N
        Processes on this machine.
    results : FOLDER
        For the samples, as Parquet; a study that was broken off there is continued.
    """

    samples: int | None = None
    seed: int | None = None
    workers: int = 1
    results: Path | str | None = None


@workflow
def study(
    file: Path | str, options: StudyOptions | None = None, executor: Executor | None = None
) -> StudiedMachines | StudiedStarts:
    """Draw samples, each by its number, and count what becomes of them.

    Parameters
    ----------
    file
        A study file.
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
        raise ValueError(f'a study needs {error.name}: pip install "rotorid[fleet]"') from error
    from rotorid.tables.study_file import read_study
    from rotorid.workflows.studies.chunks import run_study

    options = options or StudyOptions()
    path = file_of(file, "a study")
    read = read_study(path)
    seed = read.seed if options.seed is None else options.seed
    samples = read.samples if options.samples is None else options.samples
    if samples < 1 or seed < 0 or options.workers < 1:
        raise ValueError("--samples and --workers take a number from 1, --seed one from 0")
    task, files, words = _task(read, path.parent, seed)
    told = provenance(files, options)
    with ExitStack() as stack:
        folder = Path(options.results or stack.enter_context(tempfile.TemporaryDirectory()))
        kept = {"schema_version": SCHEMA_VERSION, "version": told["version"], "seed": seed}
        _claim(folder, {**kept, "inputs": [*map(hash_of, files)]})
        with phase("samples"):
            run_study(task, samples, folder, options.workers, executor)
        parts = _parts(task, samples, folder)
        common: dict[str, Any] = {"samples": samples, "seed": seed, "warnings": words, "provenance": told}
        if read.machine is not None:
            from rotorid.workflows.studies.machine_counts import count_machines

            found = count_machines(parts, len(read.machine.planes), read.machine.corrections)
            return StudiedMachines(**common, **found)
        from rotorid.workflows.studies.calibration_starts import count_minima

        return StudiedStarts(**common, **count_minima(parts, tuple(task.columns)[2:]))


def _task(read: StudyFile, folder: Path, seed: int) -> tuple[Task, list[Path], tuple[str, ...]]:
    """What the workers get, all files that were read, and what is to be known of them."""
    from rotorid.workflows.studies.chunks import Task

    if read.machine is not None:
        from rotorid.workflows.studies.drawn_machine import draw_machine, ready

        ratios = {f"ratio_{k}": "double" for k in range(read.machine.corrections + 1)}
        columns = {**ratios, "runs_needed": "int32", "held": "bool", "warned": "bool", "why": "string"}
        machines = ready(read.machine)
        return Task(draw_machine, machines, seed, columns, MACHINES), [*read.files], machines.warnings
    from rotorid.workflows.calibration.calibrate import CalibrateOptions, prepared
    from rotorid.workflows.studies.calibration_starts import draw_start

    assert read.calibrate is not None
    said = dict(read.calibrate)
    data = [folder / name for name in said.pop("data")]
    given = prepared(read.rotor_file, data, CalibrateOptions(**said))
    columns = {"converged": "bool", "chi_square": "double"}
    columns |= dict.fromkeys((number.label for number in given.numbers), "double")
    files = [*read.files, *given.data_files]
    return Task(draw_start, given, seed, columns, STARTS), files, tuple(given.assumed)


def _claim(folder: Path, told: dict[str, Any]) -> None:
    """Say in the folder which study it holds.

    Raises
    ------
    ValueError
        For a folder that holds another one, or something else.
    """
    manifest, new = folder / MANIFEST, (folder / MANIFEST).with_suffix(".tmp")
    folder.mkdir(parents=True, exist_ok=True)
    if manifest.exists():
        if json.loads(manifest.read_text(encoding="utf-8")) != told:
            raise ValueError(
                f"{folder}: another study is kept here (its file, its rotor, the seed or the version of "
                "rotorid differs): name another folder"
            )
        return
    if any(file != new for file in folder.iterdir()):
        raise ValueError(f"{folder}: no study is kept here, but other files: name another folder")
    new.write_text(json.dumps(told, indent=1), encoding="utf-8")
    new.replace(manifest)


def _parts(task: Task, samples: int, folder: Path) -> Iterator[dict[str, AnyArray]]:
    """Columns of one part after the other; NaN or None where there is nothing."""
    import pyarrow.parquet as pq

    from rotorid.workflows.studies.chunks import part

    for first in range(0, samples, task.chunk):
        last = min(first + task.chunk, samples)
        with part(folder, task, (first, last)).open("rb") as file:
            table = pq.read_table(file).slice(0, last - first)
        yield {name: table[name].to_numpy(zero_copy_only=False) for name in table.column_names}
