"""Initial vibration to be corrected, and how well it is known: that of the runs, or of new readings."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from balancing.coefficients.identifiability import UndeterminedError
from balancing.coefficients.influence import Influence
from balancing.coefficients.repeatability import NOTICEABLE_AMPLITUDE, describe, differences
from balancing.coefficients.run_errors import (
    marginal,
    run_columns,
    runs_of,
)
from balancing.data.conventions import Labels
from balancing.data.reading_errors import (
    ErrorModel,
    error_model,
    mean_covariance,
    reading_covariance,
    symmetric,
)
from balancing.data.trials import ReadingErrors, Trials
from rotorid.base.arrays import ComplexArray, FloatArray, IndexArray
from rotorid.base.rpm import RPM, rpm_text
from rotorid.regression import stretch

SPEED_TOLERANCE = 0.005
"""Speeds that differ by less, relatively, count as one."""

SAME = 1e-9
"""Readings that differ by less, relatively, are the same ones, written and read again."""


class Start(NamedTuple):
    """What `correct` starts from.

    Y₀ (S, C), the covariance of (Y₀, W) per channel or None, errors of a reading, words for the user, how to
    print, what is mounted: run, planes, weights (None: nothing), what of the errors the channels have in
    common (as `Influence.common`), whether Y₀ is of new runs, which have not yet told of the errors, and what
    errors of a model's parameters do (as `Influence.parameters`).
    """

    readings: ComplexArray
    covariance: FloatArray | None
    model: ErrorModel
    warnings: tuple[str, ...]
    labels: Labels
    mounted: tuple[str, tuple[str, ...], ComplexArray] | None
    common: ComplexArray | None = None
    fresh: bool = False
    parameters: ComplexArray | None = None

    @property
    def own(self) -> FloatArray | None:
        """The covariance without what the channels have in common."""
        if self.covariance is None:
            return None
        return symmetric(self.covariance - marginal(self.common, self.parameters))


def match_speeds(wanted: ArrayLike, known: FloatArray, what: str = "coefficients") -> list[int]:
    """Indices of known speeds (rad/s) equal to the wanted ones within 0.5 %.

    Raises
    ------
    ValueError
        For a speed that is not among the known ones.
    """
    found = []
    for speed in np.atleast_1d(np.asarray(wanted, dtype=np.float64)):
        i = int(np.argmin(np.abs(known - speed)))
        if not abs(known[i] - speed) <= SPEED_TOLERANCE * known[i]:
            rpm = ", ".join(f"{v * RPM:.6g}" for v in known)
            raise ValueError(f"there are no {what} at {rpm_text(speed)}; there are some at {rpm} rpm")
        found.append(i)
    if len(set(found)) < len(found):
        raise ValueError("a speed is given twice")
    return found


def starting_point(influence: Influence, baseline: Trials | ArrayLike | None) -> Start:
    """Vibration to be corrected, from the runs of the coefficients or from a new baseline run.

    Raises
    ------
    ValueError
        Without any baseline; for planes, sensors or speeds that do not fit.
    """
    known = ErrorModel(influence.errors, influence.reading_dof, influence.error_source)
    if baseline is None:
        if influence.baseline is None:
            raise ValueError(
                "these influence coefficients are stored ones without a vibration to correct: "
                "give the readings of a baseline run"
            )
        return _as_measured(influence, influence.baseline)
    if isinstance(baseline, Trials):
        return _from_runs(influence, baseline, known)
    readings = np.array(baseline, dtype=complex)
    if readings.shape != influence.W.shape[:2]:
        raise ValueError(f"the baseline must have shape {influence.W.shape[:2]} (speeds, sensors)")
    if not np.isfinite(readings).all():
        raise ValueError("the readings of the baseline must be finite; found NaN or infinity")
    if _same(influence, readings):
        return _as_measured(influence, readings)._replace(mounted=None)
    if known.errors is None:
        return Start(readings, None, known, (), influence.labels, None)
    variance = reading_covariance(readings, known.errors)
    nothing = np.zeros(len(influence.planes), dtype=complex)
    return _with_coefficients(influence, readings, readings[None], variance, nothing[None], known)


def _as_measured(influence: Influence, readings: ComplexArray) -> Start:
    """The vibration that the coefficients were measured with: their errors belong together."""
    known = ErrorModel(influence.errors, influence.reading_dof, influence.error_source)
    mounted = _last_run(influence)
    start = Start(readings, influence.covariance, known, (), influence.labels, mounted, influence.common)
    return start._replace(parameters=influence.parameters)


def _same(influence: Influence, readings: ComplexArray) -> bool:
    """Whether the readings of a bare rotor are those that the coefficients were measured with."""
    if influence.baseline is None or influence.covariance is None:
        return False
    return bool(np.abs(readings - influence.baseline).max() <= SAME * np.abs(readings).max())


def _from_runs(influence: Influence, trials: Trials, known: ErrorModel) -> Start:
    """Bare-rotor vibration from runs at known coefficients: the mean of Y_run − W T_run."""
    speeds, sensors = places(influence, trials)
    pick = np.ix_(range(len(trials.runs)), speeds, sensors)
    mounted = mounted_weights(influence, trials)  # (R, P)
    mean = mounted.mean(axis=0)
    readings = trials.mean[pick].mean(axis=0) - influence.W @ mean
    own = error_model(trials)
    model = known if own.source == "assumed" and known.errors is not None else own
    notes = trials.warnings + _disagreement(influence, trials, mounted, pick, model)
    if model.errors is None:
        return Start(
            readings,
            None,
            model,
            notes + model.warnings,
            trials.labels,
            _mounted_last(influence, trials, mounted),
        )
    if len(trials.runs) == 1 and trials.errors in (None, influence.errors) and _same(influence, readings):
        start = _as_measured(influence, readings)
        last = _mounted_last(influence, trials, mounted)
        return start._replace(labels=trials.labels, mounted=last, warnings=notes)
    variance = mean_covariance(trials, model)[pick].mean(axis=0) / len(trials.runs)
    start = _with_coefficients(
        influence, readings, trials.mean[pick], variance, mounted, _joined(model, known)
    )
    return start._replace(
        labels=trials.labels,
        mounted=_mounted_last(influence, trials, mounted),
        warnings=notes + start.warnings,
    )


def _mounted_last(
    influence: Influence, trials: Trials, mounted: ComplexArray
) -> tuple[str, tuple[str, ...], ComplexArray] | None:
    return (trials.runs[-1], influence.planes, mounted[-1]) if mounted[-1].any() else None


def _disagreement(
    influence: Influence,
    trials: Trials,
    mounted: ComplexArray,
    pick: tuple[IndexArray, ...],
    model: ErrorModel,
) -> tuple[str, ...]:
    """Runs that imply different vibrations of the bare rotor cannot be averaged without a word.

    Raises
    ------
    UndeterminedError
        Where no weights are known and the runs differ: one of them is a trial run.
    """
    bare = not mounted.any()
    found = differences(trials, model, largest=bare)
    if bare and found:
        named = " and ".join(f"{d.first!r} and {d.second!r} (by {d.words})" for d in found)
        raise UndeterminedError(
            f"runs {named} differ although no weights are given for them: if they are trial runs, "
            "give the weights table or keep only the baseline run"
        )
    implied = trials.mean[pick] - np.einsum("scp,rp->rsc", influence.W, mounted)
    size = np.abs(implied - implied[0]).max() / (np.abs(implied).max() or 1.0)
    if found or size <= NOTICEABLE_AMPLITUDE:
        return describe(found)
    return (
        f"the runs imply vibrations of the bare rotor that differ by {100 * size:.2g} % of the largest one: "
        "check the weights table and the stored coefficients",
    )


def _last_run(influence: Influence) -> tuple[str, tuple[str, ...], ComplexArray] | None:
    run, weights = influence.last_run, influence.last_weights
    return None if run is None or weights is None or not weights.any() else (run, influence.planes, weights)


def places(influence: Influence, trials: Trials) -> tuple[list[int], list[int]]:
    """Where the speeds and sensors of the coefficients stand among the readings."""
    lacking = [s for s in influence.sensors if s not in trials.sensors]
    if lacking:
        raise ValueError(
            f"the baseline run has no readings of sensor {', '.join(map(repr, lacking))}; it has those of "
            f"{', '.join(map(repr, trials.sensors))}"
        )
    speeds = match_speeds(influence.speeds, trials.speeds, "baseline readings")
    return speeds, [trials.sensors.index(s) for s in influence.sensors]


def mounted_weights(influence: Influence, trials: Trials) -> ComplexArray:
    """Weights of the baseline runs in the planes of the coefficients, shape (R, P)."""
    mounted = np.zeros((len(trials.runs), len(influence.planes)), dtype=complex)
    for p, plane in enumerate(trials.planes):
        if plane in influence.planes:
            mounted[:, influence.planes.index(plane)] = trials.weights[:, p]
        elif trials.weights[:, p].any():
            raise ValueError(
                f"a weight is mounted in plane {plane!r}, for which there are no influence coefficients; "
                f"there are some for {', '.join(map(repr, influence.planes))}"
            )
    return mounted


def _with_coefficients(
    influence: Influence,
    readings: ComplexArray,
    runs: ComplexArray,
    variance: FloatArray,
    mounted: ComplexArray,
    model: ErrorModel,
) -> Start:
    """Covariance of (Y₀, W) per channel where Y₀ is the mean of runs (R, S, C) less what was mounted does."""
    S, C, P = influence.W.shape
    covariance = np.zeros((S, C, 2 * P + 2, 2 * P + 2))
    change = np.eye(P + 1, dtype=complex)
    change[0] = [0.0, *-mounted.mean(axis=0)]
    warnings = model.warnings
    if influence.covariance is None:
        warnings += (
            "the errors of the influence coefficients are not known: the errors stated here are those of the "
            "baseline run alone, the real ones are larger",
        )
    else:
        covariance = stretch(change) @ influence.covariance @ stretch(change).T
    columns = run_columns(influence.run_errors, runs_of(runs, mounted, influence.W))
    R = len(runs)
    further = columns.common.reshape(2, -1, S, C) / R
    covariance[..., :2, :2] += variance + (columns.own.sum(axis=0) / R**2)[..., None, None] * np.eye(2)
    common = np.zeros((2, further.shape[1], S, C, P + 1), dtype=complex)
    common[..., 0] = further
    covariance += marginal(common)
    if influence.common is not None:
        common = np.concatenate((influence.common @ change.T, common), axis=1)
    parameters = None if influence.parameters is None else influence.parameters @ change.T
    covariance = symmetric(covariance)
    return Start(readings, covariance, model, warnings, influence.labels, None, common, True, parameters)


def _joined(model: ErrorModel, known: ErrorModel) -> ErrorModel:
    """Fewer degrees of freedom rule where coefficients and baseline have errors of different origin."""
    degrees = [d for d in (model.dof, known.dof if known.errors is not None else None) if d is not None]
    return ErrorModel(model.errors, min(degrees, default=None), model.source, model.warnings)


def describe_errors(errors: ReadingErrors | None, unit: str, scale: float) -> str:
    """Errors of a reading in words: "2 % of the amplitude, 1°"."""
    if errors is None:
        return "unknown"
    parts = []
    if errors.amplitude:
        parts.append(f"{100 * errors.amplitude:.3g} % of the amplitude")
    if errors.phase:
        parts.append(f"{np.degrees(errors.phase):.3g}°")
    if errors.floor:
        parts.append(f"{errors.floor * scale:.3g} {unit}".rstrip())
    elif not errors.phase:
        parts.append("phases exact")
    elif not errors.amplitude:
        parts.append("amplitudes exact")
    return ", ".join(parts)
