"""Second-order systems from matrices: M x'' + C x' + K x = f."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import FloatArray
from rotorid.timedomain.models.compiled import Compiled
from rotorid.timedomain.models.model_text import Reader
from rotorid.timedomain.models.ode_model import OdeModel, ode_model
from rotorid.timedomain.models.simulation_errors import SimulationError

Matrix = Sequence[Sequence[float | str]] | FloatArray
"""Numbers or expressions of parameters, (n, n)."""


@dataclass(frozen=True, eq=False)
class SecondOrderModel(OdeModel):
    """E(θ) dx/dt = r(t, x, θ, u), where E has the mass matrix; made by `second_order`.

    E is solved numerically: no matrix of symbols is inverted. `rates` are r.

    Attributes
    ----------
    inertia
        E as expressions, row by row.
    """

    inertia: tuple[Any, ...] = field(repr=False, default=())

    rates_alone: ClassVar[bool] = False

    def _rates(self, by: str, t: ArrayLike, x: ArrayLike, theta: ArrayLike, u: ArrayLike) -> FloatArray:
        table, (inverse, slopes) = super()._rates(by, t, x, theta, u), self._inverse(theta)
        if not by:
            return np.asarray(table @ inverse.T)
        if by == "parameters":
            table = table - np.einsum("pij,...j->...ip", slopes, self.f(t, x, theta, u))
        return np.asarray(inverse @ table)

    def rate(self, t: float, x: FloatArray, theta: FloatArray, u: FloatArray) -> FloatArray:
        """Rates at one point, quickly, (n_x,)."""
        return np.asarray(self._inverse(theta)[0] @ super().rate(t, x, theta, u))

    def point(self, t: float, x: FloatArray, theta: FloatArray, u: FloatArray) -> FloatArray:
        """Rates and their derivatives f_x and f_θ at one point, quickly, (n_x, 1 + n_x + n_p)."""
        inverse, slopes = self._inverse(theta)
        table = np.asarray(inverse @ super().point(t, x, theta, u))
        table[:, 1 + len(x) :] -= inverse @ (slopes @ table[:, 0]).T
        return table

    def matrices(self, theta: ArrayLike) -> FloatArray:
        """[A b B], then its derivatives by each parameter, (1 + n_p, n_x, n_x + 1 + n_u)."""
        table, (inverse, slopes) = super().matrices(theta), self._inverse(theta)
        table[0] = inverse @ table[0]
        table[1:] = inverse @ (table[1:] - slopes @ table[0])
        return table

    @cached_property
    def _compiled_inertia(self) -> Compiled:
        n, parameters = len(self.states), self._symbols["parameters"]
        slopes = [e.diff(p) for p in parameters for e in self.inertia]
        return Compiled(parameters, [*self.inertia, *slopes], (1 + len(parameters), n, n))

    def _inverse(self, theta: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """E⁻¹ and ∂E/∂θ (n_p, n_x, n_x), kept for the latest parameters."""
        values = self._theta(theta)
        key = values.tobytes()
        if self.machine.get("inertia", [None])[0] != key:
            table = self._compiled_inertia.one(values.tolist())
            if not np.isfinite(table).all() or np.linalg.cond(table[0]) > 1e14:
                shown = ", ".join(f"{n} = {v:.4g}" for n, v in zip(self.parameters, values, strict=True))
                raise SimulationError(f"the mass matrix is singular at {shown or 'the known values'}")
            self.machine["inertia"] = key, np.linalg.inv(table[0]), table[1:]
        _, inverse, slopes = self.machine["inertia"]
        return inverse, slopes


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
) -> SecondOrderModel:
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
    >>> model.states, model.linear
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
    m, c, k = (_entries(x, w) for x, w in ((mass, "mass"), (damping, "damping"), (stiffness, "stiffness")))
    n = len(m)
    if not len(c) == len(k) == n:
        raise ValueError(f"the matrices have different sizes: mass {n}, damping {len(c)}, stiffness {len(k)}")
    dofs = tuple(names) if names is not None else tuple(f"y{i + 1}" for i in range(n))
    if len(dofs) != n:
        raise ValueError(f"{n} names of displacements are needed, not {len(dofs)}")
    for matrix, added, what in ((m, masses, "masses"), (c, dampers, "dampers"), (k, springs, "springs")):
        _to_ground(matrix, added or {}, dofs, what)
    speeds = tuple(f"v_{name}" for name in dofs)
    force = dict(force or {})
    if extra := [name for name in force if name not in dofs]:
        raise ValueError(f"force: {extra[0]} is no displacement; displacements are {', '.join(dofs)}")
    states: dict[str, str] = {}
    for i, (dof, speed) in enumerate(zip(dofs, speeds, strict=True)):
        terms = [f"({force.get(dof, 0)})"]
        terms += [f"({c[i][j]})*{speeds[j]}" for j in range(n) if c[i][j] != "0"]
        terms += [f"({k[i][j]})*{dofs[j]}" for j in range(n) if k[i][j] != "0"]
        states[dof], states[speed] = speed, " - ".join(terms)
    start = dict.fromkeys(states, 0.0) | dict(initial or {})
    observed = dict(outputs) if outputs else {name: name for name in dofs}
    shared: dict[str, Any] = {"known": known, "estimate": estimate, "inputs": inputs, "bounds": bounds}
    shared["per_record"] = per_record
    plain = ode_model(states, initial=start, outputs=observed, **shared)
    read = Reader({name: Fraction(repr(value)) for name, value in plain.known.items()})
    cells = [[read(m[i][j], f"mass matrix, row {i + 1}", set(estimate)) for j in range(n)] for i in range(n)]
    zero, one = (read(number, "mass matrix", set()) for number in ("0", "1"))
    table = [[one if i == j else zero for j in range(2 * n)] for i in range(2 * n)]
    for i, row in enumerate(cells):
        table[2 * i + 1][1::2] = row
    parts = {f.name: getattr(plain, f.name) for f in fields(plain)}
    model = SecondOrderModel(**parts, inertia=tuple(e for row in table for e in row))
    model.f(0.0, np.zeros(2 * n), model.start, np.zeros(len(model.inputs)))  # a singular mass matrix
    return model


def _to_ground(
    matrix: list[list[str]], added: Mapping[str, float | str], dofs: tuple[str, ...], what: str
) -> None:
    """Add entries to the diagonal of a matrix."""
    for name, value in added.items():
        if name not in dofs:
            raise ValueError(f"{what}: {name} is no displacement; displacements are {', '.join(dofs)}")
        i = dofs.index(name)
        matrix[i][i] = f"({matrix[i][i]}) + ({_entry(value, f'{what}, {name}')})"


def _entries(matrix: Matrix, what: str) -> list[list[str]]:
    rows = [list(row) for row in matrix]
    if not rows or any(len(row) != len(rows) for row in rows):
        raise ValueError(f"the {what} matrix must be square, (n, n)")
    return [[_entry(value, f"{what} matrix, row {i + 1}") for value in row] for i, row in enumerate(rows)]


def _entry(value: float | str, where: str) -> str:
    if isinstance(value, str):
        return value
    if not np.isfinite(value):
        raise ValueError(f"{where}: {value} is no finite number")
    return "0" if value == 0 else repr(float(value))
