"""The linear regression, and the way back from combinations to parameters."""

import numpy as np
import pytest
from harmonic_cases import FEEDBACK, simulate
from hypothesis import given, settings
from hypothesis import strategies as st

from rotorid.identify import harmonic_model, identify
from rotorid.identify.amplitudes import experiments
from rotorid.identify.linear_start import System, recover

MASS = ["(m*p**2 + alpha*p + c)*X = F"]
TASK_51 = {"F": 10.0, "X": [-0.1j, -3.3e-3 - 2.2e-4j, -1.2e-3 - 4.7e-5j]}


def mass():
    return harmonic_model(MASS, known={"m": 10.0}, estimate=["c", "alpha"])


@pytest.mark.parametrize(
    ("frequencies", "signals", "options", "message"),
    [
        ([1.0], {"X": [1j]}, {}, "the input F of the model is not among the measurements"),
        ([1.0], {"F": [1.0]}, {}, "the signal X of the model is not among"),
        ([1.0], {"F": [1.0], "X": [np.inf]}, {}, "X: . finite values are needed"),
        ([1.0, 2.0], {"F": [1.0, np.nan], "X": [np.nan, 1 + 1j]}, {}, "no reading can be compared"),
        ([10, 20, 30], TASK_51, {"loss": "magic"}, "loss 'magic' is not known: one of linear"),
        ([10, 20, 30], TASK_51, {"bounds": {"k": (0, 1)}}, "k is no parameter"),
        ([10, 20, 30], TASK_51, {"bounds": {"c": (2, 1)}}, "lowest, highest"),
        ([10, 20, 30], TASK_51, {"start": {"d": 1.0}}, "start: d is no parameter"),
    ],
)
def test_measurements_and_options_that_do_not_fit_are_refused(frequencies, signals, options, message):
    with pytest.raises(ValueError, match=message):
        identify(mass(), experiments(mass(), frequencies, signals, free=False), **options)


def test_one_experiment_cannot_tell_stiffness_from_mass():
    model = harmonic_model(MASS, estimate=["m", "c", "alpha"])
    result = identify(model, experiments(model, [20.0], {"F": 10.0, "X": [-3.3e-3 - 2.2e-4j]}))
    assert result.estimate.rank == 2
    assert "only alpha and m - 0.0025*c are determined" in result.unidentifiable[0]  # 1/omega**2 = 0.0025
    assert "these experiments determine 2 of the 3" in result.unidentifiable[1]
    assert np.isfinite([result.value(name) for name in ("m", "c", "alpha")]).tolist() == [False, False, True]
    (combination,) = result.combinations
    assert combination.value == pytest.approx(10.0 - 0.0025 * 1000.0, rel=0.01)


def test_equations_without_a_known_term_determine_ratios():
    """The second may be multiplied by any number; noisy data would give zeros for T, K and k."""
    model = harmonic_model(["(m*p**2 + c)*X = F", "(T*p + K)*Y = k*X"], estimate=["m", "c", "T", "K", "k"])
    w = np.array([1.0, 2.0, 3.0])
    signals = simulate(model, np.array([1.0, 20.0, 0.5, 2.0, 3.0]), w, {"F": 1.0}).signals
    data = experiments(model, w, {**signals, "Y": np.round(signals["Y"], 3)}, free=False)
    result = identify(model, data)
    np.testing.assert_allclose(result.linear.recovery.values[:2], [1.0, 20.0], rtol=1e-9)
    np.testing.assert_allclose(result.values[:2], [1.0, 20.0], rtol=5e-3)
    assert np.isnan(result.values[2:]).all()
    assert result.estimate.rank == 4
    assert {c.words: round(c.value, 1) for c in result.combinations} == {"K/T": 4.0, "k/T": 6.0}
    assert "every multiple of T, K and k fits" in result.unidentifiable[0]


