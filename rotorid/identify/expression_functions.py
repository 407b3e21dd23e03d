"""Expressions of a model as quick functions: vectorised over samples, or for one point."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache, cached_property
from typing import Any

import numpy as np

from rotorid.base.arrays import FloatArray

Expression = Any
"""Of sympy, which has no types."""


@cache
def _real_functions() -> tuple[Any, Any]:
    """|x| and sign(x) of real numbers, with derivatives that stay numbers (sympy's own do not)."""
    import sympy

    class RealSign(sympy.Function):  # type: ignore[misc, unused-ignore]
        nargs = 1

        def fdiff(self, argindex: int = 1) -> Any:  # noqa: ANN401
            return sympy.Integer(0)

    class RealAbs(sympy.Function):  # type: ignore[misc, unused-ignore]
        nargs = 1

        def fdiff(self, argindex: int = 1) -> Any:  # noqa: ANN401
            return RealSign(self.args[0])

    return RealAbs, RealSign


def real(expr: Expression) -> Expression:
    """The expression with |x| and sign(x) that can be differentiated for real x."""
    import sympy

    real_abs, real_sign = _real_functions()
    return expr.replace(sympy.Abs, real_abs).replace(sympy.sign, real_sign)


def usual(expr: Expression) -> Expression:
    """The expression with sympy's own |x| and sign(x), to be read."""
    import sympy

    real_abs, real_sign = _real_functions()
    return expr.replace(real_abs, sympy.Abs).replace(real_sign, sympy.sign)


def signs(expr: Expression) -> set[Expression]:
    """Its parts sign(…)."""
    return set(expr.atoms(_real_functions()[1]))


def jacobian(exprs: Sequence[Expression], by: Sequence[Expression]) -> list[Expression]:
    """Each expression, and behind it its derivatives by these symbols."""
    return [part for e in exprs for part in (e, *(e.diff(s) if e.has(s) else 0 for s in by))]


class Compiled:
    """Expressions, flat in C order of `shape`, as one array-valued function of the symbols."""

    def __init__(self, symbols: Sequence[Any], exprs: Sequence[Expression], shape: tuple[int, ...]) -> None:
        self.shape, self.size = shape, math.prod(shape)
        self.places = np.array([i for i, e in enumerate(exprs) if e != 0], dtype=np.intp)
        # plain names for all quantities: a model may call one "lambda" or like a function of numpy
        self._symbols = {symbol: f"v{i}" for i, symbol in enumerate(symbols)}
        self._exprs = [exprs[i] for i in self.places]

    def many(self, batch: tuple[int, ...], arguments: Sequence[Any]) -> FloatArray:
        """Values at many points: arguments of shape `batch` or numbers; the result is batch + shape."""
        out = np.zeros((*batch, self.size))
        with np.errstate(all="ignore"):
            for place, value in zip(self.places, self.vector(*arguments), strict=True):
                out[..., place] = value
        return out.reshape(*batch, *self.shape)

    def one(self, arguments: Sequence[float]) -> FloatArray:
        """Value at one point, quickly; NaN or ±inf where an expression has no finite real value."""
        try:
            values = self._scalar(*arguments)
            if len(self.places) == self.size:
                return np.array(values, dtype=float).reshape(self.shape)
            out = np.zeros(self.size)
            out[self.places] = values
        except (ValueError, OverflowError, ZeroDivisionError, TypeError):  # TypeError: a complex power
            return self.many((), [np.float64(value) for value in arguments])
        return out.reshape(self.shape)

    @cached_property
    def vector(self) -> Callable[..., Any]:
        """Values of those that are not zero, at `places`, each for numbers or arrays of one shape."""
        return self._lambdified("numpy", {"RealAbs": np.abs, "RealSign": np.sign})

    @cached_property
    def _scalar(self) -> Callable[..., Any]:
        return self._lambdified("math", {"RealAbs": abs, "RealSign": lambda x: float((x > 0) - (x < 0))})

    def _lambdified(self, module: str, more: dict[str, Any]) -> Callable[..., Any]:
        import sympy

        plain = {symbol: sympy.Symbol(name) for symbol, name in self._symbols.items()}
        made: Callable[..., Any] = sympy.lambdify(
            list(plain.values()), [e.xreplace(plain) for e in self._exprs], modules=[more, module], cse=True
        )
        return made
