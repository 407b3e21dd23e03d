"""Records of one type of machines in the store of a fleet, at the same speeds, sensors and planes."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.coefficients.baseline import SPEED_TOLERANCE
from balancing.coefficients.identifiability import UndeterminedError
from balancing.coefficients.machine_type import MachineRecord, MachineType, fit_type, why_odd
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import counted, listing

if TYPE_CHECKING:
    import pandas as pd

    from rotorid.base.arrays import FloatArray
    from rotorid.tables.fleet.fleet_store import FleetStore

_KIND = ["quantity", "weight_kind"]
_MOST = 20
_SAME = 1e-3
"""Coefficients that differ by less, relative, come from the same runs: no two measurements agree so well."""
_YEAR = re.compile(r"(?<!\d)(19|20)\d\d(-\d\d){0,2}(?!\d)")


@dataclass(frozen=True, eq=False)
class Grid:
    """Speeds (rad/s), sensors and planes (none: all); what is read, and what weights are.

    Masses stand at `radii` of the planes (m, NaN: not known).
    """

    speeds: FloatArray
    sensors: tuple[str, ...]
    planes: tuple[str, ...]
    quantity: str
    weight_kind: str
    radii: tuple[float, ...]


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
    copies
        How many have those of another job.
    """

    name: str
    kind: MachineType
    jobs: pd.DataFrame
    grid: Grid
    reasons: tuple[str, ...]
    lacking: int
    copies: int

    @property
    def notes(self) -> tuple[str, ...]:
        """What was left out, and what is to be known of names."""
        lacking = f"{counted(self.lacking, 'job')} of {self.name} without all of these coefficients left out"
        few = f"with {counted(len(self.kind.machines), 'machine')} nothing tells an odd one from the others"
        copies = f"{counted(self.copies, 'job')} with the same coefficients as another left out"
        notes = (lacking,) * bool(self.lacking) + (copies,) * bool(self.copies)
        return (*notes, *self._repeated, *(few,) * bool(np.isinf(self.kind.limit)))

    @property
    def _repeated(self) -> tuple[str, ...]:
        """Names of machines that are folders at more than one place, years apart."""
        found = {}
        for name, paths in self.jobs.groupby("machine")["path"]:
            parts = [path.split("/")[:-1] for path in paths]
            above = {_YEAR.sub("", "/".join(p[: p.index(name)])): "/".join(p) for p in parts if name in p}
            if len(above) > 1:
                found[str(name)] = listing([*above.values()], "and")
        return tuple(
            f"{name!r} counts as one machine: {places}; if these are several, say `machine` in the jobs"
            for name, places in found.items()
        )


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
        Ids of jobs that are not to count.

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
    jobs = jobs[~jobs["job"].isin(list(without))].set_index("job")
    cells = store.table("coefficients", jobs=list(jobs.index)).join(jobs[_KIND], on="job")
    if grid is None or not grid.planes:
        usual = _usual(cells)
        if grid is None:
            grid = usual
        grid = replace(grid, planes=usual.planes, weight_kind=usual.weight_kind, radii=usual.radii)
    complete = _records(cells, dict(jobs["machine"]), grid)
    if not complete:
        raise UndeterminedError(_none(store, name, cells, grid))
    records = _different_runs(complete)
    kind = fit_type(records, grid.speeds, grid.sensors, grid.planes)
    own = jobs.loc[[record.job for record in records]]
    reasons = tuple(
        why_odd(kind, record, trials_of(store, record.job) if own["trial_runs"][record.job] > 1 else None)
        for record, _ in kind.odd
    )
    copies = len(complete) - len(records)
    return KnownType(name, kind, own, grid, reasons, len(jobs) - len(complete), copies)


def _different_runs(records: list[MachineRecord]) -> list[MachineRecord]:
    """Records without those of copies, and of coefficients that were stored and used again."""
    W = np.array([record.W for record in records]).reshape(len(records), -1)
    size = np.abs(W).max(axis=1)
    kept: list[int] = []
    for j in range(len(W)):
        if not (np.abs(W[kept] - W[j]).max(axis=1) <= _SAME * size[j]).any():
            kept.append(j)
    return [records[j] for j in kept]


def _none(store: FleetStore, name: str, cells: pd.DataFrame, grid: Grid) -> str:
    """That no job has the coefficients of a grid, and which of its names are known."""
    known = {"sensor": grid.sensors, "plane": grid.planes}
    words = f"{store.folder}: no job of {name} has coefficients of all these speeds, sensors and planes"
    for column, names in known.items():
        there = sorted(set(cells[column]))
        if lacking := [one for one in names if one not in there]:
            words += f"; it has no {column} {listing(lacking, 'and')}, but {listing(there, 'and')}"
    return words


def _records(cells: pd.DataFrame, machine: Mapping[Any, str], grid: Grid) -> list[MachineRecord]:
    """Of each job that has all coefficients of a grid; unknown errors count as none."""
    import pandas as pd

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
    there = part.groupby("plane")["radius"].transform("median")
    # a mass at another radius does as much more, or less, as its radius is larger, or smaller
    wanted = pd.Series(np.array(grid.radii)[p], part.index).fillna(there)
    factor = (wanted / part["radius"]).fillna(1.0).to_numpy()
    W[at] = factor * (part["re"] + 1j * part["im"])
    each = part[["var_re", "cov_re_im", "cov_re_im", "var_im"]].fillna(0.0).to_numpy()
    V[at] = (factor[:, None] ** 2 * each).reshape(-1, 2, 2)
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
    planes = cells.drop_duplicates("plane")
    return Grid(
        speeds=np.unique(cells["speed_rad_s"]),
        sensors=tuple(cells["sensor"].unique()),
        planes=tuple(planes["plane"]),
        quantity=str(cells["quantity"].iloc[0]),
        weight_kind=str(cells["weight_kind"].iloc[0]),
        radii=tuple(planes["radius"]),
    )
