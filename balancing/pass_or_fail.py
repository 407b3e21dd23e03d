"""Verdict of a balance per plane and sensor: pass, fail, or not decidable with these readings.

One complex number with errors, a residual unbalance or a reading, is compared with one limit: it passes where
all of its 95 % region is within the limit, fails where none of it is; otherwise, and where the errors are
unknown, the readings do not decide.

Residual unbalance from a check run: with the coefficients W of the planes, the vibration Y that is left is
that of the weights û with W û = Y in the least-squares sense, û = W⁺ Y; what would have to be added is −û.
Predicted: what is mounted, M, less what the readings ask for, D; û = M − D. Draws of Y and W give those of û.

**Zones** A to D by which ISO 20816 judges vibration.
A boundary belongs to the zone below it. The numbers are those of the machine's class, which the user states;
the standard judges broadband vibration, of which a reading is the part at the speed of rotation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from balancing.check_run import last_run
from balancing.conditioning import check_planes
from balancing.conventions import Labels
from balancing.correction_result import Correction
from balancing.influence import Influence, match_readings, plane_indices
from balancing.iso21940 import Tolerance
from balancing.methods import solve
from balancing.printed_readings import INVISIBLE, reading_columns
from balancing.regions import NORMAL_RADIUS, Region, region_edge
from balancing.trials import Limits, Trials
from balancing.weights_and_prediction import Outlook
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.tables import Column, records, text
from rotorid.base.text import capital, counted, rpm, vibration_unit_words, weight_unit_words

Kind = Literal["plane", "bearing", "sensor"]
Word = Literal["pass", "fail", "not decidable"]
_GRAM_MM = 1e6
_SHOWN = 3
_POINTS = 2880
ZONES = np.array([*"ABCD"])
HEADS = ("now", "predicted", "predicted_95", "check")


@dataclass(frozen=True, eq=False)
class Judgement:
    """One residual unbalance or reading against its limit.

    Attributes
    ----------
    kind, name
        "plane", "bearing" (a tolerance plane) or "sensor", and which.
    speed
        rad/s, of a reading; None for an unbalance.
    value
        Estimate: a weight of the job (plane), kg·m (bearing), a reading (sensor).
    limit
        In the same unit.
    low, high
        Least and largest size in the 95 % region; NaN where errors are unknown.
    """

    kind: Kind
    name: str
    speed: float | None
    value: complex
    limit: float
    low: float = np.nan
    high: float = np.nan

    @property
    def size(self) -> float:
        """Size of the estimate."""
        return abs(self.value)

    @property
    def verdict(self) -> Word:
        """Pass, fail or not decidable."""
        if self.high <= self.limit:
            return "pass"
        return "fail" if self.low > self.limit else "not decidable"


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
    labels: Labels
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
        rows = [self._row(row) for row in self.rows]
        return plain(
            {"source": self.source, "verdict": self.overall, "rows": rows, "warnings": self.warnings}
        )

    @property
    def answer(self) -> Answer:
        """Pass, fail or not decidable, the planes and the sensors nearest to it; then all the others."""
        same = sum(row.verdict == self.overall for row in self.rows)
        near = [row for row in self.rows if row.kind == "sensor"]
        near.sort(key=lambda row: (row.verdict != self.overall, -round(row.size / max(row.limit, 1e-30), 6)))
        shown = [*(row for row in self.rows if row.kind != "sensor"), *near[:_SHOWN]]
        why = {
            "pass": "kept",
            "fail": "not kept",
            "not decidable": "open: the 95 % region lies on both sides"
            if np.isfinite(self.rows[0].high)
            else "open: state errors, or read a run twice",
        }[self.overall]
        others = near[_SHOWN:]
        return Answer(
            f"{capital(self.overall)} ({self.source}): {same} of {counted(len(self.rows), 'limit')} {why}.",
            "\n".join(map(self._words, shown)),
            self.warnings,
            tables=("\n".join(["The other limits:", *map(self._words, others)]),) if others else (),
            more="the other limits" if others else "",
        )

    def _words(self, row: Judgement) -> str:
        cells = self._row(row)
        unit = (vibration_unit_words if row.kind == "sensor" else weight_unit_words)(cells["unit"])
        at = "" if row.speed is None else f" at {self.labels.speed_words(row.speed)}"
        within = f"{cells['low']:.3g} … {cells['high']:.3g} with 95 %"
        within = within if np.isfinite(row.high) else "errors unknown"
        value = f"{cells['size'] if row.size > INVISIBLE * row.limit else 0.0:.4g} {unit}".rstrip()
        name = f"{row.kind} {row.name}{at}"
        return f"  {name}: {value} ({within}), limit {cells['limit']:.4g}: {row.verdict}"

    def _row(self, row: Judgement) -> dict[str, Any]:
        labels = self.labels
        scale, unit, shown = {
            "plane": (labels.weight_scale, labels.weight_unit, labels.weight),
            "bearing": (_GRAM_MM, "g_mm", labels.weight),
            "sensor": (labels.vibration_scale, labels.vibration_unit, labels.vibration),
        }[row.kind]
        amount, angle = shown(row.value)
        return {
            "kind": row.kind,
            "name": row.name,
            "speed_rpm": None if row.speed is None else float(rpm(row.speed)),
            "size": row.size * scale,
            "angle_deg": float(angle) if amount else None,
            "low": row.low * scale,
            "high": row.high * scale,
            "limit": row.limit * scale,
            "unit": unit,
            "verdict": row.verdict,
        }


def largest(values: ComplexArray, covariance: FloatArray) -> FloatArray:
    """Largest size (…) in the 95 % regions of normal values (…) with covariances (…, 2, 2)."""
    return np.asarray(np.abs(region_edge(values, covariance, _POINTS)).max(axis=-1))


def judge(kind: Kind, name: str, limit: float, region: Region, speed: float | None = None) -> Judgement:
    """Judge one complex value.

    Parameters
    ----------
    kind, name, speed
        As of `Judgement`.
    limit
        In the unit of the value.
    region
        The value with its 95 % region; NaN covariance: errors unknown.
    """
    judged = Judgement(kind, name, speed, complex(region.centre[0]), float(limit))
    if np.isnan(region.covariance).any():
        return judged
    size = np.abs(region.edge(_POINTS))
    around = region.holds(np.zeros(1, dtype=complex))
    return replace(judged, low=0.0 if around else float(size.min()), high=float(size.max()))


def judge_unbalance(
    residual: ArrayLike,
    draws: ComplexArray,
    tolerance: Tolerance,
    planes: Sequence[str],
    *,
    radii: Mapping[str, float] | None = None,
) -> tuple[Judgement, ...]:
    """Residual unbalance of each plane, and what they are together at the tolerance planes.

    Parameters
    ----------
    residual
        Of the planes, (P,), kg·m, or kg at the radii.
    draws
        The same redrawn, (n, P); n = 0: errors unknown.
    tolerance
        With the same names of planes (in any order).
    planes
        Names, length P.
    radii
        m, of each plane, where the residuals are masses; None: they are unbalances.

    Raises
    ------
    ValueError
        For planes that the tolerance does not name.
    """
    if sorted(planes) != sorted(tolerance.planes):
        raise ValueError(
            f"the tolerance is for the planes {', '.join(map(repr, tolerance.planes)) or '(none)'}, "
            f"the residual unbalance is in {', '.join(map(repr, planes))}: name the same planes in both"
        )
    radius = np.array([1.0 if radii is None else radii[p] for p in planes])
    order = [tolerance.planes.index(p) for p in planes]
    u = np.asarray(residual, dtype=complex)

    def one(kind: Kind, name: str, row: FloatArray, limit: float) -> Judgement:
        return judge(kind, name, limit, Region.of((draws @ row)[:, None], np.atleast_1d(u @ row)))

    each = zip(planes, np.eye(len(planes)), tolerance.limits[order] / radius, strict=True)
    judged = [one("plane", name, row, limit) for name, row, limit in each]
    if tolerance.transfer is not None:
        ends = zip(("A", "B"), tolerance.transfer[:, order] * radius, tolerance.bearing_limits, strict=True)
        judged += [one("bearing", name, row, float(limit)) for name, row, limit in ends]
    return tuple(judged)


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
        Predicted readings (S, C) with these mounted; None: the correction's.

    Raises
    ------
    ValueError
        Where nothing is given to judge by, and as `judge_unbalance`.
    """
    c = correction
    D = c.weights if mounted is None else np.asarray(mounted, dtype=complex)
    judged: list[Judgement] = []
    if tolerance is not None:
        judged += judge_unbalance(D - c.weights, D - c.draws, tolerance, c.planes, radii=radii)
    if c.limits is not None:
        readings = c.after if after is None else np.asarray(after, dtype=complex)
        judged += _readings(c.influence, readings, c.after_covariance, c.limits.residual)
    return _verdict(judged, "prediction", c.labels)


