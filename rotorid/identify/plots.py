"""Pictures of an identification from harmonic tests. Nothing is shown or saved: functions draw on axes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.plot_style import MARKERS, QUIET, legend_above, look, new_figure, plain, plain_numbers
from rotorid.base.unit_words import Shown
from rotorid.identify.amplitude_residuals import compare
from rotorid.regression.interval_plot import ROOM, draw_intervals

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rotorid.identify.result import Identification

CURVE_POINTS = 1000
MANY = 12
"""Outputs that a legend still names."""
WIDE = 10.0
"""Ratio of amplitudes above which their scale is logarithmic."""
MODEL_UNIT = Shown("model unit")
"""Of amplitudes whose columns name no unit."""


def figure_identification(result: Identification) -> Figure:
    """All about an identification: amplitudes, deviations and phases (or shapes), parameters."""
    panels: list[tuple[float, Callable[..., None]]] = [(3.4, draw_shapes)]
    if not result.experiments.free.all():
        by_unit: dict[str, list[str]] = {}
        for name in result.model.outputs:
            by_unit.setdefault(_unit(result, [name]), []).append(name)
        panels = [(2.4, partial(draw_amplitudes, outputs=names)) for names in by_unit.values()]
        panels += [(1.1, draw_deviations)] * bool(result.predicted) + [(1.6, draw_phases)]
    heights, intervals = [height for height, _ in panels], _intervals(result)
    parts = 0.6 + sum(heights), ROOM[0] + ROOM[1] * len(intervals)
    figure = new_figure(sum(parts))
    above, below = figure.subfigures(2, height_ratios=parts, squeeze=False)[:, 0]
    axes = above.subplots(len(heights), sharex=True, height_ratios=heights, squeeze=False)[:, 0]
    for ax, (_, draw) in zip(axes, panels, strict=True):
        draw(result, ax)
    figure.align_ylabels(axes)
    for ax in axes[:-1]:
        ax.set_xlabel("")
    _legend(result, axes[0])
    draw_intervals(below.subplots(), intervals)
    return figure


def draw_amplitudes(result: Identification, axes: Axes, outputs: Sequence[str]) -> None:
    """Measured and fitted amplitudes over frequency in the units of their table; ± 2σ where that is known.

    Logarithmic where they are very different.
    """
    for name in outputs:
        scale = result.experiments.units.get(name, MODEL_UNIT).scale
        _draw(result, name, axes, partial(_size, scale), scale * _errors(result, name)[0])
    axes.set(xlabel=result.experiments.axis.word, ylabel=f"amplitude, {_unit(result, outputs)}")
    scale_amplitudes(axes)


def _size(scale: float, z: ComplexArray) -> FloatArray:
    return np.asarray(scale * np.abs(z))


def scale_amplitudes(axes: Axes) -> None:
    """Logarithmic where the amplitudes that are drawn are very different, else from 0."""
    every = np.concatenate([np.asarray(line.get_ydata(), dtype=float) for line in axes.get_lines()])
    every = every[np.isfinite(every) & (every > 0)]
    if len(every) and every.max() > WIDE * every.min():
        axes.set_yscale("log")
        axes.set_ylim(every.min() / 1.5, every.max() * 1.5)
        plain_numbers(axes)
    else:
        axes.set_ylim(bottom=0.0)
    plain(axes)


def draw_phases(result: Identification, axes: Axes) -> None:
    """Measured and fitted phases over frequency, positive = lead."""

    def degrees(z: ComplexArray) -> FloatArray:
        angle = np.where(np.abs(z) > 0, np.degrees(np.angle(z)), np.nan)
        if len(z) > len(result.experiments):  # no line across a full turn
            angle[1:][np.abs(np.diff(angle)) > 180.0] = np.nan
        return np.asarray(angle)

    for name in result.model.outputs:
        size = np.abs(_measured(result, name))
        _draw(
            result,
            name,
            axes,
            degrees,
            np.degrees(_errors(result, name)[1] / np.where(size > 0, size, np.nan)),
        )
    axes.set(xlabel=result.experiments.axis.word, ylabel="phase lead, °", ylim=(-205, 205))
    axes.set_yticks(range(-180, 181, 90))
    plain(axes)


def draw_deviations(result: Identification, axes: Axes) -> None:
    """How much larger the measured amplitudes are than those of the identified model, in percent."""
    largest = 0.1
    for name, predicted in result.predicted.items():
        fitted = np.abs(predicted)[~result.experiments.free]
        percent = 100 / np.where(fitted > 0, fitted, np.nan)
        gap = percent * (np.abs(_measured(result, name)) - fitted)
        _points(result, name, axes, gap, percent * _errors(result, name)[0])
        largest = max(largest, float(np.nanmax(np.abs(gap), initial=0.0)))
    axes.axhline(0.0, color=QUIET, lw=0.8)
    axes.set(xlabel=result.experiments.axis.word, ylabel="measured −\nmodel, %")
    low, high = axes.get_ylim()
    axes.set_ylim(min(low, -1.2 * largest), max(high, 1.2 * largest))
    plain(axes)


def draw_shapes(result: Identification, axes: Axes) -> None:
    """Measured and fitted mode shapes, one line per natural frequency."""
    outputs, axis = result.model.outputs, result.experiments.axis
    table = result.experiments.table(outputs).real
    fitted, natural = np.full(table.shape, np.nan), np.full(len(table), np.nan)
    if result.predicted and np.isfinite(result.values).all():
        whole, natural = compare(result.model, result.experiments).predict(result.values)
        fitted = whole.real
    unit = axis.word.rpartition(", ")[2]
    for i, w in enumerate(axis.scale * result.experiments.frequencies):
        style, mark = look(i), MARKERS[i % len(MARKERS)]
        label = f"{w:.5g} {unit}"
        if np.isfinite(natural[i]):
            label += f" (model {axis.scale * natural[i]:.5g})"
        axes.plot(table[i], mark, color=style["color"], mec="white", ms=8, zorder=3)
        axes.plot(fitted[i], lw=1.4, **style)
        axes.plot([], [], marker=mark, label=label, **style)
    axes.axhline(0.0, color=QUIET, lw=0.8)
    axes.set_xticks(range(len(outputs)), outputs)
    axes.set_ylabel(f"shape, {_unit(result, outputs)}")
    plain(axes)


def _intervals(result: Identification) -> list[tuple[str, float, float, str]]:
    """Parameters with the half width of their 95 % intervals, and combinations where they say more."""
    factor, found = result.coverage_factor or np.nan, []
    std = np.full(len(result.parameters), np.nan) if result.std is None else result.std
    for name, value, sigma in zip(result.parameters, result.values, std, strict=True):
        several = len({solution[name] for solution in result.solutions}) > 1
        words = "no interval" if np.isfinite(value) else "several values" if several else "not determined"
        found.append((name, float(value), factor * sigma, words))
    more = () if np.isfinite(result.values).all() else result.combinations
    return [*found, *((c.words, c.value, factor * (c.std or np.nan), "no interval") for c in more)]


def _legend(result: Identification, axes: Axes) -> None:
    """One key an output, mark and line, above the axes; a sentence alone where there are many."""
    from matplotlib.lines import Line2D

    outputs, free = result.model.outputs, result.experiments.free
    words = "points: measured" + (" ± 2σ" if result.experiments.stated and not free.all() else "")
    keys = axes.get_legend_handles_labels()[0]
    if not free.all():
        keys = [Line2D([], [], label=name, **_mark(result, name), **_line(result, name)) for name in outputs]
    if result.predicted or any("model" in str(key.get_label()) for key in keys):
        words += ", lines: model" if _curve(result) or free.all() else ", large: model"
    if free.any() and not free.all():
        words += "; free vibrations not drawn"
    sentence = Line2D([], [], ls="", label=words)
    legend_above(axes, 2 if free.all() else 4, handles=[*(keys if len(keys) <= MANY else []), sentence])


def _unit(result: Identification, outputs: Sequence[str]) -> str:
    return " or ".join(dict.fromkeys(result.experiments.units.get(name, MODEL_UNIT).word for name in outputs))


def _mark(result: Identification, name: str) -> dict[str, Any]:
    """Mark of an output: every other one is open and larger, so that equal ones are seen."""
    j = result.model.outputs.index(name)
    color = look(j)["color"]
    face = {"mfc": "none", "mec": color, "ms": 9} if j % 2 else {"mfc": color, "mec": "white", "ms": 7}
    return {"marker": MARKERS[j % len(MARKERS)], **face}


def _line(result: Identification, name: str) -> dict[str, Any]:
    return {**look(result.model.outputs.index(name)), "linewidth": 1.4}


def _frequencies(result: Identification) -> FloatArray:
    """Of the forced experiments, as they are shown."""
    data = result.experiments
    return np.asarray(data.axis.scale * data.frequencies[~data.free])


def _measured(result: Identification, name: str) -> ComplexArray:
    """An output of the forced experiments."""
    return np.asarray(result.experiments.table([name])[~result.experiments.free, 0])


def _errors(result: Identification, name: str) -> FloatArray:
    """Two standard deviations along and across each measured amplitude, (2, n); NaN where not stated."""
    z = _measured(result, name)
    if not result.experiments.stated:
        return np.full((2, len(z)), np.nan)
    along = np.exp(1j * np.angle(z))
    covariance = result.experiments.covariance(name)[~result.experiments.free]
    parts = [np.stack((u.real, u.imag), -1) for u in (along, 1j * along)]
    return np.array([2 * np.sqrt(np.einsum("ni,nij,nj->n", u, covariance, u)) for u in parts])


def _points(result: Identification, name: str, axes: Axes, y: FloatArray, error: FloatArray) -> None:
    """Measured points of an output, with error bars where errors are known."""
    bars = error if np.isfinite(error).any() else None
    style = {**_mark(result, name), "color": _line(result, name)["color"]}
    axes.errorbar(_frequencies(result), y, bars, linestyle="", elinewidth=1.2, zorder=3, **style)


def _draw(
    result: Identification, name: str, axes: Axes, part: Callable[[Any], FloatArray], error: FloatArray
) -> None:
    """Part of the amplitudes: as measured, and of the model, a line where one excitation belongs to it."""
    _points(result, name, axes, part(_measured(result, name)), error)
    style, curve = _line(result, name), _curve(result)
    if curve is not None:
        axes.plot(result.experiments.axis.scale * curve[0], part(curve[1][name]), **style)
    elif name in result.predicted:
        large = {**style, "linestyle": "", **_mark(result, name), "mfc": "none", "mec": style["color"]}
        fitted = np.asarray(result.predicted[name])[~result.experiments.free]
        axes.plot(_frequencies(result), part(fitted), **{**large, "ms": 13})


def _curve(result: Identification) -> tuple[FloatArray, dict[str, ComplexArray]] | None:
    """Amplitudes over the measured range, where one excitation belongs to it; of values that fit the data."""
    model, data = result.model, result.experiments
    w = data.frequencies[~data.free]
    if not result.predicted or model.varying or len(w) < 2:
        return None
    # what is measured may lie at a peak: the line passes exactly there
    grid = np.unique(np.concatenate((np.linspace(w.min(), w.max(), CURVE_POINTS), w)))
    inputs = {name: data.table([name])[~data.free, 0] for name in model.inputs}
    if any(not np.allclose(given, given[0], rtol=1e-9, atol=0.0) for given in inputs.values()):
        return None
    try:
        return grid, model.predict(
            result.theta, grid, {n: np.full(len(grid), z[0]) for n, z in inputs.items()}
        )
    except np.linalg.LinAlgError:
        return None
