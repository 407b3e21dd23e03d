"""Pictures of an identification from harmonic tests. Nothing is shown or saved: functions draw on axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.plot_style import MARKERS, QUIET, legend_above, look, new_figure, plain, plain_numbers
from rotorid.base.unit_words import Shown
from rotorid.identify.amplitude_residuals import compare
from rotorid.identify.amplitudes import real_matrices
from rotorid.regression.interval_plot import ROOM, draw_intervals

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rotorid.identify.result import Identification

CURVE_POINTS, MANY = 1000, 12
"""Of a curve; outputs that a legend still names."""
WIDE = 10.0
"""Ratio of amplitudes above which their scale is logarithmic."""
MODEL_UNIT = Shown("model unit")
"""Of amplitudes whose columns name no unit."""


def figure_identification(result: Identification) -> Figure:
    """All about an identification: amplitudes and phases (or shapes), parameters."""
    from matplotlib.lines import Line2D

    by_unit: dict[Shown, list[str]] = {}
    for name in result.model.outputs:
        by_unit.setdefault(result.experiments.units.get(name, MODEL_UNIT), []).append(name)
    free, intervals = bool(result.experiments.free.all()), _intervals(result)
    heights = [3.4] if free else [*[2.4] * len(by_unit), 1.6]
    parts = 0.6 + sum(heights), ROOM[0] + ROOM[1] * len(intervals)
    figure = new_figure(sum(parts))
    above, below = figure.subfigures(2, height_ratios=parts, squeeze=False)[:, 0]
    axes = above.subplots(len(heights), sharex=True, height_ratios=heights, squeeze=False)[:, 0]
    if free:
        _shapes(result, axes[0], " or ".join(unit.word for unit in by_unit))
    else:
        curve = _curve(result)
        for ax, (unit, names) in zip(axes, by_unit.items(), strict=False):
            _draw(result, ax, names, curve, unit.scale)
            ax.set_ylabel(f"amplitude, {unit.word}")
            size = np.abs(result.experiments.table(names))[~result.experiments.free]
            if np.nanmax(size) > WIDE * np.nanmin(np.where(size > 0, size, np.nan)):
                ax.set_yscale("log")
                plain_numbers(ax)
            else:
                ax.set_ylim(bottom=0.0)
        _draw(result, axes[-1], result.model.outputs, curve, None)
        axes[-1].set(xlabel=result.experiments.axis.word, ylabel="phase lead, °", ylim=(-205, 205))
        axes[-1].set_yticks(range(-180, 181, 90))
        handles = [
            Line2D([], [], label=name, **{**_mark(j), **look(j)})
            for j, name in enumerate(result.model.outputs[:MANY])
        ]
        stated = " ± 2σ" if result.experiments.stated else ""
        lost = "; free vibrations not drawn" if result.experiments.free.any() else ""
        words = f"points: measured{stated}; lines: model{lost}"
        handles.append(Line2D([], [], ls="", label=words))
        legend_above(axes[0], 4, handles=handles)
    for ax in axes:
        plain(ax)
    figure.align_ylabels(axes)
    draw_intervals(below.subplots(), intervals)
    return figure


def _degrees(z: ComplexArray) -> FloatArray:
    return np.where(z == 0, np.nan, np.degrees(np.angle(z)))


def _mark(j: int) -> dict[str, Any]:
    """Every other one is open and larger, so that equal ones are seen."""
    face = {"mfc": "none", "ms": 9} if j % 2 else {"mec": "white", "ms": 7}
    return {"marker": MARKERS[j % len(MARKERS)], **face}


def _draw(
    result: Identification,
    axes: Axes,
    names: Sequence[str],
    curve: tuple[FloatArray, Mapping[str, ComplexArray]],
    scale: float | None,
) -> None:
    """Sizes times a scale (None: phases), as measured, with two standard deviations, and of the model."""

    def part(z: ComplexArray) -> FloatArray:
        return _degrees(z) if scale is None else scale * np.abs(z)

    data, forced = result.experiments, ~result.experiments.free
    w = data.axis.scale * data.frequencies[forced]
    for name in names:
        j, z = result.model.outputs.index(name), data.table([name])[forced, 0]
        turn = real_matrices(np.exp(-1j * np.angle(z)))
        spread = turn @ data.covariance(name)[forced] @ np.swapaxes(turn, 1, 2)
        std = 2 * np.sqrt(np.diagonal(spread, axis1=1, axis2=2).T)
        error = np.degrees(std[1] / np.abs(z)) if scale is None else scale * std[0]
        style = {**_mark(j), "color": look(j)["color"], "linestyle": ""}
        axes.errorbar(w, part(z), error if data.stated else None, elinewidth=1.2, zorder=3, **style)
        if name in curve[1]:
            axes.plot(data.axis.scale * curve[0], part(curve[1][name]), lw=1.4, **look(j))


def _shapes(result: Identification, axes: Axes, unit: str) -> None:
    """Measured and fitted mode shapes, one line per natural frequency."""
    outputs, axis = result.model.outputs, result.experiments.axis
    table = result.experiments.table(outputs).real
    fitted, natural = np.full(table.shape, np.nan), np.full(len(table), np.nan)
    if result.predicted and np.isfinite(result.values).all():
        whole, natural = compare(result.model, result.experiments).predict(result.values)
        fitted = whole.real
    for i, w in enumerate(axis.scale * result.experiments.frequencies):
        label = f"{w:.5g} {axis.word.rpartition(', ')[2]}"
        label += f" (model {axis.scale * natural[i]:.5g})" if np.isfinite(natural[i]) else ""
        axes.plot(table[i], ls="", color=look(i)["color"], zorder=3, label=label, **_mark(i))
        axes.plot(fitted[i], lw=1.4, **look(i))
    axes.axhline(0.0, color=QUIET, lw=0.8)
    axes.set_xticks(range(len(outputs)), outputs)
    axes.set_ylabel(f"shape, {unit}")
    legend_above(
        axes, 2, handles=axes.get_legend_handles_labels()[0][:MANY], title="points: measured; lines: model"
    )


def _intervals(result: Identification) -> list[tuple[str, float, float, str]]:
    """Parameters with the half width of their 95 % intervals, and combinations where they say more."""
    factor, lines = result.coverage_factor or np.nan, []
    std = np.full(len(result.parameters), np.nan) if result.std is None else result.std
    for name, value, sigma in zip(result.parameters, result.values, std, strict=True):
        several = len({solution[name] for solution in result.solutions}) > 1
        words = "no interval" if np.isfinite(value) else "several values" if several else "not determined"
        lines.append((name, float(value), factor * sigma, words))
    more = () if np.isfinite(result.values).all() else result.combinations
    return [*lines, *((c.words, c.value, factor * (c.std or np.nan), "no interval") for c in more)]


def _curve(result: Identification) -> tuple[FloatArray, Mapping[str, ComplexArray]]:
    """Predicted amplitudes over the measured range, where one excitation belongs to it, else at its tests."""
    model, data = result.model, result.experiments
    rows = np.flatnonzero(~data.free)[np.argsort(data.frequencies[~data.free], kind="stable")]
    w, inputs = data.frequencies[rows], data.table(model.inputs)[rows]
    at_tests = w, {name: values[rows] for name, values in result.predicted.items()}
    if not result.predicted or model.varying or not np.allclose(inputs, inputs[0], rtol=1e-9, atol=0):
        return at_tests
    # what is measured may lie at a peak: the line passes exactly there
    grid = np.unique(np.concatenate((np.linspace(w.min(), w.max(), CURVE_POINTS), w)))
    with suppress(np.linalg.LinAlgError):
        return grid, model.predict(result.theta, grid, dict(zip(model.inputs, inputs[0], strict=True)))
    return at_tests
