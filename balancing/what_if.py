"""What given weights leave: at every reading, and where they make it worse.

With weights D a reading is predicted as Y₀ + W D. A check run differs from that by what Y₀ and W err by, and
by its own errors, those of a reading and those of its run. Draws of all give ±, the radius around the
predicted vector within which 95 of 100 check runs read, and what the root mean square of a check run stays
below; they are those of a correction of the same weights.

Whether a reading that weights were not made for gets worse is asked of the truth, without the errors of a
further run: it does where |Y₀ + W D| less its radius is above |Y₀| with its radius, both radii at 1 − 0.05/N
for N readings, so that of 20 jobs at most one is warned of what does not rise.

**A mode that no reading shows.**
Readings y = A u of an unbalance u, spread along the shaft, determine only some of u. With independent
normal unbalances of one size at all nodes what else it may be is drawn as it is after the readings,
u + A⁺ (y − A u); their size is that of y, as one reading tells it (χ²). The readings are taken at their word:
what they err by is in the weights as well, and goes with them. Near its critical speed a mode reads b u, and
b u + b D with the weights mounted. It is worse where that is the larger one in at least 95 of 100 draws. Gain
and phase between model and machine are those that make its coefficients the job's; a model that does not
agree with these says nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from balancing.influence import Influence, match_speeds, plane_indices
from balancing.printed_readings import largest_readings, rms, small, three_figures
from balancing.regions import LEVEL, half_width, reach, real_parts
from balancing.trials import Trials
from balancing.weights_and_prediction import Outlook
from rotorid.base.answer import Answer, Answered
from rotorid.base.json import plain
from rotorid.base.tables import Column, records, text
from rotorid.base.text import capital, figures

if TYPE_CHECKING:
    from rotorid.base.arrays import ComplexArray, FloatArray

DRAWS = 400
BETTER = 0.9
"""Of the rms of the bare rotor: what 95 of 100 check runs must stay below."""
RISES = 0.1
"""Of the largest reading: a smaller rise is not worth a word."""
ROTORS = 2000
BESIDE = 0.98
"""Of a critical speed: where damping is small, a mode reads much there, and not without bound."""
SEEN = 1e-3
"""Effect of an unbalance, of the largest, that readings tell."""
AGREES = 0.95
"""Correlation of the model's coefficients with those of the job."""
Word = Literal["better", "worse", "hardly different", "not judged"]
Look = Callable[["ComplexArray", "ComplexArray"], object]


@dataclass(frozen=True, eq=False)
class WhatIf(Outlook, Answered):
    """Vibration that given weights would leave.

    Attributes
    ----------
    influence, weights, after_covariance, check_rms, remove
        As of `balancing.Correction`.
    rms_within
        Half width of the 95 % interval of the rms of a check run; NaN where errors are unknown.
    word
        Better than the bare rotor by the rule of a correction, or worse in 95 of 100 check runs.
    worse
        Where they make it worse besides, in sentences.
    """

    rms_within: float
    word: Word
    worse: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's own units and conventions; what is unknown is None."""
        scale, remarks = self.labels.vibration_scale, self.influence.remarks
        return plain(
            {
                "word": self.word,
                "weights_refer_to": "the bare rotor, with every weight of the runs removed",
                "weights": self.work_rows(self.planes, self.weights),
                "residuals": records(self.columns()),
                "rms_before": rms(self.before) * scale,
                "rms_after": rms(self.after) * scale,
                "rms_within": self.rms_within * scale,
                "rms_after_95": self.check_rms * scale,
                "worse_elsewhere": self.worse,
                "warnings": remarks.warnings,
                "notes": remarks.notes,
            }
        )

    @property
    def answer(self) -> Answer:
        """Better or worse, and what the weights are; then every reading."""
        labels, remarks = self.labels, self.influence.remarks
        scale, unit = labels.vibration_scale, labels.vibration_in
        old = rms(self.before) * scale
        left, bound = f"{three_figures(old)} → {small(rms(self.after) * scale, old)}", " (errors unknown)"
        if self.errors_known:
            left += f" ± {figures(self.rms_within * scale, 2)}"
            bound = f", below {three_figures(self.check_rms * scale)} in ≥ 95 of 100 check runs"
        each = self.work_words(self.planes, self.weights)
        first = f"{capital(self.word)} on the bare rotor: rms {left} {unit}".rstrip() + f"{bound}."
        on = f"On the bare rotor: {'; '.join(each) or 'nothing'}; {labels.turning_in_words()}."
        shown = f"Bare rotor, and with these weights, {unit}".rstrip(" ,")
        table = f"{shown}:\n{text(self.columns(), left=2)}"
        largest = largest_readings(labels, self.speeds, self.sensors, self.before, self.after, self.within)
        return Answer(
            "\n".join((first, *self.worse)),
            f"{on}\nLargest{largest}",
            remarks.warnings,
            remarks.notes,
            (table,),
            "every reading",
            to_mount=True,
        )

    def columns(self) -> tuple[Column, ...]:
        """One row a reading: before, after, and the radius around it that holds 95 of 100 check runs."""
        within = Column("within", self.within.ravel(), lambda width: f"± {figures(width, 2)}", title="95 %")
        return (*self.vibration_columns(), *([within] if self.errors_known else []))


