"""Expressions of model files: read by a whitelist into sympy, so that a model file can never run code.

A small tokenizer and a parser of its own: numbers, names, `+ - * / **`, parentheses and the functions of
`FUNCTIONS`. Nothing is ever passed to `eval`, to Python's parser or to `sympify`. Every other name is a plain
`sympy.Symbol`: `E I N S beta gamma lambda zeta` mean what the model says, never sympy's own objects. All
numbers are exact (`Rational`), so that 0.1 + 0.2 is 0.3.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

FUNCTIONS = (
    "sin", "cos", "tan", "exp", "log", "sqrt", "abs", "tanh", "sinh", "cosh", "asin", "acos", "atan", "sign"
)  # fmt: skip
"""Functions of one argument that expressions may use; their names are no names of a model."""

MAX_LENGTH = 10_000
MAX_DEPTH = 100
MAX_EXPONENT = 50
MAX_DEGREE = 1000
MAX_TERMS = 20_000
"""Of an expression multiplied out."""
MAX_BITS = 60_000
"""Of all numbers of an expression together; exact arithmetic with more of them would take forever."""
LARGEST = 1e300

_NAME = r"[A-Za-z\u0370-\u03ff][A-Za-z0-9_\u0370-\u03ff]*"
_TOKEN = re.compile(
    rf"(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)|(?P<name>{_NAME})|(?P<sign>\*\*|[-+*/()=])"
)
_BLANK = re.compile(r"[ \t\r\n]+")
_HINTS = {
    "^": "powers are written **",
    ",": "functions take one argument, and numbers have a decimal point",
    "×": "a product is written *",
    "·": "a product is written *",
    "−": "a minus is written -",
    "–": "a minus is written -",
    ":": "a quotient is written /",
    "[": "parentheses are ( and )",
    "{": "parentheses are ( and )",
    "_": "a name begins with a letter",
}
_ALLOWED = f"numbers, names, + - * / **, parentheses and the functions {', '.join(FUNCTIONS)}"


class ExpressionError(ValueError):
    """An expression that cannot be used.

    Attributes
    ----------
    text
        The whole expression.
    position
        Where in it, counted from 0.
    hint
        What is wrong and what to do.
    """

    def __init__(self, text: str, position: int, hint: str, where: str = "") -> None:
        self.text = text
        self.position = position
        self.hint = hint
        place = f"{where}: " if where else ""
        super().__init__(f"{place}{quote(text, position)}, character {position + 1}: {hint}")


def quote(text: str, position: int = 0, width: int = 60) -> str:
    """The text in quotes, or of a long one what stands around the position."""
    if len(text) <= width:
        return repr(text)
    start = max(0, min(position - width // 2, len(text) - width))
    part = text[start : start + width]
    return repr(f"{'…' if start else ''}{part}{'…' if start + width < len(text) else ''}")


def is_name(text: str) -> bool:
    """Whether a model may use this as a name."""
    return re.fullmatch(_NAME, text) is not None and text not in FUNCTIONS


def parse(text: str, *, where: str = "") -> Any:  # noqa: ANN401  sympy has no types
    """Read one expression.

    Parameters
    ----------
    text
        Such as "(m*p**2 + b*p + c)*X".
    where
        What the text is, for messages ("equation 1").

    Returns
    -------
    sympy.Expr
        With `Symbol`s for all names and exact `Rational`s for all numbers; products are not multiplied out.

    Raises
    ------
    ExpressionError
        For everything that is no such expression, and for those too large to work with: more than 10 000
        characters, nested deeper than 100, numeric exponents above 50.

    Examples
    --------
    >>> parse("0.5*lambda**2 - E")
    -E + lambda**2/2
    """
    sides = _Parser(text, where).sides()
    if len(sides) > 1:
        at = text.index("=")
        raise ExpressionError(text, at, "an expression, without =, is expected here", where)
    return sides[0]


def parse_equation(text: str, *, where: str = "") -> tuple[Any, Any]:
    """Read an equation, "left = right", as two expressions.

    Parameters
    ----------
    text, where
        As in `parse`.

    Raises
    ------
    ExpressionError
        As in `parse`, and where there is not exactly one =.

    Examples
    --------
    >>> parse_equation("m*p**2*X = F")
    (X*m*p**2, F)
    """
    sides = _Parser(text, where).sides()
    if len(sides) != 2:
        hint = "an equation needs one =, such as (m*p**2 + b*p + c)*X = F"
        raise ExpressionError(text, max(0, text.find("=")), hint, where)
    return sides[0], sides[1]


def names(expr: Any) -> frozenset[str]:  # noqa: ANN401  sympy has no types
    """Names in an expression of `parse`.

    Examples
    --------
    >>> sorted(names(parse("T1*p + sin(beta)")))
    ['T1', 'beta', 'p']
    """
    return frozenset(symbol.name for symbol in expr.free_symbols)


@dataclass(frozen=True)
class _Token:
    kind: str
    text: str
    at: int


@dataclass(frozen=True)
class _Node:
    """A part of an expression, and how large it may become.

    `bits` bounds the size of its numbers, `terms` and `degree` those of the sum that it is when multiplied
    out.
    """

    expr: Any
    bits: int = 1
    terms: int = 1
    degree: int = 0

    @property
    def number(self) -> Fraction | None:
        """Its exact value if it has no names, or these have cancelled."""
        return Fraction(int(self.expr.p), int(self.expr.q)) if self.expr.is_Rational else None


class _Parser:
    """Precedence climbing; sums and products are collected before sympy sees them, which keeps them quick."""

    def __init__(self, text: str, where: str) -> None:
        self.text = text
        self.where = where
        self.depth = 0
        self.place = 0
        if not isinstance(text, str):
            raise ExpressionError(repr(text), 0, "an expression is a text in quotes", where)
        if len(text) > MAX_LENGTH:
            raise self.error(
                MAX_LENGTH, f"an expression has at most {MAX_LENGTH} characters, not {len(text)}"
            )
        self.tokens = self.split()

    def error(self, at: int, hint: str) -> ExpressionError:
        return ExpressionError(self.text, at, hint, self.where)

    def split(self) -> list[_Token]:
        tokens: list[_Token] = []
        at = 0
        while at < len(self.text):
            blank = _BLANK.match(self.text, at)
            if blank:
                at = blank.end()
                continue
            found = _TOKEN.match(self.text, at)
            if not found:
                sign = self.text[at]
                shown = sign if sign.isprintable() else repr(sign)[1:-1]
                hint = _HINTS.get(sign, f"expressions have {_ALLOWED}")
                raise self.error(at, f"{shown} cannot stand here: {hint}")
            tokens.append(_Token(str(found.lastgroup), found[0], at))
            at = found.end()
        return [*tokens, _Token("end", "", len(self.text))]

    @property
    def next(self) -> _Token:
        return self.tokens[self.place]

    def take(self) -> _Token:
        token = self.next
        self.place += 1
        return token

    def sides(self) -> list[Any]:
        """The expressions between the signs =."""
        nodes = [self.sum()]
        while self.next.text == "=":
            self.take()
            nodes.append(self.sum())
        token = self.next
        if token.kind != "end":
            raise self.error(token.at, self.unexpected(token))
        return [node.expr for node in nodes]

    def unexpected(self, token: _Token) -> str:
        if token.text == ")":
            return "this parenthesis closes nothing"
        return f"an operator such as * is missing before {token.text}"

    def sum(self) -> _Node:
        import sympy

        signs, nodes, at = [1], [self.product()], self.next.at
        while self.next.text in ("+", "-"):
            signs.append(1 if self.take().text == "+" else -1)
            nodes.append(self.product())
        if len(nodes) == 1:
            return nodes[0]
        return self.node(
            at,
            lambda: sympy.Add(*(sign * node.expr for sign, node in zip(signs, nodes, strict=True))),
            sum(node.bits for node in nodes),
            sum(node.terms for node in nodes),
            max(node.degree for node in nodes),
        )

    def product(self) -> _Node:
        import sympy

        up, nodes, at = [True], [self.unary()], self.next.at
        while self.next.text in ("*", "/"):
            sign = self.take()
            up.append(sign.text == "*")
            nodes.append(self.unary())
            if sign.text == "/" and nodes[-1].number == 0:  # such as x/(y - y)
                raise self.error(sign.at, "division by zero")
        if len(nodes) == 1:
            return nodes[0]
        return self.node(
            at,
            lambda: sympy.Mul(*(n.expr if above else 1 / n.expr for above, n in zip(up, nodes, strict=True))),
            sum(node.bits for node in nodes),
            # what stands in a denominator counts once: it is never multiplied out as a sum
            math.prod(node.terms if above else 1 for above, node in zip(up, nodes, strict=True)),
            sum(node.degree for node in nodes),
        )

    def unary(self) -> _Node:
        sign = self.next
        if sign.text not in ("+", "-"):
            return self.power()
        self.take()
        node = self.deeper(sign, self.unary)
        return node if sign.text == "+" else replace(node, expr=-node.expr)

    def power(self) -> _Node:
        import sympy

        base = self.atom()
        sign = self.next
        if sign.text != "**":
            return base
        self.take()
        exponent = self.deeper(sign, self.unary)
        x, n, whole, terms = base.number, exponent.number, 1, 1
        if n is not None:
            if abs(n) > MAX_EXPONENT:
                raise self.error(sign.at, f"an exponent is at most {MAX_EXPONENT} in size")
            if x is not None:
                return self.constant(self.numeric_power(x, n, sign.at), sign.at)
            whole = max(1, math.ceil(abs(n)))
            if n > 0 and n.denominator == 1:
                terms = math.comb(base.terms + whole - 1, whole)
        return self.node(
            sign.at,
            lambda: sympy.Pow(base.expr, exponent.expr),
            base.bits * whole + exponent.bits,
            terms,
            max(1, base.degree * whole),
        )

    def numeric_power(self, base: Fraction, n: Fraction, at: int) -> Fraction:
        if base == 0 and n < 0:
            raise self.error(at, "division by zero")
        if n.denominator == 1:
            self.limit(at, _bits(base) * (abs(int(n)) or 1), 1, 0)
            return Fraction(base**n)
        if base < 0:
            raise self.error(at, "a fractional power of a negative number is no real number")
        return self.real(lambda: math.pow(base, n), at, "this power")

    def atom(self) -> _Node:
        token = self.take()
        if token.kind == "number":
            return self.number(token)
        if token.kind == "name":
            return self.named(token)
        if token.text == "(":
            return self.deeper(token, lambda: self.enclosed(token))
        if token.kind == "end":
            raise self.error(token.at, "the expression ends here, but a name, a number or ( must follow")
        raise self.error(token.at, f"a name, a number or ( is expected before {token.text}")

    def enclosed(self, opened: _Token) -> _Node:
        node = self.sum()
        if self.next.text != ")":
            if self.next.kind == "end":
                raise self.error(opened.at, "this parenthesis is never closed")
            raise self.error(self.next.at, self.unexpected(self.next))
        self.take()
        return node

    def number(self, token: _Token) -> _Node:
        after = self.next
        if after.kind in ("name", "number") and after.at == token.at + len(token.text):
            hint = f"a product is written with *: {token.text}*{after.text}"
            raise self.error(after.at, hint)
        if len(token.text) > 400 or float(token.text) > LARGEST:
            raise self.error(token.at, f"a number is at most {LARGEST:g}")
        if re.search(r"[eE]-[0-9]{4,}", token.text):
            raise self.error(token.at, f"a number above 0 is at least {1 / LARGEST:g}")
        return self.constant(Fraction(token.text), token.at)

    def named(self, token: _Token) -> _Node:
        name, called = token.text, self.next
        if name in FUNCTIONS:
            if called.text != "(":
                raise self.error(
                    token.at, f"{name} is a function: {name}(…); choose another name for a quantity"
                )
            self.take()
            argument = self.deeper(called, lambda: self.enclosed(called))
            return self.function(name, argument, token.at)
        if called.text == "(":
            near = next((f for f in FUNCTIONS if f.startswith(name.casefold()[:3])), None)
            meant = f"did you mean {near}? " if near else ""
            hint = (
                f"{name} is no function ({meant}functions are {', '.join(FUNCTIONS)}); a product is written *"
            )
            raise self.error(token.at, hint)

        import sympy

        return _Node(sympy.Symbol(name), degree=1)

    def function(self, name: str, argument: _Node, at: int) -> _Node:
        import sympy

        x = argument.number
        if x is not None:
            return self.constant(self.value(name, x, at), at)
        if name == "sqrt":
            return self.node(at, lambda: sympy.sqrt(argument.expr), argument.bits, 1, 1)
        # unevaluated: sympy's simplifications may search for long
        called = getattr(sympy, "Abs" if name == "abs" else name)
        return self.node(at, lambda: called(argument.expr, evaluate=False), argument.bits, 1, 1)

    def value(self, name: str, x: Fraction, at: int) -> Fraction:
        """A function of a number."""
        if name == "abs":
            return abs(x)
        if name == "sign":
            return Fraction((x > 0) - (x < 0))
        return self.real(lambda: getattr(math, name)(x), at, f"{name}({float(x):g})")

    def real(self, compute: Callable[[], float], at: int, what: str) -> Fraction:
        try:
            value = compute()
        except (ValueError, OverflowError):
            value = math.nan
        if not math.isfinite(value):
            raise self.error(at, f"{what} is no finite real number")
        return Fraction(repr(value))  # the shortest decimal: 0.01**0.5 is 1/10

    def constant(self, number: Fraction, at: int) -> _Node:
        import sympy

        bits = _bits(number)
        self.limit(at, bits, 1, 0)
        if number and not 1 / Fraction(LARGEST) <= abs(number) <= Fraction(LARGEST):
            raise self.error(
                at, f"a number is at most {LARGEST:g} in size, and at least {1 / LARGEST:g} or 0"
            )
        return _Node(sympy.Rational(number.numerator, number.denominator), bits)

    def node(self, at: int, build: Callable[[], Any], bits: int, terms: int, degree: int) -> _Node:
        """What is built once its size is known to be allowed."""
        self.limit(at, bits, terms, degree)
        node = _Node(build(), bits, terms, degree)
        number = node.number
        return node if number is None else self.constant(number, at)

    def limit(self, at: int, bits: int, terms: int, degree: int) -> None:
        if terms > MAX_TERMS:
            raise self.error(at, f"multiplied out, this has more than {MAX_TERMS} terms; write it in parts")
        if degree > MAX_DEGREE or bits > MAX_BITS:
            raise self.error(at, "this expression is too large; write it in parts or with smaller powers")

    def deeper(self, token: _Token, inner: Callable[[], _Node]) -> _Node:
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise self.error(token.at, f"the expression is nested deeper than {MAX_DEPTH}")
        node = inner()
        self.depth -= 1
        return node


def _bits(number: Fraction) -> int:
    return number.numerator.bit_length() + number.denominator.bit_length()
