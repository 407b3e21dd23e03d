"""Lifting and merging: what data can see at best, in words."""

import math
from fractions import Fraction

import numpy as np
import pytest
from harmonic_cases import FEEDBACK, PUMP, ROTOR
from hypothesis import given, settings
from hypothesis import strategies as st
from sympy import Rational, Symbol

from rotorid.identify import harmonic_model
from rotorid.identify.combinations import sum_words
from rotorid.identify.equations import multiplied_out
from rotorid.identify.expressions import ExpressionError, parse


@pytest.mark.parametrize(
    ("equation", "known", "estimate", "words"),
    [
        (ROTOR, {"m": 10, "e": 1e-4}, ["c", "b", "delta"], {"c", "b*(1 - delta)"}),
        (FEEDBACK, {"T0": 1, "K": 10}, ["T1", "T2"], {"T1 + T2", "T1*T2"}),
        (FEEDBACK, {"T0": 0.7, "K": 10}, ["T1", "T2"], {"T1 + T2", "T1*T2"}),
        (
            FEEDBACK,
            {"K": 10},
            ["T0", "T1", "T2"],
            {"T0", "T1 + T2", "T0*(T1 + T2)", "T1*T2", "T0*T1*T2"},
        ),
        (PUMP, {"T0": 1, "K": 10}, ["T1", "T2", "zeta"], {"K*T1 + 2*T0*zeta", "T2", "T2*zeta"}),
        (PUMP, {"T0": 1}, ["T1", "T2", "zeta", "K"], {"K*T1 + 2*T0*zeta", "T2", "K", "T2*zeta"}),
    ],
    ids=["4.1", "3.2", "3.2 with T0 = 0.7", "3.3", "4.2", "4.3"],
)
def test_singular_exercises_show_their_combinations(equation, known, estimate, words):
    model = harmonic_model([equation], known=known, estimate=estimate)
    assert set(model.combinations.words) == words


def test_combinations_have_the_coefficients_that_their_words_say():
    model = harmonic_model([PUMP], known={"T0": 0.3, "K": 10}, estimate=["T1", "T2", "zeta"])
    i = model.combinations.words.index("K*T1 + 2*T0*zeta")
    values = dict(zip(model.combinations.monomials, model.combinations.rows[i], strict=True))
    assert values[(("T1", 1),)] == pytest.approx(10, rel=1e-15)
    assert values[(("zeta", 1),)] == pytest.approx(0.6, rel=1e-15)


def test_the_row_space_is_exact_for_decimal_numbers():
    # 0.1 + 0.2 - 0.3 is no zero in floats; here the column of b vanishes exactly
    model = harmonic_model(
        ["p*X + (x + y - z)*b*X + 0.1*(b + c)*X + c*p*X = F"],
        known={"x": 0.1, "y": 0.2, "z": 0.3},
        estimate=["b", "c"],
    )
    assert set(model.combinations.words) == {"b", "c"}
    assert len(model.features) == 3
    merged = harmonic_model(
        ["p*X + 0.1*b*X + 0.3*c*X + (x + y)*c*0*X = F"],
        known={"x": 0.1, "y": 0.2},
        estimate=["b", "c"],
    )
    assert merged.combinations.words == ("b + 3*c",)


@pytest.mark.parametrize(
    ("terms", "words"),
    [
        ({(("b", 1),): 1, (("b", 1), ("d", 1)): -1}, "b*(1 - d)"),
        ({(("a", 1),): 1, (("b", 1),): 2}, "a + 2*b"),
        ({(("a", 2),): -1, (("b", -1),): 3}, "3/b - a**2"),
        ({(("a", 1), ("b", -1)): 1}, "a/b"),
        ({(("a", -1), ("b", -2)): 1}, "1/(a*b**2)"),
        ({(("a", 1),): Fraction(5, 2)}, "2.5*a"),
    ],
)
def test_words(terms, words):
    assert sum_words({m: Fraction(x) for m, x in terms.items()}) == words


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
    if not value.is_finite:
        return
    slope = value.coeff(Symbol("F"))
    point = {**POINT, "F": 1 / Fraction(int(slope.p), int(slope.q))} if slope else POINT
    total = sum(
        (
            x * math.prod(point.get(name, 0) ** e for name, e in monomial)
            for monomial, x in polynomial.items()
        ),
        Fraction(0),
    )
    assert total == 0 or not slope


@given(st.integers(0, 10_000), st.integers(1, 4), st.integers(2, 5), st.integers(2, 5))
@settings(deadline=None, max_examples=40)
def test_merged_regression_spans_what_all_monomials_span(seed, rank, features, unknowns):
    """Random linear coefficients of given rank: rank and row space of the merged combinations are theirs."""
    rng = np.random.default_rng(seed)
    table = rng.integers(-3, 4, (features, rank)) @ rng.integers(-3, 4, (rank, unknowns))
    table = table[:, np.any(table, axis=0)]
    if not table.size:
        return
    names = [f"x{j}" for j in range(table.shape[1])]
    terms = " + ".join(
        f"({' + '.join(f'({x})*{n}' for x, n in zip(row, names, strict=True))})*p**{k}*X"
        for k, row in enumerate(table)
    )
    model = harmonic_model([f"{terms} + p**9*X = F"], estimate=names)
    rows = model.combinations.rows
    assert len(rows) == np.linalg.matrix_rank(table)
    assert np.linalg.matrix_rank(np.vstack((rows, table))) == len(rows)
