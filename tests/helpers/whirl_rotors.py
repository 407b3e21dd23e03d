"""Rotors for the tests of whirl: gyroscopic, anisotropic, cross-coupled, on tables."""

import numpy as np
from fem_rotors import rotor23

import fem

FULL = fem.Model(rotary_inertia=True, gyroscopic=True)


def machine(times=1, *, cross=True, shear=False):
    """The reference rotor with wheels instead of masses, on bearings that differ in x and y."""
    base = rotor23()
    k = 0.2 if cross else 0.0

    def node(item):
        return times * (item.node - 1) + 1

    return fem.Rotor(
        np.repeat(base.length, times) / times,
        np.repeat(base.outer_diameter, times),
        discs=[fem.Disc(node(d), d.mass, 0.02 * d.mass, 0.01 * d.mass) for d in base.discs],
        supports=[
            fem.Support(
                node(s),
                ((s.stiffness, k * s.stiffness), (-0.5 * k * s.stiffness, 1.6 * s.stiffness)),
                ((2e4, 0.0), (0.0, 3e4)),
            )
            for s in base.supports
        ],
        model=fem.Model(shear, True, True),
    )


def on_tables(rng):
    """A short rotor on tables of stiffness and damping with jumps and dips, and speeds over them."""
    n = int(rng.integers(2, 5))
    disc = rng.uniform(5, 60)
    tilting = disc * rng.uniform(0.005, 0.03)
    knots = np.cumsum(rng.uniform(30.0, 350.0, int(rng.integers(2, 7))))
    supports = []
    for node in rng.choice(np.arange(1, n + 2), 2, replace=False):
        k = disc / 2 * knots**2 * 10 ** rng.uniform(-0.7, 0.7, knots.size)
        c = rng.choice([0.0, 0.004, 0.06, 0.4, 1.4]) * np.sqrt(k * disc) * rng.uniform(0.3, 2, knots.size)
        side = rng.choice([1.0, rng.uniform(0.5, 2.0)])
        cross = rng.choice([0.0, 0.2]) * rng.uniform(-1, 1, knots.size) * k
        stiffness = [((one, q), (-q, side * one)) for one, q in zip(k, cross, strict=True)]
        stand = fem.Pedestal(rng.uniform(1, 20), 1e7, rng.uniform(0, 500)) if rng.random() < 0.15 else None
        supports.append(
            fem.Support(int(node), stiffness, c.tolist(), speeds=tuple(knots.tolist()), pedestal=stand)
        )
    rotor = fem.Rotor(
        rng.uniform(0.05, 0.25, n),
        rng.uniform(0.03, 0.12),
        discs=[fem.Disc(int(rng.integers(1, n + 2)), disc, tilting * rng.uniform(0.3, 1.9), tilting)],
        supports=supports,
        material_damping=float(rng.choice([0.0, 1e-5])),
        model=fem.Model(rotary_inertia=True, gyroscopic=bool(rng.random() < 0.7)),
    )
    return rotor, np.linspace(knots[0], knots[-1], int(rng.choice([2, 3, 5, 12, 40])))
