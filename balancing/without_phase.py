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

from balancing.amplitudes import Minima, covariances, drawn, minima, misfit, predicted
from balancing.conditioning import UndeterminedError, chance
from balancing.conventions import Labels
from balancing.correction import MountDecision
from balancing.decision import HARDLY_BELOW
from balancing.regions import LEVEL, Region, half_width
from balancing.tables import reading_columns, rms, three_figures, weight_columns
from balancing.trials import Trials
from rotorid.base.answer import COLUMNS, Answer, Answered
from rotorid.base.json import plain
from rotorid.base.tables import Column, frame, records, text
from rotorid.base.text import capital, counted, figures, listing, percent

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray

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
_FAR = 1e3
"""Times the trial weights: a weight that says that nothing is known."""
_DRAWS, _MOST, _LEAST = 1000, 32, 1e-3
"""Draws of each solution; solutions kept; least error of a reading, of the largest one of its sensor."""


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


class NextRun(NamedTuple):
    """A run that tells possible solutions apart: `weight` in `plane`, and the amplitudes of one reading.

    `reading` is its number, `expected` its amplitude by each solution.
    """

    plane: str
    weight: complex
    reading: int
    expected: FloatArray


@dataclass(frozen=True, eq=False)
class WithoutPhase(Answered):
    """Every correction that amplitudes allow, and whether to mount the first.

    Attributes
    ----------
    trials
        The runs, of the planes that are corrected.
    solutions
        All that are possible with 99 %, the best first.
    scatter
        How amplitudes err and how the best solution misses them.
    errors, limit
        Of each amplitude, (R, N); what of the misfit 95 % allow.
    in_line
        Whether the weights of all runs stand in one line.
    weak
        Whether no weight changed a reading by more than its errors explain.
    decision
        Whether to mount the weights, and what to do instead.
    next_run
        What would tell more; None where no run would.
    check, check_bounds
        Check runs, and what they should read at least and at most by the first solution, (2, R, S, C).
    remove
        Planes where material is taken away, opposite to the weight that would be added.
    """

    trials: Trials
    solutions: tuple[AmplitudeSolution, ...]
    scatter: Scatter
    errors: FloatArray
    limit: float
    in_line: bool
    weak: bool
    decision: MountDecision
    next_run: NextRun | None
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
    def warnings(self) -> tuple[str, ...]:
        """What contradicts."""
        return self.decision.warnings

    @property
    def notes(self) -> tuple[str, ...]:
        """Further remarks."""
        return self.decision.notes

    def holds(self, weights: ComplexArray) -> bool:
        """Whether weights (P,) lie in the 95 % region of a solution.

        For one plane also where one that leaves nothing misfits by no more than 95 % allow.
        """
        if any(one.region.holds(weights) for one in self.solutions):
            return True
        if len(self.planes) > 1:
            return False
        a = np.abs(self.trials.mean).reshape(len(self.trials.runs), -1)
        places = np.concatenate([weights, *(one.draws[:, 0] for one in self.solutions)])
        some = np.flatnonzero(a.any(axis=0))
        each = [misfit(self.trials.weights[:, 0], a[:, i], self.errors[:, i], places) for i in some]
        total = np.sum(each, axis=0)
        return bool(total[0] <= total.min() + self.limit)

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's own units and conventions; what is unknown is None."""
        labels, first = self.labels, self.solutions[0]
        after = np.abs(first.before + first.effect @ first.weights) * labels.vibration_scale
        before, run = first.before * labels.vibration_scale, self.next_run
        return plain(
            {
                "judgement": self.decision.to_dict(labels),
                "method": "without phase",
                "conventions": labels.conventions(),
                "corrections_refer_to": "the bare rotor, with every weight of the runs removed",
                "corrections": records(self._columns(first)),
                "solutions": [
                    {
                        "corrections": records(self._columns(one)),
                        "chi_square": one.chi_square,
                        "left_95": one.left,
                    }
                    for one in self.solutions
                ],
                "residuals": records((*self._readings(), Column("before", before), Column("after", after))),
                "amplitudes": records(self._amplitudes()),
                "rms_before": rms(before),
                "rms_after": rms(after),
                "rms_after_95": max(one.left for one in self.solutions) * rms(before),
                "chi_square": self.scatter.chi_square,
                "chi_square_dof": self.scatter.dof,
                "errors": {"amplitude_percent": 100 * self.scatter.relative, "origin": self.scatter.origin},
                "weights_in_one_line": self.in_line,
                "next_run": None
                if run is None
                else {"plane": run.plane, "unit": labels.weight_unit, **labels.weight_entry(run.weight)}
                | {"expected": run.expected * labels.vibration_scale},
                "check": None if self.check is None else records(self._check_columns()),
                "warnings": self.warnings,
                "notes": self.notes,
            }
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per solution and plane, with its 95 %."""
        import pandas as pd

        each = [frame(self._columns(one)).assign(solution=k) for k, one in enumerate(self.solutions, 1)]
        table = pd.concat(each, ignore_index=True)
        return table[["solution", *(name for name in table if name != "solution")]]

    def _columns(self, one: AmplitudeSolution) -> tuple[Column, ...]:
        """plane, mass, unit, angle_deg and their 95 %."""
        signs = np.array([-1.0 if plane in self.remove else 1.0 for plane in self.planes])
        low, high, angle = one.intervals()
        scale = self.labels.weight_scale
        return (
            *weight_columns(self.labels, self.planes, signs * one.weights),
            Column("mass_low", low * scale, lambda mass: figures(mass, 2), title="from"),
            Column("mass_high", high * scale, lambda mass: figures(mass, 2), title="to (95 %)"),
            Column("angle_95_deg", np.degrees(angle), lambda width: f"± {width:.0f}°", title=""),
        )

    def _readings(self) -> tuple[Column, Column]:
        return reading_columns(self.labels, self.trials.speeds, self.trials.sensors)

    def _amplitudes(self) -> tuple[Column, ...]:
        """Every amplitude as it was read, and by the first solution."""
        first = self.solutions[0]
        fitted = np.abs(first.before + self.trials.weights @ first.effect.T)
        return (*self._of_runs(self.trials), self._vibration("fitted", fitted))

    def _check_columns(self) -> tuple[Column, ...]:
        """Those of the check runs, and what they should be."""
        if self.check is None or self.check_bounds is None:
            return ()
        low, high = self.check_bounds
        return (*self._of_runs(self.check), self._vibration("lowest", low), self._vibration("highest", high))

    def _of_runs(self, trials: Trials) -> tuple[Column, ...]:
        speed, sensor = reading_columns(self.labels, trials.speeds, trials.sensors)
        R, N = len(trials.runs), len(sensor.values)
        return (
            Column("run", np.repeat(trials.runs, N)),
            replace(speed, values=tuple(speed.values) * R),
            replace(sensor, values=tuple(sensor.values) * R),
            self._vibration("read", np.abs(trials.mean)),
        )

    def _vibration(self, name: str, amplitudes: FloatArray) -> Column:
        return Column(name, amplitudes.ravel() * self.labels.vibration_scale, three_figures)

    @property
    def as_predicted(self) -> bool:
        """Whether every amplitude of the check runs lies where it was predicted to."""
        if self.check is None or self.check_bounds is None:
            return True
        read = np.abs(self.check.mean)
        return bool(np.all((self.check_bounds[0] <= read) & (read <= self.check_bounds[1])))

    def sentence(self) -> str:
        """Whether to mount what, or which run to make."""
        if self.check is not None:
            again = "add it to the runs, with its weights, and balance again"
            return (
                f"Check run: as predicted. To trim, {again}."
                if self.as_predicted
                else (f"Check run: not as predicted (--table): {again}.")
            )
        if not self.sound:
            return "\n".join(self.decision.lines())
        what = "Remove this material" if set(self.planes) <= set(self.remove) else "Mount"
        at = "; ".join(map(self._at, range(len(self.planes)))) if what == "Mount" else "as below"
        scale = self.labels.vibration_scale
        before, left = self.decision.before * scale, figures(self.decision.expected * scale, 2)
        words = f"rms {figures(before, 3)} → below {left} {self.labels.vibration_in}".rstrip()
        return f"{what} {at}: {words} with 95 %."

    def _at(self, p: int) -> str:
        return f"{self.labels.weight_at(self.weights[p])} in plane {self.planes[p]!r}"

    @property
    def answer(self) -> Answer:
        """What to do, every solution with its 95 %, and the amplitudes behind it."""
        rows: list[tuple[Column, ...]] = [self._columns(one) for one in self.solutions]
        merged = [
            Column(each[0].heading, [v for c in each for v in c.values], each[0].shown, title=each[0].title)
            for each in zip(*rows, strict=True)
        ]
        P = len(self.planes)
        leaves = [f"{100 * one.left:.0f} %" if one.left < 10 else "anything" for one in self.solutions]
        shown = [name for one in leaves for name in (one, *[""] * (P - 1))]
        merged.append(Column("left", shown, title="leaves at most"))
        origin = {"stated": "as stated", "estimated": "estimated from the runs"}.get(
            self.scatter.origin, "assumed"
        )
        caption = (
            f"{self.labels.turning_in_words()}; amplitudes ± {percent(self.scatter.relative)} % ({origin}), "
            f"{counted(len(self.solutions), 'solution')}"
        )
        tables = [text(self._amplitudes(), 3)]
        if self.check is not None:
            tables.append("Check run, 95 % of what was predicted:\n" + text(self._check_columns(), 3))
        return Answer(
            self.sentence(),
            "" if self.weak else f"{text(merged, width=COLUMNS)}\n\n{capital(caption)}.",
            self.warnings,
            self.notes,
            tuple(tables),
            "every amplitude",
            to_mount=True,
        )

    def figure(self) -> Figure:
        """Polar picture of the solutions with their regions and the weights of the runs."""
        from balancing.plots.polar import solutions_figure

        return solutions_figure(self)


class _Data(NamedTuple):
    """Amplitudes (R, N) around 1, errors, weights (R, P) around 1, what they were divided by, how they count.

    `some`: which of all readings they are.
    """

    a: FloatArray
    s: FloatArray
    T: ComplexArray
    top: FloatArray
    size: FloatArray
    rows: FloatArray
    some: BoolArray

    @property
    def relative(self) -> FloatArray:
        """Of amplitudes, (N,)."""
        return np.asarray((self.s / np.maximum(self.a, self.s)).mean(axis=0))

    def fits(self, within: float, runs: Sequence[int] | slice = slice(None)) -> list[Minima]:
        """All solutions of each reading."""
        T, a, s = self.T[runs], self.a[runs], self.s[runs]
        return [minima(T, a[:, i], s[:, i], within) for i in range(a.shape[1])]


class _Choice(NamedTuple):
    """One solution of each reading: its misfit, how far one weight is from leaving nothing, and which."""

    misfit: float
    unlike: float
    which: tuple[int, ...]


def balance_without_phase(
    trials: Trials,
    planes: Sequence[str] | None = None,
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
    planes
        At most two; default: all in which weights were mounted. Runs with weights elsewhere do not count.
    check
        Check runs, with their weights, to be compared with the first solution.
    max_weight
        Largest weight of each of these planes, kg or kg·m, (P,).
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
        No, or more than two planes, and readings that are all zero.

    Examples
    --------
    >>> runs, angles = ("0", "1", "2", "3"), np.radians([0, 0, 120, 240])
    >>> weights = (np.exp(1j * angles) * [0, 1, 1, 1])[:, None]
    >>> read = np.abs(weights - 0.8j)[..., None]
    >>> trials = Trials(runs, [100.0], ("fan",), ("P",), read, weights, amplitudes_only=True)
    >>> balance_without_phase(trials).weights.round(6)
    array([0.+0.8j])
    """
    trials, notes = _used(trials, planes)
    _enough(trials)
    data, scatter, fits, silent = _fitted(trials, row_weights)
    if silent:
        notes.append(f"sensor {listing(silent, 'and')} reads 0 in every run, and counts for nothing")
    if scatter.origin == "assumed":
        notes.append(
            f"amplitudes are taken to scatter by {percent(ASSUMED)} % from run to run: state "
            "amplitude_percent in [errors] where it is known"
        )
    P = len(trials.planes)
    limit = _limit(2 * P, scatter.estimated, POSSIBLE)
    contradiction = _contradiction(trials, data, scatter, fits)
    weak, in_line = _weak(data, fits), P == 1 and _in_line(trials.weights[:, 0])
    fits = [Minima(*(of[fit.chi_square <= fit.chi_square[0] + limit] for of in fit)) for fit in fits]
    chosen, alike = _choices(data, fits, limit)
    if not alike:
        notes.append("no single weight leaves nothing at every reading: the least of all is shown")
    largest = np.full(P, np.inf) if max_weight is None else np.asarray(max_weight) / data.size
    rng, every = np.random.default_rng(0), enumerate(fits)
    draws = [
        drawn(rng, data.T, data.a[:, i], data.s[:, i], fit, _DRAWS, scatter.estimated) for i, fit in every
    ]
    solutions, samples = _solutions(data, fits, chosen, draws, largest)
    run = _next_run(trials, data, samples, solutions, largest)
    cause = contradiction and ("measure again", contradiction)
    if not cause and weak:
        cause = "do not mount", "the trial weights changed the readings by no more than their errors explain"
    decision = _decide(trials, solutions, run, cause, notes, in_line=in_line)
    errors = np.full((len(data.a), data.some.size), np.inf)
    errors[:, data.some] = data.s * data.top
    bounds = None if check is None else _bounds(check, trials, data, samples[0], solutions[0].weights)
    return WithoutPhase(
        trials=trials,
        solutions=solutions,
        scatter=scatter,
        errors=errors,
        limit=_limit(2 * P, scatter.estimated, LEVEL),
        in_line=in_line,
        weak=weak,
        decision=decision,
        next_run=run,
        check=check,
        check_bounds=bounds,
        remove=tuple(remove),
    )


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


def _fitted(trials: Trials, row_weights: FloatArray | None) -> tuple[_Data, Scatter, list[Minima], list[str]]:
    """Amplitudes, errors and solutions of each reading, and the sensors that read nothing."""
    T, R = trials.weights, len(trials.runs)
    a = np.abs(trials.mean).reshape(R, -1)
    top, some = a.max(axis=0), np.asarray(a.any(axis=0))
    if not some.any():
        raise ValueError("every amplitude is 0: there is nothing to balance")
    silent = sorted({trials.sensors[i % len(trials.sensors)] for i in np.flatnonzero(~some)})
    errors, relative = _errors(trials)
    rows = np.ones(some.size) if row_weights is None else np.ravel(row_weights)
    a, s, top, rows = (of[..., some] for of in (a, errors.reshape(R, -1), top, rows))
    size = np.sqrt((np.abs(T) ** 2).sum(axis=0) / (T != 0).sum(axis=0))
    data = _Data(a / top, np.maximum(s / top, _LEAST), T / size, top, size, rows * top, some)
    fits = data.fits(60.0)
    spare = R - 1 - 2 * len(trials.planes)
    chi_square, dof = float(sum(fit.chi_square[0] for fit in fits)), spare * a.shape[1]
    if relative is not None or spare < SPARE or not chi_square:
        origin = "assumed" if relative is None else "stated"
        return data, Scatter(ASSUMED if relative is None else relative, origin, chi_square, dof), fits, silent
    factor = float(np.sqrt(chi_square / dof))
    fits = [Minima(fit.parameters, fit.chi_square / factor**2) for fit in fits]
    scatter = Scatter(ASSUMED * factor, "estimated", float(dof), dof, dof)
    return data._replace(s=data.s * factor), scatter, fits, silent


def _solutions(
    data: _Data, fits: list[Minima], chosen: list[_Choice], draws: list[FloatArray], largest: FloatArray
) -> tuple[tuple[AmplitudeSolution, ...], list[tuple[FloatArray, ComplexArray]]]:
    """Solutions of the job, and y and w of their draws around 1."""
    made, samples, mounted = list[AmplitudeSolution](), [], np.zeros(0)
    for choice in chosen:
        x = np.array([fits[i].parameters[b] for i, b in enumerate(choice.which)])
        some = np.array([draws[i][b] for i, b in enumerate(choice.which)]).swapaxes(0, 1)
        D = _best(x[None], data.rows, largest)[0]
        mounted = mounted if made else D
        y, w = some[..., 0], _effects(some)
        after = np.linalg.norm((y + w @ mounted) * data.rows, axis=1)
        left = after / np.linalg.norm(y * data.rows, axis=1).clip(1e-300)
        before, effect = np.zeros(data.some.size), np.zeros((data.some.size, len(D)), dtype=complex)
        before[data.some] = x[:, 0] * data.top
        effect[data.some] = _effects(x) * data.top[:, None] / data.size
        of, bound = _best(some, data.rows, largest) * data.size, float(np.quantile(left, (1 + LEVEL) / 2))
        made.append(AmplitudeSolution(D * data.size, choice.misfit, before, effect, of, bound))
        samples.append((y, w))
    return tuple(made), samples


def _effects(parameters: FloatArray) -> ComplexArray:
    """Complex w (…, P) of parameters (…, 1 + 2P)."""
    return np.asarray(parameters[..., 1::2] + 1j * parameters[..., 2::2])


def _used(trials: Trials, planes: Sequence[str] | None) -> tuple[Trials, list[str]]:
    """The runs that load no plane but these, and what to say of them."""
    loaded = [plane for plane, of in zip(trials.planes, trials.weights.T, strict=True) if of.any()]
    chosen = list(loaded if planes is None else planes)
    if unknown := [plane for plane in chosen if plane not in loaded]:
        raise ValueError(f"no run has a weight in plane {listing(map(repr, unknown), 'and')}")
    if not 1 <= len(chosen) <= 2:
        raise ValueError(
            f"without phases one or two planes can be balanced, not {len(chosen)}: choose with --planes"
        )
    at = [trials.planes.index(plane) for plane in chosen]
    other = np.delete(trials.weights, at, axis=1).any(axis=1)
    notes = (
        [f"{counted(int(other.sum()), 'run')} with weights in other planes left out"] if other.any() else []
    )
    if other.all():
        raise ValueError("every run has weights in other planes: choose these too")
    keep = np.flatnonzero(~other)

    def some(array: Any) -> Any:  # noqa: ANN401
        return None if array is None else np.take(array, keep, axis=array.ndim - 3)

    return replace(
        trials,
        runs=tuple(trials.runs[r] for r in keep),
        planes=tuple(chosen),
        readings=some(trials.readings),
        weights=trials.weights[keep][:, at],
        steps=some(trials.steps),
        covariance=some(trials.covariance),
        amplitudes_only=True,
    ), notes


def _enough(trials: Trials) -> None:
    """Refuse too few runs, with those that are missing."""
    T, P = trials.weights, len(trials.planes)
    different = len(np.unique(np.round(T / np.abs(T).max(), 9), axis=0))
    if different >= (3 if P == 1 else 7):
        return
    missing = []
    for plane, of in zip(trials.planes, T.T, strict=True):
        there = np.unique(np.round(np.angle(of[of != 0]) * 1e6) / 1e6) if of.any() else np.zeros(0)
        mass = float(np.abs(of).max())
        for _ in range(3 - len(there)):
            angles = np.sort(there)
            gaps = np.diff([*angles, angles[0] + 2 * np.pi])
            k = int(np.argmax(gaps))
            there = np.append(there, angles[k] + (gaps[k] / 3 if len(angles) == 1 else gaps[k] / 2))
            missing.append(f"{trials.labels.weight_at(mass * np.exp(1j * there[-1]))} in plane {plane!r}")
    if not (T == 0).all(axis=1).any():
        missing.insert(0, "the rotor without weights")
    need = "four runs: a baseline and three trial weights"
    if P == 2:
        need = "seven runs: a baseline and three trial weights in each plane"
    some = "" if P == 1 else ", which leave four solutions at each sensor"
    raise UndeterminedError(
        f"without phases {'one plane needs' if P == 1 else 'two planes need'} {need}, at directions that "
        f"span more than 90°; there are {counted(different, 'run')} with different weights{some}. Make the "
        f"missing {'run' if len(missing) == 1 else 'runs'}: {listing(missing, 'and')}"
    )


def _errors(trials: Trials) -> tuple[FloatArray, float | None]:
    """One standard deviation of each amplitude (R, S, C), and the relative one; None: 10 % are assumed."""
    a, n, reading, run = np.abs(trials.mean), trials.repeats, trials.errors, trials.run_errors
    size, floor = (0.0, 0.0) if reading is None else (reading.amplitude, reading.floor)
    between, lowest = (0.0, 0.0) if run is None else run
    digits = np.zeros(a.shape) if trials.steps is None else np.nanmean(trials.steps[0], axis=0) ** 2 / 12
    if not any((size, floor, between, lowest)):
        return np.sqrt((ASSUMED * a) ** 2 + digits), None
    square = (size**2 / n + between**2) * a**2 + floor**2 / n + lowest**2
    return np.sqrt(square + digits), float(np.hypot(size, between))


def _limit(n: int, dof: float, level: float) -> float:
    """Of the misfit of n numbers, with errors of so many degrees of freedom."""
    from scipy.special import fdtri

    return float(n * fdtri(n, min(dof, 1e9), level))


def _in_line(T: ComplexArray) -> bool:
    """Whether places stand in one line."""
    s = np.linalg.svd(np.column_stack((np.ones(len(T)), T.real, T.imag)) / [1, *[np.abs(T).max()] * 2])[1]
    return bool(s[-1] < 1e-6 * s[0])


def _choices(data: _Data, fits: list[Minima], limit: float) -> tuple[list[_Choice], bool]:
    """Solutions of all readings that go together, the best first; whether one weight does for all of them.

    A reading is y + w D with the common D; its distance from 0 counts in its errors. The choices are made
    reading by reading, of which the best are kept.
    """
    P, N = data.T.shape[1], len(fits)
    spread = [covariances(data.T, data.s[:, i], fit.parameters) for i, fit in enumerate(fits)]

    def unlike(which: tuple[int, ...]) -> float:
        if len(which) <= P:
            return 0.0
        x = np.array([fits[i].parameters[b] for i, b in enumerate(which)])
        D = _best(x[None], data.rows[: len(which)], np.full(P, np.inf))[0]
        left = x[:, 0] + (x[:, 1::2] + 1j * x[:, 2::2]) @ D
        G = np.zeros((2, 1 + 2 * P))
        G[0, 0], G[0, 1::2], G[0, 2::2], G[1, 1::2], G[1, 2::2] = 1.0, D.real, -D.imag, D.imag, D.real
        total = 0.0
        for i, b in enumerate(which):
            r = np.array([left[i].real, left[i].imag])
            total += float(r @ np.linalg.solve(G @ spread[i][b] @ G.T + 1e-12 * np.eye(2), r))
        return total

    kept = [_Choice(0.0, 0.0, ())]
    for fit in fits:
        longer = []
        for choice in kept:
            for b, chi_square in enumerate(fit.chi_square):
                which = (*choice.which, b)
                longer.append(_Choice(choice.misfit + float(chi_square), unlike(which), which))
        kept = sorted(longer, key=lambda one: one.misfit + one.unlike)[:_MOST]
    alike = chance(kept[0].unlike, 2 * (N - P)) >= CONTRADICTION
    if not alike:
        kept.sort(key=lambda one: one.misfit)
    least = kept[0].misfit + alike * kept[0].unlike
    return [one for one in kept if one.misfit + alike * one.unlike <= least + limit], alike


def _best(x: FloatArray, rows: FloatArray, largest: FloatArray) -> ComplexArray:
    """Weights (n, P) that leave least, by parameters (n, N, 1 + 2P), within the largest ones (P,)."""
    y, w = x[..., 0] * rows, (x[..., 1::2] + 1j * x[..., 2::2]) * rows[:, None]
    A = np.einsum("nip,niq->npq", w.conj(), w)
    b = -np.einsum("nip,ni->np", w.conj(), y)
    eye = np.eye(A.shape[-1])
    trace = np.einsum("npp->n", A.real)[:, None, None]
    D = np.linalg.solve(A + (1e-9 * trace + 1e-300) * eye, b[..., None])[..., 0]
    D *= np.minimum(1.0, _FAR / np.maximum(np.abs(D), 1e-300))
    if np.isinf(largest).all():
        return np.asarray(D)
    for _ in range(100 if len(eye) > 1 else 1):  # a plane at a time: what is left is convex
        for p in range(len(eye)):
            of = A[:, p, p].real + 1e-300
            D[:, p] = (b[:, p] - np.einsum("nq,nq->n", A[:, p], D) + A[:, p, p] * D[:, p]) / of
            D[:, p] *= np.minimum(1.0, largest[p] / np.maximum(np.abs(D[:, p]), 1e-300))
    return np.asarray(D)


def _odd_run(data: _Data, scatter: Scatter, unknowns: int) -> int | None:
    """The run that contradicts all others, if one does."""
    (R, N), chi_square, estimated = data.a.shape, scatter.chi_square, np.isfinite(scatter.estimated)
    rest = N * (R - 1 - unknowns)
    if rest < 1 or (not estimated and chance(chi_square, scatter.dof) >= CONTRADICTION):
        return None
    others = ([q for q in range(R) if q != r] for r in range(R))
    without = [sum(float(fit.chi_square[0]) for fit in data.fits(0.0, runs)) for runs in others]
    r = int(np.argmin(without))
    if not estimated:
        return r if chance(without[r], rest) > 1 - LEVEL else None
    gain = (chi_square - without[r]) * rest / max(without[r], 1e-12)
    return r if R * chance(gain, N, rest) < CONTRADICTION else None


def _contradiction(trials: Trials, data: _Data, scatter: Scatter, fits: list[Minima]) -> str:
    """Why the amplitudes are none of a linear rotor; empty where they may be."""
    odd = _odd_run(data, scatter, 1 + 2 * len(trials.planes))
    if odd is not None:
        return f"run {trials.runs[odd]!r} contradicts all others"
    if scatter.dof <= 0 or chance(scatter.chi_square, scatter.dof) >= CONTRADICTION:
        return ""
    a, T = np.abs(trials.mean).reshape(len(trials.runs), -1), trials.weights
    loaded = (T != 0).any(axis=1)
    around = T[loaded]
    if (
        T.shape[1] == 1
        and len(around) == 3
        and (~loaded).any()
        and abs(around.sum()) < 1e-3 * np.abs(around).sum()
    ):
        mean, bare = (np.sqrt((a[of] ** 2).mean(axis=0)) for of in (loaded, ~loaded))
        i = int(np.argmin(mean / np.maximum(bare, 1e-300)))
        if mean[i] < bare[i]:
            words = trials.labels.amplitude_words
            return (
                f"the amplitudes are impossible: the root mean square of three equal trials at 120°, "
                f"{words(float(mean[i]))}, cannot be below the baseline's {words(float(bare[i]))}"
            )
    off = np.array(
        [
            (predicted(data.T, fit.parameters[:1])[0][0] - data.a[:, i]) / data.s[:, i]
            for i, fit in enumerate(fits)
        ]
    )
    r = int(np.argmax((off**2).sum(axis=0)))
    ratio, run = np.sqrt(scatter.chi_square / scatter.dof), trials.runs[r]
    return f"the amplitudes miss every linear rotor by {ratio:.2g} times their errors, run {run!r} most"


def _weak(data: _Data, fits: list[Minima]) -> bool:
    """Whether no weight changed a reading by more than its errors explain."""
    clear = 0.0
    for i, fit in enumerate(fits):
        x, spread = fit.parameters[0], covariances(data.T, data.s[:, i], fit.parameters[:1])[0]
        for p in range(data.T.shape[1]):
            at = slice(1 + 2 * p, 3 + 2 * p)
            clear = max(clear, float(np.linalg.norm(x[at]) / np.sqrt(np.trace(spread[at, at]) / 2)))
    return clear < WEAK


def _next_run(
    trials: Trials,
    data: _Data,
    samples: list[tuple[FloatArray, ComplexArray]],
    solutions: Sequence[AmplitudeSolution],
    largest: FloatArray,
) -> NextRun | None:
    """The weight of one plane at which possible amplitudes differ most, in their errors."""
    share = max(_DRAWS // len(samples), 1)
    y = np.concatenate([one[0][:share] for one in samples])
    w = np.concatenate([one[1][:share] for one in samples])
    most = SHAKING * float(np.sqrt(((data.a * data.rows) ** 2).sum(axis=1).max()))
    best: tuple[float, int, complex, int] | None = None
    for p in range(data.T.shape[1]):
        for way in np.exp(2j * np.pi * np.arange(24) / 24):
            weight = min(1.0, float(largest[p])) * way
            read = np.abs(y + w[..., p] * weight)
            if np.quantile(np.sqrt(((read * data.rows) ** 2).sum(axis=1)), LEVEL) > most:
                continue
            tell = read.var(axis=0) / ((data.relative * read.mean(axis=0)) ** 2 + data.s.min(axis=0) ** 2)
            if best is None or tell.sum() > best[0]:
                best = float(tell.sum()), p, complex(weight), int(np.argmax(tell))
    if best is None:
        return None
    _, p, weight, i = best
    i, weight = int(np.flatnonzero(data.some)[i]), weight * data.size[p]
    expected = np.array([abs(one.before[i] + one.effect[i, p] * weight) for one in solutions])
    return NextRun(trials.planes[p], weight, i, expected)


def _decide(
    trials: Trials,
    solutions: Sequence[AmplitudeSolution],
    run: NextRun | None,
    wrong: tuple[Any, str] | Literal[""],
    notes: Sequence[str],
    *,
    in_line: bool,
) -> MountDecision:
    """Mount what leaves less than 0.9 of the present vibration by every possible solution."""
    before, labels = rms(solutions[0].before), trials.labels
    expected = before * max(one.left for one in solutions)
    instead, cause = list[str](), ""
    word: Literal["mount", "do not mount", "measure again"] = "do not mount"
    if wrong:
        word, cause = wrong
        again = word == "measure again"
        instead = [
            "Measure these runs again, or mend the table."
            if again
            else "Repeat the runs with heavier weights."
        ]
    elif expected < HARDLY_BELOW * before:
        word = "mount"
    else:
        cause = f"they may leave rms {labels.amplitude_words(float(f'{expected:.2g}'))} (95 %)"
        if len(solutions) > 1:
            cause = f"{counted(len(solutions), 'solution')} explain the readings"
        if in_line:
            cause = "the weights of all runs stand in one line, and its two sides cannot be told apart"
        if run is not None:
            words = f"Make this run: {labels.weight_at(run.weight)} in plane {run.plane!r} alone"
            if len(solutions) == 2:
                one, other = map(labels.amplitude_words, sorted(map(float, run.expected)))
                words += (
                    f"; {trials.sensors[run.reading % len(trials.sensors)]} then reads about {one} or {other}"
                )
            instead.append(f"{words}.")
    made = MountDecision(word, cause, tuple(instead), before, expected)
    return replace(made, warnings=tuple(trials.warnings), notes=tuple(notes))


def _bounds(
    check: Trials,
    trials: Trials,
    data: _Data,
    sample: tuple[FloatArray, ComplexArray],
    proposed: ComplexArray,
) -> FloatArray:
    """Lowest and highest amplitude that check runs should show, jointly with 95 %, (2, R, S, C)."""
    weights = np.zeros((len(check.runs), len(trials.planes)), dtype=complex)
    for p, plane in enumerate(trials.planes):
        if not check.planes:
            weights[:, p] = proposed[p] / data.size[p]
        elif plane in check.planes:
            weights[:, p] = check.weights[:, check.planes.index(plane)] / data.size[p]
    y, w = sample
    read = np.abs(y[:, None] + np.einsum("nip,rp->nri", w, weights))
    rng, least = np.random.default_rng(1), data.s.min(axis=0)
    read = np.abs(read + rng.standard_normal(read.shape) * np.hypot(data.relative * read, least)) * data.top
    tail = (1 - LEVEL) / 2 / read[0].size
    bounds = np.zeros((2, len(check.runs), data.some.size))
    bounds[:, :, data.some] = np.quantile(read, [tail, 1 - tail], axis=0)
    each = bounds.reshape(2, -1, len(trials.speeds), len(trials.sensors))
    speeds = [int(np.argmin(np.abs(trials.speeds - speed))) for speed in check.speeds]
    sensors = [trials.sensors.index(sensor) for sensor in check.sensors]
    return np.asarray(each[:, :, speeds][..., sensors])
