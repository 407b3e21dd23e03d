"""Whirl: complex eigenvalues and shapes of the rotor turning at a speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fem.matrices.banded_matrices import assemble
from fem.matrices.lateral_planes import both_planes
from fem.model.rotor import Rotor, whole
from fem.orbits import DIRECTION_NAMES, whirl_direction
from fem.solvers.eigen import finite_modes
from fem.solvers.reduced_whirl import solve_whirl
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.checks import checked_speeds
from rotorid.base.rpm import RPM, speed_text

if TYPE_CHECKING:
    import pandas as pd

_USUAL = 6  # modes, where nothing else is asked for


@dataclass(frozen=True, eq=False)
class WhirlModes:
    """Modes of the rotor at one speed, by rising frequency.

    Attributes
    ----------
    speed
        rad/s.
    eigenvalues
        λ with Im λ > 0, rad/s, shape (n,): the motion is Re(shape · e^{λt}).
    x, y
        Complex shapes in both planes, shape (N, n), the farthest node at amplitude 1.
    real
        Eigenvalues of motions that do not oscillate (overdamped, or running away), rad/s, as far as they
        were found, slowest first.
    error
        Estimated relative error of the eigenvalues.
    rotor
        The rotor.
    warnings
        What the reader must know.
    """

    speed: float
    eigenvalues: ComplexArray
    x: ComplexArray
    y: ComplexArray
    real: FloatArray
    error: float
    rotor: Rotor
    warnings: tuple[str, ...] = ()

    @property
    def frequencies(self) -> FloatArray:
        """Whirl frequencies |Im λ|, rad/s, shape (n,)."""
        return np.asarray(self.eigenvalues.imag)

    @property
    def log_decrements(self) -> FloatArray:
        """Logarithmic decrements −2π Re λ / |Im λ|, shape (n,); negative: unstable."""
        return np.asarray(-2 * np.pi * self.eigenvalues.real / self.eigenvalues.imag)

    @property
    def direction(self) -> FloatArray:
        """1 forward, −1 backward, 0 neither (a line, or different along the rotor), shape (n,)."""
        return whirl_direction(self.x.T, self.y.T)

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "speed_rad_s": self.speed,
            "frequencies_rad_s": self.frequencies.tolist(),
            "log_decrements": self.log_decrements.tolist(),
            "direction": [DIRECTION_NAMES[float(d)] for d in self.direction],
            "real_eigenvalues_rad_s": self.real.tolist(),
            "warnings": list(self.warnings),
        }

    def to_frame(self) -> pd.DataFrame:
        """One row per mode: frequency, log decrement, direction."""
        import pandas as pd

        return pd.DataFrame(
            {
                "mode": range(1, self.eigenvalues.size + 1),
                "frequency_rad_s": self.frequencies,
                "log_decrement": self.log_decrements,
                "direction": [DIRECTION_NAMES[float(d)] for d in self.direction],
            }
        )

    def summary(self) -> str:
        """The modes as text."""
        lines = [
            f"Whirl at {speed_text(self.speed)}",
            "mode     rad/s         rpm   log dec  direction",
        ]
        for k, (omega, delta, way) in enumerate(
            zip(self.frequencies, self.log_decrements, self.direction, strict=True), start=1
        ):
            rounded = round(float(delta), 4) + 0.0  # no negative zero
            lines.append(
                f"{k:4d}{omega:12.4f}{omega * RPM:12.2f}{rounded:10.4f}  {DIRECTION_NAMES[float(way)]}"
            )
        return "\n".join([*lines, *(f"Warning: {text}" for text in self.warnings)])


def whirl_modes(rotor: Rotor, speed: float, n: int | None = None) -> WhirlModes:
    """Compute the whirl modes of lowest frequency at a speed, in a reduced basis: to 1e-7 and better.

    Parameters
    ----------
    rotor
        The rotor with all its supports.
    speed
        rad/s.
    n
        How many modes that oscillate, by default 6 or all there are; forward and backward whirl count apart.

    Raises
    ------
    ValueError
        If the speed is impossible or outside the table of a support, the model has fewer modes, or the mesh
        is too fine for float64.
    """
    speeds = checked_speeds([speed])
    P = both_planes(rotor)
    n = checked_number(rotor, n)
    solution = solve_whirl(P, speeds, n)
    values, real = solution.found.values[0], solution.found.real[0]
    still = int(solution.found.still[0])
    there = np.isfinite(values)
    values = values[there]
    shapes = solution.Q.nodes(solution.found.vectors[0, there])
    if not values.size:
        raise ValueError(
            f"the rotor has no oscillating mode at {speed:.6g} rad/s: all motions are overdamped"
        )
    values, x, y = in_both_planes(values, shapes)
    size = np.sqrt((np.abs(x) ** 2 + np.abs(y) ** 2).max(axis=1))
    x, y = x.T / size, y.T / size
    warnings = missing_modes(P.planes, real, still, values.size, n)
    return WhirlModes(float(speeds[0]), values, x, y, real, solution.error, rotor, warnings)


def in_both_planes(
    values: ComplexArray, shapes: ComplexArray
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Eigenvalues with Im λ > 0 and their x and y, from (…) and (…, planes, N)."""
    if shapes.shape[-2] == 2:
        return values, shapes[..., 0, :], shapes[..., 1, :]
    z = shapes[..., 0, :]
    back = (values.imag < 0)[..., None]
    # z = φ e^{λt}: x is its real part, y its imaginary part; the conjugate of λ has the positive frequency.
    x = np.where(back, z.conj(), z)
    y = np.where(back, 1j, -1j) * x
    return np.where(values.imag < 0, values.conj(), values), x, y


def missing_modes(planes: int, real: FloatArray, still: int, found: int, n: int) -> tuple[str, ...]:
    """What is not among the modes."""
    texts = []
    if found < n:
        texts.append(f"only {found} of {n} modes oscillate, the others are overdamped")
    rigid = still // 2
    if rigid:
        texts.append(f"rigid-body motions that nothing holds (eigenvalue 0, {still} times) are left out")
    growing = real[real > 0] if planes == 2 else real[real > 0][:1]
    if growing.size:
        texts.append(
            f"the rotor runs away without oscillating (eigenvalue {growing.max():.4g} 1/s): "
            "a support pushes it aside; check negative stiffness"
        )
    return tuple(texts)


def checked_number(rotor: Rotor, n: int | None) -> int:
    """How many modes to look for, by default 6 or all there are.

    Raises
    ------
    ValueError
        If the model has fewer.
    """
    available = available_modes(rotor)
    n = min(_USUAL, available) if n is None else whole(n, "the number of modes")
    if not 1 <= n <= available:
        raise ValueError(
            f"{n} modes cannot be found: the model has 1 to {available}; "
            "choose n in this range, or divide the shaft into more elements"
        )
    return n


def available_modes(rotor: Rotor) -> int:
    """How many modes can oscillate at most: two for each unknown of a plane that moves mass."""
    pedestals = sum(s.pedestal is not None and s.pedestal.mass > 0 for s in rotor.supports)
    return 2 * (finite_modes(assemble(rotor)) + pedestals)
