"""Pictures of a fit to time records. Nothing is shown or saved: functions draw on axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.plot_style import BLUE, DARK, MARKERS, QUIET, TEXT, look, new_figure, plain
from rotorid.base.text import counted
from rotorid.identify.records import record_names
from rotorid.regression.interval_plot import ROOM, draw_intervals

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

    from rotorid.identify.records import Record
    from rotorid.identify.result_records import Fit
    from rotorid.identify.simulate import Trajectory

CURVE_POINTS, BAND = 600, "#d9dde3"
MANY = 8
"""Records that a legend still names."""
IN_A_COLUMN = 3
"""Signals that stand below each other; more stand in two columns."""
SIGNAL, STRIP, INPUT = 1.4, 0.8, 0.9
"""Heights of a signal, of its residuals and of an input, inches."""


def figure_fit(result: Fit) -> Figure:
    """All about a fit: each signal with the model and its residuals, the inputs, the parameters."""
    outputs, inputs = result.model.outputs, tuple(result.records[0].inputs)
    columns = 1 if len(outputs) <= IN_A_COLUMN else 2
    signals, driven = -(-len(outputs) // columns), -(-len(inputs) // columns)
    heights = [SIGNAL, STRIP] * signals + [INPUT] * driven
    parts = 0.9 + sum(heights), 0.2 + ROOM[0] + ROOM[1] * len(result.parameters)
    figure = new_figure(sum(parts))
    above, below = figure.subfigures(2, height_ratios=parts, squeeze=False)[:, 0]
    axes = above.subplots(len(heights), columns, sharex=True, height_ratios=heights, squeeze=False)
    curves = fine_curves(result)
    for j, name in enumerate(outputs):
        row, column = 2 * (j // columns), j % columns
        draw_signal(result, name, axes[row, column], curves)
        draw_residuals(result, name, axes[row + 1, column])
    for j, name in enumerate(inputs):
        draw_input(result, name, axes[2 * signals + j // columns, j % columns])
    for column in axes.T:
        drawn = [ax for ax in column if ax.has_data() or ax.texts]
        drawn[-1].tick_params(labelbottom=True)
        drawn[-1].set_xlabel(result.records[0].axis.word)
        for ax in set(column) - set(drawn):
            ax.remove()
        figure.align_ylabels(drawn)
    _legend(result, above)
    draw_parameters(result, below.subplots())
    return figure


def fine_curves(result: Fit) -> tuple[Trajectory, ...]:
    """The model at the times of each record, and between them where the integrator allows it."""
    return tuple(_fine(result, k) for k in range(len(result.simulations)))


def draw_signal(result: Fit, name: str, axes: Axes, curves: Sequence[Trajectory]) -> None:
    """Measured samples (points) of an output and the fitted model (lines) over time."""
    j = result.model.outputs.index(name)
    for k, record in enumerate(result.records):
        if name in record.outputs:
            axes.plot(_times(record, record.t), record.outputs[name], **_mark(result, k))
    for k, (record, curve) in enumerate(zip(result.records, curves, strict=False)):
        axes.plot(_times(record, curve.t), curve.y[:, j], **_line(result, k, len(curve.t)))
    _finish(axes, name)


def draw_residuals(result: Fit, name: str, axes: Axes) -> None:
    """Model minus measured over time, in a band of ± 2σ: as stated, or twice the rms of this output."""
    j = result.model.outputs.index(name)
    found = [
        (k, record, run.y[:, j] - record.outputs[name])
        for k, (record, run) in enumerate(zip(result.records, result.simulations, strict=False))
        if not np.isnan(record.outputs.get(name, np.nan)).all()
    ]
    if not found:
        words = "nothing measured" if result.simulations else "the states diverge: no residuals"
        axes.text(0.5, 0.5, words, ha="center", va="center", transform=axes.transAxes, fontsize=TEXT)
    rms = np.sqrt(np.nanmean(np.concatenate([r for *_, r in found]) ** 2)) if found else np.nan
    for k, record, r in found:
        sigma = (record.sigma or result.errors or {}).get(name, rms)
        band = np.broadcast_to(2 * np.asarray(sigma), record.t.shape)
        axes.fill_between(_times(record, record.t), -band, band, color=BAND, lw=0, zorder=0.5)
        axes.plot(_times(record, record.t), r, **_mark(result, k))
    axes.axhline(0.0, color=QUIET, lw=0.8)
    _finish(axes, "residual")


def draw_input(result: Fit, name: str, axes: Axes) -> None:
    """A measured input of each record over time."""
    for k, record in enumerate(result.records):
        axes.plot(_times(record, record.t), record.inputs[name], **_line(result, k, len(record)))
    _finish(axes, f"input {name}")


def draw_parameters(result: Fit, axes: Axes) -> None:
    """Parameters with their 95 % intervals, below how the search ended."""
    estimate = result.estimate
    std = np.full(len(result.parameters), np.nan) if estimate.std is None else estimate.std
    half = (estimate.coverage_factor or np.nan) * std
    words = ["no interval" if np.isfinite(value) else "not determined" for value in result.values]
    draw_intervals(axes, [*zip(result.parameters, result.values.tolist(), half.tolist(), words, strict=True)])
    state = "converged" if result.converged else "not converged"
    axes.set_title(f"{result.method}: {state} after {counted(result.iterations, 'iteration')}", fontsize=TEXT)


def _legend(result: Fit, above: SubFigure) -> None:
    """What marks, lines and the band are, above all axes; records by their marks and lines."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    names = record_names([record.name for record in result.records])
    stated = result.errors or any(record.sigma for record in result.records)
    band = "residual = model − measured, ± " + ("2σ" if stated else "2 rms")
    looks = [{**_mark(result, k), **_line(result, k, 2)} for k in range(len(names))]
    keys: list[Artist] = [
        Line2D([], [], label=name, **style) for name, style in zip(names, looks, strict=True)
    ]
    title = f"points: measured, lines: model; {band}"
    if len(names) == 1:
        points, line = _mark(result, 0), _line(result, 0, 2)
        keys = [Line2D([], [], label="measured", **points), Line2D([], [], label="model", **line)]
        keys.append(Patch(color=BAND, label=band))
        title = ""
    elif len(names) > MANY:
        keys[MANY:] = [Line2D([], [], ls="", label=f"and {len(names) - MANY} more records")]
    longest = max(len(str(key.get_label())) for key in keys)
    columns = max(1, min(4, 150 // (longest + 10)))
    style = {"frameon": False, "fontsize": TEXT, "title_fontsize": TEXT}
    above.legend(loc="outside upper center", ncols=columns, handles=keys, title=title, **style)


def _times(record: Record, t: FloatArray) -> FloatArray:
    return np.asarray(record.axis.scale * t)


def _mark(result: Fit, k: int) -> dict[str, Any]:
    """Points of a record; of a single one in grey, so that the line of the model is seen on them."""
    number = len(result.records[k])
    size = 5.0 if number <= 60 else 3.0 if number <= 400 else 2.0
    color = DARK if len(result.records) == 1 else look(k)["color"]
    return {"linestyle": "", "marker": MARKERS[k % len(MARKERS)], "color": color, "ms": size, "alpha": 0.6}


def _line(result: Fit, k: int, number: int) -> dict[str, Any]:
    """Line of a record; a single value is a dash, as a line through it would not show."""
    style = look(k) if len(result.records) > 1 else {"color": BLUE, "linestyle": "-"}
    return {**style, "lw": 1.3, "alpha": 1.0, **({"marker": "_", "ms": 22.0} if number == 1 else {})}


def _finish(axes: Axes, name: str) -> None:
    """Name with its unit, powers of ten but no offsets, and room where all values are nearly the same."""
    axes.set_ylabel(f"{name}, \nmodel unit", fontsize=TEXT)
    axes.ticklabel_format(axis="y", style="sci", scilimits=(-3, 4), useMathText=True, useOffset=False)
    axes.tick_params(labelsize=TEXT)
    plain(axes)
    low, high = axes.dataLim.intervaly
    size = max(abs(low), abs(high))
    if np.isfinite(size) and size > 0 and high - low < 1e-6 * size:
        axes.set_ylim((low + high) / 2 - 0.1 * size, (low + high) / 2 + 0.1 * size)


def _fine(result: Fit, k: int) -> Trajectory:
    from rotorid.identify.simulate import STEPWISE, simulate

    record, run = result.records[k], result.simulations[k]
    if run.integrator in STEPWISE or len(record) == 1 or len(record) >= CURVE_POINTS:
        return run
    try:
        return simulate(result.models[k], result.estimate.solution, _refined(record))
    except ValueError:
        return run


def _refined(record: Record) -> Record:
    """The same record with more times, inputs on straight lines."""
    from rotorid.identify.records import Record

    t = np.unique(np.concatenate((record.t, np.linspace(record.t[0], record.t[-1], CURVE_POINTS))))
    # a step that is rounding alone would be no step for an integrator
    t = t[np.diff(t, prepend=-np.inf) > 1e-9 * max(1e-300, float(np.ptp(record.t)))]
    return Record(t, inputs={name: np.interp(t, record.t, u) for name, u in record.inputs.items()})
