"""Correction weights: D minimises |Y₀ + W D| over all sensors and speeds ([S] (28)–(40), Den Hartog)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from balancing.coefficients.baseline import match_speeds, starting_point
from balancing.coefficients.convention_test import ConventionTest
from balancing.coefficients.identifiability import UndeterminedError, check_planes, check_resolution
from balancing.coefficients.influence import Influence
from balancing.coefficients.run_errors import RunErrors
from balancing.correction.choice import plane_indices, rows_of
from balancing.correction.correction_warnings import (
    EMPTY,
    amplitude_words,
    binding,
    cautions,
    left_out,
    notes,
    reading_names,
    weight_words,
)
from balancing.correction.counsel import Counsel, Stakes, coarse, judged, remedies
from balancing.correction.other_readings import OtherReading
from balancing.correction.region_coverage import optimism, uncertain
from balancing.correction.stack_errors import stack_errors
from balancing.data.conventions import Labels
from balancing.data.errors import Source
from balancing.data.limits import Limits
from balancing.data.trials import ReadingErrors, Trials
from balancing.solvers.conditioning import conditioning
from balancing.solvers.error_propagation import region_radius as region_radius
from balancing.solvers.methods import Fitted, Stack, fit_weights
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.regression import coverage_factor

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class Correction:
    """Weights to mount, and the vibration they should leave.

    Attributes
    ----------
    speeds, sensors, planes
        rad/s (S,), names (C) and (P).
    weights
        Total correction weights for the bare rotor (every weight of the runs removed), angle with the
        rotation, shape (P,).
    before, after
        Vibration of the bare rotor and its prediction with the corrections mounted, shape (S, C).
    covariance
        Of (Re D₁, Im D₁, …), shape (2P, 2P); None where errors are unknown.
    after_covariance
        Of a reading in a check run around its prediction, shape (S, C, 2, 2); None where errors are unknown.
    dof
        Degrees of freedom of the errors; None for stated ones.
    errors, error_source
        Of a single reading, and where they come from.
    run_errors
        What changes from run to run.
    check_rms
        Root mean square below which 95 of 100 check runs stay; None where errors are unknown.
    condition_number
        Of the stacked, column-scaled W (readings of weight 0 left out).
    rank
        Number of planes whose weights the readings determine (all, or `correct` raises).
    method
        "least-squares", "weighted", "minmax", "ridge" or "truncated".
    mounted
        Run, planes and weights (all planes of the runs) mounted in the last run; None if there were none.
    labels
        Units and conventions to print in.
    warnings
        What changes what a person does.
    notes
        What the user may want to know.
    explained
        Of the method "weighted": whether errors alone explain what the weights leave.
    singular_values
        Of the stacked, column-scaled W, largest first.
    gap
        Certified relative distance of the objective from its optimum; None for a closed form, and for the
        method "weighted" within limits.
    chi_square, fit_dof
        Of the method "weighted": how well these weights explain the readings.
    row_weights
        How much each reading counts, relative to the largest, (S·C,); None: all alike.
    limits, active
        What the correction had to keep to, and the limits that bind, in words.
    remove
        Planes where material is taken away, opposite to the weight that would be added.
    convention_test
        What the runs say about the relation of phases to angles; None: they were not asked.
    others
        What the same numbers give if a convention that is assumed is otherwise.
    counsel
        Whether to mount the weights, and what to do instead.
    """

    speeds: FloatArray
    sensors: tuple[str, ...]
    planes: tuple[str, ...]
    weights: ComplexArray
    before: ComplexArray
    after: ComplexArray
    covariance: FloatArray | None
    after_covariance: FloatArray | None
    dof: float | None
    errors: ReadingErrors | None
    error_source: Source
    run_errors: RunErrors
    check_rms: float | None
    condition_number: float
    rank: int
    method: str
    mounted: tuple[str, tuple[str, ...], ComplexArray] | None
    labels: Labels
    warnings: tuple[str, ...]
    notes: tuple[str, ...]
    explained: bool
    singular_values: FloatArray
    gap: float | None = None
    chi_square: float | None = None
    fit_dof: int | None = None
    row_weights: FloatArray | None = None
    limits: Limits | None = None
    active: tuple[str, ...] = ()
    remove: tuple[str, ...] = ()
    convention_test: ConventionTest | None = None
    others: tuple[OtherReading, ...] = ()
    counsel: Counsel = field(default_factory=Counsel)

    @property
    def plane_covariance(self) -> FloatArray | None:
        """Covariance (P, 2, 2) of each plane's weight; None where errors are unknown."""
        if self.covariance is None:
            return None
        P = len(self.planes)
        return np.asarray(np.einsum("papb->pab", self.covariance.reshape(P, 2, P, 2)))

    @property
    def mass_std(self) -> FloatArray | None:
        """Standard deviation (P,) of the weights' sizes; None where errors are unknown."""
        return self._along(1.0)

    @property
    def angle_std(self) -> FloatArray | None:
        """Standard deviation (P,) of the weights' angles, rad; NaN for a weight within its own error.

        Within its own error is a weight whose 95 % region contains zero: its angle is not determined.
        """
        across, covariance = self._along(1j), self.plane_covariance
        if across is None or covariance is None:
            return None
        vector = np.stack((self.weights.real, self.weights.imag), axis=-1)
        regular = covariance + 1e-12 * np.trace(covariance, axis1=1, axis2=2)[:, None, None] * np.eye(2)
        regular[~regular.any(axis=(1, 2))] = np.eye(2) * np.finfo(float).tiny
        distance = np.einsum("pi,pi->p", vector, np.linalg.solve(regular, vector[..., None])[..., 0])
        clear = (distance > region_radius(self.dof) ** 2) & (np.abs(self.weights) > 0)
        return np.where(clear, across / np.where(clear, np.abs(self.weights), 1.0), np.nan)

    def _along(self, turn: complex) -> FloatArray | None:
        covariance = self.plane_covariance
        if covariance is None:
            return None
        size = np.abs(self.weights)
        unit = turn * np.where(size > 0, self.weights, 1.0) / np.where(size > 0, size, 1.0)
        u = np.stack((unit.real, unit.imag), axis=-1)
        return np.asarray(np.sqrt(np.maximum(np.einsum("pi,pij,pj->p", u, covariance, u), 0.0)))

    @property
    def coverage_factor(self) -> float | None:
        """Half width of a 95 % interval in standard deviations; None where errors are unknown."""
        return None if self.covariance is None else coverage_factor(self.dof)

    @property
    def to_add(self) -> ComplexArray | None:
        """What to add to the weights mounted in the last run, one per plane of `mounted`; None without it."""
        if self.mounted is None:
            return None
        _, planes, weights = self.mounted
        total = dict(zip(self.planes, self.weights, strict=True))
        return np.array([total.get(p, 0.0) for p in planes], dtype=complex) - weights

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's own units and conventions; what is unknown is None."""
        from balancing.correction.correction_text import correction_dict

        return correction_dict(self)

    def to_frame(self) -> pd.DataFrame:
        """One row per plane: plane, mass, unit, angle_deg, mass_std, angle_std_deg (NaN where unknown).

        Where material is taken away from a plane, `action` says so, `angle_deg` is the place to work at, and
        `equivalent_added_deg` the angle of the added weight that would do the same. Where a convention is
        assumed, `mass_if_…` and `angle_deg_if_…` say what the other reading gives.
        """
        import pandas as pd

        left_out = ("covariance", "action", "remove_at_deg")
        rows = [{k: v for k, v in row.items() if k not in left_out} for row in self.to_dict()["corrections"]]
        frame = pd.DataFrame(rows)
        if self.remove:
            known = self.to_dict()["corrections"]
            frame.insert(1, "action", [row["action"] for row in known])
            frame["equivalent_added_deg"] = frame["angle_deg"]
            frame["angle_deg"] = [
                row["angle_deg"] if row["remove_at_deg"] is None else row["remove_at_deg"] for row in known
            ]
        for other in self.others:
            mass, angle = other.labels.weight(other.weights)
            word = other.words.replace(" ", "_")
            frame[f"mass_if_{word}"] = mass
            frame[f"angle_deg_if_{word}"] = (angle + [180.0 * (p in self.remove) for p in self.planes]) % 360
        return frame.astype({"mass_std": float, "angle_std_deg": float})

    def residuals_frame(self) -> pd.DataFrame:
        """One row per speed and sensor: amplitude and phase before and after (NaN: after is nothing)."""
        import pandas as pd

        frame = pd.DataFrame(self.to_dict()["residuals"]).drop(columns="after_covariance")
        return frame.astype({"after_phase_deg": float})

    def summary(self) -> str:
        """Text for an engineer, 80 columns: warnings, corrections with 95 %, vibration before and after."""
        from balancing.correction.correction_text import summary

        return summary(self)

    def plot(self, ax: Axes | None = None) -> Figure | Axes:
        """Draw the corrections and the vibration before and after.

        Parameters
        ----------
        ax
            None: a new figure with all pictures. Polar axes: the corrections only. Other axes: the amplitudes
            before and after only.

        Returns
        -------
        The new figure, or `ax`.
        """
        from balancing.plots import polar as plots

        if ax is None:
            return plots.overview(self)
        if ax.name == "polar":
            return plots.corrections(self, ax)
        return plots.amplitudes(self, ax)


