"""Check runs refine the influence coefficients: least squares over all runs, and what moved by it.

A check run with the weights T mounted obeys the relation of every trial run, Y_run = Y₀ + W T_run
(`balancing.coefficients.influence`): it is one more run of the same fit, rows weighted by the variance of
their readings where that is known. With it the fit is over-determined, so that runs which disagree show.

A coefficient that moves far against the one from the trial runs alone says that the rotor did not repeat
itself, is not linear, or that something else was mounted than is written; it is named.

What to add to the weights of the last check run (trim) is the correction by the refined coefficients less
what is mounted: D_refined − T_last. The correction itself stays the total for the bare rotor, so that limits
of the total hold.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from balancing.coefficients.baseline import match_speeds
from balancing.coefficients.identifiability import UndeterminedError
from balancing.coefficients.influence import Influence, estimate_influence, estimate_like
from balancing.data.trials import Trials
from balancing.solvers.error_propagation import region_radius
from rotorid.base.arrays import AnyArray, ComplexArray, FloatArray
from rotorid.base.rpm import rpm_text

if TYPE_CHECKING:
    from balancing.correction.correction_result import Correction


MOVED_AMPLITUDE = 0.5
"""Relative change of the size of a coefficient above which it is named."""
MOVED_ANGLE = np.deg2rad(45)
"""Change of its phase, rad, above which it is named."""

_ROUNDING = 1e-9
"""Coefficients below this share of the plane's largest one are none."""
_TIMES = 10.0
_NAMED = 3


def refine(
    trials: Trials, *checks: Trials, corrections: Correction | Mapping[str, complex] | None = None
) -> Influence:
    """Influence coefficients from trial runs and check runs together.

    Parameters
    ----------
    trials
        Trial runs, as for `estimate_influence`.
    checks
        Check runs in their order, of all or some of the sensors and speeds of the trial runs (speeds within
        0.5 % count as one). Weights of their planes are all that was mounted in them.
    corrections
        What was mounted in check runs that have no planes: a correction, or weights by plane.

    Returns
    -------
    Influence
        Its last run is the last check run, so that `Correction.to_add` is what to add to it. Where
        check runs do not cover a sensor or speed, its coefficients are those of the trial runs alone.
        Warnings name every coefficient that moved by more than 50 % or 45°.

    Raises
    ------
    UndeterminedError
        Where all runs together do not determine the coefficients.
    ValueError
        Without check runs; for sensors and speeds that the trial runs do not have, and where nobody says
        what was mounted.
    """
    if not checks:
        raise ValueError("there is no check run: give one or more beside the trial runs")
    rows, columns = _common(trials, checks)
    alone, notes = _alone(trials)
    everywhere = len(rows) == len(trials.speeds) and len(columns) == len(trials.sensors)
    if everywhere:
        refined = estimate_influence(_joined(trials, checks, corrections, rows, columns))
    else:
        refined = _partly(trials, checks, corrections, rows, columns, alone)
    words = notes if alone is None else _moved(alone, refined)
    return replace(refined, warnings=refined.warnings + words)


def mounted_in(
    check: Trials, corrections: Correction | Mapping[str, complex] | None = None
) -> dict[str, ComplexArray]:
    """Weights of each run of a check by plane, shape (R,): those it has itself, else the corrections.

    Raises
    ------
    ValueError
        Where nobody says what was mounted.
    """
    R = len(check.runs)
    if check.planes:
        return {plane: check.weights[:, p] for p, plane in enumerate(check.planes)}
    if corrections is None:
        raise ValueError(
            f"what was mounted in the check run {check.runs[0]!r} is not known: give its weights table, or "
            "the corrections that were mounted"
        )
    if isinstance(corrections, Mapping):
        return {plane: np.full(R, weight, dtype=complex) for plane, weight in corrections.items()}
    pairs = zip(corrections.planes, corrections.weights.tolist(), strict=True)
    return {plane: np.full(R, weight, dtype=complex) for plane, weight in pairs}


def runs_and_weights(
    trials: Trials, checks: Sequence[Trials], corrections: Correction | Mapping[str, complex] | None
) -> tuple[tuple[str, ...], tuple[str, ...], ComplexArray]:
    """Names of all runs (R), of the planes with a weight in any (P), and the weights (R, P).

    Raises
    ------
    ValueError
        As of `mounted_in`.
    """
    mounted = [mounted_in(check, corrections) for check in checks]
    later = [plane for weights in mounted for plane, values in weights.items() if values.any()]
    planes = tuple(dict.fromkeys((*trials.planes, *later)))
    names = list(trials.runs)
    for check in checks:
        for name in check.runs:
            names.append(different(name, names))
    weights = np.zeros((len(names), len(planes)), dtype=complex)
    weights[: len(trials.runs), : len(trials.planes)] = trials.weights
    first = len(trials.runs)
    for check, own in zip(checks, mounted, strict=True):
        last = first + len(check.runs)
        for p, plane in enumerate(planes):
            weights[first:last, p] = own.get(plane, 0.0)
        first = last
    return tuple(names), planes, weights


