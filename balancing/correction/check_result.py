"""Readings of check runs beside their prediction: result, words, and JSON types in the job's own units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.correction.correction_result import DUST
from balancing.data.conventions import Labels
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.text import figures, sentence, table, wrap
from rotorid.base.units import rpm

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class CheckComparison:
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
        return _check_dict(self)

    def to_frame(self) -> pd.DataFrame:
        """One row per run, speed and sensor: before, predicted, achieved, difference, distance."""
        import pandas as pd

        frame = pd.DataFrame(self.to_dict()["readings"]).drop(columns="covariance")
        return frame.astype({"distance": float})

    def summary(self) -> str:
        """Text of 80 columns: warnings, verdict, readings beside the prediction, improvement."""
        return _text(self)


def _verdict_words(c: CheckComparison) -> str:
    """`CheckComparison.verdict`."""
    r, s, k = c.worst
    where = f"sensor {c.sensors[k]!r} at {rpm(c.speeds[s]):.6g} rpm"
    if len(c.runs) > 1:
        where += f" in run {c.runs[r]!r}"
    if c.explained is None or c.distance is None:
        size = c.labels.vibration(c.difference)[0][r, s, k]
        return (
            "no verdict: the errors of the readings are not known (state them, or repeat readings); "
            f"{where} differs most, by {figures(size, 3)} {c.labels.vibration_unit}".rstrip()
        )
    errors = "stated" if c.dof is None else "estimated"
    chance = "" if c.probability is None else f" (probability {_percent(c.probability)})"
    if c.explained:
        return f"the differences are explained by the {errors} errors{chance}"
    if c.change is not None:
        mass, angle = c.labels.weight(c.change)
        largest = mass.max()
        parts = [
            f"{figures(mass[p], 3)} {c.labels.weight_unit} at {angle[p]:.0f}° in plane {plane!r}"
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


def _check_dict(c: CheckComparison) -> dict[str, Any]:
    """`CheckComparison.to_dict`."""
    old, old_phase = c.labels.vibration(c.before)
    planned, planned_phase = c.labels.vibration(c.predicted)
    read, read_phase = c.labels.vibration(c.achieved)
    change, change_phase = c.labels.vibration(c.difference)
    dust = DUST * old.max()
    planned = np.where(planned > dust, planned, 0.0)
    covariance = None if c.covariance is None else c.labels.vibration_covariance(c.covariance)
    return {
        "as_proposed": c.as_proposed,
        "mounted": [{"run": run, "weights": _weights(c, c.weights[r])} for r, run in enumerate(c.runs)],
        "readings": [
            {
                "run": run,
                "speed_rpm": rpm(speed),
                "sensor": sensor,
                "before": float(old[s, k]),
                "before_phase_deg": _phase(old[s, k], old_phase[s, k], dust),
                "predicted": float(planned[r, s, k]),
                "predicted_phase_deg": _phase(planned[r, s, k], planned_phase[r, s, k], dust),
                "achieved": float(read[r, s, k]),
                "achieved_phase_deg": _phase(read[r, s, k], read_phase[r, s, k], dust),
                "difference": float(change[r, s, k]),
                "difference_phase_deg": _phase(change[r, s, k], change_phase[r, s, k], dust),
                "covariance": None if covariance is None else covariance[r, s, k].tolist(),
                "distance": None if c.distance is None else float(c.distance[r, s, k]),
            }
            for r, run in enumerate(c.runs)
            for s, speed in enumerate(c.speeds)
            for k, sensor in enumerate(c.sensors)
        ],
        "chi_square": c.chi_square,
        "degrees_of_freedom": c.n,
        "error_degrees_of_freedom": c.dof,
        "probability": c.probability,
        "explained": c.explained,
        "verdict": c.verdict,
        "further_weights": None if c.change is None else _weights(c, c.change),
        "rms_before": _rms(old),
        "rms_predicted": _rms(planned),
        "rms_achieved": _rms(read),
        "improvement_predicted": c.improvement_predicted,
        "improvement_achieved": c.improvement_achieved,
        "warnings": list(c.warnings),
    }


def _text(c: CheckComparison) -> str:
    """`CheckComparison.summary`."""
    mounted = "the proposed corrections" if c.as_proposed else "what the weights table of the check says"
    blocks = [
        *(wrap(f"Warning: {w}", "  ") for w in c.warnings),
        wrap(f"Check run, mounted: {mounted}.", ""),
        _readings(c),
        wrap(sentence(c.verdict)),
        wrap(
            f"Vibration (rms) before by after: predicted {_times(c.improvement_predicted)}, "
            f"achieved {_times(c.improvement_achieved)}.",
            "",
        ),
    ]
    return "\n\n".join(blocks)


def _readings(c: CheckComparison) -> str:
    old = c.labels.vibration(c.before)[0]
    planned, planned_phase = c.labels.vibration(c.predicted)
    read, read_phase = c.labels.vibration(c.achieved)
    change = c.labels.vibration(c.difference)[0]
    several = len(c.runs) > 1
    rows = [["rpm", "sensor", "predicted", "phase", "achieved", "phase", "difference"]]
    if c.distance is not None:
        rows[0].append("std")
    for r, run in enumerate(c.runs):
        for s, speed in enumerate(c.speeds):
            for k, sensor in enumerate(c.sensors):
                none = planned[r, s, k] <= DUST * old.max()
                row = [
                    f"{rpm(speed):.6g}",
                    f"{sensor} ({run})" if several else sensor,
                    "0" if none else figures(planned[r, s, k], 3),
                    "" if none else f"{planned_phase[r, s, k]:.0f}°",
                    figures(read[r, s, k], 3),
                    f"{read_phase[r, s, k]:.0f}°",
                    figures(change[r, s, k], 3),
                ]
                if c.distance is not None:
                    row.append(figures(c.distance[r, s, k], 2))
                rows.append(row)
    unit = f" in {c.labels.vibration_unit}" if c.labels.vibration_unit else ""
    foot = "" if c.distance is None else "\nstd: the difference in its standard deviations"
    if c.distance is not None and c.dof is None:
        foot += " (95 % of all below 2.4)"
    return f"Vibration{unit}, predicted and achieved\n{table(rows, left=2)}{foot}"


def _weights(c: CheckComparison, weights: ComplexArray) -> list[dict[str, Any]]:
    mass, angle = c.labels.weight(weights)
    return [
        {"plane": p, "mass": float(mass[i]), "unit": c.labels.weight_unit, "angle_deg": float(angle[i])}
        for i, p in enumerate(c.planes)
    ]


def _phase(size: float, phase: float, dust: float) -> float | None:
    # the direction of rounding means nothing
    return float(phase) if size > dust else None


def _times(factor: float | None) -> str:
    return "nothing left" if factor is None else f"{figures(factor, 3)} times"


def _percent(probability: float) -> str:
    return "below 0.01 %" if probability < 1e-4 else f"{100 * probability:.3g} %"


def _rms(amplitudes: FloatArray) -> float:
    return float(np.sqrt(np.mean(amplitudes**2)))


def _factor(before: ComplexArray, after: ComplexArray) -> float | None:
    """Ratio of root mean squares; None where nothing but rounding is left."""
    old, new = (float(np.sqrt(np.mean(np.abs(z) ** 2))) for z in (before, after))
    return None if new <= 1e-12 * old else old / new
