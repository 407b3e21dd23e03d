"""Picture of records: vectors, and a tacho. Of a long record only what is drawn is read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.plot_style import (
    BLUE,
    COLORS,
    MARKERS,
    QUIET,
    VERMILION,
    legend_below,
    new_figure,
    plain,
)
from rotorid.base.text import RPM, cut
from rotorid.waveforms.record import Channel

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from balancing import Labels
    from rotorid.waveforms.tacho import Tacho
    from rotorid.waveforms.vectors import Vectors

TURNS, MANY = 4, 30
"""Drawn of a tacho; vectors of a record that have small marks."""


def figure_vectors(each: Sequence[Vectors], labels: Labels, channel: Channel, rate: float) -> Figure:
    """Vectors over speed, or run by run where all are steady, over the tacho of the first record."""
    figure = new_figure(7.0)
    *axes, tacho = figure.subplots(3, height_ratios=(6, 5, 2))
    draw_tacho(tacho, channel, rate, each[0].tacho)
    steady = all(one.steady for one in each)
    curves = [(c, k) for k in range(len(each[0].orders)) for c in range(len(each[0].sensors))]
    for n, (c, k) in enumerate(curves[: len(COLORS)]):
        for run, one in enumerate(each):
            z = one.vectors[:, c, k]
            x = np.full(z.shape, run + 0.05 * n) if steady else one.speeds * RPM
            errors = (
                one.radial[:, c, k] * labels.vibration_scale,
                np.degrees(one.tangential[:, c, k] / np.abs(z)),
            )
            for ax, y, error in zip(axes, labels.vibration(z), errors, strict=True):
                name = f"{one.sensors[c]}, {one.orders[k]}×"
                ax.errorbar(
                    x,
                    y,
                    2 * error,
                    fmt=MARKERS[n],
                    color=COLORS[n],
                    ms=5 if len(x) < MANY else 2.5,
                    label=name,
                )
    axes[0].set(ylabel=f"amplitude, {labels.vibration_in or 'as recorded'}", ylim=(0, None))
    axes[1].set(ylabel=f"phase ({labels.phase}), °", ylim=(-10, 370), yticks=range(0, 361, 90))
    for ax in axes:
        plain(ax)
        ax.set_xlabel("run" if steady else "speed, rpm")
        if steady:
            ax.set_xticks(range(len(each)), [cut(one.run, 16) for one in each], rotation=20, parse_math=False)
    words = f"± 2σ; at most {len(COLORS)} curves; jitter of the tacho {each[0].tacho.jitter_deg:.2g}°"
    legend_below(figure, [axes[0], tacho], 4, title=words)
    return figure


def draw_tacho(ax: Axes, channel: Channel, rate: float, tacho: Tacho) -> None:
    """Draw a tacho's signal around its first damaged pulse, else in the middle."""
    missing = np.interp(tacho.missing, tacho.turns, tacho.times)
    damaged = np.sort(np.concatenate((missing, tacho.double)))
    centre = damaged[0] if damaged.size else tacho.times[len(tacho.times) // 2]
    middle = np.interp(centre, tacho.times, tacho.turns)
    ends = np.interp([middle - TURNS / 2, middle + TURNS / 2], tacho.turns, tacho.times)
    first, last = int(ends[0] * rate), int(ends[1] * rate) + 1
    ax.plot(np.arange(first, last) / rate, channel.samples[first:last], color=QUIET, linewidth=0.9)
    for times, marker, color, label in (
        (tacho.times, "o", BLUE, "pulses"),
        (missing, "D", VERMILION, "missing, bridged"),
        (tacho.double, "X", COLORS[3], "double, left out"),
    ):
        if times.size:
            name = f"{label}: {times.size}"
            ax.plot(times, np.full(times.size, tacho.level), marker, color=color, ms=4, label=name)
    ax.set(xlabel="time, s", ylabel=f"tacho {channel.name},\nas recorded", xlim=ends)
    plain(ax)
