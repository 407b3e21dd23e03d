"""A rotor as a few masses: equivalent masses by regression, and how well the small model behaves.

Free vibration of n masses in compliance form ([S] (49)), with springs c to the ground at the masses
(seals), is `x + α (M x″ + C x) = 0`. In a mode (λ = 1/ω², shape U) this reads

    Σ_j α_ij U_jk m_j = λ_k (U_ik + Σ_j α_ij c_j U_jk)          for every mass i and mode k,

linear in the masses: formula (50) of [S]. The rows stand as in the book: unweighted, every shape scaled to
1 at the first mass.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

import fem
from fem.matrices import ignored_inertia
from rotorid.regression import Estimate, least_squares

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

FloatArray = NDArray[np.float64]

RAD_S_TO_RPM = 30.0 / np.pi

SENSITIVE = 0.1
"""A report warns where input errors of 1 % move a mass by more than this share."""

ALIKE = 0.9
"""Below this MAC two shapes are not those of one mode."""


def equivalent_masses(
    compliance: ArrayLike, frequencies: ArrayLike, shapes: ArrayLike, *, seal_stiffness: ArrayLike = 0.0
) -> Estimate:
    """Estimate the masses of an n-mass model from k modes, [S] (50).

    Parameters
    ----------
    compliance
        Deflection at mass i under unit force at mass j, m/N, shape (n, n), symmetric.
    frequencies
        Natural frequencies of the k modes, rad/s, shape (k,).
    shapes
        Mode shapes at the masses, shape (n, k); scaled to 1 at the first mass before use.
    seal_stiffness
        Of springs from each mass to the ground that `compliance` does not hold, N/m, shape (n,) or scalar.

    Returns
    -------
    Estimate of m1 … mn, kg.

    Raises
    ------
    ValueError
        For shapes that do not fit, frequencies that are not positive, or a mode with a node at the first
        mass (it cannot be scaled there).

    Examples
    --------
    >>> estimate = equivalent_masses([[2e-8, 1e-8], [1e-8, 2e-8]], [1e3], [[1.0], [1.0]])
    >>> estimate.values.round(3)
    array([33.333, 33.333])
    """
    alpha = np.asarray(compliance, dtype=float)
    omega = np.atleast_1d(np.asarray(frequencies, dtype=float))
    U = np.asarray(shapes, dtype=float)
    n = len(alpha)
    if alpha.shape != (n, n) or U.shape != (n, len(omega)):
        raise ValueError(
            f"compliance must be (n, n) and shapes (n, k) for k frequencies; got {alpha.shape}, {U.shape} "
            f"and {len(omega)} frequencies"
        )
    if not (omega > 0).all():
        raise ValueError("natural frequencies must be positive: a rigid-body mode determines no masses")
    if (np.abs(U[0]) < 1e-9 * np.abs(U).max(axis=0)).any():
        raise ValueError("a mode has a node at the first mass; choose another node for the first mass")
    U = U / U[0]
    springs = np.broadcast_to(np.asarray(seal_stiffness, dtype=float), (n,))
    B = np.concatenate([alpha * U[:, k] for k in range(len(omega))])
    D = ((U + alpha @ (springs[:, None] * U)) / omega**2).T.reshape(-1)
    return least_squares(B, D, names=[f"m{i + 1}" for i in range(n)])


def natural_frequencies(
    compliance: ArrayLike, masses: ArrayLike, *, seal_stiffness: ArrayLike = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Natural frequencies and shapes of a model in compliance form.

    Parameters
    ----------
    compliance, seal_stiffness
        As in `equivalent_masses`.
    masses
        kg, shape (n,). Masses that are zero or negative are taken as they are.

    Returns
    -------
    Frequencies, rad/s, ascending, shape (n,), NaN where a mode does not vibrate (only with masses that are
    not positive); shapes (n, n), a column per mode, scaled to the largest entry = 1.
    """
    alpha = np.asarray(compliance, dtype=float)
    m = np.asarray(masses, dtype=float)
    n = len(alpha)
    springs = np.broadcast_to(np.asarray(seal_stiffness, dtype=float), (n,))
    flexibility = np.linalg.solve(np.eye(n) + alpha * springs, alpha)
    flexibility = (flexibility + flexibility.T) / 2
    if (m > 0).all():
        root = np.sqrt(m)
        lam, vectors = np.linalg.eigh(root[:, None] * flexibility * root)
        shapes = vectors / root[:, None]
    else:
        complex_lam, complex_shapes = np.linalg.eig(flexibility * m)
        real = np.abs(complex_lam.imag) <= 1e-9 * np.abs(complex_lam)
        lam, shapes = np.where(real, complex_lam.real, np.nan), complex_shapes.real
    with np.errstate(divide="ignore", invalid="ignore"):
        omega = np.where(lam > 1e-15 * np.nanmax(np.abs(lam)), 1.0 / np.sqrt(lam), np.nan)
    order = np.argsort(omega)  # NaN last
    omega, shapes = omega[order], shapes[:, order]
    largest = np.take_along_axis(shapes, np.abs(shapes).argmax(axis=0)[None], axis=0)
    return omega, shapes / largest