def verdict_of_check(
    influence: Influence,
    check: Trials,
    *,
    tolerance: Tolerance | None = None,
    radii: Mapping[str, float] | None = None,
    limits: Limits | None = None,
) -> Verdict:
    """Judge the last check run, everything mounted that shall stay.

    Parameters
    ----------
    influence
        Coefficients, at the speeds and for the sensors of the check run (there may be more).
    check
        Check runs; what was mounted in them does not matter here.
    tolerance, radii
        As of `judge_unbalance`.
    limits
        Of readings, in the order of the coefficients' speeds and sensors.

    Raises
    ------
    UndeterminedError
        Where the readings do not tell the planes apart.
    ValueError
        Where nothing is given to judge by, for unknown planes, sensors or speeds, and as `judge_unbalance`.
    """
    where = match_readings(check, influence)
    bare = replace(last_run(check), planes=(), weights=np.zeros((1, 0), dtype=complex))
    left = influence.part(*where).rebased(bare)
    judged: list[Judgement] = []
    if tolerance is not None:
        part = left.part(range(len(left.speeds)), None, plane_indices(left, tolerance.planes))
        W, Y = part.W.reshape(-1, len(part.planes)), part.baseline.ravel()
        check_planes(W, part.planes)
        fitted = solve(W, Y)
        solved = [fitted.resolve(w.reshape(-1, *W.shape), y.reshape(-1, len(Y))) for y, w in part.draws()]
        draws = np.concatenate([0 * fitted.weights[None][:0], *solved])
        judged += judge_unbalance(-fitted.weights, -draws, tolerance, part.planes, radii=radii)
    if limits is not None:
        covariance = left.channels()[..., :2, :2] if left.known_errors else np.full((2, 2), np.nan)
        judged += _readings(left, left.baseline, covariance, limits.residual[np.ix_(*where)])
    return _verdict(judged, f"check run {check.runs[-1]}", left.labels, left.remarks.warnings)


