"""Linear regression: formula (50), weights, missing amplitudes, influence, numerical rank."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rotorid.identify import AmplitudeErrors, harmonic_model, identify
from rotorid.identify.amplitudes import Experiments, experiments
from rotorid.identify.linear_start import build_rows
from rotorid.reduction import equivalent_masses
from rotorid.regression import stack

MASS = ["(m*p**2 + alpha*p + c)*X = F"]
TASK_51 = {"F": 10.0, "X": [-0.1j, -3.3e-3 - 2.2e-4j, -1.2e-3 - 4.7e-5j]}
FEEDBACK = ["(T0*T1*T2*p**3 + (T0 + T1)*T2*p**2 + T2*p + K)*S = (T1*T2*p**2 + T2*p)*F"]
CHAIN = [
    "(m1*p**2 + c1 + c2)*X1 - c2*X2 = 0",
    "-c2*X1 + (m2*p**2 + c2 + c3)*X2 - c3*X3 = 0",
    "-c3*X2 + (m3*p**2 + c3)*X3 = 0",
]
TASK_7 = {
    "X1": 1.0,
    "X2": [1.3461538, 0.8210890, -0.9223301],
    "X3": [1.9230769, -2.1607606, 0.2427184],
}
ALPHA = {
    "a11": 8.92182799e-8, "a12": 1.10521909e-7, "a13": 6.80373513e-8,
    "a22": 1.64475623e-7, "a23": 1.10762871e-7, "a33": 9.34704746e-8,
}  # fmt: skip
SHAPES = np.array([[1, 1.45965849, 1.02334961], [1, 0.11958263, -1.04705869], [1, -0.93823799, 0.85145072]])
CRITICAL = np.array([135.24041, 540.73289, 1163.80513])
FORMULA_50 = [
    " + ".join(f"a{min(i, j)}{max(i, j)}*m{j}*X{j}" for j in (1, 2, 3)) + f" = -X{i}/p**2" for i in (1, 2, 3)
]


@pytest.mark.parametrize(("modes", "condition"), [(1, 63.2), (2, 18.3), (3, 1.42)])
def test_formula_50_is_one_more_model(modes, condition):
    model = harmonic_model(FORMULA_50, known=ALPHA, estimate=["m1", "m2", "m3"])
    data = experiments(model, CRITICAL[:modes], {f"X{j + 1}": SHAPES[:modes, j] for j in range(3)})
    assert data.free.all()
    found = identify(model, data).linear
    alpha = [[ALPHA[f"a{min(i, j)}{max(i, j)}"] for j in (1, 2, 3)] for i in (1, 2, 3)]
    masses = equivalent_masses(alpha, CRITICAL[:modes], SHAPES[:modes].T).values
    np.testing.assert_allclose(found.recovery.values, masses, rtol=1e-9)
    assert found.estimate.condition_number == pytest.approx(condition, rel=5e-3)


TWO_MASSES = [
    "(m1*p**2 + (a1 + a12)*p + c1 + c2)*X1 - (a12*p + c2)*X2 = F",
    "-(a12*p + c2)*X1 + (m2*p**2 + (a2 + a12)*p + c2)*X2 = 0",
]
TWO_MASS_NUMBERS = {"m1": 3.0, "m2": 2.0, "c1": 500.0, "c2": 300.0}


def test_lesson_1_rows_equal_an_independent_derivation_and_not_the_printed_third_row():
    model = harmonic_model(TWO_MASSES, known=TWO_MASS_NUMBERS, estimate=["a1", "a12", "a2"])
    w, x1, x2, force = 7.0, 0.31 - 0.22j, -0.17 + 0.41j, 5.0
    K, Y, *_ = build_rows(model, experiments(model, [w], {"F": force, "X1": [x1], "X2": [x2]}))
    m1, m2, c1, c2 = TWO_MASS_NUMBERS.values()
    # damper forces by hand: iω(a1 x1 + a12 (x1 − x2)), iω(a2 x2 + a12 (x2 − x1))
    mine = stack(1j * w * np.array([[x1, x1 - x2, 0], [0, x2 - x1, x2]]))
    right = stack(
        np.array([force + m1 * w**2 * x1 - (c1 + c2) * x1 + c2 * x2, m2 * w**2 * x2 - c2 * x2 + c2 * x1])
    )
    np.testing.assert_allclose(K, mine, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(Y, right, rtol=1e-13)
    printed_third = w * np.array([-x2.imag, x1.imag - x2.imag, 0])
    assert not np.allclose(K[2], printed_third)
    np.testing.assert_allclose(K[2], w * np.array([0, x1.imag - x2.imag, -x2.imag]), rtol=1e-13)


def test_lesson_1_recovers_its_dampers():
    model = harmonic_model(TWO_MASSES, known=TWO_MASS_NUMBERS, estimate=["a1", "a12", "a2"])
    truth, w = np.array([4.0, 1.5, 2.5]), np.array([8.0, 15.0])
    load = {"F": np.full(2, 5.0 + 0j)}
    data = experiments(model, w, {**load, **model.predict(truth, w, load)})
    np.testing.assert_allclose(identify(model, data).values, truth, rtol=1e-11)


def test_task_21_rows_are_the_printed_ones():
    model = harmonic_model(["(p**3 + a1*p**2 + a2*p + a3)*X = F"], estimate=["a1", "a2", "a3"])
    w, x, force = 1.7, 0.4 - 0.9j, 2.0
    K, Y, *_ = build_rows(model, experiments(model, [w], {"F": force, "X": [x]}))
    printed = [
        [-(w**2) * x.real, -w * x.imag, x.real],
        [-(w**2) * x.imag, w * x.real, x.imag],
    ]
    np.testing.assert_allclose(K, printed, rtol=1e-14)
    np.testing.assert_allclose(Y, [force - w**3 * x.imag, w**3 * x.real], rtol=1e-14)


def test_rows_that_need_a_missing_amplitude_are_left_out_and_named():
    model = harmonic_model(TWO_MASSES, known=TWO_MASS_NUMBERS, estimate=["a1", "a12", "a2"])
    truth, w = np.array([4.0, 1.5, 2.5]), np.array([8.0, 15.0, 20.0])
    load = {"F": np.full(3, 5.0 + 0j)}
    amplitudes = model.predict(truth, w, load)
    amplitudes["X2"][1] = np.nan
    found = identify(model, experiments(model, w, {**load, **amplitudes}, names=["a", "b", "c"]))
    np.testing.assert_allclose(found.values, truth, rtol=1e-11)
    assert found.left_out == ("experiment b: X2 not measured",)
    assert found.linear.rows.left_out == (
        "experiment b, equation 1: an amplitude in it is not measured",
        "experiment b, equation 2: an amplitude in it is not measured",
    )
    assert not found.linear.rows.used[1].any()


def test_without_any_complete_row_there_is_a_message():
    model = harmonic_model(MASS, known={"m": 10.0}, estimate=["c", "alpha"])
    data = experiments(model, [1.0, 2.0], {"F": [1.0, np.nan], "X": [np.nan, 1.0 + 1j]}, free=False)
    with pytest.raises(ValueError, match="no reading can be compared"):
        identify(model, data)


@pytest.mark.parametrize(
    ("signals", "message"),
    [
        ({"X": [1j]}, "the input F of the model is not among the measurements"),
        ({"F": [1.0]}, "the signal X of the model is not among"),
        ({"F": [1.0], "X": [np.inf]}, "X: . finite values are needed"),
    ],
)
def test_measurements_that_do_not_fit_the_model_are_refused(signals, message):
    model = harmonic_model(MASS, known={"m": 10.0}, estimate=["c", "alpha"])
    with pytest.raises(ValueError, match=message):
        identify(model, experiments(model, [1.0], signals, free=False))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"loss": "magic"}, "loss 'magic' is not known: one of linear"),
        ({"bounds": {"k": (0, 1)}}, "k is no parameter"),
        ({"bounds": {"c": (2, 1)}}, "lowest, highest"),
    ],
)
def test_options_that_do_not_fit_are_refused(options, message):
    model = harmonic_model(MASS, known={"m": 10.0}, estimate=["c", "alpha"])
    with pytest.raises(ValueError, match=message):
        identify(model, experiments(model, [10, 20, 30], TASK_51), **options)


def test_one_experiment_cannot_tell_stiffness_from_mass():
    model = harmonic_model(MASS, estimate=["m", "c", "alpha"])
    found = identify(model, experiments(model, [20.0], {"F": 10.0, "X": [-3.3e-3 - 2.2e-4j]}))
    assert not found.identifiable
    assert found.estimate.rank == 2
    assert "only alpha and m - 0.0025*c are determined" in found.unidentifiable[0]  # 1/omega**2 = 0.0025
    assert "these experiments determine 2 of the 3" in found.unidentifiable[1]
    assert np.isfinite(found.value("alpha"))
    assert np.isnan([found.value("m"), found.value("c")]).all()
    (combination,) = found.combinations
    assert combination.value == pytest.approx(10.0 - 0.0025 * 1000.0, rel=0.01)


def test_equations_without_a_known_term_determine_ratios():
    model = harmonic_model(["(m*p**2 + c)*X = k*F"], estimate=["m", "c", "k"])
    found = identify(model, experiments(model, [1, 2, 3], {"F": 1.0, "X": [1.0, 0.5, 0.1]}, free=False))
    assert not found.identifiable
    assert found.estimate.rank == 2
    assert [c.words for c in found.combinations] == ["c/m", "k/m"]
    assert "every multiple of m, c and k fits" in found.unidentifiable[0]
    assert found.to_dict()["parameters"]["m"]["value"] is None


def test_unknowns_of_an_equation_without_a_known_term_are_not_zero_but_undetermined():
    """The second equation may be multiplied by any number; noisy data would give zeros for T, K and k."""
    model = harmonic_model(["(m*p**2 + c)*X = F", "(T*p + K)*Y = k*X"], estimate=["m", "c", "T", "K", "k"])
    w, load = np.array([1.0, 2.0, 3.0]), {"F": np.ones(3, dtype=complex)}
    exact = model.predict(np.array([1.0, 20.0, 0.5, 2.0, 3.0]), w, load)
    data = experiments(model, w, {**load, "X": exact["X"], "Y": np.round(exact["Y"], 3)}, free=False)
    found = identify(model, data)
    np.testing.assert_allclose(found.linear.recovery.values[:2], [1.0, 20.0], rtol=1e-9)
    np.testing.assert_allclose(found.values[:2], [1.0, 20.0], rtol=5e-3)
    assert np.isnan(found.values[2:]).all()
    assert found.estimate.rank == 4
    assert {c.words: round(c.value, 1) for c in found.combinations} == {"K/T": 4.0, "k/T": 6.0}
    assert "every multiple of T, K and k fits" in found.unidentifiable[0]


def test_free_vibration_drops_damping_and_says_so():
    model = harmonic_model(["(m*p**2 + b*p + c)*X = F"], known={"m": 2.0, "b": 0.1}, estimate=["c"])
    data = experiments(model, [3.0], {"X": [1.0]})
    assert data.free.all()
    found = identify(model, data)
    assert found.value("c") == pytest.approx(18.0, rel=1e-14)
    assert any("odd powers of p" in w for w in found.warnings)


def test_weighted_intervals_are_those_of_stated_errors():
    model = harmonic_model(MASS, known={"m": 10.0}, estimate=["c", "alpha"])
    small, large = (
        identify(model, experiments(model, [10, 20, 30], TASK_51, errors=AmplitudeErrors(e, e)))
        for e in (0.01, 0.02)
    )
    assert small.errors_stated
    np.testing.assert_allclose(2 * small.std, large.std, rtol=1e-6)
    np.testing.assert_allclose(small.values, large.values, rtol=1e-9)


@given(st.floats(1e-6, 1e6), st.floats(1e-6, 1e6), st.floats(0.1, 100))
@settings(deadline=None, max_examples=30)
def test_units_do_not_matter(length, mass, rate):
    """The exercise 5.1 in other units of length, mass and time has the same answer in those units."""
    force = mass * length * rate**2
    model = harmonic_model(MASS, known={"m": 10 * mass}, estimate=["c", "alpha"])
    signals = {"F": 10 * force, "X": np.array(TASK_51["X"]) * length}
    found = identify(model, experiments(model, np.array([10, 20, 30]) * rate, signals))
    base = identify(
        harmonic_model(MASS, known={"m": 10.0}, estimate=["c", "alpha"]),
        experiments(model, [10, 20, 30], TASK_51),
    )
    scale = np.array([mass * rate**2, mass * rate])
    np.testing.assert_allclose(found.values / scale, base.values, rtol=1e-9)
    np.testing.assert_allclose(found.std / scale, base.std, rtol=1e-6)
    assert found.estimate.condition_number == pytest.approx(base.estimate.condition_number, rel=1e-6)


def test_experiments_check_themselves():
    one = {"X": np.ones(1, dtype=complex)}
    marks = np.zeros(1, dtype=bool)
    with pytest.raises(ValueError, match="no experiments"):
        Experiments((), np.zeros(0), {}, np.zeros(0, dtype=bool))
    with pytest.raises(ValueError, match="frequencies must be finite"):
        Experiments(("1",), np.array([np.nan]), one, marks)
    with pytest.raises(ValueError, match="X: 1 finite values are needed"):
        Experiments(("1",), np.ones(1), {"X": np.ones(2, dtype=complex)}, marks)
    with pytest.raises(ValueError, match="X: 1 finite values are needed"):
        Experiments(("1",), np.ones(1), one, marks, None, {"X": np.ones((2, 2))})
    with pytest.raises(ValueError, match="not negative"):
        AmplitudeErrors(-0.1)
    with pytest.raises(ValueError, match="greater than zero"):
        AmplitudeErrors()
