"""Influence coefficients: what weights do, `Y = Y₀ + W T`, how they err, and how they are drawn again.

Source of the estimate: [S] (34)–(39), generalised: weights removed or left in, several in a run and repeated
runs are all one relation. How errors travel is derived in `balancing.error_draws`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from balancing.conditioning import UndeterminedError, check_effects, check_runs
from balancing.conventions import Labels
from balancing.error_draws import Errors, Noise, drawn, run_noise
from balancing.error_draws import Gaussian as Gaussian
from balancing.error_draws import Mounted as Mounted
from balancing.error_draws import Whitening as Whitening
from balancing.reading_errors import (
    NOTICEABLE,
    ROUNDING,
    Reading,
    RunErrors,
    contradiction,
    mean_variance,
    own_variance,
    reading_of,
    run_errors,
    unbalances,
    unseen,
)
from balancing.trials import Placement, Trials, check_names, check_speeds, keep
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.choices import did_you_mean
from rotorid.base.text import RPM, percent, rpm_text
from rotorid.regression import gain

SPEED_TOLERANCE = 0.005
"""Speeds that differ by less, relatively, count as one."""
SAME = 1e-9
"""Readings that differ by less, relatively, are the same ones, written and read again."""


class Remarks(NamedTuple):
    """Sentences about coefficients.

    Attributes
    ----------
    warnings
        What the user should know.
    notes
        What the user may want to know.
    contradictions
        Those of the warnings that say that runs disagree.
    """

    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    contradictions: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Influence:
    """Influence coefficients of P planes on C sensors at S speeds.

    Attributes
    ----------
    speeds
        rad/s, shape (S,).
    sensors, planes
        Names, lengths C and P.
    W
        Complex amplitude per weight, shape (S, C, P).
    baseline
        Readings of the bare rotor, shape (S, C); NaN where there are none.
    errors
        How they err, and what that follows from.
    labels
        Units and conventions to print results in.
    remarks
        Sentences for the user.
    """

    speeds: FloatArray
    sensors: tuple[str, ...]
    planes: tuple[str, ...]
    W: ComplexArray
    baseline: ComplexArray
    errors: Errors
    labels: Labels = field(default_factory=Labels)
    remarks: Remarks = field(default_factory=Remarks)

    def __post_init__(self) -> None:
        names = {name: check_names(getattr(self, name), name) for name in ("sensors", "planes")}
        keep(self, speeds=check_speeds(self.speeds), **names)
        S, C, P = len(self.speeds), len(self.sensors), len(self.planes)
        for name, shape in (("W", (S, C, P)), ("baseline", (S, C))):
            array = np.array(getattr(self, name), dtype=complex)
            wrong = np.isinf(array) | (np.isnan(array) & (name == "W"))
            if array.shape != shape or wrong.any():
                raise ValueError(f"{name} must be finite, of shape {shape}; got shape {array.shape}")
            keep(self, **{name: array})

    @property
    def has_baseline(self) -> bool:
        """Whether every reading of the bare rotor is known."""
        return not np.isnan(self.baseline).any()

    @property
    def trials(self) -> Trials | None:
        """The runs that the coefficients are from; None: they were stored or computed."""
        return self.errors.trials

    @property
    def reading(self) -> Reading:
        """Errors of a reading."""
        return self.errors.reading

    @property
    def run_errors(self) -> RunErrors:
        """Errors of a run that all its readings share or that repeats do not show."""
        return self.errors.run

    @property
    def mounted(self) -> Mounted:
        """What is mounted today."""
        return self.errors.mounted

    @property
    def known_errors(self) -> bool:
        """Whether anything is known of the errors."""
        return bool(self.errors.noise.blocks.any() or self.errors.noise.columns.any())

    @property
    def unit(self) -> str:
        """Unit of a coefficient, such as "um_pp/g"."""
        return f"{self.labels.vibration_unit or '1'}/{self.labels.weight_unit or '1'}"

    def draws(self, count: int = 400) -> Iterator[tuple[ComplexArray, ComplexArray]]:
        """The coefficients drawn again, block by block; nothing where errors are not known.

        Parameters
        ----------
        count
            Number of draws, the same ones whenever asked for.

        Yields
        ------
        Y₀ (B, S, C) and W (B, S, C, P).
        """
        if self.known_errors:
            for error in drawn(self.errors.noise, self.errors.draw(count, 0), 0):
                yield self.baseline + error[..., 0], self.W + error[..., 1:]

    def noise_draws(self, noise: Noise, count: int = 400) -> Iterator[ComplexArray]:
        """Errors (B, S, C, n) of a noise with the sizes of `draws`, block by block."""
        return drawn(noise, self.errors.draw(count, 0), 1)

    def further(
        self, readings: ComplexArray, weights: ComplexArray, count: int = 400
    ) -> Iterator[ComplexArray]:
        """Errors of one more run, drawn with sizes as in `draws`.

        Parameters
        ----------
        readings
            What is expected, (S, C).
        weights
            What is mounted then, (P,).

        Yields
        ------
        (B, S, C), blocks of the same lengths as those of `draws`.
        """
        noise = self._of_runs(self._run(readings, weights), np.eye(1))
        return (error[..., 0] for error in self.noise_draws(noise, count))

    def _run(self, readings: ArrayLike, weights: ComplexArray) -> Trials:
        """One run with readings (S, C) and weights (P,), mounted as those of the trial runs."""
        names = ("baseline",), self.speeds, self.sensors, self.planes
        placement = self.trials.placement if self.trials else Placement()
        return Trials(*names, np.array([readings]), weights[None], labels=self.labels, placement=placement)

    def difference_noise(self, check: Trials) -> Noise:
        """How readings of runs err against Y₀ + W T: `blocks` (2, S, C, 2R, 2R), `columns` (M, S, C, R).

        Parameters
        ----------
        check
            R runs with the speeds, sensors and planes of the coefficients.
        """
        R = len(check.runs)
        reading = reading_of(check)
        reading = self.reading if reading.source == "assumed" and self.reading.errors is not None else reading
        change = np.column_stack((np.ones(R), check.weights)).astype(complex)
        return self.errors.noise.changed(change).plus(self._of_runs(check, np.eye(R), reading))

    def _of_runs(self, runs: Trials, G: FloatArray, reading: Reading | None = None) -> Noise:
        """Errors of combinations (n, R) of further runs; of a reading as those of the coefficients."""
        return run_noise(runs, self.W, G.astype(complex), reading or self.reading, self.run_errors)

    def channels(self, *, known: bool = False) -> FloatArray:
        """First-order covariance of (Re Y₀, Im Y₀, Re W₁, …) of each reading, (S, C, 2P + 2, 2P + 2).

        Parameters
        ----------
        known
            Only of what was stated or measured, not of what is assumed.
        """
        counts = np.ones(6, dtype=bool)
        if known:
            counts[0] = self.reading.source != "assumed"
            counts[1:5] = self.run_errors.origin != "assumed"
        return self.errors.noise.covariance(self.errors.sizes * counts)

    def columns(self) -> ComplexArray:
        """Errors that readings have in common, (M, S, C, P + 1).

        (Y₀, W) errs by their sum, each times a real number of variance 1.
        """
        return self.errors.noise.at(self.errors.sizes)[1]

    def part(
        self, speeds: Sequence[int], sensors: Sequence[int] | None = None, planes: Sequence[int] | None = None
    ) -> Influence:
        """Coefficients of some speeds, sensors and planes, by their indices; None: of all."""
        sensors = range(len(self.sensors)) if sensors is None else sensors
        planes = list(range(len(self.planes)) if planes is None else planes)
        if [*speeds, *sensors, *planes] == [k for n in self.W.shape for k in range(n)]:
            return self
        chosen = tuple(self.planes[p] for p in planes)
        mounted = self.mounted._replace(planes=chosen, weights=self.mounted.weights[planes])
        noise = self.errors.noise.part(speeds, sensors, planes)
        return replace(
            self,
            speeds=self.speeds[list(speeds)],
            sensors=tuple(self.sensors[c] for c in sensors),
            planes=chosen,
            W=self.W[np.ix_(speeds, sensors, planes)],
            baseline=self.baseline[np.ix_(speeds, sensors)],
            errors=self.errors._replace(noise=noise, mounted=mounted),
        )

    def rebased(self, baseline: Trials | ArrayLike | None) -> Influence:
        """The same coefficients with today's vibration as baseline.

        Parameters
        ----------
        baseline
            Runs at known weights (the bare rotor is the mean of Y − W T), or its readings (S, C); None: the
            baseline that the coefficients have.

        Raises
        ------
        ValueError
            For planes, sensors or speeds that do not fit, and readings that are not finite.
        """
        P = len(self.planes)
        if baseline is None:
            return self
        if not isinstance(baseline, Trials):
            baseline = self._run(baseline, np.zeros(P, dtype=complex))
        local = local_runs(self, baseline)
        weights, (R, *_) = local.weights, local.mean.shape
        bare = local.mean - np.einsum("scp,rp->rsc", self.W, weights)
        mean, largest = bare.mean(axis=0), np.abs(bare).max()
        apart = float(np.abs(bare - bare[0]).max() / (largest or 1.0))
        today, errors = (
            reading_of(local),
            self.errors._replace(mounted=Mounted(baseline.runs[-1], self.planes, weights[-1])),
        )
        contradictions = self.remarks.contradictions
        if apart > NOTICEABLE:
            words = (
                f"runs imply vibrations of the bare rotor that differ by {percent(apart)} % of the largest "
                "one"
            )
            if not weights.any():
                raise UndeterminedError(
                    f"{words}: if they are trial runs, give the weights table or keep only the baseline run"
                )
            contradictions += (f"{words}: check the weights table and the stored coefficients",)
        warnings = (*self.remarks.warnings, *baseline.warnings, *today.warnings, *contradictions)
        measured = today.source != "assumed"
        if measured and not self.known_errors:
            warnings += (
                "the errors of the influence coefficients are not known: ± are those of the vibration to "
                "correct alone, and too small",
            )
        again = R == 1 and baseline.errors in (None, self.reading.errors)
        again = again and bool(np.abs(mean - self.baseline).max() <= SAME * largest)
        if (measured or self.known_errors) and not again:
            reading = self.reading
            if measured or reading.errors is None:
                reading = today._replace(dof=min(today.dof, reading.dof))
            change, G = np.eye(P + 1, dtype=complex), np.zeros((P + 1, R))
            change[0, 0], change[0, 1:], G[0] = 0, -weights.mean(axis=0), 1 / R
            noise = errors.noise.changed(change).plus(self._of_runs(local, G, reading))
            errors = errors._replace(noise=noise, reading=reading)
        remarks = Remarks(tuple(dict.fromkeys(warnings)), self.remarks.notes, contradictions)
        return replace(self, baseline=mean, errors=errors, labels=baseline.labels, remarks=remarks)


def local_runs(influence: Influence, trials: Trials) -> Trials:
    """Runs at the speeds, sensors and planes of coefficients.

    Parameters
    ----------
    influence
        The coefficients.
    trials
        Runs with these sensors, speeds (within 0.5 %) and planes, perhaps more.

    Returns
    -------
    The readings and weights that belong to the coefficients, in their order.

    Raises
    ------
    ValueError
        For sensors or speeds that they lack, and a weight in another plane.
    """
    for plane, weights in zip(trials.planes, trials.weights.T, strict=True):
        if plane not in influence.planes and weights.any():
            raise ValueError(
                f"a weight is mounted in plane {plane!r}, for which there are no influence coefficients; "
                f"there are some for {', '.join(map(repr, influence.planes))}"
            )
    weights = in_order(trials.weights, trials.planes, influence.planes)
    read = with_readings(trials.with_phases(), influence, "baseline readings")
    return replace(read, planes=influence.planes, weights=weights)


def with_readings(runs: Trials, of: Influence | Trials, what: str) -> Trials:
    """Runs with the readings at the speeds and sensors of coefficients or of other runs alone.

    Parameters
    ----------
    runs, of
        The runs, and what has the wanted speeds and sensors.
    what
        As of `match_readings`.
    """
    at = np.ix_(*match_readings(of, runs, what))
    return replace(runs, speeds=of.speeds, sensors=of.sensors, **picked(runs, at))


def picked(runs: Trials, at: tuple[Any, ...]) -> dict[str, Any]:
    """Arrays of readings, steps and covariances, as far as there are some, at indices of the last axes."""
    arrays = {name: getattr(runs, name) for name in ("readings", "steps", "covariance")}
    return {name: array[..., *at] for name, array in arrays.items() if array is not None}


def in_order(weights: ComplexArray, planes: Sequence[str], wanted: Sequence[str]) -> ComplexArray:
    """Weights (…, Q) of planes as those (…, P) of the wanted planes, 0 where these have none."""
    same = [[plane == name for name in wanted] for plane in planes]
    return np.asarray(weights @ np.array(same, dtype=float).reshape(len(planes), len(wanted)))


def match_readings(
    wanted: Influence | Trials, available: Influence | Trials, what: str = "coefficients"
) -> tuple[list[int], list[int]]:
    """Indices of the wanted speeds (within 0.5 %) and sensors among the available ones.

    Parameters
    ----------
    wanted, available
        Coefficients or runs.
    what
        What the available ones have, for the complaint.

    Raises
    ------
    ValueError
        For a speed or a sensor that is not among the available ones.
    """
    there = available.sensors
    if lacking := [name for name in wanted.sensors if name not in there]:
        some, every = (", ".join(map(repr, names)) for names in (lacking, there))
        raise ValueError(f"there are no {what} of sensor {some}; there are some of {every}")
    sensors = [there.index(name) for name in wanted.sensors]
    return match_speeds(wanted.speeds, available.speeds, what), sensors


def match_speeds(wanted: ArrayLike | None, available: FloatArray, what: str = "coefficients") -> list[int]:
    """Indices of available speeds equal to the wanted ones within 0.5 %.

    Parameters
    ----------
    wanted, available
        rad/s, one or many; None: all of the available ones.
    what
        What the available speeds have, for the complaint.

    Returns
    -------
    For each wanted speed the place of the available one, from 0.

    Raises
    ------
    ValueError
        For a speed that is not among the available ones.
    """
    out = []
    for speed in np.atleast_1d(np.asarray(available if wanted is None else wanted, dtype=np.float64)):
        i = int(np.argmin(np.abs(available - speed)))
        if not abs(available[i] - speed) <= SPEED_TOLERANCE * available[i]:
            rpm = ", ".join(f"{v * RPM:.6g}" for v in available)
            raise ValueError(f"there are no {what} at {rpm_text(speed)}; there are some at {rpm} rpm")
        out.append(i)
    if len(set(out)) < len(out):
        raise ValueError("a speed is given twice")
    return out


def plane_indices(influence: Influence, planes: Sequence[str] | None) -> list[int]:
    """Indices of the chosen planes.

    Raises
    ------
    ValueError
        Unknown or repeated planes, or none.
    """
    if planes is None:
        return list(range(len(influence.planes)))
    for name in planes:
        if name not in influence.planes:
            raise ValueError(
                f"there is no plane {name!r}{did_you_mean(str(name), influence.planes)}; "
                f"the planes are {', '.join(map(repr, influence.planes))}"
            )
    if not planes or len(set(planes)) < len(planes):
        raise ValueError("choose at least one plane, each once")
    return [influence.planes.index(p) for p in planes]


def estimate_influence(trials: Trials, *, relative: bool = False) -> Influence:
    """Influence coefficients, and the readings of the bare rotor, from trial runs.

    Parameters
    ----------
    trials
        R ≥ P + 1 runs whose weights determine the baseline and every plane.
    relative
        Whether weights may be relative to unknown trial weights, and the coefficients with them.

    Returns
    -------
    Influence
        With its errors, by the rules of `balancing.reading_errors`.

    Raises
    ------
    UndeterminedError
        Where the runs do not separate baseline and planes, and for a trial weight without effect (no reading
        changes, or none by more than its errors explain at 95 %); says which run to add or repeat.

    Notes
    -----
    Runs over-determine the coefficients where R > P + 1. Rows are then weighted by the variance of their
    readings where it is known, else alike.
    """
    if trials.index is not None or (trials.relative is not None and not relative):
        raise UndeterminedError(trials.special)
    influence = fit_runs(trials)
    check_effects(trials, influence.W, influence.channels(known=True), influence.remarks.contradictions)
    return influence


def fit_runs(trials: Trials) -> Influence:
    """`estimate_influence` of weights as they stand, without a look at whether each does something."""
    R, P = trials.weights.shape
    if P == 0:
        raise UndeterminedError(
            "there are no planes: no run has a trial weight, so the effect of none is determined; "
            "add runs with trial weights, or use stored influence coefficients"
        )
    check_runs(trials.runs, trials.planes, trials.weights)
    reading = reading_of(trials)
    if reading.source == "assumed" and R > P + 1:  # the runs themselves tell all errors in one
        reading = reading._replace(source="residuals")
    A = np.column_stack((np.ones(R), trials.weights)).astype(complex)
    Y = np.moveaxis(trials.mean, 0, -1)  # (S, C, R)
    covariance = reading.covariance(trials)
    variance = mean_variance(covariance)
    theta = np.einsum("scnr,scr->scn", _gain(A, variance), Y)
    run = run_errors(trials, theta, covariance, reading)
    alone, common, loads, further = run.typical**2
    between = (
        alone * own_variance(trials.mean, run.evenly)
        + common * np.abs(trials.mean) ** 2
        + further * np.sum(np.abs(unbalances(theta[..., 1:], run.level)) ** 2, axis=-1)
        + loads * np.abs(trials.mean - theta[..., 0]) ** 2
    )
    G = _gain(A, variance + between)
    theta = np.einsum("scnr,scr->scn", G, Y)
    # a rotor at rest is at rest: what is left of its readings is rounding
    theta[..., 0][np.abs(theta[..., 0]) < ROUNDING * np.abs(Y).max(axis=-1)] = 0.0
    mounted = Mounted(trials.runs[-1], trials.planes, trials.weights[-1])
    errors = Errors(run_noise(trials, theta[..., 1:], G, reading, run), reading, run, mounted, trials)
    disagree = contradiction(trials, A, run)
    return Influence(
        speeds=trials.speeds,
        sensors=trials.sensors,
        planes=trials.planes,
        W=theta[..., 1:],
        baseline=theta[..., 0],
        errors=errors,
        labels=trials.labels,
        remarks=Remarks(reading.warnings + disagree + trials.warnings, unseen(run, trials), disagree),
    )


def _gain(A: ComplexArray, variance: FloatArray) -> ComplexArray:
    """(Y₀, W₁, …) = G Y, (S, C, P + 1, R), rows weighted by variances (R, S, C)."""
    R, n = A.shape
    variance = np.moveaxis(variance, 0, -1)
    largest = variance.max(axis=-1, keepdims=True)
    if n == R or not largest.any():
        return np.broadcast_to(gain(A), (*variance.shape[:-1], n, R))
    # a reading near zero would otherwise count infinitely much
    variance = np.where(largest > 0, np.maximum(variance, 1e-4 * largest), 1.0)
    root = 1 / np.sqrt(variance)
    return np.asarray(gain(root[..., None] * A) * root[..., None, :])
