"""Unbalance from influence coefficients: trial runs in, correction weights out."""

from balancing.check import CheckComparison, compare_check
from balancing.combine import combine
from balancing.conditioning import Conditioning, conditioning
from balancing.correction import Correction, correct
from balancing.determined import UndeterminedError
from balancing.influence import Influence, estimate_influence
from balancing.labels import Labels
from balancing.limits import Limits
from balancing.modelled import modal_shapes, model_influence
from balancing.solve import Solution, solve
from balancing.subset import Subsets, best_subsets
from balancing.tradeoff import TradeOff, trade_off
from balancing.trials import ReadingErrors, Trials
from balancing.unbalance import estimate_unbalance, unbalance_of_run
from balancing.unbalance_result import Unbalance

__all__ = [
    "CheckComparison",
    "Conditioning",
    "Correction",
    "Influence",
    "Labels",
    "Limits",
    "ReadingErrors",
    "Solution",
    "Subsets",
    "TradeOff",
    "Trials",
    "Unbalance",
    "UndeterminedError",
    "best_subsets",
    "combine",
    "compare_check",
    "conditioning",
    "correct",
    "estimate_influence",
    "estimate_unbalance",
    "modal_shapes",
    "model_influence",
    "solve",
    "trade_off",
    "unbalance_of_run",
]
