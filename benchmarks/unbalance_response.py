"""Unbalance response, 4 planes × 6 sensors × 1000 speeds, of the 23-element rotor on damped bearings.

Against ROSS' `Rotor.transfer_matrix`, called once per speed: the fastest public way to these numbers.
`run_freq_response` and `run_unbalance_response` call it, too, and then store receptances of all unknowns
(1 GB here) or repeat work per plane; both take longer. The receptance between sensor and plane in the
x-direction times ω² is the influence coefficient.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import fem
from benchmarks.rotors import ROSS, ross_rotor, rotorid_rotor, table
from benchmarks.timing import Row, best_of, relative_difference

DAMPING = 2e4  # N·s/m at both bearings
PLANES = (3, 8, 14, 20)
SENSORS = (2, 6, 10, 15, 18, 22)
SPEEDS = np.linspace(1.0, 1000.0, 1000)  # across the first two critical speeds


def with_ross(rotor: Any) -> np.ndarray:
    step = rotor.number_dof
    pick = np.ix_([step * (n - 1) for n in SENSORS], [step * (n - 1) for n in PLANES])
    return np.array([omega**2 * rotor.transfer_matrix(speed=omega)[pick] for omega in SPEEDS])


def run() -> list[Row]:
    rows = table()
    theirs = with_ross(ross_rotor(rows, DAMPING))
    seconds = best_of(lambda: ross_rotor(rows, DAMPING), with_ross, 2)
    return [
        Row(
            task=f"unbalance response, 4 × 6 × 1000, 23 elements{note}",
            ours=f"rotorid {method}",
            our_seconds=best_of(
                lambda: rotorid_rotor(rows, DAMPING),
                lambda rotor, method=method: fem.influence(rotor, PLANES, SENSORS, SPEEDS, method=method),
                repeat,
            ),
            peer=f"{ROSS} transfer_matrix",
            peer_seconds=seconds,
            difference=relative_difference(
                fem.influence(rotorid_rotor(rows, DAMPING), PLANES, SENSORS, SPEEDS, method=method).W, theirs
            ),
            allowed=1e-6,
            required_ratio=required,
        )
        for method, note, repeat, required in (("fast", "", 50, 500.0), ("exact", ", check", 5, 20.0))
    ]
