"""Correction weights: D minimises |Y₀ + W D| over all sensors and speeds ([S] (28)–(40), Den Hartog)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from balancing.coefficients.baseline import match_speeds, starting_point
from balancing.coefficients.identifiability import REMEDY, UndeterminedError, check_planes
from balancing.coefficients.influence import Influence
from balancing.coefficients.unresolved_planes import check_resolution
from balancing.correction.correction_errors import stack_errors
from balancing.correction.correction_result import Correction
from balancing.correction.correction_warnings import (
    EMPTY,
    binding,
    left_out,
    notes,
    reading_names,
    warnings_of,
)
from balancing.correction.mount_decision import Inputs, coarse, decide_to_mount, remedies
from balancing.correction.region_coverage import too_small, uncertain
from balancing.correction.selected_planes import plane_indices, rows_of
from balancing.data.limits import Limits
from balancing.data.trials import Trials
from balancing.solvers.conditioning import conditioning
from balancing.solvers.correction_methods import Fitted, Stack, fit_weights
from balancing.solvers.error_propagation import region_radius as region_radius
from rotorid.base.arrays import ComplexArray

TOGETHER = "; each weight alone is uncertain, what they leave together is not"


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
        stated or measured errors by a χ² test at 95 % (`balancing.coefficients.identifiability`). Errors that
        are assumed refuse nothing (`Correction.decision` says what they mean): the digits of the readings do,
        or, without an end of them, a condition number above 1000, which no instrument supports.
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
    inputs = Inputs(influence, start, used, chosen, rows, kept)
    soft = strength is not None or keep is not None
    asked = method
    if method is None:
        method = "weighted" if start.covariance is not None and not soft else "least-squares"
    unclear, unclear_regions = ((), ()) if soft else _resolved(inputs, part, felt, method, refuse=refuse)
    planes_told = conditioning(felt, names)
    errors = stack_errors(influence, start, used, chosen)
    stack = Stack(
        W,
        Y.ravel(),
        None if errors is None else errors.channels,
        rows,
        kept if kept is not None and kept.any else None,
        names,
        reading_names(start.labels, influence.sensors, influence.speeds[used]),
        start.labels.amplitude_words,
        start.labels.weight_words,
        None if errors is None else errors.common,
        None if errors is None else errors.explain,
        None if errors is None else errors.parameters,
    )
    fitted, method = _fitted(
        stack, method, strength, keep, assumed=asked is None and start.model.source == "assumed"
    )
    D = fitted.weights
    if stack.limits is not None:
        D = np.where(np.abs(D) < EMPTY * np.linalg.norm(Y) / np.linalg.norm(W, axis=0), 0.0, D)
    after = Y + influence.W[used][..., chosen] @ D
    covariance, dof = (None, None) if errors is None else errors.weights(fitted)
    # of an update from a type: its regions hold (docs/sure.md)
    tested = influence.baseline is not None and influence.common is None and influence.parameters is not None
    estimated = influence.run_errors.origin == "estimated"
    if method == "weighted" and covariance is not None and not (tested or estimated):
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
    result = replace(
        result,
        decision=decide_to_mount(
            inputs, D, widths, soft=soft, remove=remove, unclear=unclear, check_rms=result.check_rms
        ),
    )
    warnings, words = influence.warnings + start.warnings, influence.notes
    if result.decision.word == "mount":
        warnings += (
            tuple(words.removesuffix(REMEDY) + TOGETHER for words in unclear)
            + unclear_regions
            + fitted.warnings
            + warnings_of(result, felt, alike=not unclear)
        )
        warnings += left_out(influence, start.readings, chosen, used, D, start.labels, limits)
        words += notes(result) + coarse(influence)
    else:  # the decision says what these would
        warnings = tuple(w for w in warnings if w not in influence.contradictions)
        warnings += fitted.warnings + warnings_of(result, felt, alike=False, rising=False)
    return _with_words(result, warnings, words)


def _resolved(
    inputs: Inputs, part: Influence, felt: ComplexArray, method: str, *, refuse: bool
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Refuse planes that act alike; what is unclear about the planes, and about regions of the weights."""
    names, counts = inputs.names, None if inputs.row_weights is None else inputs.row_weights > 0
    check_planes(felt, names)
    unclear = check_resolution(part, refuse=refuse, counts=counts, remedies=partial(remedies, inputs))
    if part.covariance is None or inputs.start.covariance is None or unclear or method == "weighted":
        return unclear, ()
    coefficients = part.covariance[..., 2:, 2:].reshape(-1, 2 * len(names), 2 * len(names))
    small = too_small(felt, coefficients if counts is None else coefficients[counts], names)
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