def mac(a: ArrayLike, b: ArrayLike) -> FloatArray:
    """Modal assurance criterion between the columns of two sets of shapes.

    Parameters
    ----------
    a, b
        Shapes at the same points, (n, j) and (n, k).

    Returns
    -------
    (j, k), 1 where two shapes are proportional, 0 where they are orthogonal.

    Examples
    --------
    >>> mac([[1.0], [2.0]], [[2.0, 2.0], [4.0, -1.0]])
    array([[1., 0.]])
    """
    A, B = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    return np.asarray((A.T @ B) ** 2 / np.outer((A**2).sum(axis=0), (B**2).sum(axis=0)))


def mass_sensitivity(compliance: ArrayLike, frequencies: ArrayLike, shapes: ArrayLike) -> FloatArray:
    """Say how much errors of the inputs move the masses of (50).

    Parameters
    ----------
    compliance, frequencies, shapes
        As in `equivalent_masses`.

    Returns
    -------
    Standard deviation of each mass over its value, per unit relative standard deviation of every compliance
    (symmetric) and every shape ordinate except the first, all independent; shape (n,). First order.
    """
    alpha, omega = np.asarray(compliance, dtype=float), np.atleast_1d(np.asarray(frequencies, dtype=float))
    U = np.asarray(shapes, dtype=float)
    U = U / U[0]
    n, step = len(alpha), 1e-6
    variance = np.zeros(n)
    masses = equivalent_masses(alpha, omega, U).solution

    def add(change: FloatArray) -> None:
        nonlocal variance
        variance = variance + (change / (2 * step * masses)) ** 2

    for i in range(n):
        for j in range(i + 1):
            bump = np.ones((n, n))
            bump[i, j] = bump[j, i] = 1 + step
            up, down = alpha * bump, alpha * (2 - bump)
            add(equivalent_masses(up, omega, U).solution - equivalent_masses(down, omega, U).solution)
    for i in range(1, n):
        for k in range(len(omega)):
            bump = np.ones_like(U)
            bump[i, k] = 1 + step
            up, down = U * bump, U * (2 - bump)
            add(equivalent_masses(alpha, omega, up).solution - equivalent_masses(alpha, omega, down).solution)
    return np.asarray(np.sqrt(variance))


