"""State space with massless coordinates: eigenvalues, frequency response and feedthrough, refusals."""

from __future__ import annotations

import numpy as np
import pytest
from cases import each_of
from exact_solutions import frequency_response, whirl_exactly
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import eigvals
from scipy.optimize import linear_sum_assignment

import fem
from fem import state_space


def motion_of(M, C, K, names=None):
    M, C, K = (np.atleast_2d(np.asarray(X, dtype=float)) for X in (M, C, K))
    return fem.Motion(M, C, K, names or tuple(f"x{i + 1}" for i in range(len(M))), 0.0)


def finite_eigenvalues(motion):
    """Of the generalised problem, by QZ; as many as the determinant's degree leaves."""
    n = len(motion.M)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-motion.K, -motion.C]])
    E = np.block([[np.eye(n), np.zeros((n, n))], [np.zeros((n, n)), motion.M]])
    a, b = eigvals(A, E, homogeneous_eigvals=True)
    keep = abs(b) > 1e-7 * abs(a)
    return a[keep] / b[keep]


def farthest(found, expected):
    """Largest relative difference of two sets of eigenvalues."""
    assert len(found) == len(expected)
    distance = abs(found[:, None] - expected) / abs(expected)
    return distance[linear_sum_assignment(distance)].max()


def random_motion(seed, massive, damped, light):
    """Nonsymmetric C and K; some massless coordinates are damped, the others not."""
    rng = np.random.default_rng(seed)
    n = massive + damped + light
    R = rng.normal(size=(massive, massive))
    M = np.zeros((n, n))
    M[:massive, :massive] = R @ R.T + np.eye(massive)
    K = 0.5 * rng.normal(size=(n, n)) + 4 * np.eye(n)
    C = 0.3 * rng.normal(size=(n, n))
    C[massive : n - light, massive : n - light] = np.eye(damped) + 0.2 * rng.normal(size=(damped, damped))
    C[n - light :], C[:, n - light :] = 0.0, 0.0
    mixed = rng.permutation(n)
    return motion_of(*(X[np.ix_(mixed, mixed)] for X in (M, C, K))), 2 * massive + damped


systems = st.builds(
    random_motion, st.integers(0, 2**32 - 1), st.integers(1, 4), st.integers(0, 4), st.integers(0, 4)
)


@settings(max_examples=150, deadline=None)
@given(systems)
def test_random_systems_keep_eigenvalues_and_receptance(drawn):
    motion, order = drawn
    model = state_space(motion)
    assert model.A.shape == (order, order)
    assert len(model.states) == len(set(model.states)) == order
    assert farthest(model.eigenvalues, finite_eigenvalues(motion)) < 1e-10
    omega = np.array([0.0, 0.7, 3.1, 40.0])
    w = omega[:, None, None]
    dynamic = motion.K + 1j * w * motion.C - w * w * motion.M
    H = frequency_response(model, omega)
    unit = abs(H @ dynamic - np.eye(len(motion.M)))
    assert (unit.max(axis=(1, 2)) < 1e-10 * abs(H).max(axis=(1, 2)) * abs(dynamic).max(axis=(1, 2))).all()


def test_a_rotor_with_massless_pedestals_and_shaft():
    """A massless shaft with discs, on damped cross-coupled bearings; one on a foot that is damped in y."""
    rotor = fem.Rotor(
        [0.1] * 6,
        0.05,
        density=0.0,
        discs=[fem.Disc(3, 10.0, 0.3, 0.2), fem.Disc(5, 6.0, 0.2, 0.1)],
        supports=[
            fem.Support(1, ((1e7, 2e6), (-1e6, 2e7)), ((800.0, 10.0), (20.0, 600.0))),
            fem.Support(6, 2e7, 300.0, pedestal=fem.Pedestal(0.0, (5e7, 3e7), (0.0, 400.0))),
        ],
        model=fem.Model(rotary_inertia=True, gyroscopic=True),
    )
    for speed in (0.0, 400.0):
        motion = fem.equations_of_motion(rotor, speed=speed)
        model = state_space(motion, inputs=(), outputs=())
        assert len(model.A) == 2 * 8 + 5  # node 1, node 6 against its foot, and y of the foot
        theirs = whirl_exactly(rotor, speed, 6).eigenvalues
        for value in theirs:
            assert abs(model.eigenvalues - value).min() < 1e-9 * abs(value)
        assert model.speed == speed


@each_of(
    ("M", "C", "K", "message"),
    [
        # y is held by nothing
        (np.diag([1.0, 0.0]), np.zeros((2, 2)), np.diag([1.0, 0.0]), "held neither"),
        # a constraint x = g: index 3
        (np.diag([1.0, 0.0]), np.zeros((2, 2)), [[1.0, 1.0], [1.0, 0.0]], "held neither"),
        # two massless points joined by a spring only
        (
            np.diag([1.0, 0, 0]),
            np.zeros((3, 3)),
            [[1.0, 0, 0], [0, 1e8, -1e8], [0, -1e8, 1e8]],
            "held neither",
        ),
        # no mass where x1 = −x2
        (np.ones((2, 2)), 0.5 * np.eye(2), np.eye(2), "singular without a zero row"),
        # damping by the velocity of a coordinate that has neither mass nor damping
        (np.diag([2.0, 0]), [[0, 0.6], [0.5, 0]], np.diag([8.0, 3.0]), "not damped themselves"),
        (np.eye(2), np.eye(2), [[1.0, np.nan], [0, 1]], "2 coordinates needs finite matrices, 2 × 2"),
    ],
)
def test_what_has_no_state_space_is_refused(M, C, K, message):
    M, C, K = (np.asarray(X, dtype=float) for X in (M, C, K))
    motion = fem.Motion(M, C, K, tuple(f"x{i + 1}" for i in range(len(M))), 0.0)
    with pytest.raises(ValueError, match=message):
        state_space(motion)


def test_names_are_checked():
    motion = motion_of(np.eye(2), np.eye(2), np.eye(2))
    for choice, message in (
        ({"inputs": ["x1"]}, "no input 'x1': they are f_x1 … f_x2"),
        ({"outputs": ["x3"]}, "no output 'x3'"),
    ):
        with pytest.raises(ValueError, match=message):
            state_space(motion, **choice)
