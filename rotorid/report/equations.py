"""Equations of a result as a textbook writes them, in symbols and in numbers: text and JSON.

Sympy sorts the factors of a product by name: a name that begins with `BEHIND` comes last, as ω and the
amplitudes do in a book. No text shows that letter.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rotorid.base.answer import COLUMNS, Answer
from rotorid.base.arrays import FloatArray
from rotorid.base.json import plain
from rotorid.base.tables import Column, text
from rotorid.base.text import cut

Expression = Any
"""Of sympy, which has no types."""
Terms = Sequence[tuple[Expression, Expression]]
"""A sum of products: coefficient and factor of each."""

BEHIND = "\ue000"
_LONGEST = 20
_RAISED = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True, eq=False)
class Row:
    """One equation in symbols, left = right; its name says which."""

    name: str
    left: Terms
    right: Terms

    def written(self) -> str:
        """As a line of text."""
        return " = ".join(map(_sum, (self.left, self.right)))


@dataclass(frozen=True, eq=False)
class Equations:
    """What a command solved.

    Attributes
    ----------
    title
        What they are, and where the book has them.
    symbolic
        In symbols, before any weighting.
    names
        Of the matrix, the unknowns and the right side.
    rows, columns
        Words for each row of the matrix (m,) and for each unknown (n,).
    matrix, right
        Exactly as they were solved, (m, n) and (m,); m is 0 where the solution follows from no such rows.
    solution
        (n,), NaN where the data do not determine it; empty: without data.
    notes
        Units, weighting, and what else is to be known, in words.
    """

    title: str
    symbolic: Sequence[Row]
    names: tuple[str, str, str]
    rows: Sequence[str]
    columns: Sequence[str]
    matrix: FloatArray
    right: FloatArray
    solution: FloatArray
    notes: Sequence[str] = ()

    def to_dict(self) -> dict[str, Any]:
        """As JSON types."""
        symbols = [{"row": row.name, "text": row.written()} for row in self.symbolic]
        numbers = {name: getattr(self, name) for name in ("rows", "columns", "matrix", "right", "solution")}
        return plain({"title": self.title, "symbolic": symbols, **numbers, "notes": self.notes})

    def answer(self, result: Answer) -> Answer:
        """In place of a result's answer, whose judgement and remarks stay."""
        symbols = [f"  {row.name}  {row.written()}" for row in self.symbolic]
        # no line ends inside "Re X1": an answer writes this blank as any other
        symbols = [re.sub(r"\b(Re|Im) (?!eq)", "\\1\u00a0", line) for line in symbols]
        parts = ["\n".join([f"{self.title}:", *symbols]), *self._tables(), self._solution()]
        return Answer(result.judgement, "\n\n".join(parts), result.warnings, (*self.notes, *result.notes))

    def _tables(self) -> list[str]:
        """Name of each row, the matrix, the right side; in parts, each with as many columns as fit."""
        if not self.rows:
            return []
        matrix, unknowns, right = self.names
        names = [cut(name, _LONGEST) for name in (*self.columns, f"| {right}")]
        values = (np.column_stack((self.matrix, self.right)) + 0.0).T
        numbers = [Column(*each, "{:.6g}".format) for each in zip(names, values, strict=True)]
        first, wide = Column(f"{matrix} {unknowns} = {right}", self.rows), max(12, *map(len, names))
        each = max((COLUMNS - 4 - max(map(len, self.rows))) // (wide + 2), 1)
        return [text((first, *numbers[k : k + each]), width=COLUMNS) for k in range(0, len(numbers), each)]

    def _solution(self) -> str:
        values = [f" = {x:.6g}" if x == x else " not determined" for x in self.solution]
        values = values or [""] * len(self.columns)
        return f"{self.names[1]}: {', '.join(map(''.join, zip(self.columns, values, strict=True)))}"


def _words(expression: Expression) -> str:
    """As text: `m1·ω²`."""
    from sympy import sstr

    written = sstr(expression).replace(BEHIND, "").replace("Abs(", "abs(")
    written = re.sub(r"\*\*(\d+)(?![\w.])", lambda power: power[1].translate(_RAISED), written)
    return re.sub(r"(?<!\*)\*(?!\*)", "·", written)


def _decimals(expression: Expression) -> Expression:
    """Long fractions as decimals; sympy multiplies a sum out by such a factor."""
    from sympy import Float, Rational, sympify

    whole = sympify(expression)
    return whole.xreplace({q: Float(q, 6) for q in whole.atoms(Rational) if q.q > 100})


def _sum(terms: Terms) -> str:
    """Coefficient times factor, term by term; 0 and 1 are not written."""
    products = []
    for pair in terms:
        parts = [*map(_decimals, pair)]
        if 0 in parts:
            continue
        inside = [one for one in parts if one not in (1, -1)]
        sign = "-" if len([one for one in parts if one == -1]) == 1 else ""
        alone = len(inside) == 1 and not sign
        bare = [alone or not (one.is_Add or (one.is_Mul and one is parts[1])) for one in inside]
        words = (
            _words(one) if plain else f"({_words(one)})" for one, plain in zip(inside, bare, strict=True)
        )
        products.append(sign + ("·".join(words) or "1"))
    return " + ".join(products).replace("+ -", "- ") or "0"
