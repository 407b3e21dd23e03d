"""Unbalance from influence coefficients: trial runs in, correction weights out."""

from balancing.coefficients.coefficients_from_model import modal_shapes, model_influence, with_parameters
from balancing.coefficients.combined_coefficients import combine
from balancing.coefficients.identifiability import UndeterminedError
from balancing.coefficients.influence import Influence, estimate_influence
from balancing.correction.best_planes import Subsets, best_subsets
from balancing.correction.check_run import compare_check
from balancing.correction.check_run_result import CheckComparison
from balancing.correction.correct import correct
from balancing.correction.correction_result import Correction
from balancing.correction.history import History, history
from balancing.correction.refine_coefficients import refine
from balancing.correction.trade_off import TradeOff, trade_off
from balancing.correction.verdict import Verdict, verdict_of_check, verdict_of_prediction
from balancing.data.conventions import Labels
from balancing.data.limits import Limits
from balancing.data.trials import ReadingErrors, Trials
from balancing.iso21940 import Tolerance, tolerance
from balancing.mounting.discrete_weights import Discrete, solve_discrete
from balancing.mounting.holes import Holes, equal_holes, from_list
from balancing.mounting.material_removal import Drill, drill_holes
from balancing.mounting.mount import mount
from balancing.mounting.mount_result import Mounted
from balancing.mounting.split import Split, split
from balancing.solvers.conditioning import Conditioning, conditioning
from balancing.solvers.least_squares_minmax import Solution, solve
from balancing.trial_weight import trial_from_coefficients, trial_from_force
from balancing.unbalance import estimate_unbalance, unbalance_of_run
from balancing.unbalance_result import Unbalance

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
    "unbalance_of_run",
    "verdict_of_check",
    "verdict_of_prediction",
    "with_parameters",
]
