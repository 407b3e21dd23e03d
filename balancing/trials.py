"""Runs of a rotor: what the sensors read and which weights were mounted, and what weights must keep to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import NamedTuple

import numpy as np

from balancing.conventions import Labels
from rotorid.base.arrays import ComplexArray, FloatArray, IntArray
from rotorid.base.text import RPM

Arc = tuple[float, float]
"""First angle and width, rad, with the rotation; 0 < width ≤ 2π."""


@dataclass(frozen=True)
class ReadingErrors:
    """One standard deviation of a single reading.

    Attributes
    ----------
    amplitude
        Relative to the amplitude (0.02 is 2 %).
    phase
        rad.
    floor
        In the unit of the readings inside (SI), in every direction.

    Raises
    ------
    ValueError
        For a negative or infinite error, and where all three are zero: unknown errors are `None`.
    """

    amplitude: float = 0.0
    phase: float = 0.0
    floor: float = 0.0

    def __post_init__(self) -> None:
        values = self.amplitude, self.phase, self.floor
        if not (all(0 <= value < np.inf for value in values) and any(values)):
            raise ValueError(
                f"the errors of a reading must be finite numbers ≥ 0, not {values}, and not all zero, which "
                "no instrument is: state amplitude, phase or floor, or state no errors at all"
            )


class RunScatter(NamedTuple):
    """One standard deviation of what changes from run to run.

    Attributes
    ----------
    relative, floor
        In proportion to a reading, and in the unit of the readings inside (SI).
    """

    relative: float
    floor: float = 0.0


class Placement(NamedTuple):
    """One standard deviation of a mounted weight.

    Attributes
    ----------
    mass, angle
        Relative, and rad.
    """

    mass: float = 0.0
    angle: float = 0.0


_EXACT = Placement()
TURNED = "the rotor on its arbor"
"""The plane that stands for a rotor turned on its arbor (`special_runs`): no weight is misplaced there."""

TRIAL_WEIGHTS = "times the trial weight"
"""The unit of weights that are relative."""


class Relative(NamedTuple):
    """What weights are multiples of: one trial weight of each plane, of unknown mass, place or both.

    Attributes
    ----------
    angle
        Whether angles count from the places of these trial weights.
    sizes, unit
        Their masses by plane, NaN where they are not known, and the unit of these.
    """

    angle: bool
    sizes: dict[str, float]
    unit: str


@dataclass(frozen=True, eq=False)
class Trials:
    """Readings of R runs at S speeds by C sensors, and the weights in P planes during each run.

    Attributes
    ----------
    runs, sensors, planes
        Names, lengths R, C, P. There may be no plane (P = 0) where the readings only serve as a baseline.
    speeds
        rad/s, shape (S,).
    readings
        Complex amplitudes, phase positive = lead, shape (K, R, S, C); K repeated readings, NaN where a
        reading was repeated fewer times (the first of the K is always there). A shape (R, S, C) counts as
        K = 1.
    weights
        Mounted in each run, angle with the rotation, kg or kg·m, shape (R, P).
    errors
        Stated errors of a reading, or None.
    run_errors
        Stated errors between runs, or None.
    labels
        Units and conventions to print results in.
    warnings
        What the user should know about how the readings were understood.
    steps
        Steps in which the readings are written, of the amplitude (SI) and of the phase (rad): an instrument
        that shows whole degrees rounds by up to half of one. Shape (2, K, R, S, C), NaN where there is no
        reading; None where they are not rounded.
    covariance
        Of real and imaginary part of each reading, as its instrument measured it: shape (2, 2, K, R, S, C),
        NaN where there is no reading; None: nothing measured it.
    placement
        Stated errors of the mounted weights; zero: not stated.
    drift
        Stated drift of the readings from the first to the last run, relative, one standard deviation.
    index
        By what angle the rotor was turned on its arbor in each run, rad with the rotation, shape (R,); None:
        it was not. Weights count from the rotor's mark then, phases from that of the arbor.
    relative
        What the weights are relative to; None: nothing, their masses and places are known.
    amplitudes_only
        Whether phases are not known: the readings are amplitudes, ≥ 0, which `balance_without_phase` takes.

    Raises
    ------
    ValueError
        With one sentence that says which run, sensor, speed or plane is impossible, and why.
    """

    runs: tuple[str, ...]
    speeds: FloatArray
    sensors: tuple[str, ...]
    planes: tuple[str, ...]
    readings: ComplexArray
    weights: ComplexArray
    errors: ReadingErrors | None = None
    labels: Labels = field(default_factory=Labels)
    warnings: tuple[str, ...] = ()
    run_errors: RunScatter | None = None
    steps: FloatArray | None = None
    covariance: FloatArray | None = None
    placement: Placement = _EXACT
    drift: float = 0.0
    index: FloatArray | None = None
    relative: Relative | None = None
    amplitudes_only: bool = False

    def __post_init__(self) -> None:
        keep(
            self,
            runs=check_names(self.runs, "runs"),
            sensors=check_names(self.sensors, "sensors"),
            planes=check_names(self.planes, "planes", empty=True),
            speeds=check_speeds(self.speeds),
        )
        R, S, C, P = len(self.runs), len(self.speeds), len(self.sensors), len(self.planes)
        readings = np.array(self.readings, dtype=complex)
        if readings.ndim == 3:
            readings = readings[None]
        if readings.ndim != 4 or readings.shape[1:] != (R, S, C) or len(readings) == 0:
            raise ValueError(
                f"readings must have shape (repeats, {R} runs, {S} speeds, {C} sensors); got {readings.shape}"
            )
        self._check_readings(readings)
        if self.amplitudes_only:
            readings = np.abs(readings).astype(complex)
        keep(self, readings=readings)
        shapes = {
            "weights": (R, P),
            "index": (R,),
            "steps": (2, *readings.shape),
            "covariance": (2, 2, *readings.shape),
        }
        for name, shape in shapes.items():
            if getattr(self, name) is None:
                continue
            array = np.array(getattr(self, name), dtype=complex if name == "weights" else float)
            there = np.ones(shape, dtype=bool) if len(shape) < 3 else ~np.isnan(readings)
            if array.shape != shape or not np.isfinite(array[..., there]).all():
                raise ValueError(f"{name} must be finite, of shape {shape}; got {array.shape}")
            array[..., ~there] = np.nan
            keep(self, **{name: array})
        if self.steps is not None and (self.steps < 0).any():
            raise ValueError("steps must be finite, of shape (2, …) and ≥ 0")

    def _check_readings(self, readings: ComplexArray) -> None:
        missing = np.isnan(readings)
        bad = np.isinf(readings)
        bad[0] |= missing[0]
        # a reading after a gap would be lost: repeats are numbered without holes
        bad[1:] |= ~missing[1:] & missing[:-1]
        if bad.any():
            _, r, s, c = np.argwhere(bad)[0]
            raise ValueError(
                f"the reading of sensor {self.sensors[c]!r} in run {self.runs[r]!r} at "
                f"{self.speeds[s] * RPM:.6g} rpm is missing or infinite: every sensor must be read in every "
                "run at every speed; leave out the sensor or the speed, or repeat the run"
            )

    def with_phases(self) -> Trials:
        """The same; ValueError where their phases are not known."""
        if self.amplitudes_only:
            raise ValueError(
                "these readings have no phases: they are balanced by rotorid balance "
                "(balancing.balance_without_phase), and tell nothing else"
            )
        return self

    @property
    def turned(self) -> Trials:
        """The runs with one plane more, the first, that stands for the index: see `special_runs`."""
        if self.index is None:
            return self
        turn = np.exp(1j * self.index)
        weights = np.column_stack((turn - 1, self.weights * turn[:, None]))
        return replace(self, planes=(TURNED, *self.planes), weights=weights, index=None)

    @property
    def special(self) -> str:
        """Why the runs give a correction and nothing else; empty: they are ordinary ones."""
        if self.relative is not None:
            return "a trial weight is not known: that gives a correction, and nothing else"
        return "" if self.index is None else "an index gives the rotor's correction, and nothing else"

    @property
    def repeats(self) -> IntArray:
        """How many times each reading was taken, shape (R, S, C)."""
        return np.asarray(np.sum(~np.isnan(self.readings), axis=0), dtype=np.int64)

    @property
    def mean(self) -> ComplexArray:
        """Mean of the repeated readings, shape (R, S, C)."""
        return np.asarray(np.nansum(self.readings, axis=0) / self.repeats)


@dataclass(frozen=True, eq=False)
class Limits:
    """Limits of a correction; everything that is not limited is infinite, or has no arcs.

    Attributes
    ----------
    max_weight
        Largest total weight of each plane on the bare rotor, kg or kg·m, shape (P,).
    residual
        Largest predicted amplitude of each reading, shape (S, C).
    forbidden
        Arcs of each plane where no weight can be mounted (the ends of an arc are allowed).

    Raises
    ------
    ValueError
        Limits that are not above 0 (a plane without a weight is left out), arcs that are none.
    """

    max_weight: FloatArray
    residual: FloatArray
    forbidden: tuple[tuple[Arc, ...], ...]

    def __post_init__(self) -> None:
        for name in ("max_weight", "residual"):
            array = np.array(getattr(self, name), dtype=np.float64)
            if not (array > 0).all():
                raise ValueError(f"the limits {name} must be numbers above 0 (infinite for none)")
            keep(self, **{name: array})
        arcs = np.array([arc for plane in self.forbidden for arc in plane]).reshape(-1, 2)
        start, width = arcs.T
        whole = np.isfinite(start) & (width > 0) & (width <= 2 * np.pi)
        if not whole.all() or len(self.forbidden) != len(self.max_weight):
            raise ValueError(
                f"every plane needs arcs of 0 to 2π from a finite angle, or none; got {arcs.tolist()}"
            )

    @classmethod
    @cache
    def none(cls, S: int, C: int, P: int) -> Limits:
        """No limits at all, for S speeds, C sensors and P planes."""
        return cls(np.full(P, np.inf), np.full((S, C), np.inf), ((),) * P)

    @property
    def any(self) -> bool:
        """Whether anything is limited."""
        limited = np.isfinite(np.append(self.max_weight, self.residual)).any()
        return bool(limited or any(self.forbidden))

    def pick(self, speeds: Sequence[int], planes: Sequence[int]) -> Limits:
        """Limits of some speeds and planes, by index."""
        return Limits(
            self.max_weight[list(planes)],
            self.residual[list(speeds)],
            tuple(self.forbidden[p] for p in planes),
        )


def keep(made: object, **values: object) -> None:
    """Set attributes of a frozen object; arrays are read-only then."""
    for name, value in values.items():
        if isinstance(value, np.ndarray):
            value.flags.writeable = False
        object.__setattr__(made, name, value)


def check_names(names: Sequence[str], what: str, *, empty: bool = False) -> tuple[str, ...]:
    """Names as a tuple.

    Raises
    ------
    ValueError
        For repeated names, and for none at all unless `empty`.
    """
    out = tuple(map(str, names))
    if len(set(out)) < max(len(out), 1 - empty):
        raise ValueError(f"{what} need different names, at least one; got {', '.join(out) or 'none'}")
    return out


def check_speeds(speeds: FloatArray) -> FloatArray:
    """Speeds as an array (S,).

    Raises
    ------
    ValueError
        For a wrong shape, no speed, speeds that are not finite or not positive, and repeated speeds.
    """
    out = np.array(speeds, dtype=np.float64)
    each = set(out.ravel().tolist())
    if out.shape != (len(each),) or not each or not all(0 < speed < np.inf for speed in each):
        raise ValueError(
            f"speeds must be different, finite and greater than zero, of shape (S,); got {out.tolist()} rad/s"
        )
    return out
