"""Campbell diagram of the reference rotor over 50 speeds, six modes, against ROSS `run_campbell`.

Bearings are anisotropic, damped and cross-coupled; discs and shaft have gyroscopic effect and rotary inertia.
At 92 and 460 elements ROSS is timed at 8 and 1 of the 50 speeds and its time scaled up; at 460 with four
modes only, because with six ARPACK takes minutes for one speed: the ratio is a lower bound.

Answers are eigenvalues λ: frequency and log decrement together. At 23 elements all are compared with those of
ROSS, at each speed as a set, since both programs follow modes in their own ways. On finer meshes all six are
compared at one speed with the same equations solved in higher precision (tests/helpers/dense_rotor.py); the
note says how far ROSS is from those.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import fem
from benchmarks.rotors import ANISOTROPIC, ROSS, SIZES, judge, ross_rotor, rotorid_rotor, table
from benchmarks.timing import Row, best_of, once, scaling
from fem import campbell

SPEEDS = np.linspace(20.0, 1000.0, 50)
JUDGED = 25  # index of the speed in higher precision
MODES = 6
REQUIRED = 30.0


def with_ross(rotor: Any, speeds: np.ndarray) -> np.ndarray:
    """λ, shape (speeds, modes); axial and torsional modes of this rotor lie higher."""
    found = rotor.run_campbell(speeds, frequencies=4 if len(rotor.nodes) > 400 else MODES)
    return found.wd * (1j - found.log_dec / (2 * np.pi))


def apart(ours: np.ndarray, theirs: np.ndarray) -> float:
    """Largest relative distance of an eigenvalue of ours to the nearest one of theirs, at any speed."""
    distance = np.abs(ours[:, :, None] - theirs[:, None, :]).min(axis=2)
    return float((distance / np.abs(ours)).max())


def trusted(rotor: fem.Rotor, speed: float, values: np.ndarray) -> np.ndarray:
    return np.array([complex(judge().polished(rotor, speed, value, steps=2)[0]) for value in values])


def task() -> Row:
    return run({23: SIZES[23]})[0]


def run(sizes: dict[int, int] = SIZES) -> list[Row]:
    result: list[Row] = []
    seconds: dict[int, float] = {}
    for n, times in sizes.items():
        rows = table(times)
        make = lambda rows=rows: rotorid_rotor(rows, ANISOTROPIC, gyroscopic=True)  # noqa: E731
        theirs = lambda rows=rows: ross_rotor(rows, ANISOTROPIC, gyroscopic=True)  # noqa: E731
        seconds[n] = best_of(make, lambda rotor: campbell(rotor, SPEEDS, MODES), 10)
        ours = campbell(make(), SPEEDS, MODES).eigenvalues
        if n == 23:
            peer, note, scaled = best_of(theirs, lambda rotor: with_ross(rotor, SPEEDS), 1), "", ""
            difference = apart(ours, with_ross(theirs(), SPEEDS))
        else:
            some = SPEEDS[JUDGED : JUDGED + (8 if n == 92 else 1)]
            duration, found = once(theirs, lambda rotor, some=some: with_ross(rotor, some))
            peer, scaled = duration * len(SPEEDS) / len(some), f", {len(some)}/50 speeds"
            higher = trusted(make(), SPEEDS[JUDGED], ours[JUDGED])[None]
            difference = apart(ours[JUDGED][None], higher)
            note = f"of 19-digit arithmetic; {ROSS} is off by {apart(found[:1], higher):.0e}"
        result.append(
            Row(
                task=f"Campbell diagram, 6 modes, 50 speeds, {n} elements",
                ours="rotorid",
                our_seconds=seconds[n],
                peer=f"{ROSS} run_campbell{scaled}",
                peer_seconds=peer,
                difference=difference,
                allowed=1e-6,
                required_ratio=max([REQUIRED, *(row.ratio for row in result)]),
                note=note,
            )
        )
    if len(sizes) == 1:
        return result
    return [*result, scaling("Campbell diagram, 50 speeds", seconds, 92, 460)]
