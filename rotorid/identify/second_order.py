"""Models of matrices, M y'' + C y' + K y = f, and linear models as state spaces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import FloatArray
from rotorid.identify.expression_functions import signs
from rotorid.identify.expressions import names as names_in
from rotorid.identify.ode import OdeModel, ode_model, read_expression

if TYPE_CHECKING:
    from fem import StateSpace

Matrix = Sequence[Sequence[float | str]] | FloatArray
"""Numbers or expressions of parameters, (n, n)."""


def second_order(  # noqa: PLR0913
    mass: Matrix,
    damping: Matrix,
    stiffness: Matrix,
    *,
    estimate: Mapping[str, float],
    initial: Mapping[str, float | str] | None = None,
    force: Mapping[str, float | str] | None = None,
    outputs: Mapping[str, str] | None = None,
    known: Mapping[str, float] | None = None,
    inputs: Sequence[str] = (),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    per_record: Sequence[str] = (),
    names: Sequence[str] | None = None,
    masses: Mapping[str, float | str] | None = None,
    dampers: Mapping[str, float | str] | None = None,
    springs: Mapping[str, float | str] | None = None,
) -> OdeModel:
    """Make a model M y'' + C y' + K y = f of matrices.

    Those of a rotor come from `fem.equations_of_motion` (`motion.M, motion.C, motion.K`, with
    `names=motion.coordinates`), those of a reduced model from `Reduction.equations_of_motion`; what is to be
    estimated at a bearing or a disc is added by `masses`, `dampers` and `springs`.

    Parameters
    ----------
    mass, damping, stiffness
        M, C, K, (n, n): numbers, or expressions of parameters such as "c1 + c2".
    estimate, known, inputs, bounds, per_record
        As in `ode_model`.
    initial
        Values of displacements and velocities at the first time (or "t0"); 0 where none is given.
    force
        f by displacement: expressions of time, inputs, parameters and states; 0 where none is given.
    outputs
        What is measured; by default the displacements.
    names
        Names of the displacements, y1, y2, … by default; the velocity of y1 is v_y1. The states are
        y1, v_y1, y2, v_y2, …
    masses, dampers, springs
        {displacement: number or expression}, added to the diagonals of M, C and K: what stands between this
        displacement and the ground.

    Raises
    ------
    ValueError
        Matrices that are not square or of different sizes, a singular mass matrix, and as `ode_model`.

    Examples
    --------
    >>> model = second_order([["m"]], [[0.2]], [[4.0]], estimate={"m": 1.0}, initial={"y1": 1.0})
    >>> model.states, model.linear_driven
    (('y1', 'v_y1'), True)

    A rotor on two bearings of unknown stiffness:

    >>> import fem
    >>> shaft = fem.Rotor(length=[0.5, 0.5], outer_diameter=0.05)
    >>> motion = fem.equations_of_motion(shaft, plane="x")
    >>> model = second_order(motion.M, motion.C, motion.K, names=motion.coordinates,
    ...                      springs={"x1": "k", "x3": "k"}, estimate={"k": 1e7}, initial={"x2": 1e-3})
    >>> model.parameters
    ('k',)
    """
    import sympy

    n = len(mass)
    dofs = tuple(names) if names is not None else tuple(f"y{i + 1}" for i in range(n))
    m, c, k = (
        _entries(matrix, what, dofs, added or {}, ground)
        for matrix, what, added, ground in (
            (mass, "mass", masses, "masses"),
            (damping, "damping", dampers, "dampers"),
            (stiffness, "stiffness", springs, "springs"),
        )
    )
    if not len(c) == len(k) == n:
        raise ValueError(f"the matrices have different sizes: mass {n}, damping {len(c)}, stiffness {len(k)}")
    if len(dofs) != n:
        raise ValueError(f"{n} names of displacements are needed, not {len(dofs)}")
    if extra := [name for name in force or {} if name not in dofs]:
        raise ValueError(f"force: {extra[0]} is no displacement; displacements are {', '.join(dofs)}")
    states: dict[str, str] = {}
    for i, dof in enumerate(dofs):
        terms = [f"({(force or {}).get(dof, 0)})"]
        terms += [f"({c[i][j]})*v_{dofs[j]}" for j in range(n) if c[i][j] != "0"]
        terms += [f"({k[i][j]})*{dofs[j]}" for j in range(n) if k[i][j] != "0"]
        states |= {dof: f"v_{dof}", f"v_{dof}": " - ".join(terms)}
    plain = ode_model(
        states,
        estimate=estimate,
        initial=dict.fromkeys(states, 0.0) | dict(initial or {}),
        outputs=dict(outputs) if outputs else {name: name for name in dofs},
        known=known,
        inputs=inputs,
        bounds=bounds,
        per_record=per_record,
    )
    cells = [[sympy.Integer(i == j) for j in range(2 * n)] for i in range(2 * n)]
    for i, row in enumerate(m):
        where = f"mass matrix, row {i + 1}"
        cells[2 * i + 1][1::2] = [read_expression(cell, where, estimate, plain.known) for cell in row]
    model = replace(plain, inertia=tuple(cell for row in cells for cell in row))
    model.augmented(0.0, np.zeros(2 * n), model.start, np.zeros(len(model.inputs)))  # a singular mass matrix
    return model


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
    >>> from rotorid.identify.ode import ode_model
    >>> model = ode_model({"x": "-a*x + u"}, initial={"x": 0.0}, estimate={"a": 2.0}, inputs=["u"])
    >>> state_space(model).A
    array([[-2.]])
    """
    import sympy

    from fem import StateSpace

    if not model.states:
        raise ValueError("a model without states has no state space")
    symbols = [sympy.Symbol(name) for name in (*model.states, *model.inputs)]
    varying = {*model.states, *model.inputs}
    parts = [("the rate of", *pair) for pair in zip(model.states, model.rates, strict=True)]
    parts += [("the output", *pair) for pair in zip(model.outputs, model.observed, strict=True)]
    for what, name, expression in parts:
        if "t" in names_in(expression):
            raise ValueError(
                f"{what} {name} depends on the time itself: a state space does not; make what varies an input"
            )
        if any(names_in(e) & varying for e in (*signs(expression), *map(expression.diff, symbols))):
            raise ValueError(f"{what} {name} is not linear in states and inputs: a state space must be")
    values = model.start if theta is None else np.asarray(theta, dtype=float)
    if values.shape != model.start.shape or not np.isfinite(values).all():
        raise ValueError(f"{len(model.parameters)} parameter values are needed, finite numbers")
    n, m = len(model.states), len(model.inputs)
    table, at_rest = model.matrices(values)[0], model.h(0.0, np.zeros(n), values, np.zeros(m))
    constants = [*table[:, n], *at_rest[:, 0]]
    for (what, name, _), constant in zip(parts, constants, strict=True):
        if constant:
            raise ValueError(
                f"{what} {name} has a constant part, which a state space cannot hold: make it an input"
            )
    # linear, and 0 without inputs: the outputs of unit inputs are the columns of D
    D = model.h(np.zeros(m), np.zeros((m, n)), values, np.eye(m))[..., 0].T
    C = at_rest[:, 1 : 1 + n]
    return StateSpace(table[:, :n], table[:, n + 1 :], C, D.copy(), model.states, model.inputs, model.outputs)


def _entries(
    matrix: Matrix, what: str, dofs: Sequence[str], added: Mapping[str, float | str], ground: str
) -> list[list[str]]:
    """Texts of a matrix, with what stands between displacements and the ground on its diagonal."""
    rows = [[_entry(v, f"{what} matrix, row {i + 1}") for v in row] for i, row in enumerate(matrix)]
    if not rows or any(len(row) != len(rows) for row in rows):
        raise ValueError(f"the {what} matrix must be square, (n, n)")
    for name, value in added.items():
        if name not in dofs:
            raise ValueError(f"{ground}: {name} is no displacement; displacements are {', '.join(dofs)}")
        i = dofs.index(name)
        rows[i][i] = f"({rows[i][i]}) + ({_entry(value, f'{ground}, {name}')})"
    return rows


def _entry(value: float | str, where: str) -> str:
    if isinstance(value, str):
        return value
    if not np.isfinite(value):
        raise ValueError(f"{where}: {value} is no finite number")
    return "0" if value == 0 else repr(float(value))
