import json
import math

import numpy as np
import pytest
from fem_rotors import mirrored, refined, rotor23, rotors, uniform
from hypothesis import given, settings
from hypothesis import strategies as st

import fem
from fem import lowest_modes, one_plane
from fem.assembly import assemble, dense, multiply

# Roots of cos x cosh x = 1: the free beam.
FREE = np.array([4.730040744862704, 7.853204624095838, 10.995607838001671])


def free_beam(length=1.0, diameter=0.1):
    return FREE**2 * math.sqrt(2.1e11 * diameter**2 / 16 / 7850.0) / length**2


def test_reference_rotor():
    modes = fem.critical_speeds(rotor23(), n=3)
    assert modes.shapes.shape == (24, 3)
    assert modes.warnings == ()


def test_frequencies_converge_with_the_fourth_power_of_the_element_length():
    errors = [fem.critical_speeds(uniform(n), n=3).frequencies[2:] / free_beam() - 1 for n in (16, 32, 64)]
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (np.array(errors) > 0).all()
    np.testing.assert_allclose(rates, 4.0, atol=0.05)


@pytest.mark.parametrize("n", [60, 200, 800])
def test_fine_meshes_keep_their_digits(n):
    found = fem.critical_speeds(uniform(n), n=3).frequencies[2:]
    np.testing.assert_allclose(found, free_beam(), rtol=1e-10 + (4.7 / n) ** 4)


def test_a_fine_mesh_is_said_and_a_hopeless_one_refused():
    assert fem.critical_speeds(rotor23()).warnings == ()
    (text,) = fem.critical_speeds(refined(rotor23(), 20)).warnings
    assert "460 elements" in text
    assert "by 7e-06 of their size" in text
    with pytest.raises(ValueError, match=r"6000 elements is too fine for float64.*join"):
        fem.critical_speeds(uniform(6000))


def test_rigid_body_modes_of_a_free_rotor():
    modes = fem.critical_speeds(uniform(20), n=3)
    np.testing.assert_array_equal(modes.frequencies[:2], 0.0)
    np.testing.assert_allclose(modes.frequencies[2:], free_beam(), rtol=1e-4)
    np.testing.assert_allclose(modes.shapes[:, 0], 1.0, rtol=1e-12)
    np.testing.assert_allclose(modes.shapes[:, 1], 1 - 2 * modes.positions, atol=1e-12)
    assert modes.summary().count("rigid body") == 2


def test_one_support_leaves_one_rigid_motion_about_it():
    modes = fem.critical_speeds(uniform(20, supports=[fem.Support(1, 1e7)]), n=3)
    assert modes.frequencies[0] == 0.0
    assert modes.frequencies[1] > 100
    # Node 1 does not move: scaled to the largest value.
    np.testing.assert_allclose(modes.shapes[:, 0], modes.positions, atol=1e-12)


@pytest.mark.parametrize("n", [10, 60, 300])
@pytest.mark.parametrize("k", [1e-3, 1.0, 1e3])
def test_a_barely_supported_rotor_bounces_and_rocks_on_its_springs(n, k):
    modes = fem.critical_speeds(uniform(n, supports=[fem.Support(1, k), fem.Support(n + 1, k)]), n=3)
    mass = 7850 * math.pi / 4 * 0.01
    np.testing.assert_allclose(modes.frequencies[:2] ** 2, [2 * k / mass, 6 * k / mass], rtol=1e-4)
    np.testing.assert_allclose(modes.frequencies[2], free_beam()[0], rtol=1e-3)


def test_equal_frequencies_are_both_found():
    # A stiff body on springs at ± L/√12 from its centre bounces and rocks with the same frequency.
    half = 1 / math.sqrt(12)
    lengths = np.concatenate(
        [np.full(n, part / n) for n, part in ((20, 0.5 - half), (60, 2 * half), (20, 0.5 - half))]
    )
    k = 1e4
    body = fem.Rotor(lengths, 0.1, density=7850.0, supports=[fem.Support(21, k), fem.Support(81, k)])
    found = fem.critical_speeds(body, n=3).frequencies
    mass = 7850 * math.pi / 4 * 0.01
    np.testing.assert_allclose(found[:2] ** 2, 2 * k / mass, rtol=1e-3)
    assert found[2] > 2000


