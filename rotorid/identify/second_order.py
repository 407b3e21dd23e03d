"""Models of matrices, M y'' + C y' + K y = f."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.identify.ode import OdeModel, check_known, ode_model, read_expression

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
) -> OdeModel:
    """Make a model M y'' + C y' + K y = f of matrices.

    Those of a rotor come from `fem.equations_of_motion` (`motion.M, motion.C, motion.K`, with
    `names=motion.coordinates`), those of a reduced model from `Reduction.equations_of_motion`; what is to be
    estimated at a bearing or a disc is written into them as text.

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
    >>> K = motion.K.tolist()
    >>> for i in (motion.index("x1"), motion.index("x3")):
    ...     K[i][i] = f"{K[i][i]} + k"
    >>> model = second_order(motion.M, motion.C, K, names=motion.coordinates,
    ...                      estimate={"k": 1e7}, initial={"x2": 1e-3})
    >>> model.parameters
    ('k',)
    """
    import sympy

    given = {"mass": mass, "damping": damping, "stiffness": stiffness}
    m, c, k = (_entries(matrix, what) for what, matrix in given.items())
    n, force = len(m), force or {}
    if not len(c) == len(k) == n:
        raise ValueError(f"the matrices have different sizes: mass {n}, damping {len(c)}, stiffness {len(k)}")
    dofs = tuple(names or (f"y{i + 1}" for i in range(n)))
    if len(dofs) != n:
        raise ValueError(f"{n} names of displacements are needed, not {len(dofs)}")
    check_known("force", force, "displacement", dofs)
    rates = [f"v_{dof}" for dof in dofs]
    states: dict[str, str] = {}
    for dof, *row in zip(dofs, c, k, strict=True):
        terms = zip([*row[0], *row[1]], [*rates, *dofs], strict=True)
        products = [f"({value})*{name}" for value, name in terms if value != "0"]
        states |= {dof: f"v_{dof}", f"v_{dof}": " - ".join([f"({force.get(dof, 0)})", *products])}
    plain = ode_model(
        states,
        estimate=estimate,
        initial=dict.fromkeys(states, 0.0) | dict(initial or {}),
        outputs=outputs or {name: name for name in dofs},
        known=known,
        inputs=inputs,
        bounds=bounds,
        per_record=per_record,
    )
    inertia = sympy.eye(2 * n)
    for i, j in np.ndindex(n, n):
        where = f"mass matrix, row {i + 1}"
        inertia[2 * i + 1, 2 * j + 1] = read_expression(m[i][j], where, estimate, plain.known)
    model = replace(plain, inertia=tuple(inertia))
    model.augmented(0.0, np.zeros(2 * n), model.start, np.zeros(len(inputs)))  # a singular mass matrix
    return model


def _entries(matrix: Matrix, what: str) -> list[list[str]]:
    """Texts of a matrix."""
    if not len(matrix) or any(len(row) != len(matrix) for row in matrix):
        raise ValueError(f"the {what} matrix must be square, (n, n)")
    for i, row in enumerate(matrix):
        for value in row:
            if not isinstance(value, str) and not np.isfinite(value):
                raise ValueError(f"{what} matrix, row {i + 1}: {value} is no finite number")
    return [[v if isinstance(v, str) else repr(float(v)) if v else "0" for v in row] for row in matrix]
