"""`fleet add`: jobs of folder trees into the store of a fleet, read in this process or in several."""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterator, Sequence
from concurrent.futures import BrokenExecutor
from contextvars import Context
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from rotorid.base.answer import Answer, Answered
from rotorid.base.logs import progress
from rotorid.base.result import Column, frame, rows
from rotorid.base.text import counted
from rotorid.base.worker_processes import single_threads, worker_pool
from rotorid.report.outcome import Outcome, command, outcome_of, provenance

if TYPE_CHECKING:
    import pandas as pd

    from rotorid.tables import Job
    from rotorid.tables.fleet.fleet_store import FleetStore
    from rotorid.tables.fleet.fleet_tables import Columns, JobRows
    from rotorid.tables.fleet.job_search import FoundJob

BATCH = 200_000
"""Readings that are written together."""
CHUNK, UNDER_WAY = 4, 512
"""Jobs that a process reads before it gives them back, and that all are given at once."""


@dataclass(frozen=True)
class FleetAddOptions:
    """Options of `fleet add`.

    Attributes
    ----------
    machine_type : --type NAME
        Of the jobs that do not say it; default: the first folder below TREE, of those two folders deep.
    workers : N from 1
        Processes that read; 2 and more for hundreds of jobs.
    """

    machine_type: str | None = None
    workers: int = 1
    to: ClassVar[Sequence[str]] = ("table", "json")


@dataclass(frozen=True, eq=False, kw_only=True)
class FleetAdded(Answered):
    """How many jobs and vectors were added, how many jobs were known; files that cannot be read, and why."""

    store: FleetStore
    jobs: int
    vectors: int
    known: int
    untyped: int
    damaged: dict[Path, str]

    def _columns(self) -> tuple[Column, ...]:
        files = [str(file) for file in self.damaged]
        return Column("file", files), Column("reason", list(self.damaged.values()))

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; `tables` are the folders of the store's tables."""
        from rotorid.tables.fleet.fleet_tables import TABLES

        return {
            "jobs": self.jobs,
            "vectors": self.vectors,
            "known": self.known,
            "untyped": self.untyped,
            "damaged": rows(self._columns()),
            "tables": {name: str(self.store.folder / name) for name in TABLES},
        }

    def to_frame(self) -> pd.DataFrame:
        """Files that cannot be read."""
        return frame(self._columns())

    @property
    def answer(self) -> Answer:
        """The numbers, then each file that cannot be read."""
        from rotorid.files.problems import printable

        new = f"{counted(self.jobs, 'job')} with {counted(self.vectors, 'vector')}"
        head = f"Added {new} to {self.store.folder}; {counted(self.known, 'job')} known already."
        if self.damaged:
            head += f" {counted(len(self.damaged), 'file')} cannot be read:"
        told = [f"{printable(str(file))}: {reason}" for file, reason in self.damaged.items()]
        untyped = f"{counted(self.untyped, 'job')} without a type: machine_type in the job, or --type"
        told.append(f"What is in it: rotorid fleet show {self.store.folder}")
        return Answer(head, "\n".join(told), notes=(untyped,) if self.untyped else ())


@command
def fleet_add(
    fleet: Path | str, trees: Sequence[Path | str], options: FleetAddOptions | None = None
) -> Outcome:
    """Add the jobs of folder trees to the tables; what is known already stays as it is.

    Example: rotorid fleet add fans sample_data/fleet

    Parameters
    ----------
    fleet : FLEET
        Folder of the tables of the fleet.
    trees : TREE…
        Folders with jobs (.toml, .xlsx) at any depth, or jobs.
    options
        See there.

    Raises
    ------
    ValueError
        Where nothing can be read, and for a folder that is something else.
    """
    from rotorid.tables.fleet.fleet_store import FleetStore
    from rotorid.tables.fleet.job_search import find_jobs

    options = options or FleetAddOptions()
    store = FleetStore(Path(fleet))
    store.check(new=True)
    # apart from what the command keeps of files that it reads: those of a whole tree would fill the memory
    found, damaged = Context().run(find_jobs, [Path(tree) for tree in trees], options.machine_type)
    seen = store.known()
    new = [job for job in found if not seen or Context().run(job.quick_id) not in seen]
    batch: list[JobRows] = []
    added: list[Columns] = []
    waiting = 0
    begun = time.monotonic()
    for count, (job, read) in enumerate(zip(new, read_jobs(new, options.workers), strict=True), 1):
        if isinstance(read, str):
            damaged[job.file] = read
        elif (own := read["jobs"][0])["job"][0] not in seen:
            seen.add(own["job"][0])
            batch.append(read)
            waiting += own["vectors"][0]
        left = (time.monotonic() - begun) / count * (len(new) - count)
        progress.info("%d of %d, %.0f s left", count, len(new), left)
        if batch and (waiting >= BATCH or count == len(new)):
            added += store.append(batch)
            batch, waiting = [], 0
    known = len(found) - sum(job.file in damaged for job in found) - len(added)
    if not added and not known:
        what = ", ".join(map(str, trees))
        raise ValueError(
            "nothing could be read:\n" + "\n".join(damaged.values())
            if damaged
            else f"{what}: there is no balancing job in it (.toml with runs, or .xlsx with a sheet runs)"
        )
    return outcome_of(
        FleetAdded(
            store=store,
            jobs=len(added),
            vectors=sum(own["vectors"][0] for own in added),
            known=known,
            untyped=sum(not own["machine_type"][0] for own in added),
            damaged=damaged,
        ),
        provenance((), options, fleet=str(fleet), trees=[str(tree) for tree in trees]),
    )