def correct(  # noqa: PLR0913
    influence: Influence,
    baseline: Trials | ArrayLike | None = None,
    planes: Sequence[str] | None = None,
    speeds: ArrayLike | None = None,
    *,
    refuse: bool = True,
    method: str | None = None,
    limits: Limits | None = None,
    row_weights: ArrayLike | None = None,
    strength: float | str | None = None,
    keep: float | None = None,
    remove: Sequence[str] = (),
) -> Correction:
    """Correction weights over all chosen sensors and speeds.

    Parameters
    ----------
    influence
        Coefficients, from `estimate_influence` or stored.
    baseline
        Vibration to correct, where it is not that of the trial runs: new runs (what is mounted in them is
        taken into account), or complex amplitudes of the bare rotor (S, C).
    planes
        Names of the planes to use; default all. The others stay empty.
    speeds
        rad/s, to use; default all.
    refuse
        Whether to refuse planes that the measured coefficients tell apart only by their errors; else that is
        a warning. Planes that act alike exactly are always refused.
    method
        "weighted": each reading counts by the inverse of its error, that of the coefficients included
        (`balancing.solvers.effective_variance`); the default where errors are known, without ridge and
        truncation. "least-squares"; "minmax": the smallest largest amplitude.
    limits
        Largest weights and amplitudes and forbidden angles, for all speeds, sensors and planes of the
        influence coefficients.
    row_weights
        How much each reading counts, (S, C); default all alike. One of weight 0 counts only for its limit.
    strength
        Ridge: planes that act alike get small weights instead of a refusal; relative (0.01 …), or "auto".
    keep
        Truncation instead: how many combinations of planes to keep (1, 2, …), or the smallest singular value
        relative to the largest (below 1).
    remove
        Planes where material is taken away instead of added.

    Returns
    -------
    Correction
        With errors through both W and Y₀ where errors are known: of first order in closed form
        (`balancing.solvers.error_propagation`), or from sampled readings where limits or a maximum decide.

    Raises
    ------
    UndeterminedError
        Where the readings do not tell the planes apart; says which act alike, and what to do instead. With
        stated or measured errors by a χ² test at 95 % (`balancing.coefficients.resolution`). Errors that are
        assumed refuse nothing (`Correction.counsel` tells what they mean): the digits of the readings do, or,
        without an end of them, a condition number above 1000, which no instrument supports.
    ValueError
        For an unknown plane, speed or method, a missing or unfit baseline, limits that cannot be met.
    """
    start = starting_point(influence, baseline)
    chosen = plane_indices(influence, planes)
    used = list(range(len(influence.speeds))) if speeds is None else match_speeds(speeds, influence.speeds)
    part = influence.part(used, None, chosen)
    names, W = part.planes, part.W.reshape(-1, len(chosen))
    Y = start.readings[used]
    if not Y.any():
        raise ValueError(
            "the vibration to be corrected is zero at every sensor and speed: there is nothing to balance"
        )
    rows = rows_of(row_weights, influence.W.shape[:2], used)
    felt = W if rows is None else W[rows > 0]  # what weights of 0 leave says how well planes are told apart
    kept = None if limits is None else limits.pick(used, chosen)
    stakes = Stakes(influence, start, used, chosen, rows, kept)
    soft = strength is not None or keep is not None
    asked = method
    if method is None:
        method = "weighted" if start.covariance is not None and not soft else "least-squares"
    unclear, unclear_regions = ((), ()) if soft else _resolved(stakes, part, felt, method, refuse=refuse)
    planes_told = conditioning(felt, names)
    errors = stack_errors(influence, start, used, chosen)
    stack = Stack(
        W,
        Y.ravel(),
        None if errors is None else errors.channels,
        rows,
        kept if kept is not None and kept.any else None,
        names,
        reading_names(influence.sensors, influence.speeds[used]),
        partial(amplitude_words, start.labels),
        partial(weight_words, start.labels),
        None if errors is None else errors.common,
        None if errors is None else errors.explain,
    )
    fitted, method = _fitted(
        stack, method, strength, keep, assumed=asked is None and start.model.source == "assumed"
    )
    D = fitted.weights
    if stack.limits is not None:
        D = np.where(np.abs(D) < EMPTY * np.linalg.norm(Y) / np.linalg.norm(W, axis=0), 0.0, D)
    after = Y + influence.W[used][..., chosen] @ D
    covariance, dof = (None, None) if errors is None else errors.weights(fitted)
    if method == "weighted" and covariance is not None and influence.run_errors.origin != "estimated":
        small = "" if unclear else uncertain(D, covariance)
        unclear_regions = (small,) if small else ()
    result = Correction(
        speeds=influence.speeds[used],
        sensors=influence.sensors,
        planes=names,
        weights=D,
        before=Y,
        after=after,
        covariance=covariance,
        after_covariance=None if errors is None else errors.check_run(D, after),
        dof=dof,
        errors=start.model.errors,
        error_source=start.model.source,
        run_errors=influence.run_errors,
        check_rms=None if errors is None or dof == 0 else errors.check_rms(D, after, dof),
        condition_number=planes_told.condition_number,
        rank=planes_told.rank,
        method=method if not soft else "ridge" if strength is not None else "truncated",
        mounted=start.mounted,
        labels=start.labels,
        warnings=(),
        notes=(),
        explained=fitted.explained,
        singular_values=planes_told.singular_values,
        gap=fitted.gap,
        chi_square=fitted.chi_square,
        fit_dof=fitted.dof,
        row_weights=stack.row_weights,
        limits=stack.limits,
        active=binding(stack, fitted),
        remove=tuple(name for name in names if name in remove),
    )
    std, factor = result.mass_std, result.coverage_factor
    widths = None if std is None or factor is None else factor * std
    result = replace(result, counsel=judged(stakes, D, widths, soft=soft, remove=remove))
    warnings, words = influence.warnings + start.warnings, influence.notes
    if result.counsel.word == "mount":
        warnings += unclear + unclear_regions + fitted.warnings + cautions(result, felt, alike=not unclear)
        warnings += left_out(influence, start.readings, chosen, used, D, start.labels, limits)
        words += notes(result) + coarse(influence)
    else:  # the counsel says what these would
        warnings = tuple(w for w in warnings if w not in influence.contradictions)
        warnings += fitted.warnings + cautions(result, felt, alike=False, rising=False)
    return _with_words(result, warnings, words)


