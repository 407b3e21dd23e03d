"""Pictures of identifications, modes and run-ups. Nothing is shown or saved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from fem.plots import right_angles
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.plot_style import (
    COLORS,
    DARK,
    MARKERS,
    QUIET,
    TEXT,
    legend_below,
    look,
    new_figure,
    plain,
    rad_s_above,
)
from rotorid.base.rpm import RPM
from rotorid.base.unit_words import SPEEDS, Shown
from rotorid.identify.amplitudes import real_matrices

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rotorid.identify.modes_result import FittedModes, Readings
    from rotorid.identify.result import Identification

POINTS, CURVES, NAMES, MODES = 1000, len(COLORS), 12, 4
"""Of a curve; most curves of a sweep, outputs in a legend, modes."""
HIDDEN = 3.0
"""Standard deviations below which a vector has no phase to draw."""
MODEL_UNIT = Shown("model unit")
"""Of amplitudes whose columns name no unit."""


def figure_identification(result: Identification) -> Figure:
    """Amplitudes and phases, or shapes, measured and predicted."""
    units = {name: result.experiments.units.get(name, MODEL_UNIT) for name in result.model.outputs}
    free = bool(result.experiments.free.all())
    heights = [3.4] if free else [*[2.4] * len({*units.values()}), 1.6]
    figure = new_figure(0.9 + sum(heights))
    axes = [*figure.subplots(len(heights), sharex=True, height_ratios=heights, squeeze=False)[:, 0]]
    words = _shapes(result, axes[0], units) if free else _forced(result, axes, units)
    for ax in axes:
        plain(ax)
    figure.align_ylabels(axes)
    legend_below(figure, axes, 2 if free else 4, title=f"points: measured{words}")
    return figure


def _forced(result: Identification, axes: Sequence[Axes], units: Mapping[str, Shown]) -> str:
    """Sizes, on axes by their unit, and phases, with two standard deviations, and those of the model."""
    data, rows, phases = result.experiments, ~result.experiments.free, axes[-1]
    by_unit, (grid, curves) = dict(zip(dict.fromkeys(units.values()), axes, strict=False)), _curve(result)
    for j, (name, unit) in enumerate(units.items()):
        z, ax, line = data.table([name])[rows, 0], by_unit[unit], {"lw": 1.4, **look(j)}
        turn = real_matrices(np.exp(-1j * np.angle(z)))
        std = 2 * np.sqrt(np.einsum("nai,nij,naj->an", turn, data.covariance(name)[rows], turn))
        bars = (unit.scale * std[0], np.degrees(std[1] / np.abs(z))) if data.stated else (None, None)
        mark = {"elinewidth": 1.2, "zorder": 3, **_mark(j), "label": name if j < NAMES else ""}
        w, x = data.axis.scale * data.frequencies[rows], data.axis.scale * grid
        ax.errorbar(w, unit.scale * np.abs(z), bars[0], **mark)
        phases.errorbar(w, _degrees(z), bars[1], **mark)
        if name in curves:
            ax.plot(x, unit.scale * np.abs(curves[name]), **line)
            phases.plot(x, _degrees(curves[name]), **line)
        ax.set_ylabel(f"amplitude, {unit.word}")
    for ax in by_unit.values():
        ax.set_ylim(bottom=0.0)
    phases.set(xlabel=data.axis.word, ylabel="phase lead, °", ylim=(-205, 205), yticks=range(-180, 181, 90))
    lost = "; free vibrations not drawn" if data.free.any() else ""
    return f"{' ± 2σ' if data.stated else ''}; lines: model{lost}"


def _shapes(result: Identification, axes: Axes, units: Mapping[str, Shown]) -> str:
    """Measured and fitted mode shapes, one line per natural frequency."""
    data, outputs = result.experiments, result.model.outputs
    fitted = [[*amplitudes.real] for amplitudes in np.transpose([*result.predicted.values()])]
    for i, (w, shape) in enumerate(zip(data.frequencies, data.table(outputs).real, strict=True)):
        label = f"{data.axis.scale * w:.5g} {data.axis.word.rpartition(', ')[2]}"
        axes.plot(shape, zorder=3, label=label if i < NAMES else "", **_mark(i))
        if fitted:
            axes.plot(fitted[i], lw=1.4, **look(i))
    axes.axhline(0.0, color=QUIET, lw=0.8)
    axes.set_xticks(range(len(outputs)), outputs)
    axes.set_ylabel(f"shape, {' or '.join({unit.word: '' for unit in units.values()})}")
    return "; lines: model"


def _degrees(z: ComplexArray) -> FloatArray:
    return np.where(z == 0, np.nan, np.degrees(np.angle(z)))


def _mark(j: int) -> dict[str, Any]:
    """Points, open, so that equal ones are seen."""
    return {"ls": "", "marker": MARKERS[j % len(MARKERS)], "color": look(j)["color"], "mfc": "none", "ms": 6}


def _curve(result: Identification) -> tuple[FloatArray, Mapping[str, ComplexArray]]:
    """Predicted amplitudes over the measured range, where one excitation belongs to it, else at its tests."""
    model, data = result.model, result.experiments
    rows = np.flatnonzero(~data.free)[np.argsort(data.frequencies[~data.free], kind="stable")]
    w, inputs = data.frequencies[rows], data.table(model.inputs)[rows]
    at_tests = w, {name: values[rows] for name, values in result.predicted.items()}
    if not result.predicted or model.varying or not np.allclose(inputs, inputs[0], rtol=1e-9, atol=0):
        return at_tests
    # what is measured may lie at a peak: the line passes exactly there
    grid = np.unique(np.concatenate((np.linspace(w.min(), w.max(), POINTS), w)))
    with suppress(np.linalg.LinAlgError):
        return grid, model.predict(result.theta, grid, dict(zip(model.inputs, inputs[0], strict=True)))
    return at_tests


def figure_modes(modes: FittedModes) -> Figure:
    """A row a mode: readings and fit in the complex plane, where a mode is a circle, and over frequency."""
    data, k = modes.readings, min(len(modes.ends), MODES)
    (word, scale), unit, size = SPEEDS[data.labels.speed_unit], _unit(data), data.labels.vibration_scale
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


def bode_plot(sweep: Readings, roll: ComplexArray, fit: FittedModes | None) -> Figure:
    """Amplitude and phase over speed less the slow roll (C,), and the fit."""
    figure, labels = new_figure(6.6), sweep.labels
    above, below = axes = figure.subplots(2, sharex=True, height_ratios=(3, 2))
    dots: dict[str, Any] = {"color": "black", "linewidth": 0.9, "linestyle": (0, (1, 1))}
    order = np.argsort(sweep.speeds, kind="stable")
    for c, name in enumerate(sweep.sensors[:CURVES]):
        there = order[~np.isnan(sweep.vectors[order, c])]
        omega, vectors = sweep.speeds[there], sweep.vectors[there, c] - roll[c]
        lines = [(vectors, {"lw": 1.6, "label": name, **look(c)})]
        seen = np.abs(vectors) > HIDDEN * np.nanmedian(sweep.noise[:, c])
        phase = np.unwrap(np.angle(vectors[seen]))
        if fit is not None:
            lines.append((fit.curve(omega)[:, c] - roll[c], {"label": f"fit, run {sweep.run}", **dots}))
        for z, style in lines:  # phases of the fit beside those of the readings
            beside = labels.phase_sign * np.degrees(phase + np.angle(z * vectors.conj())[seen])
            beside -= (
                360 * np.floor(np.median(labels.phase_sign * np.degrees(phase)) / 360) if seen.any() else 0
            )
            above.plot(RPM * omega, labels.vibration_scale * np.abs(z), **style)
            below.plot(RPM * omega[seen], beside, **style)
    above.set(ylabel=f"amplitude, {_unit(sweep)}", ylim=(0.0, None))
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


def _unit(readings: Readings) -> str:
    return readings.labels.vibration_in or "no unit"
