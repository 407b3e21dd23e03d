"""Closed forms where nothing is printed: seal in (50), damping of supports and of material, two speeds."""

from __future__ import annotations

import math

import numpy as np

import fem
from balancing import Influence, Labels, correct
from rotorid.reduction import equivalent_masses
from rotorid.validation.row import Row, row

MASS = 20.0


def rows() -> list[Row]:
    """All rows of the closed forms, to eight digits."""
    return [*_seal(), *_damping(), *_two_speeds()]


def _seal() -> list[Row]:
    """Three masses on a string of four springs k, the middle one on a seal c, too; two of their modes."""
    k, c = 2e6, 1.5e6
    alpha = np.array([[3, 2, 1], [2, 4, 2], [1, 2, 3]]) / (4 * k)
    squares = np.array([(4 * k + c - math.sqrt(c * c + 8 * k * k)) / (2 * MASS), 2 * k / MASS])
    shapes = np.array([[1, 1], [2 - MASS * squares[0] / k, 0], [1, -1]])
    found = equivalent_masses(alpha, np.sqrt(squares), shapes, seal_stiffness=[0, c, 0]).values.tolist()
    return [
        row("closed form, (50) with a seal", f"m{i}, kg", f"{MASS:.7e}", m) for i, m in enumerate(found, 1)
    ]


def _damping() -> list[Row]:
    """A disc on a massless shaft: m s² and, in series, ks (1 + β (s − iΩ)) and both supports, 2 (k + c s)."""
    k, c, beta, ks, speed = 1e6, 800.0, 2e-5, 48 * 2.1e11 * math.pi * 0.05**4 / 64, 300.0
    rotor = fem.Rotor(
        *(np.array([0.5, 0.5]), np.array([0.05])),
        density=np.array(0.0),
        material_damping=np.array(beta),
        discs=[fem.Disc(2, MASS)],
        supports=[fem.Support(node, k, c) for node in (1, 3)],
    )
    shaft, supports = np.poly1d([beta, 1 - 1j * beta * speed]) * ks, np.poly1d([2 * c, 2 * k])
    s = (np.poly1d([MASS, 0, 0]) * (shaft + supports) + shaft * supports).roots
    exact = sorted(s[np.argsort(np.abs(s.real))][:2], key=lambda root: root.imag)
    modes = fem.whirl_modes(rotor, speed, 2)
    backward, forward = modes.eigenvalues[np.argsort(modes.direction)].tolist()
    stiffness = 1 / (1 / ks + 1 / supports(1j * speed))
    moved = complex(fem.unbalance_response(rotor, {2: 1.0}, speed).amplitudes[0, 1])
    source = "damped supports and material"
    return [
        *_parts(source, "backward whirl, 1/s", exact[0].conjugate(), backward),
        *_parts(source, "forward whirl, 1/s", exact[1], forward),
        *_parts(source, "response to 1 kg m, m", speed**2 / (stiffness - MASS * speed**2), moved),
    ]


def _two_speeds() -> list[Row]:
    """One plane and one sensor at two speeds: D = −Σ W̄ Y / Σ |W|²."""
    W, Y = np.array([[[2 + 1j]], [[1 - 3j]]]), np.array([[4 - 1j], [2 + 5j]])
    exact = -((2 - 1j) * (4 - 1j) + (1 + 3j) * (2 + 5j)) / (5 + 10)
    influence = Influence(np.array([1.0, 2.0]), ("1",), ("A",), W, labels=Labels())
    found = correct(influence, Y, method="least-squares").weights.tolist()
    return _parts("least squares over two speeds", "weight", exact, found[0])


def _parts(source: str, quantity: str, exact: complex, computed: complex) -> list[Row]:
    """Real and imaginary part."""
    parts = {"real": (exact.real, computed.real), "imaginary": (exact.imag, computed.imag)}
    return [
        row(f"closed form, {source}", f"{quantity}, {part} part", f"{right:.7e}", found)
        for part, (right, found) in parts.items()
    ]
