"""Pieces in holes as people read them: text, and JSON types, in the job's units and conventions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.correction.correction_text import small
from rotorid.base.json import finite
from rotorid.base.text import figures, table, wrap
from rotorid.base.units import rpm

if TYPE_CHECKING:
    from balancing.mounting.holes import Holes, Mounting
    from balancing.mounting.mounted import Mounted


def mounted_dict(m: Mounted) -> dict[str, Any]:
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


def summary(m: Mounted) -> str:
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
