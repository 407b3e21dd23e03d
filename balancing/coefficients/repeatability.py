"""Repeatability: whether runs with the same weights mounted show the same vibration."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from balancing.data.reading_errors import ErrorModel, covariance_beside_digits, mean_variance
from balancing.data.trials import ReadingErrors, Trials
from rotorid.base.arrays import ComplexArray, FloatArray, IntArray
from rotorid.regression import stretch

LEVEL = 0.99
NOTICEABLE_AMPLITUDE, NOTICEABLE = 0.10, 0.20
"""Readings of one state of the rotor that differ by more deserve a question, where errors are not tested."""
CLEAR = 3.0
"""Standard deviations that it must be as well."""


class Difference(NamedTuple):
    """Two runs that should agree and do not: names, and how large the difference is, in words."""

    first: str
    second: str
    words: str


def same_state(weights: ComplexArray) -> list[list[int]]:
    """Groups of two or more runs with the same weights mounted; weights (R, P)."""
    scale = np.abs(weights).max(initial=0.0) or 1.0
    groups: dict[tuple[complex, ...], list[int]] = defaultdict(list)
    for r, row in enumerate(np.round(weights / scale, 9) + 0.0):
        groups[tuple(row)].append(r)
    return [group for group in groups.values() if len(group) > 1]


def differences(trials: Trials, model: ErrorModel, largest: bool = False) -> list[Difference]:
    """Runs with the same weights mounted whose readings differ, the worst pair of each group.

    Parameters
    ----------
    trials
        The runs.
    model
        Errors of a reading: where they are stated, and none between runs, a χ² test at 99 %.
    largest
        Else: one reading counts that changes by 10 % of the largest of all, instead of all together (20 %).
    """
    found = []
    tested = model.source == "stated" and trials.run_errors is None
    for group in same_state(trials.weights):
        if tested:
            found.append(_beyond_errors(trials, group, model))
        else:
            found.append(_noticeable(trials, group, model, largest=largest))
    return [difference for difference in found if difference is not None]


def describe(found: Sequence[Difference]) -> tuple[str, ...]:
    """The question to ask about each difference."""
    return tuple(
        f"runs {d.first!r} and {d.second!r} have the same weights mounted but differ by {d.words}; "
        "is a row missing in the weights table?"
        for d in found
    )


def _noticeable(trials: Trials, group: list[int], model: ErrorModel, *, largest: bool) -> Difference | None:
    Y = trials.mean
    worst, pair = 0.0, None
    relative, floor = trials.run_errors or (0.0, 0.0)
    variance = (relative * np.abs(Y)) ** 2 + floor**2
    variance += mean_variance(covariance_beside_digits(trials, model))
    top = np.abs(Y).max() if largest else np.abs(Y[group]).max(axis=(0, 2))[:, None]
    for k, a in enumerate(group):
        for b in group[k + 1 :]:
            larger = np.maximum(np.abs(Y[a]), np.abs(Y[b]))
            change = np.abs(Y[a] - Y[b])
            if largest:
                share = change / (top or 1.0)
                counts = share > NOTICEABLE_AMPLITUDE
            else:
                share = change / np.where(larger > 0, larger, 1.0)
                whole = np.sqrt(np.sum(change**2) / (np.sum(larger**2) or 1.0))
                counts = (larger > 0.1 * top) & (whole > NOTICEABLE)
            counts &= change > CLEAR * np.sqrt(variance[a] + variance[b])
            if counts.any() and share[counts].max() > worst:
                worst, pair = float(share[counts].max()), (a, b)
    if pair is None:
        return None
    of = " of the largest reading" if largest else ""
    return Difference(trials.runs[pair[0]], trials.runs[pair[1]], f"{100 * worst:.2g} %{of}")


def _beyond_errors(trials: Trials, group: list[int], model: ErrorModel) -> Difference | None:
    """χ² of the readings around their mean, with the mean covariance of the group."""
    assert model.errors is not None
    Y, repeats = trials.mean[group], trials.repeats[group]
    every = covariance_beside_digits(trials, replace(model, errors=both_directions(model.errors)))
    each = every[group] * repeats[..., None, None]
    root = _inverse_root(each.mean(axis=0))  # (S, C, 2, 2), zero where every reading is
    mean = np.sum(Y * repeats, axis=0) / repeats.sum(axis=0)
    squares = _squares(root, Y - mean, repeats)
    dof = 2 * (len(group) - 1) * int(np.count_nonzero(root.any(axis=(-2, -1))))
    chi_square = float(squares.sum())
    if dof == 0 or tail(chi_square, dof, model.dof) > 1 - LEVEL:
        return None

    def apart(pair: tuple[int, int]) -> float:
        a, b = pair
        return float(_squares(root, Y[a] - Y[b], 1 / (1 / repeats[a] + 1 / repeats[b])).sum())

    first, second = max(combinations(range(len(group)), 2), key=apart)
    words = f"{np.sqrt(chi_square / dof):.2g} times the errors of the readings"
    return Difference(trials.runs[group[first]], trials.runs[group[second]], words)


def _squares(root: FloatArray, change: ComplexArray, counts: FloatArray | IntArray) -> FloatArray:
    """Squares of changes (…, S, C) in units of their errors, of means of so many readings."""
    vector = stretch(change.reshape(-1)).reshape(*change.shape, 2)
    return np.asarray(counts * np.sum(np.einsum("scij,...scj->...sci", root, vector) ** 2, axis=-1))


def both_directions(errors: ReadingErrors) -> ReadingErrors:
    """The errors with one for each direction: an error that is not stated is hardly zero."""
    return replace(errors, amplitude=errors.amplitude or errors.phase, phase=errors.phase or errors.amplitude)


def tail(chi_square: float, n: int, dof: float | None = None) -> float:
    """Probability of a larger χ² with n degrees of freedom; of F where the errors have `dof` themselves."""
    from scipy.special import chdtrc, fdtrc

    return float(chdtrc(n, chi_square) if dof is None else fdtrc(n, dof, chi_square / n))


def _inverse_root(covariance: FloatArray) -> FloatArray:
    """A with Aᵀ A = C⁻¹ for 2 × 2 blocks, zero where C is."""
    values, vectors = np.linalg.eigh(covariance)
    inverse = np.where(values > 0, 1 / np.sqrt(np.where(values > 0, values, 1.0)), 0.0)
    return np.asarray(inverse[..., :, None] * np.swapaxes(vectors, -1, -2))
