"""Check runs: their readings beside the prediction, and coefficients that they refine.

A reading in a check run with the weights T mounted is predicted as Y₀ + W T. It differs from that by the
errors of the prediction, dY₀ + dW T, by its own, and by what its run has of its own; all are one noise of the
same kinds as that of the coefficients (`balancing.influence`). With V its covariance at typical sizes χ² = dᵀ
V⁻¹ d is compared with the χ² of differences drawn from it, sizes included: the probability needs no
distribution.

Existing unbalance, wherever it sits, is in Y₀ and explains no difference in a linear rotor. A difference that
errors do not explain means that something else was mounted, changed, or is not linear. What other weights
explain is looked for, d = W δ: in one plane, by whichever leaves least, then in all together.

As runs of the same rotor check runs refine the coefficients: Y_run = Y₀ + W T_run holds for them, too. What
to add to the weights of the last check run (trim) is the correction by the refined coefficients less what is
mounted; the correction itself stays the total for the bare rotor, so that limits of the total hold.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from balancing.conditioning import UndeterminedError
from balancing.conventions import Labels
from balancing.errors import reading_of
from balancing.influence import Influence, Whitening, estimate_influence, match_speeds
from balancing.regions import LEVEL, real_parts
from balancing.tables import (
    ROUNDING,
    largest_readings,
    reading_columns,
    rms,
    small,
    three_figures,
    vector_columns,
    weight_rows,
)
from balancing.trials import Trials
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import AnyArray, ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.rpm import rpm_text
from rotorid.base.text import figures, sentence
from rotorid.regression import solution, stretch, unstretch

if TYPE_CHECKING:
    import pandas as pd

    from balancing.correction import Correction

DRAWS = 400
MOVED_AMPLITUDE, MOVED_ANGLE = 0.5, np.deg2rad(45)
"""Relative change of the size of a coefficient, and of its phase, above which it is named."""
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class CheckComparison(Answered):
    """Readings of R check runs beside their prediction.

    Attributes
    ----------
    runs, sensors, planes
        Names, lengths R, C and P.
    speeds
        rad/s, shape (S,), those of the check runs.
    weights
        What was mounted, for the bare rotor, shape (R, P).
    as_proposed
        Whether these are the proposed corrections (the check runs do not say what was mounted).
    before, predicted, achieved
        Vibration of the bare rotor (S, C), and with `weights` mounted: predicted and read (mean of the
        repeats), shape (R, S, C).
    covariance
        Of achieved − predicted, real and imaginary part, (R, S, C, 2, 2); NaN where errors are unknown.
    distance
        Of each difference from zero in its standard deviations (a radius in two dimensions: 95 % of all lie
        below 2.45 where errors are stated), (R, S, C); NaN where errors are unknown.
    chi_square, n
        Of all differences, and its degrees of freedom; chi_square None where errors are unknown.
    probability
        That errors alone make a larger χ²; None where they are unknown.
    explained
        Whether the errors explain the differences at 95 %; None where they are unknown.
    change
        Weights (P,) in the correction planes that would cause the differences, within the errors, in
        addition to `weights`; None where the differences are explained, or no such weights explain them.
    labels
        Units and conventions to print in.
    warnings
        What the user should know.
    """

    runs: tuple[str, ...]
    sensors: tuple[str, ...]
    planes: tuple[str, ...]
    speeds: FloatArray
    weights: ComplexArray
    as_proposed: bool
    before: ComplexArray
    predicted: ComplexArray
    achieved: ComplexArray
    covariance: FloatArray
    distance: FloatArray
    chi_square: float | None
    n: int
    probability: float | None
    explained: bool | None
    change: ComplexArray | None
    labels: Labels
    warnings: tuple[str, ...]

    @property
    def difference(self) -> ComplexArray:
        """Achieved − predicted, shape (R, S, C)."""
        return np.asarray(self.achieved - self.predicted)

    @property
    def improvement_predicted(self) -> float | None:
        """Rms before by rms predicted; None where nothing should be left."""
        return _factor(self.before, self.predicted)

    @property
    def improvement_achieved(self) -> float | None:
        """Rms before by rms achieved; None where nothing was left."""
        return _factor(self.before, self.achieved)

    @property
    def worst(self) -> tuple[int, int, int]:
        """Run, speed and sensor of the reading that differs most: in its errors, or in size without them."""
        size = np.abs(self.difference) if self.explained is None else self.distance
        r, s, c = np.unravel_index(int(np.argmax(size)), size.shape)
        return int(r), int(s), int(c)

    @property
    def verdict(self) -> str:
        """One or two sentences: whether the errors explain the differences, and what else may."""
        r, s, k = self.worst
        where = f"sensor {self.sensors[k]!r} at {self.labels.speed_words(self.speeds[s])}"
        if len(self.runs) > 1:
            where += f" in run {self.runs[r]!r}"
        if self.explained is None or self.probability is None:
            size = self.labels.vibration(self.difference)[0][r, s, k]
            return (
                "no verdict: the errors of the readings are not known (state them, or repeat readings); "
                f"{where} differs most, by {figures(size, 3)} {self.labels.vibration_in}".rstrip()
            )
        share = 100 * self.probability
        chance = f"probability {f'{share:.0f}' if share > 1 else 'below 1'} %"
        if self.explained:
            return f"the differences are explained by the errors ({chance})"
        likely = self._as_if() or (
            "a change of unbalance outside the planes, or a nonlinearity (bearing, looseness), or changed "
            "conditions is likely"
        )
        return (
            f"the differences are not explained by the errors ({chance}): {likely}; {where} differs most, by "
            f"{figures(self.distance[r, s, k], 2)} standard deviations"
        )

    def _as_if(self) -> str:
        """What other weights would cause the differences; empty: none in the planes."""
        if self.change is None:
            return ""
        planes = np.flatnonzero(np.abs(self.change) > 0.1 * np.abs(self.change).max())
        there = self.weights[-1] + self.change
        parts = [
            f"plane {self.planes[p]!r} had {self.labels.weight_at(there[p])} mounted instead of "
            f"{self.labels.weight_at(self.weights[-1, p]) if self.weights[-1, p] else 'nothing'}"
            for p in planes
        ]
        return (
            f"it is as if {' and '.join(parts)}: check what was mounted, and where; an unbalance outside the "
            "planes or a nonlinearity is less likely"
        )

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's own units and conventions; what is unknown is None."""
        labels, readings = self.labels, self._columns()
        sizes = {column.name: list(column.values) for column in readings}
        mounted = [
            {"run": run, "weights": weight_rows(labels, self.planes, weights)}
            for run, weights in zip(self.runs, self.weights, strict=True)
        ]
        return plain(
            {
                "as_proposed": self.as_proposed,
                "mounted": mounted,
                "readings": rows(readings),
                "chi_square": self.chi_square,
                "degrees_of_freedom": self.n,
                "error_degrees_of_freedom": None,
                "probability": self.probability,
                "explained": self.explained,
                "verdict": self.verdict,
                "further_weights": None
                if self.change is None
                else weight_rows(labels, self.planes, self.change),
                "rms_before": rms(sizes["before"]),
                "rms_predicted": rms(sizes["predicted"]),
                "rms_achieved": rms(sizes["achieved"]),
                "improvement_predicted": self.improvement_predicted,
                "improvement_achieved": self.improvement_achieved,
                "warnings": self.warnings,
            }
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per run, speed and sensor: before, predicted, achieved, difference, distance."""
        return frame([column for column in self._columns() if column.name != "covariance"])

    @property
    def headline(self) -> str:
        """Whether the rotor does what was predicted, and what is left, in a sentence."""
        scale, unit = self.labels.vibration_scale, self.labels.vibration_in
        before, predicted, achieved = (rms(z) * scale for z in (self.before, self.predicted, self.achieved))
        heads = {True: "As predicted", False: "Not as predicted", None: "Not judged"}
        left = f"rms {three_figures(before)} → {three_figures(achieved)} {unit}".rstrip()
        return f"{heads[self.explained]}: with the weights {left} ({small(predicted, before)} predicted)."

    @property
    def answer(self) -> Answer:
        """Whether the rotor does what was predicted, what is left, and all readings beside the prediction."""
        labels = self.labels
        largest = largest_readings(labels, self.speeds, self.sensors, self.before, self.achieved[-1])
        mounted = "the proposed corrections" if self.as_proposed else "what its weights table says"
        return Answer(
            f"{self.headline} {sentence(self.verdict)}",
            f"Largest in run {self.runs[-1]!r}{largest}",
            self.warnings,
            tables=(f"Check run, mounted: {mounted}.\n{self._readings_text()}",),
            more="the check run",
        )

    def _columns(self) -> tuple[Column, ...]:
        """One row per run, speed and sensor."""
        R, S, C = self.achieved.shape
        labels = self.labels
        before = np.broadcast_to(self.before, (R, S, C))
        rounding = ROUNDING * float(np.abs(self.before).max()) * labels.vibration_scale
        blocks: Sequence[Any] | FloatArray = [None] * (R * S * C)
        if self.explained is not None:
            blocks = labels.vibration_covariance(self.covariance).reshape(-1, 2, 2)
        return (
            Column("run", np.repeat(self.runs, S * C)),
            *(
                replace(column, values=list(column.values) * R)
                for column in reading_columns(labels, self.speeds, self.sensors)
            ),
            *vector_columns(labels, "before", before, rounding),
            *vector_columns(labels, "predicted", self.predicted, rounding),
            *vector_columns(labels, "achieved", self.achieved, rounding),
            *vector_columns(labels, "difference", self.difference, rounding),
            Column("covariance", blocks),
            Column(
                "distance",
                self.distance.ravel(),
                lambda distance: figures(distance, 2),
                "std",
            ),
        )

    def _readings_text(self) -> str:
        shown = {column.name: column for column in self._columns()}
        if len(self.runs) > 1:
            named = zip(shown["sensor"].values, shown["run"].values, strict=True)
            shown["sensor"] = Column("sensor", [f"{sensor} ({run})" for sensor, run in named], str)
        for name in ("before", "before_phase_deg", "difference_phase_deg"):
            del shown[name]
        foot = ""
        if self.explained is None:
            del shown["distance"]
        else:
            foot = "\nstd: the difference in its standard deviations"
        unit = f" in {self.labels.vibration_in}" if self.labels.vibration_in else ""
        return f"Vibration{unit}, predicted and achieved\n{text(list(shown.values()), left=2)}{foot}"


def _factor(before: ComplexArray, after: ComplexArray) -> float | None:
    """Ratio of root mean squares; None where nothing but rounding is left."""
    old, new = rms(before), rms(after)
    return None if new <= 1e-12 * old else old / new


def compare_check(
    correction: Correction,
    check: Trials,
    influence: Influence,
    baseline: Trials | ArrayLike | None = None,
) -> CheckComparison:
    """Compare check runs with what the influence coefficients predict for them.

    Parameters
    ----------
    correction
        The proposed weights. They count as mounted, and nothing else, if the check runs have no planes.
    check
        Readings, of some or all sensors and speeds of the coefficients; its weights, if it has planes, are
        all that was mounted in each run.
    influence, baseline
        As they were given to `balancing.correct`.

    Returns
    -------
    CheckComparison
        Without a verdict where the errors of the readings are unknown.

    Raises
    ------
    ValueError
        For sensors, speeds or planes without coefficients, and a baseline that does not fit.
    """
    today = influence if baseline is None else influence.rebased(baseline)
    at = match_speeds(check.speeds, today.speeds)
    sensors = [_index(name, today.sensors, "sensor") for name in check.sensors]
    part = today.part(at, sensors)
    T = np.zeros((len(check.runs), len(part.planes)), dtype=complex)
    for plane, weights in mounted_in(check, correction).items():
        if plane in part.planes or weights.any():
            T[:, _index(plane, part.planes, "plane")] = weights
    predicted = part.baseline + np.einsum("scp,rp->rsc", part.W, T)
    difference = check.mean - predicted
    R, S, C = difference.shape
    reading = reading_of(check)
    warnings = check.warnings + (reading.warnings if reading.source != "assumed" else ())
    covariance, distance = np.full((R, S, C, 2, 2), np.nan), np.full((R, S, C), np.nan)
    chi_square = probability = explained = change = None
    if part.known_errors:
        local = replace(check, planes=part.planes, weights=T, speeds=part.speeds)
        noise = part.difference_noise(local, predicted)
        V = noise.covariance(part.errors.sizes)
        covariance = np.einsum("scrarb->rscab", V.reshape(S, C, R, 2, R, 2))
        d = real_parts(difference[..., None])
        distance = np.sqrt(np.einsum("rsci,rsci->rsc", d, np.linalg.solve(covariance, d[..., None])[..., 0]))
        white = Whitening(noise, part.errors.sizes)
        chi_square = white.chi_square(np.moveaxis(difference, 0, -1))
        drawn = [white.chi_square(each) for block in part.noise_draws(noise, DRAWS) for each in block]
        probability = (1 + np.count_nonzero(np.array(drawn) >= chi_square)) / (1 + len(drawn))
        explained = bool(probability >= 1 - LEVEL)
        if not explained:
            change = _change(part.W, np.moveaxis(difference, 0, -1), white, np.quantile(drawn, LEVEL))
    return CheckComparison(
        runs=check.runs,
        sensors=check.sensors,
        planes=part.planes,
        speeds=part.speeds,
        weights=T,
        as_proposed=not check.planes,
        before=part.baseline,
        predicted=predicted,
        achieved=check.mean,
        covariance=covariance,
        distance=distance,
        chi_square=chi_square,
        n=2 * difference.size,
        probability=probability,
        explained=explained,
        change=change,
        labels=today.labels,
        warnings=warnings,
    )


def _change(W: ComplexArray, difference: ComplexArray, white: Whitening, limit: float) -> ComplexArray | None:
    """Weights δ (P,), the same in all runs, that leave no more than errors do; None if none do.

    Generalised least squares, δ of one plane first, then of all: `limit` is what errors leave with 95 %.
    """
    S, C, P = W.shape
    R = difference.shape[-1]
    target = white.white(real_parts(difference)[..., None])[:, 0]
    rows_ = stretch(W.reshape(S * C, 1, P)).reshape(S, C, 1, 2, 2 * P)
    A = white.white(np.repeat(rows_, R, axis=2).reshape(S, C, 2 * R, 2 * P))
    best: tuple[float, ComplexArray] | None = None
    for planes in ([[p] for p in range(P)], [list(range(P))]):
        for chosen in planes:
            real = [2 * p + part for p in chosen for part in (0, 1)]
            if len(target) <= len(real):
                continue
            delta = solution(A[:, real], target, rcond=1e-10)
            left = float(np.sum((target - A[:, real] @ delta) ** 2))
            # errors leave less where weights take part of them
            if left <= limit * (1 - len(real) / len(target)) and (best is None or left < best[0]):
                found = np.zeros(P, dtype=complex)
                found[chosen] = unstretch(delta)
                best = left, found
        if best is not None:
            return best[1]
    return None


def _index(name: str, names: tuple[str, ...], what: str) -> int:
    if name not in names:
        raise ValueError(
            f"there are no coefficients of {what} {name!r}, which the check run has; there are some of "
            f"{', '.join(map(repr, names))}"
        )
    return names.index(name)


def refine(
    trials: Trials, *checks: Trials, corrections: Correction | Mapping[str, complex] | None = None
) -> Influence:
    """Influence coefficients from trial runs and check runs together.

    Parameters
    ----------
    trials
        Trial runs, as for `estimate_influence`.
    checks
        Check runs in their order, of all sensors and speeds of the trial runs (speeds within 0.5 % count as
        one). Weights of their planes are all that was mounted in them.
    corrections
        What was mounted in check runs that have no planes: a correction, or weights by plane.

    Returns
    -------
    Influence
        Its last run is the last check run, so that `Correction.to_add` is what to add to it. A warning names
        the coefficient that moved most, where it moved by more than 50 % or 45°.

    Raises
    ------
    UndeterminedError
        Where all runs together do not determine the coefficients.
    ValueError
        Without check runs; for sensors and speeds that only some of the runs have, and where nobody says
        what was mounted.
    """
    if not checks:
        raise ValueError("there is no check run: give one or more beside the trial runs")
    joint = with_check_runs(trials, *checks, corrections=corrections)
    if joint.mean[0].size < trials.mean[0].size:
        lacking = [name for name in trials.sensors if name not in joint.sensors]
        words = f"sensor {lacking[0]!r}" if lacking else "every speed of the trial runs"
        raise ValueError(
            f"the check runs have no readings of {words}: read all of them, or leave it out of the trial runs"
        )
    refined = estimate_influence(joint)
    try:
        alone = estimate_influence(trials)
    except UndeterminedError:
        return refined
    remarks = refined.remarks
    return replace(refined, remarks=remarks._replace(warnings=remarks.warnings + _moved(alone, refined)))


def mounted_in(
    check: Trials, corrections: Correction | Mapping[str, complex] | None = None
) -> dict[str, ComplexArray]:
    """Weights of each run of a check by plane, shape (R,).

    Parameters
    ----------
    check
        R runs; their weights count where they have any.
    corrections
        What is taken to be mounted else.

    Raises
    ------
    ValueError
        Where nobody says what was mounted.
    """
    R = len(check.runs)
    if check.planes:
        return {plane: check.weights[:, p] for p, plane in enumerate(check.planes)}
    if corrections is None:
        raise ValueError(
            f"what was mounted in the check run {check.runs[0]!r} is not known: give its weights table, or "
            "the corrections that were mounted"
        )
    if isinstance(corrections, Mapping):
        return {plane: np.full(R, weight, dtype=complex) for plane, weight in corrections.items()}
    pairs = zip(corrections.planes, corrections.weights.tolist(), strict=True)
    return {plane: np.full(R, weight, dtype=complex) for plane, weight in pairs}


def _runs_and_weights(
    trials: Trials, checks: Sequence[Trials], corrections: Correction | Mapping[str, complex] | None
) -> tuple[tuple[str, ...], tuple[str, ...], ComplexArray]:
    """Names of all runs (R), of the planes with a weight in any (P), and the weights (R, P)."""
    mounted = [mounted_in(check, corrections) for check in checks]
    later = [plane for weights in mounted for plane, values in weights.items() if values.any()]
    planes = tuple(dict.fromkeys((*trials.planes, *later)))
    names = list(trials.runs)
    for check in checks:
        for name in check.runs:
            names.append(_different(name, names))
    weights = np.zeros((len(names), len(planes)), dtype=complex)
    weights[: len(trials.runs), : len(trials.planes)] = trials.weights
    first = len(trials.runs)
    for check, each in zip(checks, mounted, strict=True):
        last = first + len(check.runs)
        for p, plane in enumerate(planes):
            weights[first:last, p] = each.get(plane, 0.0)
        first = last
    return tuple(names), planes, weights


def _different(name: str, names: Sequence[str]) -> str:
    """The name, marked where there is such a run already."""
    new, k = name, 1
    while new in names:
        new = f"{name} (check)" if k == 1 else f"{name} (check {k})"
        k += 1
    return new


def with_check_runs(
    trials: Trials, *checks: Trials, corrections: Correction | Mapping[str, complex] | None = None
) -> Trials:
    """Trial runs and check runs as one table, of the speeds and sensors that all have.

    Parameters
    ----------
    trials, checks, corrections
        As of `refine`.
    """
    rows_ = [match_speeds(check.speeds, trials.speeds, "trial runs") for check in checks]
    for name in (name for check in checks for name in check.sensors):
        if name not in trials.sensors:
            raise ValueError(
                f"the check run has readings of sensor {name!r}, which the trial runs do not have; they have "
                f"those of {', '.join(map(repr, trials.sensors))}"
            )
    common = [s for s in range(len(trials.speeds)) if all(s in speeds for speeds in rows_)]
    sensors = [name for name in trials.sensors if all(name in check.sensors for check in checks)]
    if not (common and sensors):
        raise ValueError(
            "the check runs have no sensor and speed in common: give those together that were read alike"
        )
    names, planes, weights = _runs_and_weights(trials, checks, corrections)
    tables = (trials, *checks)
    picks = [
        ([speeds.index(s) for s in common], [each.sensors.index(name) for name in sensors])
        for each, speeds in zip(tables, [list(range(len(trials.speeds))), *rows_], strict=True)
    ]

    def of_all(arrays: Iterable[AnyArray]) -> AnyArray:
        return _side_by_side([a[..., at, :][..., of] for a, (at, of) in zip(arrays, picks, strict=True)])

    rounded = any(each.steps is not None for each in tables)
    measured = any(each.covariance is not None for each in tables)
    return replace(
        trials,
        runs=names,
        speeds=trials.speeds[common],
        sensors=tuple(sensors),
        planes=planes,
        readings=of_all(each.readings for each in tables),
        weights=weights,
        errors=next((each.errors for each in tables if each.errors is not None), None),
        run_errors=next((each.run_errors for each in tables if each.run_errors is not None), None),
        warnings=tuple(dict.fromkeys(word for each in tables for word in each.warnings)),
        steps=of_all(map(_steps, tables)) if rounded else None,
        covariance=of_all(_covariances(tables)) if measured else None,
    )


def _steps(trials: Trials) -> FloatArray:
    """Of readings that are not rounded: zero."""
    return np.zeros((2, *trials.readings.shape)) if trials.steps is None else trials.steps


def _covariances(tables: Sequence[Trials]) -> list[FloatArray]:
    """As measured; of a table without them zero where errors are stated, else the mean of the others."""
    known = [np.nanmean(each.covariance[[0, 1], [0, 1]]) for each in tables if each.covariance is not None]
    variance = 0.0 if any(each.errors is not None for each in tables) else np.mean(known)
    usual = variance * np.eye(2)[..., None, None, None, None]
    return [
        np.tile(usual, each.readings.shape) if each.covariance is None else each.covariance for each in tables
    ]


def _side_by_side(blocks: Sequence[AnyArray]) -> AnyArray:
    """Runs of several tables, arrays (…, K, R, S, C), as those of one: NaN where one has fewer repeats."""
    most = max(block.shape[-4] for block in blocks)
    padded = []
    for block in blocks:
        gap = np.full((*block.shape[:-4], most - block.shape[-4], *block.shape[-3:]), np.nan, block.dtype)
        padded.append(np.concatenate((block, gap), axis=-4))
    return np.concatenate(padded, axis=-3)


def _moved(alone: Influence, refined: Influence) -> tuple[str, ...]:
    """Name the coefficient that moved most, if it moved by more than 50 % or 45°."""
    planes = [refined.planes.index(plane) for plane in alone.planes]
    old, new = alone.W, refined.W[..., planes]
    rounding = _ROUNDING * np.abs(old).max()
    far = np.abs(new - old) / np.maximum(np.abs(old), rounding)
    turned = np.abs(np.angle(new * np.conj(old))) > MOVED_ANGLE
    moved = np.where((np.abs(np.abs(new / old) - 1) > MOVED_AMPLITUDE) | turned, far, 0.0)
    if not moved.any():
        return ()
    s, c, p = np.unravel_index(int(np.argmax(moved)), moved.shape)
    ratio = new[s, c, p] / old[s, c, p]
    more = f" (and {np.count_nonzero(moved) - 1} more)" if np.count_nonzero(moved) > 1 else ""
    return (
        f"the check runs move the coefficient of plane {alone.planes[p]!r} on sensor {alone.sensors[c]!r} at "
        f"{rpm_text(alone.speeds[s])} by {100 * (abs(ratio) - 1):+.0f} % and "
        f"{np.degrees(np.angle(ratio)):+.0f}°"
        f"{more}: check what was mounted in each run, and where; else the rotor does not repeat itself or is "
        "not linear",
    )
