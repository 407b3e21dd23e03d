"""From combinations back to parameters: the singular exercises, several solutions, none, null spaces."""

import numpy as np
import pytest
from harmonic_cases import FEEDBACK, PUMP, ROTOR
from hypothesis import given, settings
from hypothesis import strategies as st

from rotorid.identify import Identification, harmonic_model, identify
from rotorid.identify.amplitudes import experiments
from rotorid.identify.linear_start import System, recover

TRUTH = {"T0": 1.0, "T1": 0.5, "T2": 0.8, "zeta": 0.3, "K": 10.0, "c": 1e5, "b": 1e4, "delta": 0.5}


def exact(equation, known, estimate, frequencies, errors=None, digits=None, **options) -> Identification:
    """Identify from simulated amplitudes."""
    model = harmonic_model([equation], known=known, estimate=estimate)
    w = np.array(frequencies, dtype=float)
    load = {name: np.ones(len(w), dtype=complex) for name in model.inputs}
    truth = np.array([TRUTH[name] for name in estimate])
    amplitudes = model.predict(truth, w, load)
    if digits is not None:
        amplitudes = {n: np.round(z, digits) for n, z in amplitudes.items()}
    return identify(model, experiments(model, w, {**load, **amplitudes}, errors=errors), **options)


@pytest.mark.parametrize("last_digit", [-1e-12, 0.0, 1e-12])
def test_the_order_of_solutions_does_not_hang_on_rounding(last_digit, monkeypatch):
    """T0 of both solutions is the same but for rounding: the larger T1 comes first."""
    names = ("T0", "T1", "T2")
    exponents = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 1, 1]])
    matrix = np.array([[0.0, 1, 0, 0, 0], [0, 0, 1, 1, 0], [0, 0, 0, 0, 1]])
    system = System(names, exponents, matrix, np.array([1.0, 1.3, 0.4]), None)
    starts = [np.array([1.0 + last_digit, 0.5, 0.8]), np.array([1.0, 0.8, 0.5])]
    monkeypatch.setattr("rotorid.identify.linear_start._candidates", lambda *_: starts)
    monkeypatch.setattr("rotorid.identify.linear_start._refined", lambda _system, start, *_: start)
    assert [solution[1] for solution in recover(system).solutions] == [0.8, 0.5]


def test_41_in_words():
    found = exact(ROTOR, {"m": 10.0, "e": 1e-4}, ["c", "b", "delta"], [80, 100])
    assert found.unidentifiable == (
        "only c and b*(1 - delta) are determined; b and delta by themselves are not",
    )
    document = found.to_dict()
    assert document["identifiable"] is False
    assert document["rank"] == 2
    assert document["parameters"]["c"]["value"] == pytest.approx(1e5, rel=1e-9)
    assert document["parameters"]["b"] == {"value": None, "std": None, "ci95": None}
    assert document["combinations"]["b*(1 - delta)"]["value"] == pytest.approx(5000, rel=1e-9)


@pytest.mark.parametrize(
    ("known", "estimate", "frequencies"),
    [({"T0": 1.0, "K": 10.0}, ["T1", "T2"], [1, 2]), ({"K": 10.0}, ["T0", "T1", "T2"], [1, 2, 3, 4])],
    ids=["3.2", "3.3"],
)
def test_32_and_33_up_to_exchange(known, estimate, frequencies):
    found = exact(FEEDBACK, known, estimate, frequencies)
    document = found.to_dict()
    assert document["combinations"]["T1 + T2"]["value"] == pytest.approx(1.3, rel=1e-9)
    assert document["combinations"]["T1*T2"]["value"] == pytest.approx(0.4, rel=1e-9)
    pairs = sorted((s["T1"], s["T2"]) for s in document["solutions"])
    np.testing.assert_allclose(pairs, [[0.5, 0.8], [0.8, 0.5]], rtol=1e-6)
    assert document["parameters"]["T1"]["value"] is None
    assert not document["identifiable"]
    assert document["unidentifiable"][0].startswith("T1 and T2 can be exchanged")
    if "T0" in estimate:
        assert document["parameters"]["T0"]["value"] == pytest.approx(1.0, rel=1e-6)
        assert document["parameters"]["T0"]["std"] is not None


def test_bounds_choose_between_exchanged_solutions():
    found = exact(FEEDBACK, {"T0": 1.0, "K": 10.0}, ["T1", "T2"], [1, 2], bounds={"T1": (0.0, 0.6)})
    np.testing.assert_allclose(found.values, [0.5, 0.8], rtol=1e-6)
    assert found.identifiable


