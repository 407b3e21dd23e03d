"""Polynomials with exact coefficients: dictionary arithmetic, quick where sympy's expansion is not.

A polynomial is a dictionary from monomials to rational coefficients; a monomial is a sorted tuple of
(name, exponent), exponents of either sign, so that 1/p**2 or 1/k needs no multiplying out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import reduce
from typing import Any

Monomial = tuple[tuple[str, int], ...]
Polynomial = dict[Monomial, Fraction]

ONE: Monomial = ()
MAX_TERMS = 20_000
MAX_EXPONENT = 50


def times(a: Monomial, b: Monomial) -> Monomial:
    """Product of two monomials."""
    if not a or not b:
        return a or b
    powers = dict(a)
    for name, exponent in b:
        powers[name] = powers.get(name, 0) + exponent
    return tuple(sorted((name, e) for name, e in powers.items() if e))


def degree(monomial: Monomial) -> int:
    """Sum of the exponents' sizes."""
    return sum(abs(e) for _, e in monomial)


def add(a: Polynomial, b: Polynomial, factor: int = 1) -> Polynomial:
    """A + factor·b."""
    out = dict(a)
    for monomial, value in b.items():
        total = out.get(monomial, Fraction(0)) + factor * value
        if total:
            out[monomial] = total
        else:
            out.pop(monomial, None)
    return out


def multiply(a: Polynomial, b: Polynomial) -> Polynomial:
    """Product; ValueError beyond MAX_TERMS terms."""
    if len(a) * len(b) > 50 * MAX_TERMS:
        raise ValueError("it expands to too many terms")
    out: Polynomial = {}
    for m, x in a.items():
        for n, y in b.items():
            key = times(m, n)
            out[key] = out.get(key, Fraction(0)) + x * y
    if len(out) > MAX_TERMS:
        raise ValueError("it expands to too many terms")
    return {m: x for m, x in out.items() if x}


def power(a: Polynomial, exponent: int) -> Polynomial:
    """A to a whole power, negative only for a single term."""
    if len(a) == 1:
        ((monomial, value),) = a.items()
        return {tuple((name, e * exponent) for name, e in monomial) if exponent else ONE: value**exponent}
    out: Polynomial = {ONE: Fraction(1)}
    for _ in range(exponent):
        out = multiply(out, a)
    return out


Factor = tuple[tuple[Monomial, Fraction], ...]


class Ratio:
    """A numerator over a product of polynomials of more than one term."""

    def __init__(self, top: Polynomial, bottom: Mapping[Factor, int] | None = None) -> None:
        self.top = top
        self.bottom: Counter[Factor] = Counter(bottom or {})

    def __add__(self, other: Ratio) -> Ratio:
        bottom = self.bottom | other.bottom
        return Ratio(add(self.over(bottom), other.over(bottom)), bottom)

    def __mul__(self, other: Ratio) -> Ratio:
        return Ratio(multiply(self.top, other.top), self.bottom + other.bottom)

    def to_power(self, exponent: int) -> Ratio:
        """Whole power, of either sign."""
        if exponent >= 0:
            bottom = Counter({f: n * exponent for f, n in self.bottom.items() if exponent})
            return Ratio(power(self.top, exponent), bottom)
        if not self.top:
            raise ValueError("it divides by zero")
        top: Polynomial = {ONE: Fraction(1)}
        for factor, n in self.bottom.items():
            top = multiply(top, power(dict(factor), -n * exponent))
        if len(self.top) == 1:
            return Ratio(multiply(top, power(self.top, exponent)))
        return Ratio(top, {tuple(sorted(self.top.items())): -exponent})

    def over(self, bottom: Counter[Factor]) -> Polynomial:
        """Numerator over a common denominator."""
        top = self.top
        for factor, n in (bottom - self.bottom).items():
            top = multiply(top, power(dict(factor), n))
        return top


def from_expression(
    expression: Any,  # noqa: ANN401 - a sympy expression; sympy has no types
    constant: Callable[[Any], Fraction | None],
) -> Ratio:
    """Expand a sympy expression.

    Parameters
    ----------
    expression
        Sums, products and whole powers of symbols and numbers.
    constant
        Value of a subexpression that is a number although it is no polynomial, such as sqrt(2*k) of a known
        k; None if it is not.

    Raises
    ------
    ValueError
        With the reason, for whatever is not rational, and for expansions that are too long.
    """
    if expression.is_Symbol:
        return Ratio({((expression.name, 1),): Fraction(1)})
    if expression.is_Rational:
        return _number(Fraction(int(expression.p), int(expression.q)))
    if expression.is_Float:
        return _number(Fraction(repr(float(expression))))
    if expression.is_Add or expression.is_Mul:
        join, start = (Ratio.__add__, 0) if expression.is_Add else (Ratio.__mul__, 1)
        parts = (from_expression(part, constant) for part in expression.args)
        return reduce(join, parts, _number(Fraction(start)))
    if expression.is_Pow and expression.exp.is_Integer:
        base, exponent = expression.base, int(expression.exp)
        if abs(exponent) > MAX_EXPONENT:
            raise ValueError(f"the exponent {exponent} is too large (at most {MAX_EXPONENT})")
        value = None if exponent >= 0 or base.is_Symbol else constant(base)
        return _number(value**exponent) if value else from_expression(base, constant).to_power(exponent)
    found = constant(expression)
    if found is None:
        raise ValueError(
            f"'{expression}' is neither a polynomial nor a fraction of polynomials in p and the parameters; "
            f"give such a term a name and estimate that"
        )
    return _number(found)


def _number(value: Fraction) -> Ratio:
    return Ratio({ONE: value} if value else {})
