"""Decision whether to mount a correction at all, and what to do instead.

Mounted, the weights D leave Y₀ + W D, of which the errors of Y₀ and W are a part: with A = (Y₀ W), z = (1, D)
and the covariance of A at each reading, the mean square over N readings is

    E = |A z|²/N + zᴴ F z/N,   F = Σ E[dAᴴ dA]

(`balancing.solvers.error_propagation.error_form`). The first part is the prediction, the second grows with
the weights and with the errors of the coefficients: weights many times the trial weights, and weights that
fight each other, leave more than they take away. With B the mean square before, the weights are not worth
mounting where the errors eat half of what is promised,

    (zᴴ F z − F₀₀)/N ≥ (B − |A z|²/N)/2,

or where fewer planes with weights a third as large leave hardly more; nor where planes are not determined,
where 95 of 100 check runs stay only below hardly less than B, or where a run that was read with its weights
is below that already. In simulated jobs of one to four planes, with errors of up to 2 % and trial weights of
0.3 to 1.5 times the correction, few are told so, and what is proposed then truly leaves less than the weights
(`test_mount_decision.py`). The weighted fit is told so more often than least squares: where planes act alike
or readings are few, the most likely weights can be far larger than the true ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any, Literal

import numpy as np

from balancing.coefficients.baseline import Start
from balancing.coefficients.identifiability import REMEDY, acting_alike, resolution
from balancing.coefficients.influence import Influence
from balancing.coefficients.trial_effects import CLEAR, nonlinear
from balancing.data.conventions import Labels
from balancing.data.limits import Limits
from balancing.data.result_columns import rms
from balancing.solvers.error_propagation import error_form, region_radius
from balancing.solvers.regularised import ridge
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.text import figures, listing
from rotorid.regression import solution

Word = Literal["mount", "do not mount", "measure again"]

EATEN = 0.5
"""Share of the promised gain (mean square) that errors may eat."""
FIGHTING, HARDLY = 3.0, 0.1
"""Weights so many times larger than those of fewer planes, which leave hardly more (of the rms before)."""
HARDLY_BELOW = 0.9
"""Of the rms before: what 95 of 100 check runs must stay below."""
GOOD = 1 / 3
"""Of the rms before: what a run reads that may stay as it is."""
WORTH = 1.25
"""Of the rms before: what something else may leave at most (95 %) to be proposed."""
WEAK = 3.0
"""Below this, a trial weight is too small."""
COARSE = 0.1
"""Of a reading: a digit that is one of few."""
STRENGTHS = (0.03, 0.1, 0.3)
"""Of a ridge that is proposed."""
_ALL = 4


@dataclass(frozen=True, eq=False)
class Choice:
    """Weights in some of the planes, and what they leave.

    Attributes
    ----------
    planes, weights
        Names and least-squares weights of the bare rotor, K each.
    rms
        Of the predicted readings.
    error
        Of the readings by errors of the coefficients and of the vibration before, root mean square.
    """

    planes: tuple[str, ...]
    weights: ComplexArray
    rms: float
    error: float

    @property
    def expected(self) -> float:
        """Root mean square in a check run, errors included."""
        return float(np.hypot(self.rms, self.error))


@dataclass(frozen=True, eq=False)
class MountDecision:
    """One judgement of a correction.

    Attributes
    ----------
    word
        "mount", "do not mount" (errors eat what the weights promise, planes are not determined, or a run was
        better), or "measure again" (runs contradict each other besides).
    cause
        A clause; empty: nothing is wrong.
    instead
        What to do, in sentences.
    before, expected
        Root mean square without the weights, and in a check run with them, errors included.
    choices
        Fewer planes, the one with the smallest expected vibration first; those that keep the limits.
    """

    word: Word = "mount"
    cause: str = ""
    instead: tuple[str, ...] = ()
    before: float = 0.0
    expected: float = 0.0
    choices: tuple[Choice, ...] = ()

    def to_dict(self, labels: Labels) -> dict[str, Any]:
        """As JSON types, in the job's units."""
        scale = labels.vibration_scale
        return {
            "word": self.word,
            "cause": self.cause or None,
            "instead": list(self.instead),
            "rms_before": self.before * scale,
            "rms_expected": self.expected * scale,
            "fewer_planes": [
                {
                    "planes": list(c.planes),
                    "rms_after": c.rms * scale,
                    "rms_expected": c.expected * scale,
                    "largest_weight": float(np.abs(c.weights).max() * labels.weight_scale),
                }
                for c in self.choices
            ],
        }

    def lines(self) -> tuple[str, ...]:
        """Sentences; none for "mount"."""
        if self.word == "mount":
            return ()
        heads = {"do not mount": "Do not mount these weights", "measure again": "Measure again"}
        return (f"{heads[self.word]}: {self.cause}.", *self.instead)


