"""What modes answer to an unbalance while the speed changes.

With the angle θ(t), Ω = θ' and s = −ζω + iω√(1 − ζ²), z'' + 2ζω z' + ω² z = ω² (Ω² − iΩ') e^{iθ} has the
answer z = (z_s − z_s̄) / (s − s̄), where z_s' = s z_s + ω² (Ω² − iΩ') e^{iθ}; a vector is z e^{−iθ}. From step
to step of a uniform grid z_s is exact but for a Gauss quadrature of the force (docs/theory/run_up.md).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray, IntArray

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

_GAUSS = np.polynomial.legendre.leggauss(8)
NODES, WEIGHTS = (_GAUSS[0] + 1) / 2, _GAUSS[1] / 2
STEP = 2.0
"""Angle of a step at the highest speed, rad: the quadrature is good to 1e-10."""
MOST_STEPS = 2_000_000


@dataclass(frozen=True, eq=False)
class Speed:
    """Speed over time, s, as a spline, and the force of a unit unbalance.

    Attributes
    ----------
    omega
        rad/s.
    first, last
        Times that it is known for.
    """

    omega: BSpline
    first: float
    last: float

    @cached_property
    def step(self) -> float:
        """Of the grid, s."""
        ends = np.linspace(self.first, self.last, 1000)
        return STEP / float(self.omega(ends).max())

    def force(self, time: FloatArray) -> ComplexArray:
        """(Ω² − iΩ') e^{iθ}, with θ = 0 at the first time."""
        return np.asarray(self.growth(time) * np.exp(1j * self.angle(time)))

    def growth(self, time: FloatArray) -> ComplexArray:
        """Ω² − iΩ'."""
        return np.asarray(self.omega(time) ** 2 - 1j * self.omega.derivative()(time))

    def angle(self, time: FloatArray) -> FloatArray:
        """θ, rad."""
        turned = self.omega.antiderivative()
        return np.asarray(turned(time) - turned(self.first))

    @cached_property
    def forces(self) -> ComplexArray:
        """At the nodes of each step."""
        steps = np.arange(np.floor((self.last - self.first) / self.step))
        return self.force(self.first + self.step * (steps[:, None] + NODES))


@dataclass(frozen=True, eq=False)
class SweptAnswers:
    """Answers g_r at times (n,), Ω² − iΩ' and 1; for a constant speed those of `SteadyAnswers`."""

    speed: Speed
    time: FloatArray
    damping: tuple[float, float] = (0.0, 0.99)
    reference: float = 1.0

    @cached_property
    def omega(self) -> FloatArray:
        """Speeds (n,), rad/s."""
        return np.asarray(self.speed.omega(self.time))

    def take(self, rows: IntArray) -> SweptAnswers:
        """Those of some readings."""
        return replace(self, time=self.time[rows])

    def at(self, omega: FloatArray) -> SweptAnswers:
        """Those when the speed passes others."""
        order = np.argsort(self.omega)
        return replace(self, time=np.interp(omega, self.omega[order], self.time[order]))

    def basis(self, q: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """What R, a and b multiply (n, k + 2), and its slopes by q = (ω_r, ζ_r), (n, 2k)."""
        answers = [self._answer(omega, zeta) for omega, zeta in np.reshape(q, (2, -1)).T]
        own, by_omega, by_zeta = np.moveaxis(np.array(answers), 0, -1)
        constant = np.full((len(self.time), 1), q[0] ** 2)  # as it is for a steady speed
        return np.hstack((own, self.speed.growth(self.time)[:, None], constant)), np.hstack(
            (by_omega, by_zeta)
        )

    def _answer(self, omega: float, zeta: float) -> ComplexArray:
        """G of a mode and its slopes by ω and ζ, (3, n)."""
        root = np.sqrt(1 - zeta**2)
        s, by_zeta = omega * (-zeta + 1j * root), omega * (-1 - 1j * zeta / root)
        (z, w), (z_, w_) = self._first_order(s), self._first_order(np.conj(s))
        g = (z - z_) / (2j * omega * root)
        slopes = [
            (w * ds - w_ * np.conj(ds)) / (2j * omega * root) + g * more
            for ds, more in ((s / omega, 1 / omega), (by_zeta, zeta / root**2))
        ]
        return omega**2 * np.array((g, *slopes)) * self._back

    @cached_property
    def _back(self) -> ComplexArray:
        return np.asarray(np.exp(-1j * self.speed.angle(self.time)))

    @cached_property
    def _rests(self) -> tuple[IntArray, FloatArray, ComplexArray]:
        """Of each time the grid's last step before it, what is left then, and the force at its nodes."""
        since = self.time - self.speed.first
        steps = np.minimum(np.floor(since / self.speed.step), len(self.speed.forces)).astype(np.int64)
        rest = since - steps * self.speed.step
        return steps, rest, self.speed.force(self.time[:, None] - rest[:, None] * (1 - NODES))

    def _first_order(self, s: complex) -> tuple[ComplexArray, ComplexArray]:
        """Z of z' = s z + force, which begins as for a steady speed, at each time, and its slope by s."""
        from scipy.signal import lfilter

        h, (steps, rest, last) = self.speed.step, self._rests
        start = np.array([self.speed.first])
        speed, rate = float(self.speed.omega(start)[0]), float(self.speed.omega.derivative()(start)[0])
        f, p = speed**2 - 1j * rate, 1j * speed - s
        df, dp = 2 * speed * rate, 1j * rate  # z = f/p − (f/p)'/p to the first order of the rate
        z0, w0 = f / p - df / p**2 + f * dp / p**3, f / p**2 - 2 * df / p**3 + 3 * f * dp / p**4
        left = h * (1 - NODES)
        kernel, decay = h * WEIGHTS * np.exp(s * left), np.exp(s * h)

        def filtered(x: ComplexArray, first: complex) -> ComplexArray:
            rows = lfilter([1.0], [1.0, -decay], x, zi=[decay * first])[0]
            return np.concatenate(([first], rows))

        z = filtered(self.speed.forces @ kernel, z0)
        w = filtered(h * decay * z[:-1] + self.speed.forces @ (kernel * left), w0)
        left = rest[:, None] * (1 - NODES)
        kernel, decay = rest[:, None] * WEIGHTS * np.exp(s * left), np.exp(s * rest)
        at = decay * z[steps] + (kernel * last).sum(axis=1)
        return at, decay * (w[steps] + rest * z[steps]) + (kernel * left * last).sum(axis=1)


def swept_answers(time: FloatArray, speeds: FloatArray) -> SweptAnswers:
    """Answers at rising times (n,), s, between which the speed (n,), rad/s, is smooth (by cross-validation).

    Raises
    ------
    ValueError
        For fewer than 5 times, and for a sweep so long that its acceleration cannot matter.
    """
    from scipy.interpolate import make_smoothing_spline

    if len(time) < 5:
        raise ValueError("a sweep needs vectors at 5 times")
    speed = Speed(make_smoothing_spline(time, speeds), float(time[0]), float(time[-1]))
    if not (speed.last - speed.first) / speed.step < MOST_STEPS:
        raise ValueError(
            f"the sweep takes {speed.last - speed.first:.4g} s, too long to be followed turn by turn, and so "
            "long that its acceleration does not matter: fit it as steady, with --acceleration 0"
        )
    return SweptAnswers(speed, time)
