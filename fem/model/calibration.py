"""What a calibration found of a rotor: values of parameters, their covariance, what the model leaves."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import FloatArray, read_only

_ROUNDING = 1e-9
"""Of correlations: what lies below is no contradiction."""


def is_reading(path: str) -> bool:
    """Whether it is `probe[NAME].angle`, `.gain` or `key_phasor.angle`: of readings, no number of a rotor.

    Angles in degrees with the rotation: the true one less the one that the job says. A gain is what is
    read over what is there.
    """
    return re.fullmatch(r"probe\[[^*]+\]\.(angle|gain)|key_phasor\.angle", path) is not None


@dataclass(frozen=True, eq=False)
class Calibration:
    """Parameters that were fitted to readings, and how well the rotor with them agrees.

    Attributes
    ----------
    names
        Paths of the parameters, as `fem.model.rotor_parameters` has them, length n.
    values
        What they were found to be, shape (n,); scales relative to the rotor that was calibrated.
    covariance
        Of the parameters as they now stand in the rotor, shape (n, n): of absolute ones in their unit, of a
        scale relative to the rotor as it is now.
    speeds
        Where the model was compared with readings, rad/s, shape (S,).
    sensors
        Of which it was, length C.
    lack_of_fit
        Relative standard deviation of a coefficient that the model leaves, shape (S, C).
    needs_trial_run
        Whether the data contradict the model, so that its coefficients alone are not to be trusted.
    data
        Files it was made from, `{name: SHA-256}`: they must not count twice.

    Raises
    ------
    ValueError
        For arrays of another shape, a covariance that is not symmetric or has negative variances, a negative
        lack of fit, a name that comes twice.
    """

    names: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    speeds: FloatArray = field(default_factory=lambda: np.zeros(0))
    sensors: tuple[str, ...] = ()
    lack_of_fit: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    needs_trial_run: bool = False
    data: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        n, S, C = len(self.names), np.size(self.speeds), len(self.sensors)
        shapes = {"values": (n,), "covariance": (n, n), "speeds": (S,), "lack_of_fit": (S, C)}
        for name, shape in shapes.items():
            array = np.array(getattr(self, name), dtype=float)
            if array.shape != shape and array.size + np.prod(shape) > 0:
                raise ValueError(f"calibration: {name} must have the shape {shape}, not {array.shape}")
            if not np.isfinite(array).all() or (name in ("speeds", "lack_of_fit") and (array < 0).any()):
                raise ValueError(f"calibration: {name} must be finite, speeds and lack of fit not negative")
            array = array.reshape(shape)
            read_only(array)
            object.__setattr__(self, name, array)
        for name in ("names", "sensors"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
            if len({*getattr(self, name)}) < len(getattr(self, name)):
                raise ValueError(f"calibration: one of its {name} comes twice")
        object.__setattr__(self, "data", dict(self.data))
        R = self.correlation
        if not np.allclose(R, R.T, rtol=0.0, atol=_ROUNDING):
            raise ValueError("calibration: the covariance must be symmetric")
        if (
            min(np.diag(self.covariance), default=0.0) < 0
            or min(np.linalg.eigvalsh(R), default=0.0) < -_ROUNDING
        ):
            raise ValueError("calibration: the covariance must not be negative in any direction")

    @property
    def readings(self) -> dict[str, float]:
        """Those of the parameters that are no numbers of a rotor: angles in degrees, and gains."""
        found = zip(self.names, self.values.tolist(), strict=True)
        return {name: value for name, value in found if is_reading(name)}

    @property
    def std(self) -> FloatArray:
        """Standard deviations, shape (n,)."""
        return np.sqrt(np.abs(np.diag(self.covariance)))

    @property
    def correlation(self) -> FloatArray:
        """Correlations of the parameters, shape (n, n); 0 of what has no error."""
        scale = np.where(self.std > 0, self.std, 1.0)
        return np.asarray(self.covariance / scale / scale[:, None])

    def columns(self) -> FloatArray:
        """Principal columns L of the covariance, L Lᵀ = covariance, shape (n, m).

        Those of the correlations, so that units do not count, with an eigenvalue above 1e-12 of the largest.
        """
        values, V = np.linalg.eigh(self.correlation)
        kept = values > 1e-12 * max(values, default=0.0)
        return np.asarray(self.std[:, None] * V[:, kept] * np.sqrt(values[kept]))

    def lack_at(self, speeds: ArrayLike, sensors: Sequence[str]) -> FloatArray:
        """Lack of fit at other speeds, rad/s, and sensors, shape (S', C').

        That of the nearest speed; of a sensor that was not compared the largest of all; 0 where nothing was.
        """
        omega = np.atleast_1d(np.asarray(speeds, dtype=float))
        if not self.lack_of_fit.size:
            return np.zeros((omega.size, len(sensors)))
        rows = self.lack_of_fit[np.abs(omega[:, None] - self.speeds).argmin(axis=1)]
        rows = np.column_stack((rows, rows.max(axis=1)))
        return rows[:, [self.sensors.index(c) if c in self.sensors else -1 for c in sensors]]
