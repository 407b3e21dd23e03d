"""Equations of motion as a linear state space, massless coordinates included.

M q'' + C q' + K q = f, with coordinates q₁ that move mass and q₂ that do not (zero row and column of M); C
and K need not be symmetric: gyroscopic terms and cross-coupling stand in them with the signs of
`fem.matrices.lateral_planes` (rotation from x to y: M x'' + Ω G y' …, M y'' − Ω G x' …). The signs of the
state space follow from

    M₁₁ q₁'' + C₁₁ q₁' + C₁₂ q₂' + K₁₁ q₁ + K₁₂ q₂ = f₁
               C₂₁ q₁' + C₂₂ q₂' + K₂₁ q₁ + K₂₂ q₂ = f₂.

C₂₂ need not be regular. With its null spaces, C₂₂ V_b = 0 and U_bᵀ C₂₂ = 0, the massless coordinates are
q₂ = V_a a + V_b b: a is damped and becomes a state of first order, b is not and follows from the algebraic
rows U_bᵀ:

    M₁₁ v'                  = f₁ − C₁₁ v − C₁₂ V_a a' − K₁₁ q₁ − K₁₂ q₂
    (U_aᵀ C₂₂ V_a) a'       = U_aᵀ (f₂ − C₂₁ v − K₂₁ q₁ − K₂₂ q₂)
    (U_bᵀ K₂₂ V_b) b        = U_bᵀ (f₂ − C₂₁ v − K₂₁ q₁ − K₂₂ V_a a).

The last matrix must be regular; else the motion depends on derivatives of the forces (an index above 1) or is
not determined at all, and is refused. So is damping by the velocity of b, C₁₂ V_b ≠ 0: dampers, seals and
gyroscopic moments of a rotor have none, as what does no negative work cannot.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem.matrices.equations_of_motion import Motion
from fem.matrices.massless import ZERO, eigenvalues, massive_first, scales, solved, split_by_damping
from rotorid.base.arrays import ComplexArray, FloatArray


@dataclass(frozen=True, eq=False)
class StateSpace:
    """s' = A s + B u, y = C s + D u.

    It unpacks into A, B, C, D: `scipy.signal.StateSpace(*model)` and `control.ss(*model)` take it.

    Attributes
    ----------
    A, B, C, D
        Shapes (n, n), (n, inputs), (outputs, n), (outputs, inputs); SI.
    states
        Names: `x7` a deflection, `v_x7` its velocity; `damped1` … combinations of massless coordinates where
        damping acts on combinations only.
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
        values = eigenvalues(self.A)
        return values[np.lexsort((values.imag, values.real, np.abs(values.imag)))]

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "speed_rad_s": self.speed,
            "states": list(self.states),
            "inputs": list(self.inputs),
            "outputs": list(self.outputs),
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
        output the velocity of a massless undamped coordinate that follows a force at once.

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
    M, C, K = _checked(motion)
    names = motion.coordinates
    chosen_inputs = tuple(f"f_{name}" for name in names) if inputs is None else _listed(inputs, "input")
    chosen_outputs = names if outputs is None else _listed(outputs, "output")
    forces = [_force(name, motion) for name in chosen_inputs]
    picked = [_output(name, motion) for name in chosen_outputs]

    order, n1 = massive_first(M)
    M, C, K = (matrix[np.ix_(order, order)] for matrix in (M, C, K))
    mass, F = M[:n1, :n1], np.eye(len(names))[order][:, forces]
    scale, omega = scales(M, C, K)
    C11, C12, C21, C22 = _blocks(C, n1)
    K11, K12, K21, K22 = _blocks(K, n1)
    F1, F2 = F[:n1], F[n1:]
    ordered = [names[i] for i in order]
    split = split_by_damping(C22, scale[n1:], omega, ordered[n1:])
    Va, Vb, Ua, Ub = split.Va, split.Vb, split.Ua, split.Ub
    na = Va.shape[1]

    if (omega * scale[:n1, None] * np.abs(C12 @ Vb) > ZERO).any():
        raise ValueError(
            "the velocity of a massless coordinate acts on others without being damped itself: there is no "
            "state space with velocities; make the damping symmetric, or give the coordinate mass"
        )

    # Rows over the unknowns (q₁, v, a) and u.
    n = 2 * n1 + na
    width = n + len(forces)
    Q1, v, A_, U = np.split(np.eye(width), [n1, 2 * n1, n])
    b = solved(Ub.T @ K22 @ Vb, Ub.T @ (F2 @ U - K21 @ Q1 - K22 @ Va @ A_ - C21 @ v))
    q2 = Va @ A_ + Vb @ b
    rate_a = np.linalg.solve(Ua.T @ C22 @ Va, Ua.T @ (F2 @ U - C21 @ v - K21 @ Q1 - K22 @ q2))
    rate_v = np.linalg.solve(mass, F1 @ U - C11 @ v - C12 @ Va @ rate_a - K11 @ Q1 - K12 @ q2)
    S = np.vstack((v, rate_v, rate_a))

    back = np.argsort(order)
    deflections, velocities = np.vstack((Q1, q2))[back], np.vstack((v, Va @ rate_a))[back]
    algebraic = np.concatenate((np.zeros(n1, dtype=bool), np.abs(Vb).max(axis=1, initial=0.0) > 0))[back]
    velocities[algebraic] = deflections[algebraic, :n] @ S  # unless a force stands in the deflection
    size = scale[back]
    rows = []
    for name, (kind, i) in zip(chosen_outputs, picked, strict=True):
        direct = np.abs(deflections[i, n:]) > ZERO * size[i] * size[forces]
        if kind == "v" and algebraic[i] and direct.any():
            raise ValueError(
                f"output {name!r}: {names[i]!r} has neither mass nor damping of its own and follows "
                f"{chosen_inputs[int(np.argmax(direct))]!r} at once, so its velocity holds the derivative of "
                "this force; take the deflection, leave out the force, or give it mass or damping"
            )
        rows.append(velocities[i] if kind == "v" else deflections[i])
    Y = np.array(rows).reshape(len(rows), width)
    states = (*ordered[:n1], *(f"v_{name}" for name in ordered[:n1]), *split.names)
    return StateSpace(
        S[:, :n], S[:, n:], Y[:, :n], Y[:, n:], states, chosen_inputs, tuple(chosen_outputs), motion.speed
    )


