"""Pictures of an identification from harmonic tests. Nothing is shown or saved: functions draw on axes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray, IntArray
from rotorid.base.plot_style import MARKERS, QUIET, TEXT, legend_above, look, new_figure, plain, plain_numbers
from rotorid.base.unit_words import Shown
from rotorid.regression.interval_plot import ROOM, draw_intervals

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rotorid.harmonic.result import Identification
    from rotorid.regression.undetermined_combinations import FoundCombination

Curve = tuple[FloatArray, dict[str, ComplexArray]]

CURVE_POINTS = 1000
MANY, FEW = 12, 4
"""Outputs that a legend still names; parameters whose correlations are written as numbers."""
WIDE = 10.0
"""Ratio of amplitudes above which their scale is logarithmic."""
MODEL_UNIT = Shown("model unit")
"""Of amplitudes whose columns name no unit."""


def figure_identification(result: Identification) -> Figure:
    """All about an identification: amplitudes, deviations and phases (or shapes), parameters."""
    panels: list[tuple[float, Callable[..., None]]] = [(3.4, draw_shapes)]
    if not result.experiments.free.all():
        panels = [(2.4, partial(draw_amplitudes, outputs=names)) for names in _by_unit(result)]
        panels += [(1.1, draw_deviations)] * bool(result.predicted) + [(1.6, draw_phases)]
    heights, correlated = [height for height, _ in panels], len(_known(result)) > 1
    parameters = ROOM[0] + ROOM[1] * (len(result.parameters) + len(_combinations(result)))
    parts = 0.6 + sum(heights), max(parameters, 2.2 if correlated else 0.0)
    figure = new_figure(sum(parts))
    above, below = figure.subfigures(2, height_ratios=parts, squeeze=False)[:, 0]
    axes = above.subplots(len(heights), sharex=True, height_ratios=heights, squeeze=False)[:, 0]
    for ax, (_, draw) in zip(axes, panels, strict=True):
        draw(result, ax)
    figure.align_ylabels(axes)
    for ax in axes[:-1]:
        ax.set_xlabel("")
    _legend(result, axes[0])
    last = below.subplots(1, 1 + correlated, width_ratios=(3, 2)[: 1 + correlated], squeeze=False)[0]
    draw_parameters(result, last[0])
    if correlated:
        draw_correlations(result, last[1])
    return figure


def draw_amplitudes(result: Identification, axes: Axes, outputs: Sequence[str]) -> None:
    """Measured and fitted amplitudes over frequency in the units of their table; ± 2σ where that is known.

    Logarithmic where they are very different.
    """
    units, curve = result.experiments.units, _curve(result)
    for name in outputs:
        scale = units.get(name, MODEL_UNIT).scale
        _draw_points(
            result, name, axes, scale * np.abs(_measured(result, name)), scale * _errors(result, name)[0]
        )
        for w, z, style in _fitted(result, name, curve):
            axes.plot(w, scale * np.abs(z), **style)
    axes.set(xlabel=result.experiments.axis.word, ylabel=f"amplitude, {_unit(result, outputs)}")
    scale_amplitudes(axes)


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
    curve = _curve(result)
    for name in result.model.outputs:
        z = _measured(result, name)
        shown = np.where(np.abs(z) > 0, z, np.nan)
        _draw_points(
            result, name, axes, _degrees(shown), np.degrees(_errors(result, name)[1] / np.abs(shown))
        )
        for w, fitted, style in _fitted(result, name, curve):
            angle = _degrees(fitted)
            if style["linestyle"]:
                angle[1:][np.abs(np.diff(angle)) > 180.0] = np.nan  # no line across a full turn
            axes.plot(w, angle, **style)
    axes.set(xlabel=result.experiments.axis.word, ylabel="phase lead, °", ylim=(-205, 205))
    axes.set_yticks(range(-180, 181, 90))
    plain(axes)


def draw_deviations(result: Identification, axes: Axes) -> None:
    """How much larger the measured amplitudes are than those of the identified model, in percent."""
    largest = 0.1
    for name in result.model.outputs:
        if name not in result.predicted:
            continue
        fitted = np.abs(np.asarray(result.predicted[name]))[~result.experiments.free]
        percent = 100 / np.where(fitted > 0, fitted, np.nan)
        gap = percent * (np.abs(_measured(result, name)) - fitted)
        _draw_points(result, name, axes, gap, percent * _errors(result, name)[0])
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
    fitted, natural = _modes(result)
    unit = axis.word.rpartition(", ")[2]
    for i, w in enumerate(axis.scale * result.experiments.frequencies):
        style = look(i)
        label = f"{w:.5g} {unit}"
        if np.isfinite(natural[i]):
            label += f" (model {axis.scale * natural[i]:.5g})"
        mark = MARKERS[i % len(MARKERS)]
        axes.plot(table[i], mark, color=style["color"], mec="white", ms=8, zorder=3)
        axes.plot(fitted[i].real, lw=1.4, **style)
        axes.plot([], [], marker=mark, label=label, **style)
    axes.axhline(0.0, color=QUIET, lw=0.8)
    axes.set_xticks(range(len(outputs)), outputs)
    axes.set_ylabel(f"shape, {_unit(result, outputs)}")
    plain(axes)


def draw_parameters(result: Identification, axes: Axes) -> None:
    """Parameters with their 95 % intervals, and combinations where they say more."""
    factor, found = result.coverage_factor or np.nan, []
    std = np.full(len(result.parameters), np.nan) if result.std is None else result.std
    for name, value, sigma in zip(result.parameters, result.values, std, strict=True):
        several = len({solution[name] for solution in result.solutions}) > 1
        words = "no interval" if np.isfinite(value) else "several values" if several else "not determined"
        found.append((name, value, factor * sigma, words))
    combined = [(c.words, c.value, factor * (c.std or np.nan), "no interval") for c in _combinations(result)]
    draw_intervals(axes, [*found, *combined])


def draw_correlations(result: Identification, axes: Axes) -> None:
    """Correlation map of the parameters that are determined."""
    known = _known(result)
    correlation = result.correlation
    if correlation is None:
        return
    table, names = correlation[np.ix_(known, known)], [result.parameters[i] for i in known]
    axes.imshow(table, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    ticks = range(0, len(names), 1 + (len(names) - 1) // MANY)  # no more than a reader can tell apart
    axes.set_xticks(ticks, [names[i] for i in ticks], rotation=90 if len(names) > 3 else 0)
    axes.set_yticks(ticks, [names[i] for i in ticks])
    for (i, j), value in np.ndenumerate(np.round(table, 2) + 0.0):
        color = "white" if abs(value) > 0.6 else "black"
        text = f"{value:.2g}" if len(names) <= FEW else "" if abs(value) < 0.5 else "+" if value > 0 else "−"
        axes.text(j, i, text, ha="center", va="center", fontsize=TEXT, color=color)
    axes.set_title("correlations", fontsize=TEXT)


def _legend(result: Identification, axes: Axes) -> None:
    """One key an output, mark and line, above the axes; a sentence alone where there are many."""
    from matplotlib.lines import Line2D

    outputs, free = result.model.outputs, result.experiments.free
    said = "points: measured" + (" ± 2σ" if result.experiments.stated and not free.all() else "")
    keys = axes.get_legend_handles_labels()[0]
    if not free.all():
        keys = [Line2D([], [], label=name, **_mark(result, name), **_line(result, name)) for name in outputs]
    if result.predicted or any("model" in str(key.get_label()) for key in keys):
        said += ", lines: model" if _curve(result) or free.all() else ", large: model"
    if free.any() and not free.all():
        said += "; free vibrations not drawn"
    sentence = Line2D([], [], ls="", label=said)
    legend_above(axes, 2 if free.all() else 4, handles=[*(keys if len(keys) <= MANY else []), sentence])


def _by_unit(result: Identification) -> list[list[str]]:
    """Outputs, those with the same unit of their amplitudes together."""
    found: dict[str, list[str]] = {}
    for name in result.model.outputs:
        found.setdefault(_unit(result, [name]), []).append(name)
    return list(found.values())


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


def _combinations(result: Identification) -> tuple[FoundCombination, ...]:
    """Where they say more than the parameters."""
    return () if np.isfinite(result.values).all() else result.combinations


def _known(result: Identification) -> IntArray:
    """Indices of the parameters that are determined and have correlations."""
    correlation = result.correlation
    if correlation is None:
        return np.zeros(0, dtype=np.int64)
    return np.flatnonzero(np.isfinite(result.values) & np.isfinite(np.diag(correlation)))


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


def _draw_points(result: Identification, name: str, axes: Axes, y: FloatArray, error: FloatArray) -> None:
    """Measured points of an output, with error bars where errors are known."""
    bars = error if np.isfinite(error).any() else None
    style = {**_mark(result, name), "color": _line(result, name)["color"]}
    axes.errorbar(_frequencies(result), y, bars, linestyle="", elinewidth=1.2, zorder=3, **style)


def _fitted(
    result: Identification, name: str, curve: Curve | None
) -> list[tuple[FloatArray, ComplexArray, dict[str, Any]]]:
    """The identified model's amplitude: a line where the excitation is the same everywhere, else points."""
    style = _line(result, name)
    if curve is not None:
        return [(result.experiments.axis.scale * curve[0], curve[1][name], style)]
    if name not in result.predicted:
        return []
    large = {**style, "linestyle": "", **_mark(result, name), "mfc": "none", "mec": style["color"], "ms": 13}
    return [(_frequencies(result), np.asarray(result.predicted[name])[~result.experiments.free], large)]


def _curve(result: Identification) -> Curve | None:
    """Amplitudes over the measured range, where one excitation belongs to it; of values that fit the data."""
    model, data = result.model, result.experiments
    values = np.asarray(result.values, dtype=float)
    if not np.isfinite(values).all() and result.starts:
        values = np.array([result.starts[0].get(name, np.nan) for name in model.parameters])
    forced = ~data.free
    w = data.frequencies[forced]
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
