"""Merging of speeds: those of different runs that count as one."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.text import listing
from rotorid.tables.reader.columns import Table
from rotorid.tables.reader.problems import Problems
from rotorid.tables.reader.units import Unit

ROUNDING = 1e-12
UNSAID = 0.1
"""Per cent within which no machine keeps its speed from run to run, so that nothing need be said."""
_NAMED = 3


def same_speed(a: float, b: float, tolerance_percent: float) -> bool:
    """Whether two speeds count as one."""
    return abs(a - b) <= (tolerance_percent / 100.0 + ROUNDING) * max(a, b)


def merge_speeds(
    table: Table, usable: list[int], tolerance_percent: float, problems: Problems
) -> tuple[FloatArray, dict[int, int], tuple[str, ...]]:
    """Merge the speeds of different runs that lie within the tolerance.

    A merged speed is the mean over its runs. Ambiguous cases are problems: two speeds of one run within the
    tolerance of each other, or a chain of speeds whose ends are not.

    Parameters
    ----------
    table
        The runs table.
    usable
        Indices of its rows whose run and speed can be read.
    tolerance_percent
        Largest difference.
    problems
        Collects the complaints.

    Returns
    -------
    speeds, index, words
        rad/s, ascending; for each usable row, which of them it has; and which different speeds became one.
    """
    values = table.numbers("speed")
    runs = table.texts("run")
    distinct = sorted({float(values[row]) for row in usable})
    groups: list[list[float]] = []
    for speed in distinct:
        if groups and same_speed(speed, groups[-1][-1], tolerance_percent):
            groups[-1].append(speed)
        else:
            groups.append([speed])
    of_run: dict[tuple[int, str], dict[float, int]] = defaultdict(dict)
    place = {speed: g for g, group in enumerate(groups) for speed in group}
    for row in usable:
        of_run[place[float(values[row])], runs[row]].setdefault(float(values[row]), row)
    remedy = (
        f"within the tolerance of {tolerance_percent:g} %; write the nominal speed, or set "
        "speed_tolerance_percent smaller"
    )
    name, unit = table.fields["speed"].name, table.unit("speed")
    clear = set(range(len(groups)))
    for (group, run), first in of_run.items():
        if len(first) > 1:
            row = list(first.values())[1]
            other = table.shown("speed", next(iter(first.values())))
            table.complain(row, "speed", f"one speed: run {run!r} has {other} as well, {remedy}")
            clear.discard(group)
    for g, members in enumerate(groups):
        if g in clear and not same_speed(members[0], members[-1], tolerance_percent):
            shown = [show_speed(speed, unit) for speed in members]
            chain = ", ".join(shown if len(shown) < 8 else [*shown[:3], "…", *shown[-3:]])
            expected = f"speeds that are clearly the same or not: {chain} form a chain, neighbours {remedy}"
            table.as_whole(name, expected)
    each: list[list[float]] = [[] for _ in groups]
    for (group, _), first in of_run.items():
        each[group].extend(first)
    merged = [
        members[0] if len(members) == 1 else float(np.mean(of_group))
        for members, of_group in zip(groups, each, strict=True)
    ]
    words = _merged_words(groups, merged, tolerance_percent, unit)
    return np.array(merged), {row: place[float(values[row])] for row in usable}, words


def _merged_words(
    groups: list[list[float]], merged: list[float], tolerance_percent: float, unit: Unit
) -> tuple[str, ...]:
    alike = [
        f"{', '.join(f'{speed * unit.scale:.6g}' for speed in members)} as {show_speed(mean, unit)}"
        for members, mean in zip(groups, merged, strict=True)
        if not same_speed(members[0], members[-1], UNSAID)
    ]
    if not alike:
        return ()
    more = f" and {len(alike) - _NAMED} more" if len(alike) > _NAMED else ""
    return (
        f"speeds of different runs within {tolerance_percent:g} % count as one: "
        f"{'; '.join(alike[:_NAMED])}{more}",
    )


def nearest_speed(speeds: FloatArray, speed: float, tolerance_percent: float) -> int | None:
    """Which of some speeds counts as one with this one; None: none of them does."""
    near = int(np.argmin(np.abs(speeds - speed)))
    return near if same_speed(float(speeds[near]), speed, tolerance_percent) else None


def show_speeds(speeds: FloatArray, unit: Unit) -> str:
    """All of some speeds in the unit of a table, for messages."""
    return listing((show_speed(float(speed), unit) for speed in speeds), "and")


def show_speed(speed: float, unit: Unit) -> str:
    """A speed in the unit of the table, for messages."""
    return f"{speed * unit.scale:.6g} {unit.name.replace('rad_s', 'rad/s')}"