def test_massless_shaft_with_one_disc_is_laval_s_rotor():
    rotor = fem.Rotor(
        [0.25, 0.25],
        0.02,
        density=0.0,
        discs=[fem.Disc(2, 5.0)],
        supports=[fem.Support(1, 2e7), fem.Support(3, 2e7)],
    )
    bending = 48 * 2.1e11 * rotor.second_moment[0] / 0.5**3
    modes = fem.critical_speeds(rotor, n=1)
    assert modes.frequencies[0] == pytest.approx(math.sqrt(1 / (1 / bending + 1 / 4e7) / 5.0), rel=1e-12)
    with pytest.raises(ValueError, match="2 critical speeds cannot be found: the model has 1 to 1"):
        fem.critical_speeds(rotor, n=2)


@given(rotors(elements=(33, 70)), st.integers(1, 8))
@settings(max_examples=25, deadline=None)
def test_the_subspace_finds_what_the_dense_solution_finds(rotor, m):
    import scipy.linalg

    A = assemble(rotor)
    K = dense(one_plane(rotor, A).stiffness)
    mu, _ = scipy.linalg.eigh(dense(A.mass), K, subset_by_index=[A.size - m, A.size - 1])
    spectrum = lowest_modes(rotor, A, m)
    # The dense solution itself suffers from rounding K; ours, from energies, by the square of this only.
    lost = float(spectrum.rounding.max())
    np.testing.assert_allclose(spectrum.squares, 1 / mu[::-1], rtol=1e-6 + 10 * lost)
    np.testing.assert_allclose(spectrum.vectors.T @ dense(A.mass) @ spectrum.vectors, np.eye(m), atol=1e-7)


@given(rotors())
@settings(max_examples=25, deadline=None)
def test_scale_orientation_and_refinement_do_not_matter(rotor):
    found = fem.critical_speeds(rotor, n=2)
    np.testing.assert_allclose(
        fem.critical_speeds(mirrored(rotor), n=2).frequencies, found.frequencies, rtol=1e-8
    )
    stiffer = fem.Rotor(
        rotor.length,
        rotor.outer_diameter,
        rotor.inner_diameter,
        4 * rotor.youngs_modulus,
        rotor.density,
        rotor.discs,
        [fem.Support(s.node, 4 * s.stiffness) for s in rotor.supports],
    )
    np.testing.assert_allclose(
        fem.critical_speeds(stiffer, n=2).frequencies, 2 * found.frequencies, rtol=1e-8
    )
    # Lengths ten times larger: E I grows with 10⁴, masses with 10³, E I / L³ with 10.
    larger = fem.Rotor(
        10 * rotor.length,
        10 * rotor.outer_diameter,
        10 * rotor.inner_diameter,
        rotor.youngs_modulus,
        rotor.density,
        [fem.Disc(d.node, 1e3 * d.mass) for d in rotor.discs],
        [fem.Support(s.node, 10 * s.stiffness) for s in rotor.supports],
    )
    np.testing.assert_allclose(
        fem.critical_speeds(larger, n=2).frequencies, found.frequencies / 10, rtol=1e-8
    )
    # Rayleigh–Ritz: cutting elements can only lower a frequency.
    finer = fem.critical_speeds(refined(rotor, 2), n=2).frequencies
    assert (finer <= found.frequencies * (1 + 1e-9)).all()


