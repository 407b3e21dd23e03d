"""The rotor of 23 elements, [S] task 9.1: its critical speeds and mode shapes."""

from __future__ import annotations

import fem
from rotorid.samples import sample_data
from rotorid.tables import read_rotor
from rotorid.validation.row import Row, number, printed_table, row

SPEEDS = "[S] task 9.1, critical speeds"
SHAPES = "[S] task 9.1, mode shapes"
RELATIVE = 1e-5
ABSOLUTE = 4e-5


def rows() -> list[Row]:
    """Three critical speeds and three shapes at 24 nodes, from the element table of the sample data.

    Euler-Bernoulli elements with consistent masses, no shear, no rotary inertia, E = 2.1e11 Pa and
    density 7800 kg/m³, which are the defaults of a rotor table.
    """
    rotor = read_rotor(sample_data() / "rotor23.csv")
    modes = fem.critical_speeds(rotor, 3)
    speeds, *nodes = printed_table("rotor23_modes.csv")
    shapes = modes.shapes / modes.shapes[0]
    found = [
        row(
            SPEEDS,
            f"critical speed {k + 1}, rad/s",
            speeds[f"mode{k + 1}"],
            float(modes.frequencies[k]),
            RELATIVE * number(speeds[f"mode{k + 1}"]),
            "1e-5 of the number: the original computed in single precision",
        )
        for k in range(3)
    ]
    found += [
        row(
            SHAPES,
            f"mode {k + 1}, node {line['node']}",
            line[f"mode{k + 1}"],
            float(shapes[int(line["node"]) - 1, k]),
            ABSOLUTE,
            "4e-5 absolute, shapes being 1 at node 1: the original computed in single precision",
        )
        for k in range(3)
        for line in nodes
    ]
    return found
