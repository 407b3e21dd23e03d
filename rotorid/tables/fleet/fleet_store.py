"""The store of a fleet: a folder of Parquet tables, FLEET/TABLE/NUMBER.parquet, a number a batch of jobs.

A batch is there as soon as its table `jobs` is, which is renamed last. Writers take turns by a lock that the
system takes away from one that is killed; the next removes what that has left.
"""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Collection, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing import Labels, Trials
from rotorid.base.complex_numbers import polar
from rotorid.tables.fleet.fleet_tables import TABLES, VERSION, Columns, JobRows, arrow, arrow_table

if TYPE_CHECKING:
    import pandas as pd

LONGEST_WAIT = 600.0
"""Seconds for the batch of another writer."""
_SI = {"displacement": "m", "velocity": "m_s", "acceleration": "m_s2"}


@dataclass(frozen=True)
class FleetStore:
    """Tables of the jobs of many machines, in a folder that is made with the first batch."""

    folder: Path

    def check(self, *, new: bool = False) -> None:
        """ValueError for a folder that is no store; `new`: one that is not there, or empty, becomes one."""
        arrow()
        there = self.folder.exists()
        if not there and not new:
            raise ValueError(f"{self.folder}: there is no such fleet; `rotorid fleet add` makes one")
        other = there and (not self.folder.is_dir() or any(self.folder.glob("[!.]*")) or not new)
        if other and not (self.folder / "jobs").is_dir():
            raise ValueError(f"{self.folder}: this is no fleet, which has a folder jobs; name a new folder")

    def batches(self) -> list[str]:
        """Numbers of the batches that are whole, in the order in which they were added."""
        files = (self.folder / "jobs").glob("*.parquet")
        return sorted(file.stem for file in files if file.stem.isdecimal())

    def files(self, *names: str) -> list[Path]:
        """The files of these tables."""
        return [self._file(name, batch) for name in names for batch in self.batches()]

    def known(self) -> set[str]:
        """Ids of the jobs that have been added so far."""
        tables = (self._read("jobs", batch, columns=["job"]) for batch in self.batches())
        return {job for table in tables for job in table["job"].to_pylist()}

    def append(self, jobs: Sequence[JobRows]) -> list[Columns]:
        """Add different jobs: all or nothing; gives what the table `jobs` has of those that were new."""
        (self.folder / "jobs").mkdir(parents=True, exist_ok=True)
        with self._alone():
            self._remove_leftovers()
            known = self.known()
            new = [job for job in jobs if job["jobs"][0]["job"][0] not in known]
            batch = f"{max(map(int, self.batches()), default=0) + 1:06d}"
            for name in TABLES if new else ():
                (self.folder / name).mkdir(exist_ok=True)
                table = arrow_table(name, [part for job in new for part in job.get(name, ())])
                with self._file(name, f".{batch}", ".tmp").open("wb") as file:
                    arrow().parquet.write_table(table, file, compression="zstd", write_page_checksum=True)
            for name in TABLES if new else ():
                os.replace(self._file(name, f".{batch}", ".tmp"), self._file(name, batch))
        return [job["jobs"][0] for job in new]

    def table(
        self,
        name: str,
        *,
        jobs: Collection[str] | None = None,
        machine_type: str | None = None,
        columns: Sequence[str] | None = None,
    ) -> pd.DataFrame:
        """Rows of one of `TABLES`, those of superseded jobs left out; only of these jobs, and of this type.

        ValueError for a table that is damaged, and for a store that a newer version has written.
        """
        import pandas as pd

        read = [self._read("jobs", batch).to_pandas().assign(batch=batch) for batch in self.batches()]
        found: pd.DataFrame = pd.concat(read or [arrow_table("jobs", []).to_pandas().assign(batch="")])
        found = found.drop_duplicates(["machine", "path"], keep="last")
        if jobs is not None:
            found = found[found["job"].isin(list(jobs))]
        if machine_type is not None:
            found = found[found["machine_type"] == machine_type]
        wanted = list(columns or TABLES[name])
        if name != "jobs":
            parts = [
                self._read(name, str(batch), columns=wanted, filters=[("job", "in", list(part))])
                for batch, part in found.groupby("batch")["job"]
            ]
            found = arrow().concat_tables([arrow_table(name, []).select(wanted), *parts]).to_pandas()
        return found.reset_index(drop=True)[wanted]

    def _file(self, name: str, batch: str, ending: str = ".parquet") -> Path:
        return self.folder / name / f"{batch}{ending}"

    def _read(self, name: str, batch: str, **how: Any) -> Any:  # noqa: ANN401 - as pyarrow takes and gives it
        """One table of one batch."""
        path = self._file(name, batch)
        with path.open("rb") as file:  # by name, a colon would make it an address
            try:
                table = arrow().parquet.read_table(file, page_checksum_verification=True, **how)
            except (arrow().ArrowInvalid, OSError) as error:
                raise ValueError(
                    f"{path}: expected a whole Parquet table; remove the batch and add it again"
                ) from error
        version = (table.schema.metadata or {}).get(b"schema_version", b"").decode()
        if version != VERSION:
            raise ValueError(f"{path}: expected tables of version {VERSION}, not {version!r}: update rotorid")
        return table

    def _alone(self) -> closing[sqlite3.Connection]:
        """Hold the lock of the store: SQLite has one on every system, and no other part here."""
        try:
            lock = sqlite3.connect(self.folder / ".lock", timeout=LONGEST_WAIT, isolation_level=None)
            lock.execute("BEGIN EXCLUSIVE")
        except sqlite3.Error as error:
            raise ValueError(f"{self.folder}: cannot be written: {error}") from error
        return closing(lock)

    def _remove_leftovers(self) -> None:
        """Remove tables of batches that are not whole; files of others are left alone."""
        whole = self.batches()
        for path in (path for name in TABLES for path in (self.folder / name).glob("*")):
            ours = path.suffix in (".parquet", ".tmp") and path.stem.removeprefix(".").isdecimal()
            if ours and path.stem not in whole:
                path.unlink()