def test_free_vibration_drops_damping_and_says_so():
    model = harmonic_model(["(m*p**2 + b*p + c)*X = F"], known={"m": 2.0, "b": 0.1}, estimate=["c"])
    result = identify(model, experiments(model, [3.0], {"X": [1.0]}))
    assert result.value("c") == pytest.approx(18.0, rel=1e-14)
    assert any("odd powers of p" in w for w in result.warnings)


@given(st.floats(1e-6, 1e6), st.floats(1e-6, 1e6), st.floats(0.1, 100))
@settings(deadline=None, max_examples=30)
def test_units_do_not_matter(length, mass_unit, rate):
    """The exercise 5.1 in other units of length, mass and time has the same answer in those units."""
    model = harmonic_model(MASS, known={"m": 10 * mass_unit}, estimate=["c", "alpha"])
    signals = {"F": 10 * mass_unit * length * rate**2, "X": np.array(TASK_51["X"]) * length}
    result = identify(model, experiments(model, np.array([10, 20, 30]) * rate, signals))
    base = identify(mass(), experiments(mass(), [10, 20, 30], TASK_51))
    scale = np.array([mass_unit * rate**2, mass_unit * rate])
    np.testing.assert_allclose(result.values / scale, base.values, rtol=1e-9)
    np.testing.assert_allclose(result.std / scale, base.std, rtol=1e-6)
    assert result.estimate.condition_number == pytest.approx(base.estimate.condition_number, rel=1e-6)


# From combinations to parameters


def test_bounds_choose_between_exchanged_solutions():
    model = harmonic_model([FEEDBACK], known={"T0": 1.0, "K": 10.0}, estimate=["T1", "T2"])
    data = simulate(model, np.array([0.5, 0.8]), np.array([1.0, 2.0]), {"F": 1.0})
    result = identify(model, data, bounds={"T1": (0.0, 0.6)})
    np.testing.assert_allclose(result.values, [0.5, 0.8], rtol=1e-6)
    assert result.identifiable


def squared(stiffness):
    """A model whose k² is this, as seen by exact readings."""
    model, w = harmonic_model(["(p**2 + b*p + k**2)*X = F"], estimate=["k", "b"]), np.array([2.0, 4.0])
    return model, experiments(model, w, {"F": 1.0, "X": 1 / (stiffness - w**2 + 0.3j * w)}, free=False)


def test_several_solutions_that_are_no_exchange():
    model, data = squared(9.0)
    result = identify(model, data)
    assert sorted(s["k"] for s in result.solutions) == pytest.approx([-3.0, 3.0], rel=1e-12)
    assert result.unidentifiable == ("k has 2 values that explain the data equally well",)
    assert identify(model, data, bounds={"k": (0.0, None)}).value("k") == pytest.approx(3.0, rel=1e-12)


def test_what_stands_alone_is_known_even_without_a_real_solution():
    result = identify(*squared(-2.0))
    assert result.solutions == ()
    assert "no real values of the parameters give the estimated combinations" in result.unidentifiable
    assert {c.words: c.value for c in result.combinations}["k**2"] == pytest.approx(-2.0, rel=1e-12)
    assert result.value("b") == pytest.approx(0.3, rel=1e-9)
    assert np.isfinite(result.std).tolist() == np.isfinite(result.values).tolist() == [False, True]


def system(names, monomials, values, covariance=None, matrix=None):
    exponents = np.array([0 * np.array(monomials[0]), *monomials], dtype=float)
    matrix = np.eye(len(exponents))[1:] if matrix is None else np.array(matrix, dtype=float)
    return System(tuple(names), exponents, matrix, np.array(values, dtype=float), covariance)


