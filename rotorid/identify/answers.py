"""What modes answer to an excitation, reading by reading: at held frequencies, and while the speed changes.

With the angle θ(t), Ω = θ' and s = −ζω + iω√(1 − ζ²), z'' + 2ζω z' + ω² z = ω² (Ω² − iΩ') e^{iθ} has the
answer z = (z_s − z_s̄) / (s − s̄), where z_s' = s z_s + ω² (Ω² − iΩ') e^{iθ}; a vector is z e^{−iθ}. From step
to step of a uniform grid z_s is exact but for a Gauss quadrature of the force (docs/theory/identify.md).
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
BESIDE = 2e-6
"""Of ω: poles that are so much apart show the slope between them."""


@dataclass(frozen=True, eq=False)
class SteadyAnswers:
    """g = e / (1 − (ω/ω_r)² + 2 i ζ_r ω/ω_r), e and e/ω² under an excitation e (n,) at frequencies ω (n,).

    The excitation is, but for a factor, what a displacement far below all resonances follows; `damping` is
    the lowest and highest ratio that the answers are known for.
    """

    omega: FloatArray
    excitation: ComplexArray
    damping: tuple[float, float] = (-1.0, 1.0)

    def basis(self, q: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """The answers (n, k + 2), and their slopes by q = (ω_r, ζ_r), (n, 2k)."""
        natural, damping = np.split(q, 2)
        u, e = self.omega[:, None] / natural, self.excitation[:, None]
        g = 1 / (1 - u**2 + 2j * damping * u)
        slopes = -np.tile(g**2, 2) * np.hstack(((2 * u**2 - 2j * damping * u) / natural, 2j * u))
        return e * np.hstack((g, u[:, :1] ** 0, u[:, :1] ** -2)), e * slopes

    def take(self, rows: IntArray) -> SteadyAnswers:
        """Those of some readings."""
        return replace(self, omega=self.omega[rows], excitation=self.excitation[rows])

    def at(self, omega: FloatArray) -> SteadyAnswers:
        """Those at other frequencies; excitations lie on lines over ω², as the force of an unbalance does."""
        order = np.argsort(self.omega)
        excitation = np.interp(omega**2, self.omega[order] ** 2, self.excitation[order])
        return replace(self, omega=omega, excitation=excitation)


@dataclass(frozen=True, eq=False)
class SweptAnswers:
    """Answers g_r at times (n,), Ω² − iΩ' and 1; for a constant speed those of `SteadyAnswers`.

    `speed` is Ω over time, known between the `ends`.
    """

    speed: BSpline
    ends: tuple[float, float]
    time: FloatArray
    damping: tuple[float, float] = (0.0, 0.99)
    excitation: float = 1.0

    @cached_property
    def omega(self) -> FloatArray:
        """Speeds (n,), rad/s."""
        return np.asarray(self.speed(self.time))

    def take(self, rows: IntArray) -> SweptAnswers:
        """Those of some readings."""
        return replace(self, time=self.time[rows])

    def at(self, omega: FloatArray) -> SweptAnswers:
        """Those when the speed passes others."""
        order = np.argsort(self.omega)
        return replace(self, time=np.interp(omega, self.omega[order], self.time[order]))

    def basis(self, q: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """The answers (n, k + 2), and their slopes by q = (ω_r, ζ_r), (n, 2k)."""
        back = np.exp(-1j * self._angle(self.time))
        modes = [self._answer(omega, zeta) * back for omega, zeta in np.reshape(q, (2, -1)).T]
        g, by_omega, by_zeta = np.moveaxis(np.array(modes), 0, -1)
        force = (self._force(self.time) * back)[:, None]
        constant = np.full((len(self.time), 1), q[0] ** 2)  # as it is for a steady speed
        return np.hstack((g, force, constant)), np.hstack((by_omega, by_zeta))

    def _angle(self, time: FloatArray) -> FloatArray:
        """θ, 0 at the first time."""
        turned = self.speed.antiderivative()
        return np.asarray(turned(time) - turned(self.ends[0]))

    def _force(self, time: FloatArray) -> ComplexArray:
        """(Ω² − iΩ') e^{iθ}."""
        growth = self.speed(time) ** 2 - 1j * self.speed.derivative()(time)
        return np.asarray(growth * np.exp(1j * self._angle(time)))

    def _answer(self, omega: float, zeta: float) -> ComplexArray:
        """Z of a mode and its slopes by ω and ζ, (3, n)."""
        root = np.sqrt(1 - zeta**2)
        poles = omega * np.array((-zeta + 1j * root, -zeta - 1j * root))
        step = BESIDE * omega
        beside = [[self._first_order(s + d) for d in (-step, 0.0, step)] for s in poles]
        (z, z_), (w, w_) = (([b for _, b, _ in beside]), [(c - a) / (2 * step) for a, _, c in beside])
        by_zeta = -omega * (1 + 1j * zeta / root)  # of s, where that by ω is s / ω
        g = (z - z_) / (2j * omega * root)
        by_s = [(w * ds - w_ * np.conj(ds)) / (2j * omega * root) for ds in (poles[0] / omega, by_zeta)]
        return np.asarray(omega**2 * np.array((g, by_s[0] + g / omega, by_s[1] + g * zeta / root**2)))

    @cached_property
    def _pieces(self) -> tuple[float, IntArray, FloatArray, ComplexArray, ComplexArray]:
        """Step of the grid; of each time the last step before it, and what is left then; the forces at the
        nodes of each step, and of what is left.
        """
        first, last = self.ends
        h = STEP / float(self.speed(np.linspace(first, last, 1000)).max())
        starts = first + h * np.arange(np.floor((last - first) / h))
        steps = np.minimum(np.floor((self.time - first) / h), len(starts)).astype(np.int64)
        rest = self.time - first - steps * h
        forces = self._force(starts[:, None] + h * NODES)
        return h, steps, rest, forces, self._force(self.time[:, None] - rest[:, None] * (1 - NODES))

    def _first_order(self, s: complex) -> ComplexArray:
        """Z of z' = s z + force, which begins as for a steady speed, at each time."""
        from scipy.signal import lfilter

        h, steps, rest, forces, last = self._pieces
        first = np.array(self.ends[:1])
        speed, rate = float(self.speed(first)[0]), float(self.speed.derivative()(first)[0])
        f, p = speed**2 - 1j * rate, 1j * speed - s
        start = f / p - 2 * speed * rate / p**2 + f * 1j * rate / p**3  # to the first order of the rate
        decay, kernel = np.exp(s * h), h * WEIGHTS * np.exp(s * h * (1 - NODES))
        z = lfilter([1.0], [1.0, -decay], forces @ kernel, zi=[decay * start])[0]
        z, left = np.concatenate(([start], z)), rest[:, None]
        late = (left * WEIGHTS * np.exp(s * left * (1 - NODES)) * last).sum(axis=1)
        return np.asarray(np.exp(s * rest) * z[steps] + late)


Answers = SteadyAnswers | SweptAnswers


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
    speed, span = make_smoothing_spline(time, speeds), float(time[-1] - time[0])
    if not span * speed(np.linspace(time[0], time[-1], 1000)).max() < MOST_STEPS * STEP:
        raise ValueError(
            f"the sweep takes {span:.4g} s, too long to be followed turn by turn, and so long that its "
            "acceleration does not matter: fit it as steady, with --acceleration 0"
        )
    return SweptAnswers(speed, (float(time[0]), float(time[-1])), time)
