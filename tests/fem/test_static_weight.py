"""Static deflection under gravity, and compliance on supports of any kind."""

import dataclasses
import math

import numpy as np
import pytest
from fem_rotors import machines, rotor23, uniform
from hypothesis import given, settings

import fem

G = 9.80665


def test_simply_supported_shaft_sags_as_the_closed_form():
    rotor = uniform(8, supports=[fem.Support(1, 1e17), fem.Support(9, 1e17)])
    q = 7850 * math.pi / 4 * 0.01 * G
    EI = 2.1e11 * math.pi * 1e-4 / 64
    result = fem.static_deflection(rotor)
    assert result.y[4] == pytest.approx(-5 * q / 384 / EI, rel=1e-9)
    assert not result.x.any()
    np.testing.assert_allclose(result.reaction_y, q / 2, rtol=1e-9)
    shear = fem.static_deflection(dataclasses.replace(rotor, model=fem.Model(shear=True)))
    GA = (rotor.shear_coefficient * rotor.shear_modulus * rotor.area)[0]
    assert shear.y[4] - result.y[4] == pytest.approx(-q / 8 / GA, rel=1e-5)


def test_a_clamped_shaft_hangs_from_its_clamp():
    rotor = uniform(6, supports=[fem.Support(1, 1e17, tilting_stiffness=1e17)])
    q = 7850 * math.pi / 4 * 0.01 * G
    result = fem.static_deflection(rotor, direction=180.0)
    assert result.x[-1] == pytest.approx(-q / 8 / (2.1e11 * math.pi * 1e-4 / 64), rel=1e-9)
    assert result.reaction_x[0] == pytest.approx(q, rel=1e-9)


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
    rotor = uniform(8, supports=[fem.Support(1, 1e17), fem.Support(9, 1e17)], material_damping=1e-4)
    still, turning = fem.static_deflection(rotor), fem.static_deflection(rotor, 500.0)
    z = 1j * still.y / (1 - 1j * 500 * 1e-4)
    np.testing.assert_allclose(turning.x[1:-1], z.real[1:-1], rtol=1e-7)
    np.testing.assert_allclose(turning.y[1:-1], z.imag[1:-1], rtol=1e-7)


def test_compliance_on_supports_of_any_kind():
    plain = rotor23()
    written = dataclasses.replace(
        plain,
        supports=[fem.Support(n, ((1e8, 0), (0, 5e7))) for n in (2, 22)],
    )
    np.testing.assert_allclose(
        fem.compliance(written, [3, 7, 20]), fem.compliance(plain, [3, 7, 20]), rtol=1e-8
    )
    k = np.array([[1e8, 4e7], [1e7, 5e7]])
    coupled = dataclasses.replace(plain, supports=[fem.Support(n, k) for n in (2, 22)])
    # At a support that alone carries the load the rotor moves as the inverse of k.
    alpha = fem.compliance(coupled, [2])
    assert alpha[0, 0] == pytest.approx(np.linalg.inv(k)[0, 0], rel=1e-6)
    table = dataclasses.replace(
        plain, supports=[fem.Support(n, [5e7, 1.5e8], speeds=[0.0, 200.0]) for n in (2, 22)]
    )
    np.testing.assert_allclose(fem.compliance(table, [7], 100.0), fem.compliance(plain, [7]), rtol=1e-8)
    with pytest.raises(ValueError, match=r"its table holds 0 to 200 rad/s, not 300"):
        fem.compliance(table, [7], 300.0)


def test_a_rotor_that_is_not_held_falls():
    for supports in ([], [fem.Support(1, 1e8)], [fem.Support(n, ((1e8, 0), (0, 0))) for n in (1, 9)]):
        with pytest.raises(ValueError, match="not held"):
            fem.static_deflection(uniform(8, supports=supports))


def test_results():
    rotor = dataclasses.replace(rotor23(), supports=[fem.Support(2, 1e8, name="left"), fem.Support(22, 1e8)])
    result = fem.static_deflection(rotor)
    reactions = result.tables()[0].columns[2].values
    assert reactions == pytest.approx(result.reaction_y, rel=1e-14)
    assert result.to_frame().shape == (24, 4)
    assert "left" in result.summary()
    assert "largest deflection 631.3 µm at node 12" in result.summary()
    with pytest.raises(ValueError, match="speed must be finite and not negative"):
        fem.static_deflection(rotor, -1.0)
