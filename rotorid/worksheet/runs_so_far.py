"""Runs of a job that is being filled in: finished readings, and what the trial weights changed."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.text import figures

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from balancing import Trials
    from rotorid.base.arrays import FloatArray
    from rotorid.files.cells import Grid
    from rotorid.files.columns import Source, Table

_NUMBER = re.compile(r"[+-]?[0-9.,]*[0-9][0-9.,]*(?:[eE][+-]?[0-9]+)?")


@dataclass(frozen=True, eq=False)
class Channel:
    """Finished readings of one sensor at one speed.

    Attributes
    ----------
    speed, sensor
        As the first of its rows writes them.
    trials
        Runs (R,) at one speed by one sensor.
    covariance
        Of their means, shape (R, 1, 1, 2, 2).
    """

    speed: str
    sensor: str
    trials: Trials
    covariance: FloatArray

    def change(self, first: str, run: str) -> tuple[complex, complex, float] | None:
        """Reading of the first run, its change in another, and how many errors that is; None: not both."""
        if not {first, run} <= {*self.trials.runs}:
            return None
        pair = [self.trials.runs.index(name) for name in (first, run)]
        start, end = self.trials.mean[pair, 0, 0].tolist()
        variance = float(np.trace(self.covariance[pair, 0, 0].sum(0))) / 2
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

        changes = [(one, made) for one in self.channels if (made := one.change(self.baseline or "", run))]
        if not changes:
            return None
        channel, (start, change, errors) = max(changes, key=lambda one: abs(one[1][1]))
        seen = any(made[2] ** 2 > float(chdtri(2, 0.05 / len(changes))) for _, made in changes)
        large = any(clear_change(start, start + change) for _, (start, change, _) in changes)
        level, verdict = (
            ("none", "no more than the errors explain: a larger weight is needed"),
            ("weak", "nowhere by 30 % or 30°: a larger weight would make the answer more certain"),
            ("good", f"{figures(errors, 2)} times the errors of the readings"),
        )[seen * (1 + large)]
        labels = channel.trials.labels
        where = f"{channel.sensor} at {labels.speed_words(float(channel.trials.speeds[0]))}"
        share = 100 * abs(change) / abs(start) if start else None
        amount = labels.amplitude_words(abs(change))
        amount += "" if share is None else f", {figures(share, 3)} % of its reading"
        words = f"changes {where} by {amount}; {verdict}"
        return {"run": run, "share_percent": share, "where": where, "level": level, "words": words}

    def figure(self, speed: str, sensor: str) -> Figure:
        """The runs of one sensor at one speed; ValueError where nothing is read there yet."""
        from balancing.plots import draw_readings
        from rotorid.base.plot_style import on_figure

        one = next((it for it in self.channels if (it.speed, it.sensor) == (speed, sensor)), None)
        if one is None:
            raise ValueError(f"nothing is read yet of {sensor!r} at {speed}")
        first = self.baseline if self.baseline in one.trials.runs else None
        return on_figure(
            lambda ax: draw_readings(one.trials, one.covariance, first, ax), 5, 4.6, projection="polar"
        )


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
    from balancing import reading_of
    from rotorid.files.columns import make_table, read_grid
    from rotorid.files.further_runs import make_slow_roll, subtract_slow_roll
    from rotorid.files.job import conventions_of, open_job, tables_of
    from rotorid.files.layout import joined, read_runs_grids
    from rotorid.files.problems import Problems
    from rotorid.files.runs import COLUMNS, make_trials

    problems = Problems()
    written = open_job(job, problems)
    settings = written.read(Problems())
    conventions = conventions_of(settings)
    sources, _ = tables_of(written, settings)
    grid = None if "runs" not in sources else read_grid(sources["runs"], "runs", problems)
    grid = None if grid is None else joined(read_runs_grids(_finished(grid), conventions, problems), problems)
    table = None if grid is None else make_table(grid, COLUMNS, Problems())
    if grid is None or table is None:
        problems.stop()
        return RunsSoFar(None, (), ())
    slow = sources.get("slow_roll", settings.slow_roll)

    def read(rows: Sequence[int]) -> Trials | None:
        part = replace(grid, rows=tuple(grid.rows[i] for i in rows))
        trials = make_trials(part, None, conventions, settings.errors, Problems())
        if trials is None:
            return None
        trials = replace(trials, labels=conventions.on(trials.labels))
        its = slow
        if isinstance(slow, Mapping):
            its = {sensor: vector for sensor, vector in slow.items() if sensor in trials.sensors}
        roll = None if its is None else make_slow_roll(its, trials, conventions, Problems())
        return trials if roll is None else subtract_slow_roll(trials, roll[0])

    whole, channels = read(range(len(table))), []
    for rows in _rows_by_channel(table, conventions.speed_tolerance_percent):
        if (trials := read(rows)) is not None:
            covariance = reading_of(whole or trials).covariance(trials)  # repeats of all channels count
            channels.append(Channel(table.shown("speed", rows[0]), trials.sensors[0], trials, covariance))
    mounted = _mounted(sources.get("weights"))
    runs = tuple(dict.fromkeys(filter(None, table.texts("run"))))
    baseline = next((run for run in runs if run not in mounted), None)
    return RunsSoFar(baseline, tuple(run for run in runs if run in mounted), tuple(channels))


def _mounted(weights: Source | None) -> set[str]:
    """Runs that the weights table names."""
    from rotorid.files.columns import read_grid
    from rotorid.files.problems import Problems

    grid = None if weights is None else read_grid(weights, "weights", Problems(), may_be_empty=True)
    if grid is None or "run" not in grid.header:
        return set()
    return {str(cells[grid.header.index("run")]) for _, cells in grid.rows}


def _finished(grid: Grid) -> Grid:
    """Without the rows in which a name or a number is still missing, or is none."""
    names = ("run", "speed", "sensor", "amplitude", "phase")
    places = {k: name for k, head in enumerate(grid.header) if (name := head.partition("_")[0]) in names}

    def good(name: str, cell: object) -> bool:
        readable = name in ("run", "sensor") or not isinstance(cell, str) or _NUMBER.fullmatch(cell)
        return cell != "" and bool(readable)

    rows = (row for row in grid.rows if all(good(name, row[1][k]) for k, name in places.items()))
    return replace(grid, rows=tuple(rows))


def _rows_by_channel(table: Table, tolerance_percent: float) -> list[list[int]]:
    """Indices of the finished rows of each speed and sensor."""
    from rotorid.files.runs import same_speed

    places: dict[tuple[float, str], list[int]] = {}
    speed, run, sensor = table.numbers("speed"), table.texts("run"), table.texts("sensor")
    finite = np.isfinite(table.numbers("amplitude")) & np.isfinite(table.numbers("phase"))
    for i in range(len(table)):
        if run[i] and sensor[i] and speed[i] > 0 and finite[i]:
            near = next((v for v, _ in places if same_speed(v, speed[i], tolerance_percent)), float(speed[i]))
            places.setdefault((near, sensor[i]), []).append(i)
    return [places[key] for key in sorted(places, key=lambda key: key[0])]
