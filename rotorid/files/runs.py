"""Runs tables: what the sensors read, one row per run × speed × sensor (and repeat).

A table in another layout is brought into this form first (`layout`). With the weights tables they make
trials; with times and standard deviations, or without, vectors over speed.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from itertools import groupby, islice
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from balancing import Labels, ReadingErrors, Trials
from rotorid.base.arrays import ComplexArray, FloatArray, turned
from rotorid.base.text import Angles, Phase, listing
from rotorid.files import units
from rotorid.files.cells import Grid
from rotorid.files.columns import Column, Source, Table, make_table, repeated
from rotorid.files.input_problems import MOST_LINES, Problems
from rotorid.files.table_layouts import (
    DEFAULT_TOLERANCE,
    MOUNTED,
    Conventions,
    joined,
    read_runs_grids,
    stated_phase,
    without_phases,
)
from rotorid.files.units import one_of
from rotorid.files.weights import read_weights

if TYPE_CHECKING:
    from rotorid.files.job_keys import Errors
    from rotorid.identify.modes_result import Readings

SPEED = Column("speed", one_of(units.SPEED), ("speed_rpm", "speed_rad_s", "speed_Hz"))
COLUMNS = (
    Column("run"),
    SPEED,
    Column("sensor"),
    Column("amplitude", units.vibration, ("amplitude_um_pp", "amplitude_mm_s_rms", "amplitude")),
    Column("phase", one_of(units.ANGLE), ("phase_deg",)),
    Column("index", one_of(units.ANGLE), ("index_deg",), required=False),
    Column("repeat", required=False),
    Column("time_s", required=False, blank=True),
    Column("amplitude_std", units.vibration, ("amplitude_std_um_pp",), required=False),
    Column("phase_std", one_of(units.ANGLE), ("phase_std_deg",), required=False),
)
AMPLITUDES = tuple(replace(one, required=one.required and one.stem != "phase") for one in COLUMNS)
"""Those of a runs table that may have no phases."""
OVER_SPEED = (
    *(column for column in COLUMNS if column.stem not in ("repeat", "time_s")),
    Column("time", one_of(units.TIME), ("time_s",), required=False),
)
"""Columns of vectors over speed."""
ROUNDING = 1e-12
UNSAID = 0.1
"""Per cent within which no machine keeps its speed from run to run, so that nothing need be said."""


def same_speed(a: float, b: float, tolerance_percent: float) -> bool:
    """Whether two speeds count as one."""
    return abs(a - b) <= (tolerance_percent / 100.0 + ROUNDING) * max(a, b)


def nearest_speed(speeds: FloatArray, speed: float, tolerance_percent: float) -> int | None:
    """Which of some speeds counts as one with this one; None: none of them does."""
    near = int(abs(speeds - speed).argmin())
    return near if same_speed(float(speeds[near]), speed, tolerance_percent) else None


def speed_words(table: Table) -> Callable[[float], str]:
    """What shows a speed in the unit of a table."""
    return Labels(speed_unit=table.unit("speed").name).speed_words


def show_speeds(speeds: FloatArray, labels: Labels) -> str:
    """All of some speeds, for messages."""
    return listing(map(labels.speed_words, speeds), "and")


def read_trials(
    runs: str | Path,
    weights: str | Path | None,
    *,
    phase: Phase | None = None,
    angles: Angles | None = None,
    speed_tolerance_percent: float = DEFAULT_TOLERANCE,
    errors: Errors | ReadingErrors | None = None,
) -> Trials:
    """Read a runs table and a weights table.

    Parameters
    ----------
    runs, weights
        Files (`.csv`, `.xlsx`); `runs` may be a folder with one file a run; weights may be None where
        influence coefficients are known.
    phase
        Whether a positive phase in the runs table leads or lags; None: as its headings say, else lead,
        which the labels call assumed.
    angles
        Whether angles in the weights table count with or against the rotation; None: with, which the labels
        call assumed where an angle other than 0° and 180° is mounted.
    speed_tolerance_percent
        Speeds of different runs that differ by less count as one, their mean.
    errors
        One standard deviation of a reading.

    Returns
    -------
    balancing.Trials
        In SI (readings without a known unit as they are), phase lead, angles with the rotation.

    Raises
    ------
    InputError
        With all problems of both files.
    ValueError
        If an argument is none of the allowed values.
    """
    problems = Problems()
    phase = phase or stated_phase(runs)
    conventions = Conventions(
        Labels(phase=phase or "lead", angles=angles or "with rotation"), speed_tolerance_percent
    )
    trials = problems.need(make_trials(runs, weights, conventions, errors, problems))
    assumed: tuple[str, ...] = ("phase",) if phase is None else ()
    if angles is None and trials.weights.imag.any():
        assumed += ("angles",)
    if trials.amplitudes_only:  # they tell no direction of turning, and need none
        assumed = ()
    return replace(trials, labels=replace(trials.labels, assumed=assumed))


def make_trials(
    runs: Source,
    weights: Source | None,
    conventions: Conventions,
    errors: Errors | ReadingErrors | None,
    problems: Problems,
) -> Trials | None:
    """Put both tables together, or None and problems."""
    names, trials = read_runs(runs, conventions, problems)
    # the only run need not be named
    mounted = (
        None if weights is None else read_weights(weights, names, replace(conventions, run=""), problems)
    )
    if not trials or problems:
        return None
    if isinstance(errors, ReadingErrors):
        trials = replace(trials, errors=errors)
    elif errors is not None:
        trials = errors.stated_in(trials)
    if mounted is None:
        return trials
    trials = replace(trials, planes=mounted.planes, weights=mounted.weights, relative=mounted.relative)
    labels = replace(trials.labels, weight_unit=mounted.unit.name, weight_scale=mounted.unit.scale)
    return replace(trials, labels=labels)


def read_runs(
    source: Source, conventions: Conventions, problems: Problems
) -> tuple[tuple[str, ...] | None, Trials | None]:
    """Read a runs table: names of its runs, and its readings without weights; None and problems.

    Parameters
    ----------
    source
        A file, a folder or a tuple with one file a run, or the cells of a sheet.
    conventions
        What phases mean, and which speeds count as one.
    problems
        Collects the complaints.
    """
    grids, noted = without_phases(read_runs_grids(source, conventions, problems))
    table = readings_table(grids, AMPLITUDES, problems)
    if table is None:
        return None, None
    has_phases = "phase" in table
    run, sensor, speed = table.texts("run"), table.texts("sensor"), table.numbers("speed")
    usable = [i for i in range(len(table)) if run[i] and sensor[i] and speed[i] > 0]
    start, band = len(problems), conventions.speed_tolerance_percent
    speeds, index, words = _merge_speeds(table, usable, band)
    runs, sensors = (tuple(name for name in dict.fromkeys(names) if name) for names in (run, sensor))
    repeat = table.texts("repeat")
    order, run_at, sensor_at = (
        {name: k for k, name in enumerate(dict.fromkeys(of))} for of in (repeat, runs, sensors)
    )
    rows, readings = sorted(usable, key=lambda i: order[repeat[i]]), Counter[tuple[int, int, int]]()
    places = list[tuple[int, int, int, int]]()
    for i in rows:
        place = run_at[run[i]], index[i], sensor_at[sensor[i]]
        places.append((readings[place], *place))
        readings[place] += 1
    if len(problems) == start and len(readings) < len(rows):  # with unclear speeds the rest would be noise
        _complain_about_twins(table, dict(zip(rows, places, strict=True)), repeat, band)
    if table.grid.complete and len(usable) == len(table) and len(problems) == start:
        _complain_about_gaps(table, (runs, speeds, sensors), readings, band)
    labels = conventions.labels
    turn = _index(table, runs, labels) if "index" in table and len(problems) == start else None
    if not len(problems) and has_phases:
        _ask_about_exchange(table, conventions)
    if len(problems):  # nobody will look at the readings, and with gaps they may be immensely many
        return runs, None
    shape = max(readings.values()), len(runs), len(speeds), len(sensors)

    def placed(values: NDArray[Any]) -> NDArray[Any]:
        """Values (…, rows of the table) among repeats, runs, speeds, sensors; NaN elsewhere."""
        out = np.full((*values.shape[:-1], *shape), np.nan, values.dtype)
        out[..., *np.transpose(places)] = values[..., rows]
        return out

    unit = table.unit("amplitude")
    if unit.kind == "unbalance":  # of a calibrated machine, at angles as those of weights
        labels = replace(labels, phase="lead" if labels.angle_sign > 0 else "lag")
    vectors = labels.vibration_from(table.numbers("amplitude"), table.numbers("phase", 0.0))
    labels = replace(
        labels,
        vibration_unit=unit.name,
        vibration_scale=unit.scale,
        weight_unit="g",
        weight_scale=1e3,
        speed_unit=table.unit("speed").name,
    )
    passed_over = [
        f"column {name.removeprefix(MOUNTED)!r} is passed over: weights stand in the weights table"
        for name in table.grid.header
        if name.startswith(MOUNTED)
    ]
    nothing, stated = np.zeros(len(table)), has_phases and "phase_std" in table
    return runs, Trials(
        runs,
        speeds,
        sensors,
        (),
        placed(vectors),
        np.zeros((len(runs), 0), dtype=complex),
        labels=labels,
        warnings=(*words, *passed_over, *_which_mm_s(table, conventions), *noted),
        steps=placed(np.array([table.steps("amplitude"), table.steps("phase") if has_phases else nothing])),
        covariance=placed(np.moveaxis(covariances(table, vectors), 0, -1)) if stated else None,
        index=turn,
        amplitudes_only=not has_phases,
    )


def _index(table: Table, runs: Sequence[str], labels: Labels) -> FloatArray:
    """By what angle the rotor was turned on its arbor in each run, rad with the rotation; notes a problem."""
    run, index = table.texts("run"), table.numbers("index")
    by_run = dict(zip(run[::-1], index[::-1], strict=True))
    same = np.array([by_run[name] for name in run]) == index
    table.complain_where(~same, "index", "one index a run, the same in all its rows")
    return labels.with_rotation(np.array([by_run[name] for name in runs]))


def _merge_speeds(
    table: Table, usable: Sequence[int], tolerance_percent: float
) -> tuple[FloatArray, dict[int, int], list[str]]:
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
    values, in_unit, band = table.numbers("speed"), speed_words(table), tolerance_percent
    runs = table.texts("run")
    distinct = np.unique(values[usable])
    apart = [k > 0 and not same_speed(v, distinct[k - 1], band) for k, v in enumerate(distinct)]
    groups = np.cumsum(apart)[np.searchsorted(distinct, values[usable])].tolist()
    read = {*zip(groups, values[usable].tolist(), (runs[row] for row in usable), strict=True)}
    merged, alike = [], []
    for _, group in groupby(sorted(read), itemgetter(0)):
        of_runs = [speed for _, speed, _ in group]
        speeds = [*dict.fromkeys(of_runs)]
        merged.append(speeds[0] if len(speeds) == 1 else float(np.mean(of_runs)))
        if same_speed(speeds[0], speeds[-1], UNSAID):
            continue
        shown = [*map(in_unit, speeds)]
        alike.append(f"{shown[0]} and {shown[-1]}")
        if not same_speed(speeds[0], speeds[-1], band):
            chain = f"{len(shown)} speeds from {shown[0]} to {shown[-1]}"
            words = (
                f"speeds that are clearly the same or not: {chain} form a chain, neighbours {_remedy(band)}"
            )
            table.as_whole("speed", words)
    merging = [f"speeds within {band:g} % count as one, such as {each}" for each in alike[:1]]
    return np.array(merged), dict(zip(usable, groups, strict=True)), merging


def _remedy(tolerance_percent: float) -> str:
    within = f"within the tolerance of {tolerance_percent:g} %"
    return f"{within}; write the nominal speed, or set speed_tolerance_percent smaller"


def covariances(table: Table, vectors: ComplexArray) -> FloatArray:
    """Of real and imaginary parts of the readings (n,) of a table with `amplitude_std` and `phase_std`.

    Returns
    -------
    ndarray
        Shape (n, 2, 2); where there is no amplitude, no direction is another.
    """
    along, size = table.numbers("amplitude_std"), abs(vectors)
    across = np.where(size > 0, size * table.numbers("phase_std"), along)
    return turned(vectors, along**2, across**2)


def readings_table(grids: Sequence[Grid], columns: Sequence[Column], problems: Problems) -> Table | None:
    """The columns of a runs table, of one file a run maybe, with numbers that can be; None and problems."""
    if len(grids) > 1:
        for grid in grids:  # whose problems are in a file of their own
            readings_table([grid], columns, problems)
        grids = [] if len(problems) else joined(grids, problems)
    table = make_table(grids[0], columns, problems) if grids else None
    if table is None:
        return None
    table.complain_where(table.numbers("speed") <= 0, "speed", "a speed above 0")
    table.complain_where(table.numbers("amplitude") < 0, "amplitude", "an amplitude of 0 or more")
    stems = [stem for stem in ("amplitude_std", "phase_std") if stem in table]
    if len(stems) == 1:
        expected = "amplitude_std_… and phase_std_deg together: one alone does not tell how a reading errs"
        table.in_header(stems[0], expected)
        return table
    for stem in stems:
        expected = "a standard deviation above 0: nothing is measured exactly"
        table.complain_where(table.numbers(stem) <= 0, stem, expected)
    if stems and (unit := table.unit("amplitude")).kind != table.unit("amplitude_std").kind:
        expected = f"a unit that converts to that of the amplitude, {unit.name or 'none'}"
        table.in_header("amplitude_std", expected)
    return table


def _which_mm_s(table: Table, conventions: Conventions) -> list[str]:
    """How mm/s alone are read, below a heading that does not say it."""
    heading = table.fields["phase" if conventions.exchanged else "amplitude"].names[0]
    unit = table.unit("amplitude").name
    if unit not in ("mm_s", "mm_s_rms") or re.search("mm_s|rms|peak|pk", heading, re.IGNORECASE):
        return []
    read, other = ("peak", "rms") if unit == "mm_s" else ("rms", "peak")
    return [f"{heading!r} is read as mm/s {read}: write {other} in the heading where it is {other}"]


def _ask_about_exchange(table: Table, conventions: Conventions) -> None:
    """Amplitudes that look like angles beside phases that look like amplitudes, unless the job says it."""
    if conventions.exchanged is not None or table.unit("phase").name != "deg" or len(table) < 4:
        return
    amplitude = table.numbers("amplitude") * table.unit("amplitude").scale
    small = abs(table.numbers("phase")).max() < np.radians(30) and table.steps("phase").min() < 0.008
    whole = np.all((abs(amplitude - np.round(amplitude)) < 1e-9) & (amplitude <= 360))
    if small and whole and np.ptp(amplitude) > 90:
        expected = (
            "amplitudes and phases in their own columns: are they exchanged? All phases are below 30°, all "
            "amplitudes look like angles: state exchanged = true in the job, or exchanged = false"
        )
        table.as_whole(table.fields["amplitude"].names[0], expected)


def _complain_about_twins(
    table: Table, places: Mapping[int, tuple[int, ...]], repeat: Sequence[str], tolerance_percent: float
) -> None:
    """Two readings of one run, speed and sensor must say that they are repeats."""
    stem, expected = "repeat", "another repeat than in row {}, the same reading"
    if stem not in table:
        stem, expected = "sensor", "one reading per run, speed and sensor (row {} has the same); "
        expected += "repeated readings need a column repeat"
    speed = table.numbers("speed")
    for row, other in repeated(
        (places[row][1:], repeat[row]) if row in places else None for row in range(len(table))
    ):
        if speed[other] != speed[row]:
            there = f"run {table.shown('run', row)!r} has {table.shown('speed', other)} as well"
            table.complain(row, "speed", f"one speed: {there}, {_remedy(tolerance_percent)}")
        else:
            table.complain(row, stem, expected.format(table.rows[other]))


def _complain_about_gaps(
    table: Table,
    names: tuple[Sequence[str], FloatArray, Sequence[str]],
    present: Collection[tuple[int, int, int]],
    tolerance_percent: float,
) -> None:
    """Every run needs every sensor at every speed: influence coefficients compare runs."""
    (runs, speeds, sensors), in_unit = names, speed_words(table)
    read = {(r, s) for r, s, _ in present}
    shape = len(runs), len(speeds), len(sensors)
    gaps = (key for key in np.ndindex(shape) if key not in present)
    for r, s, c in islice(gaps, MOST_LINES):
        place = f"run {runs[r]!r} at {in_unit(float(speeds[s]))}, as every run needs at every speed"
        if (r, s) in read:
            table.as_whole("sensor", f"a reading of sensor {sensors[c]!r} in {place}")
        elif c == 0:
            near = min((speeds[k] for q, k in read if q == r), key=lambda speed: abs(speed - speeds[s]))
            hint = f"its nearest speed is {in_unit(near)}, speeds count as one within "
            hint += f"{tolerance_percent:g} %"
            table.as_whole("speed", f"readings of {place}; {hint}")


def read_vectors(source: Source, phase: Phase) -> tuple[Readings, ...]:
    """Read the vectors of each run over speed, by rising time or, without times, speed.

    The columns are those of a runs table without `repeat` (`run`, `speed_rpm`, `sensor`, `amplitude_<unit>`,
    `phase_deg`) and, optionally, `time_s` and, both or neither, `amplitude_std_<unit>` and `phase_std_deg`,
    one standard deviation. Vectors of one time were read at one speed; without times a speed stands once.
    The table may have any layout of a runs table, such as columns for each sensor; without a column `run` it
    is one run, named as the file.

    Raises
    ------
    InputError
        With all problems of the file.
    """
    from rotorid.identify.modes_result import Readings

    problems = Problems()
    files = source if isinstance(source, (Grid, tuple)) else (Path(source),)
    grids = read_runs_grids(files, Conventions(Labels(phase=phase)), problems, first=True)
    table = problems.need(readings_table(grids, OVER_SPEED, problems))
    instants = _instants(table)
    problems.stop()
    unit, sweeps = table.unit("amplitude"), []
    labels = Labels(unit.name, unit.scale, phase=phase, speed_unit=table.unit("speed").name)
    vectors = labels.vibration_from(table.numbers("amplitude"), table.numbers("phase", 0.0))
    stated = covariances(table, vectors) if "amplitude_std" in table else None
    runs, names, speeds = np.array(table.texts("run")), table.texts("sensor"), table.numbers("speed")
    for run in dict.fromkeys(runs.tolist()):
        rows = np.flatnonzero(runs == run)
        instant, first, place = np.unique(instants[rows], return_index=True, return_inverse=True)
        sensors = tuple(dict.fromkeys(names[row] for row in rows))
        at = place, [sensors.index(names[row]) for row in rows]
        Z, its = np.full((len(instant), len(sensors)), complex(np.nan, np.nan)), None
        Z[at] = vectors[rows]
        if stated is not None:
            its = np.full((*Z.shape, 2, 2), np.nan)
            its[at] = stated[rows]
        timed = instant if "time" in table else None
        sweeps.append(Readings(run, timed, speeds[rows][first], sensors, Z, its, labels))
    return tuple(sweeps)


def _instants(table: Table) -> FloatArray:
    """Times, or else speeds; a sensor is read once at a time, and all at one speed."""
    stem, where = "time", "time"
    if "time" not in table:
        stem, where = "speed", "speed; vectors read one after the other need a column time_s"
    runs, instants, speeds = table.texts("run"), table.numbers(stem), table.numbers("speed")
    keys = [*zip(runs, table.texts("sensor"), instants.tolist(), strict=True)]
    unlike = f"another sensor than in row {{}}, which has the same run and {where}"
    table.once("sensor", (None if np.isnan(key[2]) else key for key in keys), unlike)
    for row, other in repeated((run, instant) for run, _, instant in keys):
        if abs(speeds[row] - speeds[other]) > 1e-9 * speeds[other]:
            expected = f"{table.shown('speed', other)} as in row {table.rows[other]}, the same time"
            table.complain(row, "speed", expected)
    return instants
