"""Expressions of model files: read by a whitelist into sympy, so that a model file can never run code.

A small tokenizer and a parser of its own: numbers, names, `+ - * / **`, parentheses and the functions of
`FUNCTIONS`. Nothing is ever passed to `eval`, to Python's parser or to `sympify`. Every other name is a plain
`sympy.Symbol`: `E I N S beta gamma lambda zeta` mean what the model says, never sympy's own objects. All
numbers are exact (`Rational`), so that 0.1 + 0.2 is 0.3.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from numbers import Real
from typing import Any, NamedTuple

FUNCTIONS = (
    "sin", "cos", "tan", "exp", "log", "sqrt", "abs", "tanh", "sinh", "cosh", "asin", "acos", "atan", "sign"
)  # fmt: skip
"""Functions of one argument that expressions may use; their names are no names of a model."""

MAX_LENGTH, MAX_DEPTH, MAX_EXPONENT = 10_000, 100, 50
MAX_BITS = 60_000
"""Of all numbers of an expression together; exact arithmetic with more of them would take forever."""
LARGEST = 1e300

_NAME = r"[A-Za-z\u0370-\u03ff][A-Za-z0-9_\u0370-\u03ff]*"
_TOKEN = re.compile(
    r"(?P<blank>[ \t\r\n]+)|(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    rf"|(?P<name>{_NAME})|(?P<sign>\*\*|[-+*/()=])|(?P<other>.)",
    re.DOTALL,
)
_HINTS = {
    "^": "powers are written **",
    ",": "functions take one argument, and numbers have a decimal point",
    **dict.fromkeys("×·", "a product is written *"),
    **dict.fromkeys("−–", "a minus is written -"),
    ":": "a quotient is written /",
    **dict.fromkeys("[{", "parentheses are ( and )"),
    "_": "a name begins with a letter",
}


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


def check_names(kinds: Mapping[str, Iterable[str]], variable: str, meaning: str) -> None:
    """Refuse what is no name, or used twice, but for an output; the variable has a meaning of its own."""
    seen: dict[str, str] = {}
    for kind, name in ((kind, name) for kind, names in kinds.items() for name in names):
        if name == variable:
            raise ValueError(f"{kind} {name}: {name} is {meaning}; choose another name")
        if not isinstance(name, str) or not is_name(name):
            raise ValueError(
                f"{kind} {name!r} is no name; a name begins with a letter, has letters, digits and _, and is "
                "not the name of a function"
            )
        if name in seen and kind != "output":
            other = f"a {seen[name]}" if seen[name] != kind else "given"
            raise ValueError(f"{kind} {name}: {name} is already {other}; choose another name")
        seen[name] = kind


def finite(place: str, value: Any) -> float:  # noqa: ANN401
    """The value, if it is a finite number."""
    if isinstance(value, bool) or not isinstance(value, Real) or not math.isfinite(value):
        raise ValueError(f"{place}: its value must be a finite number, not {value!r}")
    return float(value)


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


class _Token(NamedTuple):
    kind: str
    text: str
    at: int


class _Node(NamedTuple):
    """A part of an expression, and a bound for the size of its numbers."""

    expr: Any
    bits: int = 1

    @property
    def number(self) -> Fraction | None:
        """Its exact value if it has no names, or these have cancelled."""
        return Fraction(int(self.expr.p), int(self.expr.q)) if self.expr.is_Rational else None


class _Parser:
    """Recursive descent; sums and products are collected before sympy sees them, which keeps them quick."""

    def __init__(self, text: str, where: str) -> None:
        self.text, self.where, self.depth = text, where, 0
        if not isinstance(text, str):
            raise ExpressionError(repr(text), 0, "an expression is a text in quotes", where)
        if len(text) > MAX_LENGTH:
            raise self.error(
                MAX_LENGTH, f"an expression has at most {MAX_LENGTH} characters, not {len(text)}"
            )
        every = [_Token(str(match.lastgroup), match[0], match.start()) for match in _TOKEN.finditer(text)]
        for kind, sign, at in every:
            if kind == "other":
                allowed = f"numbers, names, + - * / **, parentheses and the functions {', '.join(FUNCTIONS)}"
                shown = sign if sign.isprintable() else repr(sign)[1:-1]
                hint = _HINTS.get(sign, f"expressions have {allowed}")
                raise self.error(at, f"{shown} cannot stand here: {hint}")
        self.rest = iter([token for token in every if token.kind != "blank"])
        self.next = self.end = _Token("end", "", len(text))
        self.take()

    def error(self, at: int, hint: str) -> ExpressionError:
        return ExpressionError(self.text, at, hint, self.where)

    def take(self) -> _Token:
        token, self.next = self.next, next(self.rest, self.end)
        return token

    def sides(self) -> list[Any]:
        """The expressions between the signs =."""
        sides = [self.chain().expr]
        while self.next.text == "=":
            self.take()
            sides.append(self.chain().expr)
        self.expect("end")
        return sides

    def expect(self, kind: str) -> None:
        """Refuse what stands here instead of this."""
        token = self.next
        if token.text == ")" != kind:
            raise self.error(token.at, "this parenthesis closes nothing")
        if kind not in (token.kind, token.text):
            raise self.error(token.at, f"an operator such as * is missing before {token.text}")

    def chain(self, *, product: bool = False) -> _Node:
        """A sum of products, or a product."""
        import sympy

        at, nodes, sign = self.next.at, list[_Node](), self.end
        join, signs = (sympy.Mul, ("*", "/")) if product else (sympy.Add, ("+", "-"))
        while sign.text in signs or not nodes:
            node = self.unary() if product else self.chain(product=True)
            if sign.text == "/" and node.number == 0:  # such as x/(y - y)
                raise self.error(sign.at, "division by zero")
            if sign.text in ("-", "/"):
                node = node._replace(expr=-node.expr if sign.text == "-" else 1 / node.expr)
            nodes.append(node)
            sign = self.take() if self.next.text in signs else self.end
        exprs, bits = zip(*nodes, strict=True)
        return self.node(at, lambda: join(*exprs), sum(bits)) if len(nodes) > 1 else nodes[0]

    def unary(self) -> _Node:
        """A power, perhaps with a sign; all that is nested passes here."""
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise self.error(self.next.at, f"the expression is nested deeper than {MAX_DEPTH}")
        if self.next.text in ("+", "-"):
            minus = self.take().text == "-"
            node = self.unary()
            node = node._replace(expr=-node.expr) if minus else node
        else:
            node = self.power()
        self.depth -= 1
        return node

    def power(self) -> _Node:
        import sympy

        base = self.atom()
        if self.next.text != "**":
            return base
        at, exponent = self.take().at, self.unary()
        x, n = base.number, exponent.number
        if n is not None and abs(n) > MAX_EXPONENT:
            raise self.error(at, f"an exponent is at most {MAX_EXPONENT} in size")
        if x == 0 and n is not None and n < 0:
            raise self.error(at, "division by zero")
        if x is not None and n is not None and n.denominator > 1:
            return self.node(at, lambda: math.pow(x, n))
        bits = base.bits * (1 if n is None else max(1, math.ceil(abs(n)))) + exponent.bits
        return self.node(at, lambda: sympy.Pow(base.expr, exponent.expr), bits)

    def atom(self) -> _Node:
        import sympy

        (kind, text, at), after = self.take(), self.next
        if text == "(":
            node = self.chain()
            if self.next.kind == "end":
                raise self.error(at, "this parenthesis is never closed")
            self.expect(")")
            self.take()
            return node
        if kind in ("end", "sign"):
            here = f"before {text}" if text else "where the expression ends here"
            raise self.error(at, f"a name, a number or ( is expected {here}")
        if kind == "number":
            if after.kind in ("name", "number") and after.at == at + len(text):
                raise self.error(after.at, f"a product is written with *: {text}*{after.text}")
            size, above = float(text), re.search("[1-9]", re.split("[eE]", text)[0])
            exact = len(text) <= 400 and size <= LARGEST and (size >= 1 / LARGEST or not above)
            return self.node(at, lambda: Fraction(text) if exact else Fraction(LARGEST) ** 2)
        if text in FUNCTIONS:
            if after.text != "(":
                raise self.error(at, f"{text} is a function: {text}(…); choose another name for a quantity")
            return self.function(text, self.atom(), at)
        if after.text == "(":
            near = [f for f in FUNCTIONS if f.startswith(text.casefold()[:3])]
            meant = f"did you mean {near[0]}? " if near else ""
            functions = f"{meant}functions are {', '.join(FUNCTIONS)}"
            raise self.error(at, f"{text} is no function ({functions}); a product is written *")
        return _Node(sympy.Symbol(text))

    def function(self, name: str, argument: _Node, at: int) -> _Node:
        import sympy

        x = argument.number
        if x is not None and name in ("abs", "sign"):
            return self.node(at, lambda: abs(x) if name == "abs" else Fraction((x > 0) - (x < 0)))
        if x is not None:
            return self.node(at, lambda: getattr(math, name)(x))
        called = getattr(sympy, "Abs" if name == "abs" else name)
        # unevaluated: sympy's simplifications may search for long
        options = {} if name == "sqrt" else {"evaluate": False}
        return self.node(at, lambda: called(argument.expr, **options), argument.bits)

    def node(self, at: int, build: Callable[[], Any], bits: int = 1) -> _Node:
        """What is built once its size is known to be allowed; a number must be real, and in bounds."""
        import sympy

        if bits > MAX_BITS:
            raise self.error(at, "this expression is too large; write it in parts or with smaller powers")
        try:
            value = build()
            value = Fraction(repr(value)) if isinstance(value, float) else value  # 0.01**0.5 is 1/10
        except (ValueError, OverflowError):
            raise self.error(at, "this is no finite real number") from None
        node = _Node(
            sympy.Rational(*value.as_integer_ratio()) if isinstance(value, Fraction) else value, bits
        )
        number = node.number
        if number is None:
            return node
        if number and not 1 / Fraction(LARGEST) <= abs(number) <= Fraction(LARGEST):
            least = f"{1 / LARGEST:g} or 0"
            raise self.error(at, f"a number is at most {LARGEST:g} in size, and at least {least}")
        return node._replace(bits=number.numerator.bit_length() + number.denominator.bit_length())
