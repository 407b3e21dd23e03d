"""Influence coefficients of a type of machines: their mean, how machines differ, and which do not belong.

A coefficient differs from machine to machine by a few per cent along and by some degrees across; both
directions are those of the median machine's coefficient, so that a covariance which is shrunk towards its
diagonal (`rotorid.regression.random_effects`) keeps them. Machines whose whole set of coefficients is far
from the others' were mostly recorded otherwise. Four changes are tried, and each number θ that may be chosen,
the phase of Σ conj(W) μ / |μ|², counts against one:

- readings that lag where the job says that they lead: conj(W) e^{iθ}, with a θ for each plane, since a trial
  weight at the angle α makes conj(W) one of e^{2iα};
- another keyphasor mark, or another zero of the angles: W e^{iθ};
- two sensors, or two planes, exchanged.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from balancing import Gaussian, Influence, Labels, UndeterminedError, with_parameters
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.choices import did_you_mean
from rotorid.base.text import counted, listing
from rotorid.files.layout import DEFAULT_TOLERANCE
from rotorid.files.units import vibration, weight
from rotorid.regression import covariance_root, unstretch
from rotorid.regression.random_effects import RandomEffects, oddness, random_effects

if TYPE_CHECKING:
    import pandas as pd

LEAST_MACHINES = 3
"""Fewer do not show how machines differ."""
_CHOSEN = 4.0
"""Of squared distance, which a change gives up for each number that it may choose."""
_SAME = 1e-3
"""Coefficients that differ by less, relative, come from the same runs: no two measurements agree so well."""


class MachineRecord(NamedTuple):
    """Coefficients measured in one job of one machine.

    Attributes
    ----------
    machine, job
        Names.
    W, std
        The coefficients, and one standard deviation of the real and of the imaginary part of each, (S, C, P);
        0 where errors are assumed.
    """

    machine: str
    job: str
    W: ComplexArray
    std: FloatArray


class Grid(NamedTuple):
    """Speeds (rad/s), sensors, planes (none: all) and radii (m, NaN: not known); what is read, mounted."""

    speeds: FloatArray
    sensors: tuple[str, ...]
    planes: tuple[str, ...]
    radii: tuple[float, ...]
    quantity: str
    weight_kind: str


@dataclass(frozen=True, eq=False)
class MachineType:
    """Coefficients of a type of machines.

    Attributes
    ----------
    speeds, sensors, planes
        rad/s, (S,), and names, C and P.
    turn
        Phases of the median machine, as numbers of size 1, (S, C, P).
    effects
        Of the coefficients over these, stretched, n = 2 S C P, with machines as groups.
    machines
        Names of those that belong to the type.
    odd
        Records that were left out, each with its squared distance over the limit.
    limit
        Squared distance within which machines belong to the type; infinite with fewer than `LEAST_GROUPS`.
    notes
        What was left out, and which errors nobody states.
    name, labels, left_out
        In a fleet: its name, units of a job of it, and how many jobs lack coefficients or are copies.
    """

    speeds: FloatArray
    sensors: tuple[str, ...]
    planes: tuple[str, ...]
    turn: ComplexArray
    effects: RandomEffects
    machines: tuple[str, ...]
    odd: tuple[tuple[MachineRecord, float], ...]
    limit: float
    notes: tuple[str, ...]
    name: str = ""
    labels: Labels = field(default_factory=Labels)
    left_out: int = 0

    @property
    def mean(self) -> ComplexArray:
        """Mean coefficients (S, C, P)."""
        return self.coefficients(self.effects.mean)

    @property
    def widening(self) -> float:
        """Times the variance: what a region of two numbers at 95 % needs with so few machines (F over χ²)."""
        from scipy.special import chdtri, fdtri

        return float(2 * fdtri(2, len(self.machines) - 1, 0.95) / chdtri(2, 0.05))

    def coefficients(self, values: FloatArray) -> ComplexArray:
        """Stretched (…, n) as coefficients (…, S, C, P)."""
        return unstretch(values).reshape(*values.shape[:-1], *self.turn.shape) * self.turn

    def influence(self, labels: Labels, machine: str = "") -> Influence:
        """Coefficients to expect of one of `machines`, whose own jobs count then; else of a further one."""
        effects, W = self.effects, self.mean
        covariance = effects.new_group + np.diag(_doubt(effects))
        if machine in self.machines:
            mean, covariance = effects.known(self.machines.index(machine))
            W = self.coefficients(mean)
        covariance = (covariance + effects.within) * self.widening
        columns = self.coefficients(covariance_root(covariance, np.diag(covariance)).T)
        nothing = np.full(W.shape[:2], np.nan), Gaussian.none(*W.shape)
        expected = Influence(self.speeds, self.sensors, self.planes, W, *nothing, labels)
        return with_parameters(expected, columns, 0.0)

    def why_odd(self, record: MachineRecord) -> str:
        """What would make a record fit the type best, in words; "" where nothing tried does."""
        W, std, share = record.W, record.std, self.mean / np.abs(self.mean) ** 2
        lag = W.conj() * np.exp(1j * np.angle(np.sum(W * share, axis=(0, 1))))
        theta = np.angle(np.sum(W.conj() * share))
        degrees = round(np.degrees(theta))
        mark = f"{'led' if degrees > 0 else 'lagged'} {abs(degrees)}° more (another keyphasor mark)"
        changes = [
            (f"its phases {mark}", W * np.exp(1j * theta), std, 1),
            ("its phases were of the other sense (lag for lead)", lag, std, len(self.planes)),
        ]
        for names, axis, what in ((self.sensors, 1, "sensors"), (self.planes, 2, "planes")):
            for a, b in combinations(range(len(names)), 2):
                order = np.arange(len(names))
                order[[a, b]] = b, a
                words = f"its {what} {names[a]} and {names[b]} were exchanged"
                changes.append((words, W.take(order, axis), std.take(order, axis), 0))
        least, reason = min((self._distance(*parts) + _CHOSEN * n, words) for words, *parts, n in changes)
        return reason if least <= min(self.limit, self._distance(W, std)) else ""

    def _distance(self, W: ComplexArray, std: FloatArray) -> float:
        """Squared distance of coefficients measured in one job, to be compared with `limit`."""
        return self.effects.distance(*_rows(W, std, self.turn))


def _doubt(effects: RandomEffects) -> FloatArray:
    """By how much more variances between machines may be expected to be, (n,): the rest after errors.

    Where errors E of the coefficients are most of the scatter B + E, what is left of it is uncertain by
    σ = √(2 ((B + E)² - B²) / (M - 1)) and not negative; its mean then is B + σ φ(B / σ) / Φ(B / σ).
    """
    from scipy.special import ndtr

    M, B = len(effects.jobs), np.diag(effects.between)
    total = M * (np.diag(effects.new_group) - B)
    std = np.sqrt(2 * np.maximum(total**2 - B**2, 0) / (M - 1))
    ratio = np.divide(B, std, out=np.full_like(B, np.inf), where=std > 0)
    return np.asarray(std * np.exp(-(ratio**2) / 2) / np.sqrt(2 * np.pi) / ndtr(ratio))


def _rows(W: ComplexArray, std: FloatArray, turn: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Coefficients (…, S, C, P) over the type's phases as rows (…, n), and covariances (…, n / 2, 2, 2)."""
    rows = (W * np.conj(turn)).reshape(*W.shape[:-3], -1)
    return rows.view(float), std.reshape(*rows.shape, 1, 1) ** 2 * np.eye(2)


