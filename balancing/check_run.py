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

from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from balancing.conventions import Labels
from balancing.error_draws import Noise
from balancing.influence import (
    Influence,
    Whitening,
    estimate_influence,
    in_order,
    local_runs,
    match_readings,
    picked,
    with_readings,
)
from balancing.printed_readings import (
    INVISIBLE,
    covariance_column,
    largest_readings,
    reading_columns,
    rms,
    small,
    vector_columns,
    weight_rows,
)
from balancing.reading_errors import reading_of
from balancing.regions import LEVEL, real_parts
from balancing.trials import Trials
from balancing.weights_and_prediction import rms_change, shown
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.tables import Column, records, text
from rotorid.base.text import figures, listing, sentence
from rotorid.regression import solution, unstretch

if TYPE_CHECKING:
    from balancing.correction_result import Correction

DRAWS = 400


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
        Whether what was proposed was mounted (the check runs do not say what was mounted).
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
        return self.achieved - self.predicted

    @property
    def verdict(self) -> str:
        """One or two sentences: whether the errors explain the differences, and what else may."""
        size = np.abs(self.difference) if self.explained is None else self.distance
        r, s, k = np.unravel_index(int(np.argmax(size)), size.shape)
        where = f"sensor {self.sensors[k]!r} at {self.labels.speed_words(self.speeds[s])}"
        if len(self.runs) > 1:
            where += f" in run {self.runs[r]!r}"
        if self.probability is None:
            return (
                "no verdict: the errors of the readings are not known (state them, or repeat readings); "
                f"{where} differs most, by {shown(self.labels, size[r, s, k])}"
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
            f"{figures(size[r, s, k], 2)} standard deviations"
        )

    def _as_if(self) -> str:
        """Other weights that would cause the differences, in words; empty: none in the planes."""
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
        sizes = {column.heading: list(column.values) for column in readings}
        mounted = [
            {"run": run, "weights": weight_rows(labels, self.planes, weights)}
            for run, weights in zip(self.runs, self.weights, strict=True)
        ]
        return plain(
            {
                "as_proposed": self.as_proposed,
                "mounted": mounted,
                "readings": records(readings),
                "chi_square": self.chi_square,
                "degrees_of_freedom": self.n,
                "probability": self.probability,
                "explained": self.explained,
                "verdict": self.verdict,
                "further_weights": None
                if self.change is None
                else weight_rows(labels, self.planes, self.change),
                "rms_before": rms(sizes["before"]),
                "rms_predicted": rms(sizes["predicted"]),
                "rms_achieved": rms(sizes["achieved"]),
                "warnings": self.warnings,
            }
        )

    @property
    def headline(self) -> str:
        """Whether the rotor does what was predicted, and what is left in the last run, in a sentence."""
        scale = self.labels.vibration_scale
        predicted = small(rms(self.predicted[-1]) * scale, rms(self.before) * scale)
        heads = {True: "As predicted", False: "Not as predicted", None: "Not judged"}
        left = rms_change(self.labels, self.before, self.achieved[-1])
        return f"{heads[self.explained]}: with the weights {left} ({predicted} predicted without check runs)."

    @property
    def answer(self) -> Answer:
        """Whether the rotor does what was predicted, what is left, and all readings beside the prediction."""
        labels = self.labels
        largest = largest_readings(labels, self.speeds, self.sensors, self.before, self.achieved[-1])
        mounted = "what was proposed" if self.as_proposed else "what its weights table says"
        return Answer(
            f"{self.headline} {sentence(self.verdict)}",
            f"Largest in run {self.runs[-1]!r}{largest}",
            self.warnings,
            tables=(f"Check run, mounted: {mounted}.\n{self._readings_text()}",),
            more="the check run",
        )

    def _columns(self) -> tuple[Column, ...]:
        """One row per run, speed and sensor."""
        R, labels = len(self.runs), self.labels
        rounding = INVISIBLE * float(np.abs(self.before).max()) * labels.vibration_scale
        before = np.broadcast_to(self.before, self.achieved.shape)
        each = (("predicted", self.predicted), ("achieved", self.achieved), ("difference", self.difference))
        vectors = (
            vector_columns(labels, name, values, rounding) for name, values in (("before", before), *each)
        )
        places = reading_columns(labels, self.speeds, self.sensors)
        covariance = None if self.explained is None else self.covariance
        return (
            Column("run", np.repeat(self.runs, before[0].size), str if R > 1 else None),
            *(replace(column, values=list(column.values) * R) for column in places),
            *chain.from_iterable(vectors),
            covariance_column(labels, "covariance", covariance, before.size),
            Column("distance", self.distance.ravel(), partial(figures, digits=2), title="off by std"),
        )

    def _readings_text(self) -> str:
        hidden = {"before", "before_phase_deg", "difference_phase_deg"}
        hidden |= {"distance"} if self.explained is None else set()
        columns = [column for column in self._columns() if column.heading not in hidden]
        unit = f" in {self.labels.vibration_in}" if self.labels.vibration_in else ""
        table = text(columns, left=2 + (len(self.runs) > 1))
        return f"Vibration{unit}, predicted and achieved\n{table}"


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
    today = influence.rebased(baseline)
    part = today.part(*match_readings(check, today))
    local = local_runs(part, _as_mounted(check, correction))
    predicted = part.baseline + np.einsum("scp,rp->rsc", part.W, local.weights)
    difference = check.mean - predicted
    reading = reading_of(check)
    covariance = np.full((*difference.shape, 2, 2), np.nan)
    distance = covariance[..., 0, 0]
    chi_square = probability = explained = change = None
    if part.known_errors:
        noise = part.difference_noise(local)
        V = noise.covariance(part.errors.sizes)
        R, S, C = difference.shape
        covariance = np.einsum("scrarb->rscab", V.reshape(S, C, R, 2, R, 2))
        d = real_parts(difference[..., None])
        distance = np.sqrt(np.einsum("rsci,rsci->rsc", d, np.linalg.solve(covariance, d[..., None])[..., 0]))
        squares = whitened(part, noise, difference)[2]
        chi_square = float(squares[0])
        probability = np.count_nonzero(squares >= chi_square) / (1 + DRAWS)
        explained = bool(probability >= 1 - LEVEL)
        change = None if explained else _change(part, local, difference)
    return CheckComparison(
        runs=check.runs,
        sensors=check.sensors,
        planes=part.planes,
        speeds=part.speeds,
        weights=local.weights,
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
        warnings=check.warnings + (reading.warnings if reading.source != "assumed" else ()),
    )


