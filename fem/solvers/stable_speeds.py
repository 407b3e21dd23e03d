"""At which of many speeds a mode grows, decided for whole ranges of speed at a time.

Between two knots of the tables D and K are linear in speed, and so is A of z' = A z, z = (u, u'). With
eigenvalues Λ and vectors V of A in the middle of a range and S = −sign Re Λ, the Hermitian part of S V⁻¹ A V
is linear, too: if it is negative at both ends it is so between, and no eigenvalue passes the imaginary axis
in the range (inertia theorem of Ostrowski and Schneider, Lyapunov function V⁻ᴴ S V⁻¹). A range for which
this fails is halved. So in a coarse basis, with a margin for its error; the speeds that are left, one by one
in a fine one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem.matrices.lateral_planes import Planes, Quadratic, project
from fem.solvers.quadratic_eigenvalues import all_values
from fem.solvers.whirl_basis import reference, starting_vectors, vectors
from rotorid.base.arrays import AnyArray, BoolArray, ComplexArray, FloatArray, IndexArray

GROWTH = 1e-14  # Re λ / |λ| above which a mode is said to grow: rounding of what damps and drives it
_DOUBT = 1e-7  # the same within which ranges are not decided as a whole
_AWAY = 1e-6  # a real eigenvalue above this part of the reference frequency runs away
_BESIDE = 0.1  # weight of such an eigenvalue beside the growth of motions that oscillate
_FREE = 1e-3  # part of the lowest bending frequency of a free rotor below which motions are rigid
_COMPLETE = 40  # unknowns per plane up to which the basis is the whole space
_LEAST = 8  # modes of the reference rotor
_TIMES = 2.0  # the highest speed: modes up to there are low ones
_FEW = 4  # speeds that are looked at one by one
_DEEP = 5  # halvings after which a range is given up whose middle is in doubt
_DAMPED = 0.2  # damping ratio of a mode that is far from growing
_SAFE = 3.0  # times the error of the coarse basis that is its margin
_REGULAR = 1e-15
_CHUNK = 64  # matrices at a time


@dataclass(frozen=True, eq=False)
class Bases:
    """The equations in bases for the modes that may grow.

    Attributes
    ----------
    fine, coarse
        Of about eight digits, and small.
    scale
        A frequency of the order of the lowest, rad/s.
    low
        Frequency up to which the coarse basis knows the modes, rad/s.
    highest
        Frequency up to which a mode may grow, or the fine basis knows them, rad/s.
    """

    fine: Quadratic
    coarse: Quadratic
    scale: float
    low: float
    highest: float


def bases(P: Planes, speeds: FloatArray, highest: float) -> Bases:
    """Bases for modes up to a frequency, rad/s (inf: not known up to which), at speeds (S,), ascending."""
    low = min(highest, _TIMES * float(speeds[-1]))
    m = _LEAST
    while True:
        ref = reference(P, speeds, m)
        known = float(ref.frequencies[min(m // 2, ref.frequencies.size) - 1])
        if known > low or m >= P.A.size:
            break
        m *= 2
    Y, more = starting_vectors(P, ref, m // 2)
    n = P.A.size
    complete = n <= max(_COMPLETE, Y.shape[1] + more.shape[1])
    fine = np.eye(n) if complete else np.hstack((Y, more))
    coarse = fine if 2 * Y.shape[1] > fine.shape[1] else Y
    return Bases(
        fine=project(P, vectors(ref, fine)),
        coarse=project(P, vectors(ref, coarse)),
        scale=ref.scale,
        low=min(highest, known),
        highest=min(highest, np.inf if complete else float(ref.frequencies[-1])),
    )


def largest_growth(found: Bases, speeds: FloatArray) -> FloatArray:
    """Largest Re λ / |λ|, shape (S,); of motions that do not oscillate Re λ by the scale, weighted."""
    out = np.empty(speeds.size)
    for start in range(0, speeds.size, _CHUNK):
        part = slice(start, start + _CHUNK)
        out[part] = rates(found, *all_values(found.fine, speeds[part], found.scale)).max(axis=1)
    return out


def growing_at(found: Bases, speeds: FloatArray) -> BoolArray:
    """At which speeds a mode grows, shape (S,).

    Parameters
    ----------
    found
        The equations.
    speeds
        rad/s, ascending, shape (S,).
    """
    out = np.zeros(speeds.size, dtype=np.intp)
    if speeds.size > _FEW:
        knots = found.fine.P.rotor.knots
        inner = knots[(knots > speeds[0]) & (knots < speeds[-1])]
        cuts = np.unique(np.concatenate((speeds[[0, -1]], inner)))
        lam, oscillates = all_values(found.fine, cuts, found.scale)
        low = np.abs(lam.imag) <= found.low
        rough, _ = all_values(found.coarse, cuts, found.scale)
        error = np.abs(lam[:, :, None] - rough[:, None, :]).min(axis=2) / np.abs(lam)
        near = low & oscillates & (lam.real > -_DAMPED * np.abs(lam))
        order = np.argsort(np.abs(lam.imag[near]))
        margins = (
            np.concatenate(([0.0], np.abs(lam.imag[near])[order])),
            np.concatenate(([0.0], _SAFE * np.maximum.accumulate(error[near][order]))),
        )
        out = _certified(found.coarse, speeds, cuts, margins, found.low, -_DOUBT)
        rest = np.flatnonzero(out >= 0)
        if rest.size:
            surely = _certified(found.coarse, speeds[rest], cuts, margins, found.low, _DOUBT)
            out[rest] = np.maximum(surely, 0)
        # The forces that drive a mode are linear in speed between the cuts, and so, nearly, is its growth.
        high = np.asarray((np.where(low, -1.0, rates(found, lam, oscillates)) > -_DOUBT).any(axis=1))
        at = np.searchsorted(cuts, speeds)
        out[high[at] | high[np.maximum(at - 1, 0)]] = 0
    left = np.flatnonzero(out == 0)
    if left.size:
        out[left] = np.where(largest_growth(found, speeds[left]) > GROWTH, 1, -1)
    return np.asarray(out > 0)


def rates(found: Bases, lam: ComplexArray, oscillates: BoolArray) -> FloatArray:
    """Growth of motions as `largest_growth` counts it; −1 where the basis does not know them."""
    rate = np.where(oscillates, lam.real / np.abs(lam), _BESIDE * (lam.real / found.scale - _AWAY))
    # What rounding makes of the motions of a free rotor, which nothing drives, does not count.
    known = np.abs(lam) > (0.0 if found.fine.P.rotor.supports else _FREE * found.scale)
    return np.where(known & (np.abs(lam.imag) <= found.highest), rate, -1.0)


def _certified(
    Q: Quadratic,
    speeds: FloatArray,
    cuts: FloatArray,
    margins: tuple[FloatArray, FloatArray],
    low: float,
    level: float,
) -> IndexArray:
    """1 where a low mode surely grows, −1 where surely none does, else 0, shape (S,)."""
    out = np.zeros(speeds.size, dtype=np.intp)
    state = _first_order(Q, float(np.median(speeds)))
    if state is None:
        return out
    ranges = np.stack((cuts[:-1], cuts[1:]), axis=1)
    depth = 0
    while len(ranges):
        first, last = np.searchsorted(speeds, ranges[:, 0]), np.searchsorted(speeds, ranges[:, 1], "right")
        ranges = ranges[last - first > 1]
        halves = []
        for start in range(0, len(ranges), _CHUNK):
            part = ranges[start : start + _CHUNK]
            sure, lam, margin = _constant(state, part, margins, level)
            excess = lam.real - level * np.abs(lam)
            grows = ((excess > 0) & (np.abs(lam.imag) <= low)).any(axis=1)
            for (a, b), holds, more in zip(part, sure, grows, strict=True):
                if holds:
                    out[(speeds >= a) & (speeds <= b)] = 1 if more else -1
            doubt = (np.abs(excess) <= margin * np.abs(lam)).any(axis=1)
            again = part[~sure & ~(doubt & (depth >= _DEEP))]
            middle = again.mean(axis=1)
            halves += [np.stack((again[:, 0], middle), axis=1), np.stack((middle, again[:, 1]), axis=1)]
        ranges = np.concatenate(halves) if halves else ranges[:0]
        depth += 1
    return out


def _constant(
    state: Callable[[FloatArray], AnyArray],
    ranges: FloatArray,
    margins: tuple[FloatArray, FloatArray],
    level: float,
) -> tuple[BoolArray, AnyArray, FloatArray]:
    """In which ranges, (B, 2), no growth comes near the level; those in the middle, and margins, (B, n).

    The margin of an eigenvalue is that of the next frequency below.
    """
    lam, V = np.linalg.eig(state(ranges.mean(axis=1)))
    frequency, share = margins
    known = np.abs(lam.imag) <= 1.01 * frequency[-1]
    margin = np.where(known, share[np.searchsorted(frequency, 1.01 * np.abs(lam.imag), "right") - 1], 0.0)
    sign = np.where(lam.real > level * np.abs(lam), -1.0, 1.0)
    own = np.arange(V.shape[1])
    V[:, own, own] += _REGULAR  # vectors of equal eigenvalues may be one
    inverse = np.linalg.inv(V)
    sure: BoolArray = np.ones(len(ranges), dtype=bool)
    for end in (0, 1):
        H = sign[:, :, None] * (inverse @ state(ranges[:, end]) @ V)
        H = (H + np.swapaxes(H.conj(), 1, 2)) / 2
        H[:, own, own] += (margin - sign * level) * np.abs(lam)
        sure &= np.linalg.eigvalsh(H)[:, -1] < 0
    return sure, lam, margin


def _first_order(Q: Quadratic, middle: float) -> Callable[[FloatArray], AnyArray] | None:
    """A of z' = A z at speeds, in units of energy about those at a middle speed; None without enough mass."""
    own = np.sqrt(np.diag(Q.M))
    if not own.all() or np.linalg.eigvalsh(Q.M / np.outer(own, own))[0] < 1e-12:
        return None
    L = np.linalg.inv(np.linalg.cholesky(Q.M))
    K = Q.at(np.array([middle]))[1][0]
    values, vectors_ = np.linalg.eigh(((K + K.conj().T) / 2).real)
    root = np.sqrt(np.maximum(values, 1e-9 * values[-1]))
    up, down = (vectors_ * root) @ vectors_.T, (vectors_ / root) @ vectors_.T
    n = Q.size

    def state(speeds: FloatArray) -> AnyArray:
        D, K = Q.at(speeds)
        A = np.zeros((speeds.size, 2 * n, 2 * n), dtype=D.dtype)
        A[:, :n, n:] = up @ L.T
        A[:, n:, :n] = -L @ K @ down
        A[:, n:, n:] = -L @ D @ L.T
        return A

    return state
