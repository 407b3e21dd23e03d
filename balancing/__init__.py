"""Unbalance from influence coefficients: trial runs in, correction weights out."""

from balancing.correction import Correction, correct
from balancing.determined import UndeterminedError
from balancing.influence import Influence, estimate_influence
from balancing.labels import Labels
from balancing.trials import ReadingErrors, Trials

__all__ = [
    "Correction",
    "Influence",
    "Labels",
    "ReadingErrors",
    "Trials",
    "UndeterminedError",
    "correct",
    "estimate_influence",
]
