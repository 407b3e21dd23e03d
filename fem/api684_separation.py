"""Separation of critical speeds from the operating range (API 684)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from rotorid.base.rpm import RPM, rpm_text


def separation(criticals: Iterable[float], operating: tuple[float, float]) -> dict[str, Any]:
    """Which critical speeds, rad/s, lie in the operating range, and how far off the others are.

    The distance is in percent of the nearest end of the range (API 684).
    """
    low, high = operating
    rows = []
    for speed in criticals:
        below = 100 * (low - speed) / low if low > 0 else 0.0
        margin = 100 * (speed - high) / high if speed > high else max(0.0, below)
        rows.append(
            {"speed_rad_s": float(speed), "inside": low <= speed <= high, "separation_percent": float(margin)}
        )
    return {"range_rad_s": [low, high], "critical_speeds": rows}


def separation_text(operating: Mapping[str, Any]) -> str:
    """The result of `separation` for an engineer."""
    low, high = operating["range_rad_s"]
    lines = [f"operating range {low:.6g} to {high:.6g} rad/s ({low * RPM:.6g} to {rpm_text(high)})"]
    for row in operating["critical_speeds"]:
        where = "INSIDE" if row["inside"] else f"{row['separation_percent']:.1f} % away"
        lines.append(f"{row['speed_rad_s']:14.4f} rad/s {row['speed_rad_s'] * RPM:14.2f} rpm   {where}")
    if not operating["critical_speeds"]:
        lines.append("no critical speed was found")
    return "\n".join(lines)
