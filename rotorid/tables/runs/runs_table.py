"""Runs tables: what the sensors read, one row per run × speed × sensor (and repeat)."""

from __future__ import annotations

import re
from collections import defaultdict
from dataclasses import replace

import numpy as np

from balancing import Trials
from rotorid.base.arrays import FloatArray
from rotorid.base.complex_numbers import turned
from rotorid.tables.reader import units
from rotorid.tables.reader.columns import Column, Source, Table, make_table
from rotorid.tables.reader.problems import Problems
from rotorid.tables.reader.units import one_of
from rotorid.tables.runs.instrument_export import read_runs_grid
from rotorid.tables.runs.speed_merging import merge_speeds, same_speed, show_speed
from rotorid.tables.runs.stated_conventions import FULL_TURN, Conventions

SPEED = Column("speed", one_of(units.SPEED), ("speed_rpm", "speed_rad_s", "speed_Hz"))
PHASE = Column("phase", one_of(units.ANGLE), ("phase_deg",))
COLUMNS = (
    Column("run"),
    SPEED,
    Column("sensor"),
    Column("amplitude", units.vibration, ("amplitude_um_pp", "amplitude_mm_s_rms", "amplitude")),
    PHASE,
    Column("repeat", required=False),
    Column("amplitude_std", units.vibration, ("amplitude_std_um_pp",), required=False),
    Column("phase_std", one_of(units.ANGLE), ("phase_std_deg",), required=False),
)
UNUSED = re.compile(r"time_s|turns|(overall|gap)(_.+)?|order(?!1_)\d+(\.\d+)?_(amplitude|phase)(_.+)?")
"""What `rotorid vectors` writes beside them."""


_RUNS_NAMED, _SPEEDS_NAMED = 20, 10
"""Of runs with gaps, and of speeds that one run lacks, so many are named."""


def read_runs(
    source: Source, conventions: Conventions, problems: Problems
) -> tuple[tuple[str, ...] | None, Trials | None]:
    """Read a runs table: names of its runs, and its readings without weights; None and problems.

    Parameters
    ----------
    source
        A file, or the cells of a sheet.
    conventions
        What phases mean, and which speeds count as one.
    problems
        Collects the complaints.
    """
    grid = read_runs_grid(source, conventions, problems)
    if grid is None:
        return None, None
    grid = replace(grid, header=tuple("" if UNUSED.fullmatch(name) else name for name in grid.header))
    table = make_table(grid, COLUMNS, problems)
    if table is None:
        return None, None
    speed, amplitude, phase = (table.numbers(stem) for stem in ("speed", "amplitude", "phase"))
    table.must_be("speed", speed > 0, "a speed above 0")
    table.must_be("amplitude", amplitude >= 0, "an amplitude of 0 or more")
    table.must_be("phase", np.abs(phase) <= FULL_TURN, "a phase from -360 to 360 degrees")
    _complain_about_deviations(table)
    run, sensor = table.texts("run"), table.texts("sensor")
    usable = [i for i in range(len(table)) if run[i] and sensor[i] and speed[i] > 0]
    start = len(problems)
    speeds, index, merged = merge_speeds(table, usable, conventions.speed_tolerance_percent, problems)
    runs = tuple(dict.fromkeys(name for name in run if name))
    sensors = tuple(dict.fromkeys(name for name in sensor if name))
    run_at = {name: r for r, name in enumerate(runs)}
    sensor_at = {name: c for c, name in enumerate(sensors)}
    cells: dict[tuple[int, int, int], list[int]] = defaultdict(list)
    for i in usable:
        cells[run_at[run[i]], index[i], sensor_at[sensor[i]]].append(i)
    if len(problems) == start:  # with unclear speeds all the rest would be noise
        _complain_about_repeats(table, list(cells.values()), problems)
    if table.complete and len(usable) == len(table) and len(problems) == start:
        _complain_about_gaps(table, runs, speeds, sensors, set(cells), conventions, problems)
    if len(problems):  # nobody will look at the readings, and with gaps they may be immensely many
        return runs, None
    values = conventions.labels.vibration_from(amplitude, phase)
    order = _repeat_order(table)
    most = max((len(rows) for rows in cells.values()), default=1)
    written = np.array([table.steps("amplitude"), table.steps("phase")])
    readings = np.full((most, len(runs), len(speeds), len(sensors)), complex(np.nan, np.nan))
    steps = np.full((2, *readings.shape), np.nan)
    rows = [row for own in cells.values() for row in sorted(own, key=lambda i: order[i])]
    at = np.array([(k, *place) for place, own in cells.items() for k in range(len(own))], dtype=int).T
    readings[*at] = values[rows]
    steps[:, *at] = written[:, rows]
    labels = replace(
        conventions.labels,
        vibration_unit=table.unit("amplitude").name,
        vibration_scale=table.unit("amplitude").scale,
        weight_unit="g",
        weight_scale=1e3,
        speed_unit=table.unit("speed").name,
    )
    nothing = np.zeros((len(runs), 0), dtype=complex)
    trials = Trials(runs, speeds, sensors, (), readings, nothing, labels=labels, warnings=merged, steps=steps)
    if "phase_std" not in table:
        return runs, trials
    along = table.numbers("amplitude_std")
    across = np.where(amplitude > 0, amplitude * table.numbers("phase_std"), along)
    covariance = np.full((2, 2, *readings.shape), np.nan)
    covariance[:, :, *at] = np.moveaxis(turned(values, along**2, across**2), 0, -1)[..., rows]
    return runs, replace(trials, covariance=covariance)


