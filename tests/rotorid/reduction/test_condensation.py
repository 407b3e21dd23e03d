"""Guyan and IRS against dense textbook algebra, known numbers and the theorems they must obey."""

import json

import numpy as np
import pytest
from fem_rotors import machines, rotor23
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import eigh

import fem
from rotorid.reduction import guyan, reduce
from rotorid.reduction.condensation import compare_methods as compare
from rotorid.reduction.masses import plane_at_rest

MASTERS = (7, 12, 18)


def compare_methods(rotor, nodes, modes=2, **how):
    return compare(reduce(rotor, nodes, modes, **how))


def row_of(methods, name):
    (row,) = (row for row in methods.rows if row.name.split(",")[0] == name.split(",")[0])
    return row


@pytest.fixture(scope="module")
def methods():
    return compare_methods(rotor23(), MASTERS)


def test_the_known_frequencies_of_the_reference_rotor(methods):
    known = {
        "Guyan": ("135.2973", "545.3615", "1250.853"),
        "IRS": ("135.2404", "540.7360", "1176.319"),
        "regression, 2 modes": ("135.2358", "539.0517", "1069.258"),
    }
    assert [row.name for row in methods.rows] == list(known)
    for row in methods.rows:
        assert (f"{row.frequencies[0]:.4f}", f"{row.frequencies[1]:.4f}", f"{row.frequencies[2]:.3f}") == (
            known[row.name]
        )
    assert methods.warnings == ()


def textbook(rotor, nodes):
    """Transformations by dense partitioned matrices, in the order of `fem.equations_of_motion`."""
    plane, _ = plane_at_rest(rotor, None)
    motion = fem.equations_of_motion(plane, plane="x")
    M, K = motion.M, motion.K
    d = [motion.index(f"x{node}") for node in nodes]
    o = [i for i in range(len(K)) if i not in d]
    n = len(d)
    static = np.zeros((len(K), n))
    static[d] = np.eye(n)
    static[o] = -np.linalg.solve(K[np.ix_(o, o)], K[np.ix_(o, d)])
    S = np.zeros_like(K)
    S[np.ix_(o, o)] = np.linalg.inv(K[np.ix_(o, o)])
    M_G, K_G = (static.T @ A @ static for A in (M, K))
    improved = static + S @ M @ static @ np.linalg.solve(M_G, K_G)
    mu = eigh(M, K, eigvals_only=True)
    return motion, {"Guyan": static, "IRS": improved}, 1 / np.sqrt(mu[::-1][:n])


def close(a, b, tolerance):
    """Matrices as quadratic forms: each entry beside the diagonal entries of its row and column."""
    scale = np.sqrt(np.outer(np.abs(np.diag(b)), np.abs(np.diag(b))))
    np.testing.assert_allclose(a / scale, b / scale, atol=tolerance)


def check_against_textbook(rotor, nodes, tolerance=1e-6):
    motion, transformations, frequencies = textbook(rotor, nodes)
    result = compare_methods(rotor, nodes)
    np.testing.assert_allclose(result.rotor_frequencies, frequencies, rtol=tolerance)
    for name, T in transformations.items():
        row = row_of(result, name)
        deflections = [motion.index(f"x{node}") for node in range(1, rotor.n_nodes + 1)]
        np.testing.assert_allclose(row.T, T[deflections], atol=tolerance * np.abs(T).max())
        close(row.M, T.T @ motion.M @ T, tolerance)
        close(row.K, T.T @ motion.K @ T, tolerance)
        omega = np.sqrt(eigh(row.K, row.M, eigvals_only=True))
        np.testing.assert_allclose(row.frequencies, omega, rtol=tolerance)
        np.testing.assert_allclose(
            row.K @ row.shapes, row.M @ row.shapes * row.frequencies**2, atol=1e-6 * np.abs(row.K).max()
        )


def test_textbook_algebra_on_the_reference_rotor():
    check_against_textbook(rotor23(), MASTERS)
    check_against_textbook(rotor23(), (18, 2, 9, 12))


