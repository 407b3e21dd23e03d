"""Three critical speeds and mode shapes of the 23-element rotor, against ROSS `run_modal`.

ROSS' `run_modal(speed=0)` finds each frequency twice, once per lateral plane, besides the rigid axial and
torsional motions, which its filter drops; `num_modes=10` is the smallest that holds the third speed. Its
sparse and dense ways are both timed, and the faster one counts; `run_critical_speed` calls it several times.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import fem
from benchmarks.rotors import ROSS, ross_rotor, rotorid_rotor, table
from benchmarks.timing import Row, best_of, relative_difference


def with_ross(rotor: Any, sparse: bool) -> np.ndarray:
    return rotor.run_modal(speed=0.0, num_modes=10, sparse=sparse).wn[:5:2]


def run() -> list[Row]:
    rows = table()
    ours = fem.critical_speeds(rotorid_rotor(rows, 0.0), n=3).frequencies
    seconds, sparse = min(
        (best_of(lambda: ross_rotor(rows, 0.0), lambda rotor, way=way: with_ross(rotor, way), 10), way)
        for way in (True, False)
    )
    return [
        Row(
            task="3 critical speeds and shapes, 23 elements",
            ours="rotorid",
            our_seconds=best_of(
                lambda: rotorid_rotor(rows, 0.0), lambda rotor: fem.critical_speeds(rotor, n=3), 50
            ),
            peer=f"{ROSS} run_modal, {'sparse' if sparse else 'dense'}",
            peer_seconds=seconds,
            difference=max(
                relative_difference(ours, with_ross(ross_rotor(rows, 0.0), way)) for way in (True, False)
            ),
            allowed=1e-6,
            required_ratio=20.0,
        )
    ]
