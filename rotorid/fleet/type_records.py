"""Records of one type of machines in the store of a fleet, at the same speeds, sensors and planes."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from balancing import Labels, UndeterminedError
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import counted, listing
from rotorid.files.conventions import DEFAULT_TOLERANCE
from rotorid.files.units import vibration, weight
from rotorid.fleet.machine_type import MachineRecord, MachineType, fit_type

if TYPE_CHECKING:
    import pandas as pd

    from rotorid.base.arrays import FloatArray
    from rotorid.tables.fleet.fleet_store import FleetStore

_KIND = ["quantity", "weight_kind"]
_MOST = 20
_SAME = 1e-3
"""Coefficients that differ by less, relative, come from the same runs: no two measurements agree so well."""
_YEAR = re.compile(r"(?<!\d)(19|20)\d\d(-\d\d){0,2}(?!\d)")


class Grid(NamedTuple):
    """Speeds (rad/s), sensors, planes (none: all) and radii (m, NaN: not known); what is read, mounted."""

    speeds: FloatArray
    sensors: tuple[str, ...]
    planes: tuple[str, ...]
    quantity: str
    weight_kind: str
    radii: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class KnownType:
    """A type as the store knows it.

    `jobs` are rows of that table which it is made of or which were found odd, by id; so many jobs are
    `lacking` some of the coefficients or are `copies`, with those of another job.
    """

    name: str
    kind: MachineType
    jobs: pd.DataFrame
    lacking: int
    copies: int

    @property
    def labels(self) -> Labels:
        """Units to print in, those of most of its jobs; phases lead."""
        read, mounted = (str(self.jobs[name].mode()[0]) for name in ("vibration_unit", "weight_unit"))
        return Labels(read, vibration(read).scale if read else 1.0, mounted, weight(mounted).scale)

    @property
    def notes(self) -> tuple[str, ...]:
        """What was left out, and what is to be known of names."""
        notes = []
        if self.lacking:
            lacking = counted(self.lacking, "job")
            notes.append(f"{lacking} of {self.name} without all of these coefficients left out")
        if self.copies:
            notes.append(f"{counted(self.copies, 'job')} with the same coefficients as another left out")
        notes += self._repeated
        if np.isinf(self.kind.limit):
            machines = counted(len(self.kind.machines), "machine")
            notes.append(f"with {machines} nothing tells an odd one from the others")
        return tuple(notes)

    @property
    def _repeated(self) -> list[str]:
        """Names of machines that are folders at more than one place, years apart."""
        found = []
        for name, paths in self.jobs.groupby("machine")["path"]:
            parts = [path.split("/")[:-1] for path in paths]
            above = {_YEAR.sub("", "/".join(p[: p.index(name)])): "/".join(p) for p in parts if name in p}
            if len(above) > 1:
                one = f"{str(name)!r} counts as one machine: {listing(above.values(), 'and')}"
                found.append(f"{one}; if these are several, say `machine` in the jobs")
        return found


def known_type(
    store: FleetStore, name: str, grid: Grid | None = None, without: Collection[str] = ()
) -> KnownType:
    """Coefficients of a type at a grid (None: where most of them are), without some jobs (ids).

    ValueError for a type that is not there; UndeterminedError with too few machines.
    """
    store.check()
    jobs = store.table("jobs", machine_type=name)
    if jobs.empty:
        types = sorted({*store.table("jobs")["machine_type"]} - {""})
        raise ValueError(f"{store.folder}: there is no type {name!r}{did_you_mean(name, types)}")
    jobs = jobs[~jobs["job"].isin(list(without))].set_index("job")
    cells = store.table("coefficients", jobs=list(jobs.index)).join(jobs[["machine", *_KIND]], on="job")
    if cells.empty:
        raise ValueError("no job of this type has coefficients: its runs do not determine them")
    if grid is None:
        grid = _usual(cells)
    elif not grid.planes:
        grid = _usual(cells)._replace(speeds=grid.speeds, sensors=grid.sensors, quantity=grid.quantity)
    complete = _records(cells, grid)
    if not complete:
        raise UndeterminedError(_none(store, name, cells, grid))
    records = _different_runs(complete)
    kind = fit_type(records, grid.speeds, grid.sensors, grid.planes)
    own = jobs.loc[[record.job for record in records]]
    return KnownType(name, kind, own, len(jobs) - len(complete), len(complete) - len(records))


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
    """That no job has the coefficients of a grid, and what else there is."""
    words = f"{store.folder}: no job of {name} has coefficients of all these speeds, sensors and planes"
    wanted = {"sensor": grid.sensors, "plane": grid.planes}
    wanted |= {"quantity": (grid.quantity,), "weight_kind": (grid.weight_kind,)}
    for column, names in wanted.items():
        there = sorted(set(cells[column]))
        if lacking := [one for one in names if one not in there]:
            what = column.replace("_", " ")
            words += f"; it has no {what} {listing(lacking, 'and')}, but {listing(there, 'and')}"
    return words


def _records(cells: pd.DataFrame, grid: Grid) -> list[MachineRecord]:
    """Of each job that has all coefficients of a grid; unknown errors count as none."""
    import pandas as pd

    near = np.abs(cells["speed_rad_s"].to_numpy()[:, None] - grid.speeds)
    s = near.argmin(axis=1)
    c, p = (
        pd.Index(names).get_indexer(pd.Index(cells[name]))
        for name, names in (("sensor", grid.sensors), ("plane", grid.planes))
    )
    there = (near.min(axis=1) <= DEFAULT_TOLERANCE / 100 * grid.speeds[s]) & (c >= 0) & (p >= 0)
    there &= (cells["quantity"] == grid.quantity) & (cells["weight_kind"] == grid.weight_kind)
    part = cells.assign(s=s, c=c, p=p)[there].drop_duplicates(["job", "s", "c", "p"])
    shape = len(grid.speeds), len(grid.sensors), len(grid.planes)
    size = int(np.prod(shape))
    part = part[part.groupby("job")["s"].transform("size") == size]
    part = part.iloc[np.lexsort((part["p"], part["c"], part["s"], part["job"].factorize()[0]))]
    factor = np.ones(len(part))
    if grid.weight_kind == "mass":  # that at another radius does as much more, or less
        usual = part.groupby("plane")["radius"].transform("median")
        wanted = pd.Series(np.array(grid.radii)[part["p"]], part.index).fillna(usual)
        factor = (wanted / part["radius"].fillna(usual)).fillna(1.0).to_numpy()
    W = (factor * (part["re"] + 1j * part["im"])).to_numpy().reshape(-1, *shape)
    each = part[["var_re", "cov_re_im", "cov_re_im", "var_im"]].fillna(0.0).to_numpy()
    V = (factor[:, None] ** 2 * each).reshape(*W.shape, 2, 2)
    first = part[::size]
    return [MachineRecord(*one) for one in zip(first["machine"], first["job"], W, V, strict=True)]


def _usual(cells: pd.DataFrame) -> Grid:
    """Where jobs have most coefficients together, of the grids of single jobs."""
    alike = cells.assign(speed_rad_s=cells["speed_rad_s"].map("{:.3g}".format)).groupby("job")
    keys = alike[["speed_rad_s", "sensor", "plane", *_KIND]].agg(frozenset)
    first = keys.reset_index().groupby(list(keys), sort=False)["job"].agg(["size", "first"])
    of_job = cells.set_index("job")
    grids = [_grid(of_job.loc[[job]]) for job in first.sort_values("size", ascending=False)["first"][:_MOST]]
    return max(grids, key=lambda grid: sum(record.W.size for record in _records(cells, grid)))


def _grid(cells: pd.DataFrame) -> Grid:
    """That of one job."""
    planes, quantity, weight_kind = cells.drop_duplicates("plane"), *cells[_KIND].iloc[0]
    return Grid(
        speeds=np.unique(cells["speed_rad_s"]),
        sensors=tuple(cells["sensor"].unique()),
        planes=tuple(planes["plane"]),
        quantity=str(quantity),
        weight_kind=str(weight_kind),
        radii=tuple(planes["radius"]),
    )
