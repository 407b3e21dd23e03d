"""Mass sets with given frequencies: closed forms, permutations, random chains, and their shapes."""

import json
from itertools import permutations

import numpy as np
import pytest
from cases import each_of
from hypothesis import given, settings
from hypothesis import strategies as st
from repetitions import FULL
from scipy.optimize import least_squares

import fem
from rotorid.reduction import equivalent_masses, natural_frequencies, reduce
from rotorid.reduction.equivalent.frequency_matching import matching_masses
from rotorid.reduction.equivalent.frequency_shape_trade_off import trade_off
from rotorid.samples import sample_data
from rotorid.tables import read_rotor


@pytest.fixture(scope="module")
def rotor():
    return read_rotor(sample_data() / "rotor23.csv")


@pytest.fixture(scope="module")
def table(rotor):
    return trade_off(rotor, (7, 12, 18))


def chain(springs, masses):
    """Compliance and frequencies, rad/s, of masses in a row, the first spring to the ground."""
    n = len(masses)
    K = np.diag(springs) + np.diag([*springs[1:], 0.0])
    for i in range(1, n):
        K[i - 1, i] = K[i, i - 1] = -springs[i]
    squares = np.linalg.eigvals(K / np.asarray(masses)[:, None]).real
    alpha = np.linalg.inv(K)
    return (alpha + alpha.T) / 2, np.sqrt(np.sort(squares))


def check(alpha, omega, sets):
    """Every set is positive and has these frequencies, by another eigenvalue problem than the solver's."""
    assert (sets > 0).all()
    for masses in sets:
        squares = np.linalg.eigvals(np.linalg.inv(alpha) / masses[:, None])
        np.testing.assert_allclose(np.sqrt(np.sort(squares.real)), omega, rtol=1e-8)


def distance(sets, masses):
    return np.abs(sets / np.asarray(masses) - 1).max(axis=1).min(initial=np.inf)


def test_nodes_7_12_18_have_two_sets_and_only_two(rotor):
    alpha, omega = fem.compliance(rotor, (7, 12, 18)), fem.critical_speeds(rotor, 3).frequencies
    sets = matching_masses(alpha, omega)
    np.testing.assert_allclose(sets, [[89.1, 196.5, 198.6], [280.5, 162.1, 76.5]], atol=0.05)
    for masses in sets:
        np.testing.assert_allclose(natural_frequencies(alpha, masses)[0], omega, rtol=1e-9)
    check(alpha, omega, sets)


def test_one_and_two_masses_in_closed_form():
    assert matching_masses([[2e-8]], [1e3]) == pytest.approx(50.0)
    # α11 m1 + α22 m2 = λ1 + λ2 = 4, det α m1 m2 = λ1 λ2 = 2, as 3 m1 + m2 = 4 and 2 m1 m2 = 2
    sets = matching_masses([[3.0, 1.0], [1.0, 1.0]], 1 / np.sqrt([2 + np.sqrt(2), 2 - np.sqrt(2)]))
    np.testing.assert_allclose(sets, [[1 / 3, 3.0], [1.0, 1.0]], rtol=1e-9)


def test_two_sets_that_coincide_are_one():
    sets = matching_masses([[2.0, 1.0], [1.0, 2.0]], [1 / np.sqrt(3), 1.0])
    np.testing.assert_allclose(sets, [[1.0, 1.0]], rtol=1e-6)


def test_there_may_be_no_set_at_all(rotor):
    alpha = fem.compliance(rotor, (7, 12))
    for omega in (fem.critical_speeds(rotor, 2).frequencies, [100.0, 110.0]):
        assert matching_masses(alpha, omega).shape == (0, 2)


@pytest.mark.parametrize("masses", [(1.0, 2.5), (1.0, 2.0, 4.5)])
def test_equal_places_can_be_exchanged(masses):
    """Where all α_ii and all α_ij are equal, every order of the masses has the same frequencies: n! sets."""
    n = len(masses)
    alpha = np.eye(n) + 0.4
    omega, _ = natural_frequencies(alpha, masses)
    sets = matching_masses(alpha, omega)
    np.testing.assert_allclose(sets, sorted(permutations(masses)), rtol=1e-8)


