"""Static deflection under gravity, and compliance on supports of any kind."""

import dataclasses
import math

import numpy as np
import pytest
from fem_rotors import machines, rotor23, uniform
from hypothesis import given, settings

import fem

G, EI, LINE = 9.80665, 2.1e11 * math.pi * 1e-4 / 64, 7850 * math.pi / 4 * 0.01
RIGID = [fem.Support(1, 1e17), fem.Support(9, 1e17)]


@pytest.mark.parametrize("n", [2, 10, 100])
def test_a_beam_on_springs_is_exact_with_any_mesh(n):
    left, right = 3e7, 8e7
    beam = uniform(n, supports=[fem.Support(1, left), fem.Support(n + 1, right)])
    alpha = fem.compliance(beam, [1, n // 2 + 1])
    assert alpha[1, 1] == pytest.approx(1 / (48 * EI) + 1 / (4 * left) + 1 / (4 * right), rel=1e-7)
    np.testing.assert_allclose(alpha[0], [1 / left, 1 / (2 * left)], rtol=1e-7)


@given(machines(elements=(2, 20)))
@settings(max_examples=15, deadline=None)
def test_compliance_is_symmetric_positive_and_the_slow_limit_of_the_response(rotor):
    springs = [fem.Support(s.node, s.at(0.0)[0][0, 0]) for s in rotor.supports]
    rotor = dataclasses.replace(rotor, supports=springs, material_damping=0.0)
    nodes = list(range(1, rotor.n_nodes + 1))
    alpha = fem.compliance(rotor, nodes)
    np.testing.assert_array_equal(alpha, alpha.T)
    assert (np.linalg.eigvalsh(alpha) > -1e-9 * np.abs(alpha).max()).all()
    slow = 1e-5 * fem.critical_speeds(rotor, n=1).frequencies[0]
    W = fem.influence(rotor, nodes, nodes, slow).W[0]
    # both promise six digits; beyond that they warn
    np.testing.assert_allclose(W / slow**2, alpha, rtol=0, atol=1e-6 * np.abs(alpha).max())


def test_compliance_on_supports_of_any_kind():
    def on(*stiffness, nodes=(7,), speed=0.0, **options):
        supports = [fem.Support(n, *stiffness, **options) for n in (2, 22)]
        return fem.compliance(dataclasses.replace(rotor23(), supports=supports), nodes, speed)

    oval = on(((1e8, 0), (0, 5e7)), nodes=(3, 7, 20))
    np.testing.assert_allclose(oval, fem.compliance(rotor23(), [3, 7, 20]), rtol=1e-8)
    # At a support that alone carries the load the rotor moves as the inverse of k.
    k = np.array([[1e8, 4e7], [1e7, 5e7]])
    assert on(k, nodes=(2,))[0, 0] == pytest.approx(np.linalg.inv(k)[0, 0], rel=1e-6)
    table = {"speeds": [0.0, 200.0]}
    np.testing.assert_allclose(on([5e7, 1.5e8], speed=100.0, **table), on(1e8), rtol=1e-8)
    with pytest.raises(ValueError, match=r"its table holds 0 to 200 rad/s, not 300"):
        on([5e7, 1.5e8], speed=300.0, **table)


@pytest.mark.parametrize(
    ("rotor", "nodes", "message"),
    [
        (uniform(4), [1], "not held has no rest"),
        (uniform(4, supports=[fem.Support(1, 1e8), fem.Support(1, 1e8)]), [1], "supports at two nodes"),
        (uniform(4, supports=[fem.Support(1, 1e8), fem.Support(5, 1e8)]), [6], "node 6 does not exist"),
        (uniform(100, supports=[fem.Support(1, 1e-4), fem.Support(101, 1e-4)]), [5], "lost in float64"),
    ],
)
def test_impossible_requests_are_refused(rotor, nodes, message):
    with pytest.raises(ValueError, match=message):
        fem.compliance(rotor, nodes)


def test_a_simply_supported_shaft_sags_as_the_closed_form():
    rotor = uniform(8, supports=RIGID)
    result = fem.static_deflection(rotor)
    assert result.y[4] == pytest.approx(-5 * G * LINE / 384 / EI, rel=1e-9)
    assert not result.x.any()
    np.testing.assert_allclose(result.reaction_y, G * LINE / 2, rtol=1e-9)
    shear = fem.static_deflection(dataclasses.replace(rotor, model=fem.Model(shear=True)))
    GA = (rotor.shear_coefficient * rotor.shear_modulus * rotor.area)[0]
    assert shear.y[4] - result.y[4] == pytest.approx(-G * LINE / 8 / GA, rel=1e-5)


@given(machines(elements=(2, 16)))
@settings(max_examples=25, deadline=None)
def test_reactions_carry_the_weight_and_balance_its_moment(rotor):
    result = fem.static_deflection(rotor, 700.0)
    assert result.weight == pytest.approx(G * rotor.total_mass, rel=1e-14)
    at = [rotor.positions[s.node - 1] for s in rotor.supports]
    shaft = rotor.density * rotor.area * rotor.length
    moment = shaft @ (rotor.positions[:-1] + rotor.length / 2)
    moment += sum(d.mass * rotor.positions[d.node - 1] for d in rotor.discs)
    size = np.abs(result.reaction_y).max() + np.abs(result.reaction_x).max()
    assert result.reaction_y.sum() == pytest.approx(result.weight, abs=1e-7 * size)
    assert result.reaction_x.sum() == pytest.approx(0.0, abs=1e-7 * size)
    if not rotor.material_damping.any():
        assert result.reaction_y @ at == pytest.approx(G * moment, abs=1e-7 * size)
        assert result.reaction_x @ at == pytest.approx(0.0, abs=1e-7 * size)


def test_material_damping_bends_the_turning_shaft_sideways():
    # K z − iΩβK z = f for a massless-bearing shaft: z = f / (K (1 − iΩβ)).
    rotor = uniform(8, supports=RIGID, material_damping=1e-4)
    still, turning = fem.static_deflection(rotor), fem.static_deflection(rotor, 500.0)
    z = 1j * still.y / (1 - 1j * 500 * 1e-4)
    np.testing.assert_allclose((turning.x + 1j * turning.y)[1:-1], z[1:-1], rtol=1e-7)


@pytest.mark.parametrize("stiffness", [{}, {1: 1e8}, {1: ((1e8, 0), (0, 0)), 9: ((1e8, 0), (0, 0))}])
def test_a_rotor_that_is_not_held_falls(stiffness):
    with pytest.raises(ValueError, match="not held"):
        fem.static_deflection(uniform(8, supports=[fem.Support(n, k) for n, k in stiffness.items()]))
