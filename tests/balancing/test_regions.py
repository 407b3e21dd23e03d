"""Regions of draws: quantiles, edges, and directions that a limit holds."""

import numpy as np
import pytest
from balancing_data import complex_normal

from balancing.regions import NORMAL_RADIUS, Region, half_width, reach, region_edge


def test_the_region_of_normal_draws_is_that_of_chi_square():
    draws = complex_normal(np.random.default_rng(1), (40_000, 2)) * [1, 3] + [2, 5j]
    region = Region.of(draws, np.array([2, 5j]))
    assert region.radius == pytest.approx(np.sqrt(9.488), rel=0.01)  # χ² with 4
    one = Region.of(draws[:, :1], np.array([2.0 + 0j]))
    assert one.radius == pytest.approx(NORMAL_RADIUS, rel=0.01)
    assert one.holds(np.array([2 + 2.4j]))
    assert not one.holds(np.array([2 + 2.5j]))
    assert np.allclose(np.abs(one.edge(90) - 2), NORMAL_RADIUS, rtol=0.02)


def test_what_a_limit_holds_is_far_from_everything_else():
    angles = 1e-6 * np.random.default_rng(3).standard_normal(400)
    region = Region.of(np.exp(1j * angles)[:, None], np.ones(1))
    assert region.holds(np.ones(1))
    assert not region.holds(np.zeros(1))
    exact = Region(np.ones(1), np.zeros((2, 2)), NORMAL_RADIUS)
    assert exact.holds(np.ones(1))
    assert not exact.holds(np.zeros(1))


def test_edges_turn_with_their_covariance():
    edge = region_edge(1j, np.diag([4.0, 1.0]), 361)
    assert np.abs(edge.real).max() == pytest.approx(2 * NORMAL_RADIUS, rel=1e-4)
    assert np.abs(edge.imag - 1).max() == pytest.approx(NORMAL_RADIUS, rel=1e-4)
    assert reach(np.diag([4.0, 1.0])) == pytest.approx(2 * NORMAL_RADIUS)


def test_half_widths_are_quantiles():
    assert half_width(np.linspace(-1, 1, 2001)) == pytest.approx(0.95, abs=1e-3)
