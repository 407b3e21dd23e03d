"""Separation margin of critical speeds from the operating range (API 684)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from rotorid.base.answer import Answer, Answered
from rotorid.base.rpm import RPM, rpm_text
from rotorid.base.tables import Column, Table
from rotorid.base.text import listing, table


@dataclass(frozen=True)
class Separation(Answered):
    """Critical speeds beside the operating range, and why more may lie in it.

    Attributes
    ----------
    speeds
        Critical speeds, rad/s.
    operating
        Lowest and highest operating speed, rad/s.
    doubt
        Why more may lie in the range; else empty.
    """

    speeds: Iterable[float]
    operating: tuple[float, float]
    doubt: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Which speeds lie in the range, and how far off the others are, in percent of its nearest end."""
        low, high = self.operating
        rows = []
        for speed in self.speeds:
            below = 100 * (low - speed) / low if low > 0 else 0.0
            margin = 100 * (speed - high) / high if speed > high else max(0.0, below)
            rows.append({"speed_rad_s": speed, "inside": low <= speed <= high, "separation_percent": margin})
        return {"range_rad_s": [low, high], "critical_speeds": rows}

    def tables(self) -> tuple[Table, ...]:
        """How far each is from the range, the nearest first; none without any."""
        rows = list(enumerate(self.to_dict()["critical_speeds"]))
        rows.sort(key=lambda row: float(row[1]["separation_percent"]))
        if not rows:
            return ()
        columns = (
            Column("rpm", [row["speed_rad_s"] * RPM for _, row in rows], "{:.2f}".format),
            Column("away, %", [row["separation_percent"] for _, row in rows], "{:.1f}".format),
            Column("", ["INSIDE" if row["inside"] else "outside" for _, row in rows]),
        )
        return (Table("how far each is from the operating range", columns),)

    def sentence(self) -> str:
        """Whether one lies in the range, and which is nearest."""
        return self.answer.judgement

    @property
    def answer(self) -> Answer:
        """For an engineer."""
        low, high = self.operating
        within = f"the operating range {low * RPM:.6g} to {rpm_text(high)}"
        rows = sorted(self.to_dict()["critical_speeds"], key=lambda row: float(row["separation_percent"]))
        away = [[rpm_text(row["speed_rad_s"]), f"{row['separation_percent']:.1f} % away"] for row in rows]
        more = "how far each is from the operating range"
        inside = [rpm_text(row["speed_rad_s"]) for row in rows if row["inside"]]
        if inside:
            return Answer(f"INSIDE {within}: {listing(inside, 'and')}.")
        if self.doubt:
            said = f"NOT KNOWN whether a critical speed lies in {within}: {self.doubt}."
            return Answer(said, tables=(table(away),) if away else (), more=more)
        if not rows:
            return Answer(f"No critical speed was found beside {within}.")
        near = f"{rpm_text(rows[0]['speed_rad_s'])}, is {rows[0]['separation_percent']:.1f} % away"
        return Answer(f"None lies in {within}; the nearest, {near}.", tables=(table(away),), more=more)


def unsearched(first: float, last: float, operating: tuple[float, float] | None) -> str:
    """What keeps one from saying that nothing is in an operating range: speeds that were not searched.

    Parameters
    ----------
    first, last
        Between which speeds was searched, rad/s.
    operating
        Operating range, rad/s; None: there is none.

    Returns
    -------
    A clause; empty where all of the range was searched.
    """
    if operating is None or (first <= operating[0] * (1 + 1e-6) and operating[1] <= last * (1 + 1e-6)):
        return ""
    return f"only speeds from {first * RPM:.6g} to {rpm_text(last)} were searched"
