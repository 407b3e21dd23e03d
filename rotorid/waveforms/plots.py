"""Picture of a record: its tacho. Of a long one only what is drawn is read."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.plot_style import BLUE, COLORS, QUIET, TEXT, VERMILION, legend_below, new_figure, plain
from rotorid.waveforms.record import Channel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rotorid.waveforms.tacho import Tacho

TURNS = 4
"""Drawn of a tacho."""


def figure_tacho(channel: Channel, rate: float, tacho: Tacho) -> Figure:
    """Draw a tacho's signal around its first damaged pulse, else in the middle, and its speed."""
    missing = np.interp(tacho.missing, tacho.turns, tacho.times)
    damaged = np.sort(np.concatenate((missing, tacho.double)))
    centre = damaged[0] if damaged.size else tacho.times[len(tacho.times) // 2]
    middle = np.interp(centre, tacho.times, tacho.turns)
    ends = np.interp([middle - TURNS / 2, middle + TURNS / 2], tacho.turns, tacho.times)
    first, last = int(ends[0] * rate), int(ends[1] * rate) + 1
    figure = new_figure(4.6)
    signal, speed = figure.subplots(2)
    signal.plot(np.arange(first, last) / rate, channel.samples[first:last], color=QUIET, linewidth=0.9)
    signal.axhspan(tacho.level - tacho.hysteresis, tacho.level + tacho.hysteresis, color=BLUE, alpha=0.12)
    for times, marker, color, label in (
        (tacho.times, "o", BLUE, "pulses"),
        (missing, "D", VERMILION, f"missing, bridged: {missing.size}"),
        (tacho.double, "X", COLORS[3], f"double, left out: {tacho.double.size}"),
    ):
        signal.plot(times, np.full(times.size, tacho.level), marker, color=color, label=label)
    between = (tacho.times[1:] + tacho.times[:-1]) / 2
    speed.plot(between, 60 * np.diff(tacho.turns) / np.diff(tacho.times), color=BLUE, linewidth=0.9)
    signal.set(ylabel=f"{channel.name}, as recorded", xlim=ends)
    signal.set_title(f"jitter {tacho.jitter_deg:.2g}° (standard deviation of a pulse)", fontsize=TEXT)
    speed.set(xlabel="time, s", ylabel="speed, rpm")
    plain(signal)
    plain(speed)
    legend_below(figure, [signal], 3)
    return figure
