"""A comparison of check runs as people read it, in the job's own units: words, text, and JSON types."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.correction.correction_text import DUST
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.text import figures, sentence, table, wrap
from rotorid.base.units import rpm

if TYPE_CHECKING:
    from balancing.correction.check import CheckComparison


def verdict(c: CheckComparison) -> str:
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


def check_dict(c: CheckComparison) -> dict[str, Any]:
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


def summary(c: CheckComparison) -> str:
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
