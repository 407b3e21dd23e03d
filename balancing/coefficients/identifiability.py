"""Whether the runs, or the sensors, can tell the planes apart; and if not, why, in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotorid.base.arrays import ComplexArray
from rotorid.regression import Estimate, least_squares


class UndeterminedError(ValueError):
    """The data do not determine the influence coefficients, or the weights."""


def undetermined_columns(A: ComplexArray, names: Sequence[str]) -> list[int]:
    """Columns of a complex matrix whose unknowns the equations `A x = y` leave open; empty at full rank."""
    estimate: Estimate = least_squares(A, np.zeros(len(A), dtype=complex), names=names)
    lost = set(estimate.undetermined)
    return [i for i, name in enumerate(names) if f"Re {name}" in lost or f"Im {name}" in lost]


def check_runs(runs: Sequence[str], planes: Sequence[str], weights: ComplexArray) -> None:
    """Refuse runs that do not determine the baseline and the effect of every plane.

    Parameters
    ----------
    runs, planes
        Names, R and P.
    weights
        Shape (R, P).

    Raises
    ------
    UndeterminedError
        Naming the planes, and the run to add.
    """
    for p, plane in enumerate(planes):
        if not weights[:, p].any():
            raise UndeterminedError(
                f"no run has a weight greater than zero in plane {plane!r}: "
                "make a run with a trial weight there, or leave the plane out"
            )
    A = np.column_stack((np.ones(len(runs)), weights)).astype(complex)
    names = ["the baseline", *(f"plane {p!r}" for p in planes)]
    lost = undetermined_columns(A, names)
    if not lost:
        return
    with_baseline = np.vstack((A, np.eye(1, A.shape[1])))
    if lost[0] == 0 and not undetermined_columns(with_baseline, names):
        raise UndeterminedError(
            "the runs do not determine the vibration without weights: add a baseline run, a run that has no "
            "rows in the weights table (or one more run with other weights)"
        )
    alone = [i for i in undetermined_columns(with_baseline, names) if i > 0]
    missing = " and no run without weights is there either" if lost[0] == 0 else ""
    raise UndeterminedError(_unseparated(alone, planes, weights) + missing + _states(weights))


def _unseparated(columns: list[int], planes: Sequence[str], weights: ComplexArray) -> str:
    named = [f"plane {planes[i - 1]!r}" for i in columns]
    if len(named) == 2:
        return (
            f"no run separates {named[0]} from {named[1]}: their weights always stand in the same "
            "proportion; add a run with a weight in only one of them"
        )
    return (
        f"the runs do not separate {', '.join(named)}: add runs with a weight in only one of them, "
        "for each of them but one"
    )


def _states(weights: ComplexArray) -> str:
    states = len(np.unique(weights, axis=0))
    if states > weights.shape[1]:
        return ""
    return (
        f" (the runs have {states} different sets of weights; {weights.shape[1]} planes need "
        f"at least {weights.shape[1] + 1}, with the one without weights)"
    )


def check_planes(W: ComplexArray, planes: Sequence[str]) -> None:
    """Refuse planes that the readings cannot tell apart.

    Parameters
    ----------
    W
        Influence coefficients stacked over speeds and sensors, shape (N, P).
    planes
        Names.

    Raises
    ------
    UndeterminedError
        Naming the planes that act alike.
    """
    N, P = W.shape
    if N < P:
        raise UndeterminedError(
            f"{P} planes need at least {P} readings (sensors × speeds) of a run, and there "
            f"{'is' if N == 1 else 'are'} {N}: add sensors or speeds, or choose fewer planes"
        )
    for p, plane in enumerate(planes):
        if not W[:, p].any():
            raise UndeterminedError(f"plane {plane!r} has no effect on any reading: leave it out")
    lost = undetermined_columns(W, list(planes))
    if lost:
        raise UndeterminedError(alike_words(W, lost, planes) + REMEDY)


REMEDY = "; their weights are not determined: leave one out, or add sensors or speeds"


def refusal(
    words: str, warnings: Sequence[str], contradictions: Sequence[str] = (), remedies: Sequence[str] = ()
) -> UndeterminedError:
    """The error: its cause, what follows, what to do instead, and the warnings that would be lost with it.

    Parameters
    ----------
    words
        What is not determined, and why.
    warnings
        All that was found.
    contradictions
        Those of them that are the likely cause.
    remedies
        Sentences.
    """
    rest = [w for w in warnings if w not in contradictions]
    follows = f"so {words}" if contradictions else words
    return UndeterminedError(
        "\n".join((*contradictions, follows, *remedies, *(f"Warning: {w}" for w in rest)))
    )


def acting_alike(W: ComplexArray) -> list[int]:
    """The planes that the weakest combination of W (N, P) is made of."""
    return large(np.linalg.svd(W / np.linalg.norm(W, axis=0))[2][-1])


def large(direction: ComplexArray) -> list[int]:
    """Which planes a combination (P,) is made of."""
    share = np.abs(direction) / np.linalg.norm(direction)
    # of two or more planes at least two
    return [int(p) for p in np.flatnonzero(share >= min(0.3, float(np.sort(share)[-2])))]


def alike_words(W: ComplexArray, lost: list[int], planes: Sequence[str]) -> str:
    """That some planes, columns of W (N, P), act alike, and how."""
    group = [planes[i] for i in lost]
    if len(lost) == 2:
        ratio = complex(np.vdot(W[:, lost[1]], W[:, lost[0]]) / np.vdot(W[:, lost[1]], W[:, lost[1]]))
        return (
            f"planes {group[0]!r} and {group[1]!r} act alike at every sensor and speed "
            f"(a weight in {group[0]!r} does what {abs(ratio):.4g} times that weight does in {group[1]!r})"
        )
    return f"planes {', '.join(map(repr, group))} act alike: the effect of each follows from the others"
