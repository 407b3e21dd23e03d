"""The equations of motion of a rotor as plain matrices, and as a linear state space.

In M q'' + C q' + K q = f some coordinates move no mass: nodes of a massless shaft, feet without mass.
Singular vectors V of the columns of their damping part them in a, which is damped, and b, which is not:
q₂ = V (a, b); the equations are multiplied by Uᵀ, C₂₂ V = U R, so that those of b are free of a'. Each kind
is solved in turn: K for b, C for a', M for the acceleration of what has mass. The states are q₁, q₁' and a.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from fem.assembly import both_planes, project
from fem.result import holding_arrays
from fem.rotor import Rotor
from rotorid.base.arrays import ComplexArray, FloatArray, number


@holding_arrays
class Motion:
    """M q'' + C q' + K q = f of a rotor at one speed; real, in SI.

    Attributes
    ----------
    M, C, K
        Mass, damping (with the gyroscopic effect) and stiffness, shape (n, n).
    coordinates
        Name of each unknown: `x3` and `y3` are the deflections of node 3, m; `tilt_x3` and `tilt_y3` the tilt
        of the cross-section there (the slope dx/dz without shear); with shear `left_x3` and `right_x3` the
        shear angles at the ends of element 3; `foot_x1` and `foot_y1` the pedestal of the first support, m.
    speed
        rad/s.
    """

    M: FloatArray
    C: FloatArray
    K: FloatArray
    coordinates: tuple[str, ...]
    speed: float

    def index(self, name: str) -> int:
        """Index of an unknown by its name, from 0.

        Raises
        ------
        ValueError
            For an unknown that does not exist.
        """
        return _places([name], self.coordinates, "unknown")[0]


def equations_of_motion(rotor: Rotor, *, speed: float = 0.0, plane: str = "both") -> Motion:
    """Mass, damping and stiffness matrices of a rotor.

    Parameters
    ----------
    rotor
        With all that its model holds; tables of supports are read at `speed`.
    speed
        rad/s.
    plane
        "both", or "x" alone: without gyroscopic effect and coupling between the planes, so only for a rotor
        that has neither.

    Raises
    ------
    ValueError
        A plane that does not exist or is coupled to the other, a speed that is not finite, negative, or
        outside the table of a support, forces that are not linear.

    Examples
    --------
    >>> from fem import Rotor, Support
    >>> shaft = Rotor(length=[0.5, 0.5], outer_diameter=0.05, supports=[Support(1, 1e7), Support(3, 1e7)])
    >>> motion = equations_of_motion(shaft, plane="x")
    >>> motion.coordinates
    ('x1', 'tilt_x1', 'x2', 'tilt_x2', 'x3', 'tilt_x3')

    Notes
    -----
    The signs are those of `fem.assembly`: rotation from x to y; M y'' … − Ω G x'.
    """
    if plane not in ("both", "x"):
        raise ValueError(f"no plane {plane!r}: it is 'both' or 'x'")
    speed = number(speed, "speed")
    P = both_planes(rotor, complex_coordinate=False)
    equations, kinds, stride = project(P, np.eye(P.A.size)), ("", "tilt_", "left_", "right_"), P.A.stride
    names = [f"{kinds[i % stride]}{axis}{i // stride + 1}" for axis in "xy" for i in range(P.A.size)]
    names += [f"foot_{axis}{i + 1}" for axis in "xy" for i in P.pedestals]
    taken = np.array([plane == "both" or "x" in name for name in names])
    D, K = (matrix[0] for matrix in equations.at(np.array([speed])))
    if any(matrix[taken][:, ~taken].any() for matrix in (D, K)):
        raise ValueError("the planes x and y of this rotor are coupled: take both")
    M, D, K = (matrix[np.ix_(taken, taken)] for matrix in (equations.M, D, K))
    return Motion(M, D, K, tuple(itertools.compress(names, taken)), speed)


@holding_arrays
class StateSpace:
    """s' = A s + B u, y = C s + D u.

    It unpacks into A, B, C, D: `scipy.signal.StateSpace(*model)` and `control.ss(*model)` take it.

    Attributes
    ----------
    A, B, C, D
        Shapes (n, n), (n, inputs), (outputs, n), (outputs, inputs); SI.
    states
        Names: `x7` a deflection, `v_x7` its velocity; `damped1` … massless coordinates that are damped, or
        combinations of them.
    inputs
        `f_x7` is a force on coordinate `x7`, N (on a tilt: N·m).
    outputs
        `x7` or `v_x7`.
    speed
        Of rotation, for which A holds, rad/s.
    """

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    speed: float = 0.0

    def __iter__(self) -> Iterator[FloatArray]:
        """A, B, C, D."""
        return iter((self.A, self.B, self.C, self.D))

    @property
    def eigenvalues(self) -> ComplexArray:
        """Eigenvalues of A, 1/s, by rising frequency |Im|, then real part, shape (n,)."""
        # From the last state: what is fast stands first, and the slow keep their digits.
        values = np.linalg.eigvals(self.A[::-1, ::-1]).astype(complex)
        return values[np.lexsort((values.imag, values.real, np.abs(values.imag)))]

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "speed_rad_s": self.speed,
            **{name: list(getattr(self, name)) for name in ("states", "inputs", "outputs")},
            **{name: matrix.tolist() for name, matrix in zip("ABCD", self, strict=True)},
        }


def state_space(
    motion: Motion, *, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None
) -> StateSpace:
    """Write equations of motion as a state space.

    Parameters
    ----------
    motion
        Coordinates with zero row and column of M are massless: they become states of first order where they
        are damped, and are eliminated where not.
    inputs
        Forces, `f_x7` on the coordinate `x7`; by default on every coordinate.
    outputs
        `x7` for a deflection, `v_x7` for the velocity of a coordinate with mass; by default every deflection.

    Raises
    ------
    ValueError
        For names that do not exist, numbers that are not finite, a singular mass matrix without a zero row,
        and massless coordinates that nothing holds or whose velocity acts without being damped.

    Examples
    --------
    >>> import numpy as np
    >>> from fem import Motion
    >>> one = Motion(np.array([[2.0]]), np.array([[4.0]]), np.array([[26.0]]), ("x1",), 0.0)
    >>> model = state_space(one)
    >>> model.states, model.inputs, model.outputs
    (('x1', 'v_x1'), ('f_x1',), ('x1',))
    >>> model.eigenvalues
    array([-1.-3.46410162j, -1.+3.46410162j])
    """
    names, n = motion.coordinates, len(motion.coordinates)
    M, C, K = matrices = np.array([motion.M, motion.C, motion.K], dtype=float)
    if matrices.shape != (3, n, n) or not np.isfinite(matrices).all():
        raise ValueError(f"a state space of {n} coordinates needs finite matrices, {n} × {n}")
    massive = M.any(axis=0) | M.any(axis=1)
    one, two = np.flatnonzero(massive), np.flatnonzero(~massive)
    every, velocities = [f"f_{name}" for name in names], [f"v_{names[i]}" for i in one]
    inputs = tuple(every if inputs is None else inputs)
    outputs = tuple(names if outputs is None else outputs)
    forces, shown = _places(inputs, every, "input"), _places(outputs, [*names, *velocities], "output")

    U, V, light = np.eye(n), np.eye(n), np.ix_(two, two)
    _, sigma, right = np.linalg.svd(C[:, two])
    V[light] = right.T
    U[light] = np.linalg.qr(C[light] @ right.T)[0]
    C, K = U.T @ C @ V, U.T @ K @ V
    damped, free = np.split(two, [np.count_nonzero(sigma > 1e-12 * sigma.max(initial=0.0))])
    states = (*(names[i] for i in one), *velocities, *(f"damped{i + 1}" for i in range(damped.size)))
    order = len(states)
    # Over the states and the inputs.
    q, v, rate, load = np.zeros((4, n, order + len(inputs)))
    q[one], v[one], q[damped] = np.split(np.eye(order, q.shape[1]), [one.size, 2 * one.size])
    load[:, order:] = U.T[:, forces]
    for unknown, matrix, rows, what in (
        (q, K, free, "massless coordinates are held neither by stiffness nor by damping"),
        (v, C, damped, "velocities of massless coordinates act on others, but are not damped themselves"),
        (rate, M, one, "the mass matrix is singular without a zero row, as with shear but no rotary inertia"),
    ):
        square = matrix[np.ix_(rows, rows)]
        scale = np.abs(square).max(axis=1, initial=1e-300, keepdims=True)
        if np.linalg.matrix_rank(square / scale, 1e-12) < rows.size:
            raise ValueError(f"{what}: there is no state space")
        unknown[rows] = np.linalg.solve(square, (load - C @ v - K @ q)[rows])
    A, B = np.split(np.vstack((v[one], rate[one], v[damped])), [order], axis=1)
    Y, D = np.split(np.vstack((V @ q, v[one]))[shown], [order], axis=1)
    return StateSpace(A, B, Y, D, states, inputs, outputs, motion.speed)


def _places(chosen: Sequence[str], names: Sequence[str], what: str) -> list[int]:
    """Indices of the chosen names among the names there are."""
    for name in chosen:
        if name not in names:
            raise ValueError(f"no {what} {name!r}: they are {names[0]} … {names[-1]}")
    return [names.index(name) for name in chosen]
