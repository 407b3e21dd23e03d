"""Runs of a job that is being filled in: finished readings, and what the trial weights changed."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rotorid.base.text import figures

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from balancing import Trials
    from rotorid.base.arrays import FloatArray
    from rotorid.files.columns import Table


class Channel(NamedTuple):
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


class Effect(NamedTuple):
    """What a trial weight changes: "none", "weak" or "good", the largest change in per cent, in words."""

    run: str
    level: str
    percent: float | None
    words: str


class RunsSoFar(NamedTuple):
    """Readings that are there, whatever else is missing.

    Attributes
    ----------
    baseline
        The first run without a row in the weights table, or None.
    mounted
        Names of the runs that have one.
    channels
        Sensors and speeds that have readings.
    """

    baseline: str | None
    mounted: tuple[str, ...]
    channels: tuple[Channel, ...]

    def effects(self) -> list[Effect]:
        """Of each trial run that has readings where the baseline has some."""
        return [effect for run in self.mounted if (effect := self._effect(run))]

    def _effect(self, run: str) -> Effect | None:
        from scipy.special import chdtri

        from balancing import clear_change

        pairs = [
            (one, [one.trials.runs.index(name) for name in (self.baseline, run)])
            for one in self.channels
            if {self.baseline, run} <= {*one.trials.runs}
        ]
        if not pairs:
            return None
        readings = np.array([one.trials.mean[pair, 0, 0] for one, pair in pairs])
        variances = [float(np.trace(one.covariance[pair, 0, 0].sum(0))) / 2 for one, pair in pairs]
        changes = np.abs(np.diff(readings)[:, 0])
        with np.errstate(divide="ignore", invalid="ignore"):
            errors = changes / np.sqrt(variances)
        at = int(np.argmax(changes))
        level, verdict = "good", f"{figures(float(errors[at]), 2)} times the errors of the readings"
        if not np.any(errors**2 > float(chdtri(2, 0.05 / len(pairs)))):
            level, verdict = "none", "no more than the errors explain: a larger weight is needed"
        elif not any(clear_change(*pair) for pair in readings.tolist()):
            level = "weak"
            verdict = "nowhere by 30 % or 30°: a larger weight would make the answer more certain"
        channel, start = pairs[at][0], abs(readings[at, 0])
        labels, percent = channel.trials.labels, 100 * float(changes[at] / start) if start else None
        amount = labels.amplitude_words(float(changes[at]))
        amount += "" if percent is None else f", {figures(percent, 3)} % of its reading"
        where = f"{channel.sensor} at {labels.speed_words(float(channel.trials.speeds[0]))}"
        return Effect(run, level, percent, f"changes {where} by {amount}; {verdict}")

    def figure(self, speed: str, sensor: str) -> Figure:
        """The runs of one sensor at one speed, of the first where nothing is read there yet."""
        from balancing.plots import draw_readings
        from rotorid.base.plot_style import on_figure

        if not self.channels:
            raise ValueError("nothing is read yet")
        places = {(one.speed, one.sensor): one for one in reversed(self.channels)}
        one = places.get((speed, sensor), self.channels[0])
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
    slow = sources.get("slow_roll", settings.slow_roll)
    cells = read_grid(sources["runs"], "runs", problems) if "runs" in sources else None
    grids = None if cells is None else read_runs_grids(cells, conventions, problems)
    grid = joined(grids, problems)
    table = None if grid is None else make_table(grid, COLUMNS, Problems())
    if grid is None or table is None:
        problems.stop()
        return RunsSoFar(None, (), ())

    def trials_of(rows: Sequence[int]) -> Trials | None:
        part = replace(grid, rows=tuple(grid.rows[i] for i in rows))
        trials = make_trials(part, None, conventions, settings.errors, Problems())
        if trials is None or slow is None:
            return trials
        its = {k: v for k, v in slow.items() if k in trials.sensors} if isinstance(slow, Mapping) else slow
        roll = make_slow_roll(its, trials, conventions, Problems())
        return trials if roll is None else subtract_slow_roll(trials, roll[0])

    whole, channels = trials_of(range(len(table))), []
    for rows in _rows_by_channel(table, conventions.speed_tolerance_percent):
        if (trials := trials_of(rows)) is not None:
            covariance = reading_of(whole or trials).covariance(trials)  # repeats of all channels count
            channels.append(Channel(table.shown("speed", rows[0]), trials.sensors[0], trials, covariance))
    weights = sources.get("weights")
    there = None if weights is None else read_grid(weights, "weights", Problems(), may_be_empty=True)
    names = set()
    if there is not None and "run" in there.header:
        names = {str(row[there.header.index("run")]) for _, row in there.rows}
    runs = [*dict.fromkeys(filter(None, table.texts("run")))]
    baseline = next((run for run in runs if run not in names), None)
    return RunsSoFar(baseline, tuple(run for run in runs if run in names), tuple(channels))


def _rows_by_channel(table: Table, tolerance_percent: float) -> list[list[int]]:
    """Indices of the finished rows of each speed and sensor."""
    from rotorid.files.runs import same_speed

    run, sensor, speed = table.texts("run"), table.texts("sensor"), table.numbers("speed")
    finite = np.isfinite(table.numbers("amplitude") + table.numbers("phase"))
    places: dict[tuple[float, str], list[int]] = defaultdict(list)
    for i, v in enumerate(speed.tolist()):
        if run[i] and sensor[i] and v > 0 and finite[i]:
            near = next((one for one, _ in places if same_speed(one, v, tolerance_percent)), v)
            places[near, sensor[i]].append(i)
    return [places[key] for key in sorted(places, key=lambda key: key[0])]