def test_mirrored_places_have_mirrored_sets():
    """The outer places are alike (p12 = p23): the elimination then has double roots only."""
    alpha = np.array([[3.0, 2.0, 1.0], [2.0, 4.0, 2.0], [1.0, 2.0, 3.0]]) / 4
    for masses in ([1.0, 1.7, 2.4], [0.2, 3.0, 0.9], [1.0, 1.0, 3.0]):
        omega, _ = natural_frequencies(alpha, masses)
        sets = matching_masses(alpha, omega)
        check(alpha, omega, sets)
        assert distance(sets, masses) < 1e-6
        mirrored = sets[:, ::-1]
        np.testing.assert_allclose(sets, mirrored[np.lexsort(mirrored.T[::-1])], rtol=1e-5)


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_the_own_masses_of_a_chain_are_among_its_sets(data):
    n = data.draw(st.integers(1, 3))
    size = st.floats(0.05, 20.0, allow_nan=False)
    springs = np.array(data.draw(st.lists(size, min_size=n, max_size=n))) * 1e6
    masses = np.array(data.draw(st.lists(size, min_size=n, max_size=n))) * 10
    alpha, omega = chain(springs, masses)
    sets = matching_masses(alpha, omega)
    # at a fold two sets meet, and a mass is only known to the root of the rounding error
    assert distance(sets, masses) < 1e-5
    check(alpha, omega, sets)
    assert len(sets) <= (1, 2, 6)[n - 1]


@pytest.mark.full
def test_elimination_finds_what_many_random_starts_find():
    """Two ways to the sets of three masses; there are 2, 4 or 6 of them."""
    rng = np.random.default_rng(3)
    counts = []
    for _ in range(25 if FULL else 10):
        alpha, omega = chain(np.exp(rng.uniform(-1.5, 1.5, 3)), np.exp(rng.uniform(-1.5, 1.5, 3)))
        sets = matching_masses(alpha, omega)
        for start in rng.dirichlet(np.full(3, 0.6), size=20) * (1 / omega**2).sum() / np.diag(alpha):

            def miss(x, alpha=alpha, omega=omega):
                return np.log(natural_frequencies(alpha, np.exp(x))[0] / omega)

            found = least_squares(miss, np.log(start), bounds=(-20.0, 20.0), xtol=1e-14, ftol=1e-14)
            if np.abs(found.fun).max() < 1e-9:
                assert distance(sets, np.exp(found.x)) < 1e-6
        counts.append(len(sets))
    assert set(counts) == {2, 4, 6}


def test_more_than_three_masses_are_not_searched(rotor):
    with pytest.raises(ValueError, match="4 frequencies are not searched: at most 3 masses"):
        matching_masses(np.eye(4) + 0.1, [1.0, 1.2, 1.4, 1.6])
    four = trade_off(rotor, (5, 9, 13, 18))
    assert not four.matching.any()
    assert not four.to_dict()["matching_sets_complete"]
    assert "searched for up to 3 masses only" in four.summary()


@each_of(
    ("alpha", "omega", "message"),
    [
        (np.eye(3), [1.0, 2.0], r"compliance \(n, n\)"),
        (np.ones((2, 3)), [1.0, 2.0], r"compliance \(n, n\)"),
        (np.zeros((0, 0)), [], r"compliance \(n, n\)"),
        ([[1.0, np.nan], [np.nan, 1.0]], [1.0, 2.0], "finite"),
        (np.eye(2), [1.0, np.inf], "finite"),
        (np.eye(2), [0.0, 1.0], "positive"),
        ([[1.0, 0.1], [0.2, 1.0]], [1.0, 2.0], "symmetric"),
        ([[1.0, 2.0], [2.0, 1.0]], [1.0, 2.0], "positive definite"),
        (np.eye(2), [1.0, 1.0], "two frequencies are equal"),
        (np.eye(2), [1.0, 5000.0], "factor of 1000"),
    ],
)
def test_bad_inputs_are_refused(alpha, omega, message):
    with pytest.raises(ValueError, match=message):
        matching_masses(alpha, omega)


def test_trade_off_puts_exact_frequencies_beside_shapes(rotor, table):
    assert table.names[-2:] == ("matching set 1", "matching set 2")
    assert table.matching.tolist() == [False] * 5 + [True] * 2
    assert np.abs(table.relative_error[-2:]).max() < 1e-9
    np.testing.assert_allclose(table.mac[-2:].min(axis=1), [0.8388, 0.7326], atol=5e-5)
    assert table.traps.tolist() == [5, 6]
    for k, name in (
        (1, "regression, 1 mode"),
        (2, "regression, 2 modes, equal rows"),
        (3, "regression, 3 modes, equal rows"),
    ):
        row, one = table.names.index(name), reduce(rotor, (7, 12, 18), k)
        np.testing.assert_allclose(table.masses[row], one.masses.solution, rtol=1e-9)
        np.testing.assert_allclose(table.relative_error[row], one.relative_error, atol=1e-10)
        np.testing.assert_allclose(table.mac[row], one.mac, rtol=1e-9)
        assert table.condition[row] == pytest.approx(one.masses.condition_number)
    row = table.names.index("regression, 2 modes, relative rows")
    weighted = equivalent_masses(
        fem.compliance(rotor, (7, 12, 18)),
        table.rotor_frequencies[:2],
        table.rotor_shapes[:, :2],
        rows="relative",
    )
    np.testing.assert_allclose(table.masses[row], weighted.values, rtol=1e-9)


