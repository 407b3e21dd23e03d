"""Pictures of identifications, modes and run-ups. Nothing is shown or saved."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.plot_style import (
    COLORS,
    DARK,
    MARKERS,
    TEXT,
    legend_below,
    look,
    new_figure,
    note,
    plain,
)
from rotorid.base.text import RPM, SPEEDS, Shown
from rotorid.identify.amplitudes import real_matrices

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rotorid.identify.modes_result import FittedModes, Readings
    from rotorid.identify.result import Identification

POINTS, CURVES, NAMES = 1000, len(COLORS), 12
"""Of a curve; most curves of a sweep, outputs in a legend."""
MODEL_UNIT = Shown("unit of the data")
"""Of amplitudes whose columns name no unit."""


def figure_identification(result: Identification) -> Figure:
    """Amplitudes, on axes by their unit, and phases, with two standard deviations, and those of the model."""
    data = result.experiments
    units = {name: data.units.get(name, MODEL_UNIT) for name in result.model.outputs}
    panels, (grid, curves) = [*dict.fromkeys(units.values())], _curve(result)
    figure = new_figure(2.5 + 2.4 * len(panels))
    axes = figure.subplots(len(panels) + 1, sharex=True, height_ratios=[*[2.4] * len(panels), 1.6])
    w, x, phases = data.axis.scale * data.frequencies, data.axis.scale * grid, axes[-1]
    for j, (name, unit) in enumerate(units.items()):
        z, ax = data.table([name])[:, 0], axes[panels.index(unit)]
        turn = real_matrices(np.exp(-1j * np.angle(z)))
        std = 2 * np.sqrt(np.einsum("nai,nij,naj->an", turn, data.covariance(name), turn))
        bars = (unit.scale * std[0], np.degrees(std[1] / np.abs(z))) if data.stated else (None, None)
        mark = _mark(j, name if j < NAMES else "")
        ax.errorbar(w, unit.scale * np.abs(z), bars[0], **mark)
        phases.errorbar(w, _degrees(z), bars[1], **mark)
        if name in curves:
            line, phase = look(j), _degrees(curves[name])
            if grid.size > w.size:
                phase = _broken(phase)
            else:
                line |= {"marker": "x", "linestyle": ""}
            ax.plot(x, unit.scale * np.abs(curves[name]), **line)
            phases.plot(x, phase, **line)
        ax.set_ylabel(f"amplitude, {unit.word}")
    for ax in axes:
        plain(ax)
        ax.set_ylim(bottom=-0.04 * ax.get_ylim()[1])  # a mark at 0 stands above the axis
    phases.set(xlabel=data.axis.word, ylabel="phase lead, °", ylim=(-205, 205), yticks=range(-180, 181, 90))
    figure.align_ylabels(axes)
    words = f"points: measured{' ± 2σ' if data.stated else ''}; lines or crosses: model"
    legend_below(figure, axes, 4, title=words)
    return figure


def _degrees(z: ComplexArray) -> FloatArray:
    return np.where(z == 0, np.nan, np.degrees(np.angle(z)))


def _broken(phase: FloatArray) -> FloatArray:
    """Degrees of a curve with a gap where they begin anew."""
    return np.where(np.abs(np.diff(phase, prepend=phase[:1])) > 180, np.nan, phase)


def _mark(j: int, label: str) -> dict[str, Any]:
    """Points, open, so that equal ones are seen."""
    return {
        **look(j),
        "linestyle": "",
        "marker": MARKERS[j % len(MARKERS)],
        "mfc": "none",
        "ms": 6,
        "label": label,
    }


def _curve(result: Identification) -> tuple[FloatArray, Mapping[str, ComplexArray]]:
    """Predicted amplitudes over the measured range, where one excitation belongs to it."""
    model, data = result.model, result.experiments
    w, inputs = data.frequencies, data.table(model.inputs)
    if (
        result.predicted
        and not (model.varying or data.free.any())
        and np.allclose(inputs, inputs[0], 1e-9, 0)
    ):
        # what is measured may lie at a peak: the line passes exactly there
        grid = np.unique(np.concatenate((np.linspace(w.min(), w.max(), POINTS), w)))
        with suppress(np.linalg.LinAlgError):
            return grid, model.predict(result.theta, grid, dict(zip(model.inputs, inputs[0], strict=True)))
    return w, result.predicted


def figure_modes(modes: FittedModes) -> Figure:
    """A row a mode: readings and fit in the complex plane, where a mode is a circle, and over frequency."""
    data, labels, k = modes.readings, modes.readings.labels, len(modes.ends)
    (word, scale), size = SPEEDS[labels.speed_unit], labels.vibration_scale
    unit = labels.vibration_in or "no unit"
    figure = new_figure(2.2 * k + 0.7)
    axes = figure.subplots(k, 2, squeeze=False, width_ratios=(2, 3))
    for mode, ((circle, peak), (low, high)) in enumerate(zip(axes, modes.ends, strict=False)):
        rows, grid = (data.speeds >= low) & (data.speeds <= high), np.linspace(low, high, POINTS)
        fits, w = size * modes.curve(grid), scale * data.speeds[rows]
        for p, name in enumerate(data.sensors[:CURVES]):
            read, fit, mark = size * data.vectors[rows, p], fits[:, p], _mark(p, name)
            circle.plot(fit.real, fit.imag, **look(p))
            circle.plot(read.real, read.imag, **mark)
            peak.plot(scale * grid, np.abs(fit), **look(p))
            peak.plot(w, np.abs(read), **mark)
        omega, damping = modes.values[:2, mode]
        at = "" if modes.undetermined else f": {labels.speed_words(omega)}, ζ {100 * damping:.3g} %"
        circle.set_title(f"mode {mode + 1}{at}", loc="left", fontsize=TEXT)
        circle.set(xlabel=f"real part, {unit}", ylabel=f"imaginary part, {unit}")
        circle.set_aspect("equal", adjustable="datalim")
        peak.set(xlabel=f"frequency, {word}", ylabel=f"amplitude, {unit}")
        for ax in (circle, peak):
            ax.locator_params("x", nbins=4)
            plain(ax)
    legend_below(figure, axes[:1, 0], 5, title=f"hollow: readings; lines: fit, {CURVES} points at most")
    return figure


def bode_plot(sweep: Readings, roll: ComplexArray, fit: FittedModes | None) -> Figure:
    """Amplitude and phase over speed less the slow roll (C,), and the fit."""
    figure, labels = new_figure(6.6), sweep.labels
    above, below = axes = figure.subplots(2, sharex=True, height_ratios=(3, 2))
    order = np.argsort(sweep.speeds, kind="stable")
    omega = sweep.speeds[order]
    dots = {"label": "fit", "color": "black", "lw": 0.9, "ls": ":", "zorder": 3}
    fits = [] if fit is None else [(fit.curve(omega), dots)]
    for c, name in enumerate(sweep.sensors[:CURVES]):
        for Z, style in ((sweep.vectors[order], {"lw": 1.6, "label": name, **look(c)}), *fits):
            size, phase = labels.vibration(Z[:, c] - roll[c])
            above.plot(RPM * omega, size, **style)
            below.plot(RPM * omega, _broken(phase), **style)
    above.set(ylabel=f"amplitude, {labels.vibration_in or 'no unit'}", ylim=(0.0, None))
    below.set(xlabel="speed, rpm", ylabel=f"phase ({labels.phase}), degrees", yticks=range(0, 361, 90))
    if labels.phase == "lag":
        below.invert_yaxis()  # through a critical speed the curve falls, as everywhere
    for speed, damping in () if fit is None else fit.values[:2].T:
        for ax in axes:
            ax.axvline(RPM * speed, color=DARK, linewidth=0.9, linestyle="--")
        words = f"{RPM * speed:.0f} rpm\nζ {100 * damping:.3g} %"
        note(above, words, (RPM * speed, 0), (3, 5), rotation=90, va="bottom")
    for ax in axes:
        plain(ax)
    title = f"less the slow roll; dashed: critical speeds; {CURVES} curves at most"
    legend_below(figure, (above,), 4, title=title)
    return figure
