"""Speeds of a runs table: which of them count as one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.text import listing
from rotorid.files.columns import Table
from rotorid.files.units import Unit

ROUNDING = 1e-12
UNSAID = 0.1
"""Per cent within which no machine keeps its speed from run to run, so that nothing need be said."""


def same_speed(a: float, b: float, tolerance_percent: float) -> bool:
    """Whether two speeds count as one."""
    return abs(a - b) <= (tolerance_percent / 100.0 + ROUNDING) * max(a, b)


def nearest_speed(speeds: FloatArray, speed: float, tolerance_percent: float) -> int | None:
    """Which of some speeds counts as one with this one; None: none of them does."""
    near = int(np.argmin(np.abs(speeds - speed)))
    return near if same_speed(float(speeds[near]), speed, tolerance_percent) else None


def show_speed(speed: float, unit: Unit) -> str:
    """A speed in the unit of the table, for messages."""
    return f"{speed * unit.scale:.6g} {unit.name.replace('rad_s', 'rad/s')}"


def show_speeds(speeds: FloatArray, unit: Unit) -> str:
    """All of some speeds in the unit of a table, for messages."""
    return listing((show_speed(float(speed), unit) for speed in speeds), "and")


def merge_speeds(
    table: Table, usable: Sequence[int], tolerance_percent: float
) -> tuple[FloatArray, dict[int, int], tuple[str, ...]]:
    """Merge the speeds that lie within the tolerance; a merged speed is their mean.

    They are those of different runs, or of the sensors of one steady run. Two such speeds of one sensor of
    one run, and a chain of speeds whose ends are not within the tolerance, are noted as problems.

    Parameters
    ----------
    table
        The runs table.
    usable
        Indices of its rows whose run and speed can be read.
    tolerance_percent
        Largest difference.

    Returns
    -------
    speeds, index, words
        rad/s, ascending; for each usable row, which of them it has; and which different speeds became one.
    """
    values, unit, tolerance = table.numbers("speed"), table.unit("speed"), tolerance_percent
    groups: list[list[float]] = []
    for speed in np.unique(values[list(usable)]).tolist():
        if not groups or not same_speed(speed, groups[-1][-1], tolerance):
            groups.append([])
        groups[-1].append(speed)
    place = {speed: g for g, group in enumerate(groups) for speed in group}
    index = {row: place[float(values[row])] for row in usable}
    remedy = f"within the tolerance of {tolerance:g} %; write the nominal speed, or set "
    remedy += "speed_tolerance_percent smaller"
    names = [table.texts(stem) for stem in ("run", "sensor", "repeat") if stem in table]
    first: dict[tuple[object, ...], int] = {}
    of_group: list[dict[str, dict[float, None]]] = [{} for _ in groups]
    unclear = set[tuple[int, str]]()
    for row in usable:
        g, one = index[row], first.setdefault((index[row], *(each[row] for each in names)), row)
        of_group[g].setdefault(names[0][row], {})[float(values[row])] = None
        if values[one] != values[row] and (g, names[0][row]) not in unclear:
            other = table.shown("speed", one)
            table.complain(row, "speed", f"one speed: run {names[0][row]!r} has {other} as well, {remedy}")
            unclear.add((g, names[0][row]))
    alike, merged = [], []
    for g, group in enumerate(groups):
        speeds = [speed for own in of_group[g].values() for speed in own]
        merged.append(group[0] if len(group) == 1 else float(np.mean(speeds)))
        if g not in {k for k, _ in unclear} and not same_speed(group[0], group[-1], tolerance):
            shown = [show_speed(speed, unit) for speed in group]
            chain = ", ".join(shown if len(shown) < 8 else [*shown[:3], "…", *shown[-3:]])
            expected = f"speeds that are clearly the same or not: {chain} form a chain, neighbours {remedy}"
            table.as_whole(table.fields["speed"].name, expected)
        if not same_speed(group[0], group[-1], UNSAID):
            numbers = ", ".join(f"{speed * unit.scale:.6g}" for speed in group)
            alike.append(f"{numbers} as {show_speed(merged[g], unit)}")
    steady = any(len(own) > 1 for runs in of_group for own in runs.values())
    more = f" and {len(alike) - 3} more" if len(alike) > 3 else ""
    of = "of one run, or of different ones," if steady else "of different runs"
    words = f"speeds {of} within {tolerance:g} % count as one: {'; '.join(alike[:3])}{more}"
    return np.array(merged), index, (words,) if alike else ()
