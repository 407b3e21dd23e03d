"""Amplitudes before and after a correction, as bars and dots. Nothing is ever shown or saved here."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from balancing.data.result_columns import INVISIBLE
from rotorid.base.arrays import FloatArray
from rotorid.base.plot_style import TEXT, plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from balancing.correction.check_run_result import CheckComparison
    from balancing.correction.correction_result import Correction
    from balancing.data.conventions import Labels

_CLOSER = 0.3
"""Share of the largest amplitude below which what is left is drawn a second time, larger."""
_NAMED = 40
"""Readings that have room for the names of their sensors."""
_LONG = 28
"""Letters of a name of which only the first and last are shown."""


def amplitudes(
    c: Correction, ax: Axes, check: CheckComparison | None = None, closer: Axes | None = None
) -> Axes:
    """Amplitudes before and after for every speed and sensor, with 95 % of a check run where known.

    With a check run (of several: the last) those before, predicted with what was mounted, and achieved.
    """
    speeds, sensors = (c.speeds, c.sensors) if check is None else (check.speeds, check.sensors)
    sizes, reach = sizes_of(c, check)
    ends = None if reach is None else (np.maximum(sizes[1] - reach, 0.0), sizes[1] + reach)
    limit = np.full(len(sizes[0]), np.inf)
    if check is None and c.limits is not None:
        limit = c.limits.residual.ravel() * c.labels.vibration_scale
    limited, at = np.isfinite(limit), _places(len(speeds), len(sensors))
    for axes, first in ((ax, 0), (closer, 1)):
        if axes is None:
            continue
        _draw_readings(axes, at, sizes, ends)
        if limited.any():
            where = at[limited]
            axes.hlines(limit[limited], where - 0.45, where + 0.45, color="black", lw=2.2, label="limit")
        top = 1.08 * max(float(np.max(values, initial=0.0)) for values in (*sizes[first:], *(ends or ())))
        axes.set_ylim(0, top or 1.0)
        plain(axes)
        axes.grid(visible=False, axis="x")
    _name_readings(closer or ax, ax, speeds, sensors, c.labels)
    ax.set_ylabel(f"vibration{unit(c.labels)}")
    if closer is not None:
        ax.tick_params(labelbottom=False)
        closer.set_ylabel(f"what is left{unit(c.labels)}")
    return ax


def sizes_of(c: Correction, check: CheckComparison | None) -> tuple[list[FloatArray], FloatArray | None]:
    """Amplitudes before, predicted and, with a check run, achieved; half widths of 95 % of the second."""
    values, covariance = [c.before, c.after], c.after_covariance
    if check is not None:
        values = [check.before, check.predicted[-1], check.achieved[-1]]
        covariance = None if check.covariance is None else check.covariance[-1]
    sizes = [np.abs(z).ravel() * c.labels.vibration_scale for z in values]
    return sizes, None if covariance is None else c.within(covariance)


def left_is_small(sizes: Sequence[FloatArray], reach: FloatArray | None) -> bool:
    """Whether what is left cannot be read beside what was before."""
    left = max(float(np.max(values)) for values in (*sizes[1:], sizes[1] + (0.0 if reach is None else reach)))
    before = float(np.max(sizes[0]))
    return INVISIBLE * before < left < _CLOSER * before


def _draw_readings(
    ax: Axes, at: FloatArray, sizes: Sequence[FloatArray], ends: tuple[FloatArray, FloatArray] | None
) -> None:
    """Bars, dots with their 95 %, and stars on one scale."""
    old, new, *achieved = sizes
    ax.bar(at, old, 0.8, color="0.86", edgecolor="0.5", lw=0.6, label="before")
    beside = at - 0.17 * len(achieved)  # dots and stars hide each other otherwise
    if ends is not None:
        ax.vlines(beside, *ends, color="black", lw=1.2)
    after = "predicted" if ends is None else "predicted, with 95 % of a check run"
    worse = (new if ends is None else ends[1]) >= old
    for those, face, label in ((~worse, "black", after), (worse, "white", "perhaps no better than before")):
        if those.any():
            ax.plot(beside[those], new[those], "o", color="black", mfc=face, ms=4.5, label=label)
    for values in achieved:
        ax.plot(at + 0.2, values, "*", color="black", ms=8, mec="white", mew=0.5, label="achieved")


def _places(S: int, C: int) -> FloatArray:
    """Along an axis, of readings (S·C,): one group a speed."""
    return np.arange(S * C) + np.repeat(np.arange(S), C) * 0.8


def _name_readings(
    below: Axes, above: Axes, speeds: FloatArray, sensors: Sequence[str], labels: Labels
) -> None:
    """Sensors under their readings (where they fit) and speeds above each group, in the unit of the job."""
    S, C = len(speeds), len(sensors)
    x = _places(S, C)
    below.set_xlabel("sensor", fontsize=TEXT)
    below.set_xlim(-0.7, float(x[-1]) + 0.7)
    if S * C <= _NAMED:
        names = [name if len(name) < _LONG else f"{name[:16]}…{name[-8:]}" for name in sensors] * S
        below.set_xticks(x, names, rotation=90, fontsize=TEXT, parse_math=False)
    else:
        below.set_xticks([])
    every = -(-S // 12)
    numbers = [labels.speed_number(speed) for speed in speeds[::every]]
    upper = above.secondary_xaxis("top")
    upper.set_xticks(x.reshape(S, C).mean(axis=1)[::every], numbers, fontsize=TEXT)
    upper.tick_params(length=0)
    upper.set_xlabel(f"speed, {labels.speed_in}", fontsize=TEXT)
    upper.spines["top"].set_visible(False)


def unit(labels: Labels) -> str:
    """Of the readings, behind the name of an axis."""
    return f", {labels.vibration_in}" if labels.vibration_in else ""
