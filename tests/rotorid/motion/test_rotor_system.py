"""The motion of a rotor against its response and its static deflection, which other code computes."""

import numpy as np
import pytest

from fem import Disc, Model, Rotor, Support, static_deflection, unbalance_response
from rotorid.motion.system import rotor_system
from rotorid.reduction import SmallModel

TABLE = Support(
    7,
    [((3e7, 4e6), (-2e6, 5e7)), ((6e7, 1e6), (-2e6, 5e7)), ((7e7, 1e6), (-4e6, 5e7))],
    [2e4, 3e4, 2e4],
    speeds=(100.0, 250.0, 400.0),
)


def rotor(**more):
    return Rotor(
        length=[0.2] * 6,
        outer_diameter=[0.08, 0.1, 0.12, 0.12, 0.1, 0.08],
        discs=[Disc(3, 40.0, 0.8, 0.5), Disc(5, 25.0)],
        supports=[Support(1, ((2e7, 1e6), (-3e6, 4e7)), 2e4), TABLE],
        material_damping=2e-5,
        model=Model(shear=True, rotary_inertia=True, gyroscopic=True),
        **more,
    )


def synchronous(system, speed):
    """Of all unknowns at a steady speed, by the equations as they are written down."""
    C, K = system.linear(speed)
    return np.linalg.solve(K + 1j * speed * C - speed**2 * system.M, speed**2 * system.unbalance + system.bow)


@pytest.mark.parametrize("speed", [120.0, 250.0, 333.3])
def test_unbalance_and_weight_of_a_rotor(speed):
    unbalance = {3: 2e-3 * np.exp(0.3j), 5: 1e-3j}
    made = rotor_system(rotor(), 110.0, 390.0, unbalance=unbalance, direction=-60.0)
    assert made.knots.tolist() == [110.0, 250.0, 390.0]
    steady = unbalance_response(rotor(), unbalance, [speed])
    q = synchronous(made, speed)
    x, y = ([q[made.index(node)[k]] for node in range(1, 8)] for k in (0, 1))
    # x = Re(X e^{iωt}): forward (X + iY) / 2 + conj(X − iY) / 2 turning back
    np.testing.assert_allclose(x, steady.x[0], rtol=1e-9)
    np.testing.assert_allclose(y, steady.y[0], rtol=1e-9)
    rest = np.linalg.solve(made.linear(speed)[1], made.weight)
    static = static_deflection(rotor(), speed, direction=-60.0)
    np.testing.assert_allclose(rest[[made.index(node)[0] for node in range(1, 8)]], static.x, rtol=1e-9)
    np.testing.assert_allclose(rest[[made.index(node)[1] for node in range(1, 8)]], static.y, rtol=1e-9)


def test_a_bow_is_followed_slowly_and_straightens_far_above_the_critical_speed():
    shape = np.array([0.0, 3e-5, 5e-5 + 1e-5j, 6e-5, 4e-5, 1e-5, 0.0])
    stiff = [Support(1, 1e13), Support(7, 1e13)]
    free = Rotor(length=[0.2] * 6, outer_diameter=0.1, supports=stiff)
    made = rotor_system(free, 0.0, 1e6, bow=dict(enumerate(shape, start=1)), gravity=0.0)
    slow = synchronous(made, 1e-3)
    np.testing.assert_allclose([slow[made.index(node)[0]] for node in range(1, 8)], shape, atol=1e-10)
    np.testing.assert_allclose([slow[made.index(node)[1]] for node in range(1, 8)], -1j * shape, atol=1e-10)
    # Jeffcott: a light shaft with a bow b at its disc, stiffness k: z = b k / (k − m Ω²)
    light = Rotor(
        length=[0.3, 0.3], outer_diameter=0.02, density=1e-9, supports=[Support(1, 1e13), Support(3, 1e13)]
    )
    light = Rotor(**{**vars(light), "discs": [Disc(2, 10.0)]})
    k = 48 * 2.1e11 * np.pi / 64 * 0.02**4 / 0.6**3
    made = rotor_system(light, 0.0, 1e4, bow={1: 0.0, 2: 1e-4, 3: 0.0}, gravity=0.0)
    for speed in (50.0, 500.0):
        z = synchronous(made, speed)[made.index(2)[0]]
        np.testing.assert_allclose(z, 1e-4 * k / (k - 10.0 * speed**2), rtol=1e-6)


def test_what_is_impossible():
    with pytest.raises(ValueError, match="a bow needs three nodes"):
        rotor_system(rotor(), 110.0, 390.0, bow={1: 0.0, 3: 1e-4})
    with pytest.raises(ValueError, match="its table holds"):
        rotor_system(rotor(), 10.0, 390.0)
    with pytest.raises(ValueError, match="ascend"):
        rotor_system(rotor(), 200.0, 190.0)
    with pytest.raises(ValueError, match="node 9"):
        rotor_system(rotor(), 110.0, 390.0, unbalance={9: 1e-3})


def test_nodes_without_mass_and_damping_follow_the_others():
    """A mass between two springs of k: its weight, and that of the ends, sag as in the whole model."""
    K = 1e6 * np.array([[1.0, -2.0, 1.0], [-2.0, 4.0, -2.0], [1.0, -2.0, 1.0]])
    supports = [Support(1, 2e6), Support(3, 3e6)]
    small = SmallModel((1, 2, 3), [0.0, 10.0, 0.0], [5.0, 90.0, 7.0], K, supports=supports)
    made = rotor_system(small, 0.0, 100.0, unbalance={2: 1e-3})
    assert made.coordinates == ("x2", "y2")
    whole = small.motion(0.0)
    sag = np.linalg.solve(whole.K[3:, 3:], [-5.0, -90.0, -7.0])
    np.testing.assert_allclose(np.linalg.solve(made.K[0], made.weight), [0.0, sag[1]], atol=1e-15)
    np.testing.assert_allclose(made.M, 10.0 * np.eye(2))
    np.testing.assert_allclose(made.unbalance, [1e-3, -1e-3j])
