"""Bode and polar plots of run-ups, the slow roll taken off, as field engineers read them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fem.plots import draw_polar, right_angles
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.plot_style import (
    BOX,
    COLORS,
    DARK,
    STYLES,
    TEXT,
    legend_below,
    new_figure,
    note,
    on_figure,
    plain,
    rad_s_above,
)
from rotorid.base.rpm import RPM
from rotorid.base.text import counted
from rotorid.base.unit_words import Shown
from rotorid.harmonic.modal.run_up import SweepVectors

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rotorid.harmonic.modal.modal_result import FittedModes

HIDDEN = 3.0
"""Standard deviations below which a vector has no phase to draw."""
CURVES = len(COLORS)
"""Most curves of a picture."""
FIT_POINTS, ARROWS = 1500, 6
FIT: dict[str, Any] = {"color": "black", "linewidth": 0.9, "linestyle": (0, (1, 1))}


def bode_plot(sweeps: Sequence[SweepVectors], roll: ComplexArray, fit: FittedModes | None) -> Figure:
    """Amplitude and phase over speed less the slow roll (C,); as read, thin; the fit of the first sweep."""
    labels, (curves, words) = sweeps[0].labels, _curves(sweeps)
    figure = new_figure(6.6)
    above, below = figure.subplots(2, sharex=True, height_ratios=(3, 2))
    for k, (sweep, c, name) in enumerate(curves):
        order = np.argsort(sweep.speeds, kind="stable")
        seen = order[~np.isnan(sweep.vectors[order, c])]
        speed, raw = RPM * sweep.speeds[seen], sweep.vectors[seen, c]
        look, vector = {"color": COLORS[k], "linestyle": STYLES[k % len(STYLES)]}, raw - roll[c]
        above.plot(speed, labels.vibration_scale * np.abs(raw), color=COLORS[k], linewidth=0.6)
        above.plot(speed, labels.vibration_scale * np.abs(vector), linewidth=1.6, label=name, **look)
        sure = np.abs(vector) > HIDDEN * sweep.noise[seen, c]
        phase = _unwrapped(vector[sure], labels.phase_sign)
        below.plot(speed[sure], phase, linewidth=1.6, **look)
        if fit is not None and sweep is sweeps[0]:
            omega = np.linspace(speed[0] / RPM, speed[-1] / RPM, FIT_POINTS)
            q = fit.fit.estimate.solution
            model = fit.readings.answers.at(omega).basis(q)[0] @ fit.readings.each(2, q)[c] - roll[c]
            above.plot(RPM * omega, labels.vibration_scale * np.abs(model), **FIT)
            turned = _unwrapped(model, labels.phase_sign)
            off = np.median(np.interp(speed[sure], RPM * omega, turned) - phase) if sure.any() else 0.0
            hidden = np.abs(model) < HIDDEN * np.median(sweep.noise[seen, c])
            below.plot(RPM * omega, np.where(hidden, np.nan, turned - 360 * np.round(off / 360)), **FIT)
    if fit is not None:
        above.plot([], [], label="fit" if len(sweeps) == 1 else f"fit, run {sweeps[0].run}", **FIT)
        for omega in fit.fit.estimate.solution[: len(fit.ends)]:
            for ax in (above, below):
                ax.axvline(RPM * omega, color=DARK, linewidth=0.9, linestyle=(0, (2, 2)), zorder=1)
            place: dict[str, Any] = {
                "xycoords": ("data", "axes fraction"),
                "rotation": 90,
                "va": "top",
                "ha": "right",
            }
            note(above, f"{RPM * omega:.0f} rpm", (RPM * omega, 0.98), (-2, 0), bbox=BOX, **place)
    above.set(ylabel=f"amplitude, {labels.vibration_in or 'no unit'}")
    above.set_ylim(0.0, above.get_ylim()[1] * (1.0 if fit is None else 1.25))  # room for the words
    below.set(xlabel="speed, rpm", ylabel=f"phase ({labels.phase}), degrees")
    below.yaxis.set_major_locator(right_angles(below))
    if labels.phase == "lag":
        below.invert_yaxis()  # through a critical speed the curve falls, as everywhere
    for ax in (above, below):
        plain(ax)
        ax.margins(x=0.01)
    rad_s_above(above)
    legend_below(figure, (above,), 3, title=f"thin: as read; all else less the slow roll{words}")
    return figure


def polar_plot(sweeps: Sequence[SweepVectors], roll: ComplexArray) -> Figure:
    """Paths of the vectors less the slow roll (C,), with speeds marked.

    Several runs are drawn over each other, with arrows from the first to the others at some speeds: what the
    weights of a trial run did.
    """
    labels, (curves, words) = sweeps[0].labels, _curves(sweeps)
    every = np.unique(np.concatenate([sweep.speeds for sweep, _, _ in curves]))
    paths = np.full((len(every), len(curves)), complex(np.nan, np.nan))
    for k, (sweep, c, _) in enumerate(curves):
        order = np.argsort(sweep.speeds, kind="stable")
        seen = order[~np.isnan(sweep.vectors[order, c])]
        nothing = complex(np.nan, np.nan)
        paths[:, k] = np.interp(every, sweep.speeds[seen], sweep.vectors[seen, c] - roll[c], nothing, nothing)
    unit = Shown(labels.vibration_in or "no unit", labels.vibration_scale)
    names, marks = [name for *_, name in curves], max(3, 16 // len(curves))

    def draw(ax: Axes) -> None:
        draw_polar(every, paths, names, ax, marks=marks, unit=unit, lag=labels.phase == "lag")
        trial = _draw_trial_vectors(ax, every, np.asarray(paths * unit.scale, dtype=complex), curves)
        ax.set_title(f"{ax.get_title()}\nless the slow roll{words}{trial}", fontsize=TEXT)

    return on_figure(draw, height=7.4, projection="polar")


def _draw_trial_vectors(
    ax: Axes, speeds: FloatArray, paths: ComplexArray, curves: Sequence[tuple[SweepVectors, int, str]]
) -> str:
    """Arrows from the curves of the first run to those of the same sensor in others; what they are, in
    words.
    """
    drawn = False
    first = {sweep.sensors[c]: k for k, (sweep, c, _) in enumerate(curves) if sweep is curves[0][0]}
    for k, (sweep, c, _) in enumerate(curves):
        own = first.get(sweep.sensors[c], k)
        both = np.flatnonzero(~np.isnan(paths[:, k] + paths[:, own]))
        if own == k or not both.size:
            continue
        for speed in np.linspace(speeds[both[0]], speeds[both[-1]], ARROWS + 2)[1:-1]:
            ends = [complex(np.interp(speed, speeds[both], paths[both, each])) for each in (own, k)]
            start, end = ((float(np.angle(z)), abs(z)) for z in ends)
            ax.annotate("", end, start, arrowprops={"arrowstyle": "->", "color": DARK, "linewidth": 0.9})
            drawn = True
    return "; arrows: from the first run to another at one speed" if drawn else ""


def _curves(sweeps: Sequence[SweepVectors]) -> tuple[list[tuple[SweepVectors, int, str]], str]:
    """Sweeps and sensors to draw, with their names, and words about those that are not."""
    every = [
        (sweep, sweeps[0].sensors.index(name), f"{name}, run {sweep.run}" if len(sweeps) > 1 else name)
        for sweep in sweeps
        for name in sweep.sensors
        if name in sweeps[0].sensors
    ]
    left = len(every) - CURVES
    return every[:CURVES], f"; {counted(left, 'more curve')}: not drawn" if left > 0 else ""


def _unwrapped(vectors: ComplexArray, sign: int) -> FloatArray:
    """Phases as the table counts them, degrees, without jumps, the middle of the curve near 0 … 360."""
    if not len(vectors):
        return np.zeros(0)
    phase = sign * np.degrees(np.unwrap(np.angle(vectors)))
    return np.asarray(phase - 360 * np.floor(np.median(phase) / 360))
