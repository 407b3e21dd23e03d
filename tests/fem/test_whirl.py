import dataclasses
import math

import numpy as np
import pytest
from dense_rotor import whirl as dense_whirl
from exact_solutions import whirl_exactly
from fem_rotors import rotor23, uniform
from hypothesis import given, settings
from hypothesis import strategies as st
from whirl_rotors import FULL, machine, whirling_rotors

import fem
from fem import solve_whirl
from fem.assembly import both_planes
from fem.whirl import polish


def relative(found, expected):
    return float(np.max(np.abs(found - expected) / np.abs(expected)))


@settings(max_examples=15, deadline=None)
@given(whirling_rotors(), st.floats(0.0, 1000.0))
def test_fast_is_exact(rotor, speed):
    n = 6
    fast = fem.whirl_modes(rotor, speed, n)
    exact = whirl_exactly(rotor, speed, n)
    assert relative(fast.eigenvalues, exact.eigenvalues) < 1e-7
    assert fast.error < 1e-7


@settings(max_examples=10, deadline=None)
@given(whirling_rotors())
def test_one_basis_serves_all_speeds(rotor):
    whirl = solve_whirl(both_planes(rotor), np.linspace(0.0, 1000.0, 31), 6)
    for k in (1, 12, 29):
        exact = whirl_exactly(rotor, whirl.speeds[k], 6)
        light = exact.eigenvalues[exact.log_decrements < 6]
        mine = whirl.values[k][np.isfinite(whirl.values[k])]
        mine = np.where(mine.imag < 0, mine.conj(), mine)
        assert (np.abs(mine[:, None] - light).min(axis=0) < 1e-8 * np.abs(light)).all()


def test_pairs_are_polished():
    whirl = solve_whirl(both_planes(machine()), np.array([100.0, 700.0]), 6)
    at, mode = np.array([0, 1, 1]), np.array([2, 0, 5])
    values, vectors = whirl.values[at, mode], whirl.vectors[at, mode]
    near = vectors + 1e-3 * np.exp(1j * np.arange(vectors.shape[1]))
    near /= np.linalg.norm(near, axis=1)[:, None]
    found, shapes = polish(whirl.Q, whirl.speeds, at, 1.001 * values, near, 4)
    np.testing.assert_allclose(found, values, rtol=1e-11)
    np.testing.assert_allclose(np.abs((shapes.conj() * vectors).sum(axis=1)), 1.0, rtol=1e-9)


def test_what_does_no_work_is_not_in_the_decay():
    """Undamped, not even by rounding; with 1e-10 s of material damping the mode grows above its frequency."""
    rotor = machine(cross=False)
    springs = [fem.Support(s.node, ((1e8, 0.0), (0.0, 1.6e8))) for s in rotor.supports]
    rotor = dataclasses.replace(rotor, supports=springs)
    np.testing.assert_array_equal(fem.whirl_modes(rotor, 700.0).log_decrements, 0.0)
    beta = 1e-10
    damped = fem.whirl_modes(dataclasses.replace(rotor, material_damping=beta), 0.0, 2)
    whole = dataclasses.replace(rotor, material_damping=1e4 * beta)
    assert damped.log_decrements * 1e4 == pytest.approx(
        fem.whirl_modes(whole, 0.0, 2).log_decrements, rel=1e-6
    )


@settings(max_examples=10, deadline=None)
@given(whirling_rotors(elements=(3, 12)), st.floats(0.0, 1000.0))
def test_the_dense_solver_of_the_tests_agrees(rotor, speed):
    rotor = dataclasses.replace(rotor, model=dataclasses.replace(rotor.model, shear=False))
    found = fem.whirl_modes(rotor, speed, 6)
    values, X, Y = dense_whirl(rotor, speed)
    for k, lam in enumerate(found.eigenvalues):
        i = int(np.argmin(np.abs(values - lam)))
        assert abs(values[i] - lam) < 2e-7 * abs(lam)
        gap = np.sort(np.abs(values - lam))[1] / abs(lam)
        if gap < 1e-3:
            continue
        a = np.concatenate((found.x[:, k], found.y[:, k]))
        b = np.concatenate((X[i], Y[i]))
        alike = abs(np.vdot(a, b)) ** 2 / (np.vdot(a, a).real * np.vdot(b, b).real)
        assert alike > 1 - 1e-5


