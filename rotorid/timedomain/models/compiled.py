"""Expressions of a model as quick functions: vectorised over samples, or for one point."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np

from rotorid.base.arrays import FloatArray


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


def real(expr: Any) -> Any:  # noqa: ANN401  sympy has no types
    """The expression with |x| and sign(x) that can be differentiated for real x."""
    import sympy

    real_abs, real_sign = _real_functions()
    return expr.replace(sympy.Abs, real_abs).replace(sympy.sign, real_sign)


def usual(expr: Any) -> Any:  # noqa: ANN401
    """The expression with sympy's own |x| and sign(x), to be read."""
    import sympy

    real_abs, real_sign = _real_functions()
    return expr.replace(real_abs, sympy.Abs).replace(real_sign, sympy.sign)


def signs(expr: Any) -> set[Any]:  # noqa: ANN401
    """Its parts sign(…)."""
    return set(expr.atoms(_real_functions()[1]))


def _sign(x: float) -> float:
    return float((x > 0) - (x < 0))


def _lambdify(symbols: Sequence[Any], exprs: Sequence[Any], module: str) -> Callable[..., Any]:
    import sympy

    # plain names for all quantities: a model may call one "lambda" or like a function of numpy
    plain = {symbol: sympy.Symbol(f"v{i}") for i, symbol in enumerate(symbols)}
    scalar = module == "math"
    own = {"RealAbs": abs if scalar else np.abs, "RealSign": _sign if scalar else np.sign}
    made: Callable[..., Any] = sympy.lambdify(
        list(plain.values()), [e.xreplace(plain) for e in exprs], modules=[own, module], cse=True
    )
    return made


class Compiled:
    """Expressions as one array-valued function.

    Parameters
    ----------
    symbols
        Arguments, in their order.
    exprs
        Flat, in C order of `shape`.
    shape
        Of the value at one point.
    """

    def __init__(self, symbols: Sequence[Any], exprs: Sequence[Any], shape: tuple[int, ...]) -> None:
        self.shape = shape
        self.size = math.prod(shape)
        used = [(i, e) for i, e in enumerate(exprs) if e != 0]
        self.places = np.array([i for i, _ in used], dtype=np.intp)
        self._symbols, self._exprs = tuple(symbols), [e for _, e in used]
        self._vector: Callable[..., Any] | None = None
        self._scalar: Callable[..., Any] | None = None

    def many(self, batch: tuple[int, ...], arguments: Sequence[Any]) -> FloatArray:
        """Values at many points: arguments of shape `batch` or numbers; the result is batch + shape."""
        if self._vector is None:
            self._vector = _lambdify(self._symbols, self._exprs, "numpy")
        out = np.zeros((*batch, self.size))
        with np.errstate(all="ignore"):
            for place, value in zip(self.places, self._vector(*arguments), strict=True):
                out[..., place] = value
        return out.reshape(*batch, *self.shape)

    def one(self, arguments: Sequence[float]) -> FloatArray:
        """Value at one point, quickly; NaN or ±inf where an expression has no finite real value."""
        if self._scalar is None:
            self._scalar = _lambdify(self._symbols, self._exprs, "math")
        try:
            values = self._scalar(*arguments)
            if len(self.places) == self.size:
                return np.array(values, dtype=float).reshape(self.shape)
            out = np.zeros(self.size)
            out[self.places] = values
        except (ValueError, OverflowError, ZeroDivisionError, TypeError):  # TypeError: a complex power
            return self.many((), [np.float64(value) for value in arguments])
        return out.reshape(self.shape)
