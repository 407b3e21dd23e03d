"""Follow modes over speed by the likeness of their shapes (MAC), with smaller steps where it is not plain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem.solvers.quadratic_eigenvalues import NONE, Solutions, solve
from fem.solvers.reduced_whirl import Whirl
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray

_ALIKE = 0.8  # MAC of a mode with itself a step further
_OTHER = 0.5  # largest MAC with another mode, relative to it
_NEARER = (
    0.2  # or how much nearer to 1 its own MAC is: heavily damped modes may be alike at one speed already
)
_HARDLY = 0.3  # MAC below which two modes are not one
_HALVINGS = 10
_TRIALS = 24  # speeds tried between two given ones: modes alike at every step would cost 2 to the tenth


@dataclass(frozen=True, eq=False)
class Followed:
    """Modes over speed.

    Attributes
    ----------
    values
        Eigenvalue of each mode at each speed, NaN where it was not found, shape (S, c).
    vectors
        Its vector, shape (S, c, R).
    doubtful
        (index of an interval's start, mode) where shapes did not tell the mode apart from others at any step.
    """

    values: ComplexArray
    vectors: ComplexArray
    doubtful: tuple[tuple[int, int], ...]


@dataclass(frozen=True, eq=False)
class _At:
    """Modes at a speed, rad/s: eigenvalues, shape (m,), and vectors, shape (m, R)."""

    speed: float
    values: ComplexArray
    vectors: ComplexArray


class _Steps:
    """Partners of modes from one speed to another, by way of speeds between where shapes leave a doubt."""

    def __init__(self, whirl: Whirl, known: dict[float, Solutions]) -> None:
        self.whirl, self.known, self.weight = whirl, known, mass_weight(whirl)
        # In a complex coordinate the sign of Im λ is the direction: forward and backward whirl never mix.
        self.apart = whirl.Q.P.planes == 1
        self.trials = _TRIALS

    def alike(self, one: _At, other: _At) -> FloatArray:
        """`likeness` of the modes of two speeds."""
        return likeness(one.values, one.vectors, other.values, other.vectors, self.weight, self.apart)

    def between(
        self, one: _At, other: _At, alike: FloatArray, depth: int = 0
    ) -> tuple[dict[int, int], set[int]]:
        """Numbers of partners, and the modes in doubt; `alike` is the likeness of the two."""
        pairs, doubt = _pairs(alike)
        if not doubt or depth > _HALVINGS or self.trials <= 0:
            return pairs, doubt
        self.trials -= 1
        middle = self._solved((one.speed + other.speed) / 2, len(one.values))
        first, unsure = self.between(one, middle, self.alike(one, middle), depth + 1)
        second, later = self.between(middle, other, self.alike(middle, other), depth + 1)
        through = {i: second[j] for i, j in first.items() if j in second}
        return through, unsure | {i for i, j in first.items() if j in later}

    def _solved(self, speed: float, m: int) -> _At:
        if speed not in self.known:
            self.known[speed] = solve(self.whirl.Q, np.array([speed]), m, self.whirl.scale)
        found = self.known[speed]
        return _At(speed, found.values[0], found.vectors[0])


def follow(whirl: Whirl, known: dict[float, Solutions] | None = None) -> Followed:
    """Chain the eigenpairs of neighbouring speeds; `known` keeps solutions between them for the next time."""
    values, X = whirl.found.values, whirl.found.vectors
    S, m = values.shape
    steps = _Steps(whirl, {} if known is None else known)
    labels = np.full((S, m), -1)
    labels[0, np.isfinite(values[0])] = np.flatnonzero(np.isfinite(values[0]))
    count = m
    doubtful = []
    at = [_At(float(speed), values[k], X[k]) for k, speed in enumerate(whirl.speeds)]
    alike = likeness(values[:-1], X[:-1], values[1:], X[1:], steps.weight, steps.apart)
    for k in range(S - 1):
        steps.trials = _TRIALS
        pairs, doubt = steps.between(at[k], at[k + 1], alike[k])
        doubtful += [(k, int(labels[k, i])) for i in sorted(doubt)]
        for i, j in pairs.items():
            labels[k + 1, j] = labels[k, i]
        fresh = np.flatnonzero(np.isfinite(values[k + 1]) & (labels[k + 1] < 0))
        labels[k + 1, fresh] = count + np.arange(fresh.size)
        count += fresh.size
    out = np.full((S, count), NONE)
    vectors = np.full((S, count, X.shape[2]), NONE)
    row, rank = np.nonzero(labels >= 0)
    out[row, labels[row, rank]] = values[row, rank]
    vectors[row, labels[row, rank]] = X[row, rank]
    return Followed(out, vectors, tuple(doubtful))


def mass_weight(whirl: Whirl) -> FloatArray:
    """Weight of `likeness`, shape (R, R): the mass, and a little of everything that has none."""
    weight = whirl.Q.M * whirl.scale**2
    return np.asarray(weight + 1e-3 * np.trace(weight) / len(weight) * np.eye(len(weight)))


def plain(best: FloatArray, rivals: FloatArray) -> BoolArray:
    """Whether a MAC tells a mode beyond doubt from the one most like it among the others."""
    apart = (rivals <= _OTHER * best) | (1 - best <= _NEARER * (1 - rivals))
    return np.asarray((best >= _ALIKE) & apart)


def likeness(
    one: ComplexArray,
    X: ComplexArray,
    other: ComplexArray,
    Y: ComplexArray,
    weight: FloatArray,
    apart: bool = False,
) -> FloatArray:
    """MAC of states (u, λ u / |λ|), mass-weighted, between modes (…, i) and (…, j); 0 where there is none.

    The velocities tell apart forward and backward whirl of one shape in a complex coordinate, and modes of
    different damping. With `apart` modes of different sign of Im λ are not alike at all.
    """
    X, Y = np.nan_to_num(X), np.nan_to_num(Y)
    WX, WY = X @ weight, Y @ weight
    cross = np.abs(np.einsum("...ir,...jr->...ij", X.conj(), WY)) ** 2
    size = np.einsum("...ir,...ir->...i", X.conj(), WX).real[..., :, None]
    size = size * np.einsum("...jr,...jr->...j", Y.conj(), WY).real[..., None, :]
    turn = (
        np.angle(np.nan_to_num(one, nan=1.0))[..., :, None]
        - np.angle(np.nan_to_num(other, nan=1.0))[..., None, :]
    )
    mac = cross / np.maximum(size, np.finfo(float).tiny) * np.cos(turn / 2) ** 2
    there = np.isfinite(one)[..., :, None] & np.isfinite(other)[..., None, :]
    if apart:
        there &= (one.imag > 0)[..., :, None] == (other.imag > 0)[..., None, :]
    return np.asarray(np.where(there, mac, 0.0))


def _pairs(mac: FloatArray) -> tuple[dict[int, int], set[int]]:
    """Partners of largest MAC, and the modes whose partner is in doubt."""
    from scipy.optimize import linear_sum_assignment

    i, j = linear_sum_assignment(mac, maximize=True)
    best, others = mac[i, j], mac.copy()
    others[i, j] = 0.0
    doubtful = (best > 0) & ~plain(best, np.maximum(others[i].max(axis=1), others[:, j].max(axis=0)))
    # What is hardly alike is another mode that came while this one went.
    pairs = {int(one): int(other) for one, other, mac in zip(i, j, best, strict=True) if mac >= _HARDLY}
    return pairs, set(i[doubtful].tolist())
