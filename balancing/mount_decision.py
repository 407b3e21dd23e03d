"""Decision whether to mount a correction at all, and what to do instead.

With A = (Y₀ W) and z = (1, D) the mean square of N readings with the weights D mounted is zᴴ R z + zᴴ F z:
the prediction, R = Aᴴ A / N, and what the errors of A add on average, F = E[dAᴴ dA] / N, which grows with the
weights: those many times the trial weights, and those that fight each other, leave more than they take away.
Weights are not worth mounting

- where the errors add half or more of what is promised, zᴴ F z − F₀₀ ≥ (R₀₀ − zᴴ R z)/2;
- where fewer planes with weights a third as large leave hardly more;
- where 95 of 100 check runs stay only below 0.9 of the present vibration;
- where no weight is clear of its error, and 95 of 100 check runs stay only below 0.7 of it;
- where planes act alike within the errors: the answer is what is determined, and what would determine it all;
- where a run that was read, with its weights, is better than what is promised.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from balancing.conditioning import CLEAR, REMEDY, conditioning
from balancing.correction_result import Choice, Correction, MountDecision
from balancing.influence import in_order
from balancing.printed_readings import reading_names, rms
from balancing.weights_and_prediction import shown
from balancing.what_if import worse_elsewhere
from rotorid.base.text import capital, listing
from rotorid.regression import solution

if TYPE_CHECKING:
    from balancing.conventions import Labels
    from balancing.influence import Influence
    from balancing.trials import Limits
    from rotorid.base.arrays import ComplexArray, FloatArray

EATEN = 0.5
"""Share of the promised gain (mean square) that errors may eat."""
FIGHTING, HARDLY = 3.0, 0.1
"""Weights so many times larger than those of fewer planes, which leave hardly more (of the rms before)."""
HARDLY_BELOW = 0.9
"""Of the rms before: what 95 of 100 check runs must stay below."""
GOOD = 1 / 3
"""Of the rms before: what a run reads that may stay as it is."""
WEAK = 3.0
"""Effect of a trial weight in units of its errors: too small below."""
COARSE = 0.1
"""Of a reading: a digit that is one of few."""
_ALL = 4
_MORE = 1 + 1e-6
"""Above a limit by more than rounding."""


@dataclass(frozen=True, eq=False)
class Case:
    """What a correction is made of: its coefficients, those of all speeds and planes, what it must keep to.

    `part`, `today` with the vibration to correct as baseline; `row_weights` (N,) and `limits` of the part.
    """

    part: Influence
    today: Influence
    row_weights: FloatArray | None
    limits: Limits | None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the planes."""
        return self.part.planes

    @property
    def labels(self) -> Labels:
        """Units and conventions to print in."""
        return self.part.labels

    @property
    def W(self) -> ComplexArray:
        """Coefficients, (N, P)."""
        return self.part.W.reshape(-1, len(self.names))

    @cached_property
    def forms(self) -> tuple[ComplexArray, ComplexArray]:
        """R and F of the module, (P + 1, P + 1), readings by their weights."""
        N, P = self.W.shape
        w = np.ones(N) if self.row_weights is None else self.row_weights
        w = w / np.linalg.norm(w)
        A = w[:, None] * np.column_stack((self.part.baseline.ravel(), self.W))
        covariance = self.part.channels().reshape(N, P + 1, 2, P + 1, 2)
        V = np.einsum("n,nicjd->cdij", w**2, covariance)
        return np.asarray(A.conj().T @ A), V[0, 0] + V[1, 1] + 1j * (V[0, 1] - V[1, 0])

    @property
    def before(self) -> float:
        """Root mean square of the vibration to correct."""
        return float(np.sqrt(self.forms[0][0, 0].real))

    @property
    def effect(self) -> FloatArray:
        """Root mean square effect of a unit weight in each plane, (P,)."""
        return np.sqrt(np.diag(self.forms[0]).real[1:])

    @property
    def clearness(self) -> FloatArray:
        """Effect of each plane in units of its errors, (P,)."""
        return np.asarray(self.effect / np.sqrt(np.diag(self.forms[1]).real[1:].clip(1e-300)))

    @property
    def weak(self) -> list[int]:
        """Planes whose effect is not clear of its errors."""
        return [int(p) for p in np.flatnonzero(self.clearness < WEAK)]

    @property
    def max_weight(self) -> FloatArray:
        """Largest weight of each plane, (P,)."""
        return self.limits.max_weight if self.limits else np.full(len(self.names), np.inf)

    def choice(self, planes: Sequence[int], weights: ComplexArray | None = None) -> Choice:
        """Some of the planes, by least squares or with given weights."""
        (R, F), at = self.forms, [1 + p for p in planes]
        D = -solution(R[np.ix_(at, at)], R[at, 0]) if weights is None else weights
        z = np.zeros(len(R), dtype=complex)
        z[[0, *at]] = [1.0, *D]
        left, errors = (float(np.sqrt((z.conj() @ form @ z).real.clip(0.0))) for form in (R, F))
        return Choice(tuple(self.names[p] for p in planes), np.asarray(D), left, errors)

    def sound(self, choice: Choice) -> bool:
        """Whether errors leave most of what the weights promise."""
        more = choice.error**2 - self.forms[1][0, 0].real
        return bool(more <= 0 or more < EATEN * (self.before**2 - choice.rms**2))

    def strength(self, choice: Choice) -> float:
        """Root mean square effect of the largest weight."""
        at = [self.names.index(plane) for plane in choice.planes]
        return float((np.abs(choice.weights) * self.effect[at]).max())

    @cached_property
    def fewer(self) -> tuple[Choice, ...]:
        """Choices of fewer planes within the limits of weights: all of four planes, one left out of more."""
        P = len(self.names)
        every = (p for k in (range(1, P) if P <= _ALL else [P - 1]) for p in combinations(range(P), k))
        choices = [(self.choice(planes), list(planes)) for planes in every]
        kept = [c for c, planes in choices if (np.abs(c.weights) <= self.max_weight[planes]).all()]
        return tuple(sorted(kept, key=lambda c: c.expected))

    def trial_weight(self, p: int) -> float:
        """The largest one of a plane, kg; 0: there was none."""
        if (trials := self.today.trials) is None:
            return 0.0
        return float(np.abs(in_order(trials.weights, trials.planes, [self.names[p]])).max())

    def shown(self, size: float, digits: int = 3) -> str:
        """An amplitude with its unit."""
        return shown(self.labels, size, digits)

    @property
    def coarse(self) -> tuple[str, ...]:
        """That readings have hardly more than one digit; none: they have."""
        trials = self.today.trials
        if trials is None or trials.steps is None:
            return ()
        step, size = float(np.nanmedian(trials.steps[0])), rms(trials.mean)
        words = f"(steps of {self.shown(step, 2)}, readings of {self.shown(size, 2)})"
        return (f"the readings have one digit {words}",) if step >= COARSE * size else ()