@dataclass(frozen=True, eq=False)
class Inputs:
    """What the weights of a job are worth.

    Attributes
    ----------
    influence, start
        Coefficients and the vibration to correct.
    used, chosen
        Indices of speeds and planes.
    row_weights
        Of the readings used, (N,); None: all alike.
    limits
        Of these planes; None: no limits.
    """

    influence: Influence
    start: Start
    used: list[int]
    chosen: list[int]
    row_weights: FloatArray | None = None
    limits: Limits | None = None

    @property
    def before(self) -> float:
        """Root mean square of the vibration to correct."""
        return float(np.linalg.norm(self.forms[0][:, 0]))

    def sound(self, choice: Choice) -> bool:
        """Whether errors leave most of what the weights promise."""
        more = choice.error**2 - float(self.forms[1][0, 0].real)
        return more <= 0 or more < EATEN * (self.before**2 - choice.rms**2)

    def better_run(self, promised: float | None, predicted: float) -> tuple[str, float] | None:
        """Of the runs within the limits the best, and its rms, if that is less than promised (95 %).

        And less than predicted, or `GOOD`: bounds are wide where errors are assumed.
        """
        trials, S = self.influence.trials, len(self.influence.speeds)
        if promised is None or self.start.fresh or trials is None or len(trials.speeds) != S:
            return None
        if trials.sensors != self.influence.sensors:
            return None
        read, weights = np.abs(trials.mean[:, self.used]), np.abs(trials.weights)
        inside = np.array([plane in self.names for plane in trials.planes])
        kept = weights[:, inside].any(axis=1) & ~weights[:, ~inside].any(axis=1)
        if self.limits is not None:
            most = dict(zip(self.names, self.limits.max_weight * (1 + 1e-9), strict=True))
            kept &= (weights <= [most.get(plane, np.inf) for plane in trials.planes]).all(axis=1)
            kept &= (read <= self.limits.residual).all(axis=(1, 2))
        sizes = np.where(kept, np.sqrt(np.mean(read**2, axis=(1, 2))), np.inf)
        best = int(np.argmin(sizes))
        if sizes[best] >= min(promised, max(predicted, GOOD * rms(self.Y))):
            return None
        return trials.runs[best], float(sizes[best])

    def most(self, choice: Choice) -> float:
        """Root mean square that these weights leave at most with 95 %."""
        return float(choice.rms + region_radius(self.start.model.dof) * choice.error / np.sqrt(2))

    @property
    def names(self) -> tuple[str, ...]:
        """Of the planes."""
        return tuple(self.influence.planes[p] for p in self.chosen)

    @property
    def W(self) -> ComplexArray:
        """Coefficients (N, P)."""
        return np.asarray(self.influence.W[self.used][..., self.chosen].reshape(-1, len(self.chosen)))

    @property
    def Y(self) -> ComplexArray:
        """Vibration (N,)."""
        return np.asarray(self.start.readings[self.used].ravel())

    @cached_property
    def forms(self) -> tuple[ComplexArray, ComplexArray]:
        """R with |A z|²/N = |R z|², and F/N, both (P + 1, P + 1) or fewer rows, of the weighted readings."""
        w = np.ones(len(self.Y)) if self.row_weights is None else self.row_weights
        size = np.linalg.norm(w)
        A = w[:, None] * np.column_stack((self.Y, self.W)) / size
        n = A.shape[1]
        if self.start.covariance is None:
            return np.linalg.qr(A)[1], np.zeros((n, n), dtype=complex)
        index = np.concatenate([[0, 1], *([2 + 2 * p, 3 + 2 * p] for p in self.chosen)])
        own = self.start.covariance[self.used][..., index[:, None], index].reshape(-1, 2 * n, 2 * n)
        return np.linalg.qr(A)[1], error_form(own, w / size)

    def choice(self, planes: Sequence[int], weights: ComplexArray | None = None) -> Choice:
        """Some of the planes, by least squares or with given weights."""
        R, F = self.forms
        columns = [p + 1 for p in planes]
        found = -solution(R[:, columns], R[:, 0]) if weights is None else weights
        z = np.zeros(R.shape[1], dtype=complex)
        z[[0, *columns]] = [1.0, *found]
        error = float(np.sqrt(max(float(np.vdot(z, F @ z).real), 0.0)))
        return Choice(
            tuple(self.names[p] for p in planes), np.asarray(found), float(np.linalg.norm(R @ z)), error
        )

    def fewer(self) -> tuple[Choice, ...]:
        """Choices of fewer planes within the limits of weights: all of four planes, one left out of more."""
        P = len(self.chosen)
        sizes = range(1, P) if P <= _ALL else [P - 1]
        largest = np.full(P, np.inf) if self.limits is None else self.limits.max_weight
        found = []
        for planes in (p for k in sizes for p in combinations(range(P), k)):
            one = self.choice(planes)
            if (np.abs(one.weights) <= largest[list(planes)]).all():
                found.append(one)
        return tuple(sorted(found, key=lambda c: c.expected))

    def clearness(self) -> FloatArray:
        """Effect of each plane in units of its errors, (P,)."""
        R, F = self.forms
        error = np.sqrt(np.diag(F).real[1:])
        size = np.sqrt(np.sum(np.abs(R[:, 1:]) ** 2, axis=0))
        return np.asarray(np.where(error > 0, size / np.where(error > 0, error, 1.0), np.inf))

    def trial_weight(self, p: int) -> float | None:
        """The largest one of a plane, kg; None: there was none."""
        trials, name = self.influence.trials, self.names[p]
        if trials is None or name not in trials.planes:
            return None
        return float(np.abs(trials.weights[:, trials.planes.index(name)]).max()) or None


