"""Reduction of a rotor to masses at chosen nodes, beside the rotor itself.

What errors of the inputs do: compliances, frequencies, shapes and stiffnesses of seals are drawn at random by
their stated errors, and masses and frequencies computed anew.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

import fem
from fem.assembly import ignored_inertia
from rotorid.base.answer import Answer, Answered, together
from rotorid.base.arrays import FloatArray, whole
from rotorid.base.json import plain
from rotorid.base.tables import Column, frame, text
from rotorid.base.text import RPM, counted, error_figures, percent
from rotorid.reduction.masses import (
    Normalisation,
    RowWeights,
    Separated,
    design,
    equivalent_masses,
    like,
    mac,
    mass_nodes,
    natural_frequencies,
    plane_at_rest,
    separate,
    solve_many,
)
from rotorid.reduction.placement import ALIKE, BADLY
from rotorid.regression.estimate import Estimate

if TYPE_CHECKING:
    import pandas as pd

HEAVY = 1.05
"""Masses that weigh more than this times the rotor are named."""
OFF, APART = 0.1, 0.05
"""Relative errors of a model's frequency, and of a measured one beside the rotor's, that are named."""
DRAWS = 2000
"""Of inputs with their errors."""
NAMES = ("m", "omega")
_RESIDUAL = "± is one standard deviation from the regression's residuals (model error, not measurement)"


@dataclass(frozen=True, eq=False)
class InputErrors:
    """Relative standard deviations of the inputs of formula (50): 0.013 is 1.3 %. All are independent.

    Attributes
    ----------
    compliance
        Scalar, or of α_11, α_12 … α_1n, α_22 …, shape (n (n + 1) / 2,).
    frequencies
        Scalar or (k,).
    shapes
        Scalar or (n, k). A scalar leaves the ordinates at the first mass exact where shapes are scaled there
        (normalise="first"): they are 1 by definition.
    seal_stiffness
        Scalar or (n,).

    Raises
    ------
    ValueError
        For errors that are negative, not finite, or 1 and more.
    """

    compliance: ArrayLike = 0.0
    frequencies: ArrayLike = 0.0
    shapes: ArrayLike = 0.0
    seal_stiffness: ArrayLike = 0.0

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = np.array(getattr(self, field.name), dtype=float)
            if not ((value >= 0) & (value < 1)).all():
                raise ValueError(
                    f"errors of {field.name} must be shares from 0 to below 1, such as 0.013 for 1.3 %; "
                    f"got {value}"
                )
            object.__setattr__(self, field.name, value)


@dataclass(frozen=True, eq=False)
class MassErrors(Answered):
    """What stated errors of the inputs do: one standard deviation, half of what 68 % of the draws span.

    Attributes
    ----------
    masses, frequencies
        kg and rad/s, shape (n,) each; NaN where some of the drawn inputs give no such mode.
    warnings
        Masses that are not known even in sign.
    """

    masses: FloatArray
    frequencies: FloatArray
    warnings: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; what is unknown is None."""
        return plain(
            {
                "masses_std_kg": self.masses,
                "natural_frequencies_std_rad_s": self.frequencies,
                "warnings": self.warnings,
            }
        )

    @property
    def answer(self) -> Answer:
        """What the errors do to masses and frequencies."""
        masses, speeds = (", ".join(map(error_figures, row)) for row in (self.masses, self.frequencies * RPM))
        words = f"By the stated errors the masses are ± {masses} kg, the frequencies ± {speeds} rpm."
        return Answer(words, warnings=self.warnings)


