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
        mark = {"elinewidth": 1.2, "zorder": 3, **_mark(j), "label": name if j < NAMES else ""}
        ax.errorbar(w, unit.scale * np.abs(z), bars[0], **mark)
        phases.errorbar(w, _degrees(z), bars[1], **mark)
        cross = {**look(j), "marker": "x", "linestyle": ""}
        lines = [(w, result.predicted.get(name), cross), (x, curves.get(name), {"lw": 1.4, **look(j)})]
        for at, model, style in lines:
            if model is not None:
                ax.plot(at, unit.scale * np.abs(model), **style)
                phases.plot(at, _degrees(model), **style)
        ax.set_ylabel(f"amplitude, {unit.word}")
    for ax in axes:
        plain(ax)
        ax.set_ylim(bottom=-0.04 * ax.get_ylim()[1])  # a mark at 0 stands above the axis
    phases.set(xlabel=data.axis.word, ylabel="phase lead, °", ylim=(-205, 205), yticks=range(-180, 181, 90))
    figure.align_ylabels(axes)
    words = f"points: measured{' ± 2σ' if data.stated else ''}; crosses and lines: model"
    legend_below(figure, axes, 4, title=words)
    return figure


def _degrees(z: ComplexArray) -> FloatArray:
    return np.where(z == 0, np.nan, np.degrees(np.angle(z)))


def _mark(j: int) -> dict[str, Any]:
    """Points, open, so that equal ones are seen."""
    return {"ls": "", "marker": MARKERS[j % len(MARKERS)], "color": look(j)["color"], "mfc": "none", "ms": 6}


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
    return w, {}


def figure_modes(modes: FittedModes) -> Figure:
    """A row a mode: readings and fit in the complex plane, where a mode is a circle, and over frequency."""
    data, labels, k = modes.readings, modes.readings.labels, len(modes.ends)
    (word, scale), unit, size = SPEEDS[labels.speed_unit], _unit(data), labels.vibration_scale
    figure = new_figure(2.2 * k + 0.7)
    axes = figure.subplots(k, 2, squeeze=False, width_ratios=(2, 3))
    for mode, ((circle, peak), (low, high)) in enumerate(zip(axes, modes.ends, strict=False)):
        rows, grid = (data.speeds >= low) & (data.speeds <= high), np.linspace(low, high, POINTS)
        fits, w = size * modes.curve(grid), scale * data.speeds[rows]
        for p, name in enumerate(data.sensors[:CURVES]):
            read, fit, mark = size * data.vectors[rows, p], fits[:, p], _mark(p)
            circle.plot(fit.real, fit.imag, **look(p))
            circle.plot(read.real, read.imag, label=name, **mark)
            peak.plot(scale * grid, np.abs(fit), **look(p))
            peak.plot(w, np.abs(read), **mark)
        at = "" if modes.undetermined else f": {labels.speed_words(modes.values[0, mode])}"
        circle.set_title(f"mode {mode + 1}{at}", loc="left", fontsize=TEXT)
        circle.set(xlabel=f"real part, {unit}", ylabel=f"imaginary part, {unit}")
        circle.set_aspect("equal", adjustable="datalim")
        peak.set(xlabel=f"frequency, {word}", ylabel=f"amplitude, {unit}")
        for ax in (circle, peak):
            ax.locator_params("x", nbins=4)
            plain(ax)
    words = f"hollow: readings; lines: fit (at most {CURVES} points)"
    legend_below(figure, axes[:1, 0], 5, title=words)
    return figure


def bode_plot(sweep: Readings, roll: ComplexArray, fit: FittedModes | None) -> Figure:
    """Amplitude and phase over speed less the slow roll (C,), and the fit."""
    figure, labels = new_figure(6.6), sweep.labels
    above, below = axes = figure.subplots(2, sharex=True, height_ratios=(3, 2))
    dots: dict[str, Any] = {"color": "black", "linewidth": 0.9, "linestyle": (0, (1, 1)), "zorder": 3}
    order = np.argsort(sweep.speeds, kind="stable")
    omega = sweep.speeds[order]
    for c, name in enumerate(sweep.sensors[:CURVES]):
        lines = [(sweep.vectors[order, c], {"lw": 1.6, "label": name, **look(c)})]
        if fit is not None:
            lines.append((fit.curve(omega)[:, c], {"label": f"fit, run {sweep.run}", **dots}))
        for z, style in lines:
            size, phase = labels.vibration(z - roll[c])
            above.plot(RPM * omega, size, **style)
            phase[1:][np.abs(np.diff(phase)) > 180] = np.nan  # where it begins anew
            below.plot(RPM * omega, phase, **style)
    above.set(ylabel=f"amplitude, {_unit(sweep)}", ylim=(0.0, None))
    below.set(xlabel="speed, rpm", ylabel=f"phase ({labels.phase}), degrees", yticks=range(0, 361, 90))
    if labels.phase == "lag":
        below.invert_yaxis()  # through a critical speed the curve falls, as everywhere
    critical = [] if fit is None else RPM * fit.values[0]
    for ax in axes:
        for speed in critical:
            ax.axvline(speed, color=DARK, linewidth=0.9, linestyle=(0, (2, 2)), zorder=1)
        plain(ax)
    words = f"less the slow roll; at most {CURVES} curves; dashed: critical speeds"
    legend_below(figure, (above,), 3, title=words)
    return figure


def _unit(readings: Readings) -> str:
    return readings.labels.vibration_in or "no unit"
