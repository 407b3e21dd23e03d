"""Combinations of parameters that harmonic data determine: equations as features, Σ P_f(parameters)·f = 0.

The monomials of the parameters are lifted into new unknowns ([S] 1.8). The matrix of their coefficients
(features × monomials, known numbers inserted, exact rationals) has a row space: its reduced echelon form
lists the combinations of monomials that data can determine at best.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.harmonic.polynomial import ONE, Monomial, Polynomial, degree, times

P = "p"
NAME = re.compile(r"[^\W\d]\w*")
"""A name in a text."""
CONSTANT = ""
"""Signal name of a term without a signal: amplitude 1."""


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


def split_features(
    equation: int,
    polynomial: Polynomial,
    known: Mapping[str, Fraction],
    signals: frozenset[str],
    varying: frozenset[str] = frozenset(),
) -> list[Feature]:
    """Sort an equation's terms by p^k · signal; ValueError where it is not linear in the signals."""
    symbolic: dict[tuple[int, str, Monomial], dict[Monomial, Polynomial]] = {}
    for monomial, value in polynomial.items():
        k, signal, numbers, parameters, factors_of_row = 0, CONSTANT, [], [], []
        for name, exponent in monomial:
            if name == P:
                k = exponent
            elif name in varying:
                factors_of_row.append((name, exponent))
            elif name in signals:
                if signal or exponent != 1:
                    term = "*".join(f"{n}**{e}" if e != 1 else n for n, e in monomial if n in signals)
                    raise ValueError(
                        f"it is not linear in the signals: it contains {term} (name a quantity that is known "
                        f"in each row under varying)"
                    )
                signal = name
            elif name in known:
                numbers.append((name, exponent))
            else:
                parameters.append((name, exponent))
        place = symbolic.setdefault((k, signal, tuple(factors_of_row)), {}).setdefault(tuple(parameters), {})
        place[tuple(numbers)] = value
    features = []
    for (k, signal, factors), parts in sorted(symbolic.items(), key=lambda item: item[0]):
        exact = {m: insert(part, known) for m, part in parts.items()}
        exact = {m: x for m, x in exact.items() if x}
        if exact:
            features.append(Feature(equation, k, signal, exact, {m: parts[m] for m in exact}, factors))
    return features


def exact_number(value: float) -> Fraction:
    """The decimal number that a float is printed as: 0.1 is 1/10."""
    return Fraction(repr(float(value)))


def multipliers(
    powers: Sequence[int],
    products: Sequence[Monomial],
    frequencies: FloatArray,
    varying: Mapping[str, FloatArray] | None = None,
) -> ComplexArray:
    """(iω)^k and the varying quantities of each feature (n, f), for frequencies (n,) and quantities (n,)."""
    w, k = np.asarray(frequencies, dtype=float), np.asarray(powers, dtype=np.int_)
    if (k < 0).any() and (w == 0).any():
        raise ValueError("an equation divides by p: an experiment at the frequency 0 cannot be used")
    # exact powers of i, so that a real row has no imaginary dust
    out = w[:, None] ** k * np.array([1, 1j, -1, -1j])[k % 4]
    for j, product in enumerate(products):
        for name, exponent in product:
            if varying is None or name not in varying:
                raise ValueError(
                    f"{name} stands as a factor in the equations and is neither known nor estimated: "
                    f"the measurements must have its value in every row (a column {name})"
                )
            value = np.asarray(varying[name], dtype=float)
            if exponent < 0 and (value == 0).any():
                raise ValueError(f"an equation divides by {name}, which is 0 in a row of the measurements")
            out[:, j] *= value ** float(exponent)
    return np.asarray(out, dtype=complex)


def insert(polynomial: Polynomial, known: Mapping[str, Fraction]) -> Fraction:
    """Value of a polynomial in known names."""
    total = Fraction(0)
    for monomial, value in polynomial.items():
        term = value
        for name, exponent in monomial:
            term *= known[name] ** exponent
        total += term
    return total


def lifted(features: Sequence[Feature], parameters: Sequence[str]) -> tuple[Monomial, ...]:
    """Monomials of the parameters in all features: single parameters first, in their order."""
    order = {name: i for i, name in enumerate(parameters)}
    found = {m for feature in features for m in feature.exact if m != ONE}
    return tuple(sorted(found, key=lambda m: (degree(m), sorted((order[n], e) for n, e in m))))


def powers_product(exponents: FloatArray, theta: FloatArray) -> FloatArray:
    """Products Π θ^e (m,) of exponents (m, n)."""
    return np.asarray(np.prod(np.asarray(theta, dtype=float) ** exponents, axis=1))


def powers_slopes(exponents: FloatArray, theta: FloatArray) -> FloatArray:
    """Derivatives (m, n) of the products by θ."""
    values = np.asarray(theta, dtype=float)
    if values.all():
        return np.asarray(powers_product(exponents, values)[:, None] * exponents / values)
    slopes = np.zeros_like(exponents)
    for j in range(len(values)):
        used = np.flatnonzero(exponents[:, j])
        lower = exponents[used].copy()
        lower[:, j] -= 1
        slopes[used, j] = exponents[used, j] * powers_product(lower, values)
    return slopes