def _blocks(matrix: FloatArray, n: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    return matrix[:n, :n], matrix[:n, n:], matrix[n:, :n], matrix[n:, n:]


def _checked(motion: Motion) -> tuple[FloatArray, FloatArray, FloatArray]:
    n = len(motion.coordinates)
    if not n:
        raise ValueError("there are no coordinates: a state space needs at least one")
    if len(set(motion.coordinates)) != n:
        raise ValueError("two coordinates have the same name: give each its own")
    for name in "MCK":
        matrix = np.asarray(getattr(motion, name))
        if matrix.shape != (n, n):
            raise ValueError(f"{name} must be {n} × {n} for {n} coordinates, not of shape {matrix.shape}")
        if not np.isfinite(matrix).all():
            raise ValueError(f"{name} holds numbers that are not finite")
    return tuple(np.asarray(getattr(motion, name), dtype=float) for name in "MCK")  # type: ignore[return-value]


def _listed(names: Sequence[str], what: str) -> tuple[str, ...]:
    if isinstance(names, str):
        raise ValueError(f"{what}s must be a list of names, not the one name {names!r}")
    listed = tuple(names)
    repeated = [name for name in listed if listed.count(name) > 1]
    if repeated:
        raise ValueError(f"{what} {repeated[0]!r} is named more than once")
    return listed


def _force(name: str, motion: Motion) -> int:
    plain = name.removeprefix("f_")
    if not name.startswith("f_") or plain not in motion.coordinates:
        c = motion.coordinates
        raise ValueError(f"no input {name!r}: inputs are forces, f_{c[0]} … f_{c[-1]}")
    return motion.index(plain)


def _output(name: str, motion: Motion) -> tuple[str, int]:
    if name in motion.coordinates:
        return "q", motion.index(name)
    plain = name.removeprefix("v_")
    if not name.startswith("v_") or plain not in motion.coordinates:
        c = motion.coordinates
        raise ValueError(
            f"no output {name!r}: outputs are deflections, {c[0]} … {c[-1]}, or velocities, v_{c[0]} …"
        )
    return "v", motion.index(plain)
