"""Operator models: what their equations mean, what data can see at best, and what is refused."""

import math
from fractions import Fraction

import numpy as np
import pytest
from cases import each_of
from harmonic_cases import FEEDBACK, PUMP, ROTOR, simulate
from hypothesis import given, settings
from hypothesis import strategies as st
from sympy import Rational, Symbol

from rotorid.files import InputError, read_harmonic_model, read_measurements
from rotorid.identify import harmonic_model, identify
from rotorid.identify.amplitudes import experiments
from rotorid.identify.equations import multiplied_out
from rotorid.identify.expressions import ExpressionError, parse

MASS = "(m*p**2 + b*p + c)*X = F"
GYRO = ["(I*p**2 + b*p + k)*A + G*Omega*p*B = M", "(I*p**2 + b*p + k)*B - G*Omega*p*A = 0"]


def test_inputs_are_the_signals_that_no_equation_is_for_or_those_named():
    model = harmonic_model([MASS], known={"m": 10.0}, estimate=["c", "b"])
    assert (model.signals, model.inputs, model.outputs) == (("X", "F"), ("F",), ("X",))
    model = harmonic_model(["m*p**2*X + c*(X - Y) = 0"], known={"m": 1}, estimate=["c"], inputs=["Y"])
    assert (model.inputs, model.outputs) == (("Y",), ("X",))


W = np.array([0.7, 3.0])


@pytest.mark.parametrize(
    ("equation", "known", "estimate", "output", "expected"),
    [
        ("(E*p**2 + I*p + lambda)*S = N*beta", {"N": 2.0, "I": 3.0}, {"E": 5.0, "lambda": 7.0},
         "S", 2 / (7 - 5 * W**2 + 3j * W)),
        ("(m*p**2 + b*p + c)*Z = -m*e*p**2", {"m": 10.0, "e": 1e-4, "b": 5.0}, {"c": 1e5},
         "Z", 1e-3 * W**2 / (1e5 - 10 * W**2 + 5j * W)),
        ("a*X/p**2 + X/k = F", {}, {"a": 2.0, "k": 4.0}, "X", 1 / (1 / 4 - 2 / W**2)),
        ("S = K*F/(T0*p + 1)/(T1*p + 1)", {}, {"K": 5.0, "T0": 0.2, "T1": 0.7},
         "S", 5 / (0.2j * W + 1) / (0.7j * W + 1)),
        ("p**2*X + sqrt(k)*c*X = F", {"k": 4.0}, {"c": 3.0}, "X", 1 / (6 - W**2)),
    ],
    ids=["names of sympy", "a term without a signal", "a power below 0", "denominators", "a root"],
)  # fmt: skip
def test_amplitudes_are_those_of_the_written_equation(equation, known, estimate, output, expected):
    model = harmonic_model([equation], known=known, estimate=[*estimate])
    loads = dict.fromkeys(model.inputs, np.ones(2))
    found = model.predict(np.array([*estimate.values()]), W, loads)[output]
    np.testing.assert_allclose(found, expected, rtol=1e-13)


@each_of(
    ("equations", "known", "estimate", "message"),
    [
        ([MASS], {"m": 1}, ["c", "b", "k"], "the parameter k is to be estimated but stands in no equation"),
        ([MASS], {"m": 1}, ["c", "c"], "parameter c: c is already given"),
        ([MASS], {"m": 1, "c": 1}, ["c", "b"], "known value c: c is already a parameter"),
        ([MASS], {"m": 1}, ["c", "p"], "p is d/dt"),
        ([MASS], {"m": 1}, [], "no parameter"),
        ([], {}, ["c"], "no equations"),
        (["c*(X + p*X) - c*X - c*p*X + X = F"], {}, ["c"], "the parameter c cancels out"),
        (["c*X**2 = F"], {}, ["c"], "equation 1, 'c\\*X\\*\\*2 = F': it is not linear in the signals"),
        (["X = F", "c*X*F = F"], {}, ["c"], "equation 2, .*not linear in the signals"),
        (["(m*p**2 + k)*X + k*X*Y = F", "k*Y = X"], {"m": 1}, ["k"], "signals: it contains X\\*Y"),
        (["(m*p**2*T + k*T)*X = F"], {"m": 1}, ["k"], r"T\*X|X\*T.*under varying"),
        (["c*X/(1 + X) = F"], {}, ["c"], "X stands in a denominator"),
        (["sin(c*p)*X = F"], {}, ["c"], "neither a polynomial"),
        (["X/m = c*F"], {"m": 0.0}, ["c"], "divides by m, which is 0"),
        (["c*X/(m - m) = F"], {"m": 1.0}, ["c"], "division by zero"),
        (["X/(a*(b + 1) - a*b - a) = F"], {}, ["a", "b"], "it divides by zero"),
        (["c*p = 1"], {}, ["c"], "equation 1, .*contains no signal"),
        (["c*X"], {}, ["c"], "equation needs one ="),
        ([MASS], {"m": float("nan")}, ["c"], "m: its value must be a finite number"),
        ([MASS], {"m": 1}, ["c", "sin"], "parameter 'sin' is no name"),
        ([f"({'+'.join('abcdefghijklmnoqrstuvwxyz')})**9*X = F"], {}, ["a"], "terms"),
    ],
)
def test_bad_models_are_refused_in_words(equations, known, estimate, message):
    with pytest.raises(ValueError, match=message):
        harmonic_model(equations, known=known, estimate=estimate)


