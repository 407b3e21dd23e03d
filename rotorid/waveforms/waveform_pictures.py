"""Pictures of waveforms: an orbit beside its waveforms, and a waterfall of spectra over speed.

The mark of a turn is shown as on an oscilloscope: the curve is blank just before it and bright, a dot, at it,
so that blank to bright is the direction of time. Of a long record only what is drawn is read.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.plot_style import BLUE, DARK, QUIET, TEXT, VERMILION, legend_below, new_figure, note, plain
from rotorid.regression import solution
from rotorid.waveforms.record import Channel, WaveformRecord
from rotorid.waveforms.tacho_picture import figure_tacho

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rotorid.waveforms.tacho import Tacho
    from rotorid.waveforms.vectors import Vectors

UNITS = {0: ("µm", 1e6), 1: ("mm/s", 1e3), 2: ("m/s²", 1.0), None: ("", 1.0)}
"""By the derivative that a sensor measures: the unit shown, and how many of it are 1 in SI."""
LOOKS = {"1×": (VERMILION, 2.4, 8.0, 2), "as measured": (BLUE, 0.8, 4.0, 4)}
"""Colour of a curve, widths of its line and its dots, and how near the front."""
TURNS, BLANK, POINTS = 4, 0.06, 200
"""Of an orbit; share of a turn before its mark; points of a curve in a turn."""
A_LINE = 0.02
"""An orbit that is narrower, of its length, has no direction."""
LINES, TALLEST, SEEN = 48, 0.3, 0.02
"""Spectra of a waterfall; its largest amplitude, of its height, and what of that must be on the axis."""
SWEPT, MOST_TURNS = 1.0, 64.0
"""Change of 1× within a spectrum of T, in units of 1/T, to which a flat top stays true to 0.3 % (of 2× to
1.1 %); and turns within it, at most."""
FLAT_TOP, FINER = 3.77, 4
"""Its noise bandwidth, in units of 1/T; steps of the frequency in that unit."""
RUN_UP = 0.05
"""Share of the speed by which it must change to be an axis."""


def figure_of(picture: str, record: WaveformRecord, found: Vectors) -> Figure:
    """Draw "tacho", "waterfall" of the first sensor, or "orbit" of the first two where their 1× is largest.

    Raises
    ------
    ValueError
        For an orbit of one sensor, and as `figure_orbit`.
    """
    tacho = found.tacho
    if picture == "tacho":
        assert record.tacho is not None
        return figure_tacho(record.tacho, record.rate, tacho)
    if picture == "waterfall":
        return figure_waterfall(record, found.sensors[0], tacho, orders=sorted({1, 2, *found.orders}))
    if len(found.sensors) < 2:
        raise ValueError(f"{record.source}: an orbit needs two sensors; there is only {found.sensors[0]!r}")
    largest = found.times[np.argmax(np.linalg.norm(found.vectors[:, :2, 0], axis=1))]
    latest = np.interp(tacho.turns[-1] - TURNS - 1, tacho.turns, tacho.times)
    return figure_orbit(record, found.sensors[:2], tacho, min(largest, latest))


def figure_orbit(
    record: WaveformRecord,
    pair: Sequence[str],
    tacho: Tacho,
    at: float,
    *,
    turns: int = TURNS,
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
        For sensors of two quantities or along one line, and where the tacho has not so many turns.
    """
    channels = [next(c for c in record.sensors if c.name == name) for name in pair]
    if channels[0].derivative != channels[1].derivative:
        raise ValueError(
            f"sensors {pair[0]!r} and {pair[1]!r} measure different quantities: there is no orbit"
        )
    looking = np.exp(1j * np.radians((0.0, 90.0) if angles is None else angles))
    if abs((looking[1] / looking[0]).imag) < A_LINE:
        raise ValueError(f"sensors {pair[0]!r} and {pair[1]!r} look along one line: there is no orbit")
    turn, read, vectors, words = _whole_turns(channels, record.rate, tacho, at, turns)
    first = np.real(vectors[:, None] * np.exp(2j * np.pi * turn))
    unit = f", {UNITS[channels[0].derivative][0]}".rstrip(", ")
    # x + iy = weights · readings, y a quarter turn after x with the rotation
    weights = np.array([1.0, 1j]) @ np.linalg.inv(np.column_stack((looking.real, looking.imag)))
    on_paper = np.conj if clockwise else np.positive
    figure, reach = new_figure(4.3), 1.1 * np.abs(read).max()
    axes = figure.subplot_mosaic([["orbit", "0"], ["orbit", "1"]], width_ratios=[7, 6])
    for label, values in zip(LOOKS, (first, read), strict=True):
        shown = POINTS + 1 if label == "1×" else turn.size
        _draw_marked(axes["orbit"], turn[:shown], on_paper(weights @ values)[:shown], label)
        for k in (0, 1):
            _draw_marked(axes[str(k)], turn, turn + 1j * values[k], label)
    for k in (0, 1):
        axes[str(k)].set(xlim=(-0.05, turns + 0.05), ylim=(-reach, reach), ylabel=pair[k] + unit)
        plain(axes[str(k)])
    axes["0"].set_title(words, fontsize=TEXT)
    axes["0"].tick_params(labelbottom=False)
    axes["1"].set_xlabel("turns")
    _draw_plane(axes["orbit"], pair, on_paper(looking), on_paper(weights @ first), clockwise=clockwise)
    way, size = _whirl(weights @ vectors, weights.conj() @ vectors)
    along = ("along 0°", f"along {270 if clockwise else 90}°")
    if angles is None:
        size = f"if {pair[1]} stands 90° after {pair[0]}; {size}"
        along = (pair[0], f"{'−' if clockwise else ''}{pair[1]}")
    axes["orbit"].set_title(f"1×: {way}\n{size}{unit.replace(',', '')}", fontsize=TEXT)
    axes["orbit"].set(xlabel=along[0] + unit, ylabel=along[1] + unit)
    said = f"angles not known: drawn as if {pair[1]} stood 90° after {pair[0]}, with the rotation"
    legend_below(figure, [axes["orbit"]], 3, title=said if angles is None else None)
    return figure


