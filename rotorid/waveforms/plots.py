"""Pictures of records: the tacho, the orbit of two sensors, and a waterfall of spectra over time.

The mark of a turn is shown as on an oscilloscope: the curve is blank just before it and bright, a dot, at it,
so that blank to bright is the direction of time. Of a long record only what is drawn is read.
"""

from __future__ import annotations

from collections.abc import Sequence
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
LINES, MOST_TURNS, POINTS = 48, 64.0, 200
"""Spectra of a waterfall, at least, and turns within each, at most; points of the lines of orders."""


def figure_of(picture: str, record: WaveformRecord, vectors: Vectors) -> Figure:
    """Draw "tacho", "waterfall" of the first sensor, or "orbit" of the first two where their 1× is largest.

    Raises
    ------
    ValueError
        For an orbit of one sensor, and as `figure_orbit`.
    """
    tacho = vectors.tacho
    if picture == "tacho":
        assert record.tacho is not None
        return figure_tacho(record.tacho, record.rate, tacho)
    if picture == "waterfall":
        return figure_waterfall(record, tacho, sorted({1, 2, *vectors.orders}))
    if len(vectors.sensors) < 2:
        raise ValueError(f"{record.source}: an orbit needs two sensors; there is only {vectors.sensors[0]!r}")
    largest = vectors.times[np.argmax(np.linalg.norm(vectors.vectors[:, :2, 0], axis=1))]
    latest = np.interp(tacho.turns[-1] - TURNS - 1, tacho.turns, tacho.times)
    return figure_orbit(record, tacho, min(largest, latest))


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
    """Draw the orbit of the first two sensors over whole turns after a time, s, as measured and 1×.

    It is drawn as if the second sensor stood a quarter turn after the first, with the rotation.

    Raises
    ------
    ValueError
        For sensors of two quantities, and where the tacho has not so many turns.
    """
    pair = record.sensors[:2]
    names = [sensor.name for sensor in pair]
    if pair[0].derivative != pair[1].derivative:
        raise ValueError(
            f"sensors {names[0]!r} and {names[1]!r} measure different quantities: there is no orbit"
        )
    begin = float(np.ceil(np.interp(at, tacho.times, tacho.turns)))
    if begin + TURNS > tacho.turns[-1]:
        end = f"its pulses end at {tacho.times[-1]:.4g} s"
        raise ValueError(f"the tacho has not {TURNS} whole turns after {at:.4g} s: {end}")
    start, stop = np.interp([begin, begin + TURNS], tacho.turns, tacho.times)
    first, last = int(start * record.rate), int(stop * record.rate) + 2
    unit, scale = UNITS[pair[0].derivative]
    read = np.stack([sensor.samples[first:last] * (sensor.factor * scale) for sensor in pair])
    turn = tacho.turn_at(np.arange(first, last) / record.rate) - begin
    mark = np.exp(2j * np.pi * turn)
    whole = (turn >= 0) & (turn < TURNS)
    read -= read[:, whole].mean(axis=1, keepdims=True)
    x, y = 2 * (read * mark.conj())[:, whole].mean(axis=1)
    figure = new_figure(4.8, 4.8)
    orbit = figure.add_subplot()
    for label, z, color, width in (
        ("1×", np.real(np.multiply.outer((x, y), mark)), VERMILION, 2.4),
        ("as measured", read, BLUE, 0.8),
    ):
        orbit.plot(*np.where(turn % 1 > 1 - BLANK, np.nan, z), color=color, linewidth=width, label=label)
        dots = [np.interp(np.arange(TURNS), turn, part) for part in z]
        orbit.plot(*dots, "o", color=color, markersize=3 + 2 * width)
    # with the rotation and against it: x + iy = (x₁ + i y₁)/2 e^{iθ} + conj(x₁ − i y₁)/2 e^{−iθ}
    short, long = abs(x + 1j * y) - abs(x - 1j * y), abs(x + 1j * y) + abs(x - 1j * y)
    way = "forward whirl, with the rotation" if short > 0 else "backward whirl, against the rotation"
    way = "nearly along a line" if abs(short) < A_LINE * long else way
    speed = f"{60 * TURNS / (stop - start):.4g} rpm, at {start:.4g} s"
    orbit.set_title(f"{speed}\n1×: {way}, if {names[1]} stands 90° after {names[0]}", fontsize=TEXT)
    labels = [f"{name}, {unit}".rstrip(", ") for name in names]
    orbit.set(aspect="equal", xlabel=labels[0], ylabel=labels[1])
    plain(orbit)
    legend_below(figure, [orbit], 2, title="rotation anticlockwise; dot: mark, blank before it")
    return figure


def figure_waterfall(record: WaveformRecord, tacho: Tacho, orders: Sequence[float] = (1, 2)) -> Figure:
    """Draw spectra of the first sensor over time, in dB of the unit shown, and orders as lines."""
    channel, t = record.sensors[0], np.linspace(tacho.times[0], tacho.times[-1], POINTS)
    unit, scale = UNITS[channel.derivative]
    speed = np.gradient(tacho.turn_at(t), t)
    n = int(min(MOST_TURNS / speed.mean(), np.ptp(t) / LINES) * record.rate)
    figure = new_figure(5.4)
    ax = figure.add_subplot()
    samples = channel.samples * (channel.factor * scale)
    ax.specgram(
        samples - samples.mean(), NFFT=n, Fs=record.rate, noverlap=n // 2, pad_to=4 * n, mode="magnitude"
    )
    for each in orders:
        ax.plot(t, each * speed, "--", color=VERMILION, linewidth=0.9)
        ax.annotate(f"{each:g}×", (t[-1], each * speed[-1]), color=VERMILION, fontsize=TEXT)
    ax.set(ylim=(0, min((max(orders) + 1) * speed.max(), record.rate / 2)))
    ax.set(xlabel="time, s", ylabel="frequency, Hz")
    ax.set_title(f"{channel.name}: spectra of {n / record.rate:.2g} s, dB {unit}".strip(), fontsize=TEXT)
    return figure
