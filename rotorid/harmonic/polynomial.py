"""Polynomials with exact coefficients: expressions multiplied out by sympy.polys, quick where sympy is not.

As data a polynomial is a dictionary from monomials to rational coefficients; a monomial is a sorted tuple of
(name, exponent), exponents of either sign, so that 1/p**2 or 1/k needs no multiplying out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import reduce
from operator import add, mul
from typing import Any

Monomial = tuple[tuple[str, int], ...]
Polynomial = dict[Monomial, Fraction]

ONE: Monomial = ()
MAX_TERMS = 20_000
MAX_EXPONENT = 50


def times(a: Monomial, b: Monomial) -> Monomial:
    """Product of two monomials."""
    powers = Counter(dict(a))
    powers.update(dict(b))
    return tuple(sorted((name, e) for name, e in powers.items() if e))


def degree(monomial: Monomial) -> int:
    """Sum of the exponents' sizes."""
    return sum(abs(e) for _, e in monomial)


def difference(
    left: Any,  # noqa: ANN401 - sympy expressions; sympy has no types
    right: Any,  # noqa: ANN401
    constant: Callable[[Any], Fraction | None],
) -> tuple[Polynomial, frozenset[str]]:
    """Left minus right over their common denominator, and the names in it.

    Denominators of one term are no part of it: they stay as negative exponents.

    Parameters
    ----------
    left, right
        Sums, products and whole powers of symbols and numbers.
    constant
        Value of a subexpression that is a number although it is no polynomial, such as sqrt(2*k) of a known
        k; None if it is not.

    Raises
    ------
    ValueError
        With the reason, for whatever is not rational, and for expansions that are too long.
    """
    from sympy import QQ, Symbol, ring

    names = sorted(symbol.name for symbol in left.free_symbols | right.free_symbols)
    R, *generators = ring([Symbol(text) for text in (*names, *(f"1/{name}" for name in names))], QQ)
    place = dict(zip(names, generators, strict=False))

    def ratio(expression: Any) -> _Ratio:  # noqa: ANN401
        if expression.is_Symbol:
            return _Ratio(place[expression.name])
        if expression.is_Rational:
            return _Ratio(R(QQ(expression.p, expression.q)))
        if expression.is_Add or expression.is_Mul:
            return reduce(add if expression.is_Add else mul, map(ratio, expression.args))
        value = None
        if expression.is_Pow and expression.exp.is_Integer:
            base, exponent = expression.base, int(expression.exp)
            if abs(exponent) > MAX_EXPONENT:
                raise ValueError(f"the exponent {exponent} is too large (at most {MAX_EXPONENT})")
            value = None if exponent >= 0 or base.is_Symbol else constant(base)
            if not value:
                return ratio(base) ** exponent
            value **= exponent
        else:
            value = constant(expression)
        if value is None:
            raise ValueError(
                f"'{expression}' is neither a polynomial nor a fraction of polynomials in p and the "
                "parameters; give such a term a name and estimate that"
            )
        return _Ratio(R(QQ(value.numerator, value.denominator)))

    first, second = ratio(left), ratio(right)
    whole = first + _Ratio(R(-1)) * second
    below = {
        name for factor in (*first.bottom, *second.bottom) for m in as_data(factor, names) for name, _ in m
    }
    return as_data(whole.top, names), frozenset(below)


def as_data(element: Any, names: Sequence[str]) -> Polynomial:  # noqa: ANN401
    """An element of a ring of sympy; of twice as many generators as names the second half are inverses."""
    found: Polynomial = {}
    for exponents, value in element.items():
        powers = Counter(dict(zip(names, exponents, strict=False)))
        powers.subtract(dict(zip(names, exponents[len(names) :], strict=False)))
        monomial = tuple(sorted((name, e) for name, e in powers.items() if e))
        number = Fraction(int(value.numerator), int(value.denominator))
        found[monomial] = found.get(monomial, Fraction(0)) + number
    return {monomial: value for monomial, value in found.items() if value}


@dataclass(frozen=True, eq=False)
class _Ratio:
    """A numerator over a product of polynomials of more than one term, each with its power."""

    top: Any
    bottom: Counter[Any] = field(default_factory=Counter)

    def __add__(self, other: _Ratio) -> _Ratio:
        bottom = self.bottom | other.bottom
        return _Ratio(self.over(bottom) + other.over(bottom), bottom)

    def __mul__(self, other: _Ratio) -> _Ratio:
        return _Ratio(_product(self.top, other.top), self.bottom + other.bottom)

    def __pow__(self, exponent: int) -> _Ratio:
        """Whole power, of either sign."""
        R, size = self.top.ring, abs(exponent)
        powers = Counter({factor: n * size for factor, n in self.bottom.items() if size})
        if exponent >= 0:
            return _Ratio(_power(self.top, size), powers)
        if not self.top:
            raise ValueError("it divides by zero")
        turned = _Ratio(R.one).over(powers)
        if len(self.top) > 1:
            return _Ratio(turned, Counter({self.top: size}))
        ((exponents, value),) = self.top.items()
        half = len(exponents) // 2
        inverse = R.term_new(exponents[half:] + exponents[:half], 1 / value)
        return _Ratio(_product(turned, _power(inverse, size)))

    def over(self, bottom: Counter[Any]) -> Any:  # noqa: ANN401
        """Numerator over a common denominator."""
        missing = (_power(factor, n) for factor, n in (bottom - self.bottom).items())
        return reduce(_product, missing, self.top)


def _product(a: Any, b: Any) -> Any:  # noqa: ANN401
    """Product; ValueError beyond MAX_TERMS terms."""
    if len(a) * len(b) <= 50 * MAX_TERMS and len(found := a * b) <= MAX_TERMS:
        return found
    raise ValueError("it expands to too many terms")


def _power(a: Any, exponent: int) -> Any:  # noqa: ANN401
    return reduce(_product, [a] * exponent, a.ring.one)
