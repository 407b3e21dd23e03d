"""A disc in the middle of a massless shaft, on bearings that are far stiffer."""

import math

import fem

MASS, SHAFT, DIAMETER = 20.0, 1.0, 0.03
STIFFNESS = 48 * fem.STEEL_MODULUS * math.pi / 64 * DIAMETER**4 / SHAFT**3  # of a simply supported shaft
CRITICAL = math.sqrt(STIFFNESS / MASS)
BEARING = 1e13
"""N/m; they take 2e-8 of the shaft's stiffness away."""


def jeffcott(*supports, material=0.0):
    """The rotor, with more supports."""
    return fem.Rotor(
        [SHAFT / 2, SHAFT / 2],
        DIAMETER,
        density=0.0,
        discs=[fem.Disc(2, MASS)],
        supports=[fem.Support(1, BEARING), fem.Support(3, BEARING), *supports],
        material_damping=material,
    )
