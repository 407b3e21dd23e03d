"""`balance` of runs without phases: options that have no meaning there, and the outcome."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rotorid.base.text import listing
from rotorid.report.outcome import Outcome, Written, outcome_of, provenance

if TYPE_CHECKING:
    from rotorid.commands.balance_solution import BalanceOptions
    from rotorid.files import Job

_REFUSED = {
    "method": "--method",
    "influence": "--influence",
    "coefficients": "--coefficients",
    "machine_type": "--type",
    "planes": "--planes",
    "speeds": "--speeds (leave rows out)",
    "limit": "--limit",
    "ridge": "--ridge",
    "split": "--split (rotorid split puts a weight into holes)",
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
    from balancing import balance_without_phase, plots

    if given := [flag for name, flag in _REFUSED.items() if getattr(options, name) not in (None, False, ())]:
        raise ValueError(f"the runs have no phases: leave {listing(given, 'and')} away")
    planes = job.trials.planes
    limits = job.limits_of(planes)
    result = balance_without_phase(
        job.trials,
        check=job.check,
        max_weight=None if limits is None else limits.max_weight,
        row_weights=job.row_weights,
        remove=[plane for plane in planes if job.planes[plane].remove],
    )

    def coefficients(_: Path) -> Written:
        raise ValueError("amplitudes give no influence coefficients: write a table, .csv or .xlsx")

    made = provenance(job.files, options)
    files = {".json": coefficients, "influence.csv": coefficients}
    pictures = {"": lambda: plots.solutions_figure(result)}
    plain = outcome_of(result, made, files=files, pictures=pictures, title="Balancing without phases")
    return BalanceWithoutPhase(**vars(plain), job=job)
