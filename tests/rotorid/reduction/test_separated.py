"""Formula (47): shaft flexibility apart from the supports, against the static solution of the whole rotor."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fem
from rotorid.files import read_rotor
from rotorid.reduction import Separated, separate
from rotorid.samples import sample_data


@pytest.fixture(scope="module")
def rotor():
    return read_rotor(sample_data() / "rotor23.csv")


@pytest.mark.parametrize("nodes", [(7, 12, 18), (1, 7, 12, 18, 24), (2, 3, 22, 23), (24, 1)])
def test_both_parts_together_are_the_compliance_of_the_rotor(rotor, nodes):
    found = separate(rotor, nodes)
    c = [support.stiffness for support in rotor.supports]
    expected = fem.compliance(rotor, nodes)
    np.testing.assert_allclose(found.compliance(c), expected, rtol=1e-9, atol=1e-9 * expected.max())
    assert found.supports == (2, 22)
    np.testing.assert_allclose(found.fractions.sum(axis=1), 1.0, rtol=1e-14)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), shear=st.booleans())
def test_supports_are_parameters_of_the_compliance(seed, shear):
    """δ and R of a rotor on any supports hold for any others."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 9))
    lengths, diameters = rng.uniform(0.1, 0.3, n), rng.uniform(0.05, 0.15, n)
    a, b = sorted(rng.choice(n + 1, 2, replace=False) + 1)
    nodes = tuple(int(x) for x in rng.choice(n + 1, 3, replace=False) + 1)
    model = fem.Model(shear=shear)
    tables = [fem.Support(int(b), [1e7, 3e7], speeds=(0.0, 500.0)), fem.Support(int(a), 5e6)]
    found = separate(fem.Rotor(lengths, diameters, supports=tables, model=model), nodes)
    c = 10 ** rng.uniform(6, 9, 2)
    supports = [fem.Support(int(a), c[0]), fem.Support(int(b), c[1])]
    expected = fem.compliance(fem.Rotor(lengths, diameters, supports=supports, model=model), nodes)
    np.testing.assert_allclose(found.compliance(c), expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_the_flexibility_of_a_uniform_beam_in_closed_form():
    """Force between the supports: δ = a² b² / (3 E I l); on the overhang h: h² (l + h) / (3 E I)."""
    supports = [fem.Support(1, 1e8), fem.Support(5, 1e8)]
    beam = fem.Rotor([0.25] * 6, 0.05, supports=supports)
    length, found = 1.0, separate(beam, (2, 3, 7))
    EI = beam.youngs_modulus[0] * np.pi * 0.05**4 / 64
    expected = np.array([0.25**2 * 0.75**2 / (3 * length), 0.5**4 / (3 * length), 0.5**2 * 1.5 / 3])
    np.testing.assert_allclose(np.diag(found.delta) * EI, expected, rtol=1e-9)


def test_the_formula_as_printed():
    rng = np.random.default_rng(1)
    A, a, l, c1, c2 = rng.normal(size=(3, 3)), np.array([-0.2, 0.4, 1.3]), 1.1, 2e7, 5e7  # noqa: E741
    delta = A @ A.T * 1e-9
    found = Separated((1, 2, 3), a, (1, 2), l, delta).compliance([c1, c2])
    for i in range(3):
        for j in range(3):
            printed = delta[i, j] + (l - a[i]) * (l - a[j]) / (c1 * l**2) + a[i] * a[j] / (c2 * l**2)
            assert found[i, j] == pytest.approx(printed, rel=1e-13)


@pytest.mark.parametrize(
    ("supports", "message"),
    [
        ([fem.Support(1, 1e8)], "supports at 1: use the small model"),
        ([fem.Support(n, 1e8) for n in (1, 3, 5)], "supports at 1, 3, 5: use the small model"),
        ([fem.Support(1, 1e8, tilting_stiffness=1e5), fem.Support(5, 1e8)], "tilting"),
        (
            [fem.Support(1, 1e8), fem.Support(5, 1e8), fem.Support(3, 1e6, kind="seal")],
            "without tilting stiffness and seals",
        ),
    ],
)
def test_supports_that_equilibrium_cannot_share_are_refused(supports, message):
    with pytest.raises(ValueError, match=message):
        separate(fem.Rotor([0.25] * 4, 0.05, supports=supports), (2, 3))
