"""Rotors for the tests of `fem`."""

import csv
from pathlib import Path

import numpy as np
from hypothesis import strategies as st

import fem

ROOT = Path(__file__).resolve().parents[2]


def rotor23(damping=0.0):
    with (ROOT / "sample_data" / "rotor23.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    column = {name: [float(row[name] or 0) for row in rows] for name in rows[0]}
    return fem.Rotor(
        column["length_m"],
        column["diameter_m"],
        discs=[fem.Disc(n, m) for n, m in enumerate(column["mass_kg"], 1) if m],
        supports=[
            fem.Support(n, k, damping) for n, k in enumerate(column["support_stiffness_N_per_m"], 1) if k
        ],
    )


def uniform(n, *, length=1.0, diameter=0.1, **others):
    return fem.Rotor(np.full(n, length / n), diameter, density=7850.0, **others)


@st.composite
def machines(draw, elements=(2, 24), tables=True):
    """Rotors with everything: any model, discs with inertia, cross-coupled and tabulated damped bearings."""
    n = draw(st.integers(*elements))
    kind = draw(st.sampled_from(("symmetric", "anisotropic")))
    model = fem.Model(draw(st.booleans()), draw(st.booleans()), draw(st.booleans()))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))

    def matrix(size):
        if kind == "symmetric":
            cross = size * rng.uniform(-0.2, 0.2)
            return ((size, cross), (-cross, size))
        return (
            (size, size * rng.uniform(-0.3, 0.3)),
            (size * rng.uniform(-0.3, 0.3), size * rng.uniform(0.4, 2)),
        )

    def pedestal():
        if rng.random() < 0.6:
            return None
        mass = rng.choice([0.0, rng.uniform(0, 50)])
        k, c = 10 ** rng.uniform(7, 9), 10 ** rng.uniform(3, 4)
        if kind == "symmetric":
            return fem.Pedestal(mass, k, c)
        return fem.Pedestal(mass, (k, k * rng.uniform(0.3, 1)), (c, c * rng.uniform(0, 1)))

    supports = []
    for node in rng.choice(np.arange(1, n + 2), size=min(n + 1, int(rng.integers(2, 4))), replace=False):
        k, c = 10 ** rng.uniform(6, 8.5), 10 ** rng.uniform(3, 4.5)
        speeds = ()
        stiffness, damping = matrix(k), matrix(c)
        if tables and rng.random() < 0.4:
            speeds = (0.0, 500.0, 1500.0, 6000.0)
            stiffness = [matrix(k * rng.uniform(0.5, 2)) for _ in speeds]
            damping = [matrix(c * rng.uniform(0.5, 2)) for _ in speeds]
        supports.append(fem.Support(int(node), stiffness, damping, speeds=speeds, pedestal=pedestal()))
    outer = rng.uniform(0.04, 0.12, n)
    return fem.Rotor(
        rng.uniform(0.05, 0.25, n),
        outer,
        np.where(rng.random(n) < 0.3, outer * rng.uniform(0.2, 0.8, n), 0.0),
        youngs_modulus=rng.uniform(1e11, 2.2e11, n),
        density=rng.uniform(2700, 8000, n),
        poisson_ratio=rng.uniform(0.2, 0.35, n),
        material_damping=draw(st.sampled_from([0.0, 2e-6])) * rng.random(n),
        discs=[
            fem.Disc.from_geometry(int(node), rng.uniform(0.02, 0.1), rng.uniform(0.15, 0.4))
            for node in rng.integers(1, n + 2, rng.integers(0, 4))
        ],
        supports=supports,
        model=model,
    )
