"""`balance --weights`: what given weights would leave, judged as a check run is."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from rotorid.base.answer import together
from rotorid.base.tables import Table
from rotorid.commands.balance_solution import coefficients_of
from rotorid.commands.model_places import next_mode
from rotorid.commands.option_quantities import mounted_weights
from rotorid.commands.quantities import speeds
from rotorid.report.options import refuse
from rotorid.report.outcome import Outcome, outcome_of, provenance

if TYPE_CHECKING:
    from rotorid.commands.balance_solution import BalanceOptions
    from rotorid.files import Job

NEEDLESS = ("method", "planes", "ridge", "max_mass", "split", "grade", "rotor_mass", "service_speed")
"""Options of weights that are still to be computed, and of a tolerance of what these would have to be."""


def predicted(job: Job, options: BalanceOptions) -> Outcome:
    """What the weights of the options would leave, with limits and zones.

    Check runs count for the coefficients where `options.refine`, and else not at all.

    Raises
    ------
    ValueError
        For weights that cannot be, and options that mean nothing beside them.
    """
    from balancing import match_speeds, verdict_of_readings, what_if, zones_of

    refuse(options, NEEDLESS, "means nothing with --weights, which are taken as they are")
    given = mounted_weights(job, options.weights or {})
    (influence, runs), of_type = coefficients_of(job, options)
    chosen = None if options.speeds is None else speeds(options.speeds, job.trials.labels.speed_unit)
    remove = [name for name, plane in job.planes.items() if plane.remove]
    result = what_if(influence, given, runs, chosen, remove)
    result = replace(result, worse=(*result.worse, *next_mode(job, result)))
    verdict, limits = None, job.limits_of(influence.planes)
    if limits is not None:
        kept = limits.pick(match_speeds(result.speeds, influence.speeds), range(len(result.planes)))
        verdict = verdict_of_readings(result.influence, result.after, result.after_covariance, kept)
    zones = zones_of(result, job.zones) if job.zones else None
    beside = {key: part for key, part in (("verdict", verdict), ("zones", zones)) if part}
    return outcome_of(
        result,
        provenance(job.files if of_type is None else of_type.files, options),
        answer=together([result.answer, *(part.answer for part in beside.values())]),
        keys=lambda: result.to_dict() | {key: part.to_dict() for key, part in beside.items()},
        file=Table("weights", result.columns()),
        title="What these weights would leave",
    )
