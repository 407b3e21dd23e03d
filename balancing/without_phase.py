"""Balancing without phases: weights for one or two planes from amplitudes alone, and whether to mount them.

Each reading (a sensor at a speed) is fitted for itself (`amplitudes`) and may have several solutions y, w;
one of each is chosen, and the weights D that leave least of all, Σ |y + w D|², are one solution of the job.
Where one weight leaves nothing anywhere within the errors, the choices in which it does not are dropped.

Errors: as stated (amplitude, floor, from run to run); else 10 % of each amplitude, independent from run to
run, and from four readings more than unknowns on what the fit leaves. The digits always count. Those of
different readings count as independent.

A solution stays possible within 99 %, by F or χ² of the 2 P numbers that it is. The best one is mounted where
the 95 % interval of the vibration that it leaves ends below 0.9 of the present, whichever of the possible
solutions is true; else a run is named whose amplitude differs most, in its errors, among all that
is possible, of those that shake the rotor not much more than the runs did.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from balancing.amplitudes import Amplitudes, Minima, effects, misfit
from balancing.conditioning import UndeterminedError, chance
from balancing.correction import MountDecision
from balancing.decision import HARDLY_BELOW
from balancing.regions import LEVEL, Region, half_width
from balancing.tables import reading_columns, rms, three_figures, weight_columns
from balancing.trials import Trials
from rotorid.base.answer import COLUMNS, Answer, Answered
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.tables import Column, frame, records, text
from rotorid.base.text import capital, counted, figures, listing, percent

if TYPE_CHECKING:
    import pandas as pd

    from balancing.conventions import Labels

ASSUMED = 0.1
"""Relative error of an amplitude of a run, where nothing says more."""
SPARE = 4
"""Readings more than unknowns from which errors are estimated."""
CONTRADICTION = 0.01
"""Chance of a larger misfit below which amplitudes contradict each other."""
POSSIBLE = 0.99
"""Solutions are those within it."""
WEAK = 3.0
"""Effect of a trial weight in units of its error: too small below."""
SHAKING = 1.5
"""A run that is proposed may read so many times the largest run (rms, with 95 %)."""
_UNLIKE = 1e-4
"""Chance below which no single weight leaves nothing at every reading."""
_NEAR = 0.25
"""Solutions whose weights differ by less, of their size, are shown as one, with the draws of both."""
_FAR, _DRAWS, _MOST, _LEAST = 1e3, 1000, 32, 1e-3
"""Largest weight, of the trials'; draws of a solution; solutions; least error, of a sensor's largest."""


@dataclass(frozen=True, eq=False)
class AmplitudeSolution:
    """Weights that explain the amplitudes.

    Attributes
    ----------
    weights
        To mount on the bare rotor, angle with the rotation, kg or kg·m, shape (P,).
    chi_square
        Misfit of the amplitudes.
    before, effect
        Readings y ≥ 0 of the bare rotor (N,), and w of the planes by them (N, P); speed by speed.
    draws
        The weights as the errors allow, (n, P).
    left
        Share of the present vibration (rms) that the weights of the first solution leave if this one is
        true: the upper end of its 95 % interval.
    """

    weights: ComplexArray
    chi_square: float
    before: FloatArray
    effect: ComplexArray
    draws: ComplexArray
    left: float

    @cached_property
    def region(self) -> Region:
        """Where the weights are with 95 %, all planes jointly."""
        return Region.of(self.draws, self.weights)

    def intervals(self) -> FloatArray:
        """With 95 %: least and largest mass, and half the interval of the angle, rad, (3, P)."""
        turned = np.angle(self.draws * self.weights.conj())
        tails = (1 - LEVEL) / 2, (1 + LEVEL) / 2
        return np.vstack((np.quantile(np.abs(self.draws), tails, axis=0), half_width(turned)))


class Scatter(NamedTuple):
    """How amplitudes err, and how the best solution misses them.

    Attributes
    ----------
    relative, origin
        Relative error of an amplitude of a run; "stated", "assumed" or "estimated".
    chi_square, dof
        Misfit of the best solution, and its degrees of freedom.
    estimated
        Degrees of freedom of the errors; infinite where they are not estimated.
    """

    relative: float
    origin: str
    chi_square: float
    dof: int
    estimated: float = np.inf

    def limit(self, n: int, level: float) -> float:
        """What n numbers may miss, at a level."""
        from scipy.special import fdtri

        return float(n * fdtri(n, min(self.estimated, 1e9), level))


@dataclass(frozen=True, eq=False)
class WithoutPhase(Answered):
    """Every correction that amplitudes allow, and whether to mount the first.

    Attributes
    ----------
    trials
        The runs.
    solutions
        All that are possible with 99 %, the best first.
    scatter, errors
        How amplitudes err and are missed; of each amplitude, (R, N).
    decision
        Whether to mount the weights, and what to do instead.
    next_run
        Plane and weight of a run that would tell more; None where none would.
    weak
        Whether no weight changed a reading by more than its errors explain.
    check, check_bounds
        Check runs, and what they should read at least and at most by the first solution, (2, R, S, C).
    remove
        Planes where material is taken away, opposite to the weight that would be added.
    """

    trials: Trials
    solutions: tuple[AmplitudeSolution, ...]
    scatter: Scatter
    errors: FloatArray
    decision: MountDecision
    next_run: tuple[str, complex] | None
    weak: bool
    check: Trials | None = None
    check_bounds: FloatArray | None = None
    remove: tuple[str, ...] = ()

    @property
    def labels(self) -> Labels:
        """Units and conventions."""
        return self.trials.labels

    @property
    def planes(self) -> tuple[str, ...]:
        """Names, (P,)."""
        return self.trials.planes

    @property
    def weights(self) -> ComplexArray:
        """Of the first solution, (P,)."""
        return self.solutions[0].weights

    @property
    def sound(self) -> bool:
        """Whether to mount them."""
        return self.decision.word == "mount"

    @property
    def as_predicted(self) -> bool:
        """Whether every amplitude of the check runs lies where it was predicted to."""
        if self.check is None or self.check_bounds is None:
            return True
        (low, high), read = self.check_bounds, np.abs(self.check.mean)
        return bool(np.all((low <= read) & (read <= high)))

    def holds(self, weights: ComplexArray) -> bool:
        """Whether weights (P,) lie in the 95 % region of a solution.

        For one plane also where one that leaves nothing misfits by no more than 95 % allow.
        """
        if len(self.planes) > 1 or any(one.region.holds(weights) for one in self.solutions):
            return any(one.region.holds(weights) for one in self.solutions)
        a, T = np.abs(self.trials.mean).reshape(self.errors.shape), self.trials.weights[:, 0]
        places = np.concatenate([weights, *(one.draws[:, 0] for one in self.solutions)])
        total = sum(misfit(T, *reading, places) for reading in zip(a.T, self.errors.T, strict=True))
        return bool(np.min(total) + self.scatter.limit(2, LEVEL) >= np.ravel(total)[0])

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's own units and conventions; what is unknown is None."""
        labels, first = self.labels, self.solutions[0]
        scale = labels.vibration_scale
        after = np.abs(first.before + first.effect @ first.weights) * scale
        before, run = first.before * scale, self.next_run
        readings = *reading_columns(labels, self.trials.speeds, self.trials.sensors), Column("before", before)
        return plain(
            {
                "judgement": self.decision.to_dict(labels),
                "method": "without phase",
                "conventions": labels.conventions(),
                "corrections_refer_to": "the bare rotor, with every weight of the runs removed",
                "corrections": records(self._columns(first)),
                "solutions": [
                    {
                        "chi_square": one.chi_square,
                        "left_95": one.left,
                        "corrections": records(self._columns(one)),
                    }
                    for one in self.solutions
                ],
                "residuals": records((*readings, Column("after", after))),
                "amplitudes": records(self._amplitudes()),
                "rms_before": rms(before),
                "rms_after": rms(after),
                "rms_after_95": self.decision.expected * scale,
                "chi_square": self.scatter.chi_square,
                "chi_square_dof": self.scatter.dof,
                "errors": {"amplitude_percent": 100 * self.scatter.relative, "origin": self.scatter.origin},
                "next_run": None if run is None else {"plane": run[0], **labels.weight_entry(run[1])},
                "check": None if self.check is None else records(self._check()),
                "warnings": self.decision.warnings,
                "notes": self.decision.notes,
            }
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per solution and plane, with its 95 %."""
        import pandas as pd

        each = [frame(self._columns(one)).assign(solution=k) for k, one in enumerate(self.solutions, 1)]
        table = pd.concat(each, ignore_index=True)
        return table[["solution", *table.columns[:-1]]]

    def _columns(self, *solutions: AmplitudeSolution) -> tuple[Column, ...]:
        """plane, mass, unit, angle_deg and their 95 % of each solution."""
        removed = np.array([-1.0 if plane in self.remove else 1.0 for plane in self.planes])
        D = np.concatenate([removed * one.weights for one in solutions])
        low, high, angle = np.hstack([one.intervals() for one in solutions])
        scale = self.labels.weight_scale
        return (
            *weight_columns(self.labels, self.planes * len(solutions), D),
            Column("mass_low", low * scale, lambda mass: figures(mass, 2), title="from"),
            Column("mass_high", high * scale, lambda mass: figures(mass, 2), title="to (95 %)"),
            Column("angle_95_deg", np.degrees(angle), lambda width: f"± {width:.0f}°", title=""),
        )

    def _amplitudes(self) -> tuple[Column, ...]:
        """Every amplitude as it was read, and by the first solution."""
        first = self.solutions[0]
        fitted = np.abs(first.before + self.trials.weights @ first.effect.T)
        return self._read(self.trials, fitted=fitted)

    def _check(self) -> tuple[Column, ...]:
        """Those of the check runs, and what they should be."""
        assert self.check is not None
        assert self.check_bounds is not None
        return self._read(self.check, lowest=self.check_bounds[0], highest=self.check_bounds[1])

    def _read(self, trials: Trials, **beside: FloatArray) -> tuple[Column, ...]:
        """Every amplitude of runs, with others beside."""
        speed, sensor = reading_columns(self.labels, trials.speeds, trials.sensors)
        R, scale = len(trials.runs), self.labels.vibration_scale
        amplitudes = {"read": np.abs(trials.mean), **beside}
        return (
            Column("run", np.repeat(trials.runs, len(sensor.values))),
            replace(speed, values=tuple(speed.values) * R),
            replace(sensor, values=tuple(sensor.values) * R),
            *(Column(name, of.ravel() * scale, three_figures) for name, of in amplitudes.items()),
        )

    def sentence(self) -> str:
        """Whether to mount what, or which run to make."""
        if self.check is not None:
            words = "as predicted" if self.as_predicted else "not as predicted (--table)"
            return f"Check run: {words}. To go on, add it to the runs, with its weights, and balance again."
        if not self.sound:
            return "\n".join(self.decision.lines())
        places = zip(self.planes, self.weights, strict=True)
        at = "; ".join(f"{self.labels.weight_at(weight)} in plane {plane!r}" for plane, weight in places)
        what = "Remove this material" if set(self.planes) <= set(self.remove) else f"Mount {at}"
        before, left = (
            x * self.labels.vibration_scale for x in (self.decision.before, self.decision.expected)
        )
        words = f"rms {figures(before, 3)} → below {figures(left, 2)} {self.labels.vibration_in}".rstrip()
        return f"{what}: {words} with 95 %."

    @property
    def answer(self) -> Answer:
        """What to do, every solution with its 95 %, and the amplitudes behind it."""
        left = [f"{100 * one.left:.0f} %" if one.left < 10 else "anything" for one in self.solutions]
        blank = [""] * (len(self.planes) - 1)
        leaves = Column("left", [cell for words in left for cell in (words, *blank)], title="leaves at most")
        origin = {"stated": "as stated", "estimated": "estimated from the runs"}
        caption = (
            f"{self.labels.turning_in_words()}; amplitudes ± {percent(self.scatter.relative)} % "
            f"({origin.get(self.scatter.origin, 'assumed')}), {counted(len(self.solutions), 'solution')}."
        )
        table = text((*self._columns(*self.solutions), leaves), width=COLUMNS)
        tables = [text(self._amplitudes(), 3)]
        if self.check is not None:
            tables.append("Check run, with 95 % of what was predicted:\n" + text(self._check(), 3))
        return Answer(
            self.sentence(),
            "" if self.weak else f"{table}\n\n{capital(caption)}",
            self.decision.warnings,
            self.decision.notes,
            tuple(tables),
            "every amplitude",
            to_mount=True,
        )


def balance_without_phase(
    trials: Trials,
    *,
    check: Trials | None = None,
    max_weight: FloatArray | None = None,
    row_weights: FloatArray | None = None,
    remove: Sequence[str] = (),
) -> WithoutPhase:
    """Correct one or two planes by amplitudes alone.

    Parameters
    ----------
    trials
        Runs; phases of their readings are not used.
    check
        Check runs, to be compared with the first solution; without planes: with its weights.
    max_weight
        Largest weight of each plane, kg or kg·m, (P,).
    row_weights
        How much each reading counts for the weights, (S, C).
    remove
        Planes where material is taken away.

    Returns
    -------
    WithoutPhase
        Every solution within 99 %.

    Raises
    ------
    UndeterminedError
        Too few runs; says which to make.
    ValueError
        More than two planes, a plane without weights, a sensor that reads nothing.

    Examples
    --------
    >>> runs, angles = ("0", "1", "2", "3"), np.radians([0, 0, 120, 240])
    >>> weights = (np.exp(1j * angles) * [0, 1, 1, 1])[:, None]
    >>> read = np.abs(weights - 0.8j)[..., None]
    >>> trials = Trials(runs, [100.0], ("fan",), ("P",), read, weights, amplitudes_only=True)
    >>> balance_without_phase(trials).weights.round(6)
    array([0.+0.8j])
    """
    _enough(trials)
    R, P = trials.weights.shape
    a, (errors, relative) = np.abs(trials.mean).reshape(R, -1), _errors(trials)
    readings = [Amplitudes(trials.weights, *one) for one in zip(a.T, errors.T, strict=True)]
    fits = [one.minima(60.0) for one in readings]
    scatter = _scatter(fits, R - 1 - 2 * P, relative)
    if scatter.origin == "estimated":
        errors = errors * scatter.relative / ASSUMED
        readings = [Amplitudes(trials.weights, *one) for one in zip(a.T, errors.T, strict=True)]
        fits = [Minima(fit.parameters, fit.chi_square * (ASSUMED / scatter.relative) ** 2) for fit in fits]
    contradiction = _contradiction(trials, a, errors, scatter)
    weak = all(_clear(one, fit) < WEAK for one, fit in zip(readings, fits, strict=True))
    limit = scatter.limit(2 * P, POSSIBLE)
    fits, rows = [fit.within(limit) for fit in fits], np.ones(a.shape[1])
    rows = rows if row_weights is None else np.ravel(row_weights)
    chosen = _choices(readings, fits, rows, limit)
    size = np.abs(trials.weights).max(axis=0)
    largest = _FAR * size if max_weight is None else np.minimum(max_weight, _FAR * size)
    rng = np.random.default_rng(0)
    every = zip(readings, fits, strict=True)
    draws = [one.drawn(rng, fit, _DRAWS, scatter.estimated) for one, fit in every]
    solutions, samples = _solutions(fits, draws, chosen, rows, largest)
    run = _next_run(
        trials, np.concatenate([one[: _DRAWS // len(samples) + 1] for one in samples]), errors, rows
    )
    notes = (
        [
            f"amplitudes are taken to scatter by {percent(ASSUMED)} % from run to run: state "
            "amplitude_percent in [errors] where it is known"
        ]
        if scatter.origin == "assumed"
        else []
    )
    decision = _decide(trials, solutions, run, contradiction, weak=weak)
    bounds = (
        None if check is None else _bounds(check, trials, samples[0], scatter.relative, solutions[0].weights)
    )
    decision = replace(decision, warnings=tuple(trials.warnings), notes=tuple(notes))
    return WithoutPhase(trials, solutions, scatter, errors, decision, run, weak, check, bounds, tuple(remove))


def _enough(trials: Trials) -> None:
    """Refuse what cannot be solved, with the runs that are missing."""
    T, P = trials.weights, len(trials.planes)
    if not 1 <= P <= 2 or not T.any(axis=0).all():
        raise ValueError("without phases one or two planes can be balanced, each with trial weights")
    silent = ~np.abs(trials.mean).any(axis=(0, 1))
    if silent.any():
        raise ValueError(
            f"sensor {trials.sensors[int(np.argmax(silent))]!r} reads 0 in every run: leave it out"
        )
    different = len(np.unique(np.round(T / np.abs(T).max(), 9), axis=0))
    if different >= (3 if P == 1 else 7):
        return
    missing = [] if (T == 0).all(axis=1).any() else ["the rotor without weights"]
    for plane, of in zip(trials.planes, T.T, strict=True):
        angles = np.unique(np.round(np.angle(of[of != 0]), 6))
        while len(angles) < 3:
            gaps = np.diff([*angles, angles[0] + 2 * np.pi])
            k = int(np.argmax(gaps))
            angle = angles[k] + gaps[k] / (3 if len(angles) == 1 else 2)
            weight = trials.labels.weight_at(np.abs(of).max() * np.exp(1j * angle))
            angles = np.sort([*angles, angle])
            missing.append(f"{weight} in plane {plane!r}")
    need, some = "one plane needs four runs, a baseline and three trial weights", ""
    if P == 2:
        need = "two planes need seven runs, a baseline and three trial weights in each"
        some = ", which leave four solutions at a sensor"
    raise UndeterminedError(
        f"without phases {need}, at directions that span more than 90°; there are {different} with different "
        f"weights{some}. Missing: {listing(missing, 'and')}"
    )


def _errors(trials: Trials) -> tuple[FloatArray, float | None]:
    """One standard deviation of each amplitude (R, N), and the relative one; None: it is assumed."""
    a, n, reading, run = np.abs(trials.mean), trials.repeats, trials.errors, trials.run_errors
    size, floor = (0.0, 0.0) if reading is None else (reading.amplitude, reading.floor)
    between, lowest = (0.0, 0.0) if run is None else run
    unstated = not any((size, floor, between, lowest))
    square = (
        ((ASSUMED * a) ** 2) if unstated else (size**2 / n + between**2) * a**2 + floor**2 / n + lowest**2
    )
    if trials.steps is not None:
        square = square + np.nanmean(trials.steps[0], axis=0) ** 2 / 12
    errors = np.maximum(np.sqrt(square), _LEAST * a.max(axis=0)).reshape(len(a), -1)
    return errors, None if unstated else float(np.hypot(size, between))


def _scatter(fits: list[Minima], spare: int, relative: float | None) -> Scatter:
    """Errors as stated, assumed, or such that the misfit is as large as its degrees of freedom."""
    chi_square, dof = float(sum(fit.chi_square[0] for fit in fits)), spare * len(fits)
    if relative is not None:
        return Scatter(relative, "stated", chi_square, dof)
    if spare < SPARE or chi_square < 1e-6:
        return Scatter(ASSUMED, "assumed", chi_square, dof)
    return Scatter(ASSUMED * float(np.sqrt(chi_square / dof)), "estimated", float(dof), dof, dof)


def _contradiction(trials: Trials, a: FloatArray, errors: FloatArray, scatter: Scatter) -> str:
    """Why the amplitudes are none of a linear rotor; empty where they may be."""
    T, (R, N), estimated = trials.weights, a.shape, scatter.origin == "estimated"
    unlikely = scatter.dof > 0 and chance(scatter.chi_square, scatter.dof) < CONTRADICTION
    rest = scatter.dof - N
    if rest > 0 and (unlikely or estimated):  # does one run contradict all others?
        without = np.zeros(R)
        for r in range(R):
            some = np.arange(R) != r
            each = (
                Amplitudes(T[some], *one).minima(0.0) for one in zip(a[some].T, errors[some].T, strict=True)
            )
            without[r] = sum(float(fit.chi_square[0]) for fit in each)
        r = int(np.argmin(without))
        gain = (scatter.chi_square - without[r]) * rest / max(without[r], 1e-12)
        if (R * chance(gain, N, rest) < CONTRADICTION) if estimated else chance(without[r], rest) > 1 - LEVEL:
            return f"run {trials.runs[r]!r} contradicts all others"
    if not unlikely:
        return ""
    loaded = T.any(axis=1)
    if T.shape[1] == 1 and loaded.sum() == 3 and not loaded.all() and abs(T.sum()) < 1e-3 * np.abs(T).sum():
        mean, bare = (np.sqrt((a[of] ** 2).mean(axis=0)) for of in (loaded, ~loaded))
        i = int(np.argmin(mean / bare))
        if mean[i] < bare[i]:
            mean_words, bare_words = (trials.labels.amplitude_words(float(of[i])) for of in (mean, bare))
            return (
                "the amplitudes are impossible: the root mean square of three equal trials at 120°, "
                f"{mean_words}, cannot be below the baseline's {bare_words}"
            )
    ratio = np.sqrt(scatter.chi_square / scatter.dof)
    return f"the amplitudes miss every linear rotor by {ratio:.2g} times their errors"


def _clear(reading: Amplitudes, fit: Minima) -> float:
    """The largest effect of a plane in units of its errors, in the best solution."""
    x, spread = fit.parameters[0], reading.covariances(fit.parameters[:1])[0]
    error = np.diag(spread)[1:].reshape(-1, 2).mean(axis=1)
    return float(np.max(np.abs(effects(x)) / np.sqrt(error)))


class _Choice(NamedTuple):
    """One solution of each reading: its misfit, how far one weight is from leaving nothing, and which."""

    misfit: float
    unlike: float
    which: tuple[int, ...]


def _choices(readings: list[Amplitudes], fits: list[Minima], rows: FloatArray, limit: float) -> list[_Choice]:
    """Solutions of all readings that go together, the best first.

    A reading is y + w D with the common D; where one weight may leave nothing anywhere, its distance from 0
    counts in its errors. The choices are made reading by reading, of which the best are kept.
    """
    P = fits[0].parameters.shape[1] // 2
    spread = [one.covariances(fit.parameters) for one, fit in zip(readings, fits, strict=True)]

    def unlike(which: tuple[int, ...]) -> float:
        if len(which) <= P:
            return 0.0
        x = np.array([fits[i].parameters[b] for i, b in enumerate(which)])
        D = _best(x[None], rows[: len(which)])[0]
        left, total = x[:, 0] + effects(x) @ D, 0.0
        G = np.zeros((2, 1 + 2 * P))
        G[0, 0], G[0, 1::2], G[0, 2::2], G[1, 1::2], G[1, 2::2] = 1.0, D.real, -D.imag, D.imag, D.real
        for i, b in enumerate(which):
            r = np.array([left[i].real, left[i].imag])
            total += float(r @ np.linalg.pinv(G @ spread[i][b] @ G.T) @ r)
        return total

    kept = [_Choice(0.0, 0.0, ())]
    for fit in fits:
        longer = [
            _Choice(choice.misfit + float(more), unlike((*choice.which, b)), (*choice.which, b))
            for choice in kept
            for b, more in enumerate(fit.chi_square)
        ]
        kept = sorted(longer, key=lambda one: one.misfit + one.unlike)[:_MOST]
    alike = chance(kept[0].unlike, 2 * (len(fits) - P)) >= _UNLIKE
    costs = [one.misfit + alike * one.unlike for one in kept]
    order = sorted(range(len(kept)), key=costs.__getitem__)
    return [kept[k] for k in order if costs[k] <= min(costs) + limit]


def _best(x: FloatArray, rows: FloatArray, largest: FloatArray | None = None) -> ComplexArray:
    """Weights (n, P) that leave least, by parameters (n, N, 1 + 2P), within the largest ones (P,)."""
    y, w = x[..., 0] * rows, effects(x) * rows[:, None]
    A, b = np.einsum("nip,niq->npq", w.conj(), w), -np.einsum("nip,ni->np", w.conj(), y)
    ridge = 1e-13 * np.einsum("npp->np", A.real)[..., None] * np.eye(A.shape[-1])
    D = np.linalg.solve(A + ridge + 1e-300 * np.eye(A.shape[-1]), b[..., None])[..., 0]
    if largest is None or (np.abs(D) <= largest).all():
        return np.asarray(D)
    for _ in range(50):  # a plane at a time: what is left is convex
        for p in range(len(largest)):
            rest = b[:, p] - np.einsum("nq,nq->n", A[:, p], D) + A[:, p, p] * D[:, p]
            D[:, p] = rest / np.maximum(A[:, p, p].real, 1e-300)
            D[:, p] *= np.minimum(1.0, largest[p] / np.maximum(np.abs(D[:, p]), 1e-300))
    return np.asarray(D)


def _solutions(
    fits: list[Minima], draws: list[FloatArray], chosen: list[_Choice], rows: FloatArray, largest: FloatArray
) -> tuple[tuple[AmplitudeSolution, ...], list[FloatArray]]:
    """Solutions of the job, and the parameters of their draws, (n, N, 1 + 2P)."""
    made, samples, mounted = list[AmplitudeSolution](), list[FloatArray](), np.zeros(0, dtype=complex)
    for choice in chosen:
        x = np.array([fits[i].parameters[b] for i, b in enumerate(choice.which)])
        some = np.array([draws[i][b] for i, b in enumerate(choice.which)]).swapaxes(0, 1)
        D = _best(x[None], rows, largest)[0]
        mounted = mounted if made else D
        after = np.linalg.norm((some[..., 0] + effects(some) @ mounted) * rows, axis=1)
        left = after / np.linalg.norm(some[..., 0] * rows, axis=1).clip(1e-300)
        bound = float(np.quantile(left, (1 + LEVEL) / 2))
        spread = _best(some, rows, largest)
        one = AmplitudeSolution(D, choice.misfit, x[:, 0], effects(x), spread, bound)
        off = [np.linalg.norm(D - other.weights) / np.linalg.norm(other.weights) for other in made]
        if made and min(off) < _NEAR:
            k, other = int(np.argmin(off)), made[int(np.argmin(off))]
            both = np.concatenate((other.draws, spread))
            made[k] = replace(other, draws=both, left=max(other.left, bound))
            continue
        made.append(one)
        samples.append(some)
    return tuple(made), samples


def _next_run(
    trials: Trials, draws: FloatArray, errors: FloatArray, rows: FloatArray
) -> tuple[str, complex] | None:
    """The plane and the weight at which possible amplitudes differ most, in their errors."""
    a, y, w = np.abs(trials.mean).reshape(errors.shape), draws[..., 0], effects(draws)
    most = SHAKING * np.linalg.norm(a * rows, axis=1).max()
    relative, best, told = (errors / np.maximum(a, errors)).mean(axis=0), None, 0.0
    for p, plane in enumerate(trials.planes):
        size = np.abs(trials.weights[:, p]).max()
        for way in np.exp(2j * np.pi * np.arange(24) / 24):
            read = np.abs(y + w[..., p] * size * way)
            tell = (read.var(axis=0) / ((relative * read.mean(axis=0)) ** 2 + errors.min(axis=0) ** 2)).sum()
            if tell > told and np.quantile(np.linalg.norm(read * rows, axis=1), LEVEL) <= most:
                told, best = float(tell), (plane, complex(size * way))
    return best


def _decide(
    trials: Trials,
    solutions: Sequence[AmplitudeSolution],
    run: tuple[str, complex] | None,
    contradiction: str,
    *,
    weak: bool,
) -> MountDecision:
    """Mount what leaves less than 0.9 of the present vibration by every possible solution."""
    before, labels = rms(solutions[0].before), trials.labels
    expected, T = before * max(one.left for one in solutions), trials.weights[:, 0]
    word: Literal["do not mount", "measure again"] = "do not mount"
    if contradiction:
        word, cause, instead = "measure again", contradiction, "Measure these runs again, or mend the table."
    elif weak:
        cause = "the trial weights changed the readings by no more than their errors explain"
        instead = "Repeat the runs with heavier weights."
    elif expected < HARDLY_BELOW * before:
        return MountDecision(before=before, expected=expected)
    else:
        cause = f"they may leave rms {labels.amplitude_words(float(f'{expected:.2g}'))} (95 %)"
        if len(solutions) > 1:
            cause = f"{counted(len(solutions), 'solution')} explain the readings"
        off = np.linalg.svd(
            np.column_stack((np.ones(len(T)), np.array([T.real, T.imag]).T / np.abs(T).max()))
        )[1]
        if len(trials.planes) == 1 and off[-1] < 1e-6 * off[0]:
            cause = "the weights of all runs stand in one line, and its two sides cannot be told apart"
        instead = (
            "" if run is None else f"Make this run: {labels.weight_at(run[1])} in plane {run[0]!r} alone."
        )
    return MountDecision(word, cause, (instead,) if instead else (), before, expected)


def _bounds(
    check: Trials, trials: Trials, draws: FloatArray, relative: float, proposed: ComplexArray
) -> FloatArray:
    """Lowest and highest amplitude that check runs should show, jointly with 95 %, (2, R, S, C)."""
    R, mounted = len(check.runs), dict(zip(check.planes, check.weights.T, strict=True))
    usual = np.zeros_like(proposed) if check.planes else proposed
    planes = zip(trials.planes, usual, strict=True)
    D = np.array([mounted.get(plane, np.full(R, weight)) for plane, weight in planes])
    read = np.abs(draws[:, None, :, 0] + np.einsum("nip,pr->nri", effects(draws), D))
    least = _LEAST * np.abs(trials.mean).max(axis=0).ravel()
    noise = np.random.default_rng(1).standard_normal(read.shape)
    read = np.abs(read + noise * np.hypot(relative * read, least))
    tail = (1 - LEVEL) / 2 / read[0].size
    bounds = np.quantile(read, [tail, 1 - tail], axis=0).reshape(2, R, len(trials.speeds), -1)
    speeds = [int(np.argmin(np.abs(trials.speeds - speed))) for speed in check.speeds]
    return np.asarray(bounds[:, :, speeds][..., [trials.sensors.index(sensor) for sensor in check.sensors]])
