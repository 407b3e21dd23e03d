"""Pictures of records: the tacho, and the orbit of two sensors.

The mark of a turn is shown as on an oscilloscope: the curve is blank just before it and bright, a dot, at it,
so that blank to bright is the direction of time. Of a long record only what is drawn is read.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.plot_style import BLUE, COLORS, QUIET, TEXT, VERMILION, legend_below, new_figure, plain
from rotorid.waveforms.record import Channel, WaveformRecord

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rotorid.waveforms.tacho import Tacho
    from rotorid.waveforms.vectors import Vectors

UNITS = {0: ("µm", 1e6), 1: ("mm/s", 1e3), 2: ("m/s²", 1.0), None: ("", 1.0)}
"""By the derivative that a sensor measures: the unit shown, and how many of it are 1 in SI."""
TURNS, BLANK = 4, 0.06
"""Drawn of a tacho or an orbit; share of a turn before its mark."""
A_LINE = 0.02
"""An orbit that is narrower, of its length, has no direction."""


def figure_of(picture: str, record: WaveformRecord, vectors: Vectors) -> Figure:
    """Draw "tacho", or "orbit" of the first two where their 1× is largest.

    Raises
    ------
    ValueError
        For an orbit of one sensor, or of two quantities.
    """
    tacho = vectors.tacho
    if picture == "tacho":
        assert record.tacho is not None
        return figure_tacho(record.tacho, record.rate, tacho)
    if len(vectors.sensors) < 2:
        raise ValueError(f"{record.source}: an orbit needs two sensors; there is only {vectors.sensors[0]!r}")
    largest = vectors.times[np.argmax(np.linalg.norm(vectors.vectors[:, :2, 0], axis=1))]
    return figure_orbit(record, tacho, largest)


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


def figure_orbit(record: WaveformRecord, tacho: Tacho, at: float) -> Figure:
    """Draw the orbit of the first two sensors over whole turns after a time, s, or the last ones.

    As measured and 1×, as if the second sensor stood a quarter turn after the first, with the rotation.
    ValueError for sensors of two quantities.
    """
    pair = record.sensors[:2]
    names = [sensor.name for sensor in pair]
    if pair[0].derivative != pair[1].derivative:
        raise ValueError(
            f"sensors {names[0]!r} and {names[1]!r} measure different quantities: there is no orbit"
        )
    after, latest = np.ceil(np.interp([tacho.times[0], at], tacho.times, tacho.turns)), tacho.turns[-1] // 1
    begin = float(max(after[0], min(after[1], latest - TURNS)))
    turns = int(min(TURNS, latest - begin))
    start, stop = np.interp([begin, begin + turns], tacho.turns, tacho.times)
    first, last = int(start * record.rate), int(stop * record.rate) + 2
    unit, scale = UNITS[pair[0].derivative]
    read = np.stack([sensor.samples[first:last] * (sensor.factor * scale) for sensor in pair])
    turn = tacho.turn_at(np.arange(first, last) / record.rate) - begin
    mark = np.exp(2j * np.pi * turn)
    whole = (turn >= 0) & (turn < turns)
    read -= read[:, whole].mean(axis=1, keepdims=True)
    x, y = 2 * (read * mark.conj())[:, whole].mean(axis=1)
    figure = new_figure(4.8, 4.8)
    orbit = figure.add_subplot()
    for label, z, color, width in (
        ("1×", np.real(np.multiply.outer((x, y), mark)), VERMILION, 2.4),
        ("as measured", read, BLUE, 0.8),
    ):
        orbit.plot(*np.where(turn % 1 > 1 - BLANK, np.nan, z), color=color, linewidth=width, label=label)
        dots = [np.interp(np.arange(turns), turn, part) for part in z]
        orbit.plot(*dots, "o", color=color, markersize=3 + 2 * width)
    # with the rotation and against it: x + iy = (x₁ + i y₁)/2 e^{iθ} + conj(x₁ − i y₁)/2 e^{−iθ}
    short, long = abs(x + 1j * y) - abs(x - 1j * y), abs(x + 1j * y) + abs(x - 1j * y)
    way = "forward whirl, with the rotation" if short > 0 else "backward whirl, against the rotation"
    way = "nearly along a line" if abs(short) < A_LINE * long else way
    speed = f"{60 * turns / (stop - start):.4g} rpm, at {start:.4g} s"
    orbit.set_title(f"{speed}\n1×: {way}, if {names[1]} stands 90° after {names[0]}", fontsize=TEXT)
    labels = [f"{name}, {unit}".rstrip(", ") for name in names]
    orbit.set(aspect="equal", xlabel=labels[0], ylabel=labels[1])
    plain(orbit)
    legend_below(figure, [orbit], 2, title="rotation anticlockwise; dot: mark, blank before it")
    return figure