@pytest.mark.parametrize(
    ("names", "monomials", "values", "covariance", "expected"),
    [
        # a·x and a·x·T: T is their ratio, a and x are open
        ("axT", [[1, 1, 0], [1, 1, 1]], [6.0, 12.0], None, [np.nan, np.nan, 2.0]),
        # x·y has one bad value of large error: the others decide
        ("xy", [[1, 0], [0, 1], [1, 1]], [2.0, 3.0, 7.0], np.diag([1e-10, 1e-10, 1.0]), [2.0, 3.0]),
    ],
)
def test_ratios_and_weights_of_a_recovery(names, monomials, values, covariance, expected):
    recovery = recover(system(names, monomials, values, covariance))
    np.testing.assert_allclose(recovery.values, expected, rtol=1e-8)
    assert recovery.undetermined.tolist() == np.isnan(expected).tolist()


@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e9])
def test_units_of_a_combination_change_nothing(unit):
    """By hand: least squares of (x − 2)/1, (y − 3)/2, (x·y − 6.0002)/1, first order about x = 2, y = 3."""
    scale, sizes = np.array([unit, 1.0, 1.0]), np.array([1e-4, 2e-4, 1e-4])
    recovery = recover(
        system("xy", [[1, 0], [0, 1], [1, 1]], np.array([2.0, 3.0, 6.0002]) * scale,
               np.diag((sizes * scale) ** 2), np.diag(scale) @ np.eye(4)[1:])
    )  # fmt: skip
    inverse = np.linalg.pinv(np.array([[1.0, 0.0], [0.0, 0.5], [3.0, 2.0]]))
    np.testing.assert_allclose(recovery.values, [2, 3] + inverse @ [0.0, 0.0, 2e-4], rtol=1e-8)
    np.testing.assert_allclose(recovery.gain * scale, inverse * [1.0, 0.5, 1.0], rtol=1e-3, atol=1e-9)


def test_linked_unknowns_are_solved_for_together():
    """x³ + y³, x² + x·y + y²: no unknown is linear."""
    monomials = np.array([[3, 0], [0, 3], [2, 0], [1, 1], [0, 2]])
    matrix = np.array([[0.0, 1, 1, 0, 0, 0], [0, 0, 0, 1, 1, 1]])

    def given(x):
        return matrix[:, 1:] @ np.prod(np.array(x) ** monomials, axis=1)

    solutions = recover(system("xy", monomials, given([1.5, 0.5]), matrix=matrix)).solutions
    assert len(solutions) == 4
    for one in solutions:
        np.testing.assert_allclose(given(one), given([1.5, 0.5]), rtol=1e-12)
    assert any(np.allclose(one, [1.5, 0.5], rtol=1e-12) for one in solutions)


def test_three_time_constants_can_be_exchanged():
    model = harmonic_model(["(T1*p + 1)*(T2*p + 1)*(T3*p + 1)*X = F"], estimate=["T1", "T2", "T3"])
    data = simulate(model, np.array([0.9, 0.4, 0.1]), np.array([1.0, 3.0, 6.0]), {"F": 1.0})
    result = identify(model, data)
    assert len({tuple(np.round([*s.values()], 6)) for s in result.solutions}) == 6
    assert all(np.allclose(sorted(s.values()), [0.1, 0.4, 0.9], rtol=1e-7) for s in result.solutions)
    assert result.unidentifiable[0].startswith("T1, T2 and T3 can be exchanged")


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
    result = identify(model, simulate(model, truth, np.linspace(0.6, 1.9, 6), {"F": 1.0}))
    rank = np.linalg.matrix_rank(table)
    assert result.estimate.rank == len(model.combinations.rows) == rank
    null = np.linalg.svd(table)[2][rank:]
    determined = np.linalg.norm(null, axis=0) < 1e-9
    np.testing.assert_array_equal(np.isfinite(result.values), determined)
    np.testing.assert_allclose(result.values[determined], truth[determined], rtol=1e-6)
    for combination in result.combinations:
        row = model.combinations.rows[model.combinations.words.index(combination.words)]
        assert combination.value == pytest.approx(row @ truth, rel=1e-6, abs=1e-9)
        np.testing.assert_allclose(null @ row, 0, atol=1e-9 * np.abs(row).max())
