"""At which speeds a steady response exists: stability at every speed asked for, and where it is lost."""

from __future__ import annotations

import numpy as np

from fem.matrices.lateral_planes import both_planes
from fem.model.rotor import Rotor
from fem.orbits import whirl_direction
from fem.solvers.bracketed_roots import bracketed_root
from fem.solvers.quadratic_eigenvalues import all_values, solve
from fem.solvers.stable_speeds import GROWTH, Bases, bases, growing_at, largest_growth, rates
from fem.whirl import in_both_planes
from fem.windows import Window
from rotorid.base.arrays import BoolArray, FloatArray

_PARTS = 4  # into how many parts the step with an edge is divided
_SLACK = 1e-12  # of the largest entry: rounding
_NEAR = 1e-4  # relative step of speed for a slope
_SECANTS = 3
_PAIR = 1e-6  # relative distance of forward and backward whirl that coincide


def growth_bound(rotor: Rotor, speeds: FloatArray) -> FloatArray:
    """Frequency above which no mode grows at each speed, rad/s, shape (S,); 0: none grows, inf: not known.

    Multiplied by the conjugate velocity, the equations of a growing motion (Re λ > 0) on positive stiffness
    and damping show that work of the circulating forces exceeds that of the damping, which rises with the
    frequency: q / c at a support, the speed itself for the material of the shaft. Gyroscopic moments do no
    work.
    """
    bound = np.where(np.any(rotor.material_damping), speeds, 0.0)
    for support in rotor.supports:
        k, c = support.at(speeds if support.speeds else speeds[:1])
        tiny = _SLACK * np.abs(k).max(axis=(1, 2))
        c = (c + np.swapaxes(c, 1, 2)) / 2
        circulating = np.abs(k[:, 0, 1] - k[:, 1, 0]) / 2
        braking = np.sqrt(np.maximum(np.linalg.det(c), 0.0))
        with np.errstate(divide="ignore", invalid="ignore"):
            own = np.where(circulating > tiny, circulating / braking, 0.0)
        pushes = np.linalg.eigvalsh((k + np.swapaxes(k, 1, 2)) / 2)[:, 0] < -tiny
        # What is pushed aside does not oscillate, and is so at rest, too.
        own = np.where(pushes, np.maximum(own, np.maximum(speeds, 1.0)), own)
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
    # Two windows are not one because nobody asked for a speed between them.
    known = np.union1d(asked, rotor.knots[(rotor.knots > asked[0]) & (rotor.knots < asked[-1])])
    found, grows = judged(rotor, known)
    if found is None:
        return ()
    edges = np.flatnonzero(np.diff(np.concatenate(([False], grows, [False]))))
    return tuple(
        _window(found, known, int(start), int(end) - 1)
        for start, end in zip(edges[::2], edges[1::2], strict=True)
        if np.isin(known[start:end], asked).any()
    )


def judged(rotor: Rotor, speeds: FloatArray) -> tuple[Bases | None, BoolArray]:
    """At which speeds, ascending, shape (S,), a mode grows, and the equations that tell it.

    These are None where no mode can grow: `growth_bound` says so.
    """
    bound = growth_bound(rotor, speeds)
    doubtful = bound > 0
    grows = np.zeros(speeds.size, dtype=bool)
    if not doubtful.any():
        return None, grows
    found = bases(both_planes(rotor), speeds[doubtful], float(bound.max()))
    grows[doubtful] = growing_at(found, speeds[doubtful])
    return found, grows


def judge(rotor: Rotor, speeds: FloatArray) -> tuple[tuple[Window, ...], tuple[str, ...]]:
    """`unstable_windows`, and what to say of them; also where stability cannot be judged."""
    try:
        windows = unstable_windows(rotor, speeds)
    except ValueError as problem:
        return (), (f"whether the rotor is stable at these speeds is not known: {problem}",)
    return windows, tuple(window.said() for window in windows)


def _window(found: Bases, known: FloatArray, i: int, j: int) -> Window:
    """The window that holds the speeds number i to j."""
    (first, start), (last, end) = (float(known[i]), None), (float(known[j]), None)
    begins, ends = i > 0, j + 1 < known.size
    if begins:
        first, start = loss(found, known[i], known[i - 1])
    if ends:
        last, end = loss(found, known[j], known[j + 1])
    mode = growing_mode(found, last, end) if ends and not begins else growing_mode(found, first, start)
    return Window(first, last, begins, ends, *mode)


