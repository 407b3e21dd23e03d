"""Pictures of records: the tacho, the orbit of two sensors, and a waterfall of spectra over speed.

The mark of a turn is shown as on an oscilloscope: the curve is blank just before it and bright, a dot, at it,
so that blank to bright is the direction of time. Of a long record only what is drawn is read.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.plot_style import (
    BLUE,
    COLORS,
    QUIET,
    TEXT,
    VERMILION,
    legend_below,
    new_figure,
    plain,
)
from rotorid.waveforms.record import Channel, WaveformRecord

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rotorid.waveforms.tacho import Tacho
    from rotorid.waveforms.vectors import Vectors

UNITS = {0: ("µm", 1e6), 1: ("mm/s", 1e3), 2: ("m/s²", 1.0), None: ("", 1.0)}
"""By the derivative that a sensor measures: the unit shown, and how many of it are 1 in SI."""
TURNS, BLANK, POINTS = 4, 0.06, 200
"""Drawn of a tacho or an orbit; share of a turn before its mark; points of a curve in a turn."""
A_LINE = 0.02
"""An orbit that is narrower, of its length, has no direction."""
LINES, TALLEST, SEEN = 48, 0.3, 0.02
"""Spectra of a waterfall; its largest amplitude, of its height, and what of that must be on the axis."""
SWEPT, MOST_TURNS = 1.0, 64.0
"""Change of 1× within a spectrum of T, in units of 1/T, to which a flat top stays true to 0.3 % (of 2× to
1.1 %); and turns within it, at most."""
FINER = 4
"""Steps of the frequency in 1/T."""
RUN_UP = 0.05
"""Share of the speed by which it must change to be an axis."""


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
        return figure_waterfall(record, vectors.sensors[0], tacho, sorted({1, 2, *vectors.orders}))
    if len(vectors.sensors) < 2:
        raise ValueError(f"{record.source}: an orbit needs two sensors; there is only {vectors.sensors[0]!r}")
    largest = vectors.times[np.argmax(np.linalg.norm(vectors.vectors[:, :2, 0], axis=1))]
    latest = np.interp(tacho.turns[-1] - TURNS - 1, tacho.turns, tacho.times)
    return figure_orbit(record, vectors.sensors[:2], tacho, min(largest, latest))


def figure_tacho(channel: Channel, rate: float, tacho: Tacho) -> Figure:
    """Draw a tacho's signal around its first damaged pulse, else in the middle, and its speed."""
    missing = np.interp(tacho.missing, tacho.turns, tacho.times)
    damaged = np.sort(np.concatenate((missing, tacho.double)))
    centre = damaged[0] if damaged.size else tacho.times[len(tacho.times) // 2]
    middle = float(np.interp(centre, tacho.times, tacho.turns))
    ends = np.interp([middle - TURNS / 2, middle + TURNS / 2], tacho.turns, tacho.times)
    first, last = int(ends[0] * rate), int(ends[1] * rate) + 1
    figure = new_figure(4.6)
    signal, speed = figure.subplots(2)
    signal.plot(np.arange(first, last) / rate, channel.samples[first:last], color=QUIET, linewidth=0.9)
    signal.axhspan(tacho.level - tacho.hysteresis, tacho.level + tacho.hysteresis, color=BLUE, alpha=0.12)
    between = (tacho.times[1:] + tacho.times[:-1]) / 2
    rpm = 60 * np.diff(tacho.turns) / np.diff(tacho.times)
    speed.plot(between, rpm, color=BLUE, linewidth=0.9)
    for times, marker, color, label in (
        (tacho.times, "o", BLUE, "pulses"),
        (missing, "D", VERMILION, f"missing, bridged: {missing.size}"),
        (tacho.double, "X", COLORS[3], f"double, left out: {tacho.double.size}"),
    ):
        signal.plot(times, np.full(times.size, tacho.level), marker, color=color, label=label)
        if marker != "o":
            speed.plot(times, np.interp(times, between, rpm), marker, color=color)
    signal.set(ylabel=f"{channel.name}, as recorded", xlim=ends)
    signal.set_title(f"jitter {tacho.jitter_deg:.2g}° (standard deviation of a pulse)", fontsize=TEXT)
    speed.set(xlabel="time, s", ylabel="speed, rpm")
    plain(signal)
    plain(speed)
    legend_below(figure, [signal], 3)
    return figure


def figure_orbit(
    record: WaveformRecord, pair: Sequence[str], tacho: Tacho, at: float, turns: int = TURNS
) -> Figure:
    """Draw the orbit of two sensors over whole turns, as measured and 1×, over each other.

    It is drawn as if the second sensor stood a quarter turn after the first, with the rotation.

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

    Raises
    ------
    ValueError
        For sensors of two quantities, and where the tacho has not so many turns.
    """
    from scipy.interpolate import CubicSpline

    channels = [next(c for c in record.sensors if c.name == name) for name in pair]
    if channels[0].derivative != channels[1].derivative:
        raise ValueError(
            f"sensors {pair[0]!r} and {pair[1]!r} measure different quantities: there is no orbit"
        )
    begin = float(np.ceil(np.interp(at, tacho.times, tacho.turns)))
    if begin + turns > tacho.turns[-1]:
        end = f"its pulses end at {tacho.times[-1]:.4g} s"
        raise ValueError(f"the tacho has not {turns} whole turns after {at:.4g} s: {end}")
    start, stop = np.interp([begin, begin + turns], tacho.turns, tacho.times)
    first, last = max(int(start * record.rate) - 2, 0), int(stop * record.rate) + 4
    unit, scale = UNITS[channels[0].derivative]
    samples = np.stack([c.samples[first:last] * (c.factor * scale) for c in channels])
    places = tacho.turn_at((first + np.arange(samples.shape[1])) / record.rate) - begin
    turn = np.linspace(0.0, turns, POINTS * turns + 1)
    read, mark = CubicSpline(places, samples, axis=1)(turn), np.exp(2j * np.pi * turn)
    read -= read[:, :-1].mean(axis=1, keepdims=True)  # the last point is the first one of another turn
    x, y = 2 * (read[:, :-1] * mark[:-1].conj()).mean(axis=1)
    once = np.real(np.multiply.outer((x, y), mark))
    figure = new_figure(4.8, 4.8)
    orbit = figure.add_subplot()
    for label, z, color, width in (("1×", once, VERMILION, 2.4), ("as measured", read, BLUE, 0.8)):
        shown = z[:, : POINTS + 1] if label == "1×" else z
        blank = np.where((turn[: shown.shape[1]] + 1e-9) % 1 > 1 - BLANK, np.nan, shown)
        orbit.plot(*blank, color=color, linewidth=width, label=label)
        mark = "mark, blank before it" if label == "1×" else ""
        orbit.plot(*shown[:, ::POINTS], "o", color=color, markersize=3 + 2 * width, label=mark)
    # with the rotation and against it: x + iy = (x₁ + i y₁)/2 e^{iθ} + conj(x₁ − i y₁)/2 e^{−iθ}
    short, long = abs(x + 1j * y) - abs(x - 1j * y), abs(x + 1j * y) + abs(x - 1j * y)
    way = "forward whirl, with the rotation" if short > 0 else "backward whirl, against the rotation"
    way = "nearly along a line" if abs(short) < A_LINE * long else way
    speed = f"{60 * turns / (stop - start):.4g} rpm, at {start:.4g} s"
    orbit.set_title(f"{speed}\n1×: {way}, if {pair[1]} stands 90° after {pair[0]}", fontsize=TEXT)
    orbit.set(
        aspect="equal", xlabel=f"{pair[0]}, {unit}".rstrip(", "), ylabel=f"{pair[1]}, {unit}".rstrip(", ")
    )
    plain(orbit)
    legend_below(figure, [orbit], 3, title="rotation anticlockwise")
    return figure


def figure_waterfall(
    record: WaveformRecord, sensor: str, tacho: Tacho, orders: Sequence[float] = (1, 2)
) -> Figure:
    """Draw spectra of a sensor above each other: over speed, or time where that is steady or turns back.

    Parameters
    ----------
    record, tacho
        One run.
    sensor
        Its name.
    orders
        Drawn as lines.
    """
    channel = next(c for c in record.sensors if c.name == sensor)
    (unit, scale), (speed, times, n), rate = (
        UNITS[channel.derivative],
        _instants(tacho, record.rate),
        record.rate,
    )
    run_up = abs(speed[-1] - speed[0]) > max(0.9 * np.ptp(speed), RUN_UP * speed.max())
    order = np.argsort(speed if run_up else times)
    speed, times = speed[order], times[order]
    place = 60 * speed if run_up else times
    frequencies, amplitudes = spectra(channel, rate, times, n)
    largest = scale * float(amplitudes.max()) or 1.0
    tall, seen = TALLEST * np.ptp(place) / largest, scale * amplitudes.max(axis=0) > SEEN * largest
    highest = min(max(1.15 * frequencies[seen].max(initial=0.0), (max(orders) + 0.5) * speed.max()), rate / 2)
    x, lines = frequencies[frequencies <= highest], scale * tall * amplitudes[:, frequencies <= highest]
    figure = new_figure(5.4)
    ax = figure.add_subplot()
    for k, (base, line) in enumerate(zip(place, lines, strict=True)):
        ax.fill_between(x, base, base + line, color="white", linewidth=0, zorder=3 - k / LINES)
        ax.plot(x, base + line, color=BLUE, linewidth=0.8, zorder=3 - k / LINES)
    for each in orders:
        ax.plot(each * speed, place, "--", color=VERMILION, linewidth=0.9, zorder=4)
        if each * speed[-1] <= highest:
            text = ax.text(each * speed[-1], 1.0, f"{each:g}×", transform=ax.get_xaxis_transform())
            text.set(color=VERMILION, ha="center", va="bottom", fontsize=TEXT)
    ax.set(xlim=(0, highest), xlabel="frequency, Hz", ylabel="speed, rpm" if run_up else "time, s")
    size = f"largest {largest:.3g} {unit} (peak)".replace("  ", " ")
    ax.set_title(f"{sensor}: {LINES} spectra of {n / rate:.2g} s; {size}", fontsize=TEXT, pad=16)
    plain(ax)
    return figure


def spectra(channel: Channel, rate: float, times: FloatArray, n: int) -> tuple[FloatArray, FloatArray]:
    """Frequencies (F,), Hz, and amplitudes (L, F), SI, of n samples around each time.

    The peak of a sine is its amplitude, wherever its frequency is.
    """
    from scipy.signal import periodogram

    rows = []
    for time in times:
        first = int(np.clip(round(time * rate) - n // 2, 0, len(channel.samples) - n))
        samples = channel.samples[first : first + n] * channel.factor
        frequencies, power = periodogram(samples, rate, "flattop", FINER * n, scaling="spectrum")
        rows.append(np.sqrt(2 * power))
    return frequencies, np.array(rows)


def _instants(tacho: Tacho, rate: float) -> tuple[FloatArray, FloatArray, int]:
    """Speeds, turns a second, when they are, s, evenly, and how many samples a spectrum takes there."""
    from scipy.fft import next_fast_len

    start, stop = tacho.times[0], tacho.times[-1]
    t = np.linspace(start, stop, 10 * LINES)
    speed = np.gradient(tacho.turn_at(t), t)
    change = max(float(np.abs(np.diff(speed)).sum() / (stop - start)), 1e-12)
    T = min(MOST_TURNS / speed.mean(), (stop - start) / 4, np.sqrt(SWEPT / change))
    times = np.linspace(start + T / 2, stop - T / 2, LINES)
    return np.interp(times, t, speed), times, next_fast_len(int(T * rate), real=True)
