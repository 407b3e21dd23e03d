"""A type of machines from the table of a fleet: its jobs at the same speeds, sensors and planes."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from balancing import Labels, UndeterminedError
from rotorid.base.choices import did_you_mean
from rotorid.base.text import counted, listing
from rotorid.files.conventions import DEFAULT_TOLERANCE
from rotorid.files.units import vibration, weight
from rotorid.fleet.machine_type import MachineRecord, MachineType, fit_type

if TYPE_CHECKING:
    import pandas as pd

    from rotorid.base.arrays import FloatArray

_SAME = 1e-3
"""Coefficients that differ by less, relative, come from the same runs: no two measurements agree so well."""


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
    """A type as a fleet knows it.

    `jobs` are rows of the table, the first of each job which the type is made of or which is odd; so many
    others are `lacking` some of the coefficients or are `copies`, with those of another job.
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
        """What was left out."""
        notes = []
        if self.lacking:
            lacking = counted(self.lacking, "job")
            notes.append(f"{lacking} of {self.name} without all of these coefficients left out")
        if self.copies:
            notes.append(f"{counted(self.copies, 'job')} with the same coefficients as another left out")
        if np.isinf(self.kind.limit):
            machines = counted(len(self.kind.machines), "machine")
            notes.append(f"with {machines} nothing tells an odd one from the others")
        return tuple(notes)


def known_type(
    fleet: pd.DataFrame, name: str, grid: Grid | None = None, without: Collection[str] = ()
) -> KnownType:
    """A type at a grid (None: where most of its coefficients are), without some jobs.

    ValueError for a type that is not there; UndeterminedError with too few machines.
    """
    cells = fleet[fleet["machine_type"] == name]
    if cells.empty:
        types = sorted({*fleet["machine_type"]} - {""})
        hint = did_you_mean(name, types) or f"; there are {listing(types, 'and') or 'none'}"
        raise ValueError(f"there is no type {name!r} in the fleet{hint}")
    cells = cells[~cells["job"].isin(list(without))]
    if grid is None:
        grid = _usual(cells)
    elif not grid.planes:
        grid = _usual(cells)._replace(speeds=grid.speeds, sensors=grid.sensors, quantity=grid.quantity)
    complete = _records(cells, grid)
    if not complete:
        words = f"no job of {name} has coefficients of all these speeds, sensors and planes; there are"
        there = (f"{one} {listing(sorted({*cells[one]}), 'and')}" for one in ("sensor", "plane", "quantity"))
        raise UndeterminedError(f"{words} {', '.join(there)}")
    records: list[MachineRecord] = []
    for record in complete:  # without copies, and stored coefficients that were used again
        near = _SAME * np.abs(record.W).max()
        if not any(np.abs(record.W - other.W).max() <= near for other in records):
            records.append(record)
    kind = fit_type(records, grid.speeds, grid.sensors, grid.planes)
    jobs = cells.drop_duplicates("job").set_index("job")
    lacking, copies = len(jobs) - len(complete), len(complete) - len(records)
    return KnownType(name, kind, jobs.loc[[record.job for record in records]], lacking, copies)


def _records(cells: pd.DataFrame, grid: Grid) -> list[MachineRecord]:
    """Of each job that has all coefficients of a grid."""
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
    part = part[part.groupby("job")["s"].transform("size") == np.prod(shape)]
    part = part.iloc[np.lexsort((part["p"], part["c"], part["s"], part["job"].factorize()[0]))]
    factor = np.ones(len(part))
    if grid.weight_kind == "mass":  # that at another radius does as much more, or less
        usual = part.groupby("plane")["radius_m"].transform("median")
        wanted = pd.Series(np.array(grid.radii)[part["p"]], part.index).fillna(usual)
        factor = (wanted / part["radius_m"].fillna(usual)).fillna(1.0).to_numpy()
    W = (factor * (part["re"] + 1j * part["im"])).to_numpy().reshape(-1, *shape)
    each = part[["var_re", "cov_re_im", "cov_re_im", "var_im"]].to_numpy()
    V = (factor[:, None] ** 2 * each).reshape(*W.shape, 2, 2)
    first = part.drop_duplicates("job")
    return [MachineRecord(*one) for one in zip(first["machine"], first["job"], W, V, strict=True)]


def _usual(cells: pd.DataFrame) -> Grid:
    """The grid of the first job of those with most coefficients."""
    part = cells[cells["job"] == cells.groupby("job", sort=False).size().idxmax()]
    planes = part.drop_duplicates("plane")
    return Grid(
        speeds=np.unique(part["speed_rad_s"]),
        sensors=tuple(part["sensor"].unique()),
        planes=tuple(planes["plane"]),
        quantity=str(part["quantity"].iloc[0]),
        weight_kind=str(part["weight_kind"].iloc[0]),
        radii=tuple(planes["radius_m"]),
    )