def whitened(
    part: Influence, noise: Noise, difference: ComplexArray, *effects: ComplexArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A difference and effects (R, S, C) divided by the size of a noise, (n,) and (n, k).

    And the sums of squares that the effects leave of it and of draws of the noise, (1 + DRAWS,).
    """
    white = Whitening(noise, part.errors.sizes)
    y, *columns = (white.white(real_parts(np.moveaxis(z, 0, -1))[..., None]) for z in (difference, *effects))
    A = np.hstack((y[:, :0], *columns))
    basis = np.linalg.qr(A)[0]
    drawn = (white.white(np.moveaxis(real_parts(z), 0, -1)) for z in part.noise_draws(noise, DRAWS))
    left = [np.sum(z**2, axis=0) - np.sum((basis.T @ z) ** 2, axis=0) for z in chain((y,), drawn)]
    return y[:, 0], A, np.concatenate(left)


def _change(part: Influence, check: Trials, difference: ComplexArray) -> ComplexArray | None:
    """Weights δ (P,), the same in all runs, of one plane, else of all, with which errors explain the rest.

    By least squares, errors those of the readings as they are with δ mounted; None: there are none.
    """
    P = len(part.planes)
    fits: list[tuple[float, ComplexArray]] = []
    for planes in (*([p] for p in range(P)), list(range(P))):
        if len(planes) >= difference.size or (len(planes) > 1 and fits):
            continue
        effects = [np.broadcast_to(z * part.W[..., p], difference.shape) for p in planes for z in (1, 1j)]
        change = np.zeros(P, dtype=complex)
        for _ in range(2):  # errors depend on what is mounted
            noise = part.difference_noise(replace(check, weights=check.weights + change))
            target, A, (left, *usual) = whitened(part, noise, difference, *effects)
            change[planes] = unstretch(solution(A, target, rcond=1e-10))
        if left <= (most := np.quantile(usual, LEVEL)):
            fits.append((left / most, change))
    return min(fits, key=lambda fit: fit[0])[1] if fits else None


def last_run(runs: Trials) -> Trials:
    """Trials of the last run alone.

    Parameters
    ----------
    runs
        One or more.

    Returns
    -------
    Trials
        With its readings and weights.
    """
    return replace(runs, runs=runs.runs[-1:], weights=runs.weights[-1:], **picked(runs, np.s_[-1:, :, :]))


def refine(trials: Trials, check: Trials, corrections: Correction | None = None) -> Influence:
    """Influence coefficients from trial runs and check runs together.

    Parameters
    ----------
    trials
        Trial runs, as for `estimate_influence`.
    check
        Check runs in their order, of the same sensors and speeds (speeds within 0.5 % count as one). Weights
        of their planes are all that was mounted in them.
    corrections
        What was mounted in check runs that have no planes.

    Returns
    -------
    Influence
        Its last run is the last check run, so that `Correction.to_add` is what to add to it.

    Raises
    ------
    UndeterminedError
        Where all runs together do not determine the coefficients.
    ValueError
        For other sensors and speeds, and where nobody says what was mounted.
    """
    return estimate_influence(with_check_runs(trials, check, corrections))


def _as_mounted(check: Trials, correction: Correction | None) -> Trials:
    """Check runs with what was proposed as their weights, where they have none."""
    if check.planes:
        return check
    if correction is None:
        raise ValueError(
            f"what was mounted in the check run {check.runs[0]!r} is not known: give its weights table, or "
            "the corrections that were mounted"
        )
    weights = np.tile(correction.weights, (len(check.runs), 1))
    return replace(check, planes=correction.planes, weights=weights)


def with_check_runs(trials: Trials, check: Trials, corrections: Correction | None = None) -> Trials:
    """Trial runs and check runs as one table.

    Parameters
    ----------
    trials, check, corrections
        As of `refine`.

    Raises
    ------
    ValueError
        For check runs of other sensors and speeds, and where nobody says what was mounted.
    """
    if {*check.sensors} != {*trials.sensors}:
        raise ValueError(
            f"the check runs have readings of {listing(map(repr, check.sensors), 'and')}, the trial runs of "
            f"{listing(map(repr, trials.sensors), 'and')}: give those of the same sensors"
        )
    check = with_readings(_as_mounted(check, corrections), trials, "readings of the check run")
    added = [plane for plane, there in zip(check.planes, check.weights.T, strict=True) if there.any()]
    planes = tuple(dict.fromkeys((*trials.planes, *added)))
    weights = [in_order(runs.weights, runs.planes, planes) for runs in (trials, check)]
    stated = trials.errors or check.errors
    measured = [each.covariance for each in (trials, check) if each.covariance is not None]
    # of typed readings beside measured ones: the mean of these, or none beside stated errors
    usual = 0.0 if stated or not measured else float(np.nanmean(measured[0][[0, 1], [0, 1]]))

    def joined(name: str, missing: FloatArray) -> Any:  # noqa: ANN401
        """Arrays (…, K, R, S, C) of both as one, NaN where one has fewer repeats."""
        if all(getattr(runs, name) is None for runs in (trials, check)):
            return None
        most, padded = max(len(trials.readings), len(check.readings)), []
        for runs in (trials, check):
            array = getattr(runs, name)
            if array is None:
                array = np.multiply.outer(missing, np.ones(runs.readings.shape))
            gap = [*[(0, 0)] * missing.ndim, (0, most - len(runs.readings)), *[(0, 0)] * 3]
            padded.append(np.pad(array, gap, constant_values=np.nan))
        return np.concatenate(padded, axis=-3)

    return replace(
        trials,
        runs=(*trials.runs, *(f"{name} (check)" if name in trials.runs else name for name in check.runs)),
        planes=planes,
        readings=joined("readings", np.ones(())),
        weights=np.concatenate(weights),
        errors=stated,
        run_errors=trials.run_errors or check.run_errors,
        warnings=tuple(dict.fromkeys(trials.warnings + check.warnings)),
        steps=joined("steps", np.zeros(2)),
        covariance=joined("covariance", usual * np.eye(2)),
    )
