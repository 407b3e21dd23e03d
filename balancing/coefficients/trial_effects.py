"""Effect of the trial weights on the vibration: large enough, and whether the runs agree with each other."""

from __future__ import annotations

import numpy as np

from balancing.coefficients.identifiability import LEVEL, UndeterminedError, significant
from balancing.coefficients.run_error_estimate import scatter, spare_rows
from balancing.coefficients.run_errors import ASSUMED as USUAL_RUN
from balancing.coefficients.run_errors import Runs, runs_of
from balancing.data.reading_errors import ASSUMED as USUAL_READING
from balancing.data.reading_errors import ErrorModel, mean_covariance, mean_variance
from balancing.data.trials import Trials
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.regression import solution, stretch

ENGINEERS_AMPLITUDE, ENGINEERS_PHASE = 0.30, np.deg2rad(30)
"""A good trial weight changes a reading by 30 % of its amplitude or by 30°."""

CLEAR = 5.0
"""Effect of a good trial weight in units of its errors."""

_UNCHANGED = 1e-9
_MEND = "mend the table, or measure these runs again until they agree"


def check_effects(
    trials: Trials, W: ComplexArray, covariance: FloatArray | None, *, contradicted: bool = False
) -> None:
    """Refuse a trial weight that changed nothing.

    Parameters
    ----------
    trials
        The runs.
    W
        Coefficients (S, C, P).
    covariance
        Of (Y₀, W₁, …) of each channel, shape (S, C, 2P + 2, 2P + 2), or None.
    contradicted
        Whether runs that should agree do not: no larger trial weight helps then.

    Raises
    ------
    UndeterminedError
        Naming plane and run, where every reading is unchanged (1e-9), or where the changes lie within the
        errors: at 95 % over all sensors and speeds, and at 99 % for each of them (with as many chances as
        there are readings). Estimated errors count like stated ones here: a few repeats must not refuse a job
        that would pass without them.
    """
    size = np.abs(trials.mean).max(axis=0)
    for p, plane in enumerate(trials.planes):
        run = int(np.argmax(np.abs(trials.weights[:, p])))
        words = f"the trial weight in plane {plane!r} (run {trials.runs[run]!r})"
        change = np.abs(W[..., p] * trials.weights[run, p])
        if (change <= _UNCHANGED * size).all():
            raise UndeterminedError(
                f"{words} changed no reading: its effect is not determined; "
                "check that it was mounted and that the run was measured anew"
            )
        own = slice(2 + 2 * p, 4 + 2 * p)
        if covariance is not None and not _significant(W[..., p], covariance[..., own, own]):
            size = np.abs(trials.weights[run, p]) * CLEAR / clearness(W[..., p], covariance[..., own, own])
            larger = f"{float(f'{size * trials.labels.weight_scale:.2g}'):g} {trials.labels.weight_in}"
            remedy = f"repeat the run with a larger trial weight, at least {larger}".rstrip()
            raise UndeterminedError(
                f"{words} changed the readings by no more than their errors explain: its effect is not "
                f"determined; {_MEND if contradicted else remedy}"
            )


def clearness(w: ComplexArray, covariance: FloatArray) -> float:
    """Effect of a plane, root mean square over the readings, in units of its errors, (…, 2, 2)."""
    error = float(np.trace(covariance, axis1=-2, axis2=-1).sum())
    return float(np.sqrt(np.sum(np.abs(w) ** 2) / error)) if error > 0 else np.inf


def _significant(w: ComplexArray, covariance: FloatArray) -> bool:
    block = covariance.reshape(-1, 2, 2)
    v = stretch(w.ravel()).reshape(-1, 2)
    trace = np.trace(block, axis1=1, axis2=2)
    known = trace > 0
    if not known.any():
        return True
    # errors in one direction only make a block singular
    block = block[known] + 1e-9 * trace[known, None, None] * np.eye(2)
    each = np.einsum("ni,nij,nj->n", v[known], np.linalg.inv(block), v[known])
    return significant(each, 2 * len(each))


def weak_trials(trials: Trials, W: ComplexArray) -> tuple[str, ...]:
    """Warn of planes whose trial weights changed no reading by 30 % or by 30°, the engineers' rule."""
    warnings = []
    for p, plane in enumerate(trials.planes):
        runs = np.flatnonzero(trials.weights[:, p])
        amplitude, phase = 0.0, 0.0
        for r in runs:
            change = W[..., p] * trials.weights[r, p]
            reading = trials.mean[r]
            before = reading - change
            seen = np.abs(before) > _UNCHANGED * np.abs(change)
            if not seen.all():
                amplitude = np.inf  # from rest to something
            ratio = reading[seen] / before[seen]
            amplitude = max(amplitude, float(np.max(np.abs(np.abs(ratio) - 1), initial=0.0)))
            phase = max(phase, float(np.max(np.abs(np.angle(ratio)), initial=0.0)))
        if amplitude < ENGINEERS_AMPLITUDE and phase < ENGINEERS_PHASE:
            warnings.append(
                f"the trial weight in plane {plane!r} changed no reading by 30 % or 30° "
                f"(at most {100 * amplitude:.2g} % and {np.degrees(phase):.2g}°): a larger one would make "
                "the corrections more certain"
            )
    return tuple(warnings)


def nonlinear(trials: Trials, W: ComplexArray) -> str:
    """Say that runs differ from a linear machine by more than usual errors explain (95 %); else empty."""
    A = np.column_stack((np.ones(len(trials.runs)), trials.weights)).astype(complex)
    usual = mean_covariance(trials, ErrorModel(USUAL_READING))
    spare = spare_rows(A, trials.mean, mean_variance(usual))
    if not spare.dof:
        return ""
    floor = USUAL_RUN * float(np.sqrt(np.mean(np.abs(trials.mean) ** 2)))
    ratio, chance = scatter([spare], runs_of(trials.mean, trials.weights, W), USUAL_RUN, floor)
    return "" if chance > 1 - LEVEL else f"they differ from it by {ratio:.2g} times what usual errors explain"


def check_consistency(trials: Trials, A: ComplexArray, reading: FloatArray, runs: Runs) -> tuple[str, ...]:
    """Warn where runs disagree with each other by more than the stated errors explain (95 %).

    Parameters
    ----------
    trials
        The runs, more than baseline and planes need.
    A
        (1 T), shape (R, P + 1).
    reading
        Covariance of the mean readings by their errors, shape (R, S, C, 2, 2).
    runs
        The same with what their weights do.
    """
    spare = spare_rows(A, trials.mean, mean_variance(reading))
    stated = trials.run_errors or (0.0, 0.0)
    ratio, chance = scatter([spare], runs, *stated)
    if chance > 1 - LEVEL:
        return ()
    readings = trials.mean.reshape(len(A), -1)
    residual = np.abs(readings - A @ solution(A, readings)) ** 2
    worst = np.sum(residual / np.mean(np.abs(trials.mean) ** 2, axis=0).ravel(), axis=1)
    return (
        f"the runs disagree by {ratio:.2g} times the stated errors, most of all in run "
        f"{trials.runs[int(np.argmax(worst))]!r}: the rotor does not repeat itself or is not linear, "
        "or the errors are larger than stated",
    )