def decide_to_mount(
    inputs: Inputs,
    weights: ComplexArray,
    widths: FloatArray | None,
    *,
    soft: bool = False,
    remove: Sequence[str] = (),
    unclear: Sequence[str] = (),
    check_rms: float | None = None,
) -> MountDecision:
    """Whether to mount a correction, and what to do instead.

    Parameters
    ----------
    inputs
        The job.
    weights, widths
        Of all its planes, (P,), and half the 95 % intervals of their sizes; None: unknown.
    soft
        Whether they are those of a ridge or truncated.
    remove
        Planes where material is taken away.
    unclear
        Clauses that planes are not determined.
    check_rms
        Root mean square below which 95 of 100 check runs stay; None: unknown.
    """
    before = inputs.before
    whole = inputs.choice(range(len(weights)), weights)
    fewer = inputs.fewer()
    calm = [c for c in fewer if c.expected <= whole.expected + HARDLY * before]
    fighting = any(_effect(whole, inputs) >= FIGHTING * _effect(c, inputs) for c in calm)
    sound = inputs.sound(whole) and not fighting
    good = inputs.better_run(check_rms, whole.rms) if sound and weights.any() else None
    if good is not None and check_rms is not None:
        words = _leave(inputs, *good, check_rms)
        return MountDecision("do not mount", *words, before, whole.expected, fewer)
    sure = None if check_rms is None else check_rms / rms(inputs.Y)
    hardly = sure is not None and sure > HARDLY_BELOW
    if sure is not None and sure**2 < 1 - EATEN:
        unclear = ()  # what the weights leave together is well enough known
    if not weights.any() or (sound and not unclear and not hardly):
        return MountDecision("mount", before=before, expected=whole.expected, choices=fewer)
    contradictions = inputs.influence.contradictions
    instead: tuple[str, ...]
    if contradictions:
        instead = ("Instead: mend the table, or measure these runs again until they agree.",)
        cause = "; ".join((*contradictions, _outlook(whole, inputs)))
        return MountDecision("measure again", cause, instead, before, whole.expected, fewer)
    causes = [words.removesuffix(REMEDY) + "; their weights are not determined" for words in unclear]
    if not sound:
        causes = _causes(inputs, weights, widths, remove)
    elif hardly and check_rms is not None:
        causes.append(f"a check run may still show rms {_shown(inputs.start.labels, check_rms)} (95 %)")
    cause = "; ".join((*causes, _outlook(whole, inputs)))
    instead = remedies(inputs, fewer, soft=soft)
    return MountDecision("do not mount", cause, instead, before, whole.expected, fewer)


