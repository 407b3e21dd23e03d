"""`balance` of runs without phases: options that have no meaning there, and the outcome."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.text import listing
from rotorid.commands.quantities import names, speeds
from rotorid.report.outcome import Outcome, Written, outcome_of, provenance

if TYPE_CHECKING:
    from balancing import Trials
    from rotorid.commands.balance_solution import BalanceOptions
    from rotorid.files import Job

_REFUSED = {
    "method": "--method",
    "influence": "--influence",
    "coefficients": "--coefficients",
    "machine_type": "--type",
    "limit": "--limit",
    "ridge": "--ridge",
    "split": "--split (put the weight into holes by rotorid split)",
    "refine": "--refine (add the check run to the runs)",
    "grade": "--grade",
    "rotor_mass": "--rotor-mass",
    "service_speed": "--service-speed",
}


@dataclass(frozen=True, eq=False, kw_only=True)
class BalanceWithoutPhase(Outcome):
    """What amplitudes alone give; `job` is what it is made of."""

    job: Job


def balanced_without_phase(job: Job, options: BalanceOptions) -> BalanceWithoutPhase:
    """Correction weights from amplitudes.

    Raises
    ------
    ValueError
        For options that need phases, all in one message; UndeterminedError.
    """
    from balancing import balance_without_phase

    if given := [flag for name, flag in _REFUSED.items() if getattr(options, name) not in (None, False, ())]:
        raise ValueError(f"the runs have no phases: leave {listing(given, 'and')} away")
    trials, used = (
        job.trials,
        names(options.planes)
        or [
            plane
            for plane, of in zip(job.trials.planes, job.trials.weights.T, strict=True)
            if of.any() and plane in job.used
        ],
    )
    weights = job.row_weights
    if options.speeds is not None:
        trials, weights = _at_speeds(trials, weights, options)
    limits = job.limits_of(used)
    left_out = job.holes or (
        limits is not None and (np.isfinite(limits.residual).any() or any(limits.forbidden))
    )
    if left_out:
        words = (
            "holes, forbidden arcs and limits of sensors are not used without phases (holes: rotorid split)"
        )
        trials = replace(trials, warnings=(*trials.warnings, words))
    result = balance_without_phase(
        trials,
        used,
        check=job.check,
        max_weight=None if limits is None else limits.max_weight,
        row_weights=weights,
        remove=[plane for plane in used if job.planes[plane].remove],
    )

    def coefficients(_: Path) -> Written:
        raise ValueError("amplitudes give no influence coefficients: write a table, .csv or .xlsx")

    plain = outcome_of(
        result,
        provenance(job.files, options),
        files={".json": coefficients, "influence.csv": coefficients},
        title="Balancing without phases",
    )
    return BalanceWithoutPhase(**vars(plain), job=job)


def _at_speeds(trials: Trials, weights: Any, options: BalanceOptions) -> tuple[Trials, Any]:  # noqa: ANN401
    """The readings at some speeds, and how much they count."""
    from balancing import match_speeds

    wanted: Sequence[float] | np.ndarray = speeds(options.speeds or "", trials.labels.speed_unit)
    at = match_speeds(np.asarray(wanted), trials.speeds, "readings")
    some = {name: getattr(trials, name) for name in ("readings", "steps", "covariance")}
    some = {name: None if array is None else array[..., at, :] for name, array in some.items()}
    return replace(trials, speeds=trials.speeds[at], **some), None if weights is None else weights[at]
