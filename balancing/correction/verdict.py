"""Verdict of a balance per plane and sensor: pass, fail, or not decidable with these readings.

One value with errors against one limit: `balancing.correction.limit_check`.

Residual unbalance from a check run: with the coefficients W of the planes, the vibration Y that is left is
that of the weights û with W û = Y in the least-squares sense, û = W⁺ Y; what would have to be added is −û.
Errors of Y and W both count, as in `correct` by least squares, with D = −û.
Predicted: what is mounted, M, less what the readings ask for, D; û = M − D with the covariance of D.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from balancing.coefficients.baseline import match_speeds, starting_point
from balancing.coefficients.identifiability import check_planes
from balancing.coefficients.influence import Influence
from balancing.correction.correction_errors import stack_errors
from balancing.correction.correction_result import Correction
from balancing.correction.correction_warnings import reading_names
from balancing.correction.limit_check import Judgement, Word, judge, judge_unbalance
from balancing.correction.selected_planes import plane_indices
from balancing.data.conventions import Labels
from balancing.data.limits import Limits
from balancing.data.result_columns import INVISIBLE
from balancing.data.trials import Trials
from balancing.iso21940 import Tolerance
from balancing.solvers.correction_methods import Stack, fit_weights
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.result import Column, frame, rows
from rotorid.base.rpm import RPM, rpm
from rotorid.base.text import capital, counted
from rotorid.base.unit_words import vibration_unit_words, weight_unit_words

if TYPE_CHECKING:
    import pandas as pd


_GRAM_MM = 1e6
POOR = 1e-3
"""Probability of χ² below which unbalance in the planes does not explain the readings."""
_SHOWN = 3
_UNEXPLAINED = (
    "unbalance in these planes does not explain the readings within their errors: there is more, "
    "elsewhere on the rotor or not from unbalance; the residual is less certain than it seems"
)


@dataclass(frozen=True, eq=False)
class Verdict(Answered):
    """All judgements of a balance.

    Attributes
    ----------
    rows
        Planes, tolerance planes and sensors.
    source
        "check run NAME" or "prediction".
    labels
        Units and conventions to print in.
    warnings
        What the user should know.
    """

    rows: tuple[Judgement, ...]
    source: str
    labels: Labels = field(default_factory=Labels)
    warnings: tuple[str, ...] = ()

    @property
    def overall(self) -> Word:
        """Fail if anything fails, pass if everything passes."""
        words = {row.verdict for row in self.rows}
        if "fail" in words:
            return "fail"
        return "pass" if words == {"pass"} else "not decidable"

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's own units (tolerance planes in g_mm); what is unknown is None."""
        return {
            "source": self.source,
            "verdict": self.overall,
            "rows": rows(self._columns()),
            "warnings": list(self.warnings),
        }

    def to_frame(self) -> pd.DataFrame:
        """One row per judgement: the keys of `to_dict`."""
        return frame(self._columns())

    @property
    def answer(self) -> Answer:
        """Pass, fail or not decidable, the planes and the sensors nearest to it; then all the others."""
        told = [self._row_words(row) for row in rows(self._columns())]
        same = [k for k, row in enumerate(self.rows) if row.verdict == self.overall]
        near = sorted(same, key=lambda k: round(self.rows[k].limit / (self.rows[k].size or 1e-30), 6))
        shown = [k for k, row in enumerate(self.rows) if row.kind != "sensor"]
        shown += [k for k in near if k not in shown][:_SHOWN]
        others = [words for k, words in enumerate(told) if k not in shown]
        why = {
            "pass": "kept",
            "fail": "not kept",
            "not decidable": "open: the 95 % region lies on both sides, or the errors are unknown; repeated "
            "readings or stated errors would tell",
        }[self.overall]
        of = f"{len(same)} of {counted(len(told), 'limit')}"
        return Answer(
            f"{capital(self.overall)} ({self.source}): {of} {why}.",
            "\n".join(told[k] for k in shown),
            self.warnings,
            tables=("\n".join(["The other limits:", *others]),) if others else (),
            more="the other limits",
        )

    def _row_words(self, row: dict[str, Any]) -> str:
        sensor = row["kind"] == "sensor"
        unit = vibration_unit_words(row["unit"]) if sensor else weight_unit_words(row["unit"])
        at = "" if row["speed_rpm"] is None else f" at {self.labels.speed_words(row['speed_rpm'] / RPM)}"
        within = "errors unknown" if row["low"] is None else f"{row['low']:.3g} … {row['high']:.3g} with 95 %"
        size = row["size"] if row["size"] > INVISIBLE * row["limit"] else 0.0
        value = f"{size:.4g} {unit}".rstrip()
        name = f"{row['kind']} {row['name']}{at}"
        return f"  {name}: {value} ({within}), limit {row['limit']:.4g}: {row['verdict']}"

    def _columns(self) -> tuple[Column, ...]:
        labels = self.labels
        scales = {
            "plane": (labels.weight_scale, labels.weight_unit),
            "bearing": (_GRAM_MM, "g_mm"),
            "sensor": (labels.vibration_scale, labels.vibration_unit),
        }
        scale = np.array([scales[row.kind][0] for row in self.rows])
        values = [
            (labels.vibration if row.kind == "sensor" else labels.weight)(row.value) for row in self.rows
        ]
        size, low, high, limit, speeds = (
            np.array([getattr(row, name) for row in self.rows], dtype=float)
            for name in ("size", "low", "high", "limit", "speed")
        )
        return (
            Column("kind", [row.kind for row in self.rows]),
            Column("name", [row.name for row in self.rows]),
            Column("speed_rpm", [rpm(speed) for speed in speeds]),
            Column("size", size * scale),
            Column("angle_deg", [float(angle) if amount else np.nan for amount, angle in values]),
            Column("low", low * scale),
            Column("high", high * scale),
            Column("limit", limit * scale),
            Column("unit", [scales[row.kind][1] for row in self.rows]),
            Column("verdict", [row.verdict for row in self.rows]),
        )


