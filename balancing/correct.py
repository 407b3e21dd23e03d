"""Correction weights: D minimises |Y₀ + W D| over all sensors and speeds ([S] (28)–(40), Den Hartog).

Errors take one way. Every draw of (Y₀, W) is solved for its weights, which gives the region of the weights;
and with the weights D as mounted it leaves Y₀ + W D, to which a further run adds its errors, which gives what
a check run will read.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from balancing.check_run import whitened
from balancing.conditioning import UndeterminedError, check_planes, check_stack, conditioning, unresolved
from balancing.correction_result import Correction
from balancing.groups import Groups, mapped, unknowns
from balancing.influence import Influence, match_speeds, plane_indices
from balancing.limits_and_minmax import AT_LIMIT, explain
from balancing.methods import NoErrorsError, Solution, solve
from balancing.mount_decision import Case, decide, remedies
from balancing.printed_readings import reading_names
from balancing.regions import LEVEL
from balancing.trials import Limits, Trials
from balancing.what_if import check_run_spread, todays
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray

EMPTY = 1e-7
"""Effect of a weight, relative to the vibration, below which it is none."""


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
    strength: float | None = None,
    remove: Sequence[str] = (),
    groups: Groups = MappingProxyType({}),
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
        Names of the planes to use, or of groups; default all planes. The others stay empty.
    speeds
        rad/s, to use; default all.
    refuse
        Whether to refuse planes that the measured coefficients tell apart only by their errors; else that is
        a warning. Planes that act alike exactly are always refused.
    method
        "weighted": each reading counts by the inverse of its error, that of the coefficients included; the
        default where errors are known, without ridge. "least-squares"; "minmax": the smallest largest
        amplitude.
    limits
        Largest weights and amplitudes and forbidden angles, for all speeds, sensors and planes of the
        influence coefficients.
    row_weights
        How much each reading counts, (S, C); default all alike. One of weight 0 counts only for its limit.
    strength
        Ridge: planes that act alike get small weights instead of a refusal; relative (0.01 …).
    remove
        Planes where material is taken away instead of added.
    groups
        Planes with weights of fixed ratios and angles: by group, the complex share of each of its planes.

    Returns
    -------
    Correction
        With its draws, where errors are known.

    Raises
    ------
    UndeterminedError
        Where the readings do not tell the planes apart; says which act alike, and what to do instead. Errors
        that are assumed refuse nothing (`Correction.decision` says what they mean): only a condition number
        above 1000 does, which no instrument supports.
    ValueError
        For an unknown plane, speed or method, a missing or unfit baseline, limits that cannot be met.
    """
    today = todays(influence, baseline)
    grouped = unknowns(groups, planes, today.planes) if planes and set(planes) & set(groups) else None
    chosen = plane_indices(today, grouped.planes if grouped else planes)
    used = match_speeds(speeds, today.speeds)
    if grouped is not None and grouped.constrained:
        every = range(len(today.speeds))
        result = correct(
            mapped(today.part(every, None, chosen), grouped.names, grouped.shares),
            speeds=speeds,
            refuse=refuse,
            method=method,
            limits=limits and grouped.limits(limits.pick(every, chosen)),
            row_weights=row_weights,
            strength=strength,
        )
        kept = limits and limits.pick(used, chosen)
        D, most = grouped.shares @ result.weights, kept.max_weight if kept else np.inf
        heavy = np.abs(D) >= (1 - AT_LIMIT) * most
        return replace(
            result,
            influence=today.part(used, None, chosen),
            weights=D,
            draws=result.draws @ grouped.shares.T,
            fitted=replace(result.fitted, weights=D, active_weights=heavy),
            limits=result.limits and kept,
            mounted=today.mounted,
            remove=tuple(p for p in grouped.planes if p in remove),
            unknowns=grouped,
        )
    part = today.part(used, None, chosen)
    given = None if row_weights is None else np.broadcast_to(row_weights, today.W.shape[:2])[used].ravel()
    W, Y, counting = check_stack(part.W.reshape(-1, len(chosen)), part.baseline.ravel(), given)
    rows, counts = None if np.ptp(counting) == 0 else counting / counting.max(), counting > 0
    if not Y.any():
        raise ValueError(
            "the vibration to be corrected is zero at every sensor and speed: there is nothing to balance"
        )
    kept = limits and limits.pick(used, chosen)
    if kept and not kept.any:
        kept = None
    case = Case(part, today, rows, kept)
    unclear = "" if strength is not None else _unclear(case, counts, refuse=refuse)
    fitted, method = fit_part(part, method, rows, kept, strength)
    D = fitted.weights
    if kept:
        D = np.where(np.abs(D) < EMPTY * np.linalg.norm(Y) / np.linalg.norm(W, axis=0), 0.0, D)
    drawn = [np.zeros((0, len(D)), dtype=complex)]
    after_covariance, sizes = check_run_spread(
        part, D, lambda y, w: drawn.append(fitted.resolve(w.reshape(-1, *W.shape), y.reshape(-1, len(Y))))
    )
    draws = np.concatenate(drawn)
    result = Correction(
        influence=part,
        weights=D,
        draws=draws[np.isfinite(draws).all(axis=1)],
        after_covariance=after_covariance,
        check_rms=float(np.quantile(sizes, LEVEL)),
        mounted=today.mounted,
        conditioning=conditioning(W[counts], part.planes),
        fitted=fitted,
        method=method if strength is None else "ridge",
        row_weights=rows,
        limits=kept,
        remove=tuple(name for name in part.planes if name in remove),
        unknowns=grouped,
    )
    if not result.told_apart:
        unclear = unclear or _alike(case, counts, stated=False)
    return replace(result, decision=decide(result, case, unclear, limits))


