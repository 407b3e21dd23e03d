"""Reading operator equations: texts in p = d/dt become sums of c · Π θ^e · p^k · signal.

Left minus right over the common denominator is a polynomial with exact coefficients. A denominator of one
term stays, as negative exponents, so that 1/p**2 or 1/k needs no multiplying out; one of several terms is
multiplied out but for powers that all of them share, scaled so that its lowest term has the coefficient 1.
A fractional power of a parameter, such as sqrt(k), has a fraction as its exponent: one more unknown of the
regression, and k ≥ 0. Any other function of parameters, such as exp(-a), is a parameter of that name.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence, Set
from fractions import Fraction

import numpy as np

from rotorid.base.choices import did_you_mean
from rotorid.identify.combinations import (
    CONSTANT,
    NAME,
    Expression,
    Feature,
    Monomial,
    P,
    Polynomial,
    degree,
    exact_number,
    insert,
    times,
)
from rotorid.identify.expressions import check_names, finite, names, parse_equation
from rotorid.identify.operator_model import HarmonicModel

MAX_TERMS = 20_000


def harmonic_model(
    equations: Sequence[str],
    *,
    known: Mapping[str, float] | None = None,
    estimate: Sequence[str],
    inputs: Sequence[str] | None = None,
    varying: Sequence[str] = (),
) -> HarmonicModel:
    """Read an operator model.

    Parameters
    ----------
    equations
        "left = right" in p = d/dt, known names, parameters and signals, such as "(m*p**2 + b*p + c)*X = F".
        Every name that is neither p, known nor to be estimated is a signal, but for one that stands only as a
        factor of signals: that is varying. A term without a signal has amplitude 1. Denominators of several
        terms are multiplied out.
    known
        Numbers by name.
    estimate
        Names of the parameters to be estimated; they may have fractional powers, such as sqrt(k). Another
        function of them, such as exp(-a), is estimated as a parameter of that name, and what stands in it
        is not solved for.
    inputs
        Signals that excite. Default: those that stand only on right sides.
    varying
        Further known quantities that change from row to row, [S] (4), such as a speed.

    Raises
    ------
    ValueError
        For equations that cannot be read, are not linear in the signals or not rational in p and powers of
        parameters; parameters that do not occur, names given twice.

    Examples
    --------
    >>> model = harmonic_model(["(m*p**2 + b*p + c)*X = F"], known={"m": 10.0}, estimate=["c", "b"])
    >>> model.outputs, model.inputs
    (('X',), ('F',))
    """
    texts = (equations,) if isinstance(equations, str) else tuple(equations)
    if not texts:
        raise ValueError("the model has no equations")
    if not estimate:
        raise ValueError("no parameter is to be estimated: name at least one")
    numbers = {name: finite(name, value) for name, value in (known or {}).items()}
    check_names({"parameter": estimate, "known value": numbers}, P, "d/dt")
    sides = [parse_equation(text, where=f"equation {i + 1}") for i, text in enumerate(texts)]
    left, right = ({n for side in sides for n in names(side[i])} for i in (0, 1))
    others = sorted((left | right) - {P, *numbers, *estimate})
    exact, outer = {name: exact_number(value) for name, value in numbers.items()}, {*others}
    polynomials, features, i = list[tuple[Polynomial, frozenset[str]]](), list[Feature](), 0
    try:
        for i in range(len(sides)):
            polynomials.append(multiplied_out(sides[i][0] - sides[i][1], exact, estimate))
        changing = _row_by_row([terms for terms, _ in polynomials], others, inputs or (), varying)
        for i, (terms, below) in enumerate(polynomials):
            if lost := sorted(below & outer - changing):
                raise ValueError(f"it is not linear in the signals: {lost[0]} stands in a denominator")
            features += _split(i, terms, exact, outer - changing, changing)
            if not any(f.signal for f in features if f.equation == i):
                raise ValueError(
                    "it contains no signal; names that are neither known nor estimated are signals"
                )
    except ValueError as problem:
        raise ValueError(f"equation {i + 1}, '{texts[i]}': {problem}") from None
    used = {f.signal for f in features}
    signals = tuple(dict.fromkeys(n for text in texts for n in NAME.findall(text) if n in used))
    occurs = {name for f in features for m in f.exact for name, _ in m}
    functions = sorted(occurs - {*estimate})
    inside = {name for words in functions for name in NAME.findall(words)}
    for name in (name for name in estimate if name not in occurs | inside):
        if name in left | right:
            raise ValueError(
                f"the parameter {name} cancels out of the equations: nothing can be said about it"
            )
        raise ValueError(
            f"the parameter {name} is to be estimated but stands in no equation{did_you_mean(name, others)}"
        )
    parameters = (*(name for name in estimate if name in occurs), *functions)
    chosen = tuple(inputs) if inputs is not None else tuple(n for n in signals if n not in left)
    if strange := [name for name in chosen if name not in signals]:
        raise ValueError(
            f"the input {strange[0]} is no signal of the equations; signals are {', '.join(signals)}"
        )
    outputs = tuple(name for name in signals if name not in chosen)
    if not outputs:
        raise ValueError(f"all signals ({', '.join(signals)}) are inputs: there is nothing to measure")
    ordered = tuple(name for name in others if name in changing)
    return HarmonicModel(texts, parameters, numbers, signals, chosen, outputs, tuple(features), ordered)


def multiplied_out(
    expression: Expression, known: Mapping[str, Fraction], estimate: Sequence[str] = ()
) -> tuple[Polynomial, frozenset[str]]:
    """The numerator of an expression over its common denominator, and the names in denominators of sums.

    Raises
    ------
    ValueError
        With the reason, for whatever is not rational in other names than those to estimate, and for
        expansions that are too long.
    """
    from sympy import QQ, Dummy, Function, Pow, Symbol, fraction, nan, oo, ring, together, zoo

    whole = _without_functions(expression, known, estimate)
    powers, roots = [e for e in whole.atoms(Pow) if e.exp.is_Rational], dict[str, int]()
    for name in estimate:
        x = Symbol(name)
        if (root := math.lcm(1, *(int(e.exp.q) for e in powers if e.base.has(x)))) > 1:
            inner = Dummy(name, positive=True)
            roots[name], whole = root, whole.subs(x, inner**root)
    if odd := [e for e in whole.atoms(Function, Pow) if not (e.is_Pow and e.exp.is_Integer)]:
        raise ValueError(
            f"'{min(odd, key=str)}' is neither a polynomial nor a fraction of polynomials in p and the "
            "signals, nor a function of parameters"
        )
    top, bottom = fraction(together(whole))
    if max(_terms(top), _terms(bottom)) > MAX_TERMS:
        raise ValueError(f"multiplied out, it has more than {MAX_TERMS} terms")
    symbols = sorted(top.free_symbols | bottom.free_symbols, key=str)
    R = ring(symbols, QQ)[0]

    def terms(part: Expression) -> Polynomial:
        polynomial: Polynomial = {}
        for exponents, value in R.from_expr(part).terms():
            each = zip(symbols, exponents, strict=True)
            monomial = tuple((s.name, Fraction(e, roots.get(s.name, 1))) for s, e in each if e)
            polynomial[tuple(sorted(monomial))] = Fraction(int(value.numerator), int(value.denominator))
        return polynomial

    if top.has(oo, nan, zoo) or not (below := terms(bottom)):
        raise ValueError("it divides by zero")
    shared = {n: min(dict(m).get(n, 0) for m in below) for m in below for n, _ in m}
    shift = tuple((n, -e) for n, e in shared.items() if e)
    for name, _ in shift:
        if name in known and not known[name]:
            raise ValueError(f"it divides by {name}, which is 0")
    scale = below[min(below, key=lambda m: (degree(m), m))]
    left = frozenset(n for m in below for n, _ in times(m, shift))
    return {times(m, shift): x / scale for m, x in terms(top).items()}, left


def _terms(part: Expression) -> int:
    """Bound for the number of terms of a polynomial when it is multiplied out."""
    if part.is_Pow:
        n = int(part.exp)
        return math.comb(_terms(part.base) + n - 1, n)
    each = map(_terms, part.args)
    return sum(each) if part.is_Add else math.prod(each)


def _without_functions(
    whole: Expression, known: Mapping[str, Fraction], estimate: Sequence[str]
) -> Expression:
    """Functions of known names as numbers, those of parameters as symbols of their text, but for roots."""
    from sympy import Symbol

    inside = {*known, *estimate}

    def numbers(part: Expression) -> bool:
        return all(s.name in known for s in part.free_symbols)

    def function(part: Expression) -> bool:
        if not part.is_Pow or numbers(part):
            plain = part.is_Pow and part.exp.is_Integer and (part.exp > 0 or part.base.is_Symbol)
        else:  # a fractional power of a product
            plain = part.exp.is_Rational and (part.exp.is_Integer or not part.base.is_Add)
        return (
            (part.is_Function or part.is_Pow) and not plain and {s.name for s in part.free_symbols} <= inside
        )

    def replaced(part: Expression) -> Expression:
        if numbers(part):
            return _number(part, known)
        inside.add(str(part))  # which may stand in another
        return Symbol(str(part))

    return whole.replace(function, replaced)


def _number(part: Expression, known: Mapping[str, Fraction]) -> Expression:
    """A function of known names as the number that it is, such as sqrt(2*k)."""
    from sympy import Rational

    value = complex(part.subs({s: float(known[s.name]) for s in part.free_symbols}).evalf())
    if part.is_Pow and part.exp.is_negative and (not value or not np.isfinite(value)):
        raise ValueError("it divides by zero")
    if not np.isfinite(value) or abs(value.imag) > 1e-12 * abs(value):
        raise ValueError(f"'{part}' is no finite real number for the known values")
    exact = exact_number(value.real)
    return Rational(exact.numerator, exact.denominator)


def _split(
    equation: int,
    polynomial: Polynomial,
    known: Mapping[str, Fraction],
    signals: Set[str],
    varying: Set[str],
) -> list[Feature]:
    """Sort an equation's terms by p^k · signal; ValueError where it is not linear in the signals."""
    symbolic: dict[tuple[int, str, Monomial], dict[Monomial, Polynomial]] = {}
    for monomial, value in polynomial.items():
        shown = [(n, e) for n, e in monomial if n in signals]
        if len(shown) > 1 or any(e != 1 for _, e in shown):
            term = "*".join(f"{n}**{e}" if e != 1 else n for n, e in monomial if n in signals | varying)
            raise ValueError(
                f"it is not linear in the signals: it contains {term} (name a quantity that is known "
                f"in each row under varying)"
            )
        factors, numbers = (tuple(x for x in monomial if x[0] in group) for group in (varying, known))
        rest = tuple(x for x in monomial if x not in (*shown, *factors, *numbers) and x[0] != P)
        place = int(dict(monomial).get(P, 0)), shown[0][0] if shown else CONSTANT, factors
        symbolic.setdefault(place, {}).setdefault(rest, {})[numbers] = value
    features = []
    for (k, signal, factors), parts in sorted(symbolic.items()):
        exact = {m: x for m, part in parts.items() if (x := insert(part, known))}
        if exact:
            features.append(Feature(equation, k, signal, exact, {m: parts[m] for m in exact}, factors))
    return features


def _row_by_row(
    polynomials: Sequence[Polynomial], others: Sequence[str], inputs: Sequence[str], stated: Sequence[str]
) -> frozenset[str]:
    """Names that stand only beside a signal, as factors of it: it stands alone somewhere, they do not."""
    terms = [{n: e for n, e in m if n in others} for polynomial in polynomials for m in polynomial]
    alone = {n for term in terms if len(term) == 1 for n, e in term.items() if e == 1} | set(inputs)
    alone -= set(stated)
    beside = {n for term in terms if len(alone.intersection(term)) == 1 for n in set(term) - alone}
    return frozenset(beside | set(stated))
