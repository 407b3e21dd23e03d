"""Rotors for the tests of whirl: gyroscopic, anisotropic, cross-coupled, on pedestals."""

import numpy as np
from fem_rotors import rotor23
from hypothesis import strategies as st

import fem

FULL = fem.Model(rotary_inertia=True, gyroscopic=True)


def machine(times=1, *, cross=True, shear=False, material=0.0):
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
        material_damping=material,
        model=fem.Model(shear, True, True),
    )


@st.composite
def whirling_rotors(draw, elements=(3, 20)):
    """As machines have them: discs, hollow sections, tabulated and cross-coupled bearings, pedestals."""
    n = draw(st.integers(*elements))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    outer = rng.uniform(0.04, 0.2, n)

    def coefficient(low, high):
        size = 10 ** rng.uniform(low, high)
        kind = rng.integers(3)
        if kind == 0:
            return size
        cross = rng.uniform(-0.5, 0.5, 2) * size
        return ((size, cross[0]), (-cross[0] if kind == 1 else cross[1], size * rng.uniform(0.5, 2.0)))

    supports = []
    for node in rng.choice(np.arange(1, n + 2), size=min(n + 1, int(rng.integers(2, 4))), replace=False):
        speeds = (0.0, 300.0, 1000.0) if rng.random() < 0.3 else ()
        count = len(speeds) or 1
        k = [coefficient(7, 8.5) for _ in range(count)]
        c = [coefficient(2, 4.5) for _ in range(count)]
        pedestal = None
        if rng.random() < 0.3:
            mass = rng.choice([0.0, rng.uniform(10, 200)])
            pedestal = fem.Pedestal(
                mass, (10 ** rng.uniform(7.5, 9), 10 ** rng.uniform(7.5, 9)), rng.uniform(0, 1e4)
            )
        supports.append(
            fem.Support(int(node), *((k, c) if speeds else (k[0], c[0])), speeds=speeds, pedestal=pedestal)
        )
    discs = []
    for node in rng.integers(1, n + 2, rng.integers(0, 5)):
        mass = rng.uniform(1, 100)
        tilting = mass * rng.uniform(0.005, 0.03)
        discs.append(fem.Disc(int(node), mass, tilting * rng.uniform(0.5, 2.0), tilting))
    return fem.Rotor(
        rng.uniform(0.05, 0.3, n),
        outer,
        np.where(rng.random(n) < 0.3, outer * rng.uniform(0.2, 0.8, n), 0.0),
        youngs_modulus=rng.uniform(1e11, 2.2e11, n),
        density=rng.uniform(2700, 8000, n),
        material_damping=rng.choice([0.0, 1e-6]) * rng.random(n),
        discs=discs,
        supports=supports,
        model=fem.Model(bool(rng.random() < 0.4), bool(rng.random() < 0.7), bool(rng.random() < 0.8)),
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
