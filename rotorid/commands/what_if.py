"""`balance --weights`: what given weights would leave, judged as a check run is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rotorid.commands.balance_solution import coefficients_of
from rotorid.commands.option_quantities import mounted_weights
from rotorid.commands.quantities import speeds
from rotorid.report.options import refuse

if TYPE_CHECKING:
    from balancing import Verdict, WhatIf
    from rotorid.commands.balance_solution import BalanceOptions
    from rotorid.files import Job
    from rotorid.fleet.machine_type import TypeKnowledge

NEEDLESS = (
    *("method", "planes", "ridge", "max_mass", "split"),
    *("grade", "rotor_mass", "service_speed", "template"),
)
"""Options of weights that are still to be computed, and of a tolerance of what they would have to be."""


def predicted(job: Job, options: BalanceOptions) -> tuple[WhatIf, Verdict | None, TypeKnowledge | None]:
    """What the weights of the options would leave, what limits say, and where coefficients are from.

    Raises
    ------
    ValueError
        For weights that cannot be, and options that mean nothing beside them.
    """
    from balancing import match_speeds, verdict_of_readings, what_if

    assert options.weights is not None
    refuse(options, NEEDLESS, "means nothing with --weights, which are taken as they are")
    if job.check is not None and not options.refine:
        raise ValueError(
            "--weights asks what weights on the bare rotor would leave: count the check run for that with "
            "--refine, or leave it out of the job"
        )
    given = mounted_weights(job, options.weights)
    (influence, runs), of_type = coefficients_of(job, options)
    chosen = None if options.speeds is None else speeds(options.speeds, job.trials.labels.speed_unit)
    remove = [name for name, plane in job.planes.items() if plane.remove]
    result = what_if(influence, given, runs, chosen, remove)
    limits = job.limits_of(influence.planes)
    if limits is None:
        return result, None, of_type
    kept = limits.pick(match_speeds(result.speeds, influence.speeds), range(len(result.planes)))
    verdict = verdict_of_readings(result.influence, result.after, result.after_covariance, kept)
    return result, verdict, of_type
