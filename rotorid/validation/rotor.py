"""The rotor of 23 elements, [S] task 9.1: its critical speeds and mode shapes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import fem
from rotorid.samples import sample_data
from rotorid.tables import read_rotor
from rotorid.validation.row import Row, printed_table, row

SPEEDS = "[S] task 9.1, critical speeds"
SHAPES = "[S] task 9.1, mode shapes"
RELATIVE = 1e-5, "1e-5 of the number: the original computed in single precision"
ABSOLUTE = 4e-5, "4e-5 absolute, shapes being 1 at node 1: the original computed in single precision"


def rows() -> list[Row]:
    """Three critical speeds and three shapes at 24 nodes, from the element table of the sample data.

    Euler-Bernoulli elements with consistent masses, no shear, no rotary inertia, E = 2.1e11 Pa and
    density 7800 kg/m³, which are the defaults of a rotor table.
    """
    rotor = read_rotor(sample_data() / "rotor23.csv")
    modes = fem.critical_speeds(rotor, 3)
    speeds, *nodes = printed_table("rotor23_modes.csv")
    shapes = modes.shapes / modes.shapes[0]
    found = []
    for k, omega in enumerate(modes.frequencies.tolist(), start=1):
        tolerance = RELATIVE[0] * omega
        name = f"critical speed {k}, rad/s"
        found.append(row(SPEEDS, name, speeds[f"mode{k}"], omega, tolerance, RELATIVE[1]))
    for (i, k), amplitude in np.ndenumerate(shapes.T):
        name, line = f"mode {i + 1}, node {k + 1}", nodes[k]
        shown = row(SHAPES, name, line[f"mode{i + 1}"], amplitude, *ABSOLUTE)
        found.append(replace(shown, kind="number" if k else "given"))
    return found