def different(name: str, names: Sequence[str]) -> str:
    """The name, marked where there is such a run already."""
    new, k = name, 1
    while new in names:
        new = f"{name} (check)" if k == 1 else f"{name} (check {k})"
        k += 1
    return new


def sensors_in(check: Trials, trials: Trials) -> list[int]:
    """Where the sensors of a check run stand among those of the trial runs.

    Raises
    ------
    ValueError
        For a sensor that the trial runs do not have.
    """
    for name in check.sensors:
        if name not in trials.sensors:
            raise ValueError(
                f"the check run has readings of sensor {name!r}, which the trial runs do not have; they have "
                f"those of {', '.join(map(repr, trials.sensors))}"
            )
    return [trials.sensors.index(name) for name in check.sensors]


def together(
    trials: Trials, *checks: Trials, corrections: Correction | Mapping[str, complex] | None = None
) -> Trials:
    """Trial runs and check runs as one table, of the speeds and sensors that all have.

    Parameters
    ----------
    trials, checks, corrections
        As of `refine`.
    """
    return _joined(trials, checks, corrections, *_common(trials, checks))


def _common(trials: Trials, checks: Sequence[Trials]) -> tuple[list[int], list[int]]:
    """Speeds and sensors of the trial runs that all check runs have."""
    at = [match_speeds(check.speeds, trials.speeds, "trial runs") for check in checks]
    rows = [s for s in range(len(trials.speeds)) if all(s in speeds for speeds in at)]
    sensors = [sensors_in(check, trials) for check in checks]
    return rows, [c for c in range(len(trials.sensors)) if all(c in own for own in sensors)]


def _joined(
    trials: Trials,
    checks: Sequence[Trials],
    corrections: Correction | Mapping[str, complex] | None,
    rows: list[int],
    columns: list[int],
) -> Trials:
    """Trial and check runs as one table, at speeds and sensors (indices of the trial runs') that all have."""
    names, planes, weights = runs_and_weights(trials, checks, corrections)
    tables, picks = (trials, *checks), [(rows, columns)]
    for check in checks:
        speeds = match_speeds(check.speeds, trials.speeds, "trial runs")
        sensors = sensors_in(check, trials)
        picks.append(([speeds.index(s) for s in rows], [sensors.index(c) for c in columns]))

    def of_all(arrays: Iterable[AnyArray]) -> AnyArray:
        return _side_by_side([a[..., at, :][..., of] for a, (at, of) in zip(arrays, picks, strict=True)])

    rounded = any(each.steps is not None for each in tables)
    measured = any(each.covariance is not None for each in tables)
    return Trials(
        runs=names,
        speeds=trials.speeds[rows],
        sensors=tuple(trials.sensors[c] for c in columns),
        planes=planes,
        readings=of_all(each.readings for each in tables),
        weights=weights,
        errors=next((each.errors for each in tables if each.errors is not None), None),
        run_errors=next((each.run_errors for each in tables if each.run_errors is not None), None),
        labels=trials.labels,
        warnings=tuple(dict.fromkeys(word for each in tables for word in each.warnings)),
        steps=of_all(map(_steps, tables)) if rounded else None,
        covariance=of_all(_covariances(tables)) if measured else None,
    )


def _steps(trials: Trials) -> FloatArray:
    """Of readings that are not rounded: zero."""
    return np.zeros((2, *trials.readings.shape)) if trials.steps is None else trials.steps


def _covariances(tables: Sequence[Trials]) -> list[FloatArray]:
    """As measured; of a table without them zero where errors are stated, else the mean of the others."""
    known = [np.nanmean(each.covariance[[0, 1], [0, 1]]) for each in tables if each.covariance is not None]
    variance = 0.0 if any(each.errors is not None for each in tables) else np.mean(known)
    usual = variance * np.eye(2)[..., None, None, None, None]
    return [
        np.tile(usual, each.readings.shape) if each.covariance is None else each.covariance for each in tables
    ]


def _side_by_side(blocks: Sequence[AnyArray]) -> AnyArray:
    """Runs of several tables, arrays (…, K, R, S, C), as those of one: NaN where one has fewer repeats."""
    most = max(block.shape[-4] for block in blocks)
    padded = []
    for block in blocks:
        gap = np.full((*block.shape[:-4], most - block.shape[-4], *block.shape[-3:]), np.nan, block.dtype)
        padded.append(np.concatenate((block, gap), axis=-4))
    return np.concatenate(padded, axis=-3)


def _alone(trials: Trials) -> tuple[Influence | None, tuple[str, ...]]:
    """Coefficients of the trial runs alone, or None and why there are none."""
    try:
        return estimate_influence(trials), ()
    except UndeterminedError as error:
        reason = str(error).partition("\n")[0]
        return None, (
            "the trial runs alone do not determine the coefficients, so that nothing can be said about how "
            f"far the check runs moved them: {reason}",
        )


