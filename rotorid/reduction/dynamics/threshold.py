"""Where the small model loses stability, found as `fem.stability_threshold` finds it of the full rotor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

import fem
from fem.campbell import asked_for, runs_away
from fem.orbits import whirl_direction
from fem.solvers.quadratic import solve
from fem.solvers.reduced_whirl import Whirl
from fem.solvers.tracking import follow
from fem.whirl import checked_speeds, in_both_planes
from rotorid.base.arrays import AnyArray, ComplexArray, FloatArray
from rotorid.reduction.dynamics.turning import whirl_of

if TYPE_CHECKING:
    from rotorid.reduction.dynamics.small import SmallRotor


GROWTH = 1e-9
"""Re λ / |λ| above which a mode grows: an undamped one has rounding there."""

_NEAR = 1e-4
"""Relative distance of two speeds that may be one threshold."""

_SECANTS = 3

STEPS = 40
"""Into how many steps a range of speeds is divided."""


def stability_threshold(
    small: SmallRotor, highest: float, *, lowest: float = 0.0, steps: int = STEPS
) -> fem.Stability:
    """Find the first speed at which a mode of the small model stops decaying.

    What `fem.stability_threshold` asks of the full rotor, over all motions of the small one: also one that
    does not oscillate and begins to run away is followed to the speed where it does.

    Parameters
    ----------
    small
        The small model.
    highest, lowest
        Range of speeds, rad/s: within the tables of all supports.
    steps
        Into how many steps the range is divided; a mode that is unstable only between two neighbouring
        speeds is not seen. The threshold itself is found by iteration, to 1e-10 of it or better.

    Raises
    ------
    ValueError
        For an impossible range, or outside the table of a support.
    """
    return searched(whirl_of(small, grid(highest, lowest, steps)), small)


def grid(highest: float, lowest: float, steps: int) -> FloatArray:
    """The speeds that are looked at, shape (steps + 1,).

    Raises
    ------
    ValueError
        For an impossible range.
    """
    if not (np.isfinite(highest) and np.isfinite(lowest) and lowest < highest):
        raise ValueError(
            f"the range of speeds is empty: {lowest!r} to {highest!r} rad/s; give finite lowest < highest"
        )
    if int(steps) != steps or steps < 1:
        raise ValueError(f"the range is divided into at least one step; got {steps!r}")
    return checked_speeds(np.linspace(lowest, highest, int(steps) + 1))


def searched(whirl: Whirl, small: SmallRotor) -> fem.Stability:
    """The first threshold in the range of speeds of `whirl`, which holds all modes of the small model."""
    speeds = whirl.speeds
    paths = follow(whirl)
    columns = asked_for(paths, speeds, whirl.found.values.shape[1])
    values, X = paths.values[:, columns], paths.vectors[:, columns]
    growth = np.nan_to_num(values.real / np.abs(values), nan=-np.inf)
    away = np.array(runs_away(whirl))
    grows = (growth > GROWTH).any(axis=1) | away
    upto = int(np.argmax(grows)) if grows.any() else speeds.size
    decrements = (-2 * np.pi * values.real / np.abs(values.imag))[: max(upto, 1)]
    known = decrements[np.isfinite(decrements)]
    stable = fem.Stability(
        status="stable",
        lowest=float(speeds[0]),
        highest=float(speeds[-1]),
        threshold=None,
        mode=None,
        frequency=None,
        direction=None,
        margin=float(known.min()) if known.size else float("nan"),
        rotor=small.rotor,
    )
    if upto == speeds.size:
        return stable
    if upto == 0:
        if not (growth[0] > GROWTH).any():
            return replace(stable, status="unstable")
        worst = int(np.argmax(growth[0]))
        frequency, direction = _described(values[:1, worst], whirl.Q.nodes(X[:1, worst]))
        return replace(stable, status="unstable", mode=worst + 1, frequency=frequency, direction=direction)
    speed, value, shape = _located(whirl, upto)
    lost = replace(stable, status="threshold", threshold=speed)
    if shape is None:
        return lost
    # The mode is that of the growing ones which passes by on its way between the two speeds.
    frequency, direction = _described(np.array([value]), shape)
    part = (speed - speeds[upto - 1]) / (speeds[upto] - speeds[upto - 1])
    before = np.where(np.isfinite(values[upto - 1]), values[upto - 1], values[upto])
    distance = np.abs(before + part * (values[upto] - before) - value)
    mode = int(np.argmin(np.where(growth[upto] > GROWTH, distance, np.inf)))
    return replace(lost, mode=mode + 1, frequency=frequency, direction=direction)


def _located(whirl: Whirl, upto: int) -> tuple[float, complex, AnyArray | None]:
    """Where the first motion begins to grow between speed number `upto` and the one before.

    Sought is the root of the largest Re λ of all motions, which needs no mode to be followed. Of a motion
    without damping rounding decides the sign of Re λ: hence growth beyond rounding is asked for first, and
    the last step back to Re λ = 0 is made along the slope of the mode that grows.

    Returns
    -------
    The speed, the eigenvalue there and the shape of its mode (1, planes, N), None if it does not oscillate.
    """
    from scipy.optimize import brentq

    Q, scale, n = whirl.Q, whirl.scale, whirl.found.values.shape[1]
    a, b = float(whirl.speeds[upto - 1]), float(whirl.speeds[upto])

    def at(speed: float) -> tuple[ComplexArray, AnyArray, FloatArray]:
        found = solve(Q, np.array([speed]), n, scale)
        there = np.isfinite(found.values[0])
        return found.values[0, there], found.vectors[0, there], found.real[0]

    def fastest(speed: float) -> float:
        values, _, real = at(speed)
        rates = np.concatenate((values.real - GROWTH * np.abs(values), real))
        return float(rates.max(initial=-scale))

    def root(function: Callable[[float], float]) -> float:
        if function(a) >= 0:
            return a
        return b if function(b) <= 0 else float(brentq(function, a, b, xtol=1e-13 * b, rtol=1e-14))

    speed = root(fastest)
    values, vectors, real = at(speed)
    if real.max(initial=-np.inf) > values.real.max(initial=-np.inf):
        # Where a real eigenvalue is 0, K is singular: sharper than the eigenvalue, which rounding blurs.
        _, size = np.linalg.slogdet(Q.at(np.array([b]))[1][0])

        def held(omega: float) -> float:
            sign, other = np.linalg.slogdet(Q.at(np.array([omega]))[1][0])
            return -float(sign.real * np.exp(min(other - size, 700.0)))

        singular = root(held)
        return singular if abs(singular - speed) < _NEAR * b else speed, 0j, None
    k = int(np.argmax(values.real))
    value, vector = values[k], vectors[k : k + 1]
    step = min(_NEAR * b, (b - a) / 2)
    other = speed + step if speed + step <= b else speed - step  # b may be where a table ends
    values, _, _ = at(other)
    there = values[np.argmin(np.abs(values - value))].real
    for _ in range(_SECANTS):
        slope = (there - value.real) / (other - speed)
        if slope <= 0:
            break
        other, there, speed = speed, value.real, float(np.clip(speed - value.real / slope, a, b))
        values, vectors, _ = at(speed)
        k = int(np.argmin(np.abs(values - value)))
        value, vector = values[k], vectors[k : k + 1]
        if abs(other - speed) <= 1e-13 * b:
            break
    return speed, complex(value), Q.nodes(vector)


def _described(values: ComplexArray, shapes: AnyArray) -> tuple[float, float]:
    """Frequency and direction of one mode."""
    lam, x, y = in_both_planes(values, shapes)
    return float(lam.imag[0]), float(whirl_direction(x, y)[0])