def fit_type(
    records: Sequence[MachineRecord], speeds: FloatArray, sensors: Sequence[str], planes: Sequence[str]
) -> MachineType:
    """Coefficients of a type, from jobs of its machines; those that do not belong are left out and named.

    Parameters
    ----------
    records
        One a job, with the same speeds, sensors and planes.
    speeds, sensors, planes
        rad/s, (S,), and names.

    Raises
    ------
    UndeterminedError
        With fewer than `LEAST_MACHINES` machines that belong together.
    """
    names, W, std = (np.array([record[k] for record in records]) for k in (0, 2, 3))
    turn = np.exp(1j * np.angle(np.median(W.real, axis=0) + 1j * np.median(W.imag, axis=0)))
    y, error = _rows(W, std, turn)
    far, limit = oddness(y, error, np.unique(names, return_inverse=True)[1])
    fits = far <= limit
    machines, number = np.unique(names[fits], return_inverse=True)
    if len(machines) < LEAST_MACHINES:
        raise UndeterminedError(
            f"{counted(len(machines), 'machine')} with these speeds, sensors and planes: how machines of a "
            f"type differ shows with {LEAST_MACHINES} or more"
        )
    notes, assumed = list[str](), int((error[fits].max(axis=(1, 2, 3)) == 0).sum())
    if assumed:
        none = f"{counted(assumed, 'job')} without errors that are stated or measured: they count as none"
        notes.append(f"{none}, and ± are too wide rather than too narrow")
    if np.isinf(limit):
        notes.append(f"with {counted(len(machines), 'machine')} nothing tells an odd one from the others")
    return MachineType(
        speeds,
        tuple(sensors),
        tuple(planes),
        turn,
        effects=random_effects(y[fits], error[fits], number),
        machines=tuple(machines.tolist()),
        odd=tuple((records[j], float(far[j]) / limit) for j in np.flatnonzero(~fits).tolist()),
        limit=limit,
        notes=tuple(notes),
    )


