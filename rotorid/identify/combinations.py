"""Combinations of parameters that data can determine, in words.

The monomials of the parameters are lifted into new unknowns ([S] 1.8). The matrix of their coefficients
(features × monomials, known numbers inserted, exact rationals) has a row space: its reduced echelon form
lists the combinations of monomials that data can determine at best. Which of them given data determine is
seen from the rank of the regression.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.text import listing

Monomial = tuple[tuple[str, Fraction | int], ...]
"""Names with their exponents, sorted."""
Polynomial = dict[Monomial, Fraction]
Expression = Any
"""Of sympy, which has no types."""

P = "p"
ONE: Monomial = ()
CONSTANT = ""
"""Signal name of a term without a signal: amplitude 1."""
NAME = re.compile(r"[^\W\d]\w*")


@dataclass(frozen=True)
class Feature:
    """One coefficient of one equation: Σ over monomials, each with a polynomial in the known names.

    Attributes
    ----------
    equation, power, signal
        Number of the equation from 0, k of p^k, name of the amplitude (or CONSTANT).
    exact
        Coefficient of each monomial of the parameters, known numbers inserted.
    symbolic
        The same with the names of the known.
    varying
        Product of known quantities that change from row to row, such as a speed: [S] (4).
    """

    equation: int
    power: int
    signal: str
    exact: dict[Monomial, Fraction]
    symbolic: dict[Monomial, Polynomial]
    varying: Monomial = ONE


@dataclass(frozen=True, eq=False)
class Combinations:
    """The combinations of parameters that data can determine at best.

    Attributes
    ----------
    monomials
        The lifted unknowns, parameters first.
    rows
        Shape (u, monomials): each combination's coefficients.
    pivots, scales
        A feature's share of combination i is its coefficient of monomial `pivots[i]` over `scales[i]`.
    symbolic, words
        Coefficients by monomial, with the names of the known; in words such as "b*(1 - delta)".
    """

    monomials: tuple[Monomial, ...]
    rows: FloatArray
    pivots: tuple[int, ...]
    scales: FloatArray
    symbolic: tuple[Mapping[Monomial, Polynomial], ...]
    words: tuple[str, ...]


def exact_number(value: float) -> Fraction:
    """The decimal number that a float is printed as: 0.1 is 1/10."""
    return Fraction(repr(float(value)))


def times(a: Monomial, b: Monomial) -> Monomial:
    """Product of two monomials."""
    powers = dict(a)
    for name, e in b:
        powers[name] = powers.get(name, 0) + e
    return tuple(sorted((name, e) for name, e in powers.items() if e))


def degree(monomial: Monomial) -> float:
    """Sum of the exponents' sizes."""
    return sum(abs(float(e)) for _, e in monomial)


def expression(polynomial: Polynomial) -> Expression:
    """A polynomial in symbols of sympy."""
    from sympy import Add, Mul, Rational, Symbol

    return Add(
        *(
            Rational(x.numerator, x.denominator)
            * Mul(*(Symbol(n) ** Rational(Fraction(e).numerator, Fraction(e).denominator) for n, e in m))
            for m, x in polynomial.items()
        )
    )


def insert(polynomial: Polynomial, known: Mapping[str, Fraction]) -> Fraction:
    """Value of a polynomial in known names."""
    terms = (
        x * math.prod((known[n] ** int(e) for n, e in m), start=Fraction(1)) for m, x in polynomial.items()
    )
    return sum(terms, Fraction(0))


def monomials_of(features: Sequence[Feature], parameters: Sequence[str]) -> tuple[Monomial, ...]:
    """Monomials of the parameters in all features: single parameters first, in their order."""
    order = {name: i for i, name in enumerate(parameters)}
    every = {m for feature in features for m in feature.exact if m != ONE}
    return tuple(sorted(every, key=lambda m: (degree(m), sorted((order[n], e) for n, e in m))))