@pytest.mark.parametrize("times", [1, 5])
def test_the_estimated_error_is_the_true_one(times):
    rotor = machine(times)
    speeds = np.linspace(0.0, 1000.0, 21)
    fast = solve_whirl(both_planes(rotor), speeds, 8)
    exact = [whirl_exactly(rotor, speed, 8).eigenvalues for speed in speeds[::5]]
    error = relative(fast.values[::5], np.array(exact))
    assert error < 3e-8
    assert error < 5 * fast.error


def test_dense_and_sparse_checks_agree():
    rotor = machine(8)  # 370 unknowns: dense
    finer = machine(9)  # sparse
    one = whirl_exactly(rotor, 700.0, 8).eigenvalues
    other = whirl_exactly(finer, 700.0, 8).eigenvalues
    # The same rotor on two fine meshes: the difference is that of the meshes.
    np.testing.assert_allclose(other, one, rtol=2e-6)
    assert relative(fem.whirl_modes(finer, 700.0, 8).eigenvalues, other) < 1e-7


def test_rigid_disc_on_a_light_overhang():
    """Disc at the end of a massless cantilever: (k11 − m ω²)(k22 + Ip Ω ω − Id ω²) = k12²."""
    L, d, E = 0.5, 0.03, 2.1e11
    m, Ip, Id, speed = 8.0, 0.09, 0.05, 400.0
    EI = E * math.pi / 64 * d**4
    k11, k12, k22 = 12 * EI / L**3, -6 * EI / L**2, 4 * EI / L
    # Forward and backward whirl are the roots of one polynomial in ω, positive and negative.
    roots = np.roots([m * Id, -m * Ip * speed, -(k11 * Id + m * k22), k11 * Ip * speed, k11 * k22 - k12**2])
    rotor = fem.Rotor(
        [L],
        d,
        density=1e-12,
        discs=[fem.Disc(2, m, Ip, Id)],
        supports=[fem.Support(1, 1e14, tilting_stiffness=1e13)],
        model=FULL,
    )
    found = fem.whirl_modes(rotor, speed, 4)
    signed = found.frequencies * found.direction
    np.testing.assert_allclose(np.sort(signed), np.sort(roots.real), rtol=1e-7)


def test_rigid_rotor_on_two_bearings():
    """Translation and tilting of a rigid symmetric rotor: tilting feels the gyroscopic moment."""
    L, k, m, Ip, Id, speed = 1.0, 2e5, 30.0, 1.2, 0.8, 600.0
    rotor = fem.Rotor(
        [L / 2, L / 2],
        0.5,
        density=1e-9,
        discs=[fem.Disc(2, m, Ip, Id)],
        supports=[fem.Support(1, k), fem.Support(3, k)],
        model=FULL,
    )
    tilt = k * L**2 / 2
    roots = np.roots([Id, -Ip * speed, -tilt])
    expected = np.sort([*roots, math.sqrt(2 * k / m), -math.sqrt(2 * k / m)])
    found = fem.whirl_modes(rotor, speed, 4)
    np.testing.assert_allclose(np.sort(found.frequencies * found.direction), expected, rtol=1e-4)
    assert np.abs(found.log_decrements).max() < 1e-6