def what_if(
    influence: Influence,
    weights: Mapping[str, complex],
    baseline: Trials | ArrayLike | None = None,
    speeds: ArrayLike | None = None,
    remove: Sequence[str] = (),
) -> WhatIf:
    """Predict what given weights leave, and how far check runs may be from that.

    Parameters
    ----------
    influence
        Coefficients, from `estimate_influence` or stored.
    weights
        All that would be mounted on the bare rotor, kg or kg·m, angle with the rotation, by plane; the others
        are empty.
    baseline
        As of `correct`.
    speeds
        rad/s, that count; default all. At the others the answer says where the weights make it worse.
    remove
        Planes where material is taken away instead of added.

    Returns
    -------
    WhatIf
        The same prediction as that of a `Correction` of these weights.

    Raises
    ------
    ValueError
        For an unknown plane or speed, and a missing or unfit baseline.
    """
    today = todays(influence, baseline)
    D = np.zeros(len(today.planes), dtype=complex)
    if weights:
        D[plane_indices(today, list(weights))] = list(weights.values())
    used = match_speeds(speeds, today.speeds)
    part = today.part(used)
    (covariance, sizes), before = check_run_spread(part, D), rms(part.baseline)
    low, bound = np.quantile(sizes, (1 - LEVEL, LEVEL)).tolist()
    width = float(half_width(sizes - rms(part.baseline + part.W @ D)))
    word: Word = "better" if bound <= BETTER * before else "worse" if low > before else "hardly different"
    return WhatIf(
        part,
        D,
        covariance,
        bound,
        width,
        "not judged" if np.isnan(bound) else word,
        worse_elsewhere(today, D, part.speeds),
        remove=tuple(plane for plane in today.planes if plane in remove),
    )


def todays(influence: Influence, baseline: Trials | ArrayLike | None) -> Influence:
    """Coefficients with the vibration to correct, that of a baseline or their own."""
    today = influence.rebased(baseline)
    if not today.has_baseline:
        raise ValueError("there is no vibration to correct or explain: give the readings of a baseline run")
    return today


def check_readings(
    influence: Influence, weights: ComplexArray, look: Look = lambda *_: None
) -> Iterator[ComplexArray]:
    """How far check runs with weights (P,) are off, blocks (B, S, C) of draws; none: errors are unknown.

    `look` is shown the draws (Y₀, W), block by block.
    """
    after = influence.baseline + influence.W @ weights
    for (Y, W), more in zip(influence.draws(DRAWS), influence.further(after, weights, DRAWS), strict=False):
        look(Y, W)
        yield Y + W @ weights + more - after


def check_run_spread(
    influence: Influence, weights: ComplexArray, *look: Look
) -> tuple[FloatArray, FloatArray]:
    """Covariance (S, C, 2, 2) of check runs with weights (P,), and rms of each; NaN: errors are unknown.

    The one draw in twenty that is farthest off counts as if it were as far as the next: where errors of runs
    are hardly known, one in four hundred may be off by more than all others together.
    """
    after, at = influence.baseline + influence.W @ weights, LEVEL * (DRAWS - 1)
    few, sizes, squares = DRAWS - int(at), [], np.zeros((*after.shape, 2, 2))
    far, blocks = np.zeros((0, *after.shape), dtype=complex), check_readings(influence, weights, *look)
    while more := [*islice(blocks, few)]:
        sizes += [np.linalg.norm(after + off, axis=(1, 2)) for off in more]
        off = np.concatenate((far, *more))
        for here, square in zip(off.swapaxes(0, 1), squares, strict=True):  # in place, speed by speed
            here[:] = np.take_along_axis(here, np.argpartition(np.abs(here), -few, axis=0), axis=0)
            square += _squares(here[:-few])
        far = off[-few:].copy()
    if not sizes:
        return np.nan * squares, np.array([np.nan])
    size = np.abs(far)
    near = np.minimum(1.0, np.quantile(size, at % 1 / (few - 1), axis=0) / (size + 1e-300))
    # what a normal complex number loses by this
    return (squares + _squares(near * far)) / (LEVEL * DRAWS), np.concatenate(sizes) / np.sqrt(after.size)


