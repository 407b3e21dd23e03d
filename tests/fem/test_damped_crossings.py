"""Damped critical speeds over tabulated bearings: none is missed, also not two between two speeds."""

import dense_rotor
import numpy as np
from repetitions import FULL

import fem

DRAWN = 200 if FULL else 20
SCAN = 500 if FULL else 150
HEAVY = 0.69  # damping ratio of a decrement of 6; beyond, modes are not counted


def drawn(rng):
    """A short rotor on tables of stiffness and damping with jumps and dips, and the speeds asked for."""
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


def eigenvalues(rotor, speeds):
    """All of them, shape (S, 2 N), from dense matrices, which are linear between the knots of the tables."""
    knots = np.array(rotor.supports[0].speeds)
    at = [dense_rotor.assemble(rotor, knot) for knot in knots]
    i = np.clip(np.searchsorted(knots, speeds) - 1, 0, knots.size - 2)
    part = ((speeds - knots[i]) / np.diff(knots)[i])[:, None, None]
    C, K = (
        np.stack([getattr(D, name) for D in at])[i] * (1 - part)
        + np.stack([getattr(D, name) for D in at])[i + 1] * part
        for name in ("C", "K")
    )
    M, size, shift = at[0].M, len(at[0].M), 91.0
    companion = np.zeros((speeds.size, 2 * size, 2 * size))
    companion[:, :size] = -np.linalg.solve(
        K + shift * C + shift**2 * M,
        np.concatenate((C + 2 * shift * M, np.broadcast_to(M, C.shape)), axis=2),
    )
    companion[:, size:, :size] = np.eye(size)
    return 1 / np.linalg.eigvals(companion) + shift


def missed(rotor, asked):
    """Steps of a dense scan in which the answer and the number of modes below the 1× line disagree."""
    found = fem.campbell(rotor, asked, 12)
    for speed in found.critical_speeds:
        lam = eigenvalues(rotor, np.array([speed]))[0]
        assert np.abs(np.abs(lam.imag) - speed).min() < 1e-6 * speed
    if found.cut:
        return 0
    speeds = np.linspace(asked[0], asked[-1], SCAN)
    # What does not oscillate is below the line: a mode that ceases to oscillate crosses it before.
    below = (np.abs(eigenvalues(rotor, speeds).imag) < speeds[:, None]).sum(axis=1) // 2
    there = np.histogram(found.critical_speeds, speeds)[0]
    extra = there - np.abs(np.diff(below))
    wrong = np.flatnonzero((extra < 0) | (extra % 2 != 0))
    # Heavy ones come and go, by rounding alone where they are double: what passes there must be light.
    passed = [
        light_crossings(*eigenvalues(rotor, speeds[k : k + 2]), speeds[k : k + 2]) for k in wrong.tolist()
    ]
    return sum(n > there[k] for n, k in zip(passed, wrong.tolist(), strict=True))


def light_crossings(one, other, speeds):
    """How many lightly damped modes cross the 1× line in a step, each the nearest to one before it."""
    one = one[(one.imag > 0) & (-one.real < HEAVY * np.abs(one))]
    other = other[np.abs(one[:, None] - other).argmin(axis=1)]
    return int(((one.imag > speeds[0]) != (other.imag > speeds[1])).sum())


def test_no_damped_crossing_is_missed_in_drawn_tables():
    rng = np.random.default_rng(16)
    wrong = {number: count for number in range(DRAWN) if (count := missed(*drawn(rng)))}
    assert wrong == {}