def _partly(
    trials: Trials,
    checks: Sequence[Trials],
    corrections: Correction | Mapping[str, complex] | None,
    rows: list[int],
    columns: list[int],
    alone: Influence | None,
) -> Influence:
    """Refined where all check runs were read; elsewhere the coefficients of the trial runs alone.

    The errors of all runs hold for both. A column of `Influence.common` belongs to a run: that of a trial run
    is the same on either side.
    """
    if alone is None:
        alone = estimate_influence(trials)  # raises, and says why
    if not (rows and columns):
        raise ValueError(
            "the check runs have no sensor and speed in common: give those together that were read alike"
        )
    joint = _joined(trials, checks, corrections, rows, columns)
    unknown = [plane for plane in joint.planes if plane not in alone.planes]
    if unknown:
        raise UndeterminedError(
            f"only check runs have a weight in plane {unknown[0]!r}, and not every sensor was read in them "
            "at every speed: read all of them, or leave the weight out"
        )
    part = estimate_influence(joint)
    rest = estimate_like(trials, part)
    assert part.common is not None
    assert rest.common is not None
    common = np.zeros((*part.common.shape[:2], *rest.common.shape[2:]), dtype=complex)
    common[:, : rest.common.shape[1]] = rest.common
    at = np.ix_(rows, columns)
    common[:, :, at[0], at[1]] = part.common

    def placed(name: str) -> AnyArray:
        array: AnyArray = getattr(rest, name).copy()
        array[at] = getattr(part, name)
        return array

    lacking = [
        f"{name!r} at {rpm_text(speed)}"
        for s, speed in enumerate(trials.speeds)
        for c, name in enumerate(trials.sensors)
        if s not in rows or c not in columns
    ]
    more = f" and {len(lacking) - _NAMED} more" if len(lacking) > _NAMED else ""
    words = (
        f"not every check run has a reading of sensor {', '.join(lacking[:_NAMED])}{more}: the coefficients "
        "there are those of the trial runs alone"
    )
    return replace(
        part,
        speeds=alone.speeds,
        sensors=alone.sensors,
        W=placed("W"),
        baseline=placed("baseline"),
        covariance=placed("covariance"),
        digits=placed("digits") if part.digits is not None and rest.digits is not None else None,
        common=common,
        dof=min((d for d in (rest.dof, part.dof) if d is not None), default=None),
        warnings=tuple(dict.fromkeys((*alone.warnings, *part.warnings, words))),
    )


def _moved(alone: Influence, refined: Influence) -> tuple[str, ...]:
    """A sentence for each coefficient that moved by more than 50 % or 45°."""
    words = []
    for p, plane in enumerate(alone.planes):
        old, new = alone.W[..., p], refined.W[..., refined.planes.index(plane)]
        rounding = _ROUNDING * max(float(np.abs(old).max()), float(np.abs(new).max()))
        for s, c in np.argwhere((np.abs(old) > rounding) | (np.abs(new) > rounding)):
            change = abs(new[s, c]) / max(abs(old[s, c]), rounding) - 1.0
            both = min(abs(old[s, c]), abs(new[s, c])) > rounding
            turn = float(np.angle(new[s, c] * np.conj(old[s, c]))) if both else 0.0
            if abs(change) <= MOVED_AMPLITUDE and abs(turn) <= MOVED_ANGLE:
                continue
            unclear = _unclear(alone, int(s), int(c), p)
            within = " (which the trial runs alone do not tell from zero)" if unclear else ""
            words.append(
                f"the check runs move the coefficient of plane {plane!r} on sensor {alone.sensors[c]!r} at "
                f"{rpm_text(alone.speeds[s])}{within} by {_percent(change)} and "
                f"{round(np.degrees(turn)):+d}°"
            )
    if words:
        words.append(
            "coefficients that move by more than 50 % or 45° are not repeatable: check what was mounted in "
            "each run, and where; else the rotor does not repeat itself or is not linear"
        )
    return tuple(words)


def _unclear(influence: Influence, s: int, c: int, p: int) -> bool:
    """Whether a coefficient lies within its errors at 95 %."""
    if influence.covariance is None:
        return False
    own = slice(2 + 2 * p, 4 + 2 * p)
    block = influence.covariance[s, c, own, own]
    regular = block + 1e-12 * np.trace(block) * np.eye(2)
    w = np.array([influence.W[s, c, p].real, influence.W[s, c, p].imag])
    return bool(np.trace(block) > 0 and w @ np.linalg.solve(regular, w) < region_radius(None) ** 2)


def _percent(change: float) -> str:
    return f"{round(100 * change):+d} %" if change < _TIMES else f"more than {_TIMES:g} times"
