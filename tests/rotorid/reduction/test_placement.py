"""Places of equivalent masses: all choices against the one-by-one reduction, closed forms and brute force."""

from math import comb

import numpy as np
import pytest

import fem
from rotorid.files import read_rotor
from rotorid.reduction import equivalent_masses, mac, natural_frequencies, placement, reduce
from rotorid.reduction.placement import book_nodes, rank_nodes
from rotorid.samples import sample_data


@pytest.fixture(scope="module")
def rotor():
    return read_rotor(sample_data() / "rotor23.csv")


@pytest.fixture(scope="module")
def triples(rotor):
    return rank_nodes(rotor)


@pytest.fixture(scope="module")
def beam():
    """A uniform beam on (almost) rigid supports at its ends: sin(k π x / l)."""
    return fem.Rotor([0.05] * 24, 0.06, supports=[fem.Support(1, 1e10), fem.Support(25, 1e10)])


@pytest.fixture(scope="module")
def lumped():
    """A rotor that is three masses: a shaft without mass."""
    discs = [fem.Disc(2, 20.0), fem.Disc(4, 35.0), fem.Disc(5, 10.0)]
    ends = [fem.Support(1, 1e7), fem.Support(7, 2e7)]
    return fem.Rotor([0.2] * 6, 0.05, density=0.0, discs=discs, supports=ends, stations={"gear": 4})


def test_all_triples_of_the_reference_rotor(rotor, triples, monkeypatch):
    """The best frequencies are a trap: their shapes are others; batches of any size give the same."""
    assert triples.considered == comb(24, 3) == 2024
    r = triples.ranked
    assert r + triples.unphysical + triples.undetermined + triples.at_node == 2024
    assert len({tuple(row) for row in triples.nodes.tolist()}) == 2024
    assert triples.nodes[:2].tolist() == [[3, 11, 14], [9, 14, 19]]
    np.testing.assert_allclose(triples.masses[0], [317.61, 145.62, 194.64], atol=0.005)
    np.testing.assert_allclose(100 * triples.error[:2], [0.2975, 0.728], atol=5e-4)
    assert (np.diff(triples.error[:r]) >= -1e-9).all()
    assert np.isnan(triples.error[r:]).all()
    assert (triples.masses[r:].min(axis=1) <= 0).all()
    assert triples.mac[0] < 0.1
    assert triples.worst_mode[0] == 3
    assert 0 in triples.traps()
    assert "frequencies alone are a trap" in triples.summary()
    assert triples.error[triples.compromise] < 0.02
    assert triples.mac[triples.compromise] > 0.99
    monkeypatch.setattr(placement, "CHUNK", 3000)
    again = rank_nodes(rotor)
    np.testing.assert_array_equal(again.nodes, triples.nodes)
    np.testing.assert_allclose(again.masses, triples.masses, rtol=1e-9)


@pytest.mark.parametrize(("n", "modes"), [(1, 1), (2, 2), (3, 1), (4, 2), (5, 4)])
def test_every_choice_is_that_of_the_one_by_one_reduction(rotor, n, modes):
    candidates = (2, 4, 7, 9, 12, 15, 18, 20, 23)
    result = rank_nodes(rotor, n, modes, candidates=candidates)
    assert result.considered == comb(9, n)
    for i in np.random.default_rng(n).permutation(result.considered)[:20]:
        one = reduce(rotor, result.nodes[i].tolist(), modes)
        np.testing.assert_allclose(result.masses[i], one.masses.solution, rtol=1e-7)
        assert result.condition[i] == pytest.approx(one.masses.condition_number, rel=1e-7)
        physical = bool((one.masses.solution > 0).all())
        assert (i < result.ranked) == physical == np.isfinite(result.error[i])
        if physical:
            np.testing.assert_allclose(result.frequencies[i], one.frequencies, rtol=1e-8)
            assert result.error[i] == pytest.approx(np.abs(one.relative_error).max(), rel=1e-5, abs=1e-10)
            assert result.mac[i] == pytest.approx(one.mac.min(), rel=1e-6)
            assert one.mac[result.worst_mode[i] - 1] == pytest.approx(one.mac.min(), abs=1e-12)
        else:
            assert result.worst_mode[i] == 0
            assert np.isnan(result.mac[i])


