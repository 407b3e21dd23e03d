"""Matrices of a rotor: the same frequencies and modes as the solvers', the whole band, internal damping."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy.linalg import eigh

import fem
from fem import state_space
from fem.assembly import assemble, supported
from fem.forces import law, tables
from rotorid.files import read_rotor
from rotorid.samples import sample_data


@pytest.fixture(scope="module")
def rotor23():
    return read_rotor(sample_data() / "rotor23.csv")


def test_one_plane_has_the_rotor_s_frequencies(rotor23):
    motion = fem.equations_of_motion(rotor23, plane="x")
    found = np.sqrt(eigh(motion.K, motion.M, eigvals_only=True)[:3])
    np.testing.assert_allclose(found, fem.critical_speeds(rotor23, 3).frequencies, rtol=1e-7)
    assert motion.coordinates[0] == "x1"
    assert len(motion.coordinates) == 48
    assert motion.index("tilt_x2") == 3
    assert not motion.C.any()


def test_pedestals_are_unknowns():
    stand = fem.Pedestal(10.0, 1e8)
    rotor = fem.Rotor(
        length=[0.5, 0.5],
        outer_diameter=0.05,
        supports=[fem.Support(1, 1e7, pedestal=stand), fem.Support(3, 1e7)],
    )
    motion = fem.equations_of_motion(rotor, plane="x")
    assert motion.coordinates[-1] == "foot_x1"
    foot = motion.index("foot_x1")
    assert motion.M[foot, foot] == 10.0
    assert motion.K[foot, foot] == pytest.approx(1.1e8)
    assert motion.K[foot, motion.index("x1")] == -1e7


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"plane": "x"}, "coupled: take both"),
        ({"plane": "z"}, "no plane 'z'"),
        ({"speed": -1.0}, "not negative"),
    ],
)
def test_what_cannot_be(options, words):
    supports = [fem.Support(1, [[1e7, 1e5], [-1e5, 1e7]]), fem.Support(2, 1e7)]
    coupled = fem.Rotor([1.0], 0.05, supports=supports)
    with pytest.raises(ValueError, match=words):
        fem.equations_of_motion(coupled, **options)
    with pytest.raises(ValueError, match="no unknown 'x9'"):
        fem.equations_of_motion(coupled).index("x9")


def jeffcott(inner, outer):
    """A disc amid a massless shaft; dampers at the disc that turn and that stand."""
    supports = [fem.Support(1, 2e7), fem.Support(3, 2e7), fem.Support(2, 0.0, outer)]
    return fem.Rotor(
        [0.3, 0.3],
        0.04,
        density=0.0,
        discs=[fem.Disc(2, 12.0)],
        supports=supports,
        forces=[fem.InternalDamping(2, "", inner)],
    )


def test_internal_damping_drives_forward_whirl_beyond_its_threshold():
    """m z'' + (cₑ + cᵢ) z' + (k − i Ω cᵢ) z = 0 grows beyond Ω = ω (1 + cₑ / cᵢ)."""
    inner, outer = 300.0, 120.0
    rotor = jeffcott(inner, outer)
    k = 1 / (1 / 4e7 + 0.6**3 / (48 * 2.1e11 * math.pi * 0.04**4 / 64))
    threshold = math.sqrt(k / 12.0) * (1 + outer / inner)
    for speed in (0.5 * threshold, threshold, 2.0 * threshold):
        roots = np.roots([12.0, inner + outer, k - 1j * speed * inner])
        expected = np.concatenate((roots, roots.conj()))
        values = state_space(fem.equations_of_motion(rotor, speed=speed)).eigenvalues
        for value in expected:
            assert np.abs(values - value).min() < 1e-9 * abs(value)
        assert np.sign(round(values.real.max(), 6)) == np.sign(round(speed - threshold, 6))


def test_internal_damping_is_the_law_of_the_force():
    rotor, speed = jeffcott(300.0, 0.0), 170.0
    damped, plain = (fem.equations_of_motion(each, speed=speed) for each in (rotor, rotor.linear))
    codes, values = tables(rotor.forces)
    out = np.zeros((2, 6))
    law(int(codes[0]), values[0], 1e-4, 2e-4, 0.1, -0.2, speed, out)
    at = [damped.index("x2"), damped.index("y2")]
    np.testing.assert_allclose((damped.K - plain.K)[np.ix_(at, at)], -out[:, 1:3], rtol=0, atol=1e-6)
    np.testing.assert_allclose((damped.C - plain.C)[np.ix_(at, at)], -out[:, 3:5], rtol=0, atol=1e-9)
    # Forward whirl does not strain it; what runs backward is damped twice.
    at = supported(rotor, np.array([speed]))
    np.testing.assert_array_equal(at.stiffness[0, at.nodes.index(2)], [[0, 0], [0, 600j * speed]])


def test_other_forces_are_refused():
    rotor = dataclasses.replace(jeffcott(1.0, 0.0), forces=[fem.CubicSpring(2, "", 1e6, 1e12)])
    with pytest.raises(ValueError, match=r"the cubic spring at node 2 is not linear.*rotorid bearings"):
        assemble(rotor)