def loss(found: Bases, unstable: float, stable: float) -> tuple[float, complex]:
    """Where growth at one speed, rad/s, ends on the way to another: the edge next to the first.

    Sought is the root of the largest growth of all modes, which needs no mode to be followed. Of a motion
    without damping rounding decides the sign of Re λ: beside one, growth beyond a level is asked for, and the
    last step back to Re λ = 0 is made along the slope of the mode that grows.

    Returns
    -------
    The speed, and the eigenvalue that grows from there; 0 if the rotor runs away without oscillating.
    """
    from scipy.linalg import eigvals

    knots = found.fine.P.rotor.knots
    ends = min(unstable, stable), max(unstable, stable)
    between = knots[(knots > ends[0]) & (knots < ends[1])]
    trials = np.unique(np.concatenate((np.linspace(unstable, stable, _PARTS + 1), between)))
    trials = trials if stable > unstable else trials[::-1]
    growth = largest_growth(found, trials)
    level = 0.0 if growth[-1] < -GROWTH else GROWTH
    over = growth > level
    k = int(np.argmin(over))
    if over.all() or k == 0:
        return float(unstable), _fastest(found, unstable)
    (a, b), around = trials[k - 1 : k + 1].tolist(), (growth[k - 1 : k + 1] - level).tolist()

    def excess(speed: float) -> float:
        return float(largest_growth(found, np.array([speed]))[0]) - level

    speed = bracketed_root(excess, (a, b), around, 1e-13 * max(a, b))
    value = _fastest(found, speed)
    if not value:
        # K is singular there, and linear between a and b: sharper than the eigenvalue, which rounding blurs.
        start, end = found.fine.at(np.array([a, b]))[1]
        parts = eigvals(start, start - end)
        part = parts[np.nanargmin(np.abs(parts - (speed - a) / (b - a)))].real
        return float(a + part * (b - a)), 0j
    return _back(found, speed, value, ends) if level else (speed, value)


def growing_mode(
    found: Bases, speed: float, value: complex | None = None
) -> tuple[int, float, float] | tuple[None, None, None]:
    """Number by frequency, from 1, whirl frequency and direction of a mode, by default the fastest growing.

    Of two that coincide the backward one comes first. None if the motion does not oscillate.
    """
    value = _fastest(found, speed) if value is None else value
    if not value:
        return None, None, None
    pairs = solve(found.fine, np.array([speed]), 2 * found.fine.size, found.scale)
    lam, size = pairs.values[0], np.abs(pairs.values[0].imag)
    k = int(np.nanargmin(np.abs(lam - value)))
    before = size < (1 - _PAIR) * size[k]
    before |= (lam.imag < 0) & (lam[k].imag > 0) & (size < (1 + _PAIR) * size[k])
    _, x, y = in_both_planes(lam[k : k + 1], found.fine.nodes(pairs.vectors[:1, k]))
    return 1 + int(np.count_nonzero(before)), float(size[k]), float(whirl_direction(x, y)[0])


def _back(found: Bases, speed: float, value: complex, ends: tuple[float, float]) -> tuple[float, complex]:
    """Speed and eigenvalue where a mode neither grows nor decays, from where it grows a little."""
    step = min(_NEAR * ends[1], (ends[1] - ends[0]) / 2)
    other = speed + step if speed + step <= ends[1] else speed - step
    there = _nearest(found, other, value).real
    for _ in range(_SECANTS):
        if there == value.real:
            break
        new = float(np.clip(speed - value.real * (other - speed) / (there - value.real), *ends))
        other, there, speed = speed, value.real, new
        value = _nearest(found, speed, value)
    return speed, value


def _nearest(found: Bases, speed: float, value: complex) -> complex:
    """The eigenvalue at a speed that is nearest to a given one."""
    lam, _ = all_values(found.fine, np.array([speed]), found.scale)
    return complex(lam[0, np.argmin(np.abs(lam[0] - value))])


def _fastest(found: Bases, speed: float) -> complex:
    """Eigenvalue of the motion that `largest_growth` counts at a speed; 0 if it does not oscillate."""
    lam, oscillates = all_values(found.fine, np.array([speed]), found.scale)
    k = int(np.argmax(rates(found, lam, oscillates)[0]))
    value = complex(lam[0, k]) if oscillates[0, k] else 0j
    return value.conjugate() if value.imag < 0 and found.fine.P.planes == 2 else value