def _unclear(case: Case, counts: BoolArray, *, refuse: bool) -> str:
    """Refuse planes that known errors of the coefficients alone tell apart, or say so."""
    part = case.part
    check_planes(case.W[counts], part.planes)
    words = _alike(case, counts, stated=True) if part.trials is not None or part.known_errors else ""
    if words and refuse:
        first = part.remarks.contradictions
        rest = [f"Warning: {w}" for w in part.remarks.warnings if w not in first]
        so = f"so {words}" if first else words
        raise UndeterminedError("\n".join((*first, so, *remedies(case), *rest)))
    return words


def _alike(case: Case, counts: BoolArray, *, stated: bool) -> str:
    """Which planes act alike within errors that are known, or any; empty where none do."""
    covariance = case.part.channels(known=stated)[..., 2:, 2:]
    return unresolved(case.W[counts], case.names, covariance[counts.reshape(case.part.baseline.shape)])


def fit_part(
    part: Influence,
    method: str | None = None,
    rows: FloatArray | None = None,
    limits: Limits | None = None,
    strength: float | None = None,
) -> tuple[Solution, str]:
    """Weights, and the method that they follow from; least squares where errors are assumed or hardly any."""
    asked = method or ("weighted" if part.known_errors and strength is None else "least-squares")

    labels, readings = part.labels, reading_names(part.labels, part.sensors, part.speeds)
    by = partial(
        solve,
        part.W.reshape(part.baseline.size, -1),
        part.baseline.ravel(),
        channels=part.channels(),
        columns=part.columns(),
        row_weights=rows,
        limits=limits,
        strength=strength,
        names=part.planes,
        conflict=partial(
            explain,
            readings=readings,
            amplitude=labels.amplitude_words,
            weight=labels.weight_words,
        ),
        explained=partial(_explained, part) if rows is None or rows.all() else None,
    )
    try:
        return by(asked), asked
    except (UndeterminedError, NoErrorsError) as error:
        refused = isinstance(error, UndeterminedError) and part.reading.source != "assumed"
        if method is not None or refused:
            raise
        return by("least-squares"), "least-squares"


def _explained(part: Influence, D: ComplexArray) -> bool:
    """Whether what is left of Y₀ + W D, free of other weights, is within what 95 % of the draws leave."""
    noise = part.errors.noise.changed(np.concatenate(([1.0], D))[None])
    effects = (z * W[None] for W in np.moveaxis(part.W, -1, 0) for z in (1, 1j))
    left, *usual = whitened(part, noise, (part.baseline + part.W @ D)[None], *effects)[2]
    return bool(left <= np.quantile(usual, LEVEL))
