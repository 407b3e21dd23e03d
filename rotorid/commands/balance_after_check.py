"""What follows a check run of `balance`: what was mounted in it, and what is left to do."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

from rotorid.commands.balance_options import Solved, correct_job
from rotorid.commands.choice_of_coefficients import choose, of_planes

if TYPE_CHECKING:
    from balancing import CheckComparison, Correction, Influence, LeftToDo, Mounted, Trials, Verdict
    from rotorid.commands.balance_options import BalanceOptions
    from rotorid.files import Job


def as_proposed(job: Job, correction: Correction, influence: Influence, runs: Trials | None) -> Job:
    """The job with what was proposed as the weights of its check runs, which nobody states.

    Where the job has holes these are pieces, which are in them then, and no longer in stock.
    """
    import numpy as np

    from balancing import mount

    check = job.check
    assert check is not None
    pieces = None
    if not job.check_of_weights and {*correction.planes} & {*job.holes}:
        with suppress(ValueError):  # no pieces can be proposed: the weights were
            pieces = mount(correction, influence, runs, job.holes)
    mounted = np.tile((pieces or correction).weights, (len(check.runs), 1))
    check, holes = replace(check, planes=correction.planes, weights=mounted), dict(job.holes)
    placed = () if pieces is None else zip(correction.planes, pieces.discrete.mountings, strict=True)
    for plane, mounting in placed:
        if mounting is not None:
            old = holes[plane]
            stock = None if old.stock is None else old.stock - mounting.counts.sum(axis=0)
            holes[plane] = replace(old, taken=old.taken + mounting.amounts, stock=stock)
    return replace(job, check=check, check_pieces=pieces, holes=holes)


def left_to_do(
    solved: Solved,
    job: Job,
    options: BalanceOptions,
    check: CheckComparison | None,
    verdict: Verdict | None,
    pieces: Mounted | None,
) -> LeftToDo:
    """What is left to do after the check run, by all runs where the coefficients are measured.

    Parameters
    ----------
    solved, job, options
        The check run counts in them where `options.refine`.
    check, verdict
        What it says of the prediction, and limits of it; None: nothing.
    pieces
        Those of a trim.
    """
    from balancing import after_check_run, last_run, mount

    runs, (result, inputs, *_) = job.check, solved
    assert runs is not None
    stop = "; ".join(result.contradictions)
    if not options.refine:
        influence, baseline = inputs
        misplaced = check is not None and check.change is not None
        measured = baseline is None and influence.trials is not None and options.machine_type is None
        try:
            if misplaced:  # what is really there is not known, what it leaves is
                inputs = influence, last_run(runs)
            elif measured:
                inputs = of_planes(job, choose(job, options.coefficients, refined=True))
            else:
                inputs = influence, runs
            result = correct_job(job, inputs, solved.planes, options)
        except ValueError as error:
            stop = stop or f"with the check run counted, {str(error).splitlines()[0]}"
            there = runs.runs[-1], runs.planes, runs.weights[-1]
            result = replace(result, mounted=type(result.mounted)(*there))
    no_pieces = ""
    if pieces is None and job.holes and not stop:
        try:
            pieces = mount(result, *inputs, job.holes, on_top=True)
        except ValueError as error:  # a trim at any angle
            no_pieces = f"; not as pieces: {error}"
    left = after_check_run(
        result,
        runs,
        explained=None if check is None else check.explained,
        judged="" if verdict is None else verdict.overall,
        stop=stop,
        pieces=pieces,
        bare=None if check is None else check.before,
    )
    return replace(left, why=left.why + no_pieces) if left.word == "trim" else left
