"""How a motion begins: at rest in equilibrium, in steady motion, or displaced from there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.motion.equilibrium import equilibrium
from rotorid.motion.run import TOLERANCE, run
from rotorid.motion.system import MotionSystem

Beginning = tuple[FloatArray, FloatArray, tuple[str, ...]]
_BLOCK = 32  # turns
_BLOCKS = 64
_SETTLED = 1e-6
_NEAR = 0.9


def at_rest(system: MotionSystem, speed: float) -> FloatArray:
    """Where the rotor rests while it turns, shape (n,); errors as of `equilibrium`."""
    here = np.zeros(system.size)
    if not system.weight.any() and not system.acting(here, here, speed)[0].any():
        return here  # also of a rotor that nothing holds
    return np.array(equilibrium(system, speed).q)


def steady_linear(
    system: MotionSystem, speeds: Sequence[float] | FloatArray
) -> tuple[FloatArray, FloatArray, ComplexArray]:
    """Steady response to unbalance and bow of the rotor made linear about its equilibrium at each speed.

    Parameters
    ----------
    system
        What moves.
    speeds
        rad/s.

    Returns
    -------
    The speeds at which there is an equilibrium, shape (s,), the equilibria, (s, n), and the response, (s, n):
    the motion is Re(response e^{iφ}) about the equilibrium.
    """
    found = []
    for speed in speeds:
        try:
            rest = at_rest(system, speed)
        except ValueError:
            continue
        C, K = system.linear(speed)
        _, F_q, F_v, _ = system.acting(rest, np.zeros(system.size), speed)
        dynamic = K - F_q + 1j * speed * (C - F_v) - speed**2 * system.M
        found.append((speed, rest, np.linalg.solve(dynamic, speed**2 * system.unbalance + system.bow)))
    if not found:
        return np.empty(0), np.empty((0, system.size)), np.empty((0, system.size), dtype=complex)
    at, rests, responses = zip(*found, strict=True)
    return np.array(at), np.array(rests), np.array(responses)


def begin(
    system: MotionSystem,
    speed: float,
    how: Literal["rest", "steady"] = "rest",
    shift: Mapping[int, complex] | None = None,
    tolerance: float = TOLERANCE,
) -> Beginning:
    """How a motion begins: unknowns and velocities, shape (n,) each, where the angle is 0; and warnings.

    Parameters
    ----------
    system
        What moves.
    speed
        rad/s.
    how
        At rest in equilibrium, or in steady motion: where forces are not linear it begins near the steady
        motion of the linear rotor and settles for so many turns as it takes, 2048 at most.
    shift
        Nodes moved from there, x + iy, m.
    tolerance
        As `run` takes it.

    Raises
    ------
    ValueError
        As `equilibrium` and `run`, if it touches a wall, and for nodes that do not move.
    """
    rest = at_rest(system, speed)
    found = rest, np.zeros(system.size), ()
    q, v, warnings = _steady(system, speed, rest, tolerance) if how == "steady" else found
    for node, by in (shift or {}).items():
        q[[*system.index(node)]] += by.real, by.imag
    return q, v, warnings


def _steady(system: MotionSystem, speed: float, rest: FloatArray, tolerance: float) -> Beginning:
    *_, response = steady_linear(system, [speed])
    q, v = rest + response[0].real, (1j * speed * response[0]).real
    if not system.forces or not speed:
        return q, v, ()
    walls = np.array([force.wall for force in system.forces])
    x, y = system.law_tables[2].T
    if (np.hypot(q[x], q[y]) > _NEAR * walls).any():
        q, v = rest, np.zeros(system.size)
    before: ComplexArray | None = None
    for _ in range(_BLOCKS):
        found = run(system, (speed, speed), _BLOCK * 2 * np.pi / speed, (q, v), tolerance=tolerance)
        if found.stopped:
            raise ValueError(f"while it settles at the first speed {found.stopped}")
        q, v, turn = found.q, found.v, found.z[-(found.time.size // _BLOCK) :]
        if before is not None and np.abs(turn - before).max() <= _SETTLED * np.abs(turn).max():
            return q, v, ()
        before = turn
    warning = f"at the first speed nothing that comes again each turn is reached in {_BLOCK * _BLOCKS} turns"
    return q, v, (warning,)
