"""Pictures of an identification from harmonic tests. Nothing is shown or saved: functions draw on axes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.base.plot_style import COLORS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rotorid.harmonic.result import Identification

Curve = tuple[FloatArray, dict[str, ComplexArray]]

CURVE_POINTS = 400
MANY = 12
"""Outputs that a legend still names, and parameters whose correlations are written as numbers."""


def plot_identification(result: Identification, ax: Axes | None = None) -> Axes:
    """Draw measured amplitudes (points) and those of the identified model (lines) over frequency.

    Free vibrations only: measured and fitted shapes instead.

    Parameters
    ----------
    result
        What to draw.
    ax
        Where; default new axes.
    """
    from fem.plots import new_axes

    axes = new_axes() if ax is None else ax
    if result.experiments.free.all():
        draw_shapes(result, axes)
    else:
        draw_amplitudes(result, axes)
    return axes


def figure_identification(result: Identification) -> Figure:
    """All about an identification: amplitudes, phases (or shapes), residuals and correlations."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 7.5), layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=(3, 2))
    if result.experiments.free.all():
        draw_shapes(result, figure.add_subplot(grid[:, 0]))
    else:
        above = figure.add_subplot(grid[0, 0])
        draw_amplitudes(result, above)
        draw_phases(result, figure.add_subplot(grid[1, 0], sharex=above))
        above.set_xlabel("")
    draw_residuals(result, figure.add_subplot(grid[0, 1]))
    draw_correlations(result, figure.add_subplot(grid[1, 1]))
    return figure


def draw_amplitudes(result: Identification, axes: Axes) -> None:
    """Measured and fitted amplitudes over frequency, logarithmic where they are not zero."""
    smallest, largest, curve = np.inf, 0.0, _curve(result)
    for color, name, measured, forced in _outputs(result):
        size = np.abs(measured)
        axes.plot(_frequencies(result)[forced], size, "o", color=color, mec="white", label=name, zorder=3)
        for w, z, style in _fitted(result, name, curve):
            axes.plot(w, np.abs(z), style, color=color, lw=1.2, mfc="none", ms=9)
            size = np.concatenate((size, np.abs(z)))
        size = size[np.isfinite(size) & (size > 0)]
        if len(size):
            smallest, largest = min(smallest, float(size.min())), max(largest, float(size.max()))
    if largest > 0:
        axes.set_yscale("log")
        axes.set_ylim(smallest / 2, largest * 2)
    axes.set(xlabel="frequency, rad/s", ylabel="amplitude")
    _finish(axes, "measured (points) and identified model (lines)", len(result.model.outputs))


def draw_phases(result: Identification, axes: Axes) -> None:
    """Measured and fitted phases over frequency, positive = lead."""
    curve = _curve(result)
    for color, name, measured, forced in _outputs(result):
        shown = np.where(np.abs(measured) > 0, measured, np.nan)
        axes.plot(
            _frequencies(result)[forced], _degrees(shown), "o", color=color, mec="white", label=name, zorder=3
        )
        for w, z, style in _fitted(result, name, curve):
            angle = _degrees(z)
            if style == "-":
                angle[1:][np.abs(np.diff(angle)) > 180.0] = np.nan  # no line across a full turn
            axes.plot(w, angle, style, color=color, lw=1.2, mfc="none", ms=9)
    axes.set(xlabel="frequency, rad/s", ylabel="phase, °", ylim=(-190, 190), yticks=range(-180, 181, 90))
    axes.grid(alpha=0.3)


def draw_shapes(result: Identification, axes: Axes) -> None:
    """Measured and fitted mode shapes, one line per natural frequency."""
    outputs = result.model.outputs
    place = np.arange(len(outputs))
    table = result.experiments.table(result.model.outputs)
    fitted, natural = _modes(result)
    for i, w in enumerate(_frequencies(result)):
        color = COLORS[i % len(COLORS)]
        label = f"{w:.5g} rad/s" + (f" (model {natural[i]:.5g})" if np.isfinite(natural[i]) else "")
        axes.plot(place, table[i].real, "o", color=color, mec="white", label=label, zorder=3)
        axes.plot(place, fitted[i].real, "-", color=color, lw=1.2)
    axes.axhline(0.0, color="0.6", lw=0.8)
    axes.set_xticks(place, outputs)
    axes.set(ylabel="shape")
    fit = " and identified model (lines)" if np.isfinite(fitted).any() else ""
    _finish(axes, f"shapes: measured (points){fit}")


