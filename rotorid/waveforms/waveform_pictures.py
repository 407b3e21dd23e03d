"""Pictures of waveforms: an orbit beside its waveforms, and a waterfall of spectra over speed.

The mark of a turn is shown as on an oscilloscope: the curve is blank just before it and bright, a dot, at it, so
that blank to bright is the direction of time. Of a long record only what is drawn is read.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.plot_style import (
    BLUE,
    BOX,
    DARK,
    QUIET,
    TEXT,
    VERMILION,
    legend_below,
    new_figure,
    note,
    plain,
)
from rotorid.base.text import figures
from rotorid.regression import solution
from rotorid.waveforms.record import Channel, WaveformRecord

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rotorid.waveforms.tacho import Tacho

UNITS = {0: ("µm", 1e6), 1: ("mm/s", 1e3), 2: ("m/s²", 1.0), None: ("", 1.0)}
"""By the derivative that a sensor measures: the unit shown, and how many of it are 1 in SI."""
BLANK, POINTS = 0.06, 200
"""Of a turn, before its mark; of a curve in a turn."""
A_LINE = 0.02
"""An orbit that is narrower, of its length, has no direction."""
LINES, TALLEST = 48, 0.22
"""Spectra of a waterfall; its largest amplitude, of its height."""
RUN_UP = 0.05
"""Share of the speed by which it must change to be an axis."""
SWEPT, MOST_TURNS = 1.0, 64.0
"""Change of 1× within a spectrum, in units of 1/T, to which a flat top stays true to 0.3 % (of 2× to 1.1 %); and
turns within it, at most."""
FLAT_TOP = 3.77
"""Its noise bandwidth, in units of 1/T."""
SEEN = 0.02
"""Of the largest amplitude: what must be on the axis of frequencies."""


def figure_orbit(
    record: WaveformRecord,
    pair: tuple[str, str],
    tacho: Tacho,
    at: float,
    *,
    turns: int = 4,
    angles: tuple[float, float] | None = None,
    clockwise: bool = False,
) -> Figure:
    """Draw the orbit of two sensors over whole turns, as measured and 1×, beside their waveforms.

    Parameters
    ----------
    record, tacho
        One run.
    pair
        Names of its sensors.
    at
        s; the first turn that begins after it is the first one drawn.
    turns
        How many.
    angles
        Of the sensors, degrees with the rotation; None: the second is a quarter turn after the first.
    clockwise
        Whether the rotor turns clockwise on paper.

    Raises
    ------
    ValueError
        For sensors that look along one line, and where the tacho has not so many turns.
    """
    channels = [_channel(record, name) for name in pair]
    looking = np.exp(1j * np.radians((0.0, 90.0) if angles is None else angles))
    if abs((looking[1] / looking[0]).imag) < A_LINE:
        raise ValueError(f"sensors {pair[0]!r} and {pair[1]!r} look along one line: there is no orbit")
    turn, read, vectors, words = _whole_turns(channels, record.rate, tacho, at, turns)
    first = np.real(vectors[:, None] * np.exp(2j * np.pi * turn))
    figure, unit = new_figure(4.4), UNITS[channels[0].derivative][0]
    axes = figure.subplot_mosaic([["orbit", "0"], ["orbit", "1"]], width_ratios=[7, 6])
    for k, name in enumerate(pair):
        _draw_marked(axes[str(k)], turn, turn + 1j * read[k], "as measured")
        _draw_marked(axes[str(k)], turn, turn + 1j * first[k], "1×")
        axes[str(k)].set_ylabel(f"{name}, {unit}".rstrip(", "))
        plain(axes[str(k)])
    axes["0"].sharex(axes["1"])
    axes["0"].tick_params(labelbottom=False)
    axes["0"].set_title(words, fontsize=TEXT)
    axes["1"].set_xlabel("turns")
    in_plane = np.linalg.inv(np.column_stack((looking.real, looking.imag)))
    ax, up = axes["orbit"], -1j if clockwise else 1j
    _draw_plane(ax, pair, looking.real + up * looking.imag, up)
    for (x, y), label, n in ((in_plane @ read, "as measured", turn.size), (in_plane @ first, "1×", POINTS + 1)):
        _draw_marked(ax, turn[:n], (x + up * y)[:n], label)
    third = [(x + up * y)[[POINTS // 3, POINTS // 3 + 4]] for x, y in [in_plane @ first]][0]
    ends = [(float(z.real), float(z.imag)) for z in third]
    ax.annotate("", ends[1], ends[0], arrowprops={"arrowstyle": "-|>", "color": VERMILION, "mutation_scale": 18})
    ax.set_title(_whirl(*(in_plane @ vectors), unit), fontsize=TEXT)
    named = pair if angles is not None else pair
    ax.set(xlabel=f"{named[0]}", ylabel="")
    legend_below(figure, [ax], 3)
    return figure
