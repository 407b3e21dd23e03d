"""The equations of motion of a rotor as plain matrices, and as a linear state space.

In M q'' + C q' + K q = f let q₁ be the coordinates that move mass and q₂ the others, with zero rows and
columns of M: nodes of a massless shaft, feet of massless pedestals. Singular vectors of their damping,
Uᵀ C₂₂ V = Σ, part them in q₂ = V_a a + V_b b: a is damped, b is not. With v = q₁' and the signs of
`fem.assembly` (rotation from x to y: M x'' + Ω G y' …, M y'' − Ω G x' …)

    (U_bᵀ K₂₂ V_b) b = U_bᵀ (f₂ − C₂₁ v − K₂₁ q₁ − K₂₂ V_a a)
    Σ_a a'           = U_aᵀ (f₂ − C₂₁ v − K₂₁ q₁ − K₂₂ q₂)
    M₁₁ v'           = f₁ − C₁₁ v − C₁₂ V_a a' − K₁₁ q₁ − K₁₂ q₂

where C₁₂ V_b = 0: what does no negative work has no force by a velocity that is not damped itself. The states
are q₁, v and a.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem.assembly import both_planes, project
from fem.rotor import Rotor
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.checks import number

__all__ = ["Motion", "StateSpace", "equations_of_motion", "state_space"]


@dataclass(frozen=True, eq=False)
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
        """Where an unknown stands, from 0.

        Raises
        ------
        ValueError
            For an unknown that does not exist.
        """
        if name not in self.coordinates:
            raise ValueError(f"no unknown {name!r}: they are {self.coordinates[0]} … {self.coordinates[-1]}")
        return self.coordinates.index(name)


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
    equations = project(P, np.eye(P.A.size))
    M, (C, K) = equations.M, (X[0] for X in equations.at(np.array([speed])))
    kinds = ("", "tilt_", "left_", "right_")
    shaft = [(kinds[i % P.A.stride], i // P.A.stride + 1) for i in range(P.A.size)]
    feet = [("foot_", int(i) + 1) for i in P.pedestals]
    names = np.array([f"{kind}{axis}{i}" for part in (shaft, feet) for axis in "xy" for kind, i in part])
    if plane == "x":
        in_x = np.array([name.split("_")[-1].startswith("x") for name in names])
        if any(X[np.ix_(in_x, ~in_x)].any() for X in (C, K)):
            raise ValueError("the planes x and y of this rotor are coupled: take both")
        (M, C, K), names = (X[np.ix_(in_x, in_x)] for X in (M, C, K)), names[in_x]
    return Motion(M, C, K, tuple(names.tolist()), speed)


@dataclass(frozen=True, eq=False)
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
        """Of A, 1/s, by rising frequency |Im|, then real part, shape (n,)."""
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
        `x7` for a deflection, `v_x7` for a velocity; by default every deflection.

    Raises
    ------
    ValueError
        For names that do not exist or repeat, numbers that are not finite, a singular mass matrix without a
        zero row, massless coordinates that nothing holds or whose velocity acts without being damped, or as
        output the velocity of a coordinate with neither mass nor damping.

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
    matrices = np.array([motion.M, motion.C, motion.K], dtype=float)
    if matrices.shape != (3, n, n) or not np.isfinite(matrices).all() or len(set(names)) < n:
        raise ValueError(
            "a state space needs coordinates with different names, and M, C and K of finite numbers, "
            f"{n} × {n} for {n} coordinates"
        )
    M, C, K = matrices
    every = tuple(f"f_{name}" for name in names)
    inputs = every if inputs is None else tuple(inputs)
    outputs = names if outputs is None else tuple(outputs)
    forces = _places(inputs, every, "input")
    shown = _places(outputs, [*names, *(f"v_{name}" for name in names)], "output")
    massive = M.any(axis=0) | M.any(axis=1)
    one, two = np.flatnonzero(massive), np.flatnonzero(~massive)
    light = np.ix_(two, two)
    size, rate = np.sqrt(np.abs(K).max(axis=1)), np.sqrt(np.abs(K).max() / (np.abs(M).max() or 1.0))
    unit = 1 / np.where(size > 0, size, 1.0)[two]
    W, sigma, Vt = np.linalg.svd(unit[:, None] * C[light] * unit)
    rank = int(np.count_nonzero(rate * sigma > 1e-13))  # the rounding of stiffness damps nothing
    (Va, Vb), (Ua, Ub) = (np.split(unit[:, None] * X, [rank], axis=1) for X in (Vt.T, W))
    if (rate * np.abs(C[np.ix_(one, two)] @ Vb) > 1e-9 * size[one, None]).any():
        raise ValueError(
            "the velocity of a massless coordinate acts on others without being damped itself: there is no "
            "state space with velocities; make the damping symmetric, or give the coordinate mass"
        )
    at_once = two[(np.abs(Vt[rank:]) > 1e-9).any(axis=0)]
    for name, place in zip(outputs, shown, strict=True):
        if place - n in at_once:
            raise ValueError(
                f"output {name!r}: {name[2:]!r} has neither mass nor damping and follows forces at once: its "
                "velocity holds their derivatives; ask for its deflection, or give it mass or damping"
            )

    # Rows over the states q₁, v, a and the inputs.
    states = [*(names[i] for i in one), *(f"v_{names[i]}" for i in one)]
    states += [f"damped{i + 1}" for i in range(rank)]
    order = len(states)
    width = order + len(forces)
    q, velocity, load = np.zeros((3, n, width))
    q[one], velocity[one], a, load[forces] = np.split(np.eye(width), np.cumsum([one.size, one.size, rank]))
    q[two] = Va @ a
    q[two] += Vb @ _solved(
        Ub.T @ K[light] @ Vb,
        Ub.T @ (load - C @ velocity - K @ q)[two],
        "some massless coordinates are held neither by stiffness nor by damping, or move only with "
        "derivatives of the forces (an index above 1): there is no state space; give them mass, damping "
        "or stiffness",
    )
    damped = Ua.T @ (load - C @ velocity - K @ q)[two] / sigma[:rank, None]
    velocity[two] = Va @ damped
    rate_v = _solved(
        M[np.ix_(one, one)],
        (load - C @ velocity - K @ q)[one],
        "the mass matrix is singular without a zero row (as with shear but without rotary inertia): "
        "there is no state space of it; give every combination of its coordinates mass",
    )
    rates, readings = np.vstack((velocity[one], rate_v, damped)), np.vstack((q, velocity))[shown]
    A, B, Y, D = (part for rows in (rates, readings) for part in np.split(rows, [order], axis=1))
    return StateSpace(A, B, Y, D, tuple(states), inputs, outputs, motion.speed)


def _places(chosen: Sequence[str], names: Sequence[str], what: str) -> list[int]:
    """Where names of inputs or outputs stand."""
    for name in chosen:
        if name not in names or chosen.count(name) > 1:
            raise ValueError(f"no {what} {name!r}, or it is named more than once: {names[0]} … {names[-1]}")
    return [names.index(name) for name in chosen]


def _solved(matrix: FloatArray, right: FloatArray, reason: str) -> FloatArray:
    """The solution with a matrix that is regular in the scale of its rows; else the reason is raised."""
    scale = 1 / np.sqrt(np.abs(matrix).max(axis=1, initial=1e-300))
    if matrix.size and np.linalg.cond(scale[:, None] * matrix * scale, 1) > 1e12:
        raise ValueError(reason)
    return np.asarray(np.linalg.solve(matrix, right))