@pytest.mark.parametrize("speed", [0.0, 50.0, 300.0])
def test_jeffcott_on_anisotropic_damped_supports(speed):
    """A point mass between springs and dampers of x and y, coupled by kxy: a 2 × 2 quadratic problem."""
    m, K, C = 12.0, np.array([[2e5, 3e4], [-1e4, 5e5]]), np.array([[300.0, 20.0], [20.0, 700.0]])
    half = (tuple(K[0] / 2), tuple(K[1] / 2)), (tuple(C[0] / 2), tuple(C[1] / 2))
    rotor = fem.Rotor(
        [0.1, 0.1],
        0.1,
        density=1e-9,
        discs=[fem.Disc(2, m)],
        supports=[fem.Support(1, *half), fem.Support(3, *half)],
    )
    # The shaft is a spring in series: stiffness 48 E I / L³ of the middle against both ends.
    ks = 48 * 2.1e11 * math.pi / 64 * 0.1**4 / 0.2**3
    # Unknowns: disc x, y, bearings x, y (together).
    M = np.diag([m, m, 0.0, 0.0])
    D = np.zeros((4, 4))
    D[2:, 2:] = C
    spring = ks * np.block([[np.eye(2), -np.eye(2)], [-np.eye(2), np.eye(2)]])
    spring[2:, 2:] += K
    inverse = np.linalg.inv(spring)
    mu = np.linalg.eigvals(np.block([[np.zeros((4, 4)), np.eye(4)], [-inverse @ M, -inverse @ D]]))
    lam = 1 / mu[np.abs(mu) > 1e-9]
    lam = lam[lam.imag > 0.1 * np.abs(lam)]
    found = fem.whirl_modes(rotor, speed, 2)
    np.testing.assert_allclose(found.eigenvalues, lam[np.argsort(lam.imag)], rtol=1e-8)
    # Two bearings without mass creep in two directions, with the middle or against each other.
    assert found.real.size == 4


@pytest.mark.parametrize("shear", [False, True])
def test_complex_coordinate_equals_two_planes(shear):
    rotor = machine(shear=shear, material=2e-6)
    rotor = dataclasses.replace(
        rotor, supports=[fem.Support(s.node, ((1e8, 2e7), (-2e7, 1e8)), 3e4) for s in rotor.supports]
    )
    assert rotor.symmetric
    speeds = np.linspace(10.0, 900.0, 9)
    one = solve_whirl(both_planes(rotor), speeds, 8)
    two = solve_whirl(both_planes(rotor, complex_coordinate=False), speeds, 8)
    assert (one.Q.P.planes, two.Q.P.planes) == (1, 2)
    z = one.values
    np.testing.assert_allclose(np.where(z.imag < 0, z.conj(), z), two.values, rtol=5e-8)


def test_directions_of_a_symmetric_rotor():
    rotor = dataclasses.replace(
        machine(), supports=[fem.Support(s.node, 1e8, 1e4) for s in machine().supports]
    )
    found = fem.whirl_modes(rotor, 500.0, 8)
    np.testing.assert_array_equal(found.direction, [-1, 1] * 4)
    # Circles: y lags x by a quarter turn forward, leads it backward.
    np.testing.assert_allclose(found.y, -1j * found.direction * found.x, atol=1e-12)
    assert found.to_dict()["direction"][:2] == ["backward", "forward"]


def test_at_rest_without_damping_frequencies_are_the_critical_speeds():
    rotor = rotor23()
    found = fem.whirl_modes(rotor, 0.0, 6)
    np.testing.assert_allclose(found.frequencies[::2], fem.critical_speeds(rotor).frequencies, rtol=1e-9)
    np.testing.assert_allclose(found.frequencies[1::2], found.frequencies[::2], rtol=1e-12)
    assert np.abs(found.log_decrements).max() < 1e-9


def test_at_rest_planes_are_apart():
    rotor = machine(cross=False)
    found = fem.whirl_modes(rotor, 0.0, 6)
    each = []
    for i in (0, 1):
        supports = [fem.Support(s.node, s.stiffness[i][i], s.damping[i][i]) for s in rotor.supports]
        each.append(fem.whirl_modes(dataclasses.replace(rotor, supports=supports), 0.0, 6).eigenvalues[::2])
    expected = np.concatenate(each)
    np.testing.assert_allclose(found.eigenvalues, expected[np.argsort(expected.imag)], rtol=1e-7)
    np.testing.assert_array_equal(found.direction, 0)


def test_a_free_rotor():
    found = fem.whirl_modes(uniform(20), 100.0, 4)
    free = np.array([4.730040744862704, 7.853204624095838]) ** 2 * math.sqrt(2.1e11 * 0.1**2 / 16 / 7850.0)
    np.testing.assert_allclose(found.frequencies, np.repeat(free, 2), rtol=1e-4)
    assert "rigid-body motions" in found.warnings[0]