def _complain_about_deviations(table: Table) -> None:
    """Standard deviations go together, and none is 0."""
    stems = [stem for stem in ("amplitude_std", "phase_std") if stem in table]
    if len(stems) == 1:
        expected = "amplitude_std_… and phase_std_deg together: one alone does not tell how a reading errs"
        table.in_header(table.fields[stems[0]].name, expected)
        return
    for stem in stems:
        allowed = table.numbers(stem) > 0
        table.must_be(stem, allowed, "a standard deviation above 0: nothing is measured exactly")
    if stems and (unit := table.unit("amplitude")).kind != table.unit("amplitude_std").kind:
        expected = f"a unit that converts to that of the amplitude, {unit.name or 'none'}"
        table.in_header(table.fields["amplitude_std"].name, expected)


def _repeat_order(table: Table) -> list[int]:
    if "repeat" not in table:
        return list(range(len(table)))
    labels = {label: k for k, label in enumerate(dict.fromkeys(table.texts("repeat")))}
    return [labels[label] for label in table.texts("repeat")]


def _complain_about_repeats(table: Table, cells: list[list[int]], problems: Problems) -> None:
    """Two readings of one run, speed and sensor must say that they are repeats."""
    for rows in cells:
        if len(rows) < 2:
            continue
        if "repeat" not in table:
            for row in rows[1:]:
                expected = (
                    f"one reading per run, speed and sensor (row {table.rows[rows[0]]} has the same); "
                    "repeated readings need a column repeat"
                )
                table.complain(row, "sensor", expected)
            continue
        first: dict[str, int] = {}
        for row in rows:
            label = table.texts("repeat")[row]
            if label and first.setdefault(label, row) != row:
                same = table.rows[first[label]]
                table.complain(row, "repeat", f"another repeat than in row {same}, the same reading")


def _complain_about_gaps(
    table: Table,
    runs: tuple[str, ...],
    speeds: FloatArray,
    sensors: tuple[str, ...],
    present: set[tuple[int, int, int]],
    conventions: Conventions,
    problems: Problems,
) -> None:
    """Every run needs every sensor at every speed: influence coefficients compare runs."""
    if len(present) == len(runs) * len(speeds) * len(sensors):
        return
    unit = table.unit("speed")
    read: list[dict[int, set[int]]] = [defaultdict(set) for _ in runs]
    for r, s, c in present:
        read[r][s].add(c)
    anywhere = {(s, c) for _, s, c in present}
    wanting = [r for r in range(len(runs)) if sum(map(len, read[r].values())) < len(speeds) * len(sensors)]
    for r in wanting[:_RUNS_NAMED]:
        run, at = runs[r], sorted(read[r])
        if len(speeds) - len(at) > _SPEEDS_NAMED:
            expected = f"readings of run {run!r} at all {len(speeds)} speeds of the runs; it has {len(at)}"
            table.as_whole(table.fields["speed"].name, expected)
            continue
        for s, speed in enumerate(speeds):
            shown = show_speed(speed, unit)
            if s not in read[r]:
                near = min(at, key=lambda k: abs(speeds[k] - speed))
                hint = f"; its nearest speed is {show_speed(speeds[near], unit)}"
                if same_speed(speed, speeds[near], 10.0):
                    hint += f", speeds count as one within {conventions.speed_tolerance_percent:g} %"
                expected = f"readings of run {run!r} at {shown}, as other runs have{hint}"
                table.as_whole(table.fields["speed"].name, expected)
                continue
            for c, sensor in enumerate(sensors):
                if c not in read[r][s]:
                    expected = f"a reading of sensor {sensor!r} in run {run!r} at {shown}, as other runs have"
                    if (s, c) not in anywhere:
                        expected = (
                            f"a reading of sensor {sensor!r} in run {run!r} at {shown}: every run needs "
                            "every sensor at every speed"
                        )
                    table.as_whole("sensor", expected)
    if len(wanting) > _RUNS_NAMED:
        expected = f"as many readings of {len(wanting) - _RUNS_NAMED} further runs"
        table.as_whole(None, expected)