def merge(
    features: Sequence[Feature], monomials: Sequence[Monomial], known: Mapping[str, Fraction]
) -> Combinations:
    """Merge monomials whose columns no data can tell apart into the combinations that data can see."""
    from sympy import QQ
    from sympy.polys.matrices import DomainMatrix

    table = [[f.exact.get(m, Fraction(0)) for m in monomials] for f in features]
    table = [[QQ(x.numerator, x.denominator) for x in row] for row in table]
    reduced, pivots = DomainMatrix(table, (len(table), len(monomials)), QQ).to_sparse().rref()
    rows, symbolic = np.zeros((len(pivots), len(monomials))), []
    for i, row in enumerate(reduced.to_Matrix().tolist()[: len(pivots)]):
        wanted = {m: Fraction(int(x.p), int(x.q)) for m, x in zip(monomials, row, strict=True) if x}
        symbolic.append(_as_an_equation_has_them(wanted, features))
        rows[i] = [float(insert(symbolic[-1].get(m, {}), known)) for m in monomials]
    words = tuple(sum_words({times(m, k): x for m, p in s.items() for k, x in p.items()}) for s in symbolic)
    scales = rows[np.arange(len(pivots)), pivots]
    return Combinations(tuple(monomials), rows, tuple(pivots), scales, tuple(symbolic), words)


def _as_an_equation_has_them(
    wanted: Mapping[Monomial, Fraction], features: Sequence[Feature]
) -> dict[Monomial, Polynomial]:
    """Coefficients with the names of the known, where an equation has this combination, else as numbers.

    What all of them share is taken out: T0*T1 + T0*T2 of a known T0 is T1 + T2.
    """
    first = next(iter(wanted))
    for f in features if len(wanted) > 1 else ():
        parts = [f.symbolic.get(m, {}) for m in wanted]
        if any(len(part) != 1 for part in parts):
            continue
        scale = f.exact[first] / wanted[first]
        if any(f.exact[m] != scale * x for m, x in wanted.items()):
            continue
        names, factors = zip(*(item for part in parts for item in part.items()), strict=True)
        shared = tuple((n, -min(dict(one).get(n, 0) for one in names)) for n in dict(sum(names, ())))
        unit = min(map(abs, factors))
        unit = Fraction(1) if any((x / unit).denominator > 1 for x in factors) else unit
        unit = -unit if sum(x < 0 for x in factors) > len(factors) / 2 else unit
        terms = zip(wanted, names, factors, strict=True)
        return {m: {times(powers, shared): x / unit} for m, powers, x in terms}
    return {m: {ONE: x} for m, x in wanted.items()}


def sum_words(polynomial: Polynomial) -> str:
    """A sum of products in words, a common factor in front.

    Examples
    --------
    >>> sum_words({(("b", 1),): Fraction(1), (("b", 1), ("delta", 1)): Fraction(-1)})
    'b*(1 - delta)'
    """
    from sympy import factor_terms

    return _written(factor_terms(expression(polynomial)))


def _written(words: Expression) -> str:
    """As text, what is not subtracted first; fractions as decimals, but for exponents."""
    from sympy import Float, Pow, Rational
    from sympy.printing.str import StrPrinter

    fixed = {e.exp for e in words.atoms(Pow)}
    decimals = {q: Float(q, 6) for q in words.atoms(Rational) if q.q != 1 and q not in fixed}
    printer = StrPrinter({"full_prec": False})
    ordered = printer._as_ordered_terms
    printer._as_ordered_terms = lambda sum_, order=None: sorted(
        ordered(sum_, order), key=lambda term: term.could_extract_minus_sign()
    )
    return str(printer.doprint(words.xreplace(decimals)))


def why_several(solutions: Sequence[FloatArray], names: Sequence[str], differ: Sequence[int]) -> list[str]:
    """Say in words how several solutions (n,) differ in the parameters of these indices."""
    if len(solutions) < 2 or not len(differ):
        return []
    ordered = np.sort(np.array(solutions)[:, differ], axis=1)
    who = listing([names[j] for j in differ], "and")
    if np.allclose(ordered, ordered[0], rtol=1e-5, atol=0):
        return [f"{who} can be exchanged without any change of the amplitudes: see the solutions"]
    several = "has {} values" if len(differ) == 1 else "have {} sets of values"
    return [f"{who} {several.format(len(solutions))} that explain the data equally well"]
