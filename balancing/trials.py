"""Runs of a rotor: what the sensors read and which weights were mounted, and what weights must keep to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from balancing.conventions import Labels
from rotorid.base.arrays import AnyArray, BoolArray, ComplexArray, FloatArray, IntArray
from rotorid.base.complex_numbers import off_axis as off_axis
from rotorid.base.rpm import RPM
from rotorid.base.suggestions import did_you_mean

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
        values = {"amplitude": self.amplitude, "phase": self.phase, "floor": self.floor}
        for name, value in values.items():
            if not np.isfinite(value) or value < 0:
                raise ValueError(f"the {name} error of a reading must be a finite number ≥ 0, not {value}")
        if not any(values.values()):
            raise ValueError(
                "the stated errors of a reading are all zero, and no instrument is that good: "
                "state amplitude, phase or floor, or state no errors at all"
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
        that shows whole degrees rounds by up to half of one. Shape (2, K, R, S, C), or (2, R, S, C) for
        K = 1, NaN where there is no reading; None where they are not rounded.
    covariance
        Of real and imaginary part of each reading, as its instrument measured it: shape (2, 2, K, R, S, C),
        NaN where there is no reading; None: nothing measured it.
    placement
        Stated errors of the mounted weights; zero: not stated.
    drift
        Stated drift of the readings from the first to the last run, relative, one standard deviation.

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

    def __post_init__(self) -> None:
        for name in ("runs", "sensors", "planes"):
            names = check_names(getattr(self, name), name, empty=name == "planes")
            object.__setattr__(self, name, names)
        object.__setattr__(self, "speeds", check_speeds(self.speeds))
        R, S, C, P = len(self.runs), len(self.speeds), len(self.sensors), len(self.planes)
        readings = np.array(self.readings, dtype=complex)
        if readings.ndim == 3:
            readings = readings[None]
        if readings.ndim != 4 or readings.shape[1:] != (R, S, C) or len(readings) == 0:
            raise ValueError(
                f"readings must have shape (repeats, {R} runs, {S} speeds, {C} sensors); got {readings.shape}"
            )
        self._check_readings(readings)
        weights = np.array(self.weights, dtype=complex)
        if weights.shape != (R, P):
            raise ValueError(f"weights must have shape ({R} runs, {P} planes); got {weights.shape}")
        if not np.isfinite(weights).all():
            r, p = np.argwhere(~np.isfinite(weights))[0]
            raise ValueError(
                f"the weight in plane {self.planes[p]!r} of run {self.runs[r]!r} is not a finite number"
            )
        self._freeze("readings", readings)
        self._freeze("weights", weights)
        missing = np.isnan(readings)
        if self.steps is not None:
            steps = np.array(self.steps, dtype=np.float64)
            self._freeze("steps", steps[:, None] if steps.ndim == 4 else steps, (2, *readings.shape), missing)
            if (np.nan_to_num(self.steps) < 0).any():
                raise ValueError("the step in which a reading is written must be a finite number ≥ 0")
        if self.covariance is not None:
            covariance = np.array(self.covariance, dtype=np.float64)
            self._freeze("covariance", covariance, (2, 2, *readings.shape), missing)

    def _freeze(
        self, name: str, array: AnyArray, shape: tuple[int, ...] = (), missing: BoolArray | None = None
    ) -> None:
        """Keep an array, read-only; NaN where the readings have none, else finite."""
        if missing is not None:
            if array.shape != shape or not (missing | np.isfinite(array)).all():
                raise ValueError(f"{name} must be finite, of shape {shape}, or None; got {array.shape}")
            array[..., missing] = np.nan
        array.flags.writeable = False
        object.__setattr__(self, name, array)

    def _check_readings(self, readings: ComplexArray) -> None:
        missing = np.isnan(readings)
        bad = np.isinf(readings)
        bad[0] |= missing[0]
        # a reading after a gap would be lost: repeats are numbered without holes
        bad[1:] |= ~missing[1:] & missing[:-1]
        if bad.any():
            k, r, s, c = np.argwhere(bad)[0]
            rpm = self.speeds[s] * RPM
            gap = np.isnan(readings[: k + 1, r, s, c]).any()
            raise ValueError(
                f"the reading of sensor {self.sensors[c]!r} in run {self.runs[r]!r} at {rpm:.6g} rpm is "
                f"{'missing' if gap else 'infinite'}: every sensor must be read in every run at every speed; "
                "leave out the sensor or the speed, or repeat the run"
            )

    @property
    def repeats(self) -> IntArray:
        """How many times each reading was taken, shape (R, S, C)."""
        return np.asarray(np.sum(~np.isnan(self.readings), axis=0), dtype=np.int64)

    @property
    def mean(self) -> ComplexArray:
        """Mean of the repeated readings, shape (R, S, C)."""
        if len(self.readings) == 1:
            return np.asarray(self.readings[0])
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
        Negative or NaN limits, arcs that are none, planes without an angle that is left.
    """

    max_weight: FloatArray
    residual: FloatArray
    forbidden: tuple[tuple[Arc, ...], ...]

    def __post_init__(self) -> None:
        for name in ("max_weight", "residual"):
            array = np.array(getattr(self, name), dtype=np.float64)
            if np.isnan(array).any() or (array < 0).any():
                raise ValueError(f"the limits {name} must be numbers ≥ 0 (infinite for none)")
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        if len(self.forbidden) != len(self.max_weight):
            raise ValueError("there must be arcs, or none, for every plane")
        for arcs in self.forbidden:
            for start, width in arcs:
                if not (np.isfinite(start) and 0 < width <= 2 * np.pi):
                    raise ValueError(f"an arc of {width} rad from {start} rad is none")

    @classmethod
    def none(cls, S: int, C: int, P: int) -> Limits:
        """No limits at all, for S speeds, C sensors and P planes."""
        return cls(np.full(P, np.inf), np.full((S, C), np.inf), ((),) * P)

    @classmethod
    def of(
        cls,
        speeds: int,
        sensors: Sequence[str],
        planes: Sequence[str],
        *,
        max_weight: Mapping[str, float] | None = None,
        residual: Mapping[str, float | FloatArray] | None = None,
        forbidden: Mapping[str, Sequence[Arc]] | None = None,
    ) -> Limits:
        """Limits by name of plane and sensor; a sensor's limit is a number, or one per speed (S,)."""
        weight, amplitude = np.full(len(planes), np.inf), np.full((speeds, len(sensors)), np.inf)
        arcs: list[tuple[Arc, ...]] = [() for _ in planes]
        for name, value in (max_weight or {}).items():
            weight[_place(name, planes, "plane")] = value
        for name, size in (residual or {}).items():
            amplitude[:, _place(name, sensors, "sensor")] = size
        for name, own in (forbidden or {}).items():
            arcs[_place(name, planes, "plane")] = tuple(own)
        return cls(weight, amplitude, tuple(arcs))

    @property
    def any(self) -> bool:
        """Whether anything is limited."""
        return bool(
            np.isfinite(self.max_weight).any() or np.isfinite(self.residual).any() or any(self.forbidden)
        )

    def pick(self, speeds: Sequence[int], planes: Sequence[int]) -> Limits:
        """Those of some speeds and planes, by index."""
        return Limits(
            self.max_weight[list(planes)],
            self.residual[list(speeds)],
            tuple(self.forbidden[p] for p in planes),
        )