def decide(result: Correction, case: Case, unclear: str, limits: Limits | None) -> MountDecision:
    """Whether to mount a correction, and what to do instead.

    Parameters
    ----------
    result
        The correction.
    case
        What it is made of.
    unclear
        That planes are not determined; empty where they are.
    limits
        Of all speeds and planes; None: none.
    """
    D, before = result.weights, case.before
    some = D.any()
    whole, fewer = case.choice(range(len(D)), D), case.fewer
    made = MountDecision(
        before=before, expected=whole.expected, choices=fewer, warnings=_contradicted(result)
    )
    calm = [c for c in fewer if c.expected <= whole.expected + HARDLY * before]
    fighting = any(case.strength(whole) >= FIGHTING * case.strength(c) for c in calm)
    bound = result.check_rms / rms(result.before) if result.errors_known else 0.0
    sound = case.sound(whole) and not fighting and (result.clear.any() or bound**2 <= 1 - EATEN)
    if sound and (better := _better_run(result, case, whole.rms)):
        return replace(made, word="do not mount", cause=better[0], instead=better[1:])
    if not some or (sound and bound <= HARDLY_BELOW):
        cause = result.combination or unclear.removesuffix(REMEDY)
        if cause and some:
            made = replace(made, word="determined in part", cause=cause, instead=remedies(case))
        there = case.today, in_order(D, case.names, case.today.planes), result.speeds
        elsewhere = worse_elsewhere(*there)
        warnings = (*made.warnings, *(() if elsewhere else _over_limit(*there, limits)))
        return replace(made, warnings=warnings, notes=case.coarse, elsewhere=elsewhere)
    promised = case.shown(whole.rms) if whole.rms > 1e-6 * before else "0"
    outlook = (
        f"with the weights, expect rms {case.shown(whole.expected)} rather than {promised}; without them "
        f"it is {case.shown(before)}"
    )
    if contradictions := case.today.remarks.contradictions:
        return replace(
            made,
            word="measure again",
            cause="; ".join((*contradictions, outlook)),
            instead=("Instead: mend the table, or measure these runs again until they agree.",),
        )
    causes = _causes(result, case)
    if sound:
        causes = [f"a check run may still show rms {case.shown(result.check_rms)} (95 %)"]
    instead = remedies(case)
    if result.combination:
        instead = (f"{capital(result.combination)}.", *instead)
    return replace(made, word="do not mount", cause="; ".join((*causes, outlook)), instead=instead)


def remedies(case: Case) -> tuple[str, ...]:
    """What to do instead of mounting weights in all the planes, in sentences with numbers.

    Parameters
    ----------
    case
        What weights would be made of.
    """
    weak, words = case.weak, []
    good = [c for c in case.fewer if case.sound(c) and c.expected < case.before]
    if good:
        best = good[0]
        planes = listing(map(repr, best.planes), "and")
        left, before = map(case.shown, (best.rms, case.before))
        words.append(
            f"weights in {planes} alone would leave about rms {left} of {before} (--planes "
            f"{','.join(best.planes)}, or use = false for others)"
        )
    words += [_trial(case, p) for p in weak if case.trial_weight(p)]
    if case.coarse:
        words.append("read the instrument in a range that shows more digits")
    if len(case.names) > 1 and not weak:
        planes = listing((repr(case.names[p]) for p in conditioning(case.W, ()).weakest), "and")
        words.append(f"add a sensor or a speed at which planes {planes} act differently")
    return tuple(f"{'Or' if i else 'Instead'}: {w}." for i, w in enumerate(words))


