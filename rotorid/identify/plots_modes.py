"""Pictures of modes and run-ups: circles and peaks around resonances, Bode and polar plots."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fem.plots import draw_polar, right_angles
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.plot_style import (
    COLORS,
    DARK,
    MARKERS,
    TEXT,
    legend_below,
    look,
    new_figure,
    on_figure,
    plain,
    rad_s_above,
)
from rotorid.base.rpm import RPM
from rotorid.base.unit_words import SPEEDS, Shown

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rotorid.identify.modes_readings import Readings
    from rotorid.identify.modes_result import FittedModes

MODES, CURVES, POINTS = 4, len(COLORS), 1000
"""Most modes and curves of a picture; points of a fitted curve."""
HIDDEN = 3.0
"""Standard deviations below which a vector has no phase to draw."""
FIT: dict[str, Any] = {"color": "black", "linewidth": 0.9, "linestyle": (0, (1, 1))}


def figure_modes(modes: FittedModes) -> Figure:
    """A row a mode: readings and fit in the complex plane, where a mode is a circle, and over frequency."""
    data, k = modes.readings, min(len(modes.ends), MODES)
    (word, scale), unit, size = SPEEDS[data.labels.speed_unit], _unit(data), data.labels.vibration_scale
    figure = new_figure(2.2 * k + 0.7)
    axes = figure.subplots(k, 2, squeeze=False, width_ratios=(2, 3))
    for mode, ((circle, peak), (low, high)) in enumerate(zip(axes, modes.ends, strict=False)):
        rows, grid = (data.speeds >= low) & (data.speeds <= high), np.linspace(low, high, POINTS)
        for p, (name, fit) in enumerate(zip(data.sensors[:CURVES], size * modes.curve(grid).T, strict=False)):
            read = size * data.vectors[rows, p]
            mark = {"ls": "", "marker": MARKERS[p], "mfc": "none", "color": COLORS[p], "ms": 5}
            circle.plot(fit.real, fit.imag, **look(p))
            circle.plot(read.real, read.imag, label=name, **mark)
            peak.plot(scale * grid, np.abs(fit), **look(p))
            peak.plot(scale * data.speeds[rows], np.abs(read), **mark)
        at = "" if modes.undetermined else f": {data.words(modes.values[0, mode])}"
        circle.set_title(f"mode {mode + 1}{at}", loc="left", fontsize=TEXT)
        circle.set(xlabel=f"real part, {unit}", ylabel=f"imaginary part, {unit}")
        circle.set_aspect("equal", adjustable="datalim")
        peak.set(xlabel=f"frequency, {word}", ylabel=f"amplitude, {unit}")
        for ax in (circle, peak):
            ax.locator_params("x", nbins=4)
            plain(ax)
    drawn = f"{k} of {len(modes.ends)} modes, at most {CURVES} points"
    legend_below(figure, axes[:1, 0], 5, title=f"hollow: readings; lines: fit ({drawn})")
    return figure


def bode_plot(sweeps: Sequence[Readings], roll: ComplexArray, fit: FittedModes | None) -> Figure:
    """Amplitude and phase over speed less the slow roll (C,), and the fit of the first sweep."""
    figure, labels = new_figure(6.6), sweeps[0].labels
    sign = labels.phase_sign
    above, below = axes = figure.subplots(2, sharex=True, height_ratios=(3, 2))
    for k, (sweep, c, name, omega, read) in enumerate(_curves(sweeps)):
        vectors = read - roll[c]
        seen = np.abs(vectors) > HIDDEN * np.nanmedian(sweep.noise[:, c])
        phase = sign * np.degrees(np.unwrap(np.angle(vectors[seen])))
        phase -= 360 * np.floor(np.median(phase) / 360) if seen.any() else 0.0
        above.plot(RPM * omega, labels.vibration_scale * np.abs(vectors), lw=1.6, label=name, **look(k))
        below.plot(RPM * omega[seen], phase, lw=1.6, **look(k))
        if fit is not None and sweep is sweeps[0]:
            model = fit.curve(omega)[:, c] - roll[c]
            turn = np.degrees(np.angle(model * vectors.conj()))[seen]
            label = f"fit, run {sweep.run}"
            above.plot(RPM * omega, labels.vibration_scale * np.abs(model), label=label, **FIT)
            below.plot(RPM * omega[seen], phase + sign * turn, **FIT)
    above.set(ylabel=f"amplitude, {_unit(sweeps[0])}", ylim=(0.0, None))
    below.set(xlabel="speed, rpm", ylabel=f"phase ({labels.phase}), degrees")
    below.yaxis.set_major_locator(right_angles(below))
    if labels.phase == "lag":
        below.invert_yaxis()  # through a critical speed the curve falls, as everywhere
    critical = [] if fit is None else RPM * fit.values[0]
    for ax in axes:
        for speed in critical:
            ax.axvline(speed, color=DARK, linewidth=0.9, linestyle=(0, (2, 2)), zorder=1)
        plain(ax)
        ax.margins(x=0.01)
    rad_s_above(above)
    words = ", ".join(f"{speed:.0f}" for speed in critical)
    title = f"less the slow roll; at most {CURVES} curves" + (f"; critical: {words} rpm" if words else "")
    legend_below(figure, (above,), 3, title=title)
    return figure


def polar_plot(sweeps: Sequence[Readings], roll: ComplexArray) -> Figure:
    """Paths of the vectors less the slow roll (C,), with speeds marked."""
    every, nothing = np.unique(np.concatenate([s.speeds for s in sweeps])), complex(np.nan, np.nan)
    labels, curves = sweeps[0].labels, _curves(sweeps)
    paths = [np.interp(every, omega, read - roll[c], nothing, nothing) for _, c, _, omega, read in curves]
    unit, marks = Shown(_unit(sweeps[0]), labels.vibration_scale), max(3, 16 // len(curves))

    def draw(ax: Axes) -> None:
        names, lag = [name for _, _, name, *_ in curves], labels.phase == "lag"
        draw_polar(every, np.transpose(paths), names, ax, marks=marks, unit=unit, lag=lag)
        ax.set_title(f"{ax.get_title()}\nless the slow roll; at most {CURVES} curves", fontsize=TEXT)

    return on_figure(draw, height=7.4, projection="polar")


def _unit(readings: Readings) -> str:
    return readings.labels.vibration_in or "no unit"


def _curves(sweeps: Sequence[Readings]) -> list[tuple[Readings, int, str, FloatArray, ComplexArray]]:
    """Sweeps and sensors to draw, with names, rising speeds, and vectors."""
    curves = []
    for sweep in sweeps:
        for c, name in enumerate(sweep.sensors):
            order = np.argsort(sweep.speeds, kind="stable")
            seen = order[~np.isnan(sweep.vectors[order, c])]
            words = f"{name}, run {sweep.run}" if len(sweeps) > 1 else name
            curves.append((sweep, c, words, sweep.speeds[seen], sweep.vectors[seen, c]))
    return curves[:CURVES]
