"""Random effects: what groups have in common, how they differ, and how runs of one group differ.

A vector of job j of group m is y_mj = μ + b_m + w_mj + e_mj: b differs between groups (covariance B), w
from run to run within one (W), and the error e, of known covariance, is that of the measurement. By moments:
W is the pooled scatter of the jobs about their group's mean less what e leaves in it; B the scatter of the
groups' means less what w and e leave in these; neither with negative variances. Covariances of n numbers from
few groups are shrunk towards their diagonal, by as much as the scatter of the correlations calls for.

Sources: N. M. Laird, J. H. Ware, Biometrics 38 (1982) 963; J. Schäfer, K. Strimmer, Stat. Appl. Genet. Mol.
Biol. 4 (2005) 32; concentration steps: P. J. Rousseeuw, K. van Driessen, Technometrics 41 (1999) 212.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rotorid.base.arrays import BoolArray, FloatArray, IntArray

LEAST_GROUPS = 5
"""Fewer do not tell an odd one from the others."""
LEVEL = 0.999
"""Of the test whether a group is one of the others."""
_STEPS = 50
_FOLDS = 50
_LEAST = 1e-12


@dataclass(frozen=True, eq=False)
class Groups:
    """Means of M groups of n numbers.

    Attributes
    ----------
    mean
        Shape (M, n).
    error
        Covariance of each by the errors of its jobs, pairs of numbers together, (M, n / 2, 2, 2).
    jobs
        How many each is the mean of, (M,).
    within
        W, (n, n).
    """

    mean: FloatArray
    error: FloatArray
    jobs: IntArray
    within: FloatArray

    def part(self, chosen: BoolArray) -> Groups:
        """Some of them."""
        return replace(self, mean=self.mean[chosen], error=self.error[chosen], jobs=self.jobs[chosen])

    def covariance(self, m: int) -> FloatArray:
        """Of the mean of group m about the group itself, (n, n)."""
        return np.asarray(_in_blocks(self.error[m]) + self.within / self.jobs[m])


@dataclass(frozen=True, eq=False)
class RandomEffects:
    """What groups have in common.

    Attributes
    ----------
    mean
        μ (n,).
    between, within
        B and W, (n, n).
    groups
        How many it is made of.
    """

    mean: FloatArray
    between: FloatArray
    within: FloatArray
    groups: int

    @property
    def new_group(self) -> FloatArray:
        """Covariance (n, n) of a further group about the mean, which is none too well known itself."""
        return self.between * (1.0 + 1.0 / self.groups)

    def distance(self, y: FloatArray, error: FloatArray) -> float:
        """Squared Mahalanobis distance of a further group y (n,) with the covariance `error` (n, n)."""
        covariance = self.new_group + error
        size = np.sqrt(np.maximum(np.diag(covariance), _LEAST * np.max(y**2, initial=0.0)))
        scaled = covariance / np.outer(*(np.where(size > 0, size, 1.0),) * 2)
        off = (y - self.mean) / np.where(size > 0, size, 1.0)
        return float(off @ np.linalg.solve(scaled + _LEAST * np.eye(len(y)), off))

    def given(self, y: FloatArray, error: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean (n,) and covariance (n, n) of a group whose jobs had the mean y with this covariance."""
        G = np.linalg.lstsq((self.new_group + error).T, self.new_group, rcond=None)[0].T
        return self.mean + G @ (y - self.mean), positive(self.new_group - G @ self.new_group)


def grouped(y: FloatArray, error: FloatArray, group: IntArray) -> Groups:
    """Groups of jobs.

    Parameters
    ----------
    y
        One row a job, (J, n).
    error
        Covariance of each by its own errors, pairs of numbers together, (J, n / 2, 2, 2).
    group
        Number of each job's group, (J,), from 0 without gaps.
    """
    jobs = np.bincount(group)
    mean, own = np.zeros((len(jobs), y.shape[1])), np.zeros((len(jobs), *error.shape[1:]))
    np.add.at(mean, group, y / jobs[group, None])
    np.add.at(own, group, error / jobs[group, None, None, None] ** 2)
    within = np.zeros((y.shape[1],) * 2)
    several = jobs[group] > 1
    if several.any():
        off = (y - mean[group]) * np.sqrt(jobs / np.maximum(jobs - 1, 1))[group, None]
        within = positive(shrunk(off[several], int(several.sum())) - _in_blocks(error[several].mean(axis=0)))
    return Groups(mean, own, jobs, within)