def _leave(inputs: Inputs, run: str, reads: float, promised: float) -> tuple[str, tuple[str, ...]]:
    """Cause and what to do instead where the weights of a run are better than what is promised."""
    labels, influence = inputs.start.labels, inputs.influence
    cause = (
        f"leave those of run {run!r} where they are, with which it reads rms {_shown(labels, reads)}; these "
        f"promise only below {_shown(labels, promised, 2)} in 95 of 100 check runs"
    )
    strange = "; ".join(influence.contradictions)
    if not strange and influence.trials is not None and influence.error_source != "stated":
        strange = nonlinear(influence.trials, influence.W)
    more = "To promise less, add a run with other weights near these."
    return cause, (f"The runs do not fit one linear machine: {strange}.",) if strange else (more,)


def remedies(inputs: Inputs, fewer: Sequence[Choice] | None = None, *, soft: bool = False) -> tuple[str, ...]:
    """What to do instead of mounting weights in all the planes, in sentences with numbers.

    Parameters
    ----------
    inputs
        The job.
    fewer
        Its choices of fewer planes, if they are known.
    soft
        Whether a ridge was tried.
    """
    weak = _weak(inputs)
    alike = len(inputs.chosen) > 1 and not weak
    best = _proposed(inputs.fewer() if fewer is None else fewer, inputs)
    words = [] if best is None else [f"{_only(best, inputs)} would leave {_left(best, inputs)}"]
    if alike and not soft:
        words += _ridge(inputs)
    words += [_trial(p, inputs) for p in weak if inputs.trial_weight(p)]
    if coarse(inputs.influence):
        words.append("read the instrument in a range that shows more digits")
    if alike:
        words.append(_separating(inputs))
    return tuple(f"{'Or' if i else 'Instead'}: {w}." for i, w in enumerate(words))


def _proposed(choices: Sequence[Choice], inputs: Inputs) -> Choice | None:
    """The sound one with the smallest 95 % bound, if that is not much above the vibration before."""
    sound = [c for c in choices if inputs.sound(c) and inputs.most(c) < WORTH * inputs.before]
    return min(sound, key=inputs.most, default=None)


def coarse(influence: Influence) -> tuple[str, ...]:
    """Say that readings have hardly more than one digit."""
    trials, labels = influence.trials, influence.labels
    if trials is None or trials.steps is None:
        return ()
    step = float(np.nanmedian(trials.steps[0]))
    size = rms(trials.mean)
    if step < COARSE * size:
        return ()
    steps, readings = _shown(labels, step, 2), _shown(labels, size, 2)
    return (f"the readings have one digit (steps of {steps}, readings of {readings})",)


def _shown(labels: Labels, size: float, digits: int = 3) -> str:
    return f"{figures(size * labels.vibration_scale, digits)} {labels.vibration_in}".rstrip()


def _effect(choice: Choice, inputs: Inputs) -> float:
    """Root mean square effect of the largest weight."""
    columns = [1 + inputs.names.index(p) for p in choice.planes]
    return float((np.abs(choice.weights) * np.linalg.norm(inputs.forms[0][:, columns], axis=0)).max())


def _weak(inputs: Inputs) -> list[int]:
    return [int(p) for p in np.flatnonzero(inputs.clearness() < WEAK)]


def _causes(
    inputs: Inputs, weights: ComplexArray, widths: FloatArray | None, remove: Sequence[str]
) -> list[str]:
    """What makes the weights uncertain: digits, trial weights, planes that act alike, or little to gain."""
    labels, names, weak = inputs.start.labels, inputs.names, _weak(inputs)
    found = list(coarse(inputs.influence))
    for p in weak:
        trial = inputs.trial_weight(p)
        of = "" if trial is None else f" of its trial weight ({labels.weight_words(trial)})"
        width = "" if widths is None else f" ± {labels.weight_words(float(f'{widths[p]:.2g}'))} (95 %)"
        found.append(
            f"the weight in plane {names[p]!r} is {labels.weight_words(abs(weights[p]))}{width}, for the "
            f"effect{of} is only {inputs.clearness()[p]:.2g} times its error"
        )
    if not weak and len(names) > 1:
        alike = acting_alike(inputs.W)
        mass, angle = labels.weight(weights)
        at = [f"{(angle[p] + 180 * (names[p] in remove)) % 360:.0f}°" for p in alike]
        each = [f"{figures(mass[p], 3)} {labels.weight_in}".rstrip() for p in alike]
        against = " against ".join(f"{m} at {a}" for m, a in zip(each, at, strict=True))
        planes = listing((repr(names[p]) for p in alike), "and")
        found.append(f"planes {planes} act alike, and their weights fight each other ({against})")
    return found or ["the weights promise little"]