def test_bad_inputs_are_refused():
    for inputs, message in ((["G"], "the input G is no signal"), (["X", "F"], "nothing to measure")):
        with pytest.raises(ValueError, match=message):
            harmonic_model([MASS], known={"m": 1}, estimate=["c", "b"], inputs=inputs)
    model = harmonic_model(["c*X + p*Y = F"], estimate=["c"])
    with pytest.raises(ValueError, match=r"say which signals are given with inputs"):
        model.predict(np.ones(1), np.ones(1), {"F": np.ones(1)})


# What data can see at best


@pytest.mark.parametrize(
    ("equation", "known", "estimate", "words"),
    [
        (ROTOR, {"m": 10, "e": 1e-4}, ["c", "b", "delta"], {"c", "b*(1 - delta)"}),
        (FEEDBACK, {"T0": 0.7, "K": 10}, ["T1", "T2"], {"T1 + T2", "T1*T2"}),
        (FEEDBACK, {"K": 10}, ["T0", "T1", "T2"],
         {"T0", "T1 + T2", "T0*(T1 + T2)", "T1*T2", "T0*T1*T2"}),
        (PUMP, {"T0": 1}, ["T1", "T2", "zeta", "K"], {"K*T1 + 2*T0*zeta", "T2", "K", "T2*zeta"}),
        # 0.1 + 0.2 - 0.3 is no zero in floats; here the column of b vanishes exactly
        ("p*X + (x + y - z)*b*X + 0.1*(b + c)*X + c*p*X = F", {"x": 0.1, "y": 0.2, "z": 0.3}, ["b", "c"],
         {"b", "c"}),
        ("p*X + 0.1*b*X + 0.3*c*X + x*c*0*X = F", {"x": 0.1}, ["b", "c"], {"b + 3*c"}),
        ("p*X + p**2*X/(a*b**2) + (3/b - a**2)*X = F", {}, ["a", "b"], {"1/(a*b**2)", "3/b - a**2"}),
        ("(p**2 + a**1.5*p + a*b)*X = F", {}, ["a", "b"], {"a**(3/2)", "a*b"}),
    ],
)  # fmt: skip
def test_combinations_in_words(equation, known, estimate, words):
    model = harmonic_model([equation], known=known, estimate=estimate)
    assert set(model.combinations.words) == words


POINT = {"a": Fraction(2, 3), "b": Fraction(-5, 4), "c": Fraction(7)}
EXPRESSIONS = st.recursive(
    st.sampled_from(["a", "b", "c", "2", "0.3", "(a + 1)", "(b - c)"]),
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from("+-*/"), inner).map(lambda t: f"({t[0]} {t[1]} {t[2]})"),
        st.tuples(inner, st.integers(-2, 3)).map(lambda t: f"({t[0]})**{t[1]}"),
    ),
    max_leaves=6,
)


@given(EXPRESSIONS)
@settings(deadline=None, max_examples=100)
def test_what_is_multiplied_out_agrees_with_numbers(text):
    """F·(expression) − 1 over the denominators is 0 where F is the inverse of the expression there."""
    try:
        expression = parse(f"F*({text})")
        polynomial, _ = multiplied_out(expression - 1, {})
    except (ExpressionError, ValueError):
        return  # such as a division by zero
    value = expression.subs({name: Rational(str(x)) for name, x in POINT.items()})
    slope = value.coeff(Symbol("F")) if value.is_finite else 0
    if slope:
        point = {**POINT, "F": 1 / Fraction(int(slope.p), int(slope.q))}
        terms = (x * math.prod(point.get(n, 0) ** e for n, e in term) for term, x in polynomial.items())
        assert sum(terms, Fraction(0)) == 0


# Known quantities that change from row to row, [S] (4)