def type_of_fleet(
    fleet: pd.DataFrame, name: str, grid: Grid | None = None, without: Collection[str] = ()
) -> MachineType:
    """A type at a grid (None: where most of its coefficients are), without some jobs.

    ValueError for a type that is not there; UndeterminedError with too few machines.
    """
    types = sorted({*fleet["machine_type"]} - {""})
    if name not in types:
        hint = did_you_mean(name, types) or f"; there are {listing(types, 'and') or 'none'}"
        raise ValueError(f"there is no type {name!r} in the fleet{hint}")
    cells = fleet[(fleet["machine_type"] == name) & ~fleet["job"].isin(list(without))]
    records: list[MachineRecord] = []
    if grid is None:
        grid = _usual(cells)
    elif not grid.planes and len(cells):
        grid = _usual(cells)._replace(speeds=grid.speeds, sensors=grid.sensors, quantity=grid.quantity)
    for record in records_at(cells, grid):  # without copies, and stored coefficients that were used again
        near = _SAME * np.abs(record.W).max()
        if not any(np.abs(record.W - other.W).max() <= near for other in records):
            records.append(record)
    if not records:
        there = (f"{one} {listing(sorted({*cells[one]}), 'and')}" for one in ("sensor", "plane", "quantity"))
        words = f"no job of {name} has coefficients of all these speeds, sensors and planes; there are"
        raise UndeterminedError(f"{words} {', '.join(there)}")
    kind = fit_type(records, grid.speeds, grid.sensors, grid.planes)
    left_out, notes = cells["job"].nunique() - len(records), kind.notes
    if left_out:
        words = "left out: copies of others, or without all of these coefficients"
        notes = (f"{counted(left_out, 'job')} of {name} {words}", *notes)
    first = cells[cells["job"] == records[0].job].iloc[0]
    read, mounted = str(first["vibration_unit"]), str(first["weight_unit"])
    labels = Labels(read, vibration(read).scale if read else 1.0, mounted, weight(mounted).scale)
    return replace(kind, name=name, labels=labels, left_out=left_out, notes=notes)


def records_at(cells: pd.DataFrame, grid: Grid) -> list[MachineRecord]:
    """Of each job that has all coefficients of a grid."""
    import pandas as pd

    keys, values = ["speed", "sensor", "plane"], ["re", "im", "std"]
    off = np.abs(cells["speed_rad_s"].to_numpy()[:, None] / grid.speeds - 1)
    alike = (cells[["quantity", "weight_kind"]] == [grid.quantity, grid.weight_kind]).all(axis=1)
    cells = cells.assign(speed=off.argmin(axis=1))[alike & (off.min(axis=1) <= DEFAULT_TOLERANCE / 100)]
    if grid.weight_kind == "mass":  # that at another radius does as much more, or less
        usual = cells.groupby("plane")["radius_m"].transform("median")
        radii = dict(zip(grid.planes, grid.radii, strict=True))
        wanted = cells["plane"].map(radii).astype(float).fillna(usual)
        factor = wanted / cells["radius_m"].fillna(usual)
        cells[values] = cells[values].mul(factor.fillna(1.0), axis=0)
    wide = cells.drop_duplicates(["job", *keys]).pivot(index=["machine", "job"], columns=keys, values=values)
    every = pd.MultiIndex.from_product([values, range(len(grid.speeds)), grid.sensors, grid.planes])
    wide = wide.reindex(columns=every).dropna()
    each = zip(wide.index, wide.to_numpy().reshape(len(wide), *every.levshape), strict=True)
    return [MachineRecord(machine, job, re + 1j * im, std) for (machine, job), (re, im, std) in each]


def _usual(cells: pd.DataFrame) -> Grid:
    """The grid of the first job of those with most coefficients."""
    part = cells[cells["job"] == cells["job"].mode().iloc[0]]
    planes, sensors = part.drop_duplicates("plane"), tuple(part["sensor"].unique())
    places = np.unique(part["speed_rad_s"]), sensors, tuple(planes["plane"]), tuple(planes["radius_m"])
    return Grid(*places, *part[["quantity", "weight_kind"]].iloc[0])
