"""Influence coefficients of a type of machines: their mean, how machines differ, and which do not belong.

A coefficient differs from machine to machine by a few per cent along and by some degrees across; both
directions are those of the median machine's coefficient, so that a covariance which is shrunk towards its
diagonal (`rotorid.regression.random_effects`) keeps them. Machines whose whole set of coefficients is far
from the others' were mostly recorded otherwise; what would make them fit is looked for:

- readings that lag where they are said to lead: Y is written as its conjugate (that of W is not enough where
  a trial weight stood elsewhere than at 0°);
- another keyphasor mark, or another zero of the angles: W e^{iθ};
- two sensors, or two planes, exchanged.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from balancing import (
    Gaussian,
    Influence,
    Labels,
    Trials,
    UndeterminedError,
    estimate_influence,
    match_speeds,
    with_parameters,
)
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.text import counted
from rotorid.regression import covariance_root, stretch, unstretch
from rotorid.regression.random_effects import RandomEffects, oddness, random_effects

LEAST_MACHINES = 3
"""Fewer do not show how machines differ."""
_ALIKE = 4.0
"""Of squared distance, which a reason with a number to choose gives up."""


class MachineRecord(NamedTuple):
    """Coefficients measured in one job of one machine.

    Attributes
    ----------
    machine, job
        Names.
    W, covariance
        The coefficients, (S, C, P), and the covariance of each, (S, C, P, 2, 2).
    """

    machine: str
    job: str
    W: ComplexArray
    covariance: FloatArray

    @classmethod
    def of(cls, influence: Influence, machine: str = "", job: str = "") -> MachineRecord:
        """The coefficients of a job with the covariance of each, of stated and measured errors alone.

        Assumed ones would make the scatter between machines look smaller than it is.
        """
        S, C, P = influence.W.shape
        V = np.einsum("scpipj->scpij", influence.channels(known=True)[..., 2:, 2:].reshape(S, C, P, 2, P, 2))
        return cls(machine, job, influence.W, V)


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
        Records that were left out, each with its squared distance.
    limit
        Squared distance within which machines belong to the type; infinite with fewer than `LEAST_GROUPS`.
    """

    speeds: FloatArray
    sensors: tuple[str, ...]
    planes: tuple[str, ...]
    turn: ComplexArray
    effects: RandomEffects
    machines: tuple[str, ...]
    odd: tuple[tuple[MachineRecord, float], ...]
    limit: float

    @property
    def mean(self) -> ComplexArray:
        """Mean coefficients (S, C, P)."""
        return self.coefficients(self.effects.mean)

    def scatter(self, covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
        """One standard deviation along a mean coefficient, relative to it, and across, in rad, (S, C, P)."""
        std = np.sqrt(np.diag(covariance)).reshape(*self.turn.shape, 2)
        along = self.effects.mean.reshape(std.shape)
        size = np.hypot(along[..., 0], along[..., 1])
        return std[..., 0] / size, np.arctan2(std[..., 1], size)

    def distance(self, W: ComplexArray, covariance: FloatArray) -> float:
        """Squared distance of coefficients measured in one job, to be compared with `limit`."""
        return self.effects.distance(*_rows(W, covariance, self.turn))

    def influence(self, labels: Labels, machine: str = "") -> Influence:
        """Coefficients to expect of one of `machines`, whose own jobs count then; else of a further one."""
        mean, covariance = self.effects.mean, self.effects.new_group + np.diag(self._doubt)
        if machine in self.machines:
            mean, covariance = self.effects.known(self.machines.index(machine))
        covariance = (covariance + self.effects.within) * self.widening
        columns = self.coefficients(covariance_root(covariance, np.diag(covariance)).T)
        W = self.coefficients(mean)
        nothing = np.full(W.shape[:2], np.nan)
        expected = Influence(
            self.speeds, self.sensors, self.planes, W, nothing, Gaussian.none(*W.shape), labels
        )
        return with_parameters(expected, columns, 0.0)

    def measured(self, trials: Trials) -> Influence:
        """Coefficients of a job's own runs; ValueError where they do not give all that the type has."""
        all_ = estimate_influence(trials)
        sensors, planes = map(all_.sensors.index, self.sensors), map(all_.planes.index, self.planes)
        return all_.part(match_speeds(self.speeds, all_.speeds), [*sensors], [*planes])

    def why_odd(self, record: MachineRecord, trials: Trials | None = None) -> str:
        """What would make a record fit the type best, in words; "" where nothing tried does.

        By the runs that it was measured with; None: not known, and the weights taken to be at 0°.
        """
        least, words = min(_changes(self, record, trials))
        return words if least <= min(self.limit, self.distance(record.W, record.covariance)) else ""

    @property
    def _doubt(self) -> FloatArray:
        """By how much more variances between machines may be expected to be, (n,): the rest after errors.

        Where errors E of the coefficients are most of the scatter B + E, what is left of it is uncertain by
        σ = √(2 ((B + E)² - B²) / (M - 1)) and not negative; its mean then is B + σ φ(B / σ) / Φ(B / σ).
        """
        from scipy.special import ndtr

        between = np.diag(self.effects.between)
        blocks = self.effects.error.mean(axis=0)
        rest = np.diag(self.effects.within) * np.mean(1 / self.effects.jobs)
        total = between + blocks[:, [0, 1], [0, 1]].ravel() + rest
        std = np.sqrt(2 * (total**2 - between**2) / (len(self.machines) - 1))
        ratio = np.divide(between, std, out=np.full_like(std, np.inf), where=std > 0)
        return np.asarray(std * np.exp(-(ratio**2) / 2) / np.sqrt(2 * np.pi) / ndtr(ratio))

    @property
    def widening(self) -> float:
        """Times the variance: what a region of two numbers at 95 % needs with so few machines (F over χ²)."""
        from scipy.special import chdtri, fdtri

        return float(2 * fdtri(2, len(self.machines) - 1, 0.95) / chdtri(2, 0.05))

    def coefficients(self, values: FloatArray) -> ComplexArray:
        """Stretched (…, n) as coefficients (…, S, C, P)."""
        return unstretch(values).reshape(*values.shape[:-1], *self.turn.shape) * self.turn


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
    W = np.stack([record.W for record in records])
    centre = np.median(W.real, axis=0) + 1j * np.median(W.imag, axis=0)
    turn = np.exp(1j * np.angle(centre))
    y, error = _rows(W, np.stack([record.covariance for record in records]), turn)
    names = np.array([record.machine for record in records])
    far, limit = oddness(y, error, np.unique(names, return_inverse=True)[1])
    fits = far <= limit
    machines = tuple(dict.fromkeys(names[fits].tolist()))
    if len(machines) < LEAST_MACHINES:
        raise UndeterminedError(
            f"{counted(len(machines), 'machine')} with these speeds, sensors and planes: how machines of a "
            f"type differ shows with {LEAST_MACHINES} or more"
        )
    return MachineType(
        speeds=speeds,
        sensors=tuple(sensors),
        planes=tuple(planes),
        turn=turn,
        effects=random_effects(y[fits], error[fits], np.array([machines.index(n) for n in names[fits]])),
        machines=machines,
        odd=tuple((records[j], float(far[j]) / limit) for j in np.flatnonzero(~fits).tolist()),
        limit=limit,
    )


def _changes(kind: MachineType, record: MachineRecord, trials: Trials | None) -> Iterator[tuple[float, str]]:
    """Squared distance of the coefficients as they would be, and what was changed."""
    from scipy.optimize import minimize_scalar

    W, V = record.W, record.covariance
    lag = np.conj(W)
    with suppress(ValueError):  # runs that do not give all coefficients
        if trials is not None:
            read = kind.measured(trials).W
            other = replace(trials, readings=np.conj(trials.readings), covariance=None)
            size = np.linalg.norm(W, axis=(0, 1)) / np.linalg.norm(read, axis=(0, 1))  # of other radii
            lag = kind.measured(other).W * size
    mirror = np.array([[1.0, -1.0], [-1.0, 1.0]])
    yield kind.distance(lag, V * mirror), "its phases were of the other sense (lag for lead)"
    for names, axis, what in ((kind.sensors, 1, "sensors"), (kind.planes, 2, "planes")):
        for a, b in combinations(range(len(names)), 2):
            order = np.arange(len(names))
            order[[a, b]] = b, a
            exchanged = kind.distance(np.take(W, order, axis), np.take(V, order, axis))
            yield exchanged, f"its {what} {names[a]} and {names[b]} were exchanged"

    def turned(theta: float) -> float:
        by = np.exp(1j * np.array(theta))
        return kind.distance(W * by, _turned(V, by))

    step = np.radians(10.0)
    start = min(np.arange(0.0, 2 * np.pi, step).tolist(), key=turned)
    least = minimize_scalar(turned, bounds=(start - step, start + step), method="bounded")
    degrees = (round(np.degrees(least.x)) + 180) % 360 - 180
    words = f"its phases {'led' if degrees > 0 else 'lagged'} {abs(degrees)}° more (another keyphasor mark)"
    yield float(least.fun) + _ALIKE, words  # it has a number to choose


def _rows(W: ComplexArray, covariance: FloatArray, turn: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Coefficients (…, S, C, P) over the type's phases as rows (…, n), and covariances (…, n / 2, 2, 2)."""
    several = W.shape[:-3]
    y = stretch((W * np.conj(turn)).ravel()).reshape(*several, -1)
    return y, _turned(covariance, np.conj(turn)).reshape(*several, -1, 2, 2)


def _turned(covariance: FloatArray, by: ComplexArray) -> FloatArray:
    """Covariances (…, 2, 2) of complex numbers that are multiplied by numbers (…) of size 1."""
    R = stretch(by[..., None, None])
    return np.asarray(R @ covariance @ np.swapaxes(R, -1, -2))
