"""Operator equations without the amplitudes that are not measured, in exact arithmetic."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from decimal import Context, Decimal
from fractions import Fraction

from rotorid.expressions import parse_equation

Monomial = tuple[tuple[str, int], ...]
Coefficient = dict[int, Fraction]
"""Σ value · p^power."""
Row = dict[Monomial, Coefficient]
"""An equation Σ coefficient · product of names = 0."""

DIGITS = Context(prec=25)


def eliminated(
    equations: Sequence[str], own: Mapping[str, int], known: Mapping[str, float], parameters: Sequence[str]
) -> tuple[str, ...]:
    """Equations in which amplitudes that are not measured do not stand any more.

    Of A_uu U + A_um X = F_u and A_mu U + A_mm X = F_m remains

        det(A_uu) (A_mm X − F_m) − A_mu adj(A_uu) (A_um X − F_u) = 0,

    divided by the first coefficient of det(A_uu): where U are supports without mass, that is the balance of
    forces at the masses times a factor near 1. Bareiss' elimination keeps polynomials in p polynomials; only
    the result is rounded, to 25 digits.

    Parameters
    ----------
    equations
        "left = right" in p = d/dt.
    own
        {amplitude that is not measured: number of the equation that goes with it}. One whose own equation has
        parameters as factors of such amplitudes stays, and so do all where A_uu is singular.
    known
        Numbers by name.
    parameters
        Names that are to be estimated.
    """
    if not own:
        return tuple(equations)
    from rotorid.harmonic.polynomial import times

    try:
        rows = [_row(text, known) for text in equations]
    except (ValueError, ZeroDivisionError):
        return tuple(equations)  # harmonic_model says what is wrong
    for monomial in (m for row in rows for m in row):
        there = [e for name, e in monomial if name in own]
        others = [name for name, _ in monomial if name not in own and name not in parameters]
        if there and (there != [1] or others):
            return tuple(equations)  # not linear: harmonic_model says so
    unseen = [z for z in own if all(len(m) == 1 for m in rows[own[z]] if any(n in own for n, _ in m))]
    if not unseen:
        return tuple(equations)
    first = [own[z] for z in unseen]
    touched = {i for i, row in enumerate(rows) if any(n in unseen for m in row for n, _ in m)}
    table = {i: rows[i] for i in sorted(touched | set(first))}
    before: Coefficient = {0: Fraction(1)}
    open_ = list(first)
    for z in unseen:
        place: Monomial = ((z, 1),)
        pivot_row = next((i for i in open_ if table[i].get(place)), None)
        if pivot_row is None:
            return tuple(equations)
        open_.remove(pivot_row)
        top = table.pop(pivot_row)
        pivot = top[place]
        for i, row in table.items():
            new: Row = {}
            for monomial, value in row.items():
                _add(new, monomial, _multiply(pivot, value), 1)
                if any(name == z for name, _ in monomial):
                    factor = tuple(item for item in monomial if item[0] != z)
                    for other, part in top.items():
                        _add(new, times(factor, other), _multiply(value, part), -1)
            table[i] = {m: _divide(value, before) for m, value in new.items() if value}
        before = pivot
    scale = before[min(before)]
    words = re.findall(r"[^\W\d]\w*", " ".join(equations))
    order = {name: i for i, name in reversed(list(enumerate(words))) if name not in parameters}
    rest = [i for i in range(len(equations)) if i not in first]
    return tuple(_text(table[i], scale, order) if i in table else equations[i] for i in rest)


def _row(text: str, known: Mapping[str, float]) -> Row:
    from rotorid.harmonic.polynomial import add, from_expression

    left, right = (from_expression(side, lambda part: None) for side in parse_equation(text))
    bottom = left.bottom | right.bottom
    row: Row = {}
    for monomial, value in add(left.over(bottom), right.over(bottom), -1).items():
        power, rest, number = 0, [], value
        for name, exponent in monomial:
            if name == "p":
                power = exponent
            elif name in known:
                number *= Fraction(repr(float(known[name]))) ** exponent
            else:
                rest.append((name, exponent))
        _add(row, tuple(rest), {power: number}, 1)
    return {m: c for m, c in row.items() if c}


def _add(row: Row, monomial: Monomial, value: Coefficient, sign: int) -> None:
    own = row.setdefault(monomial, {})
    for power, x in value.items():
        total = own.get(power, Fraction(0)) + sign * x
        if total:
            own[power] = total
        else:
            own.pop(power, None)


def _multiply(a: Coefficient, b: Coefficient) -> Coefficient:
    out: Coefficient = {}
    for i, x in a.items():
        for j, y in b.items():
            out[i + j] = out.get(i + j, Fraction(0)) + x * y
    return {k: x for k, x in out.items() if x}


def _divide(a: Coefficient, b: Coefficient) -> Coefficient:
    """The quotient of polynomials that divide without rest."""
    rest, out = dict(a), {}
    lead = max(b)
    while rest:
        power = max(rest)
        factor = rest[power] / b[lead]
        out[power - lead] = factor
        for k, x in b.items():
            value = rest.get(k + power - lead, Fraction(0)) - factor * x
            if value:
                rest[k + power - lead] = value
            else:
                rest.pop(k + power - lead, None)
    return out


def _text(row: Row, scale: Fraction, order: Mapping[str, int]) -> str:
    """The equation, amplitudes in the order in which the equations first have them."""
    terms = []
    place = {m: max((order.get(name, -1) for name, _ in m), default=-1) for m in row}
    for monomial, value in sorted(row.items(), key=lambda item: place[item[0]]):
        sums = " + ".join(f"({_digits(x / scale)}){_power(k)}" for k, x in sorted(value.items()))
        names = "".join(f"*{name}**({e})" if e != 1 else f"*{name}" for name, e in monomial)
        terms.append(f"({sums}){names}")
    return f"{' + '.join(terms)} = 0"


def _power(k: int) -> str:
    return "" if not k else f"*p**{k}" if k > 0 else f"/p**{-k}"


def _digits(value: Fraction) -> str:
    return str(DIGITS.divide(Decimal(value.numerator), Decimal(value.denominator)))
