import math

import numpy as np
import pytest
from fem_rotors import rotor23, rotors, uniform
from hypothesis import given, settings

import fem


def test_reference_rotor_compliance():
    alpha = fem.compliance(rotor23(), [7, 12, 18])
    expected = [
        [8.92182799e-8, 1.10521909e-7, 6.80373513e-8],
        [1.10521909e-7, 1.64475623e-7, 1.10762871e-7],
        [6.80373513e-8, 1.10762871e-7, 9.34704746e-8],
    ]
    np.testing.assert_allclose(alpha, expected, rtol=1e-8)


@pytest.mark.parametrize("n", [2, 10, 100])
def test_a_beam_on_springs_is_exact_with_any_mesh(n):
    left, right, L = 3e7, 8e7, 1.0
    beam = uniform(n, supports=[fem.Support(1, left), fem.Support(n + 1, right)])
    middle = n // 2 + 1
    EI = 2.1e11 * math.pi * 0.1**4 / 64
    alpha = fem.compliance(beam, [1, middle])
    assert alpha[1, 1] == pytest.approx(L**3 / (48 * EI) + 1 / (4 * left) + 1 / (4 * right), rel=1e-7)
    np.testing.assert_allclose(alpha[0], [1 / left, 1 / (2 * left)], rtol=1e-7)


@given(rotors(damped=False))
@settings(max_examples=25, deadline=None)
def test_compliance_is_symmetric_positive_and_the_slow_limit_of_the_response(rotor):
    nodes = list(range(1, rotor.n_nodes + 1))
    alpha = fem.compliance(rotor, nodes)
    np.testing.assert_array_equal(alpha, alpha.T)
    assert (np.linalg.eigvalsh(alpha) > -1e-9 * np.abs(alpha).max()).all()
    slow = 1e-5 * fem.critical_speeds(rotor, n=1).frequencies[0]
    W = fem.influence(rotor, nodes, nodes, slow).W[0]
    # both promise six digits; beyond that they warn
    np.testing.assert_allclose(W / slow**2, alpha, rtol=0, atol=1e-6 * np.abs(alpha).max())


def test_stations_name_nodes():
    rotor = fem.Rotor(
        [0.5, 0.5], 0.05, supports=[fem.Support(1, 1e8), fem.Support(3, 1e8)], stations={"mid": 2}
    )
    np.testing.assert_array_equal(fem.compliance(rotor, ["mid"]), fem.compliance(rotor, [2]))


@pytest.mark.parametrize(
    ("rotor", "nodes", "message"),
    [
        (uniform(4), [1], "not held has no rest"),
        (uniform(4, supports=[fem.Support(1, 1e8), fem.Support(1, 1e8)]), [1], "supports at two nodes"),
        (uniform(4, supports=[fem.Support(1, 1e8), fem.Support(5, 1e8)]), [6], "node 6 does not exist"),
        (uniform(100, supports=[fem.Support(1, 1e-4), fem.Support(101, 1e-4)]), [5], "lost in float64"),
    ],
)
def test_impossible_requests_are_refused(rotor, nodes, message):
    with pytest.raises(ValueError, match=message):
        fem.compliance(rotor, nodes)
