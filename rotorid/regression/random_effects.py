"""Random effects: what groups have in common, how they differ, and how runs of one group differ.

A vector of job j of group m is y_mj = μ + b_m + w_mj + e_mj: b differs between groups (covariance B), w
from run to run within one (W), and the error e, of known covariance, is that of the measurement. By moments:
W is the pooled scatter of the jobs about their group's mean less what e leaves in it; B the scatter of the
groups' means less what w and e leave in these; neither with negative variances. Covariances of n numbers from
few groups are shrunk towards their diagonal, by as much as the scatter of the correlations calls for.

Sources: N. M. Laird, J. H. Ware, Biometrics 38 (1982) 963; J. Schäfer, K. Strimmer, Stat. Appl. Genet. Mol.
Biol. 4 (2005) 32.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from rotorid.base.arrays import FloatArray, IntArray
from rotorid.regression.linear import covariance_root, solution

LEAST_GROUPS = 5
"""Fewer do not tell an odd one from the others."""
LEVEL = 0.999
"""Of the test whether a group is one of the others."""
_STEPS = 50
_FOLDS = 50
_LEAST = 1e-12


class RandomEffects(NamedTuple):
    """M groups of n numbers: what they have in common, and each.

    `mean` is μ (n,), `between` and `within` are B and W, (n, n); `new_group` is the covariance of a further
    group about the mean, which is none too well known itself. `groups` (M, n) are the means of the groups
    over so many `jobs` (M,), `error` (M, n / 2, 2, 2) their covariances by the jobs' own errors.
    """

    mean: FloatArray
    between: FloatArray
    within: FloatArray
    new_group: FloatArray
    groups: FloatArray
    error: FloatArray
    jobs: IntArray

    def distance(self, y: FloatArray, error: FloatArray) -> float:
        """Squared Mahalanobis distance of a job (n,) of a further group, with own errors (n / 2, 2, 2)."""
        covariance = self.new_group + self.within + block_diag(*error)
        least = _LEAST * np.maximum(np.diag(covariance), _LEAST * np.max(y**2))
        off = y - self.mean
        return float(off @ np.linalg.solve(covariance + np.diag(least), off))

    def known(self, m: int) -> tuple[FloatArray, FloatArray]:
        """Best linear prediction of group m from its own jobs and all groups, and its covariance (n, n)."""
        error = block_diag(*self.error[m]) + self.within / self.jobs[m]
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
    within, dof, alone = np.zeros((y.shape[1],) * 2), len(y) - len(jobs), 1 / jobs[group]
    if dof:
        left = block_diag(*np.tensordot(1 - alone, error, 1) / dof)
        within = _without(shrunk((y - groups[group])[alone < 1], dof), left)
    mean, noise = groups.mean(axis=0), block_diag(*errors.mean(axis=0)) + within * np.mean(1 / jobs)
    between = _without(shrunk(groups - mean, len(jobs) - 1), noise)
    new_group = between + (between + noise) / len(jobs)
    return RandomEffects(mean, between, within, new_group, groups, errors, jobs)


def shrunk(off: FloatArray, dof: int) -> FloatArray:
    """Covariance (n, n) of deviations (N, n) of so many degrees of freedom, shrunk towards its diagonal."""
    N, scatter, other = len(off), off.T @ off / dof, 1.0 - np.eye(off.shape[1])
    std = np.sqrt(np.diag(scatter))
    x = off / np.where(std > 0, std, 1.0)
    variance = N / dof**3 * np.sum(other * ((x**2).T @ x**2 - (x.T @ x) ** 2 / N))
    total = float(np.sum(other * (x.T @ x / dof) ** 2))
    share = 1.0 if N < 3 or not total else float(np.clip(variance / total, 0.0, 1.0))
    return scatter * (1.0 - share * other)


def _without(scatter: FloatArray, error: FloatArray) -> FloatArray:
    """What errors leave of a scatter, (n, n), without negative variances.

    Numbers are taken in units of their scatter: in those of what is left, a number of which hardly anything
    is left would make what it has in common with others, and with it their variance, as large as one likes.
    """
    root = covariance_root(scatter - error, np.diag(scatter))
    return root @ root.T


def oddness(y: FloatArray, error: FloatArray, group: IntArray) -> tuple[FloatArray, float]:
    """Squared distance of each job from the groups that belong together, (J,), and the limit of these.

    These are first the half of the groups nearest to the medians, then those that fit them; from then on each
    is left out and compared with the rest (of many, in `_FOLDS` parts), so that none hides itself. A group
    counts once, however many jobs it has. The scale is the median of these distances: that of an estimated,
    shrunk covariance has no closed form. Infinite without `LEAST_GROUPS` groups. Parameters as
    `random_effects`.
    """
    from scipy.special import fdtri

    if len(np.unique(group)) < LEAST_GROUPS:
        return np.zeros(len(y)), np.inf
    each = _medians(y, group)
    centre = np.median(each, axis=0)
    spread = np.median(np.abs(each - centre), axis=0)
    distance = np.mean(((y - centre) / np.where(spread > 0, spread, 1.0)) ** 2, axis=1)
    inside, folds = distance <= np.sort(_medians(distance, group))[len(each) // 2], 1
    for _ in range(_STEPS):
        fold = group % folds
        for k in np.unique(fold).tolist():
            rest = inside & ((fold != k) | (folds == 1))
            number = np.unique(group[rest], return_inverse=True)[1]
            others = random_effects(y[rest], error[rest], number)
            for j in np.flatnonzero(fold == k).tolist():
                distance[j] = others.distance(y[j], error[j])
        near = _medians(distance[inside], group[inside])
        most, middle = fdtri(y.shape[1], len(near) - 1, [LEVEL, 0.5])
        limit = float(np.median(near) * most / middle)
        fits = distance <= limit
        if len(np.unique(group[fits])) < LEAST_GROUPS or (fits == inside).all():
            break
        inside, folds = fits, _FOLDS
    return distance, limit


def _medians(values: FloatArray, group: IntArray) -> FloatArray:
    """Median of each group over its jobs, values (J, …)."""
    return np.array([np.median(values[group == m], axis=0) for m in np.unique(group)])
