"""Pieces in holes: result, text, and JSON types in the job's units and conventions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.correction.correction_result import Correction, small
from balancing.mounting.discrete import Discrete
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.json import finite
from rotorid.base.text import figures, table, wrap
from rotorid.base.units import rpm

if TYPE_CHECKING:
    import pandas as pd

    from balancing.mounting.holes import Holes, Mounting

AGAINST = 3.0
"""Pieces that weigh more than this times what they make are said to act against each other."""


@dataclass(frozen=True, eq=False)
class Mounted:
    """Pieces in holes that leave the least vibration.

    Attributes
    ----------
    correction
        The continuous one, in the same planes.
    holes
        Of each plane; None: any weight at any angle.
    found
        Pieces of each plane, and how near the optimum they are known to be.
    after
        Predicted vibration with them, (S, C).
    after_covariance
        Of a reading in a check run around it, (S, C, 2, 2); None where errors are unknown.
    on_top_of
        Run whose weights stay mounted; None: everything is removed before.
    """

    correction: Correction
    holes: tuple[Holes | None, ...]
    found: Discrete
    after: ComplexArray
    after_covariance: FloatArray | None
    on_top_of: str | None = None

    @property
    def warnings(self) -> tuple[str, ...]:
        """Planes in which pieces act mostly against each other, for a gain that may be nothing."""
        labels, said = self.correction.labels, []
        for plane, chosen in zip(self.correction.planes, self.found.mountings, strict=True):
            if chosen is None:
                continue
            total, made = float(chosen.amounts.sum()), abs(chosen.vector)
            if total > AGAINST * made:
                shown = [labels.weight(value)[0] for value in (total + 0j, made + 0j)]
                said.append(
                    f"plane {plane}: pieces of {float(shown[0]):.4g} {labels.weight_unit} together make "
                    f"{float(shown[1]):.4g} {labels.weight_unit}, they act against each other: state a "
                    "stock, or fewer pieces per hole, if fewer would do"
                )
        return tuple(said)

    @property
    def weights(self) -> ComplexArray:
        """What the pieces of each plane add up to, (P,)."""
        return self.found.weights

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's units and conventions."""
        return _mounted_dict(self)

    def to_frame(self) -> pd.DataFrame:
        """One row per hole that gets something: plane, action, hole, angle_deg, mass, unit, pieces."""
        import pandas as pd

        columns = ["plane", "action", "hole", "angle_deg", "mass", "unit", "pieces"]
        return pd.DataFrame(self.to_dict()["holes"], columns=columns)

    def summary(self) -> str:
        """Text: hole by hole, what is left of the vibration, and how sure the optimum is."""
        return _text(self)


def _mounted_dict(m: Mounted) -> dict[str, Any]:
    """`Mounted.to_dict`."""
    c, labels = m.correction, m.correction.labels
    size, angle = labels.weight(m.weights)
    after, phase = labels.vibration(m.after)
    covariance = None if m.after_covariance is None else labels.vibration_covariance(m.after_covariance)
    return {
        "planes": [
            {
                "plane": plane,
                "mass": float(size[p]),
                "unit": labels.weight_unit,
                "angle_deg": float(angle[p]),
                "action": "remove" if plane in c.remove else "add",
            }
            for p, plane in enumerate(c.planes)
        ],
        "on_top_of": m.on_top_of,
        "warnings": list(m.warnings),
        "holes": [row for p in range(len(c.planes)) for row in _holes(m, p)],
        "residuals": [
            {
                "speed_rpm": rpm(speed),
                "sensor": sensor,
                "after": float(after[s, k]),
                "after_phase_deg": float(phase[s, k]),
                "after_covariance": None if covariance is None else covariance[s, k].tolist(),
            }
            for s, speed in enumerate(c.speeds)
            for k, sensor in enumerate(c.sensors)
        ],
        "rms_after": float(np.sqrt(np.mean(after**2))),
        "max_after": float(after.max()),
        "proven": m.found.proven,
        "gap": float(m.found.gap),
        "plane_by_plane": finite(m.found.rounded_objective / m.found.objective)
        if m.found.objective > 0 and all(h is not None for h in m.holes)
        else None,
    }


