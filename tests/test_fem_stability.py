import dataclasses
import math

import numpy as np
import pytest
from fem_rotors import rotor23
from whirl_rotors import machine

import fem

MASS, SHAFT, DIAMETER = 20.0, 1.0, 0.03
STIFFNESS = 48 * fem.STEEL_MODULUS * math.pi / 64 * DIAMETER**4 / SHAFT**3
CRITICAL = math.sqrt(STIFFNESS / MASS)


def jeffcott(*supports, bearing=1e13, material=0.0):
    """A disc in the middle of a massless shaft."""
    return fem.Rotor(
        [SHAFT / 2, SHAFT / 2],
        DIAMETER,
        density=0.0,
        discs=[fem.Disc(2, MASS)],
        supports=[fem.Support(1, bearing), fem.Support(3, bearing), *supports],
        material_damping=material,
    )


@pytest.mark.parametrize("ratio", [0.2, 1.0, 5.0])
def test_internal_damping(ratio):
    """Stable up to ω0 (1 + c_e / c_i)."""
    material = 1e-4
    rotor = jeffcott(fem.Support(2, 0.0, ratio * material * STIFFNESS), material=material)
    expected = CRITICAL * (1 + ratio)
    found = fem.stability_threshold(rotor, 2 * expected)
    assert found.status == "threshold"
    assert found.threshold == pytest.approx(expected, rel=1e-7)
    assert found.frequency == pytest.approx(CRITICAL, rel=1e-7)
    assert found.whirl_ratio == pytest.approx(1 / (1 + ratio), rel=1e-7)
    assert found.direction == 1


def test_internal_damping_on_flexible_bearings():
    """Only the shaft's share of the deflection is damped inside: k_s (1 + iβ(ω − Ω)) in series with 2 k_b."""
    material, bearing, external = 2e-4, 0.7 * STIFFNESS, 60.0
    rotor = jeffcott(fem.Support(2, 0.0, external), bearing=bearing, material=material)
    found = fem.stability_threshold(rotor, 3000.0)
    shaft = STIFFNESS * (1 + 1j * material * (found.frequency - found.threshold))
    dynamic = shaft * 2 * bearing / (shaft + 2 * bearing)
    balance = dynamic - MASS * found.frequency**2 + 1j * external * found.frequency
    assert abs(balance) < 1e-8 * STIFFNESS


@pytest.mark.parametrize(("factor", "status"), [(1 - 1e-6, "stable"), (1 + 1e-6, "unstable")])
def test_cross_coupling_at_the_limit(factor, status):
    """q = b ω0 is the limit."""
    damping = 150.0
    q = factor * damping * CRITICAL
    rotor = jeffcott(fem.Support(2, ((0, q), (-q, 0)), damping, kind="seal"))
    assert fem.stability_threshold(rotor, 500.0).status == status


def test_cross_coupling_that_grows_with_speed():
    """q = b Ω / 2, as in a plain seal: stable up to 2 ω0, whirl ratio 1/2."""
    damping, top = 150.0, 1000.0
    q = damping * top / 2
    seal = fem.Support(
        2, [((0, 0), (0, 0)), ((0, q), (-q, 0))], [damping, damping], speeds=(0.0, top), kind="seal"
    )
    found = fem.stability_threshold(jeffcott(seal), top)
    assert found.threshold == pytest.approx(2 * CRITICAL, rel=1e-7)
    assert found.whirl_ratio == pytest.approx(0.5, rel=1e-8)
    assert found.mode in (1, 2)
    assert "0.5 × speed" in found.summary()


def test_anisotropic_bearings_shift_the_limit():
    """Two planes: the eigenvalue at the threshold lies on the axis, on both sides of it off it."""
    # Split stiffness and damping outside balance material damping for a while.
    rotor = dataclasses.replace(machine(cross=False), material_damping=np.full(23, 2e-4))
    found = fem.stability_threshold(rotor, 3000.0, n=4)
    assert found.status == "threshold"
    at = fem.whirl_modes(rotor, found.threshold, 4)
    k = int(np.argmin(np.abs(at.frequencies - found.frequency)))
    assert abs(at.eigenvalues[k].real) < 1e-7 * at.frequencies[k]
    before = fem.whirl_modes(rotor, 0.999 * found.threshold, 4)
    after = fem.whirl_modes(rotor, 1.001 * found.threshold, 4)
    assert before.eigenvalues.real.max() < 0 < after.eigenvalues.real.max()


def test_stable_is_said():
    rotor = dataclasses.replace(
        rotor23(), supports=[fem.Support(s.node, 1e8, 2e4) for s in rotor23().supports]
    )
    found = fem.stability_threshold(rotor, 1000.0)
    assert found.status == "stable"
    assert found.threshold is None
    assert found.whirl_ratio is None
    assert found.margin > 0
    assert "stable from 0 to 1000" in found.summary()


def test_undamped_is_not_unstable():
    assert fem.stability_threshold(rotor23(), 1000.0).status == "stable"


def test_unstable_from_the_start():
    q = 1e6
    found = fem.stability_threshold(jeffcott(fem.Support(2, ((0, q), (-q, 0)), 10.0, kind="seal")), 500.0)
    assert found.status == "unstable"
    assert found.direction == 1
    assert "unstable already at 0" in found.summary()
    assert found.to_dict()["threshold_rad_s"] is None


def test_running_away_is_said():
    rotor = jeffcott(fem.Support(2, -2 * STIFFNESS, 10.0, kind="seal"))
    found = fem.stability_threshold(rotor, 500.0, n=1)
    assert found.status == "unstable"


@pytest.mark.parametrize(
    ("highest", "options", "message"),
    [(10.0, {"lowest": 20.0}, "range of speeds is empty"), (10.0, {"lowest": -5.0}, "not negative")],
)
def test_bad_input(highest, options, message):
    with pytest.raises(ValueError, match=message):
        fem.stability_threshold(rotor23(), highest, **options)


def test_tables_are_not_left():
    rotor = jeffcott(fem.Support(2, [1e3, 1e3], [1.0, 1.0], speeds=(100.0, 200.0), name="seal"))
    with pytest.raises(ValueError, match="seal"):
        fem.stability_threshold(rotor, 150.0)
    assert fem.stability_threshold(rotor, 200.0, lowest=100.0).status == "stable"
