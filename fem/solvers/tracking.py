"""Follow modes over speed by the likeness of their shapes (MAC), with smaller steps where it is not plain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem.solvers.quadratic import NONE, Solutions, solve
from fem.solvers.reduced_whirl import Whirl
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray, IndexArray

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
    lost
        Whether a mode may have gone on above those that were computed, shape (c,).
    doubtful
        (index of an interval's start, mode) where shapes did not tell the mode apart from others at any step.
    """

    values: ComplexArray
    vectors: ComplexArray
    lost: BoolArray
    doubtful: tuple[tuple[int, int], ...]


def follow(whirl: Whirl, known: dict[float, Solutions] | None = None) -> Followed:
    """Chain the eigenpairs of neighbouring speeds; `known` keeps solutions between them for the next time."""
    known = {} if known is None else known
    values, X = whirl.found.values, whirl.found.vectors
    S, m = values.shape
    weight = mass_weight(whirl)
    labels = np.full((S, m), -1)
    labels[0, np.isfinite(values[0])] = np.flatnonzero(np.isfinite(values[0]))
    count = m
    lost: set[int] = set()
    doubtful = []
    # In a complex coordinate the sign of Im λ is the direction: forward and backward whirl never mix.
    apart = whirl.Q.P.planes == 1
    alike = likeness(values[:-1], X[:-1], values[1:], X[1:], weight, apart)
    partner = np.argmax(alike, axis=2)
    obvious = _obvious(alike, partner)
    for k in range(S - 1):
        if obvious[k]:
            labels[k + 1, partner[k]] = labels[k]
            continue
        pairs, doubt = _pairs(alike[k])
        if doubt:
            ends = (values[k], X[k]), (values[k + 1], X[k + 1])
            pairs, doubt, _ = _bridge(whirl, weight, known, whirl.speeds[k : k + 2], *ends, 0, _TRIALS)
            doubtful += [(k, int(labels[k, i])) for i in sorted(doubt)]
        for i, j in pairs.items():
            labels[k + 1, j] = labels[k, i]
        fresh = np.flatnonzero(np.isfinite(values[k + 1]) & (labels[k + 1] < 0))
        labels[k + 1, fresh] = count + np.arange(fresh.size)
        count += fresh.size
        if np.isfinite(values[k + 1]).all():
            lost |= {int(labels[k, i]) for i in np.flatnonzero(np.isfinite(values[k])) if i not in pairs}
    out = np.full((S, count), NONE)
    vectors = np.full((S, count, X.shape[2]), NONE)
    at, rank = np.nonzero(labels >= 0)
    out[at, labels[at, rank]] = values[at, rank]
    vectors[at, labels[at, rank]] = X[at, rank]
    return Followed(out, vectors, np.isin(np.arange(count), list(lost)), tuple(doubtful))


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


def _obvious(mac: FloatArray, partner: IndexArray) -> BoolArray:
    """At which steps every mode has a partner beyond doubt, shape (S − 1,)."""
    best = np.take_along_axis(mac, partner[:, :, None], axis=2)[:, :, 0]
    others = mac.copy()
    np.put_along_axis(others, partner[:, :, None], 0.0, axis=2)
    across = np.take_along_axis(others.max(axis=1), partner, axis=1)
    rivals = np.maximum(others.max(axis=2), across)
    one_each = (np.sort(partner, axis=1) == np.arange(mac.shape[1])).all(axis=1)
    return np.asarray(one_each & plain(best, rivals).all(axis=1))


def _pairs(mac: FloatArray) -> tuple[dict[int, int], set[int]]:
    """Partners by falling MAC, and the modes whose partner is in doubt."""
    left = mac.copy()
    pairs: dict[int, int] = {}
    doubt: set[int] = set()
    for _ in range(len(mac)):
        i, j = (int(index) for index in np.unravel_index(int(np.argmax(left)), left.shape))
        best = left[i, j]
        if best <= 0:
            break
        rivals = max(np.delete(mac[i], j).max(initial=0.0), np.delete(mac[:, j], i).max(initial=0.0))
        if not (best >= _ALIKE and (rivals <= _OTHER * best or 1 - best <= _NEARER * (1 - rivals))):
            doubt.add(i)
        # What is hardly alike is another mode that came while this one went.
        if best >= _HARDLY:
            pairs[i] = j
        left[i], left[:, j] = 0.0, 0.0
    return pairs, doubt


def _bridge(
    whirl: Whirl,
    weight: FloatArray,
    known: dict[float, Solutions],
    speeds: FloatArray,
    start: tuple[ComplexArray, ComplexArray],
    end: tuple[ComplexArray, ComplexArray],
    depth: int,
    trials: int,
) -> tuple[dict[int, int], set[int], int]:
    """Partners over an interval by way of its middle, the modes in doubt, and trials left."""
    middle = float(speeds.mean())
    if middle not in known:
        known[middle] = solve(whirl.Q, np.array([middle]), len(start[0]), whirl.scale)
    found = known[middle]
    trials -= 1
    half = found.values[0], found.vectors[0]
    apart = whirl.Q.P.planes == 1
    steps = []
    for a, b, ends in ((start, half, (speeds[0], middle)), (half, end, (middle, speeds[1]))):
        step, doubt = _pairs(likeness(a[0], a[1], b[0], b[1], weight, apart))
        if doubt and depth < _HALVINGS and trials > 0:
            step, doubt, trials = _bridge(whirl, weight, known, np.array(ends), a, b, depth + 1, trials)
        steps.append((step, doubt))
    (first, unsure), (second, later) = steps
    unsure = unsure | {i for i, j in first.items() if j in later}
    return {i: second[j] for i, j in first.items() if j in second}, unsure, trials