def draw_residuals(result: Identification, axes: Axes) -> None:
    """Residuals of each equation (or output) and experiment: real part filled, imaginary part open."""
    place = np.arange(len(result.experiments))
    number = len(result.residual_names)
    width = min(0.6, 0.12 * number)
    for j, name in enumerate(result.residual_names):
        color = COLORS[j % len(COLORS)]
        shift = place + (j - (number - 1) / 2) * width / number
        values = result.residuals[:, j]
        axes.plot(shift, values.real, "o", color=color, ms=5, label=name)
        if not result.experiments.free.all():
            axes.plot(shift, values.imag, "o", color=color, ms=5, mfc="none")
    axes.axhline(0.0, color="0.6", lw=0.8)
    names = result.experiments.names
    step = max(1, len(names) // 12)
    axes.set_xticks(place[::step], names[::step])
    axes.ticklabel_format(axis="y", style="sci", scilimits=(-2, 3), useMathText=True)
    axes.set(xlabel="experiment", ylabel="residual")
    parts = "" if result.experiments.free.all() else ": real part filled, imaginary open"
    _finish(axes, f"residuals{parts} (rms {result.residual_rms:.3g})", len(result.residual_names))


def draw_correlations(result: Identification, axes: Axes) -> None:
    """Correlation map of the parameters that are determined; words where there is none."""
    correlation = result.correlation
    known = np.flatnonzero(np.isfinite(result.values))
    if correlation is None or len(known) < 2 or not np.isfinite(correlation[np.ix_(known, known)]).all():
        if len(known) < 2:
            reason = "fewer than two determined parameters:\nno correlations"
        else:
            reason = "no errors are stated and there are no\nmore equations than unknowns: no correlations"
        axes.text(0.5, 0.5, reason, ha="center", va="center", transform=axes.transAxes, color="0.4")
        axes.set_axis_off()
        return
    table = correlation[np.ix_(known, known)]
    names = [result.parameters[i] for i in known]
    image = axes.imshow(table, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    axes.figure.colorbar(image, ax=axes, shrink=0.8)
    ticks = range(0, len(names), 1 + (len(names) - 1) // 20)  # no more than a reader can tell apart
    axes.set_xticks(ticks, [names[i] for i in ticks], rotation=90 if len(names) > 6 else 0)
    axes.set_yticks(ticks, [names[i] for i in ticks])
    if len(names) <= MANY:
        for (i, j), value in np.ndenumerate(np.round(table, 2) + 0.0):
            color = "white" if abs(value) > 0.6 else "black"
            axes.text(j, i, f"{value:.2f}", ha="center", va="center", fontsize=8, color=color)
    axes.set_title("correlations of the parameters", fontsize=10)


def _finish(axes: Axes, title: str, names: int = 0) -> None:
    """Grid, title, and a legend where it has not too many names."""
    axes.grid(alpha=0.3)
    axes.set_title(title, fontsize=10)
    if names <= MANY:
        axes.legend(frameon=False, fontsize=9)


def _frequencies(result: Identification) -> FloatArray:
    return np.asarray(result.experiments.frequencies, dtype=float)


def _outputs(result: Identification) -> list[tuple[str, str, ComplexArray, BoolArray]]:
    """Color, name, measured amplitudes and which experiments, forced ones only, of every output."""
    table, forced = result.experiments.table(result.model.outputs), ~result.experiments.free
    return [
        (COLORS[j % len(COLORS)], name, table[forced, j], forced)
        for j, name in enumerate(result.model.outputs)
    ]


def _fitted(
    result: Identification, name: str, curve: Curve | None
) -> list[tuple[FloatArray, ComplexArray, str]]:
    """The identified model's amplitude: a line where the excitation is the same everywhere, else points."""
    if curve is not None:
        return [(curve[0], curve[1][name], "-")]
    if name not in result.predicted:
        return []
    forced = ~result.experiments.free
    return [(_frequencies(result)[forced], np.asarray(result.predicted[name])[forced], "s")]


def _curve(result: Identification) -> Curve | None:
    """Amplitudes over the measured range, where one excitation belongs to it and the values are known."""
    model, data = result.model, result.experiments
    values = np.asarray(result.values, dtype=float)
    if not np.isfinite(values).all() and result.solutions:
        values = np.array([result.solutions[0].get(name, np.nan) for name in model.parameters])
    forced = ~data.free
    w = _frequencies(result)[forced]
    if model.varying or not np.isfinite(values).all() or len(w) < 2:
        return None
    # what is measured may lie at a peak: the line passes exactly there
    grid = np.unique(np.concatenate((np.linspace(w.min(), w.max(), CURVE_POINTS), w)))
    inputs: dict[str, ComplexArray] = {}
    for name in model.inputs:
        given = data.table([name])[forced, 0]
        if np.isnan(given).any() or not np.allclose(given, given[0], rtol=1e-9, atol=0.0):
            return None
        inputs[name] = np.full(len(grid), given[0])
    try:
        return grid, model.predict(values, grid, inputs)
    except (ValueError, np.linalg.LinAlgError):
        return None


def _modes(result: Identification) -> tuple[ComplexArray, FloatArray]:
    """Shapes (experiments, outputs) and frequencies of the identified model; NaN where it predicts none."""
    from rotorid.harmonic.comparison import compare

    unknown = np.full((len(result.experiments), len(result.model.outputs)), np.nan, dtype=complex)
    try:
        if np.isfinite(result.values).all():
            return compare(result.model, result.experiments).predict(result.values)
    except (ValueError, np.linalg.LinAlgError):  # a model that predicts nothing has measured points only
        pass
    return unknown, unknown[:, 0].real.copy()


def _degrees(z: ComplexArray) -> FloatArray:
    return np.asarray(np.degrees(np.angle(z)) + 0.0 * np.abs(z))
