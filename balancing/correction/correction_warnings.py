"""Warnings of a correction, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from balancing.coefficients.identifiability import acting_alike
from balancing.coefficients.influence import Influence
from balancing.data.conventions import Labels
from balancing.data.limits import Limits
from rotorid.base.arrays import ComplexArray, FloatArray

if TYPE_CHECKING:
    from balancing.correction.correction_result import Correction
    from balancing.solvers.correction_methods import Fitted, Stack


ILL_CONDITIONED = 30.0
"""Above this condition number (columns scaled) measured coefficients hardly tell the planes apart."""
EMPTY = 1e-7
"""Effect of a weight, relative to the vibration, below which it is none."""
_RISES_NAMED = 3
_TOUCHES = 2e-3
"""Relative distance below which a limit with a price is touched (the solver stays a little inside)."""


def reading_names(labels: Labels, sensors: tuple[str, ...], speeds: FloatArray) -> tuple[str, ...]:
    """What to call each reading, speed by speed."""
    return tuple(f"sensor {c!r} at {labels.speed_words(s)}" for s in speeds for c in sensors)


def binding(stack: Stack, fitted: Fitted) -> tuple[str, ...]:
    """Limits that the correction touches, in words."""
    if stack.limits is None:
        return ()
    D, r = fitted.weights, stack.Y + stack.W @ fitted.weights
    nothing = np.zeros(0, dtype=bool)
    weights = nothing if fitted.active_weights is None else fitted.active_weights
    amplitudes = nothing if fitted.active_residuals is None else fitted.active_residuals
    words = [
        f"plane {name!r} has its largest weight, {stack.weight(float(limit))}"
        for name, touches, size, limit in zip(
            stack.planes, weights, np.abs(D), stack.limits.max_weight, strict=False
        )
        if touches and size >= limit * (1 - _TOUCHES)
    ]
    words += [
        f"{name} has its largest amplitude, {stack.amplitude(float(limit))}"
        for name, touches, size, limit in zip(
            stack.readings, amplitudes, np.abs(r), stack.limits.residual.ravel(), strict=False
        )
        if touches and size >= limit * (1 - _TOUCHES)
    ]
    words += [
        f"plane {name!r} stands at the end of a forbidden arc"
        for name, weight, arcs in zip(stack.planes, D, stack.limits.forbidden, strict=True)
        if abs(weight) > 0 and any(_at_end(weight, start, width) for start, width in arcs)
    ]
    return tuple(words)


def _at_end(weight: complex, start: float, width: float) -> bool:
    away = np.angle(weight * np.exp(-1j * np.array([start, start + width])))
    return bool((np.abs(away) < 1e-6).any())


def warnings_of(result: Correction, W: ComplexArray, *, alike: bool, rising: bool = True) -> tuple[str, ...]:
    """Planes that act nearly alike, planes without weights, a poor fit, readings that rise."""
    out = []
    if alike and result.condition_number > ILL_CONDITIONED:
        planes = acting_alike(W)
        out.append(
            f"planes {', '.join(repr(result.planes[p]) for p in planes)} act nearly alike (condition number "
            f"{result.condition_number:.3g}): small errors of the readings become large weights; "
            "leave one out, or add sensors or speeds"
        )
    empty = (result.weights == 0) & (result.limits is not None)
    out += [
        f"the limits leave plane {p!r} without a weight"
        for p, nothing in zip(result.planes, empty, strict=True)
        if nothing
    ]
    told = result.explained or result.active
    if result.chi_square is not None and result.fit_dof and not told:
        ratio = np.sqrt(result.chi_square / result.fit_dof)
        out.append(
            f"weights in these planes leave {ratio:.2g} times what the errors explain: unbalance elsewhere, "
            "a bow or nonlinearity (the ± allow for it), or larger errors than stated (± up to "
            f"{ratio:.2g} times larger)"
        )
    if rising and np.abs(result.after).max() > np.abs(result.before).max() * (1 + 1e-6):
        out += _rises(result)
    return tuple(out)


def notes(result: Correction) -> tuple[str, ...]:
    """Weights within their errors, readings that rise but stay below the largest one today."""
    out = []
    std = result.angle_std
    if std is not None:
        out += [
            f"the weight in plane {p!r} lies within its own error: its angle is not determined"
            for p, s, weight in zip(result.planes, std, result.weights, strict=True)
            if np.isnan(s) and weight
        ]
    if np.abs(result.after).max() <= np.abs(result.before).max() * (1 + 1e-6):
        out += _rises(result)
    return tuple(out)


def _rises(result: Correction) -> tuple[str, ...]:
    return _rising(result.speeds, result.sensors, result.before, result.after, result.labels, "")


def left_out(
    influence: Influence,
    Y: ComplexArray,
    chosen: list[int],
    used: list[int],
    D: ComplexArray,
    labels: Labels,
    limits: Limits | None,
) -> tuple[str, ...]:
    """Readings at speeds that were left out and are predicted to rise, or to pass their limits."""
    rest = [s for s in range(len(influence.speeds)) if s not in used]
    after = Y[rest] + influence.W[rest][..., chosen] @ D
    words = _rising(influence.speeds[rest], influence.sensors, Y[rest], after, labels, ", a speed left out")
    if limits is None:
        return words
    over = np.abs(after) > limits.residual[rest] * (1 + 1e-6)
    names = reading_names(labels, influence.sensors, influence.speeds[rest])
    return words + tuple(
        f"the vibration of {names[s * len(influence.sensors) + c]}, a speed left out, is predicted to be "
        f"{labels.amplitude_words(float(np.abs(after[s, c])))}, more than its "
        f"limit of {labels.amplitude_words(float(limits.residual[rest[s], c]))}"
        for s, c in np.argwhere(over)[:_RISES_NAMED]
    )


def _rising(
    speeds: FloatArray,
    sensors: tuple[str, ...],
    before: ComplexArray,
    after: ComplexArray,
    labels: Labels,
    where: str,
) -> tuple[str, ...]:
    old, new = labels.vibration(before)[0], labels.vibration(after)[0]
    places = [tuple(place) for place in np.argwhere(new > old * (1 + 1e-6))]
    places.sort(key=lambda place: old[place] - new[place])
    words = [
        f"the vibration of sensor {sensors[c]!r} at {labels.speed_words(speeds[s])}{where} is predicted "
        f"to rise from {old[s, c]:.3g} to {new[s, c]:.3g} {labels.vibration_in}".rstrip()
        for s, c in places[:_RISES_NAMED]
    ]
    if len(places) > _RISES_NAMED:
        words[-1] += f"; {len(places) - _RISES_NAMED} more readings{where} rise less"
    return tuple(words)
