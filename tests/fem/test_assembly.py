"""Matrices of a rotor: the same frequencies and modes as the solvers', the whole band, internal damping."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from fem_rotors import machines
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import eigh

import fem
from fem import state_space
from fem.assembly import WholeBand, assemble, both_planes, project, supported
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


@given(machines(elements=(2, 10)), st.booleans())
@settings(max_examples=30, deadline=None)
def test_whole_band_and_basis_are_the_equations(rotor, damped):
    """At any λ the band solves λ² M + λ C + K of both planes; a full basis is the same."""
    if damped:
        rotor = dataclasses.replace(rotor, forces=[fem.InternalDamping(2, "", 3e3)])
    speed, value = 200.0, -7.0 + 310.0j
    motion = fem.equations_of_motion(rotor, speed=speed)
    n = assemble(rotor).size
    T = value**2 * motion.M + value * motion.C + motion.K
    rng = np.random.default_rng(1)
    load = rng.normal(size=(3, 2, n)) + 1j * rng.normal(size=(3, 2, n))
    full = np.zeros((len(T), 3), dtype=complex)
    full[: 2 * n] = load.reshape(3, -1).T
    for planes in {2, 1 if rotor.symmetric else 2}:
        P = both_planes(rotor, complex_coordinate=planes == 1)
        band = WholeBand(P)
        factors = band.factor(value, speed)
        loads = load if planes == 2 else load[:, :1] + 1j * load[:, 1:]
        X = band.planes(factors(band.interleaved(loads).T).T)
        x = np.linalg.solve(T, full)[: 2 * n].T.reshape(3, 2, n)
        x = x if planes == 2 else x[:, :1] + 1j * x[:, 1:]
        np.testing.assert_allclose(X, x, rtol=0, atol=1e-8 * np.abs(x).max())
    basis = np.linalg.qr(rng.normal(size=(n, 4)))[0]
    reduced = project(both_planes(rotor, complex_coordinate=False), basis)
    D, K = (matrix[0] for matrix in reduced.at(np.array([speed])))
    vectors = np.eye(reduced.size)
    whole = np.hstack((reduced.expand(vectors).reshape(-1, 2 * n), vectors[:, 8:]))
    for small, large in ((reduced.M, motion.M), (D, motion.C), (K, motion.K)):
        np.testing.assert_allclose(small, whole @ large @ whole.T, atol=1e-9 * np.abs(large).max())


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