def _whole_turns(
    channels: Sequence[Channel], rate: float, tacho: Tacho, at: float, turns: int
) -> tuple[FloatArray, FloatArray, ComplexArray, str]:
    """Turns (n,) from 0, readings without their means (C, n), their 1× (C,) in the units shown; when."""
    from scipy.interpolate import CubicSpline

    begin = float(np.ceil(np.interp(at, tacho.times, tacho.turns)))
    if begin + turns > tacho.turns[-1]:
        end = f"its pulses end at {tacho.times[-1]:.4g} s"
        raise ValueError(f"the tacho has not {turns} whole turns after {at:.4g} s: {end}")
    start, stop = np.interp([begin, begin + turns], tacho.turns, tacho.times)
    first, last = max(int(start * rate) - 2, 0), int(stop * rate) + 4
    samples = [c.samples[first:last] * (c.factor * UNITS[c.derivative][1]) for c in channels]
    own = tacho.turn_at((first + np.arange(len(samples[0]))) / rate) - begin
    turn = np.linspace(0.0, turns, POINTS * turns + 1)
    read, angle = CubicSpline(own, np.stack(samples), axis=1)(turn), 2 * np.pi * turn
    K = np.column_stack((np.ones_like(turn), np.cos(angle), np.sin(angle)))
    mean, cosine, sine = solution(K[:-1], read.T[:-1])  # the last point is the first one of another turn
    words = f"{60 * turns / (stop - start):.4g} rpm, at {start:.4g} s"
    return turn, read - mean[:, None], cosine - 1j * sine, words


def _draw_marked(ax: Axes, turn: FloatArray, z: ComplexArray, label: str) -> None:
    """A curve z, blank before each whole turn, with a dot at it."""
    color, width, dot, front = LOOKS[label]
    shown = np.where((turn + 1e-9) % 1 > 1 - BLANK, np.nan, z)
    ax.plot(shown.real, shown.imag, color=color, linewidth=width, zorder=front, label=label)
    marks, label = z[::POINTS], "mark, blank before it" if label == "1×" else ""
    ax.plot(marks.real, marks.imag, "o", color=color, markersize=dot, zorder=front + 1, label=label)


