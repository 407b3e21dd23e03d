"""Models in time: ordinary differential equations as text, with their derivatives.

    E(θ) dx/dt = r(t, x, θ, u),    x(t0) = x0(θ),    y = h(t, x, θ, u)

E is the unit matrix, or holds the mass matrix of a model made of matrices (`second_order`); it is solved
numerically, no matrix of symbols is inverted. With f = E⁻¹ r

    f_x = E⁻¹ r_x,    f_θ = E⁻¹ (r_θ − E_θ f).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import FloatArray
from rotorid.base.choices import did_you_mean
from rotorid.identify import expressions
from rotorid.identify.expression_functions import Compiled, Expression, jacobian, real, signs


class SimulationError(ValueError):
    """A solution that does not exist, or cannot be computed, up to the last time."""


@dataclass(frozen=True, eq=False)
class OdeModel:
    """dx/dt = f(t, x, θ, u), y = h(t, x, θ, u); made by `ode_model` or `second_order`.

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
        r, x(0) and h as expressions, one for each state or output.
    per_record
        Parameters that every one of several records has for itself.
    recorded
        Parameters that are initial states as the record says, each with the output that measures it; their
        starting values are NaN here.
    prior
        Value and standard deviation of parameters that are known beside the records, by name.
    inertia
        E as expressions, row by row; empty: the unit matrix.
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
    recorded: Mapping[str, str] = field(default_factory=dict)
    prior: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    inertia: tuple[Expression, ...] = field(repr=False, default=())

    def f(self, t: ArrayLike, x: ArrayLike, theta: ArrayLike, u: ArrayLike = ()) -> FloatArray:
        """Rates of the states, then their derivatives by states and parameters, (*B, n_x, 1 + n_x + n_p)."""
        made, parts = self._compiled("rates", self.symbols, 1), [np.asarray(p, float) for p in (x, theta, u)]
        if np.ndim(t) == 0:  # quickly
            table = made.one([float(np.asarray(t)), *np.concatenate(parts).tolist()])
        else:
            rest = (part[..., j] for part in parts for j in range(part.shape[-1]))
            table = made.many(np.shape(t), [t, *rest])
        if self.inertia:
            inverse, slopes = self.inverse(theta)
            table = inverse @ table
            moved = np.tensordot(inverse @ slopes, table[..., 0], (2, -1))
            table[..., 1 + len(self.states) :] -= np.moveaxis(moved, (0, 1), (-1, -2))
        return table

    def h(self, t: FloatArray, z: FloatArray, theta: FloatArray, u: FloatArray) -> FloatArray:
        """Outputs and their derivatives (n, n_y, 1 + k), of states and theirs (n, n_x, 1 + k).

        k is the number of parameters, or 0, or larger for directions in which these do not change.
        """
        made, n = self._compiled("observed", self.symbols, 1), z.shape[1]
        table = np.zeros((z.shape[2], len(self.outputs), len(t)))
        for place, value in zip(made.places, made.vector(t, *z[..., 0].T, *theta, *u.T), strict=True):
            j, i = divmod(int(place), made.shape[1])
            if 0 < i <= n:
                table[1:, j] += value * z[:, i - 1, 1:].T
            elif i - n < len(table):
                table[max(i - n, 0), j] += value
        return table.T

    def x0(self, theta: ArrayLike) -> FloatArray:
        """Initial states, then their derivatives by the parameters, (n_x, 1 + n_p)."""
        return self._alone("initial", theta)

    def matrices(self, theta: ArrayLike) -> FloatArray:
        """[A b B] of a linear model, then its derivatives by each parameter, (1 + n_p, n_x, n_x + 1 + n_u).

        Raises
        ------
        ValueError
            The model is not linear with constant coefficients.
        """
        if not self.linear_driven:
            raise ValueError(
                "expm solves linear models with constant coefficients, without explicit time; use dop853, "
                "lsoda, or auto"
            )
        table, n = self._alone("coefficients", theta), len(self.states)
        tables = table.T.reshape(table.shape[1], n, -1)
        if self.inertia:
            inverse, slopes = self.inverse(theta)
            tables = inverse @ tables
            tables[1:] -= inverse @ slopes @ tables[0]
        return tables

    @cached_property
    def coefficients(self) -> tuple[Expression, ...]:
        """Of E dx/dt = A x + b + B u, where the rates are such: [A b B], row by row."""
        n = len(self.states)
        x, u = self.symbols[1 : 1 + n], self.symbols[1 + n + len(self.start) :]
        rest = dict.fromkeys((*x, *u), 0)
        return tuple(part for e in self.rates for part in (*map(e.diff, x), e.subs(rest), *map(e.diff, u)))

    @cached_property
    def linear_driven(self) -> bool:
        """Whether dx/dt = A x + b + B u with constant A, b and B: no explicit time."""
        # such as sign(v): its derivative is 0, but it is not constant
        parts = [*self.coefficients, *(part for e in self.rates for part in signs(e))]
        varying = {"t", *self.states, *self.inputs}
        return bool(self.states) and not self.timed and not any(expressions.names(e) & varying for e in parts)

    @cached_property
    def in_rates(self) -> set[str]:
        """Names that stand in the rates."""
        return {name for e in self.rates for name in expressions.names(e)}

    @property
    def timed(self) -> bool:
        """Whether the rates depend on the time itself."""
        return "t" in self.in_rates

    @property
    def driven(self) -> bool:
        """Whether inputs stand in the rates."""
        return bool(self.in_rates & {*self.inputs})

    @cached_property
    def fixed_at_first(self) -> list[int]:
        """Outputs that known initial values fix at the first time: no parameter stands in them there."""
        put = dict(zip(self.symbols[1:], self.initial, strict=False))
        first = [expressions.names(e.subs(put)) & {*self.parameters} for e in self.observed]
        return [i for i, free in enumerate(first) if self.states and not free]

    # -- expressions and their functions, made when needed

    @cached_property
    def symbols(self) -> list[Any]:
        """Of the time, the states, the parameters and the inputs."""
        import sympy

        return [*map(sympy.Symbol, ("t", *self.states, *self.parameters, *self.inputs))]

    @cached_property
    def memory(self) -> dict[Any, Any]:
        """What was computed for this model: functions, the inverse of E, integrators that are worth it."""
        return {}

    def _alone(self, what: str, theta: ArrayLike) -> FloatArray:
        """Expressions of the parameters alone, with the derivatives by these, (m, 1 + n_p)."""
        n = 1 + len(self.states)
        table = self._compiled(what, self.symbols[n : n + len(self.start)], 0)
        return table.one(np.asarray(theta, dtype=float).tolist())

    def _compiled(self, what: str, symbols: list[Any], first: int) -> Compiled:
        """Expressions of these symbols, with the derivatives by those of states and parameters."""
        if what not in self.memory:
            exprs, by = getattr(self, what), symbols[first : len(symbols) - first * len(self.inputs)]
            self.memory[what] = Compiled(symbols, jacobian(exprs, by), (len(exprs), 1 + len(by)))
        made: Compiled = self.memory[what]
        return made

    def inverse(self, theta: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """E⁻¹ (n_x, n_x) and ∂E/∂θ (n_p, n_x, n_x), kept for the latest parameters.

        Raises
        ------
        SimulationError
            E is singular.
        """
        values, n, memory = np.asarray(theta, dtype=float), len(self.states), self.memory
        if memory.get("inverse at") != values.tobytes():
            table = np.moveaxis(self._alone("inertia", values).reshape(n, n, -1), -1, 0)
            if not np.isfinite(table).all() or np.linalg.cond(table[0]) > 1e14:
                shown = ", ".join(f"{n} = {v:.4g}" for n, v in zip(self.parameters, values, strict=True))
                raise SimulationError(f"the mass matrix is singular at {shown or 'the known values'}")
            memory |= {"inverse at": values.tobytes(), "inverse": (np.linalg.inv(table[0]), table[1:])}
        inverse: tuple[FloatArray, FloatArray] = memory["inverse"]
        return inverse


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
        parameter of each record, x_0 of the state x.
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
    >>> model.linear_driven
    True
    """
    known, initial = dict(known or {}), dict(initial or {})
    outputs = dict(outputs or {name: name for name in states})
    if not outputs:
        raise ValueError("a model needs states, or outputs of the time")
    recorded = {f"{x}_0": _measuring(x, outputs) for x in states if initial.get(x) == "record"}
    initial |= {state: f"{state}_0" for state in states if initial.get(state) == "record"}
    kinds = {"state": states, "parameter": (*estimate, *recorded), "known value": known, "input": inputs}
    expressions.check_names(kinds | {"output": outputs}, "t", "the time")
    if missing := [name for name in states if name not in initial]:
        raise ValueError(f"initial: the value of the state {missing[0]} is missing")
    check_known("initial", initial, "state", states)
    check_known("per_record", per_record, "parameter", estimate)
    begin, known = ({n: expressions.finite(n, x) for n, x in each.items()} for each in (estimate, known))
    names = ["t", *states, *estimate, *inputs]
    texts = {}

    def read(kind: str, given: Mapping[str, float | str], allowed: Collection[str]) -> tuple[Expression, ...]:
        """Expressions of the states or outputs."""
        for name, text in given.items():
            texts[f"{kind} {name}"] = text if isinstance(text, str) else repr(float(text))
        return tuple(read_expression(text, f"{kind} {n}", allowed, known) for n, text in given.items())

    return OdeModel(
        states=tuple(states),
        parameters=(*estimate, *recorded),
        outputs=tuple(outputs),
        inputs=tuple(inputs),
        start=np.array([*begin.values(), *(math.nan for _ in recorded)], dtype=float),
        known=known,
        bounds=_limits(bounds or {}, estimate, len(recorded)),
        rates=read("state", states, names),
        initial=read("initial", {name: initial[name] for name in states}, (*estimate, *recorded)),
        observed=read("output", outputs, names),
        texts=texts,
        per_record=(*dict.fromkeys(per_record), *recorded),
        recorded=recorded,
    )


def read_expression(
    text: float | str, where: str, allowed: Collection[str], known: Mapping[str, float]
) -> Expression:
    """Read one expression that may use the names allowed, and known ones, which become their numbers."""
    import sympy

    if not isinstance(text, str):
        text = repr(expressions.finite(where, text))
    expr = expressions.parse(text, where=where)
    usable = sorted({*allowed, *known})
    for name in sorted(expressions.names(expr) - {*usable}):
        hint = did_you_mean(name, usable) or f"; it may use {', '.join(usable) or 'numbers'}"
        raise ValueError(f"{where}: {expressions.quote(text)}: {name} is not defined here{hint}")
    put = {sympy.Symbol(name): sympy.Rational(repr(float(value))) for name, value in known.items()}
    value = real(expr.subs(put))
    if value.has(sympy.zoo, sympy.nan, sympy.oo, sympy.I):
        raise ValueError(f"{where}: {expressions.quote(text)} has no finite real value with known values")
    return value


def check_known(where: str, names: Iterable[str], kind: str, known: Collection[str]) -> None:
    """Refuse names that are none of a model."""
    for name in names:
        if name not in known:
            raise ValueError(
                f"{where}: {name} is no {kind}; {kind.split()[0]}s are {', '.join(known) or 'none'}"
            )


def _measuring(state: str, outputs: Mapping[str, str]) -> str:
    """The output that measures a state, which begins as the record says."""
    for output, text in outputs.items():
        if str(text).strip("() ") == state:
            return output
    raise ValueError(
        f'initial {state}: "record" needs an output that is {state} alone, without factor, offset or other '
        "states; give a number, or a parameter to be estimated"
    )


def with_nuisance(
    outputs: Mapping[str, str], offset: bool, drift: bool, hum_Hz: Sequence[float]
) -> tuple[dict[str, str], list[str]]:
    """Outputs with a constant, a part that grows with t, and sinusoids, each with a factor of its own.

    Returns
    -------
    Their expressions, and the names of the factors, which are to be estimated from 0 for every record.

    Examples
    --------
    >>> with_nuisance({"x": "1e6*x"}, True, False, [50])[1]
    ['offset_x', 'hum50_cos_x', 'hum50_sin_x']
    """
    terms = {"offset": "1"} if offset else {}
    terms |= {"drift": "t"} if drift else {}
    for frequency in hum_Hz:
        name = f"hum{frequency:g}".replace(".", "_")
        terms |= {f"{name}_{wave}": f"{wave}({2 * math.pi * frequency!r}*t)" for wave in ("cos", "sin")}
    texts = {
        output: " + ".join([f"({text})", *(f"{name}_{output}*{term}" for name, term in terms.items())])
        for output, text in outputs.items()
    }
    return texts, [f"{name}_{output}" for output in outputs for name in terms]


def _limits(
    bounds: Mapping[str, tuple[float, float]], estimate: Mapping[str, float], more: int
) -> FloatArray:
    """Bounds of all parameters, (n_p, 2), without any for those that the records begin with."""
    check_known("bounds", bounds, "parameter", estimate)
    for name, (low, high) in bounds.items():
        if not low < high:
            raise ValueError(f"bounds of {name}: the lower one, {low:g}, must be below the upper, {high:g}")
        if not low <= estimate[name] <= high:
            raise ValueError(
                f"bounds of {name}: the starting value {estimate[name]:g} is outside {low:g} … {high:g}"
            )
    free = (-np.inf, np.inf)
    return np.array([*(bounds.get(name, free) for name in estimate), *[free] * more]).reshape(-1, 2)
