"""The store of a fleet: a folder of Parquet tables, FLEET/TABLE/NUMBER.parquet, a number a batch of jobs.

A batch is there as soon as its table `jobs` is, which is renamed last. Writers take turns by a lock that the
system takes away from one that is killed; the next removes what that has left.
"""

from __future__ import annotations

import contextlib
import os
import sqlite3
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.data.conventions import Labels, polar
from balancing.data.trials import Trials
from rotorid.tables.fleet.fleet_tables import TABLES, VERSION, JobRows, arrow, arrow_table

if TYPE_CHECKING:
    import pandas as pd

LONGEST_WAIT = 600.0
"""Seconds for the batch of another writer."""
_BATCH = "batch"
_SI = {"displacement": "m", "velocity": "m_s", "acceleration": "m_s2"}


@dataclass(frozen=True)
class FleetStore:
    """Tables of the jobs of many machines.

    Attributes
    ----------
    folder
        It is made with the first batch.
    """

    folder: Path

    def check(self, *, new: bool = False) -> None:
        """Refuse a folder that is no store; `new`: one that is not there, or empty, becomes one.

        Raises
        ------
        ValueError
            Saying what it is.
        """
        arrow()
        there = self.folder.exists()
        if not there and not new:
            raise ValueError(f"{self.folder}: there is no such fleet; `rotorid fleet add` makes one")
        other = there and (not self.folder.is_dir() or any(self.folder.glob("[!.]*")) or not new)
        if other and not (self.folder / "jobs").is_dir():
            raise ValueError(f"{self.folder}: this is no fleet, which has a folder jobs; name a new folder")

    def batches(self) -> list[str]:
        """Numbers of the batches that are whole, in the order in which they were added."""
        return sorted(path.stem for path in (self.folder / "jobs").glob("[0-9]*.parquet") if _is_ours(path))

    def files(self, *names: str) -> list[Path]:
        """The files of these tables."""
        return [self._file(name, batch) for name in names for batch in self.batches()]

    def known(self) -> set[str]:
        """Ids of the jobs that have been added so far."""
        tables = (self._read("jobs", batch, columns=["job"]) for batch in self.batches())
        return {job for table in tables for job in table["job"].to_pylist()}

    def append(self, jobs: Sequence[JobRows]) -> int:
        """Add different jobs: all or nothing; gives the number of those that were new.

        Raises
        ------
        OSError
            Where it cannot be written.
        """
        pa = arrow()
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
                    pa.parquet.write_table(table, file, compression="zstd")
            for name in TABLES if new else ():
                os.replace(self._file(name, f".{batch}", ".tmp"), self._file(name, batch))
        return len(new)

    def table(
        self,
        name: str,
        *,
        jobs: Collection[str] | None = None,
        machine_type: str | None = None,
        columns: Sequence[str] | None = None,
    ) -> pd.DataFrame:
        """Rows of a table, those of superseded jobs left out.

        Parameters
        ----------
        name
            One of `TABLES`.
        jobs, machine_type
            Only those of these jobs, and of this type.
        columns
            Only these; default: all.

        Raises
        ------
        ValueError
            For a store that a newer version has written.
        """
        import pandas as pd

        batches = [
            self._read("jobs", batch).to_pandas().assign(**{_BATCH: batch}) for batch in self.batches()
        ]
        own: pd.DataFrame = pd.concat(batches) if batches else arrow_table("jobs", []).to_pandas()
        own = own.drop_duplicates(["machine", "path"], keep="last", ignore_index=True)
        if jobs is not None:
            own = own[own["job"].isin(list(jobs))]
        if machine_type is not None:
            own = own[own["machine_type"] == machine_type]
        if name == "jobs" or own.empty:
            there = own if name == "jobs" else arrow_table(name, []).to_pandas()
            return there.reset_index(drop=True)[list(columns or TABLES[name])]
        parts = [
            self._read(name, str(batch), columns=columns, filters=[("job", "in", list(part))])
            for batch, part in own.groupby(_BATCH)["job"]
        ]
        found: pd.DataFrame = arrow().concat_tables(parts).to_pandas()
        return found

    def _file(self, name: str, batch: str, ending: str = ".parquet") -> Path:
        return self.folder / name / f"{batch}{ending}"

    def _read(self, name: str, batch: str, **how: Any) -> Any:  # noqa: ANN401 - as pyarrow takes and gives it
        """One table of one batch."""
        path = self._file(name, batch)
        try:
            with path.open("rb") as file:  # by name, a colon would make it an address
                table = arrow().parquet.read_table(file, **how)
        except arrow().ArrowInvalid as error:
            raise ValueError(
                f"{path}: expected a whole Parquet table; remove the batch and add it again"
            ) from error
        version = (table.schema.metadata or {}).get(b"schema_version", b"").decode()
        if version != VERSION:
            raise ValueError(f"{path}: expected tables of version {VERSION}, not {version!r}: update rotorid")
        return table

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """Hold the lock of the store: SQLite has one on every system, and no other part here."""
        try:
            lock = sqlite3.connect(self.folder / ".lock", timeout=LONGEST_WAIT, isolation_level=None)
            lock.execute("BEGIN EXCLUSIVE")
        except sqlite3.Error as error:
            raise ValueError(f"{self.folder}: cannot be written: {error}") from error
        with contextlib.closing(lock):
            yield

    def _remove_leftovers(self) -> None:
        whole = self.batches()
        for path in (path for name in TABLES for path in (self.folder / name).glob("*")):
            if _is_ours(path) and path.stem not in whole:
                path.unlink()


