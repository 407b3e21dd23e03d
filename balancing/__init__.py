"""Unbalance from influence coefficients: trial runs in, correction weights out.

Every name below is loaded when it is first used.
"""

from __future__ import annotations

from rotorid.base.lazy_names import lazy_names

TYPE_CHECKING = False
if TYPE_CHECKING:
    from balancing.coefficients.coefficients_from_model import modal_shapes as modal_shapes
    from balancing.coefficients.coefficients_from_model import model_influence as model_influence
    from balancing.coefficients.coefficients_from_model import with_parameters as with_parameters
    from balancing.coefficients.combined_coefficients import combine as combine
    from balancing.coefficients.identifiability import UndeterminedError as UndeterminedError
    from balancing.coefficients.influence import Influence as Influence
    from balancing.coefficients.influence import estimate_influence as estimate_influence
    from balancing.correction.best_planes import Subsets as Subsets
    from balancing.correction.best_planes import best_subsets as best_subsets
    from balancing.correction.check_run import compare_check as compare_check
    from balancing.correction.check_run_result import CheckComparison as CheckComparison
    from balancing.correction.correct import correct as correct
    from balancing.correction.correction_result import Correction as Correction
    from balancing.correction.history import History as History
    from balancing.correction.history import history as history
    from balancing.correction.refine_coefficients import refine as refine
    from balancing.correction.trade_off import TradeOff as TradeOff
    from balancing.correction.trade_off import trade_off as trade_off
    from balancing.correction.verdict import Verdict as Verdict
    from balancing.correction.verdict import verdict_of_check as verdict_of_check
    from balancing.correction.verdict import verdict_of_prediction as verdict_of_prediction
    from balancing.data.conventions import Labels as Labels
    from balancing.data.limits import Limits as Limits
    from balancing.data.trials import ReadingErrors as ReadingErrors
    from balancing.data.trials import Trials as Trials
    from balancing.iso21940 import Tolerance as Tolerance
    from balancing.iso21940 import tolerance as tolerance
    from balancing.mounting.discrete_weights import Discrete as Discrete
    from balancing.mounting.discrete_weights import solve_discrete as solve_discrete
    from balancing.mounting.holes import Holes as Holes
    from balancing.mounting.holes import equal_holes as equal_holes
    from balancing.mounting.holes import from_list as from_list
    from balancing.mounting.material_removal import Drill as Drill
    from balancing.mounting.material_removal import drill_holes as drill_holes
    from balancing.mounting.mount import mount as mount
    from balancing.mounting.mount_result import Mounted as Mounted
    from balancing.mounting.split import Split as Split
    from balancing.mounting.split import split as split
    from balancing.solvers.conditioning import Conditioning as Conditioning
    from balancing.solvers.conditioning import conditioning as conditioning
    from balancing.solvers.least_squares_minmax import Solution as Solution
    from balancing.solvers.least_squares_minmax import solve as solve
    from balancing.trial_weight import trial_from_coefficients as trial_from_coefficients
    from balancing.trial_weight import trial_from_force as trial_from_force
    from balancing.unbalance import estimate_unbalance as estimate_unbalance
    from balancing.unbalance import unbalance_of_run as unbalance_of_run
    from balancing.unbalance_result import Unbalance as Unbalance

_HOME = {
    "modal_shapes": "coefficients.coefficients_from_model",
    "model_influence": "coefficients.coefficients_from_model",
    "with_parameters": "coefficients.coefficients_from_model",
    "combine": "coefficients.combined_coefficients",
    "UndeterminedError": "coefficients.identifiability",
    "Influence": "coefficients.influence",
    "estimate_influence": "coefficients.influence",
    "Subsets": "correction.best_planes",
    "best_subsets": "correction.best_planes",
    "compare_check": "correction.check_run",
    "CheckComparison": "correction.check_run_result",
    "correct": "correction.correct",
    "Correction": "correction.correction_result",
    "History": "correction.history",
    "history": "correction.history",
    "refine": "correction.refine_coefficients",
    "TradeOff": "correction.trade_off",
    "trade_off": "correction.trade_off",
    "Verdict": "correction.verdict",
    "verdict_of_check": "correction.verdict",
    "verdict_of_prediction": "correction.verdict",
    "Labels": "data.conventions",
    "Limits": "data.limits",
    "ReadingErrors": "data.trials",
    "Trials": "data.trials",
    "Tolerance": "iso21940",
    "tolerance": "iso21940",
    "Discrete": "mounting.discrete_weights",
    "solve_discrete": "mounting.discrete_weights",
    "Holes": "mounting.holes",
    "equal_holes": "mounting.holes",
    "from_list": "mounting.holes",
    "Drill": "mounting.material_removal",
    "drill_holes": "mounting.material_removal",
    "mount": "mounting.mount",
    "Mounted": "mounting.mount_result",
    "Split": "mounting.split",
    "split": "mounting.split",
    "Conditioning": "solvers.conditioning",
    "conditioning": "solvers.conditioning",
    "Solution": "solvers.least_squares_minmax",
    "solve": "solvers.least_squares_minmax",
    "trial_from_coefficients": "trial_weight",
    "trial_from_force": "trial_weight",
    "estimate_unbalance": "unbalance",
    "unbalance_of_run": "unbalance",
    "Unbalance": "unbalance_result",
}

__all__ = [*_HOME]

__getattr__, __dir__ = lazy_names(__name__, _HOME)