@dataclass(frozen=True, eq=False)
class Reduction:
    """An n-mass model of a rotor beside the rotor itself.

    Attributes
    ----------
    nodes, positions
        Where the masses stand: node numbers and m from the left end, shape (n,).
    modes
        How many modes of the rotor the regression used.
    masses
        The `Estimate` of formula (50), kg.
    sensitivity
        Relative standard deviation of each mass per relative standard deviation of the inputs, shape (n,).
    compliance
        m/N, shape (n, n).
    frequencies, shapes
        Of the n-mass model: rad/s (n,), and at the masses (n, n), scaled to fit the rotor's.
    rotor_frequencies, rotor_shapes
        Of the rotor's plane at rest: rad/s (n,), and at the masses (n, n).
    rotor_modes
        The rotor's modes at every node, to draw.
    warnings
        What a user should know before trusting the model.
    """

    rotor: fem.Rotor
    nodes: tuple[int, ...]
    positions: FloatArray
    modes: int
    masses: Estimate
    sensitivity: FloatArray
    compliance: FloatArray
    frequencies: FloatArray
    shapes: FloatArray
    rotor_modes: fem.Modes
    rotor_shapes: FloatArray
    warnings: tuple[str, ...]

    @property
    def rotor_frequencies(self) -> FloatArray:
        """The rotor's first n natural frequencies, rad/s."""
        return self.rotor_modes.frequencies

    @property
    def relative_error(self) -> FloatArray:
        """Of each frequency against the rotor's, shape (n,)."""
        return np.asarray(self.frequencies / self.rotor_frequencies - 1.0)

    @property
    def mac_matrix(self) -> FloatArray:
        """MAC of the model's modes (rows) with the rotor's (columns) at the masses, (n, n)."""
        return mac(self.shapes, self.rotor_shapes)

    @property
    def mac(self) -> FloatArray:
        """MAC of each mode with the rotor's mode of the same number, shape (n,)."""
        return np.asarray(np.diag(self.mac_matrix))

    @property
    def equations_of_motion(self) -> fem.Motion:
        """M x'' + K x = f of the small model: masses, and the inverse of the compliance.

        The displacement of the mass at node 7 is `x7`. There is no damping: what a rotor's bearings and its
        surroundings take out is for the user to add, or to estimate (`rotorid.timedomain.second_order`).
        """
        K = np.linalg.inv(self.compliance)
        n = len(self.nodes)
        names = tuple(f"x{node}" for node in self.nodes)
        return fem.Motion(np.diag(self.masses.solution), np.zeros((n, n)), (K + K.T) / 2, names, 0.0)

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, the keys of INTERFACE.md (`rotorid reduce`)."""
        return {
            "nodes": list(self.nodes),
            "positions_m": self.positions.tolist(),
            "modes": self.modes,
            "masses_kg": self.masses.solution.tolist(),
            "masses_std_kg": None if self.masses.std is None else _floats(self.masses.std),
            "mass_sensitivity": self.sensitivity.tolist(),
            "compliance_m_per_N": self.compliance.tolist(),
            "natural_frequencies_rad_s": _floats(self.frequencies),
            "rotor_frequencies_rad_s": self.rotor_frequencies.tolist(),
            "relative_error": _floats(self.relative_error),
            "mac": _floats(self.mac),
            "condition_number": self.masses.condition_number,
            "warnings": list(self.warnings),
        }

    def to_frame(self) -> pd.DataFrame:
        """First a row per mass (`table` is "masses"), then a row per mode ("modes").

        Masses have node, position and mass; modes have number, frequencies, error and MAC. Cells of the other
        kind are blank.
        """
        import pandas as pd

        n = len(self.nodes)
        masses = pd.DataFrame(
            {"node": self.nodes, "position_m": self.positions, "mass_kg": self.masses.solution}
        )
        modes = pd.DataFrame(
            {
                "mode": np.arange(1, n + 1),
                "frequency_rad_s": self.frequencies,
                "rotor_frequency_rad_s": self.rotor_frequencies,
                "relative_error": self.relative_error,
                "mac": self.mac,
            }
        )
        modes.index += n
        frame = pd.concat((masses, modes), axis=1).astype({"node": "Int64", "mode": "Int64"})
        frame.insert(0, "table", ["masses"] * n + ["modes"] * n)
        return frame

    def summary(self) -> str:
        """Text for an engineer."""
        std = self.masses.std
        lines = [f"Warning: {w}" for w in self.warnings]
        lines.append(f"{len(self.nodes)} equivalent masses from the first {self.modes} mode(s), formula (50)")
        for i, node in enumerate(self.nodes):
            spread = "" if std is None else f" ± {_plain(std[i])}"
            mass = self.masses.solution[i]
            lines.append(f"  node {node:>3}  at {self.positions[i]:7.3f} m   {mass:10.3f} kg{spread}")
        total = self.masses.solution.sum()
        lines.append(f"  together {total:.1f} kg of the rotor's {self.rotor.total_mass:.1f} kg")
        lines.append("mode   n-mass model            rotor                   error      MAC")
        for k, (f, g) in enumerate(zip(self.frequencies, self.rotor_frequencies, strict=True)):
            error = self.relative_error[k]
            lines.append(
                f"{k + 1:>4}   {_speed(f)}   {_speed(g)}   {100 * error:+7.3f} %  {self.mac[k]:.5f}"
                if np.isfinite(f)
                else f"{k + 1:>4}   {'does not vibrate':<21}   {_speed(g)}"
            )
        lines.append(f"condition number of the regression {self.masses.condition_number:.3g}")
        if std is not None:
            lines.append(
                "± is one standard deviation from the regression's residuals (model error, not measurement)"
            )
        return "\n".join(lines)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the shapes of both models over the rotor; returns the axes."""
        from rotorid.plots import plot_reduction

        return plot_reduction(self, ax)