def verdict_of_prediction(
    correction: Correction,
    *,
    tolerance: Tolerance | None = None,
    radii: Mapping[str, float] | None = None,
    mounted: ArrayLike | None = None,
    after: ArrayLike | None = None,
) -> Verdict:
    """Judge what is expected before a check run: its limits, and a tolerance if there is one.

    Parameters
    ----------
    correction
        With its limits of readings.
    tolerance, radii
        As of `judge_unbalance`, for the planes of the correction.
    mounted
        Weights (P,) that are mounted in place of the proposed ones (pieces, rounding); None: those.
    after
        Predicted readings (S, C) with these mounted; None: the correction's own.

    Raises
    ------
    ValueError
        Where nothing is given to judge by, and as `judge_unbalance`.
    """
    c = correction
    D = c.weights if mounted is None else np.asarray(mounted, dtype=complex)
    judged: list[Judgement] = []
    if tolerance is not None:
        u = D - c.weights
        judged += judge_unbalance(u, c.covariance, tolerance, c.planes, radii=radii, dof=c.dof)
    readings = c.after if after is None else np.asarray(after, dtype=complex)
    limit = None if c.limits is None else c.limits.residual
    judged += _readings(c.sensors, c.speeds, readings, c.after_covariance, limit, c.dof)
    return _verdict(judged, "prediction", c.labels)


def verdict_of_check(
    influence: Influence,
    check: Trials,
    *,
    run: int = -1,
    tolerance: Tolerance | None = None,
    radii: Mapping[str, float] | None = None,
    limits: Limits | None = None,
    planes: Sequence[str] | None = None,
) -> Verdict:
    """Judge one check run, everything mounted that shall stay.

    Parameters
    ----------
    influence
        Coefficients, at the speeds and for the sensors of the check run (there may be more).
    check
        Check runs; what was mounted in them does not matter here.
    run
        Which of them, by index; default the last.
    tolerance, radii
        As of `judge_unbalance`.
    limits
        Of readings, in the order of the coefficients' speeds and sensors.
    planes
        Use these planes only; None: those of the tolerance, or all.

    Raises
    ------
    UndeterminedError
        Where the readings do not tell the planes apart.
    ValueError
        Where nothing is given to judge by, for unknown planes, sensors or speeds, and as `judge_unbalance`.
    """
    at = match_speeds(check.speeds, influence.speeds)
    unknown = [name for name in check.sensors if name not in influence.sensors]
    if unknown:
        raise ValueError(f"there are no coefficients of sensor {unknown[0]!r}, which the check run has")
    pick = np.ix_(at, [influence.sensors.index(name) for name in check.sensors])
    known = influence.part(at, [influence.sensors.index(name) for name in check.sensors])
    name = check.runs[run]
    only = [range(len(check.runs))[run]]
    bare = replace(
        check,
        runs=(name,),
        readings=check.readings[:, only],
        steps=None if check.steps is None else check.steps[:, :, only],
        covariance=None if check.covariance is None else check.covariance[:, :, :, only],
        planes=(),
        weights=np.zeros((1, 0), dtype=complex),
    )
    start = starting_point(known, bare)
    warnings = start.warnings
    judged: list[Judgement] = []
    if tolerance is not None:
        chosen = plane_indices(known, planes or tolerance.planes)
        used = tuple(known.planes[p] for p in chosen)
        W, Y = known.W[..., chosen].reshape(-1, len(chosen)), start.readings.ravel()
        check_planes(W, used)
        errors = stack_errors(known, start, list(range(len(at))), chosen)
        own, *columns = (None,) * 3 if errors is None else (errors.channels, errors.common, errors.parameters)
        names = reading_names(start.labels, known.sensors, known.speeds)
        stack = Stack(W, Y, own, None, None, used, names, str, str, columns[0], parameters=columns[1])
        found = fit_weights(stack, "least-squares")
        covariance, dof = (None, None) if errors is None else errors.weights(found)
        if errors is not None and not errors.explain(found.weights, POOR):
            warnings += (_UNEXPLAINED,)
        judged += judge_unbalance(-found.weights, covariance, tolerance, used, radii=radii, dof=dof)
    own_errors = None if start.covariance is None else start.covariance[..., :2, :2]
    limit = None if limits is None else limits.residual[pick]
    judged += _readings(check.sensors, known.speeds, start.readings, own_errors, limit, start.model.dof)
    return _verdict(judged, f"check run {name}", start.labels, warnings)


def _readings(
    sensors: Sequence[str],
    speeds: FloatArray,
    readings: ComplexArray,
    covariance: FloatArray | None,
    limit: FloatArray | None,
    dof: float | None,
) -> list[Judgement]:
    if limit is None:
        return []
    return [
        judge(
            "sensor",
            name,
            readings[s, c],
            limit[s, c],
            None if covariance is None else covariance[s, c],
            dof,
            w,
        )
        for s, w in enumerate(speeds.tolist())
        for c, name in enumerate(sensors)
        if np.isfinite(limit[s, c])
    ]


def _verdict(
    rows: Sequence[Judgement], source: str, labels: Labels, warnings: tuple[str, ...] = ()
) -> Verdict:
    if not rows:
        raise ValueError("there is nothing to judge by: give a tolerance, or limits of sensors")
    return Verdict(tuple(rows), source, labels, warnings)
