"""Critical speeds with gyroscopic effect, any supports, tables and pedestals."""

import dataclasses
import math

import dense_rotor
import numpy as np
import pytest
from fem_rotors import machines, rotor23, uniform
from hypothesis import given, settings
from scipy.linalg import eigh

import fem

FULL = fem.Model(shear=True, rotary_inertia=True, gyroscopic=True)


@given(machines(elements=(3, 10), tables=False))
@settings(max_examples=20, deadline=None)
def test_any_rotor_against_dense_matrices(rotor):
    rotor = dataclasses.replace(rotor, model=dataclasses.replace(rotor.model, shear=False))
    found = fem.critical_speeds(rotor, 4)
    ((K, N),) = dense_rotor.synchronous(rotor, [0.0])
    mu = eigh(N, K, eigvals_only=True)[::-1]
    np.testing.assert_allclose(found.frequencies, 1 / np.sqrt(mu[:4]), rtol=1e-7)
    if rotor.symmetric:
        assert set(found.direction) == {"forward"}


@pytest.mark.parametrize("n", [8, 60])
def test_gyroscopic_moment_stiffens_forward_whirl(n):
    """Overhung disc on a massless shaft: closed form of Föppl's 2 × 2 problem."""
    E, L, d, Ip, Id, m = 2.1e11, 0.5, 0.04, 0.3, 0.16, 20.0
    EI = E * math.pi * d**4 / 64
    rotor = fem.Rotor(
        np.full(n, L / n),
        d,
        density=0.0,
        discs=[fem.Disc(n + 1, m, Ip, Id)],
        supports=[fem.Support(1, 1e17, tilting_stiffness=1e17)],
        model=fem.Model(rotary_inertia=True, gyroscopic=True),
    )
    # Compliance of the free end: w = F L³/3EI + Q L²/2EI, θ = F L²/2EI + Q L/EI;
    # F = ω² m w, Q = −ω² (Ip − Id) θ.
    J = Ip - Id
    a, b, c = L**3 / 3 / EI, L**2 / 2 / EI, L / EI
    # The determinant of [[1 − a m q, b J q], [−b m q, 1 + c J q]] = 0 with q = ω².
    roots = np.roots([(b * b - a * c) * m * J, c * J - a * m, 1.0])
    (q,) = roots[roots > 0]
    assert fem.critical_speeds(rotor, 1).frequencies[0] == pytest.approx(math.sqrt(q), rel=1e-8)
    # A thin disc removes the second forward critical speed.
    with pytest.raises(ValueError, match="the model has 1 to 1"):
        fem.critical_speeds(rotor, 2)
    thick = dataclasses.replace(rotor, discs=[fem.Disc(n + 1, m, 0.1, 0.16)])
    assert fem.critical_speeds(thick, 2).frequencies.size == 2


def test_directions_come_in_pairs_on_slightly_different_supports():
    def on(k, gyroscopic=True):
        return dataclasses.replace(
            rotor23(),
            supports=[fem.Support(n, k) for n in (2, 22)],
            discs=[fem.Disc(12, 50.0, 6.0, 3.0)],
            model=FULL if gyroscopic else fem.Model(),
        )

    oval = ((1e8, 0), (0, 0.97e8))
    modes = fem.critical_speeds(on(oval), 4)
    assert modes.direction == ("backward", "forward") * 2
    # Without gyroscopic effect each plane whirls alone, in straight lines.
    apart = fem.critical_speeds(on(oval, False), 4)
    assert set(apart.direction) == {"mixed"}
    assert (np.minimum(np.abs(apart.x).max(axis=0), np.abs(apart.y).max(axis=0)) < 1e-6).all()


@pytest.mark.parametrize("kind", ["isotropic", "anisotropic"])
def test_bearing_tables_are_read_at_the_critical_speed(kind):
    speeds = np.linspace(0, 3000, 31)

    def k(omega):
        stiff = 2e7 + 3e4 * omega
        return stiff if kind == "isotropic" else ((stiff, 0.0), (0.0, 0.6 * stiff))

    def on(stiffness, **others):
        return dataclasses.replace(
            rotor23(), supports=[fem.Support(n, stiffness, **others) for n in (2, 22)], model=FULL
        )

    modes = fem.critical_speeds(on([k(v) for v in speeds], speeds=speeds), 4)
    assert (np.diff(modes.frequencies) > 0).all()
    for i, omega in enumerate(modes.frequencies):
        fixed = fem.critical_speeds(on(k(omega)), 4)
        assert fixed.frequencies[i] == pytest.approx(omega, rel=1e-10)
        np.testing.assert_allclose(modes.shapes[:, i], fixed.shapes[:, i], rtol=0, atol=1e-6)


