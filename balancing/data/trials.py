"""Runs of a rotor: what the sensors read and which weights were mounted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from balancing.data.conventions import Labels
from rotorid.base.arrays import ComplexArray, FloatArray, IntArray
from rotorid.base.rpm import RPM


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
    """One standard deviation of what changes from run to run: of a reading, and in the unit inside."""

    relative: float
    floor: float = 0.0


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
        for name, array in (("readings", readings), ("weights", weights)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        if self.steps is not None:
            object.__setattr__(self, "steps", self._checked_steps(self.steps))
        if self.covariance is not None:
            object.__setattr__(self, "covariance", self._checked_covariance(self.covariance))

    def _checked_steps(self, given: FloatArray) -> FloatArray:
        steps = np.array(given, dtype=np.float64)
        if steps.ndim == 4:
            steps = steps[:, None]
        if steps.shape != (2, *self.readings.shape):
            wanted = (2, *self.readings.shape)
            raise ValueError(f"steps must have shape {wanted} or be None; got {steps.shape}")
        missing = np.isnan(self.readings)
        if not (missing | (np.isfinite(steps) & (steps >= 0))).all():
            raise ValueError("the step in which a reading is written must be a finite number ≥ 0")
        steps[:, missing] = np.nan
        steps.flags.writeable = False
        return steps

    def _checked_covariance(self, given: FloatArray) -> FloatArray:
        covariance, wanted = np.array(given, dtype=np.float64), (2, 2, *self.readings.shape)
        missing = np.isnan(self.readings)
        if covariance.shape != wanted or not (missing | np.isfinite(covariance)).all():
            raise ValueError(f"covariance must be finite, of shape {wanted}, or None; got {covariance.shape}")
        covariance[:, :, missing] = np.nan
        covariance.flags.writeable = False
        return covariance

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


def off_axis(weights: ArrayLike) -> bool:
    """Whether any of these complex weights stands at another angle than 0° and 180°."""
    w = np.asarray(weights, dtype=complex)
    return bool((np.abs(w.imag) > 1e-9 * np.abs(w)).any())


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
