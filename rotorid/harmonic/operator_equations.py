"""Reading operator equations: texts in p = d/dt, parameters and signals become a model."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from fractions import Fraction
from typing import Any

import numpy as np

from rotorid.harmonic.operator_model import HarmonicModel
from rotorid.harmonic.parameter_combinations import CONSTANT, NAME, Feature, P, exact_number, split_features
from rotorid.harmonic.polynomial import Polynomial, difference


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
        Names of the parameters to be estimated.
    inputs
        Signals that excite. Default: those that stand only on right sides.
    varying
        Further known quantities that change from row to row, [S] (4), such as a speed.

    Raises
    ------
    ValueError
        For equations that cannot be read, are not linear in the signals or not rational in p and parameters,
        or follow from the others; parameters that do not occur, names given twice.

    Examples
    --------
    >>> model = harmonic_model(["(m*p**2 + b*p + c)*X = F"], known={"m": 10.0}, estimate=["c", "b"])
    >>> model.outputs, model.inputs
    (('X',), ('F',))
    """
    from rotorid.identify.expressions import names, parse_equation

    if isinstance(equations, str):
        equations = [equations]
    if not equations:
        raise ValueError("the model has no equations")
    numbers = {name: _finite(name, value) for name, value in (known or {}).items()}
    _check_names(tuple(estimate), numbers)
    sides = [parse_equation(text, where=f"equation {i + 1}") for i, text in enumerate(equations)]
    left, right = ({n for side in sides for n in names(side[i])} for i in (0, 1))
    given = {P, *numbers, *estimate}
    occurring = sorted((left | right) - given)
    for name in estimate:
        if name not in left | right:
            hint = _near(name, occurring)
            raise ValueError(f"the parameter {name} is to be estimated but stands in no equation{hint}")

    exact = {name: exact_number(value) for name, value in numbers.items()}
    features, changing = _all_features(equations, sides, exact, occurring, inputs or (), varying)
    used = {f.signal for f in features} - {CONSTANT}
    signals = tuple(name for name in _by_place(equations, occurring) if name in used)
    if not signals:
        raise ValueError(
            "the equations contain no signal: no name is left that is neither known nor estimated"
        )
    _check_independent(features, len(equations))
    occurs = {name for f in features for m in f.exact for name, _ in m}
    for name in estimate:
        if name not in occurs:
            raise ValueError(
                f"the parameter {name} cancels out of the equations: nothing can be said about it"
            )
    if inputs is None:
        chosen = tuple(name for name in signals if name not in left)
    else:
        chosen = tuple(inputs)
        for name in chosen:
            if name not in signals:
                raise ValueError(
                    f"the input {name} is no signal of the equations; signals are {', '.join(signals)}"
                )
    outputs = tuple(name for name in signals if name not in chosen)
    if not outputs:
        raise ValueError(f"all signals ({', '.join(signals)}) are inputs: there is nothing to measure")
    return HarmonicModel(
        tuple(equations),
        tuple(estimate),
        numbers,
        signals,
        chosen,
        outputs,
        tuple(features),
        tuple(name for name in occurring if name in changing),
    )


def _all_features(
    equations: Sequence[str],
    sides: Sequence[Any],
    known: Mapping[str, Fraction],
    names_: Sequence[str],
    inputs: Sequence[str],
    varying: Sequence[str],
) -> tuple[list[Feature], frozenset[str]]:
    """Features of all equations, and the names of quantities that change from row to row."""
    expanded = []
    for i, (text, side) in enumerate(zip(equations, sides, strict=True)):
        with _named(i, text):
            expanded.append(_expand(side[0], side[1], known))
    changing = _row_by_row([part for part, _ in expanded], names_, inputs, varying)
    features: list[Feature] = []
    for i, (text, (terms, below)) in enumerate(zip(equations, expanded, strict=True)):
        with _named(i, text):
            if lost := sorted(below & set(names_) - changing):
                raise ValueError(f"it is not linear in the signals: {lost[0]} stands in a denominator")
            own = split_features(i, terms, known, frozenset(names_), changing)
            if not any(f.signal for f in own):
                raise ValueError(
                    "it contains no signal; names that are neither known nor estimated are signals"
                )
            features += own
    return features, changing


@contextmanager
def _named(index: int, text: str) -> Iterator[None]:
    """Say in which equation a problem lies."""
    try:
        yield
    except ValueError as problem:
        raise ValueError(f"equation {index + 1}, '{text}': {problem}") from None


