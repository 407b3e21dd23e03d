"""Records of one type of machines in the store of a fleet, at the same speeds, sensors and planes."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.coefficients.baseline import SPEED_TOLERANCE
from balancing.coefficients.machine_type import MachineRecord, MachineType, fit_type, why_odd
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import counted

if TYPE_CHECKING:
    import pandas as pd

    from rotorid.base.arrays import FloatArray
    from rotorid.tables.fleet.fleet_store import FleetStore

_KIND = ["quantity", "weight_kind"]
_MOST = 20


@dataclass(frozen=True, eq=False)
class Grid:
    """Speeds (rad/s), sensors and planes (none: all); what is read, and what weights are."""

    speeds: FloatArray
    sensors: tuple[str, ...]
    planes: tuple[str, ...]
    quantity: str
    weight_kind: str


@dataclass(frozen=True, eq=False)
class KnownType:
    """A type as the store knows it.

    Attributes
    ----------
    name
        Of the type.
    kind
        Its coefficients.
    jobs
        Rows of the table `jobs` that it is made of or that were found odd, by id.
    grid
        Where.
    reasons
        Of each odd record, what would make it fit; "": not found.
    lacking
        How many jobs of the type have no coefficients there.
    """

    name: str
    kind: MachineType
    jobs: pd.DataFrame
    grid: Grid
    reasons: tuple[str, ...]
    lacking: int

    @property
    def notes(self) -> tuple[str, ...]:
        """What was left out."""
        lacking = f"{counted(self.lacking, 'job')} of {self.name} without all of these coefficients left out"
        few = f"with {counted(len(self.kind.machines), 'machine')} nothing tells an odd one from the others"
        return (lacking,) * bool(self.lacking) + (few,) * bool(np.isinf(self.kind.limit))


def known_type(
    store: FleetStore, name: str, grid: Grid | None = None, without: Collection[str] = ()
) -> KnownType:
    """Coefficients of a type.

    Parameters
    ----------
    store
        The fleet.
    name
        Of the type.
    grid
        Where; None: where most of them are.
    without
        Hashes of files whose jobs are not to count.

    Raises
    ------
    ValueError
        For a type that is not there; UndeterminedError with too few machines.
    """
    from rotorid.tables.fleet.fleet_store import trials_of

    store.check()
    jobs = store.table("jobs", machine_type=name)
    if jobs.empty:
        types = sorted({*store.table("jobs")["machine_type"]} - {""})
        raise ValueError(f"{store.folder}: there is no type {name!r}{did_you_mean(name, types)}")
    jobs = jobs[~jobs["runs_file"].isin(list(without))].set_index("job")
    cells = store.table("coefficients", jobs=list(jobs.index)).join(jobs[_KIND], on="job")
    if grid is None or not grid.planes:
        usual = _usual(cells)
        if grid is None:
            grid = usual
        grid = replace(grid, planes=usual.planes, weight_kind=usual.weight_kind)
    records = _records(cells, dict(jobs["machine"]), grid)
    kind = fit_type(records, grid.speeds, grid.sensors, grid.planes)
    own = jobs.loc[[record.job for record in records]]
    reasons = tuple(
        why_odd(kind, record, trials_of(store, record.job) if own["trial_runs"][record.job] > 1 else None)
        for record, _ in kind.odd
    )
    return KnownType(name, kind, own, grid, reasons, len(jobs) - len(records))


def _records(cells: pd.DataFrame, machine: Mapping[Any, str], grid: Grid) -> list[MachineRecord]:
    """Of each job that has all coefficients of a grid; unknown errors count as none."""
    near = np.abs(cells["speed_rad_s"].to_numpy()[:, None] - grid.speeds)
    s = near.argmin(axis=1)
    there = near[np.arange(len(s)), s] <= SPEED_TOLERANCE * grid.speeds[s]
    there &= cells["sensor"].isin(grid.sensors) & cells["plane"].isin(grid.planes)
    there &= (cells["quantity"] == grid.quantity) & (cells["weight_kind"] == grid.weight_kind)
    part = cells[there].assign(s=s[there])
    part = part.drop_duplicates(["job", "s", "sensor", "plane"])
    shape = len(grid.speeds), len(grid.sensors), len(grid.planes)
    part = part[part.groupby("job")["s"].transform("size") == np.prod(shape)]
    job, ids = part["job"].factorize()
    c, p = (
        part[name].map(list(names).index)
        for name, names in (("sensor", grid.sensors), ("plane", grid.planes))
    )
    W = np.zeros((len(ids), *shape), dtype=complex)
    V = np.zeros((*W.shape, 2, 2))
    at = job, part["s"], c, p
    W[at] = part["re"] + 1j * part["im"]
    each = part[["var_re", "cov_re_im", "cov_re_im", "var_im"]].fillna(0.0).to_numpy()
    V[at] = each.reshape(-1, 2, 2)
    return [MachineRecord(machine[name], name, W[k], V[k]) for k, name in enumerate(ids)]


def _usual(cells: pd.DataFrame) -> Grid:
    """Where jobs have most coefficients together, of the grids of single jobs."""
    if cells.empty:
        raise ValueError("no job of this type has coefficients: its runs do not determine them")
    alike = cells.assign(speed_rad_s=cells["speed_rad_s"].map("{:.3g}".format)).groupby("job")
    keys = alike[["speed_rad_s", "sensor", "plane", *_KIND]].agg(_different)
    first = keys.reset_index().groupby(list(keys), sort=False)["job"].agg(["size", "first"])
    of_job = cells.set_index("job")
    grids = [_grid(of_job.loc[[job]]) for job in first.sort_values("size", ascending=False)["first"][:_MOST]]
    machine = dict.fromkeys(of_job.index, "")
    return max(grids, key=lambda grid: sum(record.W.size for record in _records(cells, machine, grid)))


def _different(column: pd.Series[str]) -> tuple[str, ...]:
    return tuple(sorted(set(column)))


def _grid(cells: pd.DataFrame) -> Grid:
    """That of one job."""
    return Grid(
        np.unique(cells["speed_rad_s"]),
        tuple(cells["sensor"].unique()),
        tuple(cells["plane"].unique()),
        *(str(cells[name].iloc[0]) for name in _KIND),
    )
