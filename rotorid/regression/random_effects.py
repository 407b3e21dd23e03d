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

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag

from rotorid.base.arrays import BoolArray, FloatArray, IntArray
from rotorid.regression.linear import covariance_root, solution

LEAST_GROUPS = 5
"""Fewer do not tell an odd one from the others."""
LEVEL = 0.999
"""Of the test whether a group is one of the others."""
_STEPS = 50
_FOLDS = 50
_LEAST = 1e-12


@dataclass(frozen=True, eq=False)
class RandomEffects:
    """M groups of n numbers: what they have in common, and each.

    `mean` is μ (n,), `between` and `within` are B and W, (n, n). `groups` (M, n) are the means of the groups
    over so many `jobs` (M,), `error` (M, n / 2, 2, 2) their covariances by the jobs' own errors.
    """

    mean: FloatArray
    between: FloatArray
    within: FloatArray
    groups: FloatArray
    error: FloatArray
    jobs: IntArray

    @cached_property
    def new_group(self) -> FloatArray:
        """Covariance (n, n) of a further group about the mean, which is none too well known itself."""
        error = _of_means(self.error, self.within, self.jobs)
        return np.asarray(self.between + (self.between + error) / len(self.groups))

    def distance(self, y: FloatArray, error: FloatArray) -> float:
        """Squared Mahalanobis distance of a job (n,) of a further group, with own errors (n / 2, 2, 2)."""
        covariance = self.new_group + self.within + block_diag(*error)
        least = _LEAST * np.maximum(np.diag(covariance), _LEAST * np.max(y**2))
        off = y - self.mean
        return float(off @ np.linalg.solve(covariance + np.diag(least), off))

    def known(self, m: int) -> tuple[FloatArray, FloatArray]:
        """Best linear prediction of group m from its own jobs and all groups, and its covariance (n, n)."""
        error = _of_means(self.error[[m]], self.within, self.jobs[[m]])
        G = solution(self.between + error, self.between).T
        rest = np.eye(len(G)) - G
        covariance = rest @ self.new_group @ rest.T + G @ error @ G.T
        return self.mean + G @ (self.groups[m] - self.mean), covariance


def random_effects(y: FloatArray, error: FloatArray, group: IntArray) -> RandomEffects:
    """Mean and covariances by moments, of two groups or more.

    y (J, n) has one row a job, `error` (J, n / 2, 2, 2) the covariances by its own errors, pairs of numbers
    together, `group` (J,) the number of its group, from 0 without gaps.
    """
    member = group == np.arange(group.max() + 1)[:, None]
    jobs = member.sum(axis=1)
    share = member / jobs[:, None]
    groups, errors = share @ y, np.tensordot(share**2, error, 1)
    within, dof, several = np.zeros((y.shape[1],) * 2), len(y) - len(jobs), jobs[group] > 1
    if dof:
        left = np.tensordot(1 - 1 / jobs[group], error, 1) / dof
        within = _without(shrunk((y - groups[group])[several], dof), block_diag(*left))
    mean = groups.mean(axis=0)
    between = _without(shrunk(groups - mean, len(jobs) - 1), _of_means(errors, within, jobs))
    return RandomEffects(mean, between, within, groups, errors, jobs)


def _of_means(error: FloatArray, within: FloatArray, jobs: IntArray) -> FloatArray:
    """What errors and the jobs leave in the means of groups, (n, n), on average."""
    return np.asarray(block_diag(*error.mean(axis=0)) + within * np.mean(1 / jobs))


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


def _without(scatter: FloatArray, error: FloatArray) -> FloatArray:
    """What errors leave of a scatter, (n, n), without negative variances.

    Numbers are taken in units of their scatter: in those of what is left, a number of which hardly anything
    is left would make what it has in common with others, and with it their variance, as large as one likes.
    """
    root = covariance_root(scatter - error, np.diag(scatter))
    return np.asarray(root @ root.T)


def oddness(y: FloatArray, error: FloatArray, group: IntArray) -> tuple[FloatArray, float]:
    """Squared distance of each job from the groups that belong together, (J,), and the limit of these.

    The half of the groups that lies closest together comes from concentration steps, and grows by the jobs
    that fit it; each group of these is then left out and compared with the rest (of many, in `_FOLDS` parts),
    so that none hides itself. A group counts once, however many jobs it has. The scale is the median of these
    distances: that of an estimated, shrunk covariance has no closed form. Infinite without `LEAST_GROUPS`
    groups. Parameters as `random_effects`.
    """
    from scipy.special import fdtri

    n, M = y.shape[1], len(np.bincount(group))
    if M < LEAST_GROUPS:
        return np.zeros(len(y)), np.inf

    def limit_of(jobs: BoolArray, dof: int) -> float:
        """What `LEVEL` of groups stay within, by the median of those of some jobs."""
        middle = np.median(_medians(distance[jobs], group[jobs]))
        return float(middle * fdtri(n, dof, LEVEL) / fdtri(n, dof, 0.5))

    each = _medians(y, group)
    centre = np.median(each, axis=0)
    spread = np.median(np.abs(each - centre), axis=0)
    distance = np.mean(((y - centre) / np.where(spread > 0, spread, 1.0)) ** 2, axis=1)
    inside = np.zeros(len(y), dtype=bool)
    for _ in range(_STEPS):
        nearest = [distance[group == m].min() for m in range(M)]
        half = distance <= np.sort(nearest)[M // 2]
        if (half == inside).all():
            break
        inside, distance = half, _distances(y, error, group, half, 1)
    limit = limit_of(distance < np.inf, M // 2)
    for _ in range(_STEPS):
        fits = distance <= limit
        kept = len(np.unique(group[fits]))
        if kept < LEAST_GROUPS or (fits == inside).all():
            break
        inside, distance = fits, _distances(y, error, group, fits, _FOLDS)
        limit = limit_of(fits, kept - 1)
    return distance, limit


def _medians(values: FloatArray, group: IntArray) -> FloatArray:
    """Median of each group over its jobs, values (J, …)."""
    return np.array([np.median(values[group == m], axis=0) for m in np.unique(group)])


def _distances(
    y: FloatArray, error: FloatArray, group: IntArray, inside: BoolArray, folds: int
) -> FloatArray:
    """Squared distance of each job from those inside, its group's fold left out if there are several."""
    distances, fold = np.empty(len(y)), group % folds
    for k in np.unique(fold).tolist():
        rest = inside & ((fold != k) | (folds == 1))
        number = np.unique(group[rest], return_inverse=True)[1]
        effects = random_effects(y[rest], error[rest], number)
        for j in np.flatnonzero(fold == k).tolist():
            distances[j] = effects.distance(y[j], error[j])
    return distances