@pytest.mark.parametrize(
    ("known", "estimate", "frequencies"),
    [
        ({"T0": 1.0, "K": 10.0}, ["T1", "T2", "zeta"], [1, 2]),
        ({"T0": 1.0}, ["T1", "T2", "zeta", "K"], [1, 2, 3]),
    ],
    ids=["4.2", "4.3"],
)
def test_42_and_43_recover_everything(known, estimate, frequencies):
    found = exact(PUMP, known, estimate, frequencies)
    np.testing.assert_allclose(found.values, [TRUTH[n] for n in estimate], rtol=1e-6)
    words = {c.words: c.value for c in found.combinations}
    assert words["K*T1 + 2*T0*zeta"] == pytest.approx(10 * 0.5 + 2 * 0.3, rel=1e-9)
    assert found.identifiable


def test_several_solutions_that_are_no_exchange():
    model = harmonic_model(["(p**2 + k**2)*X = F"], estimate=["k"])
    data = experiments(model, [1.0, 2.0], {"F": 1.0, "X": [1 / 8.0, 1 / 5.0]}, free=False)
    found = identify(model, data)
    assert sorted(s["k"] for s in found.solutions) == pytest.approx([-3.0, 3.0], rel=1e-12)
    assert found.unidentifiable == ("k has 2 values that explain the data equally well",)
    assert identify(model, data, bounds={"k": (0.0, None)}).value("k") == pytest.approx(3.0, rel=1e-12)


def test_no_real_solution_is_said():
    model = harmonic_model(["(p**2 + k**2)*X = F"], estimate=["k"])
    data = experiments(model, [2.0, 4.0], {"F": 1.0, "X": [-1 / 6.0, -1 / 18.0]}, free=False)
    found = identify(model, data)
    assert found.solutions == ()
    assert found.unidentifiable == ("no real values of the parameters give the estimated combinations",)
    assert not found.identifiable
    assert found.combinations[0].value == pytest.approx(-2.0, rel=1e-12)


def test_what_stands_alone_is_known_even_without_a_real_solution():
    model = harmonic_model(["(p**2 + b*p + k**2)*X = F"], estimate=["k", "b"])
    w = np.array([2.0, 4.0])
    x = 1 / (-(w**2) + 0.3j * w - 2.0)
    found = identify(model, experiments(model, w, {"F": 1.0, "X": x}))
    assert found.solutions == ()
    assert np.isnan(found.value("k"))
    assert found.value("b") == pytest.approx(0.3, rel=1e-9)
    assert np.isfinite(found.std[1])
    assert np.isnan(found.std[0])


def system(names, monomials, values, covariance=None):
    exponents = np.array([0 * np.array(monomials[0]), *monomials], dtype=float)
    one = np.eye(len(exponents))
    return System(tuple(names), exponents, one[1:], np.array(values, dtype=float), covariance)


def test_ratios_are_found_although_their_parts_are_open():
    """a·x and a·x·T: T is their ratio, a and x are open."""
    found = recover(system("axT", [[1, 1, 0], [1, 1, 1]], [6.0, 12.0]))
    assert list(found.undetermined) == [True, True, False]
    assert found.values[2] == pytest.approx(2.0, rel=1e-12)
    assert np.isnan(found.values[:2]).all()


def test_overdetermined_recovery_weighs_by_the_errors():
    """x and x·y and y with one bad value of large error: the others decide."""
    covariance = np.diag([1e-10, 1e-10, 1.0])
    found = recover(system("xy", [[1, 0], [0, 1], [1, 1]], [2.0, 3.0, 7.0], covariance))
    np.testing.assert_allclose(found.values, [2.0, 3.0], rtol=1e-8)


@pytest.mark.parametrize("unit", [1e-9, 1e9])
def test_units_of_a_combination_change_nothing(unit):
    """The first combination in other units, and its error with it: the same parameters."""
    values, covariance = np.array([2.0, 3.0, 6.0002]), np.diag([1e-8, 4e-8, 1e-8])
    inputs = system("xy", [[1, 0], [0, 1], [1, 1]], values, covariance)
    plain, scale = recover(inputs), np.array([unit, 1.0, 1.0])
    stated = covariance * np.outer(scale, scale)
    other = recover(
        System(
            inputs.names,
            inputs.exponents,
            scale[:, None] * inputs.matrix,
            values * scale,
            stated,
        )
    )
    np.testing.assert_allclose(other.values, plain.values, rtol=1e-9)
    np.testing.assert_allclose(other.gain * scale, plain.gain, rtol=1e-6, atol=1e-9)
    # by hand: the least squares of (x − 2)/1, (y − 3)/2, (x·y − 6.0002)/1, first order about x = 2, y = 3
    J = np.array([[1.0, 0.0], [0.0, 0.5], [3.0, 2.0]])
    first = np.linalg.lstsq(J, np.array([0.0, 0.0, 2e-4]), rcond=None)[0]
    np.testing.assert_allclose(plain.values, [2 + first[0], 3 + first[1]], rtol=1e-8)


