"""`balance` of runs without phases: options that have no meaning there, and the outcome."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import inf, pi
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorid.base.text import listing, percent
from rotorid.commands.split import GOOD_ENOUGH
from rotorid.report.options import changed, option_name
from rotorid.report.outcome import Outcome, Written, outcome_of, provenance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from balancing import Holes, WithoutPhase
    from rotorid.commands.balance_options import BalanceOptions
    from rotorid.files import Job

_TAKEN = ("phase", "angles", "errors", "max_mass", "split")


def balanced_without_phase(job: Job, options: BalanceOptions) -> Outcome:
    """Correction weights from amplitudes.

    Raises
    ------
    ValueError
        For options and parts of the job that need phases, all in one message; UndeterminedError.
    """
    from balancing import balance_without_phase

    given = [option_name(name) for name in changed(options) if name not in _TAKEN]
    of_job = {
        "limits of sensors": job.limits is not None and job.limits.residual.min() < inf,
        "zones": job.zones,
        "the check run (add it to the runs, with its weights)": job.check is not None,
        "--split (no plane has holes)": options.split and not job.holes,
    }
    if given := [*given, *(words for words, there in of_job.items() if there)]:
        raise ValueError(f"the runs have no phases: leave {listing(given, 'and')} away")
    planes = job.trials.planes
    remove = [plane for plane in planes if job.planes[plane].remove]
    result = balance_without_phase(
        job.trials, limits=job.limits_of(planes), row_weights=job.row_weights, remove=remove, holes=job.holes
    )
    keys, lines = result.to_dict(), ["In holes: --split."] if job.holes else []
    if options.split:
        keys["mounting"] = _in_holes(result, job.holes) if result.sound else {}
        lines = [
            f"In holes of {plane}: {'; '.join(one['words']) or 'nothing'}; error "
            f"{percent(one['relative_error'])} % of this weight."
            for plane, one in keys["mounting"].items()
        ]

    def coefficients(_: Path) -> Written:
        raise ValueError("amplitudes give no influence coefficients: write a table, .csv or .xlsx")

    def picture() -> Figure:
        from balancing.plots import solutions_figure

        return solutions_figure(result)

    return outcome_of(
        result,
        provenance(job.files, options),
        sentences=(*result.sentence().splitlines(), *lines),
        keys=keys,
        files={".json": coefficients, "influence.csv": coefficients},
        pictures={"": picture},
        title="Balancing without phases",
    )


def _in_holes(result: WithoutPhase, holes: Mapping[str, Holes]) -> dict[str, Any]:
    """The weights in the holes of their planes, as JSON types; material that is taken away at its place."""
    from balancing.one_weight import split

    pieces = {}
    for plane, weight in zip(result.planes, result.weights.tolist(), strict=True):
        if plane in holes:
            away = plane in result.remove
            there = replace(holes[plane], angles=holes[plane].angles - pi * away)
            made = split(-weight if away else weight, there, good_enough=GOOD_ENOUGH)
            pieces[plane] = made.to_dict(result.labels)
    return pieces