def test_where_a_table_ends():
    def on(first, last, others=None):
        tables = [(first, last), others or (first, last)]
        supports = [fem.Support(n, [5e7, 6e7], speeds=ends) for n, ends in zip((2, 22), tables, strict=True)]
        return dataclasses.replace(rotor23(), supports=supports)

    some = fem.critical_speeds(on(50.0, 300.0), 3)
    assert some.frequencies.size == 1
    assert "only 1 of 3 critical speeds between 50 and 300 rad/s" in some.warnings[0]
    assert fem.mesh_check(on(50.0, 300.0), 3).frequencies == pytest.approx(some.frequencies)
    late = fem.critical_speeds(on(200.0, 900.0), 1)
    assert 200 < late.frequencies[0] < 900
    assert "critical speeds below the tables are not known" in late.warnings[0]
    for ends, words in (
        ((10.0, 60.0), "no critical speed lies between 10 and 60 rad/s"),
        ((200.0, 250.0), r"lowest natural frequency at 200 rad/s is .*: extend the tables"),
        ((0, 10, (20, 30)), "no speed in common"),
    ):
        with pytest.raises(ValueError, match=words):
            fem.critical_speeds(on(*ends), 1)


@pytest.mark.parametrize("n", [12, 60])
def test_free_and_barely_held_rotors_whirl(n):
    def on(*stiffness, gyroscopic=True):
        supports = [fem.Support(k, s) for k in (1, n + 1) for s in stiffness]
        model = dataclasses.replace(FULL, gyroscopic=gyroscopic)
        return fem.critical_speeds(uniform(n, model=model, supports=supports), 4).frequencies

    assert (on()[:2] == 0).all()
    assert (on()[2:] > on(gyroscopic=False)[2:]).all()
    mass = 7850 * math.pi / 4 * 0.01
    np.testing.assert_allclose(on(((2.0, 0), (0, 1.0)))[:2] ** 2, [2 / mass, 4 / mass], rtol=1e-3)
    held_in_x = on(((1e8, 0), (0, 0)))
    assert (held_in_x[:2] == 0).all()
    assert held_in_x[2] > 100


@pytest.mark.parametrize(
    ("flags", "ignored"),
    [
        ({}, ["diametral", "polar"]),
        ({"rotary_inertia": True}, ["polar"]),
        ({"gyroscopic": True}, ["diametral"]),
        ({"gyroscopic": True, "rotary_inertia": True}, []),
    ],
)
def test_ignored_inertia_is_named(flags, ignored):
    rotor = dataclasses.replace(
        on_ends([0.5, 0.5]), discs=[fem.Disc(2, 1.0, 0.2, 0.1)], model=fem.Model(**flags)
    )
    words = [text.partition(" inertia is ignored")[0] for text in fem.critical_speeds(rotor, 1).warnings]
    assert words == [f"disc at node 2: {name}" for name in ignored]


def on_ends(lengths):
    """A shaft on two springs."""
    ends = [fem.Support(1, 1e8), fem.Support(len(lengths) + 1, 1e8)]
    return fem.Rotor(lengths, 0.05, supports=ends)


def test_an_element_of_a_thousandth_of_its_neighbour_is_computed():
    fine = fem.critical_speeds(on_ends([0.05] * 20), 2).frequencies
    short = [0.05] * 10 + [5e-5, 0.05 - 5e-5] + [0.05] * 9
    np.testing.assert_allclose(fem.critical_speeds(on_ends(short), 2).frequencies, fine, rtol=1e-8)


@pytest.mark.parametrize("lengths", [[0.25, 1e-9, 0.25], [8e-5, 0.25]])
def test_much_shorter_elements_are_refused(lengths):
    with pytest.raises(ValueError, match=r"element [12]: length .* 1/3000 of its longer neighbour"):
        on_ends(lengths)


def test_a_seal_that_pushes_outwards_at_a_bearing_leaves_the_rotor_held():
    """Their stiffnesses add up, they do not cancel."""
    for k in (1e8, np.diag((1e8, 2e8))):
        both = [fem.Support(1, k), fem.Support(5, k), fem.Support(1, -1e6, kind="seal")]
        speeds = fem.critical_speeds(fem.Rotor([0.2] * 4, 0.05, supports=both), 1).rpm
        np.testing.assert_allclose(speeds, 9321.3, atol=1)
