"""The mesh check, and cutting elements."""

import numpy as np
import pytest
from fem_rotors import uniform
from hypothesis import given, settings
from hypothesis import strategies as st

import fem


@given(st.integers(3, 24), st.booleans())
@settings(max_examples=25, deadline=None)
def test_the_estimate_is_the_true_error(n, shear):
    """Simply supported shaft: closed forms of tests/fem/test_elements.py."""
    exact = [1261.04906276, 4877.35161039] if shear else [1276.187754, 5104.751016]
    rotor = uniform(
        n,
        supports=[fem.Support(1, 1e18), fem.Support(n + 1, 1e18)],
        model=fem.Model(shear=shear, rotary_inertia=shear),
    )
    check = fem.mesh_check(rotor, 2)
    true = check.frequencies / exact - 1
    np.testing.assert_allclose(check.errors, true, rtol=0.3 if n < 6 else 0.06, atol=2e-9)
    np.testing.assert_allclose(check.extrapolated, exact, rtol=0.3 * true.max() + 2e-9)
    assert check.elements == n
    np.testing.assert_array_equal(check.frequencies, fem.critical_speeds(rotor, 2).frequencies)


def test_cutting_elements_moves_everything_along():
    rotor = fem.Rotor(
        [0.1, 0.3],
        [0.05, 0.04],
        discs=[fem.Disc(2, 3.0, 0.1, 0.05, name="d")],
        supports=[fem.Support(1, [1e7, 2e7], speeds=[0, 9], name="b"), fem.Support(3, 1e8)],
        stations={"end": 3},
        poisson_ratio=[0.3, 0.2],
        model=fem.Model(True, True, True),
        forces=[fem.Stop(2, stiffness=1.0)],
    )
    finer = fem.refined(rotor, 3)
    np.testing.assert_allclose(finer.length, [0.1 / 3] * 3 + [0.1] * 3)
    assert finer.discs == (fem.Disc(4, 3.0, 0.1, 0.05, name="d"),)
    assert [s.node for s in (*finer.supports, *finer.forces)] == [1, 7, 4]
    assert dict(finer.stations) == {"end": 7}
    assert finer.poisson_ratio.tolist() == [0.3] * 3 + [0.2] * 3
    assert fem.refined(rotor, 1) == rotor
    with pytest.raises(ValueError, match="one for each of 1 elements"):
        fem.refined(rotor, 0)
