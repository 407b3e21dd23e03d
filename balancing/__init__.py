"""Unbalance from influence coefficients: trial runs in, correction weights out."""

from balancing.check import CheckComparison, compare_check
from balancing.combine import combine
from balancing.conditioning import Conditioning, conditioning
from balancing.correction import Correction, correct
from balancing.determined import UndeterminedError
from balancing.discrete import Discrete, solve_discrete
from balancing.history import History, history
from balancing.holes import Holes, equal_holes, from_list
from balancing.influence import Influence, estimate_influence
from balancing.labels import Labels
from balancing.limits import Limits
from balancing.modelled import modal_shapes, model_influence
from balancing.mounted import Mounted, mount
from balancing.refine import Trim, refine, trim
from balancing.removal import Drill, drill_holes
from balancing.solve import Solution, solve
from balancing.split import Split, split
from balancing.subset import Subsets, best_subsets
from balancing.tolerance import Tolerance, tolerance
from balancing.tradeoff import TradeOff, trade_off
from balancing.trial_weight import trial_from_coefficients, trial_from_force
from balancing.trials import ReadingErrors, Trials
from balancing.unbalance import estimate_unbalance, unbalance_of_run
from balancing.unbalance_result import Unbalance
from balancing.verdict import Verdict, verdict_of_check, verdict_of_prediction

__all__ = [
    "CheckComparison",
    "Conditioning",
    "Correction",
    "Discrete",
    "Drill",
    "History",
    "Holes",
    "Influence",
    "Labels",
    "Limits",
    "Mounted",
    "ReadingErrors",
    "Solution",
    "Split",
    "Subsets",
    "Tolerance",
    "TradeOff",
    "Trials",
    "Trim",
    "Unbalance",
    "UndeterminedError",
    "Verdict",
    "best_subsets",
    "combine",
    "compare_check",
    "conditioning",
    "correct",
    "drill_holes",
    "equal_holes",
    "estimate_influence",
    "estimate_unbalance",
    "from_list",
    "history",
    "modal_shapes",
    "model_influence",
    "mount",
    "refine",
    "solve",
    "solve_discrete",
    "split",
    "tolerance",
    "trade_off",
    "trial_from_coefficients",
    "trial_from_force",
    "trim",
    "unbalance_of_run",
    "verdict_of_check",
    "verdict_of_prediction",
]
