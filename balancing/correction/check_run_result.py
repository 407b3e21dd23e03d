"""Readings of check runs beside their prediction: result, words, and JSON types in the job's own units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.data.conventions import Labels
from balancing.data.result_columns import (
    ROUNDING,
    known,
    largest_readings,
    reading_columns,
    rms,
    small,
    three_figures,
    vector_columns,
    weight_rows,
)
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.text import figures, sentence

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class CheckComparison(Answered):
    """Readings of R check runs beside their prediction.

    Attributes
    ----------
    runs, sensors, planes
        Names, lengths R, C and P.
    speeds
        rad/s, shape (S,), those of the check runs.
    weights
        What was mounted, for the bare rotor, shape (R, P).
    as_proposed
        Whether these are the proposed corrections (the check runs do not say what was mounted).
    before, predicted, achieved
        Vibration of the bare rotor (S, C), and with `weights` mounted: predicted and read (mean of the
        repeats), shape (R, S, C).
    covariance
        Of achieved − predicted, real and imaginary part, (R, S, C, 2, 2); None where errors are unknown.
    distance
        Of each difference from zero in its standard deviations (a radius in two dimensions: 95 % of all lie
        below 2.45 where errors are stated), (R, S, C); None where errors are unknown.
    chi_square, n
        Of all differences, and its degrees of freedom; chi_square None where errors are unknown.
    dof
        Degrees of freedom of the errors; None for stated ones.
    probability
        That errors alone make a larger χ²; None where they are unknown.
    explained
        Whether the errors explain the differences at 95 %; None where they are unknown.
    change
        Weights (P,) in the correction planes that would cause the differences, within the errors, in
        addition to `weights`; None where the differences are explained, or no such weights explain them.
    labels
        Units and conventions to print in.
    warnings
        What the user should know.
    """

    runs: tuple[str, ...]
    sensors: tuple[str, ...]
    planes: tuple[str, ...]
    speeds: FloatArray
    weights: ComplexArray
    as_proposed: bool
    before: ComplexArray
    predicted: ComplexArray
    achieved: ComplexArray
    covariance: FloatArray | None
    distance: FloatArray | None
    chi_square: float | None
    n: int
    dof: float | None
    probability: float | None
    explained: bool | None
    change: ComplexArray | None
    labels: Labels
    warnings: tuple[str, ...]

    @property
    def difference(self) -> ComplexArray:
        """Achieved − predicted, shape (R, S, C)."""
        return np.asarray(self.achieved - self.predicted)

    @property
    def improvement_predicted(self) -> float | None:
        """Rms before by rms predicted; None where nothing should be left."""
        return _factor(self.before, self.predicted)

    @property
    def improvement_achieved(self) -> float | None:
        """Rms before by rms achieved; None where nothing was left."""
        return _factor(self.before, self.achieved)

    @property
    def worst(self) -> tuple[int, int, int]:
        """Run, speed and sensor of the reading that differs most: in its errors, or in size without them."""
        size = np.abs(self.difference) if self.distance is None else self.distance
        r, s, c = np.unravel_index(int(np.argmax(size)), size.shape)
        return int(r), int(s), int(c)

    @property
    def verdict(self) -> str:
        """One or two sentences: whether the errors explain the differences, and what else may."""
        return _verdict_words(self)

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's own units and conventions; what is unknown is None."""
        labels, readings = self.labels, self._columns()
        sizes = {column.name: list(column.values) for column in readings}
        mounted = [
            {"run": run, "weights": weight_rows(labels, self.planes, weights)}
            for run, weights in zip(self.runs, self.weights, strict=True)
        ]
        return plain(
            {
                "as_proposed": self.as_proposed,
                "mounted": mounted,
                "readings": rows(readings),
                "chi_square": self.chi_square,
                "degrees_of_freedom": self.n,
                "error_degrees_of_freedom": self.dof,
                "probability": self.probability,
                "explained": self.explained,
                "verdict": self.verdict,
                "further_weights": None
                if self.change is None
                else weight_rows(labels, self.planes, self.change),
                "rms_before": rms(sizes["before"]),
                "rms_predicted": rms(sizes["predicted"]),
                "rms_achieved": rms(sizes["achieved"]),
                "improvement_predicted": self.improvement_predicted,
                "improvement_achieved": self.improvement_achieved,
                "warnings": self.warnings,
            }
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per run, speed and sensor: before, predicted, achieved, difference, distance."""
        return frame([column for column in self._columns() if column.name != "covariance"])

    @property
    def headline(self) -> str:
        """Whether the rotor does what was predicted, and what is left, in a sentence."""
        scale, unit = self.labels.vibration_scale, self.labels.vibration_in
        before, predicted, achieved = (rms(z) * scale for z in (self.before, self.predicted, self.achieved))
        heads = {True: "As predicted", False: "Not as predicted", None: "Not judged"}
        left = f"rms {three_figures(before)} → {three_figures(achieved)} {unit}".rstrip()
        return f"{heads[self.explained]}: with the weights {left} ({small(predicted, before)} predicted)."

    @property
    def answer(self) -> Answer:
        """Whether the rotor does what was predicted, what is left, and all readings beside the prediction."""
        labels = self.labels
        largest = largest_readings(labels, self.speeds, self.sensors, self.before, self.achieved[-1])
        mounted = "the proposed corrections" if self.as_proposed else "what its weights table says"
        return Answer(
            f"{self.headline} {sentence(self.verdict)}",
            f"Largest in run {self.runs[-1]!r}{largest}",
            self.warnings,
            tables=(f"Check run, mounted: {mounted}.\n{self._readings_text()}",),
            more="the check run",
        )

    def _columns(self) -> tuple[Column, ...]:
        """One row per run, speed and sensor."""
        R, S, C = self.achieved.shape
        labels = self.labels
        before = np.broadcast_to(self.before, (R, S, C))
        rounding = ROUNDING * float(np.abs(self.before).max()) * labels.vibration_scale
        blocks: Sequence[Any] | FloatArray = [None] * (R * S * C)
        if self.covariance is not None:
            blocks = labels.vibration_covariance(self.covariance).reshape(-1, 2, 2)
        return (
            Column("run", np.repeat(self.runs, S * C)),
            *(
                replace(column, values=list(column.values) * R)
                for column in reading_columns(labels, self.speeds, self.sensors)
            ),
            *vector_columns(labels, "before", before, rounding),
            *vector_columns(labels, "predicted", self.predicted, rounding),
            *vector_columns(labels, "achieved", self.achieved, rounding),
            *vector_columns(labels, "difference", self.difference, rounding),
            Column("covariance", blocks),
            Column(
                "distance",
                known(self.distance, (R, S, C)).ravel(),
                lambda distance: figures(distance, 2),
                "std",
            ),
        )

    def _readings_text(self) -> str:
        shown = {column.name: column for column in self._columns()}
        if len(self.runs) > 1:
            named = zip(shown["sensor"].values, shown["run"].values, strict=True)
            shown["sensor"] = Column("sensor", [f"{sensor} ({run})" for sensor, run in named], str)
        for name in ("before", "before_phase_deg", "difference_phase_deg"):
            del shown[name]
        foot = ""
        if self.distance is None:
            del shown["distance"]
        else:
            foot = "\nstd: the difference in its standard deviations"
            foot += " (95 % of all below 2.4)" if self.dof is None else ""
        unit = f" in {self.labels.vibration_in}" if self.labels.vibration_in else ""
        return f"Vibration{unit}, predicted and achieved\n{text(list(shown.values()), left=2)}{foot}"


def _verdict_words(c: CheckComparison) -> str:
    """`CheckComparison.verdict`."""
    r, s, k = c.worst
    where = f"sensor {c.sensors[k]!r} at {c.labels.speed_words(c.speeds[s])}"
    if len(c.runs) > 1:
        where += f" in run {c.runs[r]!r}"
    if c.explained is None or c.distance is None:
        size = c.labels.vibration(c.difference)[0][r, s, k]
        return (
            "no verdict: the errors of the readings are not known (state them, or repeat readings); "
            f"{where} differs most, by {figures(size, 3)} {c.labels.vibration_in}".rstrip()
        )
    errors = "stated" if c.dof is None else "estimated"
    chance = "" if c.probability is None else f" (probability {_percent(c.probability)})"
    if c.explained:
        return f"the differences are explained by the {errors} errors{chance}"
    if c.change is not None:
        mass, angle = c.labels.weight(c.change)
        largest = mass.max()
        parts = [
            f"{figures(mass[p], 3)} {c.labels.weight_in} at {angle[p]:.0f}° in plane {plane!r}"
            for p, plane in enumerate(c.planes)
            if mass[p] > 0.1 * largest
        ]
        likely = (
            f"a further weight of {' and '.join(parts)} would cause them: check what was mounted, and where; "
            "an unbalance outside the planes or a nonlinearity is less likely"
        )
    else:
        likely = (
            "a change of unbalance outside the planes, or a nonlinearity (bearing, looseness), or changed "
            "conditions is likely"
        )
    return (
        f"the differences are not explained by the {errors} errors{chance}: {likely}; {where} differs most, "
        f"by {figures(c.distance[r, s, k], 2)} standard deviations"
    )


def _percent(probability: float) -> str:
    return "below 0.01 %" if probability < 1e-4 else f"{100 * probability:.3g} %"


def _factor(before: ComplexArray, after: ComplexArray) -> float | None:
    """Ratio of root mean squares; None where nothing but rounding is left."""
    old, new = rms(before), rms(after)
    return None if new <= 1e-12 * old else old / new
