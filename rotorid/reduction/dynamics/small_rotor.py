"""A rotor as a few masses on a massless shaft, with its supports, material damping and gyroscopic effect.

The deflections of the masses and of all supported nodes are kept; between them the shaft hangs statically.
With T the static shapes of the shaft, one column for a unit deflection of each kept node (all others held),
the equations of `fem.assembly` in the basis T read, per plane with M = diag(m) (zero at a
support without a mass), B = Tᵀ B T, G = Tᵀ G T, K = Tᵀ K T and rotation from x to y,

    x:  M x'' + (B + C) x' + Ω G y' + K x + Ω B y + supports = f_x
    y:  M y'' + (B + C) y' − Ω G x' + K y − Ω B x + supports = f_y.

Supports and pedestals stand at their places and act as in the whole rotor, so that they stay parameters of
the small model. C is the modal damping, of the surroundings: it does not turn.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

import fem
from fem import StateSpace
from fem.assembly import Reduced, both_planes, project
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.checks import checked_speeds
from rotorid.base.text import counted
from rotorid.reduction.dynamics.condensation import (
    condensed,
    damping_ratios,
    external_damping,
    left_out,
    static_shapes,
)

if TYPE_CHECKING:
    import pandas as pd

Plane = Literal["both", "x"]
Supports = Literal["kept", "condensed"]

_INFINITE = 1e13  # response times largest stiffness, per unit force: beyond, only rounding is left


@dataclass(frozen=True, eq=False)
class SmallRotor(Answered):
    """Masses at some nodes of a rotor; made by `small_rotor`.

    Attributes
    ----------
    rotor
        The rotor it stands for.
    nodes
        Where the masses are, n of them.
    masses
        kg, shape (n,).
    modal_damping
        Damping ratios of the first modes of each plane at rest.
    kept
        Nodes of the masses, then those that only carry supports; k of them.
    shapes
        Static deflections of all nodes, one column for each kept node, shape (N, k).
    shaft_stiffness
        Of the shaft between the kept nodes, without supports, one plane, N/m, shape (k, k).
    quadratic
        The equations in both planes, without the modal damping; for other functions of this package.
    external
        The damping matrix of `modal_damping` in the order of `quadratic`, N·s/m.
    warnings
        What the reader must know.
    """

    rotor: fem.Rotor
    nodes: tuple[int, ...]
    masses: FloatArray
    modal_damping: tuple[float, ...]
    kept: tuple[int, ...]
    shapes: FloatArray
    shaft_stiffness: FloatArray
    quadratic: Reduced
    external: FloatArray
    warnings: tuple[str, ...] = ()

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the unknowns: the masses in x, in y, supports without mass, feet of pedestals."""
        return tuple(name for name, _ in self._order())

    @property
    def undamped_modes(self) -> SmallRotor:
        """The same without modal damping, which the full rotor does not have either."""
        return replace(self, modal_damping=(), external=np.zeros_like(self.external))

    def motion(self, speed: float = 0.0, plane: Plane = "both", supports: Supports = "kept") -> fem.Motion:
        """Matrices of the equations of motion.

        Parameters
        ----------
        speed
            rad/s; tables of supports are read there.
        plane
            "both", or "x" alone where nothing couples the planes.
        supports
            "kept": supported nodes and feet without mass are unknowns with zero rows and columns of M;
            "condensed": they are eliminated, which is possible only where no damping acts on them, and exact
            but for gyroscopic moments: these follow the static shapes of shaft and supports then.

        Raises
        ------
        ValueError
            For an impossible speed or one outside a table, planes that are coupled, or damping on unknowns
            that are to be condensed.
        """
        if plane not in ("both", "x"):
            raise ValueError(f"no plane {plane!r}: it is 'both' or 'x'")
        if supports not in ("kept", "condensed"):
            raise ValueError(f"no way {supports!r} to treat supports: it is 'kept' or 'condensed'")
        D, K = (matrix[0] for matrix in self._at(checked_speeds([speed])))
        order = self._order()
        if plane == "x":
            inside = np.array([_plane(name) == "x" for name, _ in order])
            rows = np.array([i for _, i in order])
            across = np.ix_(rows[inside], rows[~inside])
            if D[across].any() or K[across].any():
                raise ValueError("the planes x and y of this rotor are coupled: take both")
            order = [item for item in order if _plane(item[0]) == "x"]
        pick = np.array([i for _, i in order])
        grid = np.ix_(pick, pick)
        motion = fem.Motion(
            self.quadratic.M[grid], D[grid], K[grid], tuple(name for name, _ in order), float(speed)
        )
        if supports == "kept":
            return motion
        return condensed(motion, float(speed) * self.quadratic.D1[grid])

    def state_space(
        self,
        speed: float = 0.0,
        *,
        plane: Plane = "both",
        inputs: Sequence[str] | None = None,
        outputs: Sequence[str] | None = None,
    ) -> StateSpace:
        """The model as s' = A s + B u, y = C s + D u at a speed.

        Parameters
        ----------
        speed, plane
            As in `motion`.
        inputs, outputs
            As in `fem.state_space`; by default forces on the masses and their deflections. Forces and
            deflections at the bearings have the names of their nodes, `f_x2` and `x2`.

        Raises
        ------
        ValueError
            As `motion` and `fem.state_space`.
        """
        motion = self.motion(speed, plane)
        masses = [f"{axis}{node}" for axis in ("xy" if plane == "both" else "x") for node in self.nodes]
        return fem.state_space(
            motion,
            inputs=[f"f_{name}" for name in masses] if inputs is None else inputs,
            outputs=masses if outputs is None else outputs,
        )

    def eigenvalues(self, speed: float = 0.0) -> ComplexArray:
        """All finite eigenvalues at a speed, 1/s, by rising frequency |Im|.

        Each mass gives two pairs. A support without mass adds a decay of its own where damping acts on it,
        and a pair far above the others where gyroscopic moments do.

        Raises
        ------
        ValueError
            For an impossible speed or one outside the table of a support.
        """
        return fem.state_space(self.motion(speed), inputs=(), outputs=()).eigenvalues

    def response(self, speeds: ArrayLike) -> ComplexArray:
        """Response of the masses to unbalance at the masses, as `fem.influence` defines it.

        Parameters
        ----------
        speeds
            rad/s, one or many; tables of supports are read there.

        Returns
        -------
        W, m per kg·m, shape (S, n, n): x at the mass of the row is Re(W U e^{iΩt}) for the unbalance U (kg·m,
        complex, phase with the rotation) at the mass of the column: f_x = Re(U Ω² e^{iΩt}), f_y = Im of it.

        Raises
        ------
        ValueError
            For impossible speeds, outside the table of a support, or exactly at an undamped critical speed.
        """
        return readings(self, checked_speeds(speeds))[:, : len(self.nodes)]

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "nodes": list(self.nodes),
            "masses_kg": self.masses.tolist(),
            "support_nodes": list(self.kept[len(self.nodes) :]),
            "modal_damping": list(self.modal_damping),
            "shaft_nodes": list(self.kept),
            "shaft_stiffness_N_per_m": self.shaft_stiffness.tolist(),
            "coordinates": list(self.coordinates),
            "warnings": list(self.warnings),
        }

    def to_frame(self) -> pd.DataFrame:
        """One row per mass: node, position, mass."""
        import pandas as pd

        positions = self.rotor.positions[np.array(self.nodes) - 1]
        return pd.DataFrame({"node": self.nodes, "position_m": positions, "mass_kg": self.masses})

    @property
    def answer(self) -> Answer:
        """Where its masses and supports stand."""
        said = f"{counted(len(self.nodes), 'mass', 'masses')} on a massless shaft, both planes"
        alone = self.kept[len(self.nodes) :]
        if alone:
            said += f"; supports without mass at node {', '.join(map(str, alone))}"
        if self.modal_damping:
            ratios = ", ".join(f"{100 * ratio:.3g} %" for ratio in self.modal_damping)
            said += f"; damping ratios of the first modes of each plane: {ratios}"
        return Answer(f"{said}.", warnings=self.warnings)

    def _at(self, speeds: FloatArray) -> tuple[FloatArray, FloatArray]:
        D, K = self.quadratic.at(speeds)
        return np.asarray(D + self.external), np.asarray(K)

    def _order(self) -> list[tuple[str, int]]:
        """Names of the unknowns, and where they stand in `quadratic`."""
        d, n, pedestals = len(self.kept), len(self.nodes), self.quadratic.P.pedestals
        out = [
            (f"{axis}{self.kept[k]}", plane * d + k)
            for part in (range(n), range(n, d))
            for plane, axis in enumerate("xy")
            for k in part
        ]
        out += [
            (f"foot_{axis}{int(node) + 1}", 2 * d + plane * len(pedestals) + k)
            for plane, axis in enumerate("xy")
            for k, node in enumerate(pedestals)
        ]
        return out


