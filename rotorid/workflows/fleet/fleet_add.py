"""`fleet add`: jobs of folder trees into the store of a fleet."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorid.base.answer import Answer
from rotorid.base.logs import progress
from rotorid.base.result import Column, frame, rows
from rotorid.base.text import counted
from rotorid.workflows.fleet.job_batches import apart, read_jobs, reason_of
from rotorid.workflows.result_provenance import Outcome, provenance, workflow

if TYPE_CHECKING:
    import pandas as pd

    from rotorid.tables.fleet.fleet_store import FleetStore
    from rotorid.tables.fleet.fleet_tables import JobRows
    from rotorid.tables.fleet.job_search import FoundJob

BATCH = 200_000
"""Readings that are written together."""
Damaged = dict[Path, str]


@dataclass(frozen=True)
class FleetAddOptions:
    """Options of `fleet add`.

    Attributes
    ----------
    machine_type : NAME
        Of the jobs that do not say it; default: the first folder below TREE, of those two folders deep.
    workers : N
        Processes that read; 2 and more for hundreds of jobs.
    """

    machine_type: str | None = None
    workers: int = 1


@dataclass(frozen=True, eq=False, kw_only=True)
class FleetAdded(Outcome):
    """How many jobs and vectors were added, how many jobs were known; files that cannot be read, and why."""

    store: FleetStore
    jobs: int
    vectors: int
    known: int
    untyped: int
    damaged: Damaged

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
        from rotorid.tables.reader.problems import printable

        new = f"{counted(self.jobs, 'job')} with {counted(self.vectors, 'vector')}"
        head = f"Added {new} to {self.store.folder}; {counted(self.known, 'job')} known already."
        if self.damaged:
            head += f" {counted(len(self.damaged), 'file')} cannot be read:"
        told = [f"{printable(str(file))}: {reason}" for file, reason in self.damaged.items()]
        untyped = f"{counted(self.untyped, 'job')} without a type: machine_type in the job, or --type"
        told.append(f"What is in it: rotorid fleet show {self.store.folder}")
        return Answer(head, "\n".join(told), notes=(untyped,) if self.untyped else ())


@workflow
def fleet_add(
    fleet: Path | str, trees: Sequence[Path | str], options: FleetAddOptions | None = None
) -> FleetAdded:
    """Add the jobs of folder trees to a store, a batch after the other.

    Parameters
    ----------
    fleet
        The folder of the store; it is made where there is none.
    trees
        Folders with jobs, at any depth, or jobs.
    options
        See there.

    Raises
    ------
    ValueError
        Where nothing can be read, and for a folder that is something else.
    """
    from rotorid.tables.fleet.fleet_store import FleetStore

    options = options or FleetAddOptions()
    store = FleetStore(Path(fleet))
    store.check(new=True)
    found, damaged = _found([Path(tree) for tree in trees], options.machine_type or "")
    seen = store.known()
    new = [job for job in found if not seen or not _is_known(job, seen)]
    batch: list[JobRows] = []
    jobs = vectors = waiting = untyped = 0
    unread: Damaged = {}
    begun = time.monotonic()
    for count, read in enumerate(read_jobs(new, options.workers), 1):
        if read.rows is None:
            unread[read.found.file] = read.reason
        elif (own := read.rows["jobs"][0])["job"][0] not in seen:
            seen.add(own["job"][0])
            batch.append(read.rows)
            waiting += own["vectors"][0]
            untyped += not own["machine_type"][0]
        left = (time.monotonic() - begun) / count * (len(new) - count)
        progress.info("%d of %d, %.0f s left", count, len(new), left)
        if batch and (waiting >= BATCH or count == len(new)):
            jobs += store.append(batch)
            batch, vectors, waiting = [], vectors + waiting, 0
    known = len(found) - len(unread) - jobs
    if not jobs + known:
        raise ValueError(_nothing(trees, damaged | unread))
    return FleetAdded(
        store=store,
        jobs=jobs,
        vectors=vectors,
        known=known,
        untyped=untyped,
        damaged=damaged | unread,
        provenance=provenance((), options, fleet=str(fleet), trees=[str(tree) for tree in trees]),
    )


def _found(trees: Sequence[Path], machine_type: str) -> tuple[list[FoundJob], Damaged]:
    """Jobs of trees, and files of which nobody can say what they are; workbooks that jobs name are none."""
    from rotorid.tables.fleet.job_search import found_job, job_files
    from rotorid.tables.reader.excel_workbook import is_workbook

    found: dict[Path, FoundJob] = {}
    damaged: Damaged = {}
    closed: list[OSError] = []
    for tree in trees:
        for file in job_files(tree, closed.append):
            try:
                job = apart(found_job, file, tree, machine_type)
            except (OSError, ValueError) as error:
                damaged[file] = reason_of(error)
                continue
            if job is not None:
                found.setdefault(file.resolve(), job)
    places: dict[tuple[str, str], FoundJob] = {}
    for file, job in list(found.items()):
        other = places.setdefault((job.machine, job.path), job)
        if other is not job and not _same(job, other):
            damaged[found.pop(file).file] = (
                f"{other.file} is another job at the same place below its tree, of the same machine: "
                "add the folder above both, or say `machine` in them"
            )
    damaged |= {Path(error.filename): reason_of(error) for error in closed}
    tables = (table for job in found.values() for table in job.tables.values())
    named = {table.resolve() for table in tables if is_workbook(table)}
    return [job for file, job in found.items() if file not in named], damaged


def _is_known(job: FoundJob, seen: set[str]) -> bool:
    try:
        return apart(job.quick_id) in seen
    except (OSError, ValueError):  # reading says it better
        return False


def _same(job: FoundJob, other: FoundJob) -> bool:
    try:
        return bool(apart(job.quick_id) == apart(other.quick_id))
    except (OSError, ValueError):  # reading says it better
        return True


def _nothing(trees: Sequence[Path | str], damaged: Damaged) -> str:
    if damaged:
        return "nothing could be read:\n" + "\n".join(damaged.values())
    what = ", ".join(map(str, trees))
    return f"{what}: there is no balancing job in it (.toml with runs, or .xlsx with a sheet runs)"