def _is_ours(path: Path) -> bool:
    """Whether a file is a table of a batch, or one that was being written; others are left alone."""
    return path.suffix in (".parquet", ".tmp") and path.stem.removeprefix(".").isdecimal()


def trials_of(store: FleetStore, job: str) -> Trials:
    """The trial runs of a job as they were read, in SI.

    Raises
    ------
    ValueError
        For a job that the store has not, or that was superseded.
    """
    jobs, readings, weights = (store.table(name, jobs=[job]) for name in ("jobs", "readings", "weights"))
    if jobs.empty:
        raise ValueError(f"{store.folder}: there is no job {job!r}, or a newer one stands in its place")
    readings, weights = (frame[frame["kind"] == "trial"] for frame in (readings, weights))
    (runs, r), (speeds, s), (sensors, c) = (
        _numbered(readings[name]) for name in ("run", "speed_rad_s", "sensor")
    )
    planes, p = _numbered(weights["plane"])
    k = readings["repeat"].to_numpy() - 1
    place = k, r, s, c
    values = np.full((k.max() + 1, len(runs), len(speeds), len(sensors)), np.nan, dtype=complex)
    values[place] = polar(readings["amplitude"], np.radians(readings["phase_deg"]))
    covariance = None
    if readings["std_re"].notna().all():
        covariance = np.full((2, 2, *values.shape), np.nan)
        covariance[0, 0][place], covariance[1, 1][place] = readings["std_re"] ** 2, readings["std_im"] ** 2
        covariance[0, 1][place] = covariance[1, 0][place] = readings["cov_re_im"]
    mounted = np.zeros((len(runs), len(planes)), dtype=complex)
    row = [runs.index(run) for run in weights["run"]]
    mounted[row, p] = polar(weights["weight"], np.radians(weights["angle_deg"]))
    unbalances = jobs["weight_kind"][0] == "unbalance"
    return Trials(
        runs=tuple(runs),
        speeds=np.array(speeds),
        sensors=tuple(sensors),
        planes=tuple(planes),
        readings=values,
        weights=mounted,
        covariance=covariance,
        labels=Labels(
            vibration_unit=_SI.get(jobs["quantity"][0], jobs["vibration_unit"][0]),
            weight_unit="kg_m" if unbalances else "kg",
        ),
    )


def _numbered(column: pd.Series[Any]) -> tuple[list[Any], Any]:
    """Different values in the order in which they come, and the index of each row's."""
    codes, values = column.factorize()
    return list(values), codes
