"""Unbalance from influence coefficients: trial runs in, correction weights out.

Trial runs give influence coefficients (`estimate_influence`), these and a vibration correction weights
(`correct`), these pieces in holes (`mount`); a check run is compared with its prediction (`compare_check`)
and counts for the coefficients (`refine`).
"""

from __future__ import annotations

from balancing.check_run import CheckComparison, compare_check, last_run, refine, with_check_runs
from balancing.choice_of_pieces import Mounted, mount
from balancing.computed import combine, model_influence, with_parameters
from balancing.conditioning import (
    Conditioning,
    UndeterminedError,
    check_runs,
    conditioning,
)
from balancing.convention_test import ConventionTest, convention_test
from balancing.conventions import Labels
from balancing.correct import correct
from balancing.correction_result import Correction
from balancing.error_draws import Gaussian
from balancing.groups import Groups, Unknowns, held, in_planes, mapped, unknowns
from balancing.holes import Holes, equal_holes, from_list
from balancing.influence import (
    Influence,
    Remarks,
    estimate_influence,
    local_runs,
    match_speeds,
)
from balancing.iso21940 import GRADES, Tolerance, tolerance
from balancing.limits_and_minmax import InfeasibleError
from balancing.methods import METHODS, Solution, solve
from balancing.pass_or_fail import (
    Verdict,
    Zones,
    verdict_of_check,
    verdict_of_prediction,
    verdict_of_readings,
    zones_of,
)
from balancing.piece_search import Discrete, solve_discrete
from balancing.reading_errors import Reading, RunErrors, reading_of, usual_run_errors
from balancing.regions import Region, real_parts, region_edge
from balancing.special_runs import machine_influence, relative_to, rotor_and_arbor, with_arbor
from balancing.trial_weight import (
    Lag,
    TrialWeight,
    expected_lag,
    trial_from_coefficients,
    trial_from_force,
)
from balancing.trials import TRIAL_WEIGHTS, Limits, Placement, ReadingErrors, Relative, RunScatter, Trials
from balancing.trim_after_check_run import LeftToDo, after_check_run
from balancing.unbalance import Unbalance, estimate_unbalance, unbalance_of_run
from balancing.what_if import WhatIf, mode_made_worse, what_if
from balancing.without_phase import AmplitudeSolution, WithoutPhase, balance_without_phase

__all__ = [
    "GRADES",
    "METHODS",
    "TRIAL_WEIGHTS",
    "AmplitudeSolution",
    "CheckComparison",
    "Conditioning",
    "ConventionTest",
    "Correction",
    "Discrete",
    "Gaussian",
    "Groups",
    "Holes",
    "InfeasibleError",
    "Influence",
    "Labels",
    "Lag",
    "LeftToDo",
    "Limits",
    "Mounted",
    "Placement",
    "Reading",
    "ReadingErrors",
    "Region",
    "Relative",
    "Remarks",
    "RunErrors",
    "RunScatter",
    "Solution",
    "Tolerance",
    "TrialWeight",
    "Trials",
    "Unbalance",
    "UndeterminedError",
    "Unknowns",
    "Verdict",
    "WhatIf",
    "WithoutPhase",
    "Zones",
    "after_check_run",
    "balance_without_phase",
    "check_runs",
    "combine",
    "compare_check",
    "conditioning",
    "convention_test",
    "correct",
    "equal_holes",
    "estimate_influence",
    "estimate_unbalance",
    "expected_lag",
    "from_list",
    "held",
    "in_planes",
    "last_run",
    "local_runs",
    "machine_influence",
    "mapped",
    "match_speeds",
    "mode_made_worse",
    "model_influence",
    "mount",
    "reading_of",
    "real_parts",
    "refine",
    "region_edge",
    "relative_to",
    "rotor_and_arbor",
    "solve",
    "solve_discrete",
    "tolerance",
    "trial_from_coefficients",
    "trial_from_force",
    "unbalance_of_run",
    "unknowns",
    "usual_run_errors",
    "verdict_of_check",
    "verdict_of_prediction",
    "verdict_of_readings",
    "what_if",
    "with_arbor",
    "with_check_runs",
    "with_parameters",
    "zones_of",
]


def __dir__() -> list[str]:
    return sorted(__all__)