def trials_of(store: FleetStore, job: str) -> Trials:
    """The trial runs of a job as they were read, in SI; ValueError where it is not there, or superseded."""
    import pandas as pd

    jobs, readings, weights = (store.table(name, jobs=[job]) for name in ("jobs", "readings", "weights"))
    if jobs.empty:
        raise ValueError(f"{store.folder}: there is no job {job!r}, or a newer one stands in its place")
    readings, weights = (frame[frame["kind"] == "trial"] for frame in (readings, weights))
    places = ["repeat", "run", "speed_rad_s", "sensor"]
    axes = [readings[name].unique() for name in places]
    shape = [len(axis) for axis in axes]
    _, runs, speeds, sensors = axes
    # NaN where a reading was repeated fewer times
    full = readings.set_index(places).reindex(pd.MultiIndex.from_product(axes))
    covariance = None
    if readings["std_re"].notna().all():
        re, im, both = full["std_re"] ** 2, full["std_im"] ** 2, full["cov_re_im"]
        covariance = np.array([[re, both], [both, im]]).reshape(2, 2, *shape)
    mounted = polar(weights["weight"], np.radians(weights["angle_deg"]))
    vibration = _SI.get(jobs["quantity"][0], jobs["vibration_unit"][0])
    weight = "kg_m" if jobs["weight_kind"][0] == "unbalance" else "kg"
    return Trials(
        runs=tuple(runs),
        speeds=speeds,
        sensors=tuple(sensors),
        planes=tuple(weights["plane"].unique()),
        readings=polar(full["amplitude"], np.radians(full["phase_deg"])).reshape(shape),
        weights=mounted.reshape(len(runs), -1),
        covariance=covariance,
        labels=Labels(vibration_unit=vibration, weight_unit=weight),
    )