@pytest.mark.parametrize("normalise", ["first", "largest", "length"])
@pytest.mark.parametrize("rows", ["equal", "relative"])
def test_scales_and_weights_reach_the_regression(rotor, normalise, rows):
    result = rank_nodes(rotor, 3, 2, candidates=(4, 7, 12, 14, 18, 20), normalise=normalise, rows=rows)
    full = fem.critical_speeds(rotor, 3)
    assert result.frequencies.shape == (20, 3)
    for nodes, masses, error, worst in zip(
        result.nodes, result.masses, result.error, result.mac, strict=True
    ):
        alpha, U = fem.compliance(rotor, nodes.tolist()), full.shapes[nodes - 1]
        used = full.frequencies[:2], U[:, :2]
        m = equivalent_masses(alpha, *used, normalise=normalise, rows=rows).solution
        np.testing.assert_allclose(masses, m, rtol=1e-7)
        if (m > 0).all():
            omega, shapes = natural_frequencies(alpha, m)
            assert error == pytest.approx(np.abs(omega / full.frequencies - 1).max(), rel=1e-5)
            assert worst == pytest.approx(np.diag(mac(shapes, U)).min(), rel=1e-6)


def test_no_choice_beats_the_compromise(triples):
    error, mac_ = triples.error[: triples.ranked], triples.mac[: triples.ranked]
    for i in (triples.compromise, triples.best_by_frequency, triples.best_by_mac):
        assert not ((error <= error[i]) & (mac_ >= mac_[i]) & ((error < error[i]) | (mac_ > mac_[i]))).any()
    assert triples.best_by_frequency == 0
    assert triples.best_by_mac == int(np.argmax(mac_))


def test_a_rotor_that_is_three_masses_gets_them_at_its_discs(lumped):
    stations = {"modes": 2, "candidates": [5, "gear", 2, 6]}
    for choices in ({}, {"modes": 3}, {"rows": "relative", "normalise": "length"}, stations):
        result = rank_nodes(lumped, **choices)
        assert result.nodes[0].tolist() == [2, 4, 5]
        np.testing.assert_allclose(result.masses[0], [20.0, 35.0, 10.0], rtol=1e-7)
        assert result.error[0] < 1e-9
        assert result.mac[0] > 1 - 1e-9
        assert result.error[1] > 0.01
        assert result.compromise == result.best_by_mac == 0


def test_a_first_mass_at_a_node_of_a_mode_is_counted_and_not_ranked(beam):
    """The middle, node 13, is a node of mode 2: with its shape scaled to 1 there is no regression."""
    result = rank_nodes(beam, 2, 2)
    middle_first = result.nodes[:, 0] == 13
    assert result.at_node == middle_first.sum() == 12
    assert np.isnan(result.condition[middle_first]).all()
    assert (np.flatnonzero(middle_first) >= result.ranked + result.unphysical).all()
    assert "a mode has a node at the first mass 12" in result.answer.whole()
    other = rank_nodes(beam, 2, 2, normalise="length")
    assert other.at_node == 0
    assert np.isfinite(other.condition).all()


@pytest.mark.parametrize(
    ("n", "nodes"),
    [
        (1, [1 / 2]),
        (2, [1 / 4, 3 / 4]),
        (3, [1 / 4, 1 / 2, 3 / 4]),
        (5, [1 / 6, 1 / 4, 1 / 2, 3 / 4, 5 / 6]),
        (6, [1 / 12, 3 / 12, 5 / 12, 7 / 12, 9 / 12, 11 / 12]),
    ],
)
def test_the_books_rule_on_a_uniform_beam(beam, n, nodes):
    """Mode k of a simply supported beam has its antinodes at (2 j − 1) l / (2 k)."""
    assert book_nodes(beam, n) == tuple(round(24 * x) + 1 for x in nodes)


def test_the_books_rule_needs_enough_antinodes(rotor, beam):
    # the fourth antinode of mode 4 is on the overhang
    with pytest.raises(ValueError, match="mode 4 has 3 antinodes between the outermost supports"):
        book_nodes(rotor, 4)
    soft = fem.Rotor(beam.length, beam.outer_diameter, supports=[fem.Support(1, 1e3), fem.Support(25, 1e3)])
    with pytest.raises(ValueError, match="mode 2 has 0 antinode"):
        book_nodes(soft, 2)
    coarse = fem.Rotor([0.3] * 4, 0.06, supports=[beam.supports[0], fem.Support(5, 1e10)])
    with pytest.raises(ValueError, match="share a node"):
        book_nodes(coarse, 5)
    assert rank_nodes(coarse, 5, 2).book is None


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"n": 0}, "number of masses"),
        ({"n": 25}, "24 candidates hold 1 … 24"),
        ({"n": 2, "modes": 3}, "2 masses can use 1 … 2"),
        ({"n": 12}, "ways, more than 2000000: give fewer nodes as candidates"),
        ({"candidates": [4, 4, 7]}, "candidates must be different nodes"),
        ({"candidates": [4, 7, 99]}, "node 99 does not exist"),
        ({"candidates": [4, 7]}, "2 candidates hold 1 … 2"),
        ({"speed": -1.0}, "speed must be"),
    ],
)
def test_bad_questions_are_refused(rotor, arguments, message):
    with pytest.raises(ValueError, match=message):
        rank_nodes(rotor, **arguments)
