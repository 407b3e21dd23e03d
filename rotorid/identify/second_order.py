"""Models of matrices, M y'' + C y' + K y = f."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.identify.ode import OdeModel, check_known, ode_model, read_expression

__all__ = ["second_order"]

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
        Values of displacements and velocities at the first time; 0 where none is given.
    force
        f by displacement: expressions of time, inputs, parameters and states; 0 where none is given.
    outputs
        What is measured; by default the displacements.
    names
        Names of the displacements, y1, y2, … by default; the velocity of y1 is v_y1. The states are
        y1, v_y1, y2, v_y2, …; a displacement of which row and column of M are 0 is a state alone, of which
        C holds the rate.

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
    light = {i for i in range(n) if {*m[i], *(row[i] for row in m)} == {"0"}}
    rates = {i: f"v_{dof}" for i, dof in enumerate(dofs) if i not in light}
    states: dict[str, str] = {}
    for i, dof in enumerate(dofs):
        terms = [*((c[i][j], rate) for j, rate in rates.items()), *zip(k[i], dofs, strict=True)]
        products = [f"({value})*{name}" for value, name in terms if value != "0"]
        rate = " - ".join([f"({force.get(dof, 0)})", *products])
        states |= {dof: rate} if i in light else {dof: rates[i], rates[i]: rate}
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
    places = [*states]
    inertia = sympy.eye(len(states))
    for i, j in np.ndindex(n, n):
        # forces of the rates of what has a mass stand on the right, those of the others here
        entries, what = (c, "damping") if j in light else (m, "mass")
        if i not in light or j in light:
            row, column = (
                places.index(x if at in light else f"v_{x}") for at, x in ((i, dofs[i]), (j, dofs[j]))
            )
            where = f"{what} matrix, row {i + 1}"
            inertia[row, column] = read_expression(entries[i][j], where, estimate, plain.known)
    model = replace(plain, inertia=tuple(inertia))
    # refuses a singular mass matrix
    model.inverse(model.start)
    return model


def _entries(matrix: Matrix, what: str) -> list[list[str]]:
    """Texts of a matrix."""
    if not len(matrix) or any(len(row) != len(matrix) for row in matrix):
        raise ValueError(f"the {what} matrix must be square, (n, n)")
    return [[v if isinstance(v, str) else repr(float(v)) if v else "0" for v in row] for row in matrix]
