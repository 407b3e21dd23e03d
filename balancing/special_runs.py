"""Runs of a rotor turned on its arbor (index balancing), and with trial weights that nobody knows.

**Index.**
The phase mark is the arbor's. At index θ the rotor stands turned by θ, with the rotation, and so do the
weights d on it:

    y(θ) = A + R e^{iθ} + W d e^{iθ} = Y₀ + R (e^{iθ} − 1) + W (d e^{iθ}),    Y₀ = A + R.

That is a rotor with one plane more, whose trial weight is e^{iθ} − 1 and whose coefficient is R: what fits
trial runs fits these, with its errors. No run need stand at index 0. Two positions, 0° and 180°, have the
closed form R = (y(0) − y(180))/2, A = (y(0) + y(180))/2. Weights on the rotor cannot mend its arbor: they are
to make |R + W d| small. A is all that turns with the arbor: its unbalance, the rotor's mass on a seat that
runs out, run-out of what the sensors see.

**Relative to a trial weight.**
Runs fit y = Y₀ + W T with T = 1 for such a weight, whatever it is. W is its effect then, and the correction D
the factor by which to change it: |D| times as heavy, arg D further with the rotation. Its errors are those of
the factor. A mass that is known makes a mass of |D|; where all angles are known, T has them, and D too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from textwrap import fill
from typing import Any, NamedTuple

import numpy as np

from balancing.conditioning import UndeterminedError, check_effects, check_runs
from balancing.correct import correct
from balancing.correction_result import Correction
from balancing.error_draws import Gaussian
from balancing.groups import mapped
from balancing.influence import Influence, Mounted, fit_runs
from balancing.printed_readings import three_figures
from balancing.trials import TRIAL_WEIGHTS, Relative, Trials
from rotorid.base.answer import COLUMNS
from rotorid.base.arrays import FloatArray
from rotorid.base.json import plain
from rotorid.base.tables import Column, records
from rotorid.base.text import figures, weight_unit_words

_SAME = 1e-6


class RotorAndArbor(NamedTuple):
    """Coefficients with what the rotor does alone as baseline, and with what its arbor does."""

    rotor: Influence
    arbor: Influence


def rotor_and_arbor(trials: Trials, stored: Influence | None = None) -> RotorAndArbor:
    """Rotor and arbor apart.

    Parameters
    ----------
    trials
        R runs with `index`, of at least two positions: without weights, and with one trial weight for each
        plane, or without weights alone where coefficients are stored.
    stored
        Coefficients at the speeds and of the sensors of the runs.

    Raises
    ------
    UndeterminedError
        For one position only, and for runs that do not tell rotor, arbor and trial weights apart.
    ValueError
        For trial weights beside stored coefficients.

    Returns
    -------
    RotorAndArbor
        Coefficients of weights on the rotor, with what the `rotor`, or the `arbor`, does alone as baseline.
    """
    turn = np.exp(1j * (np.zeros(1) if trials.index is None else trials.index))
    if np.abs(turn - turn[0]).max() < _SAME:
        raise UndeterminedError(
            "the rotor stood at one index only, which does not tell it from its arbor: turn it on the arbor, "
            "best by 180°, and measure again"
        )
    if stored is not None and trials.weights.any():
        raise ValueError(
            "runs at several indices with stored coefficients are runs without weights: leave these runs "
            "out, or the coefficients"
        )
    runs = (trials if stored is None else replace(trials, planes=(), weights=trials.weights[:, :0])).turned
    try:
        check_runs(runs.runs, runs.planes, runs.weights)
    except UndeterminedError:
        raise UndeterminedError(
            "these runs do not tell the rotor, its arbor and the trial weights apart: two runs without "
            "weights, at indices such as 0° and 180°, and one with a trial weight for each plane do"
        ) from None
    fitted = fit_runs(runs)
    W, planes = (fitted.W[..., 1:], trials.planes) if stored is None else (stored.W, stored.planes)
    P, labels = len(planes), (stored or fitted).labels
    shares = np.eye(len(runs.planes), 1 + P)[:, 1:].astype(complex)

    def part(*first: float) -> Influence:
        """The coefficients with this combination of Y₀ and R as baseline."""
        of = mapped(fitted, planes, shares, first)
        noise, on = of.errors.noise, trials.weights[-1]
        if stored is not None:
            noise, on = noise.plus(stored.errors.noise.changed(np.diag([0.0] + P * [1.0]))), np.zeros(P)
        errors = of.errors._replace(noise=noise, mounted=Mounted(trials.runs[-1], planes, on), trials=trials)
        return replace(of, W=W, errors=errors, labels=labels)

    rotor, arbor = part(0.0, 1.0), part(1.0, -1.0)
    if stored is None:
        check_effects(trials, W, rotor.channels(known=True), fitted.remarks.contradictions)
    if not arbor.baseline.any():  # a correction of nothing at all is refused
        arbor = replace(arbor, baseline=arbor.baseline + 1e-12 * np.abs(rotor.baseline).max())
    return RotorAndArbor(rotor, arbor)


def machine_influence(trials: Trials) -> Influence:
    """Coefficients of a calibrated balancing machine, whose readings are the unbalances of its planes: 1.

    Parameters
    ----------
    trials
        Its readings, kg·m; its sensors are named as the planes.

    Returns
    -------
    Influence
        Exact, without a baseline.
    """
    S, C = trials.mean.shape[1:]
    one = np.broadcast_to(np.eye(C, dtype=complex), (S, C, C))
    labels = trials.labels
    labels = replace(labels, weight_unit=labels.vibration_unit, weight_scale=labels.vibration_scale)
    nothing = np.full((S, C), np.nan + 0j)
    errors = Gaussian.none(S, C, C)
    return Influence(trials.speeds, trials.sensors, trials.sensors, one, nothing, errors, labels)


@dataclass(frozen=True, eq=False)
class ArborCorrection(Correction):
    """A correction of the rotor alone, with its unbalance and that of its arbor.

    Attributes
    ----------
    unbalances
        Weights that do what the rotor does, and what its arbor does, with their draws.
    """

    unbalances: tuple[Correction, ...] = ()

    def _what(self) -> str:
        return f"{super()._what()} {'from' if 'Remove' in super()._what() else 'on'} the rotor"

    def _left(self) -> str:
        return f"{super()._left()}, beside the arbor's part"

    def _weights_text(self) -> str:
        words = (
            "Unbalance of the arbor, and all run-out that turns with it, which no index tells from it, "
            f"{self.labels.weight_in}: {self.unbalances[1].in_words()}."
        )
        return f"{super()._weights_text()}\n{fill(words, COLUMNS)}"

    def to_dict(self) -> dict[str, Any]:
        """That of the correction with rotor_unbalance and arbor_unbalance."""
        rotor, arbor = (records(part._weight_columns()[:6]) for part in self.unbalances)
        return super().to_dict() | plain({"rotor_unbalance": rotor, "arbor_unbalance": arbor})


def with_arbor(result: Correction, both: RotorAndArbor) -> ArborCorrection:
    """The correction of a rotor, with the unbalances of rotor and arbor.

    Parameters
    ----------
    result
        Correction of `both.rotor`.
    both
        From `rotor_and_arbor`.

    Returns
    -------
    ArborCorrection
        Whose JSON has rotor_unbalance and arbor_unbalance.
    """
    at = result.planes, result.speeds
    opposite = (correct(part, None, *at, refuse=False) for part in both)
    unbalances = tuple(replace(c, weights=-c.weights, draws=-c.draws) for c in opposite)
    return ArborCorrection.of(result, unbalances=unbalances)


@dataclass(frozen=True, eq=False)
class RelativeCorrection(Correction):
    """A correction whose weights are multiples of the trial weight of their plane.

    Attributes
    ----------
    relative
        What is known of these trial weights.
    """

    relative: Relative = Relative(True, {}, "")  # noqa: RUF009

    @property
    def parts(self) -> None:
        """Weights that are multiples of different trial weights have no static part."""

    def _what(self) -> str:
        if len(self.planes) > 1:
            return super()._what()
        (place,), times = self._places(self), three_figures(abs(self.weights[0]))
        if self.relative.angle and not self.remove:
            return f"Move the trial weight by {place} and take {times} times as much"
        start = " from its place" if self.relative.angle else ""
        return f"{'Remove' if self.remove else 'Mount'} {times} {TRIAL_WEIGHTS}, {place}{start}"

    def _masses(self) -> FloatArray:
        """In the unit of the trial weights, (P,); NaN: not known."""
        return np.abs(self.weights) * [self.relative.sizes[plane] for plane in self.planes]

    def _sizes(self) -> tuple[Column, ...]:
        masses = Column("mass", self._masses(), figures, title=weight_unit_words(self.relative.unit))
        times = Column("times", np.abs(self.weights), three_figures)
        return (times,) if np.isnan(self._masses()).all() else (times, masses)

    def _places(self, of: Correction) -> list[str]:
        if not self.relative.angle:
            return super()._places(of)
        turns = of.labels.with_rotation(_turns(of)).tolist()
        return [f"{abs(turn):.0f}° {'with' if turn >= 0 else 'against'} the rotation" for turn in turns]

    @property
    def _counting(self) -> str:
        return f"{TRIAL_WEIGHTS}; {'angles from it' if self.relative.angle else super()._counting}"

    def _weight_columns(self) -> tuple[Column, ...]:
        plane, times, _, angle, std, angle_std, *last, at = super()._weight_columns()
        nothing = np.full(len(self.planes), np.nan)
        turn = Column("turn_deg", nothing)
        if self.relative.angle:
            turn = replace(turn, values=_turns(self))
            angle, at = (replace(column, values=nothing) for column in (angle, at))
        masses = self._masses()
        return (
            plane,
            replace(times, values=masses),
            Column("unit", [self.relative.unit] * len(masses)),
            angle,
            replace(std, values=masses * std.values / np.abs(self.weights)),
            angle_std,
            replace(times, heading="times_trial"),
            replace(std, heading="times_trial_std"),
            turn,
            *last,
            at,
        )

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; what only a known trial weight would tell is None."""
        relative = ["mass", "angle"] if self.relative.angle else ["mass"]
        return super().to_dict() | {"relative_to_trial_weight": relative}


def _turns(of: Correction) -> FloatArray:
    """How far to move trial weights, degrees as the job counts them, -180 … 180, (P,)."""
    return (of.places(of.planes, of.weights) + 180) % 360 - 180


def relative_to(result: Correction, relative: Relative) -> RelativeCorrection:
    """A correction of runs whose weights are multiples of trial weights, told as such.

    Parameters
    ----------
    result
        The correction.
    relative
        `Trials.relative` of the runs.

    Returns
    -------
    RelativeCorrection
        Whose JSON has times_trial and turn_deg of every plane.
    """
    nothing = Mounted("", (), np.zeros(0, dtype=complex))
    return RelativeCorrection.of(result, relative=relative, mounted=nothing)
