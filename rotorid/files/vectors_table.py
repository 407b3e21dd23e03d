"""Tables of vectors over speed: runs tables with times and standard deviations."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from balancing import Labels
from rotorid.base.arrays import FloatArray
from rotorid.base.text import Phase
from rotorid.files import runs as runs_table
from rotorid.files import units
from rotorid.files.cells import Grid
from rotorid.files.columns import Column, Source, Table
from rotorid.files.conventions import Conventions
from rotorid.files.layout import joined, read_runs_grids
from rotorid.files.problems import Problems
from rotorid.files.units import one_of
from rotorid.identify.modes_result import Readings

COLUMNS = (
    *(column for column in runs_table.COLUMNS if column.stem not in ("repeat", "time_s")),
    Column("time", one_of(units.TIME), ("time_s",), required=False),
)
_SAME = 1e-9


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
    problems = Problems()
    files = source if isinstance(source, (Grid, tuple)) else (Path(source),)
    grids = read_runs_grids(files, Conventions(Labels(phase=phase)), problems, first=True)
    grid = problems.need(joined(grids, problems))
    table = problems.need(runs_table.readings_table(grid, problems, COLUMNS))
    instants = _instants(table)
    problems.stop()
    unit, sweeps = table.unit("amplitude"), []
    labels = Labels(unit.name, unit.scale, phase=phase, speed_unit=table.unit("speed").name)
    vectors = labels.vibration_from(table.numbers("amplitude"), table.numbers("phase"))
    covariances = runs_table.covariances(table, vectors) if "amplitude_std" in table else None
    runs, names, speeds = np.array(table.texts("run")), table.texts("sensor"), table.numbers("speed")
    for run in dict.fromkeys(runs.tolist()):
        rows = np.flatnonzero(runs == run)
        instant, first, place = np.unique(instants[rows], return_index=True, return_inverse=True)
        sensors = tuple(dict.fromkeys(names[row] for row in rows))
        at = place, [sensors.index(names[row]) for row in rows]
        Z, stated = np.full((len(instant), len(sensors)), complex(np.nan, np.nan)), None
        Z[at] = vectors[rows]
        if covariances is not None:
            stated = np.full((*Z.shape, 2, 2), np.nan)
            stated[at] = covariances[rows]
        timed = instant if "time" in table else None
        sweeps.append(Readings(run, timed, speeds[rows][first], sensors, Z, stated, labels))
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
    first: dict[tuple[str, float], int] = {}
    for row, (run, _, instant) in enumerate(keys):
        other = first.setdefault((run, instant), row)
        if abs(speeds[row] - speeds[other]) > _SAME * speeds[other]:
            expected = f"{table.shown('speed', other)} as in row {table.rows[other]}, the same time"
            table.complain(row, "speed", expected)
    return instants