def test_gain_is_the_derivative_of_the_recovery():
    names, monomials, values = "xyz", [[1, 0, 0], [1, 1, 0], [0, 1, 1]], np.array([2.0, 6.0, 15.0])
    found = recover(system(names, monomials, values))
    np.testing.assert_allclose(found.values, [2.0, 3.0, 5.0], rtol=1e-12)
    for i in range(3):
        step = np.eye(3)[i] * 1e-6
        up, down = (recover(system(names, monomials, values + s)).values for s in (step, -step))
        np.testing.assert_allclose(found.gain[:, i], (up - down) / 2e-6, rtol=1e-6, atol=1e-8)


def test_linked_unknowns_are_solved_for_together():
    # x³ + y³, x² + x·y + y²: no unknown is linear
    exponents = np.array([[0, 0], [3, 0], [0, 3], [2, 0], [1, 1], [0, 2]], dtype=float)
    matrix = np.array([[0.0, 1, 1, 0, 0, 0], [0, 0, 0, 1, 1, 1]])
    values = matrix @ np.prod(np.array([1.5, 0.5]) ** exponents, axis=1)
    solutions = recover(System(("x", "y"), exponents, matrix, values, None)).solutions
    assert len(solutions) == 4
    for one in solutions:
        np.testing.assert_allclose(matrix @ np.prod(one**exponents, axis=1), values, rtol=1e-12)
    assert any(np.allclose(one, [1.5, 0.5], rtol=1e-12) for one in solutions)


def test_three_time_constants_can_be_exchanged():
    model = harmonic_model(["(T1*p + 1)*(T2*p + 1)*(T3*p + 1)*X = F"], estimate=["T1", "T2", "T3"])
    w, load = np.array([1.0, 3.0, 6.0]), {"F": np.ones(3, dtype=complex)}
    found = identify(
        model, experiments(model, w, {**load, **model.predict(np.array([0.9, 0.4, 0.1]), w, load)})
    )
    assert len(found.solutions) == 6
    assert all(np.allclose(sorted(s.values()), [0.1, 0.4, 0.9], rtol=1e-7) for s in found.solutions)
    assert found.unidentifiable[0].startswith("T1, T2 and T3 can be exchanged")


@given(st.integers(0, 100_000), st.integers(1, 4), st.integers(0, 2))
@settings(deadline=None, max_examples=40)
def test_random_systems_recover_or_name_an_invariant(seed, unknowns, merged):
    """Exact data: parameters come back, or every named combination is constant along the null space."""
    rng = np.random.default_rng(seed)
    names = [f"x{j}" for j in range(unknowns)]
    features = max(unknowns - merged, 1)
    table = rng.integers(1, 6, (features, unknowns)) * rng.choice((-1, 1), (features, unknowns))
    terms = " + ".join(
        f"({' + '.join(f'({x})*{n}' for x, n in zip(row, names, strict=True))})*p**{k}*X"
        for k, row in enumerate(table)
    )
    model = harmonic_model([f"{terms} + 7*p**{features}*X = F"], estimate=names)
    truth = rng.uniform(0.5, 2.0, unknowns)
    w = np.linspace(0.6, 1.9, 6)
    load = {"F": np.ones(6, dtype=complex)}
    found = identify(model, experiments(model, w, {**load, **model.predict(truth, w, load)}, free=False))
    rank = np.linalg.matrix_rank(table)
    assert found.estimate.rank == rank
    null = np.linalg.svd(table)[2][rank:]
    determined = np.linalg.norm(null, axis=0) < 1e-9
    np.testing.assert_array_equal(np.isfinite(found.values), determined)
    np.testing.assert_allclose(found.values[determined], truth[determined], rtol=1e-6)
    for combination in found.combinations:
        i = model.combinations.words.index(combination.words)
        row = model.combinations.rows[i]
        assert combination.value == pytest.approx(row @ truth, rel=1e-6, abs=1e-9)
        np.testing.assert_allclose(null @ row, 0, atol=1e-9 * np.abs(row).max())
