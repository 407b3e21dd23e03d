"""Unbalance response, 4 planes × 6 sensors × 1000 speeds, of the reference rotor on damped bearings.

Against ROSS' `Rotor.transfer_matrix`, called once per speed: the fastest public way to these numbers.
`run_freq_response` and `run_unbalance_response` call it, too, and then store receptances of all unknowns (1
GB here) or repeat work per plane; both take longer. The receptance between sensor and plane in the
x-direction times ω² is the influence coefficient.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import fem
from benchmarks.rotors import ROSS, SIZES, Bearing, ross_rotor, rotorid_rotor, table
from benchmarks.timing import Row, best_of, relative_difference

BEARING = Bearing(damping=2e4)
PLANES = (3, 8, 14, 20)  # nodes of the 23-element rotor
SENSORS = (2, 6, 10, 15, 18, 22)
SPEEDS = np.linspace(1.0, 1000.0, 1000)  # across the first two critical speeds


def make(times: int = 1) -> fem.Rotor:
    return rotorid_rotor(table(times), BEARING)


def ours(rotor: fem.Rotor) -> np.ndarray:
    times = {n + 1: times for n, times in SIZES.items()}[rotor.n_nodes]
    planes, sensors = ([times * (node - 1) + 1 for node in nodes] for nodes in (PLANES, SENSORS))
    return fem.influence(rotor, planes, sensors, SPEEDS).W


def with_ross(rotor: Any) -> np.ndarray:
    pick = np.ix_(*([rotor.number_dof * (node - 1) for node in nodes] for nodes in (SENSORS, PLANES)))
    return np.array([omega**2 * rotor.transfer_matrix(speed=omega)[pick] for omega in SPEEDS])


def task() -> Row:
    theirs = lambda: ross_rotor(table(), BEARING)  # noqa: E731
    return Row(
        task="unbalance response, 4 × 6 × 1000, 23 elements",
        our_seconds=best_of(make, ours, 50),
        peer=f"{ROSS} transfer_matrix",
        peer_seconds=best_of(theirs, with_ross, 2),
        difference=relative_difference(ours(make()), with_ross(theirs())),
        required_ratio=1000.0,
        goal=1500.0,
    )
