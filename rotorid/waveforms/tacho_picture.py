"""Picture of a tacho: its signal with what was found, its speed with damaged pulses, jitter of the pulses."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.plot_style import (
    BLUE,
    COLORS,
    DARK,
    QUIET,
    TEXT,
    VERMILION,
    legend_below,
    new_figure,
    plain,
)
from rotorid.waveforms.record import Channel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rotorid.waveforms.tacho import Tacho


def figure_tacho(channel: Channel, rate: float, tacho: Tacho, *, turns: float = 4.0) -> Figure:
    """Draw what was found in a tacho's signal.

    Parameters
    ----------
    channel, rate
        Its signal, samples a second.
    tacho
        What was found.
    turns
        So many of the signal are drawn, around the first pulse that is missing or double, else in the middle.
    """
    begin = tacho.turns[0]
    missing = np.interp(tacho.missing, tacho.turns, tacho.times)
    damaged = np.sort(np.concatenate((missing, tacho.double)))
    centre = damaged[0] if damaged.size else tacho.times[len(tacho.times) // 2]
    middle = float(np.interp(centre, tacho.times, tacho.turns))
    ends = np.interp([middle - turns / 2, middle + turns / 2], tacho.turns, tacho.times)
    first, last = int(ends[0] * rate), int(ends[1] * rate) + 1
    figure = new_figure(6.4)
    axes = figure.subplot_mosaic([["signal"] * 2, ["speed"] * 2, ["jitter", "count"]], width_ratios=[5, 1])
    ax = axes["signal"]
    ax.plot(np.arange(first, last) / rate, channel.samples[first:last], color=QUIET, linewidth=0.9)
    ax.axhline(tacho.level, color=DARK, linestyle="--", linewidth=0.8)
    band = (tacho.level - tacho.hysteresis, tacho.level + tacho.hysteresis)
    ax.axhspan(*band, color=BLUE, alpha=0.12, linewidth=0)
    kinds = (
        (tacho.times, "o", BLUE, "pulses"),
        (missing, "D", VERMILION, f"missing, bridged: {missing.size}"),
        (tacho.double, "X", COLORS[3], f"double, left out: {tacho.double.size}"),
    )
    between = (tacho.times[1:] + tacho.times[:-1]) / 2
    rpm = 60 * np.diff(tacho.turns) / np.diff(tacho.times)
    axes["speed"].plot(between, rpm, color=BLUE, linewidth=0.9)
    for times, marker, color, label in kinds:
        look: dict[str, Any] = {"linestyle": "", "marker": marker, "color": color, "markersize": 6}
        near = times[(times >= ends[0]) & (times <= ends[1])]
        ax.plot(near, np.full(near.size, tacho.level), label=label, **look)
        if marker != "o":
            axes["speed"].plot(times, np.interp(times, between, rpm), **look)
    late = 360 * (tacho.turn_at(tacho.times) - tacho.turns)
    axes["jitter"].plot(tacho.times, late, ".", color=BLUE, markersize=2, rasterized=True)
    axes["count"].hist(late, 40, orientation="horizontal", color=BLUE)
    axes["count"].sharey(axes["jitter"])
    axes["count"].tick_params(labelleft=False)
    axes["count"].set_xlabel("pulses")
    ax.set(xlabel="time, s", ylabel=f"{channel.name}, as recorded", xlim=ends)
    ax.set_title(f"around turn {middle - begin:.0f}", fontsize=TEXT)
    axes["speed"].set(xlabel="time, s", ylabel="speed, rpm")
    axes["jitter"].set(xlabel="time, s", ylabel="pulse, ° late")
    axes["jitter"].set_title(f"jitter {tacho.jitter_deg:.2g}° (standard deviation of a pulse)", fontsize=TEXT)
    for each in axes.values():
        plain(each)
    legend_below(figure, [ax], 3)
    return figure
