"""At which speeds a steady response exists at all: the stability of the rotor at every speed asked for."""

from __future__ import annotations

import numpy as np

from fem.matrices.lateral_planes import both_planes
from fem.model.rotor import Rotor
from fem.orbits import whirl_direction
from fem.solvers.quadratic import solve
from fem.solvers.stable_speeds import GROWTH, Bases, bases, growing_at, largest_growth
from fem.whirl import in_both_planes
from fem.windows import Window
from rotorid.base.arrays import FloatArray

_PARTS = 8  # into how many parts the step with an edge is divided
_SLACK = 1e-12  # of the largest entry: rounding


def growth_bound(rotor: Rotor, speeds: FloatArray) -> FloatArray:
    """Frequency above which no mode grows at each speed, rad/s, shape (S,); 0: none grows, inf: not known.

    Multiplied by the conjugate velocity, the equations of a growing motion (Re λ > 0) on positive stiffness
    and damping show that work of the circulating forces exceeds that of the damping, which rises with the
    frequency: q / c at a support, the speed itself for the material of the shaft. Gyroscopic moments do no
    work.
    """
    bound = np.where(np.any(rotor.material_damping), speeds, 0.0)
    for support in rotor.supports:
        k, c = support.at(speeds)
        tiny = _SLACK * np.abs(k).max(axis=(1, 2))
        c = (c + np.swapaxes(c, 1, 2)) / 2
        circulating = np.abs(k[:, 0, 1] - k[:, 1, 0]) / 2
        braking = np.sqrt(np.maximum(np.linalg.det(c), 0.0))
        with np.errstate(divide="ignore", invalid="ignore"):
            own = np.where(circulating > tiny, circulating / braking, 0.0)
        outwards = np.linalg.eigvalsh((k + np.swapaxes(k, 1, 2)) / 2)[:, 0] < -tiny
        # What is pushed aside does not oscillate, and is so at rest, too.
        own = np.where(outwards, np.maximum(own, np.maximum(speeds, 1.0)), own)
        wrong = np.linalg.eigvalsh(c)[:, 0] < -_SLACK * np.abs(c).max(axis=(1, 2))
        bound = np.maximum(bound, np.where(wrong, np.inf, own))
    return np.asarray(bound)


def unstable_windows(rotor: Rotor, speeds: FloatArray) -> tuple[Window, ...]:
    """Ranges of speed without a steady response, as far as they hold one of the speeds asked for.

    Every speed is judged, and the knots of the tables between: first by `growth_bound`, then as
    `fem.solvers.stable_speeds` says.

    Parameters
    ----------
    rotor
        The rotor.
    speeds
        rad/s, in any order, shape (S,).

    Raises
    ------
    ValueError
        If the rotor on the mean stiffness of its supports is statically unstable.
    """
    asked = np.unique(speeds)
    knots = np.unique([speed for support in rotor.supports for speed in support.speeds])
    # Two windows are not one because nobody asked for a speed between them.
    judged = np.union1d(asked, knots[(knots > asked[0]) & (knots < asked[-1])])
    bound = growth_bound(rotor, judged)
    doubtful = bound > 0
    if not doubtful.any():
        return ()
    found = bases(both_planes(rotor), judged[doubtful], float(bound.max()))
    grows = np.zeros(judged.size, dtype=bool)
    grows[doubtful] = growing_at(found, judged[doubtful], knots)
    edges = np.flatnonzero(np.diff(np.concatenate(([False], grows, [False]))))
    return tuple(
        _window(found, judged, knots, int(start), int(end) - 1)
        for start, end in zip(edges[::2], edges[1::2], strict=True)
        if np.isin(judged[start:end], asked).any()
    )


def judge(rotor: Rotor, speeds: FloatArray) -> tuple[tuple[Window, ...], tuple[str, ...]]:
    """`unstable_windows`, and what to say of them; also where stability cannot be judged."""
    try:
        windows = unstable_windows(rotor, speeds)
    except ValueError as problem:
        return (), (f"whether the rotor is stable at these speeds is not known: {problem}",)
    return windows, tuple(window.said() for window in windows)


def _window(found: Bases, judged: FloatArray, knots: FloatArray, i: int, j: int) -> Window:
    """The window that holds the speeds number i to j."""
    begins, ends = i > 0, j + 1 < judged.size
    first = _edge(found, judged[i], judged[i - 1], knots) if begins else float(judged[i])
    last = _edge(found, judged[j], judged[j + 1], knots) if ends else float(judged[j])
    at = first if begins or not ends else last
    pairs = solve(found.fine, np.array([at]), found.fine.size, found.scale)
    values = pairs.values[0]
    rates = np.nan_to_num(values.real / np.abs(values), nan=-1.0)
    rates[np.nan_to_num(np.abs(values.imag)) > found.highest] = -1.0
    k = int(np.argmax(rates))
    real = float(pairs.real[0].max(initial=-found.scale))
    if real > max(rates[k], 0.0) * found.scale:
        return Window(first, last, begins, ends)
    lam, x, y = in_both_planes(values[k : k + 1], found.fine.nodes(pairs.vectors[:1, k]))
    return Window(first, last, begins, ends, k + 1, float(lam.imag[0]), float(whirl_direction(x, y)[0]))


def _edge(found: Bases, unstable: float, stable: float, knots: FloatArray) -> float:
    """Where growth at one speed, rad/s, ends on the way to another: the edge next to the first."""
    from scipy.optimize import brentq

    # Where the mode decays beyond rounding on the other side, its growth vanishes at the edge.
    level = 0.0 if largest_growth(found, np.array([stable]))[0] < -GROWTH else GROWTH

    def excess(speeds: FloatArray) -> FloatArray:
        return largest_growth(found, speeds) - level

    between = knots[(knots > min(unstable, stable)) & (knots < max(unstable, stable))]
    trials = np.unique(np.concatenate((np.linspace(unstable, stable, _PARTS + 1), between)))
    trials = trials if stable > unstable else trials[::-1]
    over = excess(trials) > 0
    k = int(np.argmin(over))
    if over.all() or k == 0:
        return unstable
    a, b = float(trials[k - 1]), float(trials[k])
    return float(brentq(lambda v: float(excess(np.array([v]))[0]), a, b, xtol=1e-13 * max(a, b), rtol=1e-12))
