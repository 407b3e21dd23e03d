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
from scipy.signal import StateSpace as ScipyStateSpace
from scipy.signal import lsim

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
    keep = np.abs(b) > 1e-7 * np.abs(a)
    return a[keep] / b[keep]


def farthest(found, expected):
    """Largest relative difference of two sets of eigenvalues."""
    assert len(found) == len(expected)
    distance = np.abs(found[:, None] - expected) / np.abs(expected)
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
    unit = np.abs(H @ dynamic - np.eye(len(motion.M)))
    assert (
        unit.max(axis=(1, 2)) < 1e-10 * np.abs(H).max(axis=(1, 2)) * np.abs(dynamic).max(axis=(1, 2))
    ).all()


def test_feedthrough_of_a_force_on_a_massless_undamped_output():
    """A mass on two springs in series; a force on the point between moves it at once by f/(k1 + k2)."""
    k1, k2 = 3.0, 5.0
    model = state_space(motion_of(np.diag([1.0, 0.0]), np.zeros((2, 2)), [[k1, -k1], [-k1, k1 + k2]]))
    assert model.states == ("x1", "v_x1")
    np.testing.assert_allclose(model.D, [[0, 0], [0, 1 / (k1 + k2)]], atol=1e-15)
    np.testing.assert_allclose(model.A, [[0, 1], [-k1 * k2 / (k1 + k2), 0]], atol=1e-15)
    np.testing.assert_allclose(model.B, [[0, 0], [1, k1 / (k1 + k2)]], atol=1e-15)
    np.testing.assert_allclose(model.C, [[1, 0], [k1 / (k1 + k2), 0]], atol=1e-15)


def test_a_damper_and_a_spring_without_mass_creep():
    k, c = 4.0, 2.0
    model = state_space(motion_of(0.0, c, k), outputs=["x1"])
    assert model.states == ("damped1",)
    t = np.linspace(0.0, 3.0, 61)
    _, y, _ = lsim(ScipyStateSpace(*model), np.ones_like(t), t)
    np.testing.assert_allclose(y, (1 - np.exp(-k * t / c)) / k, atol=1e-12)


def test_it_unpacks_into_its_matrices():
    motion, _ = random_motion(11, 2, 1, 1)
    model = state_space(motion, inputs=["f_x2", "f_x1"], outputs=["x3", "x1"])
    A, B, C, D = model
    assert (A is model.A, B is model.B, C is model.C, D is model.D) == (True,) * 4
    omega = np.array([0.4, 2.0])
    dynamic = motion.K + 1j * omega[:, None, None] * motion.C - omega[:, None, None] ** 2 * motion.M
    expected = np.linalg.inv(dynamic)[:, [2, 0]][:, :, [1, 0]]
    np.testing.assert_allclose(frequency_response(model, omega), expected, rtol=1e-10)


def test_velocities():
    motion, _ = random_motion(2, 2, 2, 1)
    massive = [name for name, row in zip(motion.coordinates, motion.M, strict=True) if row.any()]
    model = state_space(motion, outputs=[*massive, *(f"v_{name}" for name in massive)])
    H = frequency_response(model, [0.9, 2.5])
    iw = 1j * np.array([0.9, 2.5])[:, None, None]
    np.testing.assert_allclose(H[:, 2:], iw * H[:, :2], rtol=1e-9, atol=1e-12)
    light = min(set(motion.coordinates) - set(massive))
    with pytest.raises(ValueError, match=f"no output 'v_{light}'"):
        state_space(motion, outputs=[f"v_{light}"])


def test_a_shaft_with_shear_but_without_rotary_inertia_is_refused():
    """Its mass matrix is singular without a zero row."""
    rotor = fem.Rotor(
        [0.1] * 8, 0.05, supports=[fem.Support(1, 1e7), fem.Support(9, 1e7)], model=fem.Model(shear=True)
    )
    with pytest.raises(ValueError, match=r"singular without a zero row.*rotary inertia"):
        state_space(fem.equations_of_motion(rotor))


def test_little_damping_on_a_massless_coordinate_costs_no_digits():
    """A spring of two halves; at the point between them a damper c: one eigenvalue near −(k1 + k2)/c."""
    k1, k2 = 3e8, 5e8
    for c in (1e-2, 1e-5):
        motion = motion_of(np.diag([10.0, 0.0]), np.diag([0.0, c]), [[k1, -k1], [-k1, k1 + k2]])
        found = state_space(motion).eigenvalues
        assert len(found) == 3
        slow = found[np.abs(found) < 1e5]
        root = np.sqrt(k1 * k2 / (k1 + k2) / 10.0)
        decay = -0.5 * c * (k1 / (k1 + k2)) ** 2 / 10.0  # of first order in c
        np.testing.assert_allclose(np.abs(slow.imag), root, rtol=1e-12)
        np.testing.assert_allclose(slow.real, decay, rtol=1e-5, atol=1e-14 * root)


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
            assert np.abs(model.eigenvalues - value).min() < 1e-9 * abs(value)
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
        (np.eye(2), np.eye(2), np.eye(3)[:2], "inhomogeneous"),
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
        ({"outputs": ["v_x3"]}, "no output 'v_x3'"),
    ):
        with pytest.raises(ValueError, match=message):
            state_space(motion, **choice)


def test_an_undamped_system():
    model = state_space(motion_of(1.0, 0.0, 4.0))
    assert frequency_response(model, 1.0)[0, 0, 0] == pytest.approx(1 / 3)
    document = model.to_dict()
    assert document["A"] == [[0.0, 1.0], [-4.0, 0.0]]
    assert document["states"] == ["x1", "v_x1"]