@dataclass(frozen=True, eq=False)
class Reduction(Answered):
    """An n-mass model of a rotor beside the rotor itself.

    Attributes
    ----------
    nodes
        Where the masses stand: node numbers, or labels where there is no rotor.
    modes
        How many modes of the rotor the regression used.
    source
        Whether these modes were computed from the rotor or measured.
    normalise, rows, nonnegative
        As in `equivalent_masses`.
    masses
        Estimate of the masses, kg, with the scatter of the regression.
    compliance
        m/N, shape (n, n), without the seals in `seal_stiffness`.
    seal_stiffness
        Of springs from the masses to the ground beside the compliance, N/m, shape (n,).
    frequencies, shapes
        Of the n-mass model: rad/s (n,), and at the masses (n, n), scaled to fit the rotor's.
    rotor_frequencies, rotor_shapes
        Of the rotor, computed for its plane at rest or measured: rad/s (j,), and at the masses (n, j).
    rotor
        None where only its compliance and measured modes are known.
    rotor_modes
        The computed modes at every node, to draw; None without a rotor.
    errors
        What stated errors of the inputs do to masses and frequencies; None where none are stated.
    separated
        The compliance of the shaft apart from its two supports, (47); None where not asked for.
    warnings
        What a user should know before trusting the model.
    """

    nodes: tuple[int | str, ...]
    modes: int
    source: Literal["rotor", "measured"]
    normalise: Normalisation
    rows: RowWeights
    nonnegative: bool
    masses: Estimate
    compliance: FloatArray
    seal_stiffness: FloatArray
    frequencies: FloatArray
    shapes: FloatArray
    rotor_frequencies: FloatArray
    rotor_shapes: FloatArray
    rotor: fem.Rotor | None = None
    rotor_modes: fem.Modes | None = None
    errors: MassErrors | None = None
    separated: Separated | None = None
    warnings: tuple[str, ...] = ()

    @property
    def positions(self) -> FloatArray | None:
        """Of the masses, m from the left end, shape (n,); None without a rotor."""
        if self.rotor is None:
            return None
        return np.asarray(self.rotor.positions[[int(node) - 1 for node in self.nodes]])

    @property
    def relative_error(self) -> FloatArray:
        """Of each frequency against the rotor's, shape (n,); NaN where the rotor's is not known."""
        return np.asarray(self.frequencies / self._padded(self.rotor_frequencies) - 1.0)

    @property
    def mac(self) -> FloatArray:
        """MAC of each mode with the rotor's mode of the same number, shape (n,); NaN where unknown."""
        return self._padded(np.diag(mac(self.shapes, self.rotor_shapes)))

    @property
    def equations_of_motion(self) -> fem.Motion:
        """M x'' + K x = f of the small model: masses, and the inverse of the compliance.

        The displacement of the mass at node 7 is `x7`. There is no damping: what a rotor's bearings and its
        surroundings take out is for the user to add, or to estimate, or comes with the supports (`small`).
        """
        K = np.linalg.inv(self.compliance) + np.diag(self.seal_stiffness)
        M, names = np.diag(self.masses.solution), tuple(f"x{node}" for node in self.nodes)
        return fem.Motion(M, np.zeros_like(M), (K + K.T) / 2, names, 0.0)

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, the keys of INTERFACE.md (`rotorid reduce`)."""
        document: dict[str, Any] = {
            "nodes": self.nodes,
            "positions_m": self.positions,
            "modes": self.modes,
            "source": self.source,
            "normalise": self.normalise,
            "rows": self.rows,
            "nonnegative": self.nonnegative,
            "masses_kg": self.masses.solution,
            "masses_std_kg": self.masses.std,
            "compliance_m_per_N": self.compliance,
            "seal_stiffness_N_per_m": self.seal_stiffness,
            "natural_frequencies_rad_s": self.frequencies,
            "rotor_frequencies_rad_s": self._padded(self.rotor_frequencies),
            "relative_error": self.relative_error,
            "mac": self.mac,
            "condition_number": self.masses.condition_number,
            "warnings": self.warnings,
        }
        if (apart := self.separated) is not None:
            document["separated"] = {
                "nodes": apart.nodes,
                "positions_m": apart.positions,
                "supports": apart.supports,
                "span_m": apart.span,
                "delta_m_per_N": apart.delta,
                "fractions": apart.fractions,
            }
        if self.errors is not None:
            document["uncertainty"] = self.errors.to_dict()
        return plain(document)

    def to_frame(self) -> pd.DataFrame:
        """First a row per mass (`table` is "masses"), then a row per mode ("modes").

        Masses have node, position and mass; modes have number, frequencies, error and MAC. Cells of the other
        kind are blank.
        """
        import pandas as pd

        n, parts = len(self.nodes), {"masses": self._of_masses(), "modes": self._of_modes()}
        frames = [
            frame((Column("table", [kind] * n), *(each for each in columns if each.heading)))
            for kind, columns in parts.items()
        ]
        whole = {"mode": "Int64"} if self.rotor is None else {"mode": "Int64", "node": "Int64"}
        return pd.concat(frames, ignore_index=True).astype(whole)

    def _of_masses(self) -> tuple[Column, ...]:
        """Node, position and mass; what has no name is printed alone."""
        positions, std, three = self.positions, self.masses.std, "{:.3f}".format
        at = () if positions is None else (Column("position_m", positions, three, title="at, m"),)
        spread = () if std is None else (Column("", std, error_figures, title="±"),)
        masses = Column("mass_kg", self.masses.solution, three, title="mass, kg")
        return (Column("node", self.nodes), *at, masses, *spread)

    def _of_modes(self) -> tuple[Column, ...]:
        """Number, both frequencies, error and MAC; what has no name is printed alone."""
        model, other = self.frequencies, self._padded(self.rotor_frequencies)
        still = ["" if np.isfinite(f) else "does not vibrate" for f in model]
        one, four = "{:.1f}".format, "{:.4f}".format
        return (
            Column("mode", range(1, len(self.nodes) + 1)),
            Column("", model * RPM, one, title="model, rpm"),
            Column("frequency_rad_s", model, four, title="rad/s"),
            Column("", other * RPM, one, title="rotor, rpm" if self.source == "rotor" else "measured, rpm"),
            Column("rotor_frequency_rad_s", other, four, title="rad/s"),
            Column("relative_error", self.relative_error, lambda e: f"{100 * e:+.3f}", title="error, %"),
            Column("mac", np.where(np.isfinite(model), self.mac, np.nan), "{:.5f}".format, title="MAC"),
            *((Column("", still),) if any(still) else ()),
        )

    @property
    def answer(self) -> Answer:
        """How well the masses stand for the rotor, the masses, and both frequencies beside each other."""
        whole = " kg" if self.rotor is None else f" of the rotor's {self.rotor.total_mass:.1f} kg"
        kind = "measured mode" if self.source == "measured" else "mode"
        first = f"the first {kind}" if self.modes == 1 else f"the first {self.modes} {kind}s"
        masses = Answer(
            f"{counted(len(self.nodes), 'equivalent mass', 'equivalent masses')} from {first}, formula (50), "
            f"together {self.masses.solution.sum():.1f}{whole}.\n"
            f"{self._judgement()}; condition number {self.masses.condition_number:.3g}.",
            f"{text(self._of_masses())}\n\n{text(self._of_modes())}",
            self.warnings[::-1],  # of the model as it came out before those of what it is made for
            () if self.masses.std is None else (_RESIDUAL,),
        )
        more = [] if self.errors is None else [self.errors.answer]
        if (apart := self.separated) is not None:
            a, b = apart.supports
            columns = (
                Column("mass at node", apart.nodes),
                Column(f"% on node {a}", 100 * apart.fractions[:, 0], "{:.4g}".format),
                Column(f"% on node {b}", 100 * apart.fractions[:, 1], "{:.4g}".format),
                Column("shaft on rigid supports, m/N", np.diag(apart.delta), "{:.6g}".format),
            )
            words = f"The shaft apart from its supports at nodes {a} and {b}, {apart.span:.6g} m apart."
            more.append(Answer(words, tables=(text(columns),), more="shares of the supports"))
        return together([masses, *more])

    def _judgement(self) -> str:
        """How near the modes are."""
        k, apart = self.modes, self.relative_error
        if (self.masses.solution <= 0).any():
            return "NO physical model, a mass is not positive"
        if not np.isfinite(apart[:k]).all():
            return "NO model of these modes, not all of them vibrate"
        whose, largest = {"rotor": "rotor's"}.get(self.source, "measured"), np.abs(apart[:k]).max()
        following = [f"; mode {k + 1} off by {100 * e:+.3g} %" for e in apart[k : k + 1] if np.isfinite(e)]
        return (
            f"Frequencies within {percent(round(largest, 8))} % of the {whose}, MAC {self.mac[:k].min():.4g}"
            + "".join(following)
        )

    def _padded(self, values: FloatArray) -> FloatArray:
        out = np.full(len(self.nodes), np.nan)
        out[: len(values)] = values[: len(out)]
        return out


def reduce(  # noqa: PLR0913
    rotor: fem.Rotor,
    nodes: Sequence[int],
    modes: int = 2,
    *,
    speed: float | None = None,
    normalise: Normalisation = "first",
    rows: RowWeights = "equal",
    nonnegative: bool = False,
    measured: tuple[ArrayLike, ArrayLike] | None = None,
    supports_apart: bool = False,
    errors: InputErrors | None = None,
) -> Reduction:
    """Reduce a rotor to masses at chosen nodes by regression over its first modes.

    Formula (50) is one of a plane that does not turn: of a rotor with gyroscopic effect, or on supports that
    are more than constant isotropic springs, the plane x at rest is reduced, and `warnings` say so. What
    turns, couples and damps comes back in the small model.

    Parameters
    ----------
    rotor
        On supports; its static compliance must exist.
    nodes
        Different node numbers, from 1, where the masses stand.
    modes
        How many of the modes the regression uses, 1 … n.
    speed
        Where tables of supports are read, rad/s; by default their lowest common speed.
    normalise, rows, nonnegative
        As in `equivalent_masses`; the defaults are those of [S].
    measured
        Frequencies, rad/s (k,), and shapes at the nodes (n, k), used instead of the computed ones.
    supports_apart
        Take the compliance from (47): that of the shaft on rigid supports, and the two bearings beside it;
        seals at the masses then stand in the right side of (50).
    errors
        Relative standard deviations of the inputs: then `errors` of the result has those of masses and
        frequencies, of 2000 draws with a fixed seed.

    Raises
    ------
    ValueError
        For a speed outside a table, nodes that do not exist or repeat, a number of modes out of range, a
        rotor free to move, masses that these modes do not determine, or supports that cannot be set apart.

    Notes
    -----
    Source: [S] 1.10, tasks 9.1 and 9.2. The frequencies of the small model come from its eigenvalue
    problem, so their agreement with the rotor's is a check, also for the modes that the regression used.
    """
    places = mass_nodes(rotor, nodes)
    n = len(places)
    plane, remarks = plane_at_rest(rotor, speed)
    if measured is not None and any(s.pedestal and s.pedestal.mass for s in rotor.supports):
        raise ValueError(
            "measured modes hold the masses of the pedestals, which formula (50) cannot take apart: give the "
            "pedestals no mass in the rotor file (the equivalent masses then hold it), or use computed modes"
        )
    full = fem.critical_speeds(plane, n)
    shapes = full.shapes[np.array(places) - 1]
    seals, apart = np.zeros(n), None
    if supports_apart:
        kept = []
        for support in plane.supports:
            if support.kind == "seal" and support.node in places and support.plain:
                seals[places.index(support.node)] += float(support.stiffness)
            else:
                kept.append(support)
        plane = dataclasses.replace(plane, supports=kept)
        apart = separate(plane, places)
    alpha = fem.compliance(plane, places)
    modes_of = full.frequencies, shapes
    if measured is not None:
        modes_of = _modes(measured, n)
        remarks += _other_modes(*modes_of, full.frequencies, shapes)
    remarks += ignored_inertia(rotor)
    remarks += [warning for warning in full.warnings if warning not in ignored_inertia(full.rotor)]
    return _reduced(
        *(places, alpha, seals, *modes_of, modes, errors),
        rotor=rotor,
        rotor_modes=full,
        separated=apart,
        warnings=tuple(remarks),
        source="rotor" if measured is None else "measured",
        normalise=normalise,
        rows=rows,
        nonnegative=nonnegative,
    )


def reduce_measured(  # noqa: PLR0913
    compliance: ArrayLike,
    frequencies: ArrayLike,
    shapes: ArrayLike,
    modes: int | None = None,
    *,
    nodes: Sequence[int | str] | None = None,
    seal_stiffness: ArrayLike = 0.0,
    normalise: Normalisation = "first",
    rows: RowWeights = "equal",
    nonnegative: bool = False,
    errors: InputErrors | None = None,
) -> Reduction:
    """Estimate equivalent masses of a rotor of which compliance and modes are given, without a model of it.

    Parameters
    ----------
    compliance
        m/N, shape (n, n).
    frequencies, shapes
        Measured, rad/s (k,), and at the masses (n, k).
    modes
        How many of them the regression uses; default all.
    nodes
        Names of the places, 1 … n by default.
    seal_stiffness, normalise, rows, nonnegative
        As in `equivalent_masses`.
    errors
        As in `reduce`.

    Raises
    ------
    ValueError
        As `equivalent_masses`, and for masses that these modes do not determine.
    """
    alpha = np.asarray(compliance, dtype=float)
    n = len(alpha)
    omega, U = _modes((frequencies, shapes), n)
    places = tuple(range(1, n + 1)) if nodes is None else tuple(nodes)
    if len(places) != n or len(set(places)) != n:
        raise ValueError(f"{n} different names of places are needed; got {list(places)}")
    seals = np.broadcast_to(np.asarray(seal_stiffness, dtype=float), (n,)).copy()
    used = len(omega) if modes is None else modes
    how = {"source": "measured", "normalise": normalise, "rows": rows, "nonnegative": nonnegative}
    return _reduced(places, alpha, seals, omega, U, used, errors, **how)


def _reduced(
    places: tuple[int | str, ...],
    alpha: FloatArray,
    seals: FloatArray,
    omega: FloatArray,
    shapes: FloatArray,
    modes: int,
    errors: InputErrors | None,
    **others: Any,  # noqa: ANN401
) -> Reduction:
    """The regression and its checks, whatever the inputs come from; other fields of the result."""
    n, most = len(places), min(len(places), len(omega))
    modes = whole(modes, "the number of modes")
    if not 1 <= modes <= most:
        raise ValueError(f"{n} masses can use 1 … {most} modes; got {modes}")
    how = {key: others[key] for key in ("normalise", "rows", "nonnegative")}
    estimate = equivalent_masses(alpha, omega[:modes], shapes[:, :modes], seal_stiffness=seals, **how)
    if not estimate.full_rank:
        raise ValueError(
            f"the first {counted(modes, 'mode')} cannot determine the masses at nodes {list(places)}: "
            f"{estimate.describe_rank()}; use more modes or other nodes"
        )
    frequencies, model = natural_frequencies(alpha, estimate.solution, seal_stiffness=seals)
    compared = shapes[:, :n]
    j = compared.shape[1]
    model[:, :j] = like(model[:, :j], compared)
    result = Reduction(
        nodes=places,
        modes=modes,
        masses=estimate,
        compliance=alpha,
        seal_stiffness=seals,
        frequencies=frequencies,
        shapes=model,
        rotor_frequencies=omega[:n],
        rotor_shapes=compared,
        **others,
    )
    bound = how["nonnegative"] and not estimate.solution.all()
    drawn = _errors_by_draws(result, errors) if errors is not None and not bound else None
    warnings = (*result.warnings, *_warnings(result))
    return dataclasses.replace(result, errors=drawn, warnings=warnings)


def _warnings(result: Reduction) -> list[str]:
    """Masses that are not positive; or at their bound, too heavy, other modes, a shaky regression."""
    warnings, masses = [], result.masses
    pairs = zip(result.nodes, masses.solution, strict=True)
    wrong = ", ".join(f"{mass:.4g} kg at node {node}" for node, mass in pairs if mass <= 0)
    if wrong and not result.nonnegative:
        return [
            f"a mass is not positive, {wrong}: no physical model; use other nodes, more modes, or "
            "--nonnegative"
        ]
    if wrong:
        warnings.append(
            f"at the bound 0, the modes ask for less than nothing there: {wrong}; the standard deviations of "
            "the others hold this fixed, and those by stated errors are not computed; leave these places out"
        )
    total = np.inf if result.rotor is None else result.rotor.total_mass
    if (together_kg := float(masses.solution.sum())) > HEAVY * total:
        warnings.append(
            f"the masses weigh {together_kg:.4g} kg together, more than the rotor ({total:.4g} kg): they "
            "stand where it hardly moves; use other nodes"
        )
    modes = zip(result.relative_error.tolist(), result.mac.tolist(), strict=True)
    far = [
        f"mode {k} by {100 * error:+.1f} %, MAC {shape:.2f}"
        for k, (error, shape) in enumerate(modes, start=1)
        if abs(error) > OFF or (k <= result.modes and not shape >= ALIKE)
    ]
    if far:
        warnings.append(
            f"the model is far off: {'; '.join(far).replace('by +nan %', 'does not vibrate')}; do not rely "
            "on these frequencies and shapes, use other nodes or more masses"
        )
    if masses.condition_number > BADLY:
        warnings.append(
            f"the regression is ill-conditioned (condition number {masses.condition_number:.1f}): errors of "
            "1 % in the compliances and shapes can move the masses by up to "
            f"{masses.condition_number:.0f} %; more modes make them firmer"
        )
    return warnings


def _other_modes(
    omega: FloatArray,
    measured: FloatArray,
    rotor_omega: FloatArray,
    computed: FloatArray,
) -> list[str]:
    """What to say where the measured rotor is not that of the model: frequencies, then shapes."""
    remarks, agreement = [], mac(measured, computed)
    for k, (f, g) in enumerate(zip(omega.tolist(), rotor_omega.tolist(), strict=False)):
        if abs(f / g - 1) > APART:
            remarks.append(
                f"the measured frequency {k + 1}, {f:.6g} rad/s, differs by {100 * (f / g - 1):+.1f} % from "
                f"that of the rotor model, {g:.6g} rad/s: its compliance may not be the measured rotor's"
            )
        if agreement[k, k] < ALIKE:
            best = int(agreement[k].argmax())
            remarks.append(
                f"the shape of measured mode {k + 1} is not that of the rotor's (MAC {agreement[k, k]:.2f}); "
                f"nearest is its mode {best + 1} (MAC {agreement[k, best]:.2f}): is a mode missing, or a "
                "sign wrong?"
            )
    return remarks


def _modes(measured: tuple[ArrayLike, ArrayLike], n: int) -> tuple[FloatArray, FloatArray]:
    """Frequencies and shapes as arrays that fit n masses; `design` looks at their numbers."""
    omega, shapes = np.atleast_1d(np.asarray(measured[0], float)), np.asarray(measured[1], float)
    if shapes.shape != (n, len(omega)):
        raise ValueError(
            f"shapes must be (n, k) for {n} masses and {len(omega)} frequencies; got {shapes.shape}"
        )
    return omega, shapes


def _errors_by_draws(result: Reduction, stated: InputErrors) -> MassErrors:
    """What stated errors do, by recomputed draws; NaN where a mode is lost in some of them."""
    n, k = len(result.nodes), result.modes
    i, j = np.triu_indices(n)
    sizes = {"compliance": (i.size,), "frequencies": (k,), "shapes": (n, k), "seal_stiffness": (n,)}
    sigma = []
    for name, shape in sizes.items():
        given = np.asarray(getattr(stated, name))
        if given.shape not in ((), shape):
            raise ValueError(f"errors of {name} must be one number or have shape {shape}; got {given.shape}")
        full = np.array(np.broadcast_to(given, shape))
        if name == "shapes" and given.ndim == 0 and result.normalise == "first":
            full[0] = 0.0
        sigma.append(full.ravel())
    parts, ends = np.concatenate(sigma), np.cumsum([*map(len, sigma)])
    drawn = 1 + np.random.default_rng(0).normal(size=(DRAWS, ends[-1])) * parts
    a, w, u, c = np.split(drawn, ends[:-1], axis=1)
    factors = np.ones((DRAWS, n, n))
    factors[:, i, j] = factors[:, j, i] = a
    alpha, springs = result.compliance * factors, result.seal_stiffness * c
    shapes = result.rotor_shapes[:, :k] * u.reshape(-1, n, k)
    omega = result.rotor_frequencies[:k] * w
    B, D = design(alpha, omega, shapes, seal_stiffness=springs, normalise=result.normalise, rows=result.rows)
    masses, _ = solve_many(B, D)
    omega = np.full_like(masses, np.nan)
    if np.isfinite(masses).all():
        omega, _ = natural_frequencies(alpha, masses, seal_stiffness=springs)
    low, high = np.quantile((masses, omega), (0.15866, 0.84134), axis=1)  # NaN where any draw is
    std, exact = (high - low) / 2, (result.masses.solution, result.frequencies)
    warnings = [
        f"the stated errors do not determine {NAMES[row]}{column + 1}: it may be off by as much as it is, or "
        "drawn masses are not positive"
        for row, column in np.argwhere(~(std < np.abs(exact)))
    ]
    return MassErrors(std[0], std[1], tuple(warnings))
