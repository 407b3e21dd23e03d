"""A rotor as three masses for control design: masses, places, state space, error of the response, model file.

Run `python examples/reduce_for_control.py [MODEL.toml]`; the model file is for `rotorid fit`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from rotorid import read_rotor, reduction
from rotorid.files.settings import toml_bytes
from rotorid.files.small_model import equations_of

ROTOR = Path(__file__).parents[1] / "sample_data" / "rotor23.csv"
NODES = (7, 12, 18)


def main(model: str | None = None) -> dict[str, float]:
    """Print what the small model can do; return its key numbers."""
    rotor = read_rotor(ROTOR)

    # Masses at the book's nodes from two modes, formula (50), and how sure they are.
    small = reduction.reduce(rotor, NODES, 2)
    print(small.summary(), end="\n\n")

    # Of all places of three masses: are these good ones?
    places = reduction.rank_nodes(rotor, 3, 2)
    best = places.nodes[places.compromise]
    print(
        f"a good compromise of all {len(places.nodes)} places: nodes {', '.join(map(str, best))}", end="\n\n"
    )

    # Both planes with bearings and 1 % of modal damping, as matrices A, B, C, D.
    masses = small.masses.solution
    machine = reduction.small_model(rotor, NODES, masses, modal_damping=(0.01, 0.01, 0.01))
    plant = machine.state_space(0.0)
    growth = float(plant.eigenvalues.real.max())
    print(
        f"state space: {len(plant.states)} states, {len(plant.inputs)} inputs, slowest decay {growth:.4f} 1/s"
    )

    # How far its response to unbalance is from the full rotor's, which has no modal damping.
    cost = reduction.compare_response(rotor, machine, np.linspace(20.0, 450.0, 87))
    print(cost.summary())

    if model is not None:
        motion = small.equations_of_motion
        dampers = dict.fromkeys(motion.coordinates, 1000.0)
        Path(model).write_bytes(toml_bytes(equations_of(motion, dampers)))
    return {
        "m7_kg": float(small.masses.solution[0]),
        "m12_kg": float(small.masses.solution[1]),
        "m18_kg": float(small.masses.solution[2]),
        "second_frequency_error": float(small.relative_error[1]),
        "states": len(plant.states),
        "slowest_decay": growth,
        "largest_response_error": float(cost.sizes["largest"]),
    }


if __name__ == "__main__":
    main(*sys.argv[1:2])
