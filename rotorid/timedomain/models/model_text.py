"""Reading the parts of a model: names, numbers, bounds and expressions."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from rotorid import expressions
from rotorid.base.arrays import FloatArray
from rotorid.timedomain.models.compiled import real


class Reader:
    """Reads expressions, puts known numbers in, and keeps the texts."""

    def __init__(self, exact: Mapping[str, Fraction]) -> None:
        self.exact = exact
        self.texts: dict[str, str] = {}

    def __call__(self, text: float | str, where: str, allowed: set[str]) -> Any:  # noqa: ANN401
        """Read one expression that may use the names allowed and the known ones."""
        import sympy

        if not isinstance(text, str):
            if isinstance(text, bool) or not np.isfinite(text):
                raise ValueError(f"{where}: {text} is no finite number and no expression")
            text = repr(float(text))
        self.texts[where] = text
        expr = expressions.parse(text, where=where)
        for name in sorted(expressions.names(expr) - allowed - set(self.exact)):
            near = difflib.get_close_matches(name, [*allowed, *self.exact], n=1)
            hint = f"did you mean {near[0]}?" if near else "put it under estimate, known or inputs"
            if name in ("t",) or where.startswith("initial"):
                hint = f"it may use {', '.join(sorted(allowed | set(self.exact))) or 'numbers'}"
            raise ValueError(f"{where}: {expressions.quote(text)}: {name} is not defined here; {hint}")
        put = {sympy.Symbol(n): sympy.Rational(v.numerator, v.denominator) for n, v in self.exact.items()}
        value = real(expr.subs(put))
        if value.has(sympy.zoo, sympy.nan, sympy.oo, sympy.I):
            raise ValueError(f"{where}: {expressions.quote(text)} has no finite real value with known values")
        return value


def check_names(groups: Mapping[str, Sequence[str] | Mapping[str, Any]]) -> None:
    """Refuse names that are none, or used twice; `groups` by kind."""
    seen: dict[str, str] = {}
    for kind, names in groups.items():
        for name in names:
            if name == "t":
                raise ValueError(f"{kind} t: t is the time; choose another name")
            if not isinstance(name, str) or not expressions.is_name(name):
                raise ValueError(
                    f"{kind} {name!r} is no name; a name begins with a letter, has letters, digits and _, "
                    "and is not the name of a function"
                )
            if name in seen:
                other = f"a {seen[name]}" if seen[name] != kind else "given"
                raise ValueError(f"{kind} {name}: {name} is already {other}; choose another name")
            seen[name] = kind


def finite_numbers(values: Mapping[str, float], kind: str, what: str) -> FloatArray:
    """Finite numbers as an array."""
    for name, value in values.items():
        number: object = value
        if isinstance(number, (bool, str)) or not np.isscalar(number) or not np.isfinite(value):
            raise ValueError(f"{kind} {name}: the {what} must be a finite number, not {value!r}")
    return np.array([float(v) for v in values.values()])


def bound_table(bounds: Mapping[str, tuple[float, float]], estimate: Mapping[str, float]) -> FloatArray:
    """Bounds of all parameters, (n_p, 2)."""
    table = np.tile([-np.inf, np.inf], (len(estimate), 1))
    place = {name: i for i, name in enumerate(estimate)}
    for name, (low, high) in bounds.items():
        if name not in place:
            raise ValueError(f"bounds: {name} is no parameter; parameters are {', '.join(estimate)}")
        if not low < high:
            raise ValueError(f"bounds of {name}: the lower one, {low:g}, must be below the upper, {high:g}")
        if not low <= estimate[name] <= high:
            raise ValueError(
                f"bounds of {name}: the starting value {estimate[name]:g} is outside {low:g} … {high:g}"
            )
        table[place[name]] = low, high
    return table