def read_jobs(found: Sequence[FoundJob], workers: int) -> Iterator[JobRows | str]:
    """Of each job its rows by table, or why there are none; what was read of it is not kept."""
    if workers == 1:
        yield from (Context().run(_read, job) for job in found)
        return
    try:
        with single_threads(), worker_pool(workers) as pool:
            for k in range(0, len(found), UNDER_WAY):
                yield from pool.map(_read, found[k : k + UNDER_WAY], chunksize=CHUNK)
    except BrokenExecutor as error:
        raise ValueError(
            "a process that reads jobs has died; the memory may be too small for so many workers: add the "
            "rest with fewer"
        ) from error


def _read(found: FoundJob) -> JobRows | str:
    from rotorid.files.input_file import each_file_once
    from rotorid.tables import read_job
    from rotorid.tables.fleet.job_search import reason_of

    try:
        with each_file_once(), warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            return _rows(found, read_job(found.file), caught)
    except (ValueError, OSError, ArithmeticError, MemoryError) as error:
        return reason_of(error)


def _rows(found: FoundJob, job: Job, caught: Sequence[warnings.WarningMessage]) -> JobRows:
    """Rows of a job with its coefficients, and what `correct` proposes where that was mounted."""
    from balancing import estimate_influence
    from rotorid.files.input_file import sha256
    from rotorid.fleet.job_records import job_rows, kind_of
    from rotorid.fleet.proposals import pieces_mounted, proposed
    from rotorid.tables.fleet.job_search import job_id

    influence, trials, check, labels = job.influence, job.trials, job.check, job.trials.labels
    before = mounted = None
    undetermined = refused = ""
    try:
        influence = influence or estimate_influence(trials)
    except ValueError as error:
        undetermined = str(error)
    if influence is not None and check is not None:
        runs = None if job.influence is None else trials
        try:
            before = (influence if runs is None else influence.rebased(runs)).baseline
            if not job.check_mounted:
                correction = proposed(job, influence, runs)
                pieces = pieces_mounted(job, correction, influence, runs)
                mounted = correction.planes, (pieces or correction).weights
        except ValueError as error:
            refused = f"no corrections are proposed: {error}"
    told = [str(one.message).encode(errors="replace").decode() for one in caught]  # of any names of files
    said = [*(trials.warnings if influence is None else influence.remarks.warnings), *told]
    said += [labels.assumed_in_words(), refused]
    files = [sha256(file) for file in job.files]
    quantity, weight_kind = kind_of(labels)
    own = {
        "job": job_id(files),
        "path": found.path,
        "machine": job.machine or found.machine,
        "machine_type": job.machine_type or found.machine_type,
        "date": job.date or found.date,
        "quantity": quantity,
        "weight_kind": weight_kind,
        "vibration_unit": labels.vibration_unit,
        "weight_unit": labels.weight_unit,
        "files": files,
        "runs_file": sha256(found.tables.get("runs", found.file)),
        "warnings": list(dict.fromkeys(filter(None, said))),
        "trial_runs": len(trials.runs),
        "check_runs": 0 if check is None else len(check.runs),
        "vectors": sum(int(runs.repeats.sum()) for runs in (trials, check) if runs is not None),
        "undetermined": undetermined,
    }
    return job_rows(job, own, influence, mounted, before)
