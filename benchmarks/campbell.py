"""Campbell diagram of the reference rotor over 50 speeds, six modes, against ROSS `run_campbell`.

Bearings are anisotropic, damped and cross-coupled; discs and shaft have gyroscopic effect and rotary
inertia. Compared are the eigenvalues λ, frequency and log decrement together, at each speed as a set, since
both programs follow modes in their own ways.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import fem
from benchmarks.rotors import ANISOTROPIC, ROSS, ross_rotor, rotorid_rotor, table
from benchmarks.timing import Row, best_of

SPEEDS = np.linspace(20.0, 1000.0, 50)
MODES = 6


def with_ross(rotor: Any) -> np.ndarray:
    """λ, shape (speeds, modes); axial and torsional modes of this rotor lie higher."""
    diagram = rotor.run_campbell(SPEEDS, frequencies=MODES)
    return diagram.wd * (1j - diagram.log_dec / (2 * np.pi))


def apart(a: np.ndarray, b: np.ndarray) -> float:
    """Largest relative distance of an eigenvalue a to the nearest b, at any speed."""
    distance = np.abs(a[:, :, None] - b[:, None, :]).min(axis=2)
    return float((distance / np.abs(a)).max())


def make(times: int = 1) -> fem.Rotor:
    return rotorid_rotor(table(times), ANISOTROPIC, gyroscopic=True)


def ours(rotor: fem.Rotor) -> np.ndarray:
    return fem.campbell(rotor, SPEEDS, MODES).eigenvalues


def task() -> Row:
    theirs = lambda: ross_rotor(table(), ANISOTROPIC, gyroscopic=True)  # noqa: E731
    return Row(
        task=f"Campbell diagram, {MODES} modes, 50 speeds, 23 elements",
        our_seconds=best_of(make, ours, 10),
        peer=f"{ROSS} run_campbell",
        peer_seconds=best_of(theirs, with_ross, 1),
        difference=apart(ours(make()), with_ross(theirs())),
        required_ratio=30.0,
    )
