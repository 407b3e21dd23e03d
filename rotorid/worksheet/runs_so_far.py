"""Runs of a job that is being filled in: finished readings, and what the trial weights changed."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorid.base.text import figures

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from balancing import Trials
    from rotorid.base.arrays import FloatArray
    from rotorid.files.cells import Grid
    from rotorid.files.columns import Source, Table
    from rotorid.files.conventions import Conventions
    from rotorid.files.job_models import JobSettings, Vector

_NUMBER = re.compile(r"[+-]?[0-9.,]*[0-9][0-9.,]*(?:[eE][+-]?[0-9]+)?")
LEVELS = ("none", "weak", "good")
"""The changes lie within the errors; they are less than 30 % and 30°; at least one is more."""


@dataclass(frozen=True, eq=False)
class Channel:
    """Finished readings of one sensor at one speed.

    Attributes
    ----------
    speed
        As the first of its rows writes it.
    trials
        Runs (R,) at one speed by one sensor.
    covariance
        Of their means, shape (R, 1, 1, 2, 2).
    """

    speed: str
    trials: Trials
    covariance: FloatArray

    @property
    def sensor(self) -> str:
        """Its name."""
        return self.trials.sensors[0]

    def change(self, first: str, run: str) -> tuple[complex, complex, float] | None:
        """Reading of the first run, its change in another, and how many errors that is; None: not both."""
        if not {first, run} <= {*self.trials.runs}:
            return None
        a, b = (self.trials.runs.index(name) for name in (first, run))
        start, end = (complex(self.trials.mean[r, 0, 0]) for r in (a, b))
        variance = sum(float(self.covariance[r, 0, 0, i, i]) for r in (a, b) for i in (0, 1)) / 2
        return start, end - start, abs(end - start) / math.sqrt(variance) if variance > 0 else math.inf


@dataclass(frozen=True, eq=False)
class RunsSoFar:
    """Readings that are there, whatever else is missing.

    Attributes
    ----------
    baseline
        The first run without a row in the weights table, or None.
    trials
        Names of the runs that have one, in the order of their table.
    channels
        Sensors and speeds that have readings.
    """

    baseline: str | None
    trials: tuple[str, ...]
    channels: tuple[Channel, ...]

    def to_dict(self) -> dict[str, Any]:
        """As JSON types: the effect of each trial run beside the baseline."""
        return {
            "baseline": self.baseline,
            "channels": [{"speed": one.speed, "sensor": one.sensor} for one in self.channels],
            "runs": [effect for run in self.trials if (effect := self._effect(run))],
        }

    def _effect(self, run: str) -> dict[str, Any] | None:
        """The largest change that a run makes, in words; None before there are readings of both."""
        from scipy.special import chdtri

        from balancing import clear_change

        if self.baseline is None:
            return None
        found = [(one, made) for one in self.channels if (made := one.change(self.baseline, run))]
        if not found:
            return None
        channel, (start, change, errors) = max(found, key=lambda one: abs(one[1][1]))
        seen = any(made[2] ** 2 > float(chdtri(2, 0.05 / len(found))) for _, made in found)
        large = any(clear_change(start, start + change) for _, (start, change, _) in found)
        level = LEVELS[seen * (1 + large)]
        labels = channel.trials.labels
        where = f"{channel.sensor} at {labels.speed_words(float(channel.trials.speeds[0]))}"
        share = 100 * abs(change) / abs(start) if start else None
        amount = labels.amplitude_words(abs(change))
        amount += "" if share is None else f", {figures(share, 3)} % of its reading"
        verdict = {
            "none": "no more than the errors explain: a larger weight is needed",
            "weak": "nowhere by 30 % or 30°: a larger weight would make the answer more certain",
            "good": f"{figures(errors, 2)} times the errors of the readings",
        }[level]
        return {
            "run": run,
            "share_percent": share,
            "where": where,
            "level": level,
            "words": f"changes {where} by {amount}; {verdict}",
        }

    def figure(self, speed: str, sensor: str) -> Figure:
        """The runs of one sensor at one speed.

        Raises
        ------
        ValueError
            Where nothing is read there yet.
        """
        from balancing.plots import draw_readings
        from rotorid.base.plot_style import on_figure

        found = [one for one in self.channels if (one.speed, one.sensor) == (speed, sensor)]
        if not found:
            raise ValueError(f"nothing is read yet of {sensor!r} at {speed}")
        trials, covariance = found[0].trials, found[0].covariance
        first = self.baseline if self.baseline in trials.runs else None
        return on_figure(lambda ax: draw_readings(trials, covariance, first, ax), 5, 4.6, projection="polar")


def runs_so_far(job: Path) -> RunsSoFar:
    """The finished readings of a job, row by row: rows that cannot be read yet are left out.

    Parameters
    ----------
    job
        A job file or a workbook.

    Raises
    ------
    InputError
        If there is no job with a runs table.
    """
    from rotorid.files.columns import make_table, read_grid
    from rotorid.files.job import Overrides, conventions_of, tables_of
    from rotorid.files.job_excel import open_job
    from rotorid.files.layout import read_runs_grid
    from rotorid.files.problems import Problems
    from rotorid.files.runs import COLUMNS

    problems = Problems()
    written = open_job(job, problems)
    settings = written.read(Problems())
    conventions = conventions_of(settings, Overrides())
    sources, _ = tables_of(written, settings)
    grid = None if "runs" not in sources else read_grid(sources["runs"], "runs", problems)
    grid = None if grid is None else read_runs_grid(_finished(grid), conventions, problems)
    table = None if grid is None else make_table(grid, COLUMNS, Problems())
    if grid is None or table is None:
        problems.stop()
        return RunsSoFar(None, (), ())
    weights, mounted = sources.get("weights"), set[str]()
    mounting = None if weights is None else read_grid(weights, "weights", Problems(), may_be_empty=True)
    if mounting is not None and "run" in mounting.header:
        at = mounting.header.index("run")
        mounted = {str(cells[at]) for _, cells in mounting.rows}
    slow = sources.get("slow_roll", settings.slow_roll)
    runs = tuple(dict.fromkeys(run for run in table.texts("run") if run))
    baseline = next((run for run in runs if run not in mounted), None)
    trials = tuple(run for run in runs if run in mounted)
    return RunsSoFar(baseline, trials, tuple(_channels(grid, table, conventions, settings, slow)))


def _finished(grid: Grid) -> Grid:
    """Without the rows in which a name or a number is still missing, or is none."""
    names = ("run", "speed", "sensor", "amplitude", "phase")
    places = {k: name for k, head in enumerate(grid.header) if (name := head.partition("_")[0]) in names}
    texts = {k for k, name in places.items() if name in ("run", "sensor")}

    def good(k: int, cell: object) -> bool:
        return cell != "" and (k in texts or not isinstance(cell, str) or bool(_NUMBER.fullmatch(cell)))

    rows = (row for row in grid.rows if all(good(k, row[1][k]) for k in places))
    return replace(grid, rows=tuple(rows))


def _channels(
    grid: Grid,
    table: Table,
    conventions: Conventions,
    settings: JobSettings,
    slow: Source | Mapping[str, Vector] | None,
) -> Iterator[Channel]:
    """Each sensor at each speed that can be read by itself."""
    from balancing import reading_of
    from rotorid.files.problems import Problems
    from rotorid.files.runs import make_trials
    from rotorid.files.slow_roll import make_slow_roll, subtract_slow_roll

    def read(part: Grid) -> Trials | None:
        trials = make_trials(part, None, conventions, settings.errors, Problems())
        if trials is None:
            return None
        trials = replace(trials, labels=conventions.on(trials.labels))
        its = slow
        if isinstance(slow, Mapping):
            its = {sensor: vector for sensor, vector in slow.items() if sensor in trials.sensors}
        roll = None if its is None else make_slow_roll(its, trials, conventions, Problems())
        return trials if roll is None else subtract_slow_roll(trials, roll)

    whole = read(grid)
    for rows in _rows_by_channel(table, conventions.speed_tolerance_percent):
        trials = read(replace(grid, rows=tuple(grid.rows[i] for i in rows)))
        if trials is not None:
            reading = reading_of(trials if whole is None else whole)  # repeats of all channels count
            yield Channel(table.shown("speed", rows[0]), trials, reading.covariance(trials))


def _rows_by_channel(table: Table, tolerance_percent: float) -> Sequence[list[int]]:
    """Indices of the finished rows of each speed and sensor."""
    from rotorid.files.runs import same_speed

    found: dict[tuple[float, str], list[int]] = {}
    speed, run, sensor = table.numbers("speed"), table.texts("run"), table.texts("sensor")
    sizes = table.numbers("amplitude"), table.numbers("phase")
    for i in range(len(table)):
        if run[i] and sensor[i] and speed[i] > 0 and all(math.isfinite(size[i]) for size in sizes):
            near = next((v for v, _ in found if same_speed(v, speed[i], tolerance_percent)), float(speed[i]))
            found.setdefault((near, sensor[i]), []).append(i)
    return [found[key] for key in sorted(found, key=lambda key: key[0])]
