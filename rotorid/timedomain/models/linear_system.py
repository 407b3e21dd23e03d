"""A linear model in time as a state space."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rotorid import expressions
from rotorid.timedomain.models.compiled import signs
from rotorid.timedomain.models.ode_model import OdeModel

if TYPE_CHECKING:
    from fem import StateSpace


def state_space(model: OdeModel, theta: ArrayLike | None = None) -> StateSpace:
    """Write a linear model as s' = A s + B u, y = C s + D u.

    Parameters
    ----------
    model
        Of `ode_model`, `second_order` or a file, with its inputs and outputs.
    theta
        Parameters, shape (n_p,); by default the starting values.

    Returns
    -------
    StateSpace
        With the model's names; initial values have no place in it.

    Raises
    ------
    ValueError
        A model without states, one that depends on the time itself or is not linear, constant loads (they
        need an input of their own), parameters that are not finite.

    Examples
    --------
    >>> from rotorid.timedomain import ode_model
    >>> model = ode_model({"x": "-a*x + u"}, initial={"x": 0.0}, estimate={"a": 2.0}, inputs=["u"])
    >>> state_space(model).A
    array([[-2.]])
    """
    from fem import StateSpace

    _check_linear(model)
    values = model.start if theta is None else np.asarray(theta, dtype=float)
    if not np.isfinite(values).all():
        raise ValueError("the parameters must be finite numbers")
    zero, none = np.zeros(len(model.states)), np.zeros(len(model.inputs))
    table, n = model.matrices(values)[0], len(zero)
    A, constant, B = table[:, :n], table[:, n], table[:, n + 1 :]
    C = model.h_x(0.0, zero, values, none)
    rest = model.h(0.0, zero, values, none)
    if constant.any() or rest.any():
        what = (
            f"the rate of {model.states[int(np.flatnonzero(constant)[0])]}"
            if constant.any()
            else f"the output {model.outputs[int(np.flatnonzero(rest)[0])]}"
        )
        raise ValueError(f"{what} has a constant part, which a state space cannot hold: make it an input")
    # linear, and 0 without inputs: the outputs of unit inputs are the columns of D
    units = np.eye(len(none))
    D = model.h(np.zeros(len(none)), np.zeros((len(none), len(zero))), values, units).T
    return StateSpace(A, B, C, D.copy(), model.states, model.inputs, model.outputs)


def _check_linear(model: OdeModel) -> None:
    import sympy

    if not model.states:
        raise ValueError("a model without states has no state space")
    symbols = [sympy.Symbol(name) for name in (*model.states, *model.inputs)]
    varying = {"t", *model.states, *model.inputs}
    parts = [("the rate of", *pair) for pair in zip(model.states, model.rates, strict=True)]
    parts += [("the output", *pair) for pair in zip(model.outputs, model.observed, strict=True)]
    for what, name, expression in parts:
        if "t" in expressions.names(expression):
            raise ValueError(
                f"{what} {name} depends on the time itself: a state space does not; make what varies an input"
            )
        slopes: list[Any] = [expression.diff(symbol) for symbol in symbols]
        if any(expressions.names(part) & varying for part in (*signs(expression), *slopes)):
            raise ValueError(f"{what} {name} is not linear in states and inputs: a state space must be")