def check_names(names: Sequence[str], what: str, *, empty: bool = False) -> tuple[str, ...]:
    """Names as a tuple.

    Raises
    ------
    ValueError
        For repeated names, and for none at all unless `empty`.
    """
    out = tuple(str(n) for n in names)
    if not out and not empty:
        raise ValueError(f"there are no {what}")
    twice = sorted({n for n in out if out.count(n) > 1})
    if twice:
        raise ValueError(f"{what} need different names; found twice: {', '.join(twice)}")
    return out


def check_speeds(speeds: FloatArray) -> FloatArray:
    """Speeds as a read-only array (S,).

    Raises
    ------
    ValueError
        For a wrong shape, no speed, speeds that are not finite or not positive, and repeated speeds.
    """
    out = np.array(speeds, dtype=np.float64)
    if out.ndim != 1 or not len(out):
        raise ValueError(f"speeds must have shape (S,), at least one; got {out.shape}")
    if not (np.isfinite(out) & (out > 0)).all():
        raise ValueError(f"speeds must be finite and greater than zero; got {out.tolist()} rad/s")
    if len(set(out.tolist())) < len(out):
        raise ValueError(f"every speed may stand only once; got {out.tolist()} rad/s")
    out.flags.writeable = False
    return out


def _place(name: str, names: Sequence[str], what: str) -> int:
    if name not in names:
        hint = did_you_mean(str(name), names)
        raise ValueError(f"there is no {what} {name!r}{hint}; there are {', '.join(map(repr, names))}")
    return list(names).index(name)
