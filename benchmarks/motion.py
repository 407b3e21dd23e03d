"""Motion in time of the reference rotor from rest under unbalance: 0.5 s at 3,000 rpm, 2,001 instants.

Against ROSS' `Rotor.run_time_response`, which takes the equations of one speed to a state-space matrix and
scipy's `lsim`; its other method, Newmark's, takes longer. Both planes, gyroscopic effect, linear damped
bearings: ROSS has no film that is not linear. Here the rotor keeps its bearings, sensors and plane, and 12
modes between them (Craig and Bampton) of both planes together.

Answers: the deflections of two nodes at all instants, by the largest. ROSS takes the force as linear
between the instants: it is taken at a quarter of that step, and the note says how far its answer at the
whole step is off.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import fem
from benchmarks.rotors import ROSS, Bearing, ross_rotor, rotorid_rotor, table
from benchmarks.timing import Row, best_of, once
from rotorid.motion.run import run as move
from rotorid.motion.system import reduced_system, rotor_system

BEARING = Bearing(damping=2e4, vertical=0.6)
PLANE, SENSORS, MODES = 12, (8, 18), 12
SPEED, TIME, STEPS, UNBALANCE = 3000 * np.pi / 30, 0.5, 2000, 1e-2


def ours(rotor: fem.Rotor) -> np.ndarray:
    whole = rotor_system(rotor, 0.0, SPEED, unbalance={PLANE: UNBALANCE}, gravity=0.0)
    system = reduced_system(whole, (PLANE, *SENSORS, 2, 22), MODES)
    rest = np.zeros(system.size)
    return move(system, (SPEED, SPEED), TIME, (rest, rest), nodes=SENSORS, rate=STEPS / TIME).z


def with_ross(rotor: Any, finer: int = 1) -> np.ndarray:
    t = np.linspace(0.0, TIME, finer * STEPS + 1)
    F = np.zeros((t.size, rotor.ndof))
    at = rotor.number_dof * (PLANE - 1)
    F[:, at] = UNBALANCE * SPEED**2 * np.cos(SPEED * t)
    F[:, at + 1] = UNBALANCE * SPEED**2 * np.sin(SPEED * t)
    y = rotor.run_time_response(SPEED, F, t).yout[::finer]
    columns = rotor.number_dof * (np.array(SENSORS) - 1)
    return y[:, columns] + 1j * y[:, columns + 1]


def run() -> list[Row]:
    rows = table()
    theirs = lambda: ross_rotor(rows, BEARING, gyroscopic=True)  # noqa: E731
    make = lambda: rotorid_rotor(rows, BEARING, gyroscopic=True)  # noqa: E731
    peer, expected = once(theirs, with_ross)
    _, finer = once(theirs, lambda rotor: with_ross(rotor, 4))
    found = ours(make())
    largest = np.abs(finer).max()
    off = np.abs(expected - finer).max() / largest
    return [
        Row(
            task="motion in time, 23 elements, 2001 instants",
            ours="rotorid motion",
            our_seconds=best_of(make, ours, 5),
            peer=f"{ROSS} run_time_response",
            peer_seconds=peer,
            difference=float(np.abs(found - finer).max() / largest),
            allowed=1e-3,
            required_ratio=1.0,
            note=f"{ROSS} at this step is off by {off:.0e}",
        )
    ]