def reduce(
    rotor: fem.Rotor, nodes: Sequence[int], modes: int = 2, *, speed: float | None = None
) -> Reduction:
    """Reduce a rotor to masses at chosen nodes by regression over its first modes.

    Formula (50) is one of a plane that does not turn: of a rotor with gyroscopic effect, or on supports that
    are more than constant isotropic springs, the plane x at rest is reduced, and `warnings` say so.

    Parameters
    ----------
    rotor
        On supports; its static compliance must exist.
    nodes
        Different node numbers, from 1, where the masses stand.
    modes
        How many of the rotor's modes the regression uses, 1 … n.
    speed
        Where tables of supports are read, rad/s; by default their lowest common speed.

    Raises
    ------
    ValueError
        For a speed outside a table, nodes that do not exist or repeat, a number of modes out of range, a
        rotor free to move, or masses that these modes do not determine.

    Notes
    -----
    Source: [S] 1.10, tasks 9.1 and 9.2. The frequencies of the small model come from its own eigenvalue
    problem, so their agreement with the rotor's is a check, also for the modes that the regression used.
    """
    places = tuple(int(n) for n in nodes)
    n = len(places)
    if n == 0 or len(set(places)) != n:
        raise ValueError(f"the masses need different nodes; got {list(nodes)}")
    bad = [p for p in places if not 1 <= p <= rotor.n_nodes]
    if bad:
        raise ValueError(f"node {bad[0]} does not exist: this rotor has nodes 1 … {rotor.n_nodes}")
    if not 1 <= modes <= n:
        raise ValueError(f"{n} masses can use 1 … {n} modes; got {modes}")
    plane, said = _plane_at_rest(rotor, speed)
    alpha = fem.compliance(plane, places)
    full = fem.critical_speeds(plane, n)
    index = np.array(places) - 1
    rotor_shapes = full.shapes[index]
    estimate = equivalent_masses(alpha, full.frequencies[:modes], rotor_shapes[:, :modes])
    if not estimate.full_rank:
        raise ValueError(
            f"the first {modes} mode(s) do not determine the masses at nodes {list(places)}: "
            f"{estimate.describe_rank()}; use more modes or other nodes"
        )
    sensitivity = mass_sensitivity(alpha, full.frequencies[:modes], rotor_shapes[:, :modes])
    omega, shapes = natural_frequencies(alpha, estimate.solution)
    shapes = _like(shapes, rotor_shapes)
    agreement = np.diag(mac(shapes, rotor_shapes))[:modes]
    return Reduction(
        rotor=rotor,
        nodes=places,
        positions=rotor.positions[index],
        modes=modes,
        masses=estimate,
        sensitivity=sensitivity,
        compliance=alpha,
        frequencies=omega,
        shapes=shapes,
        rotor_modes=full,
        rotor_shapes=rotor_shapes,
        warnings=(
            *said,
            *_of_shaft(rotor, full),
            *_warnings(estimate, sensitivity, omega, places, agreement),
        ),
    )


