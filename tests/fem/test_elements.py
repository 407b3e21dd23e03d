"""Convergence rates of the elements against closed forms."""

import math

import numpy as np
import pytest
from fem_rotors import uniform
from hypothesis import given, settings
from hypothesis import strategies as st

import fem
from fem.assembly import assemble
from fem.elements import dense, strains

# E = 2.1e11 Pa, ρ = 7850 kg/m³, D = 0.1 m, L = 1 m, rad/s.
SIMPLY = [1276.18775, 5104.75102, 11485.68979]
CANTILEVER = [454.63784, 2849.16671, 7977.74929]
FREE = [2892.9744, 7974.59535, 15633.39539]
# ν = 0.3, Cowper, with rotary inertia.
TIMOSHENKO = [1261.04906, 4877.35161, 10437.66019]
RIGID = 1e18  # N/m or N·m/rad: beside it the beam's own 1e6 counts for nothing
FULL = fem.Model(shear=True, rotary_inertia=True)


def pinned(n, **others):
    return uniform(n, supports=[fem.Support(1, RIGID), fem.Support(n + 1, RIGID)], **others)


def clamped(n, **others):
    return uniform(n, supports=[fem.Support(1, RIGID, tilting_stiffness=RIGID)], **others)


def errors(make, exact, meshes, skip=0):
    found = [fem.critical_speeds(make(n), 3).frequencies[skip:] for n in meshes]
    return np.array(found) / exact - 1


def timoshenko_pinned(nu, inner, k=1.0, rotary=True):
    """Lower root of the frequency equation of a simply supported Timoshenko beam, wave number k π."""
    E, rho, D = 2.1e11, 7850.0, 0.1
    area, moment = math.pi / 4 * (D**2 - inner**2), math.pi / 64 * (D**4 - inner**4)
    m2 = (inner / D) ** 2
    kappa = 6 * (1 + nu) * (1 + m2) ** 2 / ((7 + 6 * nu) * (1 + m2) ** 2 + (20 + 12 * nu) * m2)
    G, q = E / 2 / (1 + nu), (k * math.pi) ** 2
    a = rho * moment * rho / (kappa * G) if rotary else 0.0
    b = rho * area + (rho * moment * q if rotary else 0.0) + E * moment * rho * q / (kappa * G)
    c = E * moment * q * q
    return math.sqrt(2 * c / (b + math.sqrt(b * b - 4 * a * c)))


@pytest.mark.parametrize(
    ("make", "exact", "skip"),
    [(pinned, SIMPLY, 0), (clamped, CANTILEVER, 0), (uniform, FREE, 2)],
    ids=["simply supported", "cantilever", "free"],
)
def test_euler_bernoulli_frequencies_converge_with_the_fourth_power(make, exact, skip):
    e = errors(make, exact, (16, 32, 64), skip)
    assert (e > 0).all()
    np.testing.assert_allclose(np.log2(e[:-1] / e[1:])[:, 1:], 4.0, atol=0.1)
    np.testing.assert_allclose(errors(make, exact, (128,), skip), 0.0, atol=5e-8)


def test_timoshenko_frequencies_converge_with_the_fourth_power_too():
    e = errors(lambda n: pinned(n, model=FULL), TIMOSHENKO, (8, 16, 32))
    assert (e > 0).all()
    np.testing.assert_allclose(np.log2(e[:-1] / e[1:])[:, 1:], 4.0, atol=0.1)
    np.testing.assert_allclose(errors(lambda n: pinned(n, model=FULL), TIMOSHENKO, (64,)), 0.0, atol=5e-7)


@given(st.floats(0.0, 0.45), st.floats(0.0, 0.095), st.booleans(), st.integers(1, 3))
@settings(max_examples=25, deadline=None)
def test_hollow_timoshenko_shafts_of_any_material(nu, inner, rotary, k):
    rotor = pinned(
        48, inner_diameter=inner, poisson_ratio=nu, model=fem.Model(shear=True, rotary_inertia=rotary)
    )
    exact = timoshenko_pinned(nu, inner, k, rotary)
    assert fem.critical_speeds(rotor, 3).frequencies[k - 1] == pytest.approx(exact, rel=1.1 * (k / 48) ** 4)


def test_slender_shafts_lock_not_and_tend_to_euler_bernoulli():
    for n in (2, 8):
        thin = fem.Rotor(
            np.full(n, 1 / n), 1e-4, supports=[fem.Support(1, 1e6), fem.Support(n + 1, 1e6)], model=FULL
        )
        plain = fem.Rotor(thin.length, 1e-4, supports=thin.supports)
        np.testing.assert_allclose(
            fem.critical_speeds(thin, 2).frequencies, fem.critical_speeds(plain, 2).frequencies, rtol=1e-6
        )