def small_rotor(
    rotor: fem.Rotor,
    nodes: Sequence[int | str],
    masses: ArrayLike,
    *,
    modal_damping: Sequence[float] = (),
    also: Sequence[int] = (),
) -> SmallRotor:
    """Put masses in place of a rotor's distributed mass; everything else stays where it is.

    Parameters
    ----------
    rotor
        The rotor with its supports.
    nodes
        Where the masses stand: different node numbers, from 1, or names of stations.
    masses
        kg, all positive, shape (n,), as `equivalent_masses` estimates them.
    modal_damping
        Damping ratios ζ of the first modes of each plane at rest without other damping (supports as at their
        lowest tabulated speed, without cross-coupling): C = Σ 2 ζ ω (M φ)(M φ)ᵀ / (φᵀ M φ).
    also
        Further nodes that are kept, without mass.

    Raises
    ------
    ValueError
        For nodes that do not exist or repeat, masses that are not positive, too few kept nodes to hold the
        shaft, impossible damping ratios, or a mesh too fine for float64.

    Notes
    -----
    Gyroscopic moments act on slopes, and these follow the kept deflections statically: right to first order
    in the speed. Where discs with I_p = 0.02 m² × mass shift whirl frequencies by 3 %, 0.3 % is missing.
    Inertia of tilting is in the masses as far as they were fitted to modes that know it; none is added.
    """
    places = tuple(rotor.node(node) for node in nodes)
    if not places or len(set(places)) != len(places):
        raise ValueError(f"the masses need different nodes; got {list(nodes)}")
    try:
        m = np.array(masses, dtype=float)
    except (TypeError, ValueError):
        raise ValueError("masses must be numbers in kg, one for each node") from None
    if m.shape != (len(places),):
        raise ValueError(f"{len(places)} nodes need as many masses, not an array of shape {m.shape}")
    for place, mass in zip(places, m, strict=True):
        if not (np.isfinite(mass) and mass > 0):
            raise ValueError(
                f"the mass at node {place} is {mass:.4g} kg, not positive: a physical model needs positive "
                "masses, use other nodes or more modes, or non-negative least squares, and leave out nodes "
                "without mass"
            )
    kept = (*places, *sorted({*also, *(s.node for s in rotor.supports)} - set(places)))
    T = static_shapes(rotor, kept)
    quadratic = project(both_planes(rotor, complex_coordinate=False), T)
    n, d = len(places), len(kept)
    M = quadratic.M.copy()
    M[: 2 * d, : 2 * d] = 0.0
    for plane in (0, 1):
        own = plane * d + np.arange(n)
        M[own, own] = m
    shaft = quadratic.K0[:d, :d].copy()
    for array in (M, m, shaft):
        array.flags.writeable = False
    quadratic = replace(quadratic, M=M)
    ratios = damping_ratios(modal_damping)
    return SmallRotor(
        rotor=rotor,
        nodes=places,
        masses=m,
        modal_damping=ratios,
        kept=kept,
        shapes=T[:: quadratic.P.A.stride],
        shaft_stiffness=shaft,
        quadratic=quadratic,
        external=external_damping(rotor, quadratic, ratios),
        warnings=left_out(rotor),
    )


def readings(small: SmallRotor, omega: FloatArray) -> ComplexArray:
    """`SmallRotor.response` at speeds, rad/s, shape (S,): in x, then in y, shape (S, 2 n, n)."""
    D, K = small._at(omega)
    n = len(small.nodes)
    own = np.arange(n)  # the masses are the first of the kept nodes
    in_y = len(small.kept) + own
    loads = np.zeros((len(omega), small.quadratic.size, n), dtype=complex)
    loads[:, own, own], loads[:, in_y, own] = 1.0, -1j
    w = omega[:, None, None]
    try:
        X = np.linalg.solve(K - w * w * small.quadratic.M + 1j * w * D, loads)
    except np.linalg.LinAlgError:
        X = np.full_like(loads, np.inf)
    if not np.abs(X).max() * np.abs(K).max() < _INFINITE:
        raise ValueError(
            "the undamped model runs exactly at a critical speed, or nothing holds it: the response is "
            "infinite; leave out this speed"
        )
    return np.asarray(w * w * X[:, np.concatenate((own, in_y))])


def _plane(name: str) -> str:
    """Plane of a coordinate: `x7`, `foot_y1`."""
    return name.removeprefix("foot_")[0]
