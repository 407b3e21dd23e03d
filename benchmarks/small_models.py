"""Small models of the reference rotor beside ROSS: Guyan's reduction, and motion in time from rest.

Guyan's reduction of ROSS always keeps the nodes of bearings and discs, so these are kept in both programs,
and one axial and one torsional unknown, without which its stiffness is singular; these and the second plane
are left out afterwards. Frequencies of the reduced model stand beside those of the whole rotor; of the
peer's plane they come from SciPy's `eigh` (its `run_modal` takes longer). All are compared.

Motion: 0.5 s at 3,000 rpm under unbalance, 2,001 instants, both planes, gyroscopic effect, linear damped
bearings, beside `Rotor.run_time_response` (`lsim`; Newmark's method takes longer). Here the rotor keeps its
bearings, sensors and plane, and 12 modes between them (Craig and Bampton). Compared are the deflections of
two nodes at all instants, by the largest, with ROSS at a quarter of the step, since its force is linear
between the instants.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import eigh

import fem
from benchmarks.rotors import ROSS, Bearing, ross, ross_rotor, rotorid_rotor, table
from benchmarks.timing import Row, best_of, once, relative_difference
from rotorid.motion.run import run as move
from rotorid.motion.system import reduced_system, rotor_system
from rotorid.reduction import guyan

BEARING = Bearing(damping=2e4, vertical=0.6)
PLANE, SENSORS, MODES = 12, (8, 18), 12
SPEED, TIME, STEPS, UNBALANCE = 3000 * np.pi / 30, 0.5, 2000, 1e-2


def moved(rotor: fem.Rotor) -> np.ndarray:
    whole = rotor_system(rotor, 0.0, SPEED, unbalance={PLANE: UNBALANCE}, gravity=0.0)
    system = reduced_system(whole, (PLANE, *SENSORS, 2, 22), MODES)
    rest = np.zeros(system.size)
    return move(system, (SPEED, SPEED), TIME, (rest, rest), nodes=SENSORS, rate=STEPS / TIME).z


def moved_by_ross(rotor: Any, finer: int = 1) -> np.ndarray:
    t = np.linspace(0.0, TIME, finer * STEPS + 1)
    F = np.zeros((t.size, rotor.ndof))
    at = rotor.number_dof * (PLANE - 1)
    F[:, at] = UNBALANCE * SPEED**2 * np.cos(SPEED * t)
    F[:, at + 1] = UNBALANCE * SPEED**2 * np.sin(SPEED * t)
    y = rotor.run_time_response(SPEED, F, t).yout[::finer]
    columns = rotor.number_dof * (np.array(SENSORS) - 1)
    return y[:, columns] + 1j * y[:, columns + 1]


def guyan_of_ross(rotor: Any) -> np.ndarray:
    """Frequencies of Guyan's model in the plane x and as many of the whole rotor, rad/s, (2, nodes)."""
    model = ross.ModelReduction(rotor=rotor, speed=0.0, method="guyan", include_dofs=[2, 5])
    K, M = model.reduce_matrix(model.K), model.reduce_matrix(model.M)
    x = [i for i, unknown in enumerate(model.selected_dofs) if unknown % rotor.number_dof == 0]
    plane = [i for i in range(rotor.ndof) if i % rotor.number_dof in (0, 4)]  # x and the slope in it
    reduced = eigh(K[np.ix_(x, x)], M[np.ix_(x, x)], eigvals_only=True)
    whole = eigh(model.K[np.ix_(plane, plane)], model.M[np.ix_(plane, plane)], eigvals_only=True)
    return np.sqrt([reduced, whole[: len(x)]])


def our_guyan(rotor: fem.Rotor, kept: list[int]) -> np.ndarray:
    model = guyan(rotor, kept)
    return np.array([model.frequencies, model.frequencies / (1.0 + model.relative_error)])


def reduction() -> Row:
    rows = table()
    kept = [n for n, row in enumerate(rows, 1) if row["mass_kg"] or row["support_stiffness_N_per_m"]]
    ours, theirs = lambda: rotorid_rotor(rows, Bearing()), lambda: ross_rotor(rows, Bearing())
    return Row(
        task=f"Guyan reduction to {len(kept)} nodes",
        our_seconds=best_of(ours, lambda rotor: our_guyan(rotor, kept), 30),
        peer=f"{ROSS} Guyan",
        peer_seconds=best_of(theirs, guyan_of_ross, 5),
        difference=relative_difference(our_guyan(ours(), kept), guyan_of_ross(theirs())),
        goal=2.0,
    )


def motion() -> Row:
    rows = table()
    theirs = lambda: ross_rotor(rows, BEARING, gyroscopic=True)  # noqa: E731
    make = lambda: rotorid_rotor(rows, BEARING, gyroscopic=True)  # noqa: E731
    peer, expected = once(theirs, moved_by_ross)
    _, finer = once(theirs, lambda rotor: moved_by_ross(rotor, 4))
    answer, largest = moved(make()), np.abs(finer).max()
    return Row(
        task="motion in time, 23 elements, 2001 instants",
        our_seconds=best_of(make, moved, 5),
        peer=f"{ROSS} run_time_response",
        peer_seconds=peer,
        difference=float(np.abs(answer - finer).max() / largest),
        allowed=1e-3,
        note=f"{ROSS} at this step is off by {np.abs(expected - finer).max() / largest:.0e}",
    )


def run() -> list[Row]:
    return [reduction(), motion()]