def _row_by_row(
    expanded: Sequence[Polynomial], occurring: Sequence[str], inputs: Sequence[str], stated: Sequence[str]
) -> frozenset[str]:
    """Names that stand only beside a signal, as factors of it: it stands alone somewhere, they do not."""
    terms = [{n: e for n, e in m if n in occurring} for part in expanded for m in part]
    alone = {n for term in terms if len(term) == 1 for n, e in term.items() if e == 1} | set(inputs)
    alone -= set(stated)
    found = set(stated)
    for term in terms:
        if len(alone.intersection(term)) == 1:
            found |= set(term) - alone
    return frozenset(found)


def _expand(lhs: Any, rhs: Any, known: Mapping[str, Fraction]) -> tuple[Polynomial, frozenset[str]]:  # noqa: ANN401
    """Left minus right side over the common denominator, and the names in that."""

    def constant(part: Any) -> Fraction | None:  # noqa: ANN401
        if any(symbol.name not in known for symbol in part.free_symbols):
            return None
        value = complex(part.subs({s: float(known[s.name]) for s in part.free_symbols}).evalf())
        if not np.isfinite(value) or abs(value.imag) > 1e-12 * abs(value):
            raise ValueError(f"'{part}' is no finite real number for the known values")
        return exact_number(value.real)

    try:
        terms, below = difference(lhs, rhs, constant)
    except ZeroDivisionError:
        raise ValueError("it divides by zero") from None
    for monomial in terms:
        for name, exponent in monomial:
            if name in known and exponent < 0 and not known[name]:
                raise ValueError(f"it divides by {name}, which is 0")
    return terms, below


def _check_names(estimate: tuple[str, ...], known: Mapping[str, float]) -> None:
    from rotorid.identify.expressions import is_name

    if not estimate:
        raise ValueError("no parameter is to be estimated: name at least one")
    for name in (*estimate, *known):
        if not is_name(name):
            raise ValueError(f"'{name}' cannot be a name: letters, digits and _ only, and no function's name")
        if name == P:
            raise ValueError("p is d/dt: it can be neither known nor estimated")
    for name in estimate:
        if estimate.count(name) > 1:
            raise ValueError(f"the parameter {name} is named twice")
        if name in known:
            raise ValueError(f"{name} is both known and to be estimated")


def _check_independent(features: Sequence[Feature], equations: int) -> None:
    """Raise ValueError for an equation that follows from those before it: its rows would count twice.

    The rank of A(p; θ) at one general point, modulo a large prime.
    """
    from sympy import GF
    from sympy.polys.matrices import DomainMatrix

    names = sorted({name for f in features for m in (*f.exact, f.varying) for name, _ in m} | {P})
    drawn = np.random.default_rng(1).integers(2, 1000, len(names)).tolist()
    point = {name: Fraction(value, 999) for name, value in zip(names, drawn, strict=True)}
    place = {name: i for i, name in enumerate(dict.fromkeys(f.signal for f in features))}
    table = [[Fraction(0)] * equations for _ in place]
    for f in features:
        for monomial, x in f.exact.items():
            term = x * math.prod(point[n] ** e for n, e in (*monomial, *f.varying, (P, f.power)))
            table[place[f.signal]][f.equation] += term
    K = GF(2**61 - 1)
    whole = [[K(x.numerator) / K(x.denominator) for x in row] for row in table]
    _, free = DomainMatrix(whole, (len(place), equations), K).to_sparse().rref()
    for i in range(equations):
        if i not in free:
            raise ValueError(
                f"equation {i + 1} follows from those before it and tells nothing new: leave it out, or its "
                "rows would count twice"
            )


def _finite(name: str, value: float) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not np.isfinite(value):
        raise ValueError(f"the known {name} must be a finite number; got {value!r}")
    return float(value)


def _near(name: str, names: Sequence[str]) -> str:
    found = difflib.get_close_matches(name, names, 1, 0.5)
    return f"; did you mean {found[0]}?" if found else ""


def _by_place(equations: Sequence[str], names: Sequence[str]) -> list[str]:
    """Names in the order in which they first stand in the equations."""
    found = NAME.findall(" ".join(equations))
    place = {name: i for i, name in reversed(list(enumerate(found)))}
    return sorted(names, key=lambda name: place.get(name, len(place)))