def _squares(off: ComplexArray) -> FloatArray:
    """Squares and products of both parts of (n, …), summed: (…, 2, 2)."""
    parts = real_parts(off[..., None])
    return np.asarray(np.einsum("n...i,n...j->...ij", parts, parts))


def worse_elsewhere(today: Influence, weights: ComplexArray, used: FloatArray) -> tuple[str, ...]:
    """A sentence about what weights clearly make worse at a speed they were not made for, or none.

    Parameters
    ----------
    today
        At all speeds, with the vibration of the bare rotor.
    weights
        On the bare rotor, (P,).
    used
        Speeds that they were made for, rad/s.
    """
    other = ~np.isin(today.speeds, used)
    N = np.count_nonzero(other) * len(today.sensors)
    if not (N and weights.any() and today.known_errors):
        return ()
    changes = np.append(1, 0 * weights), np.append(1, weights)
    old, new = np.abs(today.baseline), np.abs(today.baseline + today.W @ weights)
    noises = (today.errors.noise.changed(change[None]) for change in changes)
    before, after = (reach(noise.covariance(today.errors.sizes)) for noise in noises)
    of_all = np.sqrt(np.log((1 - LEVEL) / N) / np.log(1 - LEVEL))
    rise = np.where(other[:, None] & (new - old > of_all * (before + after)), new - old, 0.0)
    s, c = divmod(int(np.argmax(rise)), len(today.sensors))
    if rise[s, c] <= RISES * old.max():
        return ()
    labels, scale = today.labels, today.labels.vibration_scale
    low, high = three_figures(old[s, c] * scale), three_figures(new[s, c] * scale)
    change = f"{low} → {high} ± {figures(after[s, c] * scale, 2)} {labels.vibration_in}".rstrip()
    return (
        f"But at {labels.speed_words(today.speeds[s])} these weights, which were not made for that, make it "
        f"worse: {today.sensors[c]} {change}.",
    )


def mode_made_worse(
    outlook: Outlook,
    model: Callable[[Mapping[str, int], FloatArray], Influence],
    nodes: Mapping[str, int],
    levers: Mapping[str, float],
    count: int,
    critical: float,
) -> tuple[str, ...]:
    """A sentence about the mode of a critical speed, which weights make worse by the model, or none.

    Parameters
    ----------
    outlook
        Weights, and the readings that they are made of.
    model
        Coefficients per unbalance of the same sensors, of nodes by name, at speeds in rad/s.
    nodes
        Of each plane.
    levers
        m, of planes whose weights are masses.
    count
        How many nodes there are.
    critical
        rad/s, beyond all readings.

    Returns
    -------
    One sentence; none where fewer than 95 of 100 rotors that read the same get worse.
    """
    shaft = {str(node): node for node in range(1, count + 1)}
    W = model(shaft, np.append(outlook.speeds, BESIDE * critical)).W
    planes = W[..., [nodes[plane] - 1 for plane in outlook.planes]]
    planes = planes * [levers.get(plane, 1.0) for plane in outlook.planes]
    here, there = planes[:-1].ravel(), outlook.influence.W.ravel()
    common = np.vdot(here, there)
    if abs(common) < AGREES * np.linalg.norm(here) * np.linalg.norm(there) or not outlook.weights.any():
        return ()
    scale = common / np.linalg.norm(here) ** 2
    A, b, y = scale * W[:-1].reshape(-1, count), scale * W[-1], outlook.before.ravel()
    added = scale * planes[-1] @ outlook.weights
    rng = np.random.default_rng(0)
    u = rng.standard_normal((ROTORS, count, 2)) @ [1, 1j] * np.linalg.norm(y) / np.linalg.norm(A)
    u = u / np.sqrt(rng.chisquare(2, (ROTORS, 1)))
    u = u + (y - u @ A.T) @ np.linalg.pinv(A, SEEN).T
    ratio = np.linalg.norm(u @ b.T + added, axis=1) / np.linalg.norm(u @ b.T, axis=1)
    share = np.mean(ratio > 1)
    if share < LEVEL:
        return ()
    at, many = outlook.labels.speed_words(critical), f"{100 * share:.0f} of 100 rotors"
    return (
        f"But by the rotor model these weights make the mode at {at} worse, if the machine runs up to it: by "
        f"{np.median(ratio):.2g} times, in {many} that read the same here.",
    )
