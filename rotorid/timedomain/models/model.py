"""Models in time: first-order ordinary differential equations as text, with their derivatives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotorid import expressions
from rotorid.base.arrays import FloatArray
from rotorid.timedomain.models.compiled import Compiled, signs
from rotorid.timedomain.models.reading import Reader, bound_table, check_names, finite_numbers

Expression = Any
"""Of sympy, which has no types."""

UNROLLED = 300
"""Products in f_x S up to which they are written out."""


@dataclass(frozen=True, eq=False)
class OdeModel:
    """dx/dt = f(t, x, θ, u), y = h(t, x, θ, u); made by `ode_model`.

    All functions take times of any shape B, states (*B, n_x), parameters (n_p,) and inputs (*B, n_u).

    Attributes
    ----------
    states, parameters, outputs, inputs
        Names.
    start
        Starting values of the parameters, shape (n_p,).
    known
        Numbers by name.
    bounds
        Lower and upper bounds of the parameters, shape (n_p, 2), ±inf where there is none.
    texts
        The expressions as written, by place ("state x1").
    rates, initial, observed
        f, x(0) and h as expressions, one for each state or output.
    per_record
        Parameters that every one of several records has for itself.
    t0
        Time to which the initial values belong, s; "first" or None (not stated): the first of each record.
    """

    states: tuple[str, ...]
    parameters: tuple[str, ...]
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    start: FloatArray
    known: Mapping[str, float]
    bounds: FloatArray
    texts: Mapping[str, str] = field(repr=False)
    rates: tuple[Expression, ...] = field(repr=False)
    initial: tuple[Expression, ...] = field(repr=False)
    observed: tuple[Expression, ...] = field(repr=False)
    per_record: tuple[str, ...] = ()
    t0: float | str | None = None

    def f(self, t: ArrayLike, x: ArrayLike, theta: ArrayLike, u: ArrayLike = ()) -> FloatArray:
        """Rates of the states, (*B, n_x)."""
        return self._many(self._compiled_f, t, x, theta, u)

    def f_x(self, t: ArrayLike, x: ArrayLike, theta: ArrayLike, u: ArrayLike = ()) -> FloatArray:
        """Their derivatives by the states, (*B, n_x, n_x)."""
        return self._many(self._compiled_f_x, t, x, theta, u)

    def f_theta(self, t: ArrayLike, x: ArrayLike, theta: ArrayLike, u: ArrayLike = ()) -> FloatArray:
        """Their derivatives by the parameters, (*B, n_x, n_p)."""
        return self._many(self._compiled_f_theta, t, x, theta, u)

    def h(self, t: ArrayLike, x: ArrayLike, theta: ArrayLike, u: ArrayLike = ()) -> FloatArray:
        """Outputs, (*B, n_y)."""
        return self._many(self._compiled_h, t, x, theta, u)

    def h_x(self, t: ArrayLike, x: ArrayLike, theta: ArrayLike, u: ArrayLike = ()) -> FloatArray:
        """Their derivatives by the states, (*B, n_y, n_x)."""
        return self._many(self._compiled_h_x, t, x, theta, u)

    def h_theta(self, t: ArrayLike, x: ArrayLike, theta: ArrayLike, u: ArrayLike = ()) -> FloatArray:
        """Their derivatives by the parameters at constant states, (*B, n_y, n_p)."""
        return self._many(self._compiled_h_theta, t, x, theta, u)

    def x0(self, theta: ArrayLike) -> FloatArray:
        """Initial states, (n_x,)."""
        return self._compiled_x0.one(self._theta(theta).tolist())

    def x0_theta(self, theta: ArrayLike) -> FloatArray:
        """Their derivatives by the parameters, (n_x, n_p)."""
        return self._compiled_x0_theta.one(self._theta(theta).tolist())

    def rate(self, t: float, x: FloatArray, theta: FloatArray, u: FloatArray) -> FloatArray:
        """Rates at one point, quickly, (n_x,)."""
        return self._compiled_f.one([t, *x.tolist(), *theta.tolist(), *u.tolist()])

    def point(self, t: float, x: FloatArray, theta: FloatArray, u: FloatArray) -> FloatArray:
        """f, f_x and f_θ at one point, quickly, (n_x, 1 + n_x + n_p)."""
        return self._compiled_point.one([t, *x.tolist(), *theta.tolist(), *u.tolist()])

    def augmented(self, t: float, z: FloatArray, theta: FloatArray, u: FloatArray) -> FloatArray:
        """Rates of the states and of S = ∂x/∂θ behind them, row by row, quickly, (n_x (1 + n_p),)."""
        if self._compiled_augmented is not None:
            return self._compiled_augmented.one([t, *z.tolist(), *theta.tolist(), *u.tolist()])
        n = len(self.states)
        table = self.point(t, z[:n], theta, u)
        slopes = table[:, 1 : 1 + n] @ z[n:].reshape(n, -1) + table[:, 1 + n :]
        return np.concatenate([table[:, 0], slopes.reshape(-1)])

    @cached_property
    def linear(self) -> bool:
        """Whether dx/dt = A x + b with constant A and b: no inputs, no explicit time."""
        return self.linear_driven and not self.driven

    @cached_property
    def linear_driven(self) -> bool:
        """Whether dx/dt = A x + b + B u with constant A, b and B: no explicit time."""
        if not self.states:
            return False
        varying = {"t", *self.states, *self.inputs}
        if any(expressions.names(part) & varying for e in self.rates for part in signs(e)):
            return False  # such as sign(v): its derivative is 0, but it is not constant
        slopes = [*self._a_exprs, *self._input_exprs]
        if any(expressions.names(e) & varying for e in slopes):
            return False
        return not any(expressions.names(e) & varying for e in self._b_exprs)

    @cached_property
    def timed(self) -> bool:
        """Whether the rates depend on the time itself."""
        return any("t" in expressions.names(e) for e in self.rates)

    @cached_property
    def driven(self) -> bool:
        """Whether inputs stand in the rates."""
        return any(expressions.names(e) & set(self.inputs) for e in self.rates)

    def matrices(self, theta: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """A (n_x, n_x), b (n_x,), ∂A/∂θ (n_p, n_x, n_x), ∂b/∂θ (n_p, n_x) of a linear model.

        Raises
        ------
        ValueError
            The model is not linear with constant coefficients.
        """
        if not self.linear_driven:
            raise ValueError("this model is not linear with constant coefficients; it has no matrices")
        table = self._compiled_matrices.one(self._theta(theta).tolist())
        return table[0, :, :-1], table[0, :, -1], table[1:, :, :-1], table[1:, :, -1]

    def input_matrices(self, theta: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """B (n_x, n_u) of a linear model with inputs, and ∂B/∂θ (n_p, n_x, n_u)."""
        table = self._compiled_input_matrices.one(self._theta(theta).tolist())
        return table[0], table[1:]

    # -- expressions and their functions, made when needed

    def _theta(self, theta: ArrayLike) -> FloatArray:
        values = np.asarray(theta, dtype=float)
        if values.shape != (len(self.parameters),):
            raise ValueError(
                f"{len(self.parameters)} parameter values are needed ({', '.join(self.parameters)}), not an "
                f"array of shape {values.shape}"
            )
        return values

    def _many(self, made: Compiled, t: ArrayLike, x: ArrayLike, theta: ArrayLike, u: ArrayLike) -> FloatArray:
        times = np.asarray(t, dtype=float)
        batch = times.shape
        states = np.broadcast_to(np.asarray(x, dtype=float), (*batch, len(self.states)))
        inputs = np.broadcast_to(np.asarray(u, dtype=float), (*batch, len(self.inputs)))
        arguments = [
            times,
            *np.moveaxis(states, -1, 0),
            *self._theta(theta).tolist(),
            *np.moveaxis(inputs, -1, 0),
        ]
        return made.many(batch, arguments)

    @cached_property
    def _arguments(self) -> tuple[list[Any], list[Any], list[Any]]:
        """Symbols: states, parameters, and all arguments."""
        import sympy

        states = [sympy.Symbol(name) for name in self.states]
        parameters = [sympy.Symbol(name) for name in self.parameters]
        inputs = [sympy.Symbol(name) for name in self.inputs]
        return states, parameters, [sympy.Symbol("t"), *states, *parameters, *inputs]

    def _compile(self, exprs: Sequence[Any], shape: tuple[int, ...]) -> Compiled:
        return Compiled(self._arguments[2], exprs, shape)

    @cached_property
    def _a_exprs(self) -> list[Any]:
        return _jacobian(self.rates, self._arguments[0])

    @cached_property
    def fixed_at_first(self) -> list[int]:
        """Outputs that known initial values fix at the first time: no parameter stands in them there."""
        put = dict(zip(self._arguments[0], self.initial, strict=True))
        return [
            i
            for i, e in enumerate(self.observed if self.states else ())
            if not expressions.names(e.subs(put)) & set(self.parameters)
        ]

    @cached_property
    def machine(self) -> dict[str, Any]:
        """Where an integration keeps what it has compiled of this model."""
        return {}

    @property
    def rates_alone(self) -> bool:
        """Whether `rates` are the whole right side."""
        return True

    @cached_property
    def with_free_start(self) -> OdeModel:
        """The model with its initial states as further parameters, behind the others."""
        import sympy

        names = tuple(f"{name}_at_node" for name in self.states)
        while set(names) & {*self.parameters, *self.states, *self.inputs}:
            names = tuple(f"{name}_" for name in names)
        k = len(names)
        return replace(
            self,
            parameters=(*self.parameters, *names),
            start=np.concatenate((self.start, np.zeros(k))),
            bounds=np.vstack((self.bounds, np.tile([-np.inf, np.inf], (k, 1)))),
            initial=tuple(sympy.Symbol(name) for name in names),
            t0=None,
        )

    @property
    def _input_symbols(self) -> list[Any]:
        return self._arguments[2][1 + len(self.states) + len(self.parameters) :]

    @cached_property
    def _input_exprs(self) -> list[Any]:
        return _jacobian(self.rates, self._input_symbols)

    @cached_property
    def _b_exprs(self) -> list[Any]:
        """The rates at x = 0, u = 0 (only of use where A and B are constant)."""
        zero = dict.fromkeys([*self._arguments[0], *self._input_symbols], 0)
        return [e.subs(zero) for e in self.rates]

    @cached_property
    def _compiled_f(self) -> Compiled:
        return self._compile(self.rates, (len(self.states),))

    @cached_property
    def _compiled_f_x(self) -> Compiled:
        return self._compile(self._a_exprs, (len(self.states), len(self.states)))

    @cached_property
    def _compiled_f_theta(self) -> Compiled:
        exprs = _jacobian(self.rates, self._arguments[1])
        return self._compile(exprs, (len(self.states), len(self.parameters)))

    @cached_property
    def _compiled_point(self) -> Compiled:
        states, parameters, _ = self._arguments
        exprs = [e for rate in self.rates for e in (rate, *_jacobian((rate,), [*states, *parameters]))]
        return self._compile(exprs, (len(states), 1 + len(states) + len(parameters)))

    @cached_property
    def _compiled_augmented(self) -> Compiled | None:
        """The products f_x S written out, where they are few: quicker than matrices of this size."""
        import sympy

        states, parameters, arguments = self._arguments
        n, k = len(states), len(parameters)
        if sum(e != 0 for e in self._a_exprs) * k > UNROLLED:
            return None
        slopes = [[sympy.Dummy() for _ in parameters] for _ in states]
        exprs = list(self.rates)
        for i, rate in enumerate(self.rates):
            row = self._a_exprs[i * n : (i + 1) * n]
            exprs += [
                rate.diff(p) + sum(e * slopes[m][j] for m, e in enumerate(row) if e != 0)
                for j, p in enumerate(parameters)
            ]
        symbols = [arguments[0], *states, *(s for row in slopes for s in row), *arguments[1 + n :]]
        return Compiled(symbols, exprs, (n * (1 + k),))

    @cached_property
    def _compiled_h(self) -> Compiled:
        return self._compile(self.observed, (len(self.outputs),))

    @cached_property
    def _compiled_h_x(self) -> Compiled:
        exprs = _jacobian(self.observed, self._arguments[0])
        return self._compile(exprs, (len(self.outputs), len(self.states)))

    @cached_property
    def _compiled_h_theta(self) -> Compiled:
        exprs = _jacobian(self.observed, self._arguments[1])
        return self._compile(exprs, (len(self.outputs), len(self.parameters)))

    @cached_property
    def _compiled_x0(self) -> Compiled:
        return Compiled(self._arguments[1], self.initial, (len(self.states),))

    @cached_property
    def _compiled_x0_theta(self) -> Compiled:
        exprs = _jacobian(self.initial, self._arguments[1])
        return Compiled(self._arguments[1], exprs, (len(self.states), len(self.parameters)))

    @cached_property
    def _compiled_matrices(self) -> Compiled:
        n = len(self.states)
        both = [
            e for i in range(n) for e in (*self._a_exprs[i * n : (i + 1) * n], self._b_exprs[i])
        ]  # [A b], row by row
        tables = [both, *([e.diff(p) for e in both] for p in self._arguments[1])]
        return Compiled(self._arguments[1], [e for table in tables for e in table], (len(tables), n, n + 1))

    @cached_property
    def _compiled_input_matrices(self) -> Compiled:
        parameters, shape = self._arguments[1], (len(self.states), len(self.inputs))
        tables = [self._input_exprs, *([e.diff(p) for e in self._input_exprs] for p in parameters)]
        return Compiled(parameters, [e for table in tables for e in table], (len(tables), *shape))


def _jacobian(exprs: Sequence[Any], by: Sequence[Any]) -> list[Any]:
    return [e.diff(symbol) for e in exprs for symbol in by]


def ode_model(
    states: Mapping[str, str],
    *,
    estimate: Mapping[str, float],
    initial: Mapping[str, float | str] | None = None,
    outputs: Mapping[str, str] | None = None,
    known: Mapping[str, float] | None = None,
    inputs: Sequence[str] = (),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    per_record: Sequence[str] = (),
) -> OdeModel:
    """Make a model of text.

    Parameters
    ----------
    states
        Rate of each state, dx/dt, such as {"x": "v", "v": "-k*x - c*v + cos(t)"}; empty: `outputs` are
        functions of the time alone (curve fitting).
    estimate
        Parameters to be estimated, with starting values.
    initial
        Value of each state at the first time of a record: a number, or an expression of parameters (the name
        of one: an unknown initial state). "t0": the time to which they belong instead, s, or "first".
    outputs
        What is measured; by default the states.
    known
        Numbers by name.
    inputs
        Names of measured inputs (columns of the record).
    bounds
        Lower and upper bound of parameters, ±inf for none.
    per_record
        Parameters, usually initial states, of which every record has its own: x0 of the second record is then
        called x0_2.

    Raises
    ------
    ValueError
        Names that are used twice, are missing or are none; expressions that cannot be read
        (`ExpressionError`); starting values out of bounds.

    Examples
    --------
    >>> model = ode_model({"x": "-a*x"}, initial={"x": 1.0}, estimate={"a": 0.5})
    >>> model.linear
    True
    """
    known, initial = dict(known or {}), dict(initial or {})
    t0 = None if "t0" in states else initial.pop("t0", None)
    if t0 is not None and t0 != "first" and (isinstance(t0, str) or not np.isfinite(t0)):
        raise ValueError(f'initial: t0 is the time of the initial values in s, or "first", not {t0!r}')
    if not states and not outputs:
        raise ValueError("a model needs states, or outputs of the time")
    check_names({"state": states, "parameter": estimate, "known value": known, "input": inputs})
    if missing := [name for name in states if name not in initial]:
        raise ValueError(f"initial: the value of the state {missing[0]} is missing")
    if extra := [name for name in initial if name not in states]:
        raise ValueError(f"initial: {extra[0]} is no state; states are {', '.join(states) or 'none'}")
    outputs = dict(outputs) if outputs else {name: name for name in states}
    for name in outputs:
        if not expressions.is_name(name) or name == "t":
            raise ValueError(f"output {name!r} is no name; names are letters, digits and _, but not t")
    if lost := [name for name in per_record if name not in estimate]:
        raise ValueError(f"per_record: {lost[0]} is no parameter; parameters are {', '.join(estimate)}")
    start = finite_numbers(estimate, "parameter", "starting value")
    numbers = finite_numbers(known, "known value", "value")
    exact = {name: Fraction(repr(float(v))) for name, v in zip(known, numbers, strict=True)}
    everything = {"t", *states, *estimate, *inputs}
    read = Reader(exact)
    return OdeModel(
        states=tuple(states),
        parameters=tuple(estimate),
        outputs=tuple(outputs),
        inputs=tuple(inputs),
        start=start,
        known=dict(zip(known, numbers.tolist(), strict=True)),
        bounds=bound_table(bounds or {}, estimate),
        rates=tuple(read(e, f"state {name}", everything) for name, e in states.items()),
        initial=tuple(read(initial[name], f"initial {name}", set(estimate)) for name in states),
        observed=tuple(read(e, f"output {name}", everything) for name, e in outputs.items()),
        texts=read.texts,
        per_record=tuple(dict.fromkeys(per_record)),
        t0=t0,
    )
