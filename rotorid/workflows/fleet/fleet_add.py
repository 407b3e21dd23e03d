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
from rotorid.workflows.fleet.job_batches import apart, read_jobs
from rotorid.workflows.result_provenance import Outcome, provenance, workflow

if TYPE_CHECKING:
    import pandas as pd

    from rotorid.tables.fleet.fleet_store import FleetStore
    from rotorid.tables.fleet.fleet_tables import Columns, JobRows

BATCH = 200_000
"""Readings that are written together."""


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
    from rotorid.tables.fleet.job_search import find_jobs

    options = options or FleetAddOptions()
    store = FleetStore(Path(fleet))
    store.check(new=True)
    found, damaged = apart(find_jobs, [Path(tree) for tree in trees], options.machine_type or "")
    seen = store.known()
    new = [job for job in found if not seen or apart(job.quick_id) not in seen]
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
    return FleetAdded(
        store=store,
        jobs=len(added),
        vectors=sum(own["vectors"][0] for own in added),
        known=known,
        untyped=sum(not own["machine_type"][0] for own in added),
        damaged=damaged,
        provenance=provenance((), options, fleet=str(fleet), trees=[str(tree) for tree in trees]),
    )