def test_textbook_algebra_with_shear_tilting_springs_and_two_pedestals_at_one_node():
    rotor = fem.Rotor(
        [0.2] * 6,
        0.08,
        discs=[fem.Disc(3, 20.0, 0.4, 0.3)],
        supports=[
            fem.Support(1, 2e7, pedestal=fem.Pedestal(30.0, 5e7)),
            fem.Support(1, 1e7, pedestal=fem.Pedestal(4.0, 3e7)),
            fem.Support(4, 0.0, 1e3, pedestal=fem.Pedestal(1e-4, 1e7)),
            fem.Support(7, 3e7, tilting_stiffness=1e5),
        ],
        model=fem.Model(shear=True, rotary_inertia=True),
    )
    motion, transformations, _ = textbook(rotor, (2, 5))
    assert [name for name in motion.coordinates if "foot" in name] == ["foot_x1", "foot_x2", "foot_x3"]
    check_against_textbook(rotor, (2, 5))
    assert np.abs(transformations["IRS"][-3:]).max(axis=1).tolist()[-1] == 0.0  # nothing ties the third


@settings(max_examples=30)
@given(machines(elements=(4, 12)), st.integers(0, 2**32 - 1))
def test_any_machine_agrees_with_textbook_algebra(rotor, seed):
    rng = np.random.default_rng(seed)
    nodes = rng.choice(np.arange(1, rotor.n_nodes + 1), size=2, replace=False).tolist()
    check_against_textbook(rotor, nodes, 1e-5)


@settings(max_examples=40)
@given(machines(elements=(4, 12)), st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_ritz_frequencies_are_never_below_the_rotors(rotor, n, seed):
    nodes = np.random.default_rng(seed).choice(np.arange(1, rotor.n_nodes + 1), size=n, replace=False)
    result = compare_methods(rotor, nodes.tolist(), modes=1, normalise="largest")
    for name in ("Guyan", "IRS"):
        assert (row_of(result, name).relative_error > -1e-7).all()  # neighbouring masters cost digits
    # the order of the masters only orders the unknowns
    turned = compare_methods(rotor, nodes[::-1].tolist(), modes=1, normalise="largest")
    close(row_of(turned, "IRS").M[::-1, ::-1], row_of(result, "IRS").M, 1e-7)


def test_a_massless_shaft_with_discs_at_the_masters_is_exact_for_every_method():
    """Then static condensation loses nothing, the mass matrix is that of the discs, and (50) agrees."""
    masses = [40.0, 25.0]
    rotor = fem.Rotor(
        [0.2] * 6,
        0.06,
        density=0.0,
        discs=[fem.Disc(3, masses[0]), fem.Disc(6, masses[1])],
        supports=[fem.Support(1, 1e8), fem.Support(7, 1e8)],
    )
    result = compare_methods(rotor, (3, 6))
    for row in result.rows:
        np.testing.assert_allclose(row.M, np.diag(masses), atol=1e-6)
        np.testing.assert_allclose(row.frequencies, result.rotor_frequencies, rtol=1e-9)
        np.testing.assert_allclose(row.mac, 1.0, rtol=1e-9)
        np.testing.assert_allclose(row.K, np.linalg.inv(fem.compliance(rotor, (3, 6))), rtol=1e-7)
    assert [row.masses is not None for row in result.rows] == [False, False, True]
    np.testing.assert_allclose(row_of(result, "regression").masses, masses, rtol=1e-7)
    assert row_of(result, "Guyan").masses is None


def test_a_singular_mass_matrix_is_said():
    """One of two masses stands on a support that hardly moves: the second master moves no mass."""
    rotor = fem.Rotor(
        [0.25] * 8,
        0.05,
        density=0.0,
        discs=[fem.Disc(3, 10.0), fem.Disc(1, 10.0)],
        supports=[fem.Support(1, 1e16), fem.Support(9, 1e9)],
    )
    result = compare_methods(rotor, (3, 6), modes=1)
    assert row_of(result, "IRS").M is None
    assert any(text.startswith("IRS: Guyan's mass matrix is singular") for text in result.warnings)
    document = json.loads(json.dumps(result.to_dict(), allow_nan=False))["methods"][1]
    assert document["natural_frequencies_rad_s"] == [None, None]
    assert "singular" in document["reason"]
    assert "no model" in result.summary()
    guess = row_of(result, "Guyan")
    assert guess.relative_error[0] == pytest.approx(0.0, abs=1e-9)
    assert np.isnan(guess.frequencies[1])
    assert np.isnan(guess.mac[1])


def test_guyan_alone_is_the_row_of_the_comparison(methods):
    alone, row = guyan(rotor23(), MASTERS), row_of(methods, "Guyan")
    np.testing.assert_allclose(alone.M, row.M, rtol=1e-12)
    np.testing.assert_allclose(alone.relative_error, row.relative_error, atol=1e-11)
    with pytest.raises(ValueError, match="not held"):
        guyan(fem.Rotor([0.2] * 4, 0.05), [2, 3])