def _draw_plane(
    ax: Axes, names: Sequence[str], looking: ComplexArray, ellipse: ComplexArray, *, clockwise: bool
) -> None:
    """Where sensors are, how the rotor turns, and which way its 1× whirls."""
    reach = 1.12 * float(np.abs([ax.get_xlim(), ax.get_ylim()]).max())
    ax.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
    plain(ax)
    for name, way in zip(names, 0.92 * reach * looking, strict=True):
        ax.plot([0, way.real], [0, way.imag], "--", color=QUIET, linewidth=0.8, zorder=1)
        note(ax, name, (way.real, way.imag), color=DARK, ha="center", va="center", backgroundcolor="white")
    arrow = {"arrowstyle": "-|>", "color": VERMILION, "mutation_scale": 17, "shrinkA": 0, "shrinkB": 0}
    for k in (POINTS // 4, 3 * POINTS // 4):
        (x0, y0), (x1, y1) = ((z.real, z.imag) for z in ellipse[[k, k + 3]])
        ax.annotate("", (x1, y1), (x0, y0), arrowprops=arrow, zorder=6)
    begin, end, bend = (0.04, 0.16, -0.7) if clockwise else (0.16, 0.04, 0.7)
    bent = {"arrowstyle": "-|>", "color": DARK, "connectionstyle": f"arc3,rad={bend}"}
    ax.annotate("", (end, 0.9), (begin, 0.9), "axes fraction", "axes fraction", arrowprops=bent)
    ax.text(0.1, 0.87, "rotation", color=DARK, fontsize=TEXT, ha="center", transform=ax.transAxes)


def _whirl(forward: ComplexArray, backward: ComplexArray) -> tuple[str, str]:
    """Way and size of 1× in words, of twice its parts with the rotation and against it, ()."""
    long, short = (float(np.abs(forward) + sign * np.abs(backward)) / 2 for sign in (1, -1))
    way = "forward whirl, with the rotation" if short > 0 else "backward whirl, against the rotation"
    way = "nearly along a line" if abs(short) < A_LINE * long else way
    return way, f"semi-axes {long:.3g} × {abs(short):.3g}"


def figure_waterfall(
    record: WaveformRecord, sensor: str, tacho: Tacho, *, orders: Sequence[float] = (1, 2)
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
    (unit, scale), (speed, times, n) = UNITS[channel.derivative], _instants(tacho, record.rate)
    run_up, rate = abs(speed[-1] - speed[0]) > max(0.9 * np.ptp(speed), RUN_UP * speed.max()), record.rate
    place = 60 * speed if run_up else times
    order = np.argsort(place)
    speed, place = speed[order], place[order]
    frequencies, amplitudes = spectra(channel, rate, times[order], n)
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
    step = 10.0 ** np.floor(np.log10(largest))
    bar = step * max(m for m in (1, 2, 5) if m * step <= largest)
    side, top = ax.get_yaxis_transform(), place[0] + bar * tall
    ax.plot([1.02, 1.02], [place[0], top], color=DARK, linewidth=2, transform=side, clip_on=False)
    ax.text(
        1.03, place[0], " ".join(f"{bar:g} {unit} (peak)".split()), transform=side, rotation=90, fontsize=TEXT
    )
    ax.set(xlim=(0, highest), xlabel="frequency, Hz", ylabel="speed, rpm" if run_up else "time, s")
    words = f"{LINES} spectra of {n / rate:.2g} s, {FLAT_TOP * rate / n:.2g} Hz wide (flat top)"
    ax.set_title(f"{sensor}: {words}", fontsize=TEXT, pad=16)
    plain(ax)
    return figure


def spectra(channel: Channel, rate: float, times: FloatArray, n: int) -> tuple[FloatArray, FloatArray]:
    """Frequencies (F,), Hz, and amplitudes (L, F), SI, of n samples around each time.

    The peak of a sine is its amplitude, wherever its frequency is.
    """
    from scipy.signal import periodogram

    found = []
    for time in times:
        first = int(np.clip(round(time * rate) - n // 2, 0, len(channel.samples) - n))
        samples = channel.samples[first : first + n] * channel.factor
        frequencies, power = periodogram(samples, rate, "flattop", FINER * n, scaling="spectrum")
        found.append(np.sqrt(2 * power))
    return frequencies, np.array(found)


def _instants(tacho: Tacho, rate: float) -> tuple[FloatArray, FloatArray, int]:
    """Speeds, turns a second, evenly, when they are, s, and how many samples a spectrum takes there."""
    from scipy.fft import next_fast_len

    start, stop = tacho.times[0], tacho.times[-1]
    t = np.linspace(start, stop, 10 * LINES)
    speed = np.gradient(tacho.turn_at(t), t)
    change = max(float(np.abs(np.diff(speed)).sum() / (stop - start)), 1e-12)
    T = min(MOST_TURNS / speed.mean(), (stop - start) / 4, np.sqrt(SWEPT / change))
    inside = (t >= start + T / 2) & (t <= stop - T / 2)
    way = np.cumsum(np.abs(np.gradient(speed[inside])) + 1e-4 * speed.max())
    times = np.interp(np.linspace(way[0], way[-1], LINES), way, t[inside])
    return np.interp(times, t, speed), times, next_fast_len(int(T * rate), real=True)
