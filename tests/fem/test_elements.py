"""Convergence rates of the elements against closed forms."""

import math
from functools import partial

import numpy as np
import pytest
from fem_rotors import uniform
from hypothesis import given, settings
from hypothesis import strategies as st

import fem

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
    ("make", "exact", "skip", "last"),
    [
        (pinned, SIMPLY, 0, 5e-8),
        (clamped, CANTILEVER, 0, 5e-8),
        (uniform, FREE, 2, 5e-8),
        (partial(pinned, model=FULL), TIMOSHENKO, 0, 5e-7),
    ],
    ids=["simply supported", "cantilever", "free", "Timoshenko"],
)
def test_frequencies_converge_with_the_fourth_power(make, exact, skip, last):
    e = errors(make, exact, (16, 32, 64), skip)
    assert (e > 0).all()
    np.testing.assert_allclose(np.log2(e[:-1] / e[1:])[:, 1:], 4.0, atol=0.1)
    np.testing.assert_allclose(errors(make, exact, (128,), skip), 0.0, atol=last)


@given(st.floats(0.0, 0.45), st.floats(0.0, 0.095), st.booleans(), st.integers(1, 3))
@settings(max_examples=25, deadline=None)
def test_hollow_timoshenko_shafts_of_any_material(nu, inner, rotary, k):
    rotor = pinned(
        48, inner_diameter=inner, poisson_ratio=nu, model=fem.Model(shear=True, rotary_inertia=rotary)
    )
    exact = timoshenko_pinned(nu, inner, k, rotary)
    assert fem.critical_speeds(rotor, 3).frequencies[k - 1] == pytest.approx(exact, rel=1.1 * (k / 48) ** 4)


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
