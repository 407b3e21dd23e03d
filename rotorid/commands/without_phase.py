"""`balance` of runs without phases: options that have no meaning there, and the outcome."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING

from rotorid.base.text import listing
from rotorid.report.options import changed, option_name
from rotorid.report.outcome import Outcome, Written, outcome_of, provenance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rotorid.commands.balance_options import BalanceOptions
    from rotorid.files import Job

_REFUSED = (
    *("method", "influence", "coefficients", "machine_type", "planes", "speeds", "limit", "ridge", "split"),
    *("refine", "weights", "grade", "rotor_mass", "service_speed"),
)
_INSTEAD = {"speeds": " (leave rows out)", "split": " (rotorid split puts a weight into holes)"}


def balanced_without_phase(job: Job, options: BalanceOptions) -> Outcome:
    """Correction weights from amplitudes.

    Raises
    ------
    ValueError
        For options and parts of the job that need phases, all in one message; UndeterminedError.
    """
    from balancing import balance_without_phase

    given = [option_name(name) + _INSTEAD.get(name, "") for name in changed(options) if name in _REFUSED]
    limited = job.limits is not None and job.limits.residual.min() < inf
    of_job = {
        "limits of sensors": limited,
        "zones": job.zones,
        "the check run (add it to the runs, with its weights)": job.check is not None,
    }
    if given := [*given, *(words for words, there in of_job.items() if there)]:
        raise ValueError(f"the runs have no phases: leave {listing(given, 'and')} away")
    planes = job.trials.planes
    remove = [plane for plane in planes if job.planes[plane].remove]
    limits = job.limits_of(planes)
    result = balance_without_phase(
        job.trials, limits=limits, row_weights=job.row_weights, remove=remove, holes=job.holes
    )
    if job.holes:
        note = "the weights stand at any angle: rotorid split puts them into holes"
        decision = replace(result.decision, notes=(*result.decision.notes, note))
        result = replace(result, decision=decision)

    def coefficients(_: Path) -> Written:
        raise ValueError("amplitudes give no influence coefficients: write a table, .csv or .xlsx")

    def picture() -> Figure:
        from balancing.plots import solutions_figure

        return solutions_figure(result)

    return outcome_of(
        result,
        provenance(job.files, options),
        files={".json": coefficients, "influence.csv": coefficients},
        pictures={"": picture},
        title="Balancing without phases",
    )