def test_trade_off_as_document_and_table(table):
    document = table.to_dict()
    json.dumps(document, allow_nan=False)
    assert [a["matching"] for a in document["alternatives"]] == table.matching.tolist()
    assert document["alternatives"][-1]["condition_number"] is None
    frame = table.to_frame()
    np.testing.assert_array_equal(frame[["mass_7_kg", "mass_12_kg", "mass_18_kg"]], table.masses)
    np.testing.assert_array_equal(frame[["mac_1", "mac_2", "mac_3"]], table.mac)


def test_trade_off_prints_masses_errors_in_percent_and_mac(table):
    lines = table.answer.whole().splitlines()
    for r, name in enumerate(table.names):
        first = next(i for i, line in enumerate(lines) if line.startswith(f"{name}: "))
        masses = lines[first].removeprefix(f"{name}: ").removesuffix(" kg").split(", ")
        assert [float(text) for text in masses] == pytest.approx(table.masses[r], abs=5.1e-3)
        (errors, mac) = (line.split() for line in lines[first + 1 : first + 3])
        assert errors[:2] == ["error,", "%"]
        assert [float(text) for text in errors[2:]] == pytest.approx(
            100 * (table.frequencies[r] / table.rotor_frequencies - 1), abs=5.1e-5
        )
        assert mac[0] == "MAC"
        assert [float(text) for text in mac[1:]] == pytest.approx(table.mac[r], abs=5.1e-5)


def test_trade_off_where_no_model_is_good(rotor):
    text = " ".join(trade_off(rotor, (3, 11, 14)).summary().split())
    assert "None of these models moves like the rotor in all 3 modes" in text
    nothing = trade_off(rotor, (2, 3, 4))
    assert not nothing.matching.any()
    assert sum("not positive, no physical model" in w for w in nothing.warnings) == 5
    assert nothing.answer.judgement == "No model here has positive masses: choose other nodes."
    assert "no set of positive masses at these nodes has all 3 frequencies" in nothing.summary()
    json.dumps(nothing.to_dict(), allow_nan=False)
    alone = trade_off(rotor, [12])
    np.testing.assert_allclose(alone.masses, 332.419, atol=1e-3)
    assert "One mass has no shape" in alone.summary()


def test_trade_off_names_what_it_leaves_out():
    ends = [fem.Support(1, 1e10), fem.Support(25, 1e10)]
    beam = fem.Rotor([0.05] * 24, 0.06, supports=ends, stations={"middle": 13})
    table = trade_off(beam, ["middle", 7])
    assert table.nodes == (13, 7)
    assert table.names[0] == "regression, 1 mode"
    assert not any("2 modes" in name for name in table.names)
    assert sum("left out, a mode has a node at the first mass" in w for w in table.warnings) == 2
    assert len(trade_off(beam, ["middle", 7], normalise="length").names) == 3


@pytest.mark.parametrize(
    ("nodes", "message"),
    [((), "different nodes"), ((7, 7), "different nodes"), ((7, 99), "node 99 does not exist")],
)
def test_trade_off_refuses_bad_nodes(rotor, nodes, message):
    with pytest.raises(ValueError, match=message):
        trade_off(rotor, nodes)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("alpha", "omega"),
    [
        (
            [[1, -0.6612, 1.3792], [-0.6612, 1.0457, -1.5606], [1.3792, -1.5606, 3.3518]],
            [1, 2.6936, 232.9631],
        ),
        ([[1, 0.1593, -1.0076], [0.1593, 0.4319, -0.314], [-1.0076, -0.314, 1.7292]], [1, 1.2874, 38.7023]),
    ],
)
def test_steps_to_masses_beyond_all_bounds_say_nothing(alpha, omega):
    """Far frequencies: a trial step may leave what float64 can square."""
    for masses in matching_masses(alpha, omega):
        np.testing.assert_allclose(natural_frequencies(alpha, masses)[0], omega, rtol=1e-8)