def _outlook(whole: Choice, inputs: Inputs) -> str:
    labels, before = inputs.start.labels, inputs.before
    promised = _shown(labels, whole.rms) if whole.rms > 1e-9 * before else "0"
    return (
        f"with the weights, expect rms {_shown(labels, whole.expected)} rather than {promised}; without them "
        f"it is {_shown(labels, before)}"
    )


def _only(choice: Choice, inputs: Inputs) -> str:
    planes = listing(map(repr, choice.planes), "and")
    named = f"plane {planes} alone" if len(choice.planes) == 1 else f"only planes {planes}"
    mass = ", ".join(inputs.start.labels.weight_words(float(m)) for m in np.abs(choice.weights))
    return f"{named} (--planes {','.join(choice.planes)}; {mass})"


def _left(choice: Choice, inputs: Inputs) -> str:
    labels = inputs.start.labels
    return (
        f"rms {_shown(labels, choice.rms)}, at most {_shown(labels, inputs.most(choice))} with 95 %, of "
        f"{_shown(labels, inputs.before)}"
    )


def _ridge(inputs: Inputs) -> list[str]:
    if inputs.limits is not None and inputs.limits.any:
        return []
    planes = range(len(inputs.chosen))
    tried = [
        inputs.choice(planes, ridge(inputs.W, inputs.Y, s, inputs.row_weights).weights) for s in STRENGTHS
    ]
    best = _proposed(tried, inputs)
    if best is None:
        return []
    return [f"--ridge {STRENGTHS[tried.index(best)]:g} would leave {_left(best, inputs)}"]


def _trial(p: int, inputs: Inputs) -> str:
    """A trial weight whose effect is clear of its error."""
    now, ratio = inputs.trial_weight(p), float(inputs.clearness()[p])
    assert now is not None
    labels, name, needed = inputs.start.labels, inputs.names[p], now * CLEAR / ratio
    if inputs.limits is not None and needed > inputs.limits.max_weight[p]:
        most = labels.weight_words(float(inputs.limits.max_weight[p]))
        return f"leave plane {name!r} out: a clear trial weight would be larger than its largest, {most}"
    size = labels.weight_words(float(f"{needed:.2g}"))
    return f"repeat the trial run of plane {name!r} with {'at least' if ratio < 2 else 'about'} {size}"


def _separating(inputs: Inputs) -> str:
    """Readings that tell apart the planes that act alike: of a speed that was left out, or none."""
    influence = inputs.influence
    planes = [inputs.chosen[p] for p in acting_alike(inputs.W)]
    named = listing((repr(influence.planes[p]) for p in planes), "and")

    def apart(used: list[int]) -> float:
        part = influence.part(used, range(len(influence.sensors)), planes)
        n = len(planes)
        if part.covariance is None or part.W[..., 0].size < n:
            return 0.0
        covariance = part.covariance[..., 2:, 2:].reshape(-1, 2 * n, 2 * n)
        if not covariance.any():
            return 0.0
        return resolution(part.W.reshape(-1, n), covariance).ratio

    now = apart(inputs.used)
    others = {s: apart([s]) for s in range(len(influence.speeds)) if s not in inputs.used}
    best = max(others, key=lambda s: others[s], default=None)
    if best is not None and others[best] > max(2 * now, WEAK):
        speed = influence.labels.speed_words(influence.speeds[best])
        return (
            f"use {speed} too, a speed left out, where planes {named} are told "
            f"apart by {others[best]:.2g} times the errors (now {now:.2g})"
        )
    told = f" ({now:.2g} times the errors)" if now else ""
    return (
        f"add a sensor or a speed at which planes {named} act differently; none of the readings tells them "
        f"apart{told}"
    )