@given(rotors())
@settings(max_examples=25, deadline=None)
def test_bands_are_the_matrices(rotor):
    A = assemble(rotor)
    X = np.random.default_rng(1).normal(size=(A.size, 3))
    pencil = one_plane(rotor, A)
    K = dense(pencil.stiffness)
    np.testing.assert_array_equal(K, K.T)
    np.testing.assert_allclose(multiply(pencil.stiffness, X), K @ X, rtol=1e-9, atol=1e-9 * np.abs(K).max())

    def energy(Y):
        return pencil.energy(Y).diagonal()

    np.testing.assert_allclose(energy(X), np.einsum("ij,ik,kj->j", X, K, X), rtol=1e-9)
    # A rigid translation carries the whole mass and strains no shaft.
    ones = np.tile([1.0, 0.0], rotor.n_nodes)[:, None]
    assert (ones.T @ multiply(A.mass, ones)).item() == pytest.approx(rotor.total_mass, rel=1e-12)
    assert energy(ones)[0] == pytest.approx(sum(s.stiffness for s in rotor.supports), rel=1e-12)


@pytest.mark.parametrize("columns", [3, 30])
def test_hermitian_bands(columns):
    rng = np.random.default_rng(2)
    band = rng.normal(size=(4, 9)) + 1j * rng.normal(size=(4, 9))
    band[3] = band[3].real
    X = rng.normal(size=(9, columns)) + 1j * rng.normal(size=(9, columns))
    full = dense(band)
    np.testing.assert_array_equal(full, full.conj().T)
    np.testing.assert_allclose(multiply(band, X), full @ X, rtol=1e-12)


def test_ignored_inertia_is_said():
    rotor = fem.Rotor(
        [0.2] * 4,
        0.05,
        discs=[fem.Disc(3, 5.0, 0.1, 0.05, name="wheel")],
        supports=[fem.Support(1, 1e8), fem.Support(5, 1e8)],
    )
    texts = fem.critical_speeds(rotor).warnings
    assert [text.split(" is ignored")[0] for text in texts] == [
        "disc at node 3: diametral inertia",
        "disc at node 3: polar inertia",
    ]
    assert f"Warning: {texts[0]}" in " ".join(fem.critical_speeds(rotor).summary().split())


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
    ],
)
def test_impossible_requests_are_refused(rotor, n, message):
    with pytest.raises(ValueError, match=message):
        fem.critical_speeds(rotor, n)


def test_result_as_table_json_and_text():
    modes = fem.critical_speeds(rotor23(), n=2)
    document = json.loads(json.dumps(modes.to_dict()))
    assert set(document) >= {"critical_speeds_rad_s", "critical_speeds_rpm", "positions_m", "mode_shapes"}
    assert len(document["mode_shapes"]) == 2
    assert len(document["mode_shapes"][0]) == 24
    assert document["critical_speeds_rpm"][0] == pytest.approx(135.24041 * 30 / math.pi, rel=1e-7)
    frame = modes.to_frame()
    assert list(frame.columns) == ["node", "position_m", "mode_1", "mode_2"]
    assert frame.node.tolist() == list(range(1, 25))
    np.testing.assert_array_equal(frame.mode_2, modes.shapes[:, 1])
    assert "1291.45" in modes.summary()
    with pytest.raises(ValueError, match="read-only"):
        modes.shapes[0, 0] = 0.0


def test_a_thin_disc_does_not_take_the_place_of_a_rigid_motion():
    """Its λ < 0 lies nearer to −σ than 0 does."""
    import scipy.linalg

    disc, model = fem.Disc(3, 30.0, 1.0, 0.6), fem.Model(shear=True, rotary_inertia=True, gyroscopic=True)
    seen = 0
    for diameter in np.linspace(0.03, 0.3, 40):
        rotor = fem.Rotor([0.2] * 6, diameter, discs=[disc], model=model)
        A = assemble(rotor)
        pencil = one_plane(rotor, A, 1)
        spectrum = lowest_modes(rotor, A, 6, pencil)
        K, M = dense(pencil.stiffness), dense(pencil.mass)
        squares = 1 / scipy.linalg.eigh(M, K + spectrum.shift * M, eigvals_only=True) - spectrum.shift
        squares = squares[np.argsort(np.abs(squares))][2:6]
        np.testing.assert_allclose(np.sort(spectrum.squares[2:]), np.sort(squares), rtol=1e-6)
        seen += -2 * spectrum.shift < spectrum.squares.min() < -spectrum.shift
    assert seen
