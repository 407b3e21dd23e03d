"""Balancing without phases: weights for one or two planes from amplitudes alone, and whether to mount them.

Solutions are those of `amplitudes`. Errors: as stated (amplitude, floor, from run to run); else 10 % of each
amplitude, and from four readings more than unknowns on what the fit leaves. The digits always count.
Solutions are those within 99 %, by F or χ² of the 2 P numbers. The best one is mounted where the 95 %
interval of the vibration that it leaves ends below 0.9 of the present, whichever of the solutions is true.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from balancing.conditioning import UndeterminedError, chance
from balancing.correction_result import MountDecision
from balancing.holes import SAME_ANGLE, Holes
from balancing.limits_and_minmax import allowed_sectors, stands_in
from balancing.mount_decision import HARDLY_BELOW
from balancing.printed_readings import reading_columns, rms, three_figures, weight_columns
from balancing.regions import LEVEL, Region
from balancing.trials import Limits, Trials
from balancing.without_phase_fit import Fit, best_weights, choices, common_weight, effects
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
_LEAST = 1e-3
"""Least error, of a sensor's largest amplitude."""
_TINY = 1e-300


class Scatter(NamedTuple):
    """How amplitudes err, and how the best solution misses them.

    Attributes
    ----------
    relative, origin
        Relative error of an amplitude of a run; "stated", "assumed" or "estimated".
    chi_square, dof
        Misfit of the best solution, and its degrees of freedom.
    """

    relative: float
    origin: str
    chi_square: float
    dof: int

    def limit(self, n: int, level: float) -> float:
        """What n numbers may miss at a level."""
        from scipy.special import fdtri

        return float(n * fdtri(n, self.dof if self.origin == "estimated" else 1e9, level))


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
    region
        Weights in its joint 95 % region, (n, P).
    intervals
        From and to of the sizes, and ± of the angles: all of these together hold with 95 %; (P,) each; kg or
        kg·m, rad.
    left
        Share of the present vibration (rms) that the weights of the first solution leave if this one is
        true: the upper end of its 95 % interval.
    """

    weights: ComplexArray
    chi_square: float
    before: FloatArray
    effect: ComplexArray
    region: ComplexArray
    intervals: tuple[FloatArray, FloatArray, FloatArray]
    left: float


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
        Plane, weight and hole (empty: none) of a run that would tell more.
    remove
        Planes where material is taken away, opposite to the weight that would be added.
    """

    trials: Trials
    solutions: tuple[AmplitudeSolution, ...]
    scatter: Scatter
    errors: FloatArray
    decision: MountDecision
    next_run: tuple[str, complex, str]
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

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's own units and conventions."""
        labels, first, scale = self.labels, self.solutions[0], self.labels.vibration_scale
        before, after = first.before * scale, np.abs(first.before + first.effect @ first.weights) * scale
        readings = reading_columns(labels, self.trials.speeds, self.trials.sensors)
        corrections = [records(self._columns(one)) for one in self.solutions]
        return plain(
            {
                "judgement": self.decision.to_dict(labels),
                "method": "without phase",
                "conventions": {**labels.conventions(), "phase": None},
                "corrections_refer_to": "the bare rotor, with every weight of the runs removed",
                "corrections": corrections[0],
                "solutions": [
                    {"chi_square": one.chi_square, "left_95": one.left, "corrections": rows}
                    for one, rows in zip(self.solutions, corrections, strict=True)
                ],
                "residuals": records((*readings, Column("before", before), Column("after", after))),
                "amplitudes": records(self._amplitudes()),
                "rms_before": rms(before),
                "rms_after": rms(after),
                "rms_after_95": self.decision.expected * scale,
                "chi_square": self.scatter.chi_square,
                "chi_square_dof": self.scatter.dof,
                "errors": {"amplitude_percent": 100 * self.scatter.relative, "origin": self.scatter.origin},
                "next_run": None
                if self.sound
                else {
                    "plane": self.next_run[0],
                    **labels.weight_entry(self.next_run[1]),
                    **({"hole": self.next_run[2]} if self.next_run[2] else {}),
                },
                "warnings": self.decision.warnings,
                "notes": self.decision.notes,
            }
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per solution and plane, with its 95 %."""
        number = np.repeat(np.arange(len(self.solutions)) + 1, len(self.planes))
        return frame((Column("solution", number), *self._columns(*self.solutions)))

    def _columns(self, *solutions: AmplitudeSolution) -> tuple[Column, ...]:
        """plane, mass, unit, angle_deg and their 95 % of each solution."""
        sign = np.array([-1.0 if plane in self.remove else 1.0 for plane in self.planes])
        D = np.concatenate([sign * one.weights for one in solutions])
        low, high, angle = np.hstack([one.intervals for one in solutions])
        scale = self.labels.weight_scale
        return (
            *weight_columns(self.labels, self.planes * len(solutions), D),
            Column("mass_low", low * scale, lambda mass: figures(mass, 2), title="from"),
            Column("mass_high", high * scale, lambda mass: figures(mass, 2), title="to (95 %)"),
            Column("angle_95_deg", np.degrees(angle), lambda width: f"± {width:.0f}°", title=""),
        )

    def _amplitudes(self) -> tuple[Column, ...]:
        """Every amplitude as it was read, and by the first solution."""
        first, R, scale = self.solutions[0], len(self.trials.runs), self.labels.vibration_scale
        fitted = np.abs(first.before + self.trials.weights @ first.effect.T)
        readings = reading_columns(self.labels, self.trials.speeds, self.trials.sensors)
        return (
            Column("run", np.repeat(self.trials.runs, len(first.before))),
            *(replace(one, values=tuple(one.values) * R) for one in readings),
            Column("read", np.abs(self.trials.mean).ravel() * scale, three_figures),
            Column("fitted", fitted.ravel() * scale, three_figures),
        )

    def sentence(self) -> str:
        """Whether to mount what, or which run to make."""
        if not self.sound:
            return "\n".join(self.decision.lines())
        labels = self.labels
        places = zip(self.planes, self.weights, strict=True)
        at = "; ".join(f"{labels.weight_at(weight)} in plane {plane!r}" for plane, weight in places)
        what = "Remove this material" if set(self.planes) <= set(self.remove) else f"Mount {at}"
        before, left = (x * labels.vibration_scale for x in (self.decision.before, self.decision.expected))
        words = f"rms {figures(before, 3)} → below {figures(left, 2)} {labels.vibration_in}".rstrip()
        return f"{what}: {words} with 95 %."

    @property
    def answer(self) -> Answer:
        """What to do, every solution with its 95 %, and the amplitudes behind it."""
        left = [f"{100 * one.left:.0f} %" if one.left < 10 else "anything" for one in self.solutions]
        leaves = Column("left", np.repeat(left, len(self.planes)), title="leaves at most")
        caption = (
            f"{self.labels.turning_in_words()}; amplitudes ± {percent(self.scatter.relative)} % "
            f"({self.scatter.origin}), {counted(len(self.solutions), 'solution')}."
        )
        table = text((*self._columns(*self.solutions), leaves), width=COLUMNS)
        return Answer(
            self.sentence(),
            f"{table}\n\n{capital(caption)}",
            self.decision.warnings,
            self.decision.notes,
            (text(self._amplitudes(), 3),),
            "every amplitude",
            to_mount=True,
        )


def balance_without_phase(
    trials: Trials,
    *,
    limits: Limits | None = None,
    row_weights: FloatArray | None = None,
    remove: Sequence[str] = (),
    holes: Mapping[str, Holes] | None = None,
) -> WithoutPhase:
    """Correct one or two planes by amplitudes alone.

    Parameters
    ----------
    trials
        Runs; phases of their readings are not used.
    limits
        Of the planes (P): largest weights, which are kept, and arcs, where nothing is mounted.
    row_weights
        How much each reading counts for the weights, (S, C), where no weights leave nothing at all of them.
    remove
        Planes where material is taken away.
    holes
        Of planes that have some: a further run has its weight in one of them.

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
    >>> abs(balance_without_phase(trials).weights - 0.8j) < 1e-6
    array([ True])
    """
    holes = holes or {}
    _check(trials, holes)
    a, (errors, scatter) = np.abs(trials.mean).reshape(len(trials.runs), -1), _errors(trials)
    N, P = a.shape[1], len(trials.planes)
    limits = limits or Limits.none(1, N, P)
    size, top = np.abs(trials.weights).max(axis=0), a.max(axis=0)
    T, a, errors = trials.weights / size, a / top, errors / top  # around 1
    fits = [Fit(T, *one) for one in zip(a.T, errors.T, strict=True)]
    scatter = scatter._replace(chi_square=sum(fit.chi_square[0] for fit in fits))
    if scatter.origin == "assumed" and scatter.dof >= SPARE * N and scatter.chi_square > 1e-6:
        factor = (scatter.chi_square / scatter.dof) ** 0.5
        scatter, errors = Scatter(ASSUMED * factor, "estimated", scatter.dof, scatter.dof), factor * errors
        fits = [Fit(T, *one) for one in zip(a.T, errors.T, strict=True)]
    limit, rng = scatter.limit(2 * P, POSSIBLE), np.random.default_rng(0)
    weights = (1.0 if row_weights is None else np.ravel(row_weights)) * top
    kept = choices([fit.minima(rng, limit) for fit in fits], weights, limit)
    every = np.array([[one.parameters for one in choice] for choice in kept])
    starts = best_weights(every, weights)
    alone = LEVEL ** (0.5 / P)  # of 2 P numbers that hold together
    alike = (
        common_weight(starts, T, a, errors, limit, scatter.limit(2, LEVEL), scatter.limit(1, alone))
        if P == 1
        else []
    )
    solutions, tail = list[AmplitudeSolution](), 0.0 if alike else (1 - alone) / 2

    for k, best in enumerate([one[0] for one in alike] or starts):
        nearest = np.linalg.norm(starts - best, axis=1).argmin()
        choice, x = kept[nearest], every[nearest]
        draws = np.stack([one.draws for one in choice], axis=1)
        if alike:
            _, inside, near = alike[k]
        else:
            near = best_weights(draws, weights)
            inside = near[Region.of(near, best).holds(near)]
        low, high = np.quantile(np.abs(near * size), (tail, 1 - tail), axis=0)
        angle = np.quantile(np.abs(np.angle(near * best.conj())), 1 - 2 * tail, axis=0)
        D = best * np.minimum(1.0, limits.max_weight / np.maximum(np.abs(best * size), _TINY))
        mounted = solutions[0].weights / size if solutions else D
        after, before = (draws[..., 0] + effects(draws) @ mounted) * weights, draws[..., 0] * weights
        share = np.linalg.norm(after, axis=1) / np.linalg.norm(before, axis=1).clip(_TINY)
        left = np.abs(1 - mounted / inside).max() if alike else np.quantile(share, (1 + LEVEL) / 2)
        solutions.append(
            AmplitudeSolution(
                D * size,
                sum(one.chi_square for one in choice),
                x[:, 0] * top,
                effects(x) * top[:, None] / size,
                inside * size,
                (low, high, angle),
                left,
            )
        )
    each = zip(trials.planes, trials.weights.T, strict=True)
    run = max(((plane, *_widest_gap(of, holes.get(plane))) for plane, of in each), key=lambda one: one[3])[:3]
    weak = chance((((a - a.mean(axis=0)) / errors) ** 2).sum(), a.size - N) > 1 - LEVEL
    decision = _decide(trials, solutions, scatter, limits, run, weak=weak)
    return WithoutPhase(trials, tuple(solutions), scatter, errors * top, decision, run, tuple(remove))


def _check(trials: Trials, holes: Mapping[str, Holes]) -> None:
    """Refuse what cannot be solved, with the runs that are missing."""
    T, P = trials.weights, len(trials.planes)
    if not 1 <= P <= 2 or not T.any(axis=0).all():
        raise ValueError("without phases one or two planes can be balanced, each with trial weights")
    silent = ~np.abs(trials.mean).any(axis=(0, 1))
    if silent.any():
        raise ValueError(f"sensor {trials.sensors[np.argmax(silent)]!r} reads 0 in every run: leave it out")
    different = len(np.unique(np.round(T / np.abs(T).max(), 9), axis=0))
    if different >= (3 if P == 1 else 7):
        return
    missing = [] if (T == 0).all(axis=1).any() else ["the rotor without weights"]
    for plane, of in zip(trials.planes, T.T, strict=True):
        while len(np.unique(np.round(np.angle(of[of != 0]), 6))) < 3:
            weight, hole, _ = _widest_gap(of, holes.get(plane))
            missing.append(f"{trials.labels.weight_at(weight)}{_there(hole)} in plane {plane!r}")
            of = np.append(of, weight)
    raise UndeterminedError(
        "without phases one plane needs four runs, a baseline and three trial weights at directions that "
        "span more than 90°, and two planes need seven, a baseline and three in each; there are "
        f"{different} with different weights. Missing: {listing(missing, 'and')}"
    )


def _there(hole: str) -> str:
    return hole and f" (hole {hole})"


def _widest_gap(weights: ComplexArray, holes: Holes | None) -> tuple[complex, str, float]:
    """A weight in the widest gap of one plane's weights, a third or half of the way; its hole; the gap, rad.

    As large as the largest; where there are holes, in the nearest one with a direction that no weight had.
    """
    angles = np.unique(np.round(np.angle(weights[weights != 0]), 6))
    gaps = np.diff([*angles, angles[0] + 2 * np.pi])
    k = np.argmax(gaps)
    direction, hole = np.exp(1j * (angles[k] + gaps[k] / (3 if len(angles) == 1 else 2))), ""
    if holes is not None:
        places = np.exp(1j * holes.angles)
        new = np.abs(places[:, None] - np.exp(1j * angles)).min(axis=1) > SAME_ANGLE
        if new.any():
            at = int(np.where(new, np.abs(places - direction), np.inf).argmin())
            direction, hole = places[at], holes.names[at]
    return complex(np.abs(weights).max() * direction), hole, gaps[k]


def _errors(trials: Trials) -> tuple[FloatArray, Scatter]:
    """One standard deviation of each amplitude (R, N), stated or assumed."""
    a, n, reading, run = np.abs(trials.mean), trials.repeats, trials.errors, trials.run_errors
    size, floor = (reading.amplitude, reading.floor) if reading else (0.0, 0.0)
    between, lowest = run or (0.0, 0.0)
    stated = any((size, floor, between, lowest))
    if not stated:
        between = ASSUMED
    square = (size**2 / n + between**2) * a**2 + floor**2 / n + lowest**2
    if trials.steps is not None:
        square = square + np.nanmean(trials.steps[0], axis=0) ** 2 / 12
    errors = np.maximum(np.sqrt(square), _LEAST * a.max(axis=0)).reshape(len(a), -1)
    dof = (len(a) - 1 - 2 * len(trials.planes)) * errors.shape[1]
    return errors, Scatter(np.hypot(size, between), "stated" if stated else "assumed", 0.0, dof)


def _contradiction(trials: Trials, scatter: Scatter) -> str:
    """Why the amplitudes are none of a linear rotor."""
    T, a = trials.weights, np.abs(trials.mean).reshape(len(trials.runs), -1)
    loaded = T.any(axis=1)
    if T.shape[1] == 1 and loaded.sum() == 3 and not loaded.all() and abs(T.sum()) < 1e-3 * np.abs(T).sum():
        mean, bare = (np.sqrt((a[of] ** 2).mean(axis=0)) for of in (loaded, ~loaded))
        i = np.argmin(mean / bare)
        if mean[i] < bare[i]:
            words = [trials.labels.amplitude_words(of[i]) for of in (mean, bare)]
            return (
                "the amplitudes are impossible: the root mean square of three equal trials at 120°, "
                f"{words[0]}, cannot be below the baseline's {words[1]}"
            )
    return (
        f"the amplitudes miss every linear rotor by {np.sqrt(scatter.chi_square / scatter.dof):.2g} "
        "times their errors"
    )


def _decide(
    trials: Trials,
    solutions: Sequence[AmplitudeSolution],
    scatter: Scatter,
    limits: Limits,
    run: tuple[str, complex, str],
    *,
    weak: bool,
) -> MountDecision:
    """Mount what leaves less than 0.9 of the present vibration by every solution, where it may stand."""
    labels, before, weights = trials.labels, rms(solutions[0].before), solutions[0].weights
    expected, cause, instead = before * max(one.left for one in solutions), "", ""
    each = zip(trials.planes, weights.tolist(), limits.forbidden, strict=True)
    forbidden = [repr(plane) for plane, D, arcs in each if not stands_in(D, allowed_sectors(arcs))]
    word: Literal["mount", "do not mount", "measure again"] = "do not mount"
    if scatter.origin != "estimated" and chance(scatter.chi_square, scatter.dof) < CONTRADICTION:
        word, cause = "measure again", _contradiction(trials, scatter)
        instead = "Measure these runs again, or mend the table."
    elif forbidden:
        cause = f"they stand where the job forbids weights, in plane {listing(forbidden, 'and')}"
    elif expected < HARDLY_BELOW * before:
        word = "mount"
    elif weak:
        cause = "the trial weights changed the readings by no more than their errors explain"
        instead = "Repeat the runs with heavier weights."
    else:
        cause = f"they may leave rms {labels.amplitude_words(float(f'{expected:.2g}'))} (95 %)"
        if len(solutions) > 1:
            cause = f"{counted(len(solutions), 'solution')} explain the readings"
        instead = f"Make this run: {labels.weight_at(run[1])}{_there(run[2])} in plane {run[0]!r} alone."
    note = (
        f"amplitudes are taken to scatter by {percent(ASSUMED)} % from run to run: state amplitude_percent "
        "in [errors] where it is known"
    )
    return MountDecision(
        word,
        cause,
        (instead,) if instead else (),
        before,
        expected,
        warnings=tuple(trials.warnings),
        notes=(note,) if scatter.origin == "assumed" else (),
    )