def test_a_speed_that_changes_from_row_to_row():
    model = harmonic_model(GYRO, known={"I": 0.8}, estimate=["b", "k", "G"])
    assert (model.varying, model.signals, model.inputs) == (("Omega",), ("A", "B", "M"), ("M",))
    (b, k, g), w, speed = (3.0, 500.0, 1.3), np.linspace(8, 60, 7), np.linspace(10, 90, 7)
    d, turned = k - 0.8 * w**2 + 1j * w * b, 1j * w * g * speed
    A, B = d / (d**2 + turned**2), turned / (d**2 + turned**2)  # written out by hand
    data = experiments(model, w, {"M": 1.0, "A": A, "B": B, "Omega": speed}, free=False)
    result = identify(model, data)
    np.testing.assert_allclose(result.values, [b, k, g], rtol=1e-9)
    assert result.warnings == ()
    np.testing.assert_allclose(result.predicted["B"], B, rtol=1e-9)


def test_a_temperature_in_free_vibrations_and_a_speed_in_a_quotient():
    model = harmonic_model(["(m*p**2 + k0 + k1*T)*X = F"], known={"m": 2.0}, estimate=["k0", "k1"])
    T = np.array([20.0, 40.0, 70.0])
    data = experiments(model, np.sqrt((5e3 - 12.0 * T) / 2.0), {"X": 1.0, "T": T})
    assert data.free.all()
    np.testing.assert_allclose(identify(model, data).values, [5e3, -12.0], rtol=1e-9)
    equation = "(m*p**2 + b*p + c/Omega)*X = u*Omega**2"
    model = harmonic_model([equation], known={"m": 2.0}, estimate=["b", "c", "u"], varying=["Omega"])
    w = np.array([3.0, 5.0, 9.0, 14.0])
    x = 0.3 * w**2 / (-2 * w**2 + 4j * w + 800 / w)
    values = identify(model, experiments(model, w, {"X": x, "Omega": w})).values
    np.testing.assert_allclose(values, [4, 800, 0.3], rtol=1e-9)
    with pytest.raises(ValueError, match="divides by Omega, which is 0"):
        identify(model, experiments(model, w, {"X": x, "Omega": np.array([0.0, 1, 2, 3])}))


def test_columns_of_a_table(tmp_path):
    model, data = tmp_path / "model.toml", tmp_path / "data.csv"
    head = "frequency_rad_s,M_re,A_re,A_im,B_re,B_im"
    rows = [f"{w},1,0.1,0.01,0.02,{w}" for w in (10, 20)]

    def read(name, *cells, equations=GYRO):
        model.write_text(f'equations = {equations}\nestimate = ["b", "k", "G"]\nknown = {{ I = 0.8 }}\n')
        lines = [f"{head},{name}", *(f"{r},{c}" for r, c in zip(rows, cells, strict=False))]
        data.write_text("\n".join(lines) + "\n")
        return read_measurements(data, read_harmonic_model(model))

    for name, cells, values in (
        ("Omega_re", (10, 20), [10, 20]),
        ("Omega_rpm", (30, 60), [np.pi, 2 * np.pi]),
        ("Omega", (10, ""), [10, np.nan]),
    ):
        table = read(name, *cells)
        np.testing.assert_allclose(table.varying["Omega"], values)
    result = identify(read_harmonic_model(model).model, table)
    assert result.left_out[0] == "experiment 2: left out, for not every input or varying quantity is known"
    misspelt = [GYRO[0].replace("+ k)", "+ kk)"), GYRO[1]]
    for name, equations, words in (
        ("Omega_im", GYRO, "Omega_im"),
        ("note", GYRO, "a column Omega: the equations multiply amplitudes"),
        ("Omega", misspelt, "a column kk: the equations multiply amplitudes"),
    ):
        with pytest.raises(InputError, match=words):
            read(name, 3, equations=equations)


def test_a_name_that_differs_by_case_only_is_asked_about():
    right = ["(m*p**2 + k1 + k2)*X1 = k2*X2 + F", "(m*p**2 + k2)*X2 = k2*X1"]
    truth, w = np.array([300.0, 200.0]), np.array([3.0, 5.0, 8.0])
    options = {"known": {"m": 2.0}, "estimate": ["k1", "k2"]}
    z = simulate(harmonic_model(right, **options), truth, w, {"F": 1.0}).signals
    model = harmonic_model([right[0].replace("*X2", "*x2"), right[1]], **options)
    for more in ({}, {"x2": 0.0}):  # a table without the column reads an input as 0
        with pytest.raises(ValueError, match=r"is x2 meant to be X2\?"):
            identify(model, experiments(model, w, {**z, **more}, free=False))
    data = experiments(model, w, {**z, "x2": z["X2"]}, free=False)
    np.testing.assert_allclose(identify(model, data).values, truth, rtol=1e-9)