def _resolved(
    stakes: Stakes, part: Influence, felt: ComplexArray, method: str, *, refuse: bool
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Refuse planes that act alike; what is unclear about the planes, and about regions of the weights."""
    names, counts = stakes.names, None if stakes.row_weights is None else stakes.row_weights > 0
    check_planes(felt, names)
    unclear = check_resolution(part, refuse=refuse, counts=counts, remedies=partial(remedies, stakes))
    if part.covariance is None or stakes.start.covariance is None or unclear or method == "weighted":
        return unclear, ()
    coefficients = part.covariance[..., 2:, 2:].reshape(-1, 2 * len(names), 2 * len(names))
    small = optimism(felt, coefficients if counts is None else coefficients[counts], names)
    return (), (small,) if small else ()


def _fitted(
    stack: Stack, method: str, strength: float | str | None, keep: float | None, *, assumed: bool
) -> tuple[Fitted, str]:
    """Weights, and the method that found them."""
    try:
        return fit_weights(stack, method, strength=strength, keep=keep), method
    except UndeterminedError:
        if method != "weighted" or not assumed:
            raise
        return fit_weights(stack, "least-squares"), "least-squares"  # what is assumed refuses nothing


def _with_words(result: Correction, warnings: tuple[str, ...], notes: tuple[str, ...]) -> Correction:
    for name in ("weights", "before", "after", "covariance", "after_covariance"):
        array = getattr(result, name)
        if array is not None:
            array.flags.writeable = False
    return replace(result, warnings=warnings, notes=notes)
