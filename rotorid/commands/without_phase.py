"""`balance` of runs without phases: options that have no meaning there, and the outcome."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rotorid.base.text import listing
from rotorid.report.outcome import Outcome, Written, outcome_of, provenance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from balancing import WithoutPhase
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
    "weights": "--weights",
    "grade": "--grade",
    "rotor_mass": "--rotor-mass",
    "service_speed": "--service-speed",
}


def balanced_without_phase(job: Job, options: BalanceOptions) -> Outcome:
    """Correction weights from amplitudes.

    Raises
    ------
    ValueError
        For options that need phases, all in one message; UndeterminedError.
    """
    from balancing import balance_without_phase

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
    pictures = {"": lambda: _picture(result)}
    return outcome_of(result, made, files=files, pictures=pictures, title="Balancing without phases")


def _picture(result: WithoutPhase) -> Figure:
    """Polar picture of the solutions with their regions and the weights of the runs."""
    from balancing.plots import solutions_figure

    return solutions_figure(result)
