"""How combinations of runs err: numbers of their own, and columns in common; drawn, and made white.

All errors act linearly. θ = (Y₀, W₁, …, W_P) of every reading errs by numbers of its own and by columns that
readings have in common,

    δθ = own + Σ column_m · (size of its kind) · z_m,    z real, independent, of variance 1.

For trial runs θ = G Y with the gain G of least squares, so that a run drawn again draws θ again. The size of
each kind (readings, own part of a run, what is common to it, further unbalance, what is known) comes first.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import zip_longest
from typing import NamedTuple

import numpy as np

from balancing.reading_errors import (
    NO_RUN_ERRORS,
    Reading,
    RunErrors,
    job_columns,
    own_variance,
    rms,
    unbalances,
)
from balancing.regions import real_parts
from balancing.trials import Trials
from rotorid.base.arrays import ComplexArray, FloatArray, IntArray
from rotorid.regression import covariance_root, stretch, unstretch

BLOCK = 20_000
"""Readings of a block of draws."""
READING, OWN, COMMON, LOADS, UNBALANCE, KNOWN = range(6)


class Noise(NamedTuple):
    """Errors of (Y₀, W): blocks by reading, and columns in common.

    `blocks` (1 or 2, S, C, 2P + 2, 2P + 2): covariances by readings, and by the own part of runs of size 1;
    `columns` (M, S, C, P + 1) of size 1, and `kind` (M,), which size each has.
    """

    blocks: FloatArray
    columns: ComplexArray
    kind: IntArray

    def part(self, speeds: Sequence[int], sensors: Sequence[int], planes: Sequence[int]) -> Noise:
        """The noise of some speeds, sensors and planes."""
        chosen = [0, *(1 + p for p in planes)]
        real = [2 * k + part for k in chosen for part in (0, 1)]
        return Noise(
            self.blocks[np.ix_(range(len(self.blocks)), speeds, sensors, real, real)],
            self.columns[np.ix_(range(len(self.columns)), speeds, sensors, chosen)],
            self.kind,
        )

    def changed(self, change: ComplexArray) -> Noise:
        """The noise of combinations (m, P + 1), or (S, C, m, P + 1), of (Y₀, W)."""
        real = stretch(change)
        blocks = real @ self.blocks @ np.swapaxes(real, -1, -2)
        return Noise(blocks, (change @ self.columns[..., None])[..., 0], self.kind)

    def plus(self, other: Noise) -> Noise:
        """Together with an independent one."""
        columns = np.concatenate((self.columns, other.columns))
        blocks = [a + b for a, b in zip_longest(self.blocks, other.blocks, fillvalue=0.0)]
        return Noise(np.array(blocks), columns, np.concatenate((self.kind, other.kind)))

    def at(self, sizes: FloatArray) -> tuple[FloatArray, ComplexArray]:
        """Own covariances (S, C, 2P + 2, 2P + 2) and columns at sizes (6,) of the kinds."""
        blocks = np.tensordot(sizes[: len(self.blocks)] ** 2, self.blocks, axes=1)
        return blocks, self.columns * sizes[self.kind][:, None, None, None]

    def covariance(self, sizes: FloatArray) -> FloatArray:
        """Covariance of each reading, (S, C, 2P + 2, 2P + 2), at sizes (6,) of the kinds."""
        blocks, columns = self.at(sizes)
        if len(columns):
            F = real_parts(columns)
            blocks += np.einsum("mscp,mscq->scpq", F, F, optimize=True)
        return blocks


def kind_sizes(run: RunErrors) -> FloatArray:
    """Typical size of each kind, (6,)."""
    return np.array([1.0, *run.typical, 1.0])


class Mounted(NamedTuple):
    """What is mounted: name of the run, planes, weights (P,); all zero where nothing is."""

    run: str
    planes: tuple[str, ...]
    weights: ComplexArray


class Errors(NamedTuple):
    """Where (Y₀, W) come from, and how they err.

    Attributes
    ----------
    noise
        How they err.
    reading, run
        Errors of a reading and of a run that they are made of, and that further readings have.
    mounted
        In the last run.
    trials
        The runs; None: stored, computed or combined coefficients.
    """

    noise: Noise
    reading: Reading
    run: RunErrors
    mounted: Mounted
    trials: Trials | None = None

    @property
    def sizes(self) -> FloatArray:
        """Typical size of each kind, (6,)."""
        return kind_sizes(self.run)

    def draw(self, count: int, seed: int) -> FloatArray:
        """Sizes of each kind in so many draws, (count, 6); the same for the same seed."""
        rng = np.random.default_rng([seed, 0])
        scales = self.reading.scales(rng, count)
        return np.column_stack((scales, self.run.draw(rng, count), np.ones(count)))


class Gaussian(Errors):
    """Errors of stored, computed or combined coefficients: normal, as they are.

    Parameters
    ----------
    blocks
        Covariance of (Re Y₀, Im Y₀, Re W₁, …) of each reading without the columns, (S, C, 2P + 2, 2P + 2);
        zero where nothing is known.
    columns
        What readings have in common: Σ column · (independent real normal of variance 1), (M, S, C, P + 1).
    reading, run
        Of further readings.
    mounted
        What is mounted.

    Attributes
    ----------
    noise, trials
        How (Y₀, W) err; None: there are no runs.
    """

    def __new__(
        cls,
        blocks: FloatArray,
        columns: ComplexArray,
        reading: Reading,
        run: RunErrors,
        mounted: Mounted | None = None,
    ) -> Gaussian:
        """Normal errors of this covariance."""
        noise = Noise(blocks[None], columns, np.full(len(columns), KNOWN))
        nothing = Mounted("", (), np.zeros(columns.shape[-1] - 1, dtype=complex))
        return super().__new__(cls, noise, reading, run, mounted or nothing)

    @classmethod
    def none(cls, S: int, C: int, P: int) -> Gaussian:
        """Errors of coefficients (S, C, P) of which nothing is known."""
        blocks = np.zeros((S, C, 2 * P + 2, 2 * P + 2))
        return cls(blocks, np.zeros((0, S, C, P + 1), dtype=complex), Reading(), NO_RUN_ERRORS)


def run_noise(trials: Trials, W: ComplexArray, G: ComplexArray, reading: Reading, run: RunErrors) -> Noise:
    """Errors of combinations G Y of runs.

    Parameters
    ----------
    trials
        Runs with the readings Y, (R, S, C).
    W
        Coefficients (S, C, P) of all their planes.
    G
        (S, C, n, R), or (n, R) for all readings.
    reading, run
        How they err.
    """
    Y = trials.mean
    R, S, C = Y.shape
    n = G.shape[-2]
    G = np.broadcast_to(G, (S, C, n, R))
    variances = [reading.covariance(trials)]
    parts, kinds = [np.einsum("scnr,mrsc->mscn", G, job_columns(trials, W))], [KNOWN]
    if run.sizes.any():
        variances.append(np.einsum("rsc,ij->rscij", own_variance(Y, run.evenly), np.eye(2)))
        loads = np.einsum("scp,rp->rsc", W, trials.weights)
        common, loaded = (np.moveaxis(G, -1, 0) * part[..., None] for part in (Y, loads))
        c = unbalances(W, run.level or rms(Y))
        further = np.einsum("scnr,scp->rpscn", G, c).reshape(-1, S, C, n)
        parts = [common, 1j * common, loaded, 1j * loaded, further, 1j * further, *parts]
        kinds = [COMMON, COMMON, LOADS, LOADS, UNBALANCE, UNBALANCE, KNOWN]
    blocks = np.empty((len(variances), S, C, 2 * n, 2 * n))
    for s in range(S):  # at all speeds the products would take ten times as much
        B = stretch(G[s]).reshape(C, 2 * n, R, 2)
        blocks[:, s] = [
            np.einsum("cark,rckl,cbrl->cab", B, part[:, s], B, optimize=True) for part in variances
        ]
    return Noise(blocks, np.concatenate(parts), np.repeat(kinds, [len(part) for part in parts]))


def drawn(noise: Noise, factors: FloatArray, seed: int) -> Iterator[ComplexArray]:
    """Errors (B, S, C, P + 1), block by block, at sizes (n, 6) of the draws; the same whatever the blocks."""
    S, C = noise.blocks.shape[1:3]
    step = max(1, BLOCK // (S * C))
    rngs = [np.random.default_rng([seed, part]) for part in (1, 2, 3)]
    roots = [
        np.array([covariance_root(at, np.einsum("...ii->...i", at)) for at in part]) for part in noise.blocks
    ]
    for start in range(0, len(factors), step):
        f = factors[start : start + step]
        z = rngs[2].standard_normal((len(f), len(noise.kind))) * f[:, noise.kind]
        error = np.tensordot(z, noise.columns, 1)
        for kind, root in enumerate(roots):
            if root.any() and factors[:, kind].any():
                z = rngs[kind].standard_normal((len(f), *root.shape[:-1], 1))
                error += f[:, kind, None, None, None] * unstretch((root @ z)[..., 0])
        yield error


class Whitening:
    """V⁻¹ of a noise at some sizes: blocks of each sensor and speed, and columns in common.

    V = L (1 + F Fᵀ) Lᵀ, `blocks` = L Lᵀ, F = U s Vᵀ, has the inverse root (1 + U (1/√(1 + s²) − 1) Uᵀ) L⁻¹.
    """

    def __init__(self, noise: Noise, sizes: FloatArray) -> None:
        blocks, columns = noise.at(sizes)
        n = blocks.shape[-1]
        least = 1e-12 * (np.trace(blocks, axis1=-2, axis2=-1).max() or 1.0) / n
        self.blocks: FloatArray = blocks + least * np.eye(n)
        self._root = np.linalg.cholesky(self.blocks)
        F = self._alone(np.moveaxis(real_parts(columns), 0, -1))
        self._basis, size, _ = np.linalg.svd(F, full_matrices=False)
        self._less = 1 - 1 / np.hypot(1, size)

    def _alone(self, columns: FloatArray) -> FloatArray:
        white = np.asarray(np.linalg.solve(self._root, columns))
        return white.reshape(self._root[..., 0].size, columns.shape[-1])

    def white(self, columns: FloatArray) -> FloatArray:
        """Columns (S, C, n, k) with V⁻¹ = wᵀ w, (S C n, k)."""
        w = self._alone(columns)
        return np.asarray(w - self._basis @ (self._less[:, None] * (self._basis.T @ w)))
