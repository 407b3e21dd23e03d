"""Models in time: first-order ordinary differential equations as text, with their derivatives."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from rotorid import expressions
from rotorid.base.arrays import FloatArray
from rotorid.timedomain.models.compiled import Compiled, signs
from rotorid.timedomain.models.model_text import Reader, bound_table, check_names, finite_numbers

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
    recorded
        Parameters that are initial states as the record says, each with the output that measures it; their
        starting values are NaN here, see `recorded_starts`.
    prior
        Value and standard deviation of parameters that are known beside the records, by name.
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
    recorded: Mapping[str, str] = field(default_factory=dict)
    prior: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    rates_alone: ClassVar[bool] = True
    """Whether `rates` are the whole right side."""

    def f(self, t: ArrayLike, x: ArrayLike, theta: ArrayLike, u: ArrayLike = ()) -> FloatArray:
        """Rates of the states, (*B, n_x)."""
        return self._rates("", t, x, theta, u)

    def f_x(self, t: ArrayLike, x: ArrayLike, theta: ArrayLike, u: ArrayLike = ()) -> FloatArray:
        """Their derivatives by the states, (*B, n_x, n_x)."""
        return self._rates("states", t, x, theta, u)

    def f_theta(self, t: ArrayLike, x: ArrayLike, theta: ArrayLike, u: ArrayLike = ()) -> FloatArray:
        """Their derivatives by the parameters, (*B, n_x, n_p)."""
        return self._rates("parameters", t, x, theta, u)

    def h(self, t: ArrayLike, x: ArrayLike, theta: ArrayLike, u: ArrayLike = ()) -> FloatArray:
        """Outputs, (*B, n_y)."""
        return self._many("observed", "", t, x, theta, u)

    def h_x(self, t: ArrayLike, x: ArrayLike, theta: ArrayLike, u: ArrayLike = ()) -> FloatArray:
        """Their derivatives by the states, (*B, n_y, n_x)."""
        return self._many("observed", "states", t, x, theta, u)

    def h_theta(self, t: ArrayLike, x: ArrayLike, theta: ArrayLike, u: ArrayLike = ()) -> FloatArray:
        """Their derivatives by the parameters at constant states, (*B, n_y, n_p)."""
        return self._many("observed", "parameters", t, x, theta, u)

    def x0(self, theta: ArrayLike) -> FloatArray:
        """Initial states, (n_x,)."""
        return self._made("initial").one(self._theta(theta).tolist())

    def x0_theta(self, theta: ArrayLike) -> FloatArray:
        """Their derivatives by the parameters, (n_x, n_p)."""
        return self._made("initial", "parameters").one(self._theta(theta).tolist())

    def rate(self, t: float, x: FloatArray, theta: FloatArray, u: FloatArray) -> FloatArray:
        """Rates at one point, quickly, (n_x,)."""
        return self._made("rates").one([t, *x.tolist(), *theta.tolist(), *u.tolist()])

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
        return not any(expressions.names(e) & varying for e in self._affine)

    @cached_property
    def timed(self) -> bool:
        """Whether the rates depend on the time itself."""
        return any("t" in expressions.names(e) for e in self.rates)

    @cached_property
    def driven(self) -> bool:
        """Whether inputs stand in the rates."""
        return any(expressions.names(e) & set(self.inputs) for e in self.rates)

    def matrices(self, theta: ArrayLike) -> FloatArray:
        """[A b B] of a linear model, then its derivatives by each parameter, (1 + n_p, n_x, n_x + 1 + n_u).

        Raises
        ------
        ValueError
            The model is not linear with constant coefficients.
        """
        if not self.linear_driven:
            raise ValueError("this model is not linear with constant coefficients; it has no matrices")
        return self._compiled_affine.one(self._theta(theta).tolist())

    # -- expressions and their functions, made when needed

    def _theta(self, theta: ArrayLike) -> FloatArray:
        values = np.asarray(theta, dtype=float)
        if values.shape != (len(self.parameters),):
            raise ValueError(
                f"{len(self.parameters)} parameter values are needed ({', '.join(self.parameters)}), not an "
                f"array of shape {values.shape}"
            )
        return values

    def _rates(self, by: str, t: ArrayLike, x: ArrayLike, theta: ArrayLike, u: ArrayLike) -> FloatArray:
        """f, or its derivatives by the "states" or the "parameters"."""
        return self._many("rates", by, t, x, theta, u)

    def _many(
        self, of: str, by: str, t: ArrayLike, x: ArrayLike, theta: ArrayLike, u: ArrayLike
    ) -> FloatArray:
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
        return self._made(of, by).many(batch, arguments)

    def _made(self, of: str, by: str = "") -> Compiled:
        """Of "rates", "initial" or "observed", or of their derivatives by "states" or "parameters"."""
        if (of, by) not in self.machine:
            exprs = getattr(self, of)
            shape = (len(exprs), len(self._symbols[by])) if by else (len(exprs),)
            arguments = self._symbols["parameters"] if of == "initial" else self._arguments
            table = _jacobian(exprs, self._symbols[by]) if by else exprs
            self.machine[of, by] = Compiled(arguments, table, shape)
        made: Compiled = self.machine[of, by]
        return made

    @cached_property
    def _symbols(self) -> dict[str, list[Any]]:
        """Of states, parameters and inputs."""
        import sympy

        kinds = {"states": self.states, "parameters": self.parameters, "inputs": self.inputs}
        return {kind: [sympy.Symbol(name) for name in names] for kind, names in kinds.items()}

    @cached_property
    def _arguments(self) -> list[Any]:
        """Symbols of the time, the states, the parameters and the inputs."""
        import sympy

        return [sympy.Symbol("t"), *(symbol for kind in self._symbols.values() for symbol in kind)]

    @cached_property
    def fixed_at_first(self) -> list[int]:
        """Outputs that known initial values fix at the first time: no parameter stands in them there."""
        put = dict(zip(self._symbols["states"], self.initial, strict=True))
        return [
            i
            for i, e in enumerate(self.observed if self.states else ())
            if not expressions.names(e.subs(put)) & set(self.parameters)
        ]

    @cached_property
    def machine(self) -> dict[Any, Any]:
        """What has been compiled of this model, by itself and by an integration."""
        return {}

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

    @cached_property
    def _affine(self) -> list[Any]:
        """[A b B] row by row: slopes of the rates by states and inputs, and the rates where these are 0."""
        states, inputs = self._symbols["states"], self._symbols["inputs"]
        zero = dict.fromkeys([*states, *inputs], 0)
        return [
            e
            for rate in self.rates
            for e in (*_jacobian([rate], states), rate.subs(zero), *_jacobian([rate], inputs))
        ]

    @cached_property
    def _compiled_affine(self) -> Compiled:
        parameters, n = self._symbols["parameters"], len(self.states)
        slopes = [e.diff(p) for p in parameters for e in self._affine]
        shape = (1 + len(parameters), n, n + 1 + len(self.inputs))
        return Compiled(parameters, [*self._affine, *slopes], shape)

    @cached_property
    def _compiled_point(self) -> Compiled:
        by = [*self._symbols["states"], *self._symbols["parameters"]]
        exprs = [e for rate in self.rates for e in (rate, *_jacobian([rate], by))]
        return Compiled(self._arguments, exprs, (len(self.states), 1 + len(by)))

    @cached_property
    def _compiled_augmented(self) -> Compiled | None:
        """The products f_x S written out, where they are few: quicker than matrices of this size."""
        import sympy

        states, parameters, arguments = self._symbols["states"], self._symbols["parameters"], self._arguments
        n, k = len(states), len(parameters)
        rows = [_jacobian([rate], states) for rate in self.rates]
        if not self.rates_alone or k * sum(e != 0 for row in rows for e in row) > UNROLLED:
            return None
        slopes = [[sympy.Dummy() for _ in parameters] for _ in states]
        exprs = list(self.rates)
        for rate, row in zip(self.rates, rows, strict=True):
            exprs += [
                rate.diff(p) + sum(e * slopes[m][j] for m, e in enumerate(row) if e != 0)
                for j, p in enumerate(parameters)
            ]
        symbols = [arguments[0], *states, *(s for row in slopes for s in row), *arguments[1 + n :]]
        return Compiled(symbols, exprs, (n * (1 + k),))


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
        of one: an unknown initial state), or "record": as measured by the output that equals this state, a
        parameter of each record, x_0 of the state x. "t0": the time to which they belong instead, s, or
        "first".
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
        (`ExpressionError`); starting values out of bounds; a state from the record that no output measures.

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
    taken = _recorded(initial, outputs, {*everything, *known})
    initial |= {state: parameter for state, (parameter, _) in taken.items()}
    recorded = dict(taken.values())
    limits = bound_table(bounds or {}, estimate)
    read = Reader(exact)
    return OdeModel(
        states=tuple(states),
        parameters=(*estimate, *recorded),
        outputs=tuple(outputs),
        inputs=tuple(inputs),
        start=np.append(start, np.full(len(recorded), np.nan)),
        known=dict(zip(known, numbers.tolist(), strict=True)),
        bounds=np.vstack((limits, np.tile([-np.inf, np.inf], (len(recorded), 1)))),
        rates=tuple(read(e, f"state {name}", everything) for name, e in states.items()),
        initial=tuple(read(initial[name], f"initial {name}", {*estimate, *recorded}) for name in states),
        observed=tuple(read(e, f"output {name}", everything) for name, e in outputs.items()),
        texts=read.texts,
        per_record=(*dict.fromkeys(per_record), *recorded),
        t0=t0,
        recorded=recorded,
    )


def _recorded(
    initial: Mapping[str, float | str], outputs: Mapping[str, str], names: Collection[str]
) -> dict[str, tuple[str, str]]:
    """New parameter, and the output that measures it, of each state that begins as the record says."""
    import sympy

    found: dict[str, tuple[str, str]] = {}
    wanted = [x for x, value in initial.items() if value == "record" and "record" not in names]
    told = {expressions.parse(str(e), where=f"output {y}"): y for y, e in outputs.items()} if wanted else {}
    for state in wanted:
        output = told.get(sympy.Symbol(state))
        if output is None:
            raise ValueError(
                f'initial {state}: "record" needs an output that is {state} alone, without factor, offset or '
                "other states; give a number, or a parameter to be estimated"
            )
        parameter = f"{state}_0"
        while parameter in names:
            parameter += "_"
        found[state] = parameter, output
    return found
