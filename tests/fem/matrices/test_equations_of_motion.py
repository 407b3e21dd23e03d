"""Plain matrices of a rotor: the same frequencies and whirl modes as the program's own solvers."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh

import fem
from rotorid.samples import sample_data
from rotorid.tables import read_rotor


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


def test_both_planes_have_the_whirl_modes_of_bearings_seals_and_discs():
    rotor = read_rotor(sample_data() / "compressor" / "rotor.toml")
    speed = 700.0
    motion = fem.equations_of_motion(rotor, speed=speed)
    n = len(motion.coordinates)
    # u = λ (−K⁻¹ C u − K⁻¹ M λu): the form that keeps the digits of the low modes
    small = np.linalg.solve(motion.K, np.hstack((motion.C, motion.M)))
    mine = 1 / np.linalg.eigvals(np.vstack((-small, np.eye(n, 2 * n))))
    theirs = fem.whirl_modes(rotor, speed, 4).eigenvalues
    for value in theirs:
        assert np.abs(mine - value).min() < 1e-8 * abs(value)


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


def test_what_cannot_be():
    coupled = fem.Rotor(
        length=[1.0],
        outer_diameter=0.05,
        supports=[fem.Support(1, [[1e7, 1e5], [-1e5, 1e7]]), fem.Support(2, 1e7)],
    )
    with pytest.raises(ValueError, match="coupled: take both"):
        fem.equations_of_motion(coupled, plane="x")
    with pytest.raises(ValueError, match="no plane 'z'"):
        fem.equations_of_motion(coupled, plane="z")
    with pytest.raises(ValueError, match="not negative"):
        fem.equations_of_motion(coupled, speed=-1.0)
    with pytest.raises(ValueError, match="no unknown 'x9'"):
        fem.equations_of_motion(coupled).index("x9")