def test_statics_of_a_stepped_timoshenko_shaft_are_exact():
    # A cantilever of two sections under a force at its end: bending and shear compliance add up.
    E, G = 2.1e11, 2.1e11 / 2.6
    rotor = fem.Rotor(
        [0.4, 0.3],
        [0.1, 0.06],
        [0.03, 0.0],
        supports=[fem.Support(1, 1e18, tilting_stiffness=1e18)],
        model=fem.Model(shear=True),
    )
    area, moment, kappa = rotor.area, rotor.second_moment, rotor.shear_coefficient
    bending = (0.7**3 - 0.3**3) / 3 / (E * moment[0]) + 0.3**3 / 3 / (E * moment[1])
    shear = 0.4 / (kappa[0] * G * area[0]) + 0.3 / (kappa[1] * G * area[1])
    assert fem.compliance(rotor, [3])[0, 0] == pytest.approx(bending + shear, rel=1e-10)
    assert kappa[1] == pytest.approx(6 * 1.3 / (7 + 6 * 0.3), rel=1e-14)


@given(st.integers(0, 2**32 - 1), st.booleans(), st.booleans())
@settings(max_examples=30, deadline=None)
def test_energies_are_those_of_the_continuous_element(seed, shear, rotary):
    """Each form against a Gauss integral of the polynomials it stands for."""
    rng = np.random.default_rng(seed)
    L, outer = rng.uniform(0.05, 0.5), rng.uniform(0.05, 0.3)
    inner = outer * rng.uniform(0, 0.9)
    rotor = fem.Rotor(
        [L], outer, inner, material_damping=1e-4, model=fem.Model(shear, rotary, gyroscopic=True)
    )
    A = assemble(rotor)
    q = rng.normal(size=A.size) * np.array([0.1, 1, 1, 1, 0.1, 1] if shear else [0.1, 1, 0.1, 1])
    w1, t1, ga, gb, w2, t2 = q if shear else (q[0], q[1], 0, 0, q[2], q[3])
    g, weight = np.polynomial.legendre.leggauss(5)
    s, weight = (g + 1) / 2, weight / 2 * L
    a, b = L * (t1 + ga), L * (t2 + gb)
    c = [w1, a, 3 * (w2 - w1) - 2 * a - b, 2 * (w1 - w2) + a + b]
    w = c[0] + c[1] * s + c[2] * s**2 + c[3] * s**3
    slope, curvature = (c[1] + 2 * c[2] * s + 3 * c[3] * s**2) / L, (2 * c[2] + 6 * c[3] * s) / L**2
    gamma, step = ga + (gb - ga) * s, (gb - ga) / L
    EI, GA = 2.1e11 * rotor.second_moment[0], (rotor.shear_coefficient * rotor.shear_modulus * rotor.area)[0]
    strain = weight @ (EI * (curvature - step) ** 2 + GA * gamma**2)
    tilt = rotor.density[0] * rotor.second_moment[0] * (weight @ (slope - gamma) ** 2)
    mass = rotor.density[0] * rotor.area[0] * (weight @ w**2) + (tilt if rotary else 0)
    for band, expected in (
        (A.shaft, strain),
        (A.mass, mass),
        (A.gyroscopic, 2 * tilt),
        (A.material, 1e-4 * strain),
    ):
        assert q @ dense(band) @ q == pytest.approx(expected, rel=1e-9)
    assert (strains(rotor, q[:, None]) ** 2).sum() == pytest.approx(strain, rel=1e-9)
    assert A.deflection(2) == A.size - 2


@given(st.integers(0, 2**32 - 1), st.booleans())
@settings(max_examples=20, deadline=None)
def test_rigid_motions_strain_nothing_and_carry_the_mass(seed, shear):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 12))
    disc = fem.Disc.from_geometry(int(rng.integers(1, n + 2)), 0.05, 0.4)
    rotor = fem.Rotor(
        rng.uniform(0.05, 0.3, n), rng.uniform(0.03, 0.2, n), discs=[disc], model=fem.Model(shear, True, True)
    )
    A = assemble(rotor)
    motion = np.zeros((A.size, 2))
    motion[A.deflections, 0] = 1.0
    motion[A.deflections, 1], motion[A.deflections + 1, 1] = rotor.positions, 1.0
    size = np.abs(dense(A.shaft)).max()
    assert np.abs(dense(A.shaft) @ motion).max() < 1e-12 * size
    assert (motion.T @ dense(A.mass) @ motion)[0, 0] == pytest.approx(rotor.total_mass, rel=1e-12)
    # Moment of inertia about the left end, and twice the shaft's tilting inertia plus the disc's polar one.
    x, L = rotor.positions, rotor.length
    m, tilting = rotor.density * rotor.area * L, rotor.density * rotor.second_moment * L
    centre = x[:-1] + L / 2
    expected = m @ (centre**2 + L**2 / 12) + tilting.sum()
    expected += disc.mass * x[disc.node - 1] ** 2 + disc.diametral_inertia
    assert (motion.T @ dense(A.mass) @ motion)[1, 1] == pytest.approx(expected, rel=1e-12)
    G = (motion.T @ dense(A.gyroscopic) @ motion)[1, 1]
    assert pytest.approx(2 * tilting.sum() + disc.polar_inertia, rel=1e-12) == G