def random_effects(groups: Groups) -> RandomEffects:
    """Mean and covariances by moments, of two groups or more."""
    mean, M = groups.mean.mean(axis=0), len(groups.mean)
    error = _in_blocks(groups.error.mean(axis=0)) + groups.within * np.mean(1 / groups.jobs)
    return RandomEffects(mean, positive(shrunk(groups.mean - mean, M - 1) - error), groups.within, M)


def shrunk(off: FloatArray, dof: int) -> FloatArray:
    """Covariance (n, n) of deviations (N, n) of so many degrees of freedom, shrunk towards its diagonal."""
    N = len(off)
    std = np.sqrt(np.sum(off**2, axis=0) / dof)
    x = off / np.where(std > 0, std, 1.0)
    R = x.T @ x / dof
    other = ~np.eye(len(R), dtype=bool)
    variance = ((x**2).T @ x**2 - (x.T @ x) ** 2 / N)[other].sum() * N / dof**3
    total = float(np.sum(R[other] ** 2))
    share = 1.0 if N < 3 or not total else float(np.clip(variance / total, 0.0, 1.0))
    return np.asarray(np.where(other, (1 - share) * R, R) * np.outer(std, std))


def positive(covariance: FloatArray) -> FloatArray:
    """The nearest covariance without negative variances, each number in units of its own size."""
    size = np.sqrt(np.abs(np.diag(covariance)))
    scale = np.outer(*(np.where(size > 0, size, 1.0),) * 2)
    values, vectors = np.linalg.eigh(covariance / scale)
    return np.asarray((vectors * values.clip(0.0)) @ vectors.T * scale)


def oddness(groups: Groups) -> tuple[FloatArray, float]:
    """Squared distance of each group from those that belong together, (M,), and the limit of these.

    The half that lies closest together is found by concentration steps, and grown by what fits it; each of
    these is then left out and compared with the rest (of many, in `_FOLDS` parts), so that none hides itself.
    The scale is the median of these distances: that of an estimated, shrunk covariance has no closed form.
    Infinite without `LEAST_GROUPS` groups.
    """
    M, n = groups.mean.shape
    if M < LEAST_GROUPS:
        return np.zeros(M), np.inf
    centre = np.median(groups.mean, axis=0)
    spread = np.median(np.abs(groups.mean - centre), axis=0)
    distance = np.mean(((groups.mean - centre) / np.where(spread > 0, spread, 1.0)) ** 2, axis=1)
    inside = np.zeros(M, dtype=bool)
    for _ in range(_STEPS):
        half = np.zeros(M, dtype=bool)
        half[np.argsort(distance, kind="stable")[: M // 2 + 1]] = True
        if (half == inside).all():
            break
        inside, distance = half, _distances(groups, half, 1)
    limit = _limit(distance, n, M // 2)
    for _ in range(_STEPS):
        fits = distance <= limit
        if fits.sum() < LEAST_GROUPS or (fits == inside).all():
            break
        inside, distance = fits, _distances(groups, fits, _FOLDS)
        limit = _limit(distance[fits], n, int(fits.sum()) - 1)
    return distance, limit


def _limit(distance: FloatArray, n: int, dof: int) -> float:
    """What `LEVEL` of groups stay within, by the median of some."""
    from scipy.special import fdtri

    return float(np.median(distance) * fdtri(n, dof, LEVEL) / fdtri(n, dof, 0.5))


def _distances(groups: Groups, inside: BoolArray, folds: int) -> FloatArray:
    """Squared distance of each group from those inside, its own fold left out if there are several."""
    found = np.empty(len(inside))
    fold = np.arange(len(inside)) % folds
    for k in range(min(folds, len(inside))):
        effects = random_effects(groups.part(inside & (fold != k) if folds > 1 else inside))
        for m in np.flatnonzero(fold == k).tolist():
            found[m] = effects.distance(groups.mean[m], groups.covariance(m))
    return found


def _in_blocks(pairs: FloatArray) -> FloatArray:
    """Covariance (2N, 2N) of pairs of numbers, (N, 2, 2), independent of each other."""
    N = len(pairs)
    out = np.zeros((N, 2, N, 2))
    out[np.arange(N), :, np.arange(N)] = pairs
    return out.reshape(2 * N, 2 * N)