def merge(
    features: Sequence[Feature], monomials: Sequence[Monomial], known: Mapping[str, Fraction]
) -> Combinations:
    """Merge monomials whose columns no data can tell apart into the combinations that data can see."""
    from sympy import QQ
    from sympy.polys.matrices import DomainMatrix

    exact = [[f.exact.get(m, Fraction(0)) for m in monomials] for f in features]
    table = [[QQ(x.numerator, x.denominator) for x in row] for row in exact]
    reduced, pivots = DomainMatrix(table, (len(table), len(monomials)), QQ).to_sparse().rref()
    rows, told = np.zeros((len(pivots), len(monomials))), []
    for i, row in enumerate(reduced.to_Matrix().tolist()[: len(pivots)]):
        wanted = {m: Fraction(int(x.p), int(x.q)) for m, x in zip(monomials, row, strict=True) if x}
        symbolic = _own_words(wanted, features)
        for m, part in symbolic.items():
            rows[i, monomials.index(m)] = float(insert(part, known))
        told.append(symbolic)
    scales = rows[np.arange(len(pivots)), pivots]
    words = tuple(map(combination_words, told))
    return Combinations(tuple(monomials), rows, tuple(pivots), scales, tuple(told), words)


def _own_words(
    wanted: Mapping[Monomial, Fraction], features: Sequence[Feature]
) -> dict[Monomial, Polynomial]:
    """Coefficients with the names of the known as an equation has them, where one has this combination."""
    if len(wanted) > 1:
        first = next(iter(wanted))
        for feature in features:
            if not all(m in feature.exact and len(feature.symbolic[m]) == 1 for m in wanted):
                continue
            scale = feature.exact[first] / wanted[first]
            if all(feature.exact[m] == scale * x for m, x in wanted.items()):
                return _without_common(_in_order({m: feature.symbolic[m] for m in wanted}))
    return {m: {ONE: x} for m, x in wanted.items()}


def _in_order(symbolic: Mapping[Monomial, Polynomial]) -> dict[Monomial, Polynomial]:
    """Short terms and small numbers first, as one would write them."""

    def key(m: Monomial) -> tuple[int, Fraction]:
        ((numbers, value),) = symbolic[m].items()
        return degree(m) + degree(numbers), abs(value)

    return {m: symbolic[m] for m in sorted(symbolic, key=key)}


def _without_common(symbolic: Mapping[Monomial, Polynomial]) -> dict[Monomial, Polynomial]:
    """Take out what all coefficients share, so that T0*T1 + T0*T2 of a known T0 is T1 + T2."""
    terms = {m: next(iter(part.items())) for m, part in symbolic.items()}
    numbers = [dict(known) for known, _ in terms.values()]
    names = [name for name in numbers[0] if all(name in n for n in numbers)]
    inverse = tuple(sorted((name, -min(n[name] for n in numbers)) for name in names))
    sizes = [value for _, value in terms.values()]
    smallest = min(map(abs, sizes))
    shared = smallest if all((v / smallest).denominator == 1 for v in sizes) else Fraction(1)
    if sizes[0] < 0:
        shared = -shared
    return {m: {times(known, inverse): value / shared} for m, (known, value) in terms.items()}


def combination_words(coefficients: Mapping[Monomial, Polynomial]) -> str:
    """Write Σ coefficient·monomial, a common factor in front.

    Examples
    --------
    >>> one = Fraction(1)
    >>> combination_words({(("b", 1),): {(): one}, (("b", 1), ("delta", 1)): {(): -one}})
    'b*(1 - delta)'
    """
    terms = [(known, m, value) for m, part in coefficients.items() for known, value in part.items()]
    monomials = [dict(m) for m in coefficients]
    common = tuple(
        sorted(
            (name, e)
            for name, e in monomials[0].items()
            if e > 0 and all(m.get(name) == e for m in monomials)
        )
    )
    if len(terms) < 2 or not common:
        return _sum_words(terms)
    inverse = tuple((name, -e) for name, e in common)
    inside = _sum_words([(known, times(m, inverse), value) for known, m, value in terms])
    return f"{_product_words((), common)}*({inside})"


def ratio_words(above: Polynomial, below: Polynomial) -> str:
    """Write one sum over another, common factors cancelled.

    Examples
    --------
    >>> one, ka, kb = Fraction(1), (("ka", 1),), (("kb", 1),)
    >>> ratio_words({(("ka", 1), ("kb", 1)): one}, {ka: one, kb: one})
    'ka*kb/(ka + kb)'
    """
    import sympy

    return str(sympy.factor(sympy.cancel(expression(above) / expression(below))))


def expression(polynomial: Polynomial) -> Any:  # noqa: ANN401 - sympy has no types
    """A polynomial in symbols of sympy."""
    from sympy import Add, Mul, Rational, Symbol

    return Add(
        *(
            Rational(x.numerator, x.denominator) * Mul(*(Symbol(name) ** e for name, e in monomial))
            for monomial, x in polynomial.items()
        )
    )


def _sum_words(terms: Sequence[tuple[Monomial, Monomial, Fraction]]) -> str:
    text = ""
    for known, monomial, value in terms:
        sign = ("-" if value < 0 else "") if not text else (" - " if value < 0 else " + ")
        product = _product_words(known, monomial)
        size = abs(value)
        number = f"{float(size):.6g}"
        if product == "1":
            product = number
        elif number != "1":
            product = f"{number}/{product[2:]}" if product.startswith("1/") else f"{number}*{product}"
        text += sign + product
    return text


def _product_words(known: Monomial, monomial: Monomial) -> str:
    over = [_power_words(n, e) for n, e in (*known, *monomial) if e > 0]
    under = [_power_words(n, -e) for n, e in (*known, *monomial) if e < 0]
    text = "*".join(over) or "1"
    if not under:
        return text
    return f"{text}/{under[0]}" if len(under) == 1 else f"{text}/({'*'.join(under)})"


def _power_words(name: str, exponent: int) -> str:
    return name if exponent == 1 else f"{name}**{exponent}"