def _text(m: Mounted) -> str:
    """`Mounted.summary`."""
    c, labels = m.correction, m.correction.labels
    unit = labels.weight_unit
    rows = [["plane", "hole", "angle", unit, "pieces"]]
    rows += [
        [_where(r), r["hole"], f"{r['angle_deg']:.1f}°", figures(r["mass"]), r["pieces"]]
        for p in range(len(c.planes))
        for r in _holes(m, p)
    ]
    head = "What to mount, all planes together" if not c.remove else "What to mount or to remove"
    stays = "" if m.on_top_of is None else f", in addition to what is mounted in run {m.on_top_of!r}"
    lines = [*(f"Warning: {words}" for words in m.warnings), head + stays]
    if c.labels.assumed:
        said = " and ".join(c.labels.assumed)
        lines.append(
            wrap(f"For {said} as assumed: if that is otherwise, state it and choose the pieces anew.")
        )
    lines.append(table(rows, left=2) if len(rows) > 1 else "  nothing: every piece would make it worse")
    after = labels.vibration(m.after)[0]
    free = labels.vibration(c.after)[0]
    scale = float(labels.vibration(c.before)[0].max())
    shown = [
        f"rms {small(float(np.sqrt(np.mean(size**2))), scale)}, largest {small(float(size.max()), scale)}"
        for size in (after, free)
    ]
    lines.append(f"{labels.vibration_unit} left: {shown[0]}; with any weights {shown[1]}".strip())
    for p, plane in enumerate(c.planes):
        if not _holes(m, p):
            lines.append(f"Plane {plane}: nothing; no pieces that it can take make it better.")
    found = m.found
    if all(h is not None for h in m.holes) and np.isfinite(found.rounded_objective) and found.objective > 0:
        lines.append(
            f"Plane by plane the nearest pieces would leave {found.rounded_objective / found.objective:.3g} "
            "times as much."
        )
    lines.append(
        "No other choice of pieces is better (proven)."
        if found.proven
        else f"A better choice, if there is one, is better by at most {100 * found.gap:.2g} %."
    )
    return "\n".join(lines)


def _where(row: dict[str, Any]) -> str:
    return f"{row['plane']} (remove)" if row["action"] == "remove" else str(row["plane"])


def _holes(m: Mounted, p: int) -> list[dict[str, Any]]:
    """A row for each hole of a plane that gets something; one without hole where any angle is possible."""
    labels, plane = m.correction.labels, m.correction.planes[p]
    action = "remove" if plane in m.correction.remove else "add"
    gone = 180.0 if action == "remove" else 0.0
    holes = m.holes[p]
    if holes is None:
        size, angle = labels.weight(m.weights[p])
        return [_row(plane, action, "any", float(angle + gone) % 360, float(size), labels.weight_unit, "")]
    mounting = m.found.mountings[p]
    assert mounting is not None
    out = []
    for h in np.flatnonzero(mounting.amounts > 0):
        vector = mounting.amounts[h] * np.exp(1j * holes.angles[h])
        size, angle = labels.weight(vector)
        words = _pieces(holes, mounting, int(h), labels.weight_scale)
        at = float(angle + gone) % 360
        out.append(_row(plane, action, holes.names[h], at, float(size), labels.weight_unit, words))
    return out


def _row(
    plane: str, action: str, hole: str, angle: float, mass: float, unit: str, pieces: str
) -> dict[str, Any]:
    return {
        "plane": plane,
        "action": action,
        "hole": hole,
        "angle_deg": angle,
        "mass": mass,
        "unit": unit,
        "pieces": pieces,
    }


def _pieces(holes: Holes, mounting: Mounting, h: int, scale: float) -> str:
    return " + ".join(
        f"{int(count)} × {figures(float(piece) * scale)}" if count > 1 else figures(float(piece) * scale)
        for piece, count in zip(holes.pieces, mounting.counts[h], strict=True)
        if count
    )