def _trial(case: Case, p: int) -> str:
    """A trial weight whose effect is clear of its error."""
    ratio, name = float(case.clearness[p]), case.names[p]
    needed, most = case.trial_weight(p) * CLEAR / ratio, float(case.max_weight[p])
    if needed > most:
        words = case.labels.weight_words(most)
        return f"leave plane {name!r} out: a clear trial weight would be larger than its largest, {words}"
    size = case.labels.weight_words(float(f"{needed:.2g}"))
    return f"repeat the trial run of plane {name!r} with {'at least' if ratio < 2 else 'about'} {size}"


def _causes(result: Correction, case: Case) -> list[str]:
    """What makes the weights uncertain: digits, trial weights, planes that act alike, or little to gain."""
    words, names, sizes = case.labels.weight_words, case.names, np.abs(result.weights)
    causes = list(case.coarse)
    widths = result.half_widths()[0]
    for p in case.weak:
        trial = case.trial_weight(p)
        of = f" of its trial weight ({words(trial)})" if trial else ""
        width = f" ± {words(float(f'{widths[p]:.2g}'))} (95 %)" if np.isfinite(widths[p]) else ""
        causes.append(
            f"the weight in plane {names[p]!r} is {words(float(sizes[p]))}{width}, for the effect{of} is "
            f"only {case.clearness[p]:.2g} times its error"
        )
    if not case.weak and len(names) > 1:
        alike, at = conditioning(case.W, ()).weakest, result.places(names, result.weights)
        each = " against ".join(f"{words(float(sizes[p]))} at {at[p]:.0f}°" for p in alike)
        planes = listing((repr(names[p]) for p in alike), "and")
        causes.append(f"planes {planes} act alike, and their weights fight each other ({each})")
    return causes or ["the weights promise little"]


def _better_run(result: Correction, case: Case, predicted: float) -> tuple[str, str] | None:
    """A run within the limits that reads less than is promised (95 %), and than predicted or `GOOD`."""
    trials, limits = case.today.trials, result.limits
    # with an index readings are of the arbor, too
    if trials is None or trials.index is not None or not result.errors_known:
        return None
    if trials.mean.shape[1:] != result.before.shape or trials.runs[-1] != result.mounted.run:
        return None
    largest = dict(zip(case.names, case.max_weight * _MORE, strict=True))
    read, weights = np.abs(trials.mean), np.abs(trials.weights)
    most = [largest.get(plane, 0.0) for plane in trials.planes]
    kept = (weights <= most).all(axis=1) & weights.any(axis=1)
    if limits is not None:
        kept &= (read <= limits.residual).all(axis=(1, 2))
    sizes = np.where(kept, np.sqrt(np.mean(read**2, axis=(1, 2))), np.inf)
    best = int(np.argmin(sizes))
    if sizes[best] >= min(result.check_rms, max(predicted, GOOD * rms(result.before))):
        return None
    cause = (
        f"leave those of run {trials.runs[best]!r} where they are, with which it reads rms "
        f"{case.shown(sizes[best])}; these promise only below {case.shown(result.check_rms, 2)} in 95 of 100 "
        "check runs"
    )
    strange = "; ".join(case.today.remarks.contradictions)
    if strange:
        return cause, f"The runs do not fit one linear machine: {strange}."
    return cause, "To promise less, add a run with other weights near these."


def _contradicted(result: Correction) -> tuple[str, ...]:
    fitted = result.fitted
    if fitted.explained or result.active or fitted.chi_square is None or not fitted.dof:
        return ()
    ratio = np.sqrt(fitted.chi_square / fitted.dof)
    return (
        f"weights in these planes leave {ratio:.2g} times what the errors explain: unbalance elsewhere, a "
        f"bow or nonlinearity (the ± allow for it), or larger errors than stated (± up to {ratio:.2g} times "
        "larger)",
    )


def _over_limit(
    today: Influence, weights: ComplexArray, used: FloatArray, limits: Limits | None
) -> tuple[str, ...]:
    """The largest reading that passes its limit with weights (P,) at speeds that were left out."""
    if limits is None:
        return ()
    new = np.abs(today.baseline + today.W @ weights)
    left_out = ~np.isin(today.speeds, used)[:, None]
    over = (left_out * (new > limits.residual * _MORE) * new).ravel()
    worst, names = np.argmax(over), reading_names(today.labels, today.sensors, today.speeds)
    size = today.labels.amplitude_words(over[worst])
    words = f"the vibration of {names[worst]} is predicted to pass its limit: {size}"
    return (words,) if over.any() else ()