def verdict_of_readings(
    of: Influence, readings: ComplexArray, covariance: FloatArray, limits: Limits
) -> Verdict:
    """Judge predicted readings.

    Parameters
    ----------
    of
        Coefficients, whose speeds and sensors they are.
    readings, covariance
        Predicted, (S, C), and how a check run scatters around them, (S, C, 2, 2); NaN: errors unknown.
    limits
        Of these readings.

    Raises
    ------
    ValueError
        Where no reading has a limit.
    """
    return _verdict(_readings(of, readings, covariance, limits.residual), "prediction", of.labels)


def _readings(
    of: Influence, readings: ComplexArray, covariance: FloatArray, limit: FloatArray
) -> list[Judgement]:
    V = np.broadcast_to(covariance, (*limit.shape, 2, 2))
    each = (
        (s, c, Region(readings[[s], c], V[s, c], NORMAL_RADIUS)) for s, c in np.argwhere(np.isfinite(limit))
    )
    return [judge("sensor", of.sensors[c], limit[s, c], region, float(of.speeds[s])) for s, c, region in each]


def _verdict(
    rows: Sequence[Judgement], source: str, labels: Labels, warnings: tuple[str, ...] = ()
) -> Verdict:
    if not rows:
        raise ValueError("there is nothing to judge by: give a tolerance, or limits of sensors")
    return Verdict(tuple(rows), source, labels, warnings)


@dataclass(frozen=True, eq=False)
class Zones(Answered):
    """Zone of each reading that has boundaries.

    Attributes
    ----------
    places
        Columns speed and sensor.
    letters
        Of the bare rotor ("now"), "predicted", of the largest amplitude in the 95 % region of that
        ("predicted_95") and in the last "check" run; "" where that is not known.
    """

    places: tuple[Column, ...]
    letters: Mapping[str, tuple[str, ...]]

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; the worst of all readings, and each."""
        worst = {name: max(each) or None for name, each in self.letters.items()}
        return {"worst": worst, "readings": records(self._columns())}

    @property
    def answer(self) -> Answer:
        """The worst zone now and then, in a sentence; then that of each reading."""
        now, predicted, bound, check = map(max, self.letters.values())
        words = f"{now} now, {predicted} predicted" + (f" (95 %: {bound})" if bound > predicted else "")
        words += f", {check} in the check run" if check else ""
        return Answer(
            f"Zone {words}: the worst of {counted(len(self.letters['now']), 'reading')}, at 1× alone.",
            tables=(f"Zones:\n{text(self._columns(), left=2)}",),
            more="zones",
        )

    def _columns(self) -> tuple[Column, ...]:
        return (*self.places, *(Column(name, each) for name, each in self.letters.items() if any(each)))


def zones_of(
    outlook: Outlook,
    boundaries: Mapping[str, Sequence[float]],
    after: ComplexArray | None = None,
    check: Trials | None = None,
) -> Zones:
    """Zones of the readings of an outlook.

    Parameters
    ----------
    outlook
        A correction, or what given weights would leave.
    boundaries
        A/B, B/C and C/D of each sensor that has some, amplitudes as those of the readings.
    after
        Predicted readings (S, C) in place of those of the outlook, as with pieces.
    check
        Check runs at speeds of the outlook, of which the last counts.
    """
    predicted, most = outlook.after if after is None else after, np.full(outlook.before.shape, np.nan)
    if outlook.errors_known:
        most = largest(predicted, outlook.after_covariance)
    read = np.full(most.shape, np.nan)
    if check is not None:
        for (s, c), size in np.ndenumerate(np.abs(check.mean[-1])):
            here = np.ix_(outlook.speeds == check.speeds[s], np.array(outlook.sensors) == check.sensors[c])
            read[here] = size
    names = [name for name in outlook.sensors if name in boundaries]
    limits = np.array([boundaries[name] for name in names])

    def letters(readings: ComplexArray | FloatArray) -> tuple[str, ...]:
        sizes = np.abs(readings[:, [outlook.sensors.index(name) for name in names]])
        above = np.count_nonzero(sizes[..., None] > limits, axis=-1)
        return tuple(np.where(np.isnan(sizes), "", ZONES[above]).ravel().tolist())

    each = zip(HEADS, (outlook.before, predicted, most, read), strict=True)
    places = reading_columns(outlook.labels, outlook.speeds, names)
    return Zones(places, {head: letters(readings) for head, readings in each})