@settings(max_examples=8, deadline=None)
@given(whirling_rotors(elements=(3, 10)), st.floats(0.1, 900.0))
def test_turning_the_other_way_or_another_scale_changes_nothing(rotor, speed):
    found = fem.whirl_modes(rotor, speed, 4).eigenvalues
    # Twice the stiffness and damping, twice the density and masses: the same motion.
    half_density = dataclasses.replace(
        rotor,
        youngs_modulus=2 * rotor.youngs_modulus,
        density=2 * rotor.density,
        discs=[
            fem.Disc(d.node, 2 * d.mass, 2 * d.polar_inertia, 2 * d.diametral_inertia) for d in rotor.discs
        ],
        supports=[doubled(s) for s in rotor.supports],
    )
    assert relative(fem.whirl_modes(half_density, speed, 4).eigenvalues, found) < 1e-7
    # Seen from the other end the rotor turns backward: x stays, y changes its sign.
    last = rotor.n_nodes + 1
    arrays = ("length", "outer_diameter", "inner_diameter", "youngs_modulus", "density", "material_damping")
    turned = dataclasses.replace(
        rotor,
        **{name: getattr(rotor, name)[::-1] for name in arrays},
        discs=[dataclasses.replace(d, node=last - d.node) for d in rotor.discs],
        supports=[dataclasses.replace(s, node=last - s.node) for s in rotor.supports],
    )
    assert relative(fem.whirl_modes(turned, speed, 4).eigenvalues, found) < 1e-7


def doubled(support):
    def twice(value):
        if isinstance(value, tuple):
            return tuple(twice(v) for v in value)
        return 2 * value

    pedestal = support.pedestal
    if pedestal is not None:
        pedestal = fem.Pedestal(2 * pedestal.mass, twice(pedestal.stiffness), twice(pedestal.damping))
    return dataclasses.replace(
        support, stiffness=twice(support.stiffness), damping=twice(support.damping), pedestal=pedestal
    )


def test_overdamped_motions_are_said():
    rotor = fem.Rotor(
        [0.1, 0.1],
        0.1,
        density=1e-9,
        discs=[fem.Disc(2, 10.0)],
        supports=[fem.Support(1, 1e5, 2e3), fem.Support(3, 1e5, 2e3)],
    )
    with pytest.raises(ValueError, match="no oscillating mode"):
        fem.whirl_modes(rotor, 10.0, 1)
    with pytest.raises(ValueError, match="no oscillating mode"):
        fem.campbell(rotor, [10.0], 1)


def test_a_rotor_that_runs_away_is_said():
    rotor = dataclasses.replace(rotor23(), supports=[*rotor23().supports, fem.Support(12, -1e9, kind="seal")])
    found = fem.whirl_modes(rotor, 10.0, 2)
    assert any("runs away" in text for text in found.warnings)
    assert found.real.max() > 0


@pytest.mark.parametrize(
    ("speed", "n", "message"),
    [
        (-1.0, 2, "not negative"),
        (math.nan, 2, "finite"),
        ("fast", 2, "numbers in rad/s"),
        (10.0, 0, "0 modes cannot be found"),
        (10.0, 1000, "1 to 96"),
        (10.0, 2.5, "whole number"),
    ],
)
def test_bad_input(speed, n, message):
    with pytest.raises(ValueError, match=message):
        fem.whirl_modes(rotor23(), speed, n)


def test_outside_a_table():
    rotor = dataclasses.replace(
        rotor23(),
        supports=[fem.Support(3, [1e8, 2e8], 1e3, speeds=(100, 500), name="front"), fem.Support(20, 1e8)],
    )
    with pytest.raises(ValueError, match=r"front.*100 to 500 rad/s, not 600"):
        fem.whirl_modes(rotor, 600.0)


def test_results_speak():
    found = fem.whirl_modes(machine(), 700.0, 3)
    assert len(found.to_frame()) == 3
    assert "forward" in found.summary()
    assert repr(found).startswith("WhirlModes(3 whirl modes at 700 rad/s")
    assert "<table" in found._repr_html_()
    assert found.x.shape == (24, 3)
    np.testing.assert_allclose((abs(found.x) ** 2 + abs(found.y) ** 2).max(axis=0), 1.0)