def _plane_at_rest(rotor: fem.Rotor, speed: float | None) -> tuple[fem.Rotor, list[str]]:
    """The rotor's plane x without rotation, on springs to the ground or to pedestals, and what to say of it.

    Neither gyroscopic moments nor coupling between x and y nor damping have a place in formula (50).
    """
    if speed is not None and not (np.isfinite(speed) and speed >= 0):
        raise ValueError(f"the speed must be finite and not negative, in rad/s, not {speed}")
    lowest = max((support.speeds[0] for support in rotor.supports if support.speeds), default=0.0)
    omega = lowest if speed is None else float(speed)
    supports = []
    for support in rotor.supports:
        stand = support.pedestal
        supports.append(
            fem.Support(
                support.node,
                float(support.at(omega)[0][0, 0]),
                name=support.name,
                pedestal=None if stand is None else fem.Pedestal(stand.mass, stand.xy("stiffness")[0]),
                kind=support.kind,
                tilting_stiffness=support.tilting_stiffness,
            )
        )
    plane = dataclasses.replace(
        rotor, supports=supports, model=dataclasses.replace(rotor.model, gyroscopic=False)
    )
    said = []
    if rotor.model.gyroscopic or not (rotor.symmetric and _uncoupled(rotor)):
        said.append(
            "formula (50) knows neither rotation nor coupling of the planes: the model holds for the plane x "
            "of the rotor at rest, without gyroscopic effect and cross-coupling"
        )
    if not rotor.constant:
        which = "the lowest of" if speed is None else "chosen in"
        said.append(f"the stiffness of the supports (kxx) is that at {omega:.6g} rad/s, {which} their tables")
    return plane, said


def _of_shaft(rotor: fem.Rotor, full: fem.Modes) -> list[str]:
    """Warnings of the modes, without those on what the plane at rest leaves out of a rotor that has it."""
    ours = ignored_inertia(full.rotor)
    return [*ignored_inertia(rotor), *(text for text in full.warnings if text not in ours)]


def _uncoupled(rotor: fem.Rotor) -> bool:
    """Whether no support's stiffness couples x and y."""
    matrices = [support.at(support.speeds or 0.0)[0] for support in rotor.supports]
    return not any(K[..., 0, 1].any() or K[..., 1, 0].any() for K in matrices)


def _warnings(
    estimate: Estimate,
    sensitivity: FloatArray,
    omega: FloatArray,
    places: tuple[int, ...],
    agreement: FloatArray,
) -> list[str]:
    out = [
        f"the mass at node {p} is {m:.4g} kg, not positive: no physical model; use other nodes or more modes"
        for p, m in zip(places, estimate.solution, strict=True)
        if m <= 0
    ]
    if np.isnan(omega).any():
        out.append("with these masses the model has modes that do not vibrate")
    out += [
        f"mode {k} of the model does not have the shape of the rotor's (MAC {value:.2f}, below {ALIKE}): "
        "do not rely on its frequency; use other nodes or more masses"
        for k, value in enumerate(agreement, start=1)
        if not value >= ALIKE
    ]
    if (sensitivity > SENSITIVE / 0.01).any():
        moves = ", ".join(f"{x:.0f} %" for x in sensitivity)
        out.append(
            f"the regression is ill-conditioned (condition number "
            f"{estimate.condition_number:.1f}): errors of "
            f"1 % in the compliances and shapes move the masses by {moves}; more modes make them firmer"
        )
    return out


def _like(shapes: FloatArray, reference: FloatArray) -> FloatArray:
    """Scale each column to the least-squares size of the reference column, so that both can be drawn."""
    factor = (shapes * reference).sum(axis=0) / (shapes**2).sum(axis=0)
    weak = np.abs(factor) < 1e-12
    return np.asarray(shapes * np.where(weak, 1.0, factor))


def _speed(omega: float) -> str:
    return f"{omega:9.4f} rad/s {omega * RAD_S_TO_RPM:7.1f}/min"


def _plain(value: float) -> str:
    """Two significant digits, never as a power of ten."""
    if value == 0 or not np.isfinite(value):
        return f"{value:g}"
    places = 1 - int(np.floor(np.log10(abs(value))))
    return f"{round(value, places):.{max(places, 0)}f}"


def _floats(values: FloatArray) -> list[float | None]:
    return [float(v) if np.isfinite(v) else None for v in values]
