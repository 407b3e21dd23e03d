"""What the runs of a job say about its conventions, and what it would be under other ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from rotorid.base.text import listing

if TYPE_CHECKING:
    from balancing import Correction
    from balancing.coefficients.convention_test import ConventionTest
    from rotorid.tables import Job


def with_contradiction(job: Job) -> Job:
    """The job with the warning, before all others, where its runs contradict its conventions."""
    from balancing.correction.convention_assumptions import contradiction

    words = contradiction(_ask(job), job.trials.labels)
    return replace(job, trials=replace(job.trials, warnings=words + job.trials.warnings))


def with_other_readings(
    result: Correction,
    job: Job,
    again: Callable[[str, str], Correction] | None,
    *,
    refined: bool = False,
) -> Correction:
    """The correction with what the runs say about its conventions, and what other ones give.

    Parameters
    ----------
    result
        As the job is read.
    job
        Its runs are asked.
    again
        Solves the same job with this phase and these angles; None where that cannot be done.
    refined
        Whether the check runs took part: what was mounted in them as proposed, before it was refined, was
        proposed by these conventions and by no others.
    """
    from balancing.correction.convention_assumptions import OtherReading, contradiction

    if refined and not job.check_mounted:
        again, test = None, _ask(job)
    else:
        test = _ask(job, result)
    labels = result.labels
    first = contradiction(test, labels)
    warnings = first + tuple(w for w in result.warnings if w not in first)
    turned: list[tuple[str, ...]] = [(name,) for name in labels.assumed if test.verdict != "confirmed"]
    turned += [labels.assumed] if len(labels.assumed) == 2 else []
    found: list[tuple[list[str], Correction]] = []
    for names in turned:
        if again is None:
            break
        other = labels.otherwise(names)
        try:
            solved = again(other.phase, other.angles)
        except ValueError:  # no answer, as where limits cannot be met
            continue
        words = " and ".join(getattr(other, name).removesuffix(" rotation") for name in names)
        same = next((said for said, known in found if _alike(known, solved)), None)
        if same is not None:
            same.append(words)
        elif not _alike(result, solved):
            found.append(([words], solved))
    others = (OtherReading(listing(said), c.labels, c.weights, c.to_add) for said, c in found)
    return replace(result, warnings=warnings, convention_test=test, others=tuple(others))


def _ask(job: Job, mounted: Correction | None = None) -> ConventionTest:
    """What trial runs, and check runs of which is known what was mounted, say about conventions."""
    from balancing.coefficients.convention_test import convention_test
    from balancing.correction.refine_coefficients import together

    if job.check is None or not (mounted or job.check_mounted):
        return convention_test(job.trials)
    return convention_test(
        together(job.trials, job.check, corrections=None if job.check_mounted else mounted)
    )


def _alike(a: Correction, b: Correction) -> bool:
    """Whether both say the same numbers, as they are printed."""
    import numpy as np

    one, two = (
        m * np.exp(1j * np.radians(angle)) for m, angle in (c.labels.weight(c.weights) for c in (a, b))
    )
    return bool(np.abs(one - two).max() <= 1e-6 * np.abs(one).max())
