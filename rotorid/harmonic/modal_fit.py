"""Modes from amplitudes around resonances, the measurements that [S] lesson 7 begins with.

At every point X = e (Σ_r R_r / (1 − (ω/ω_r)² + 2 i ζ_r ω/ω_r) + a + b / ω²): all points have the same ω_r and
ζ_r; e is the excitation, a and b stand for modes above and below the range. R, a and b are linear and
eliminated (variable projection), so the search has two parameters a mode. It begins with circles: a resonance
with a constant neighbour is one (Kennedy and Pancu, 1947).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from rotorid.base.arrays import AnyArray, ComplexArray, FloatArray
from rotorid.harmonic.comparison import TRUSTED, whitening
from rotorid.harmonic.experiments import Experiments
from rotorid.harmonic.modal_result import FittedModes
from rotorid.regression.nonlinear import nonlinear_least_squares

PROMINENCE, SKIRT = 1.4, 4.0
"""A mode's peak stands so many times above its valleys; its circle is fitted down to this fraction of it."""
ROUNDS = 3
"""With errors at the measured amplitudes, then at the fitted ones."""


@dataclass(frozen=True, eq=False)
class Readings:
    """Amplitudes Z (n, P) under excitations (n,), and what whitens them (n, P, 2, 2)."""

    omega: FloatArray
    excitation: ComplexArray
    Z: ComplexArray
    root: FloatArray

    def basis(self, q: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """What R, a and b multiply (n, k + 2), and its slopes by q = (ω_r, ζ_r), (n, 2k)."""
        own, damping = np.split(q, 2)
        u, e = self.omega[:, None] / own, self.excitation[:, None]
        g = 1 / (1 - u**2 + 2j * damping * u)
        slopes = -np.tile(g**2, 2) * np.hstack(((2 * u**2 - 2j * damping * u) / own, 2j * u))
        return e * np.hstack((g, u[:, :1] ** 0, u[:, :1] ** -2)), e * slopes

    def point(self, p: int, q: FloatArray) -> tuple[AnyArray, ...]:
        """Of a point what R, a and b do not explain, its slopes, R, a and b, and their covariances."""
        seen = ~np.isnan(self.Z[:, p])

        def real(z: ComplexArray) -> FloatArray:
            parts = self.root[seen, p] @ np.stack((z[seen].real, z[seen].imag), axis=1)
            return np.asarray(parts.reshape(-1, z.shape[1]))

        columns, slopes = self.basis(q)
        design = real(np.stack((columns, 1j * columns), axis=-1).reshape(len(seen), -1))
        y, size = real(self.Z[:, [p]])[:, 0], design.shape[1]
        Q, R = np.linalg.qr(design, mode="complete")
        rest, inverse = Q[:, size:].T, np.linalg.inv(R[:size])
        c = (inverse @ (Q[:, :size].T @ y)).reshape(-1, 2) @ (1, 1j)
        spread = np.einsum("iaib->iab", (inverse @ inverse.T).reshape(len(c), 2, -1, 2))
        return rest @ y, -rest @ real(slopes * np.tile(c[: len(c) - 2], 2)), c, spread

    def each(self, what: int, q: FloatArray) -> list[AnyArray]:
        """One of these for every point."""
        return [self.point(p, q)[what] for p in range(self.Z.shape[1])]

    def rows(self, what: int, q: FloatArray) -> AnyArray:
        """One of these of all points together."""
        return np.concatenate(self.each(what, q))


def fit_modes(
    experiments: Experiments,
    points: Sequence[str],
    excitation: ComplexArray,
    bands: Sequence[tuple[float, float]] | None = None,
) -> FittedModes:
    """Fit modes to amplitudes around resonances.

    Parameters
    ----------
    experiments
        Harmonic tests with their errors; where none are stated, all amplitudes have the same relative one.
    points
        Names of the signals.
    excitation
        Of each experiment, (n,), but for a factor: what a displacement far below all resonances follows.
    bands
        Frequencies around each resonance, rad/s: one mode in each, and nothing else counts. None: around
        each peak, and everything counts.

    Raises
    ------
    ValueError
        Where there is no peak, and where readings are fewer than unknowns.
    """
    order = np.argsort(experiments.frequencies, kind="stable")
    if bands is not None:
        omega = experiments.frequencies[order]
        order = order[np.any([(omega >= low) & (omega <= high) for low, high in bands], axis=0)]
    if not len(order):
        raise ValueError("there are no readings in --bands")
    experiments, excitation = experiments.take(order), excitation[order]
    omega, Z = experiments.frequencies, experiments.table(points)
    H = Z / excitation[:, None]
    sections = _peaks(omega, H) if bands is None else sorted(bands)
    rows = [np.flatnonzero((omega >= low) & (omega <= high)) for low, high in sections]
    spare = np.count_nonzero(~np.isnan(Z), axis=0) - len(rows) - 2
    if min(spare) < 0 or sum(spare) < len(rows) or min(map(len, rows)) < 3:
        raise ValueError(
            f"too few readings: every resonance needs 3 frequencies, and every point {len(rows) + 2} (one a "
            "mode and two for modes beyond the range), and one more for the frequencies and damping"
        )
    q = np.transpose([_circle(omega[row], H[row]) for row in rows]).ravel()
    names = [f"{letter}{mode}" for letter in "ωζ" for mode in range(1, len(rows) + 1)]
    ends = tuple((float(omega[row[0]]), float(omega[row[-1]])) for row in rows)
    # −ω with −ζ is the same mode, and far from its readings a mode is another's neighbour
    bounds = {name: (low / 2, 2 * high) for name, (low, high) in zip(names, ends, strict=False)}
    fitted = Z
    for turn in range(ROUNDS):
        readings = Readings(omega, excitation, Z, whitening(experiments, tuple(points), fitted)[0])
        fit = nonlinear_least_squares(
            partial(readings.rows, 0),
            partial(readings.rows, 1),
            q,
            names=names,
            sigma_stated=experiments.stated,
            bounds=bounds,
            near=turn > 0,
        )
        q = fit.estimate.solution
        model = readings.basis(q)[0] @ np.transpose(readings.each(2, q))
        ratio = np.abs(model) / np.abs(Z)
        fitted = np.where((ratio < TRUSTED) & (ratio > 1 / TRUSTED), model, Z)
    left = np.nan_to_num((Z - model) / np.abs(model))
    trend = np.vdot(left[:-1], left[1:]).real / np.vdot(left, left).real * np.sqrt(2 * left.size)
    residues = np.transpose(readings.each(2, q))[: len(rows)]
    spread = np.swapaxes(readings.each(3, q), 0, 1)[: len(rows)]
    return FittedModes(tuple(points), fit, residues, spread, ends, float(trend), experiments.axis)


def _peaks(omega: FloatArray, H: ComplexArray) -> list[tuple[float, float]]:
    """Frequencies around each peak of all points together, each point in its own size."""
    from scipy.signal import find_peaks

    level = np.log(np.nanmean((np.abs(H) / np.nanmax(np.abs(H), axis=0)) ** 2, axis=1)) / 2
    found = find_peaks(level, prominence=np.log(PROMINENCE))[0]
    if not len(found):
        raise ValueError(
            f"no peak stands {PROMINENCE:g} times above both its sides: measure on both sides of the "
            "resonance, or say with --bands where it is"
        )
    valleys = [0, *(a + int(level[a:b].argmin()) for a, b in pairwise(found)), len(omega) - 1]
    sections = []
    for peak, (first, last) in zip(found, pairwise(valleys), strict=True):
        rows = np.arange(first, last + 1)
        near = rows[(level[rows] > level[peak] - np.log(SKIRT)) | (np.abs(rows - peak) < 2)]
        sections.append((float(omega[near[0]]), float(omega[near[-1]])))
    return sections


def _circle(omega: FloatArray, H: ComplexArray) -> tuple[float, float]:
    """ω_r and ζ_r of the circles through responses (n, P): H (s − ω²) = c + a ω² with s = ω_r² (1 + 2 i ζ_r).

    It is linear in s, which all points share, and in c and a of each.
    """
    top, bottom = 0j, np.finfo(float).tiny
    for h in H.T:
        seen = ~np.isnan(h)
        v = omega[seen] ** 2
        line = np.stack((np.ones_like(v), v / omega.mean() ** 2), axis=1)
        rest = h[seen] - line @ (np.linalg.pinv(line) @ h[seen])
        top, bottom = top + np.vdot(rest, h[seen] * v), bottom + np.vdot(rest, rest).real
    s = top / bottom
    if not omega[0] ** 2 < s.real < omega[-1] ** 2:
        return float(omega[np.nansum(np.abs(H), axis=1).argmax()]), 0.01
    damping = s.imag / (2 * s.real)
    return float(np.sqrt(s.real)), float(np.copysign(np.clip(abs(damping), 1e-6, 0.5), damping))
