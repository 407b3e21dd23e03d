import json
import math

import numpy as np
import pytest
from fem_rotors import rotor23, uniform

import fem
from fem import lowest_modes, one_plane
from fem.assembly import assemble, dense

# Roots of cos x cosh x = 1: the free beam.
ROOTS = np.array([4.730040744862704, 7.853204624095838, 10.995607838001671])
FREE = ROOTS**2 * math.sqrt(2.1e11 * 0.1**2 / 16 / 7850.0)
MASS = 7850 * math.pi / 4 * 0.01
MODEL = fem.Model(shear=True, rotary_inertia=True, gyroscopic=True)
THIN = [fem.Disc(node, 30.0, 1.0, 0.6) for node in (3, 5)]


@pytest.mark.parametrize("n", [60, 200, 800])
def test_fine_meshes_keep_their_digits(n):
    found = fem.critical_speeds(uniform(n), n=3).frequencies[2:]
    np.testing.assert_allclose(found, FREE, rtol=1e-10 + (4.7 / n) ** 4)


def test_a_fine_mesh_is_said_and_a_hopeless_one_refused():
    (text,) = fem.critical_speeds(fem.refined(rotor23(), 20)).warnings
    assert "460 elements" in text
    assert "by 7e-06 of their size" in text
    with pytest.raises(ValueError, match=r"6000 elements is too fine for float64.*join"):
        fem.critical_speeds(uniform(6000))


def test_rigid_body_modes_of_a_free_rotor():
    modes = fem.critical_speeds(uniform(20), n=3)
    np.testing.assert_array_equal(modes.frequencies[:2], 0.0)
    np.testing.assert_allclose(modes.frequencies[2:], FREE, rtol=1e-4)
    np.testing.assert_allclose(modes.shapes[:, 0], 1.0, rtol=1e-12)
    np.testing.assert_allclose(modes.shapes[:, 1], 1 - 2 * modes.positions, atol=1e-12)


@pytest.mark.parametrize("n", [10, 60, 300])
@pytest.mark.parametrize("k", [1e-3, 1.0, 1e3])
def test_a_barely_supported_rotor_bounces_and_rocks_on_its_springs(n, k):
    modes = fem.critical_speeds(uniform(n, supports=[fem.Support(1, k), fem.Support(n + 1, k)]), n=3)
    np.testing.assert_allclose(modes.frequencies[:2] ** 2, [2 * k / MASS, 6 * k / MASS], rtol=1e-4)
    np.testing.assert_allclose(modes.frequencies[2], FREE[0], rtol=1e-3)


def test_equal_frequencies_are_both_found():
    # A stiff body on springs at ± L/√12 from its centre bounces and rocks with the same frequency.
    half = 1 / math.sqrt(12)
    end = (0.5 - half) / 20
    lengths = np.repeat([end, half / 30, end], [20, 60, 20])
    k = 1e4
    body = fem.Rotor(lengths, 0.1, density=7850.0, supports=[fem.Support(21, k), fem.Support(81, k)])
    found = fem.critical_speeds(body, n=3).frequencies
    np.testing.assert_allclose(found[:2] ** 2, 2 * k / MASS, rtol=1e-3)
    assert found[2] > 2000


@pytest.mark.parametrize(
    ("rotor", "n", "message"),
    [
        (uniform(3), 0, "0 critical speeds cannot be found: ask for 1 or more"),
        (uniform(3), 9, "9 critical speeds cannot be found"),
        (uniform(3), 2.0, "the number of critical speeds must be a whole number"),
        (fem.Rotor([0.1] * 3, 0.05, density=0.0, supports=[fem.Support(1, 1e6)]), 1, "the rotor has no mass"),
        (
            fem.Rotor([0.1] * 3, 0.05, density=0.0, discs=[fem.Disc(2, 1.0)]),
            1,
            "rigid body without moving any mass",
        ),
        # Both modes beside the rigid ones have negative mass.
        (fem.Rotor([0.2] * 6, 0.1, density=0.0, discs=THIN, model=MODEL), 1, "the model has 1 to 0"),
    ],
)
def test_impossible_requests_are_refused(rotor, n, message):
    with pytest.raises(ValueError, match=message):
        fem.critical_speeds(rotor, n)


def test_result_as_table_and_json():
    modes = fem.critical_speeds(rotor23(), n=2)
    document = json.loads(json.dumps(modes.to_dict()))
    assert set(document) >= {"critical_speeds_rad_s", "critical_speeds_rpm", "positions_m", "mode_shapes"}
    assert np.shape(document["mode_shapes"]) == (2, 24)
    assert document["critical_speeds_rpm"][0] == pytest.approx(135.24041 * 30 / math.pi, rel=1e-7)
    frame = modes.to_frame()
    assert list(frame.columns) == ["node", "position_m", "mode_1", "mode_2"]
    np.testing.assert_array_equal(frame.mode_2, modes.shapes[:, 1])
    with pytest.raises(ValueError, match="read-only"):
        modes.shapes[0, 0] = 0.0


def test_a_thin_disc_does_not_take_the_place_of_a_rigid_motion():
    """Its λ < 0 lies nearer to −σ than 0 does."""
    from scipy.linalg import eigh

    seen = 0
    for diameter in np.linspace(0.03, 0.3, 40):
        rotor = fem.Rotor([0.2] * 6, diameter, discs=THIN[:1], model=MODEL)
        pencil = one_plane(rotor, assemble(rotor), 1)
        spectrum = lowest_modes(pencil, 6)
        K, M = dense(pencil.stiffness), dense(pencil.mass)
        squares = 1 / eigh(M, K + spectrum.shift * M, eigvals_only=True) - spectrum.shift
        squares = sorted(squares, key=abs)[2:6]
        np.testing.assert_allclose(np.sort(spectrum.squares[2:]), np.sort(squares), rtol=1e-6)
        seen += -2 * spectrum.shift < spectrum.squares.min() < -spectrum.shift
    assert seen
