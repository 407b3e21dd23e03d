"""Pictures of a fit to time records. Nothing is shown or saved: functions draw on axes."""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.plot_style import (
    BLUE,
    DARK,
    MARKERS,
    QUIET,
    TEXT,
    legend_below,
    look,
    new_figure,
    plain,
)
from rotorid.base.text import counted
from rotorid.identify.records import refined
from rotorid.identify.simulation import STEPWISE, simulate

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rotorid.identify.result_records import Fit

CURVE_POINTS = 600
MANY = 8
"""Records that a legend names."""


def figure_fit(result: Fit) -> Figure:
    """All about a fit: each signal with the model and its residuals, the inputs, the parameters."""
    outputs, inputs = result.model.outputs, tuple(result.records[0].inputs)
    heights = [1.3, 0.9] * len(outputs) + [0.9] * len(inputs)
    parts = 0.9 + sum(heights), 0.8 + 0.26 * len(result.parameters)
    figure = new_figure(sum(parts))
    above, below = figure.subfigures(2, height_ratios=parts, squeeze=False)[:, 0]
    axes = above.subplots(len(heights), sharex=True, height_ratios=heights, squeeze=False)[:, 0]
    for name, upper, lower in zip(outputs, axes[::2], axes[1::2], strict=False):
        draw_signal(result, name, upper)
        draw_residuals(result, name, lower)
    for name, ax in zip(inputs, axes[2 * len(outputs) :], strict=True):
        for k, record in enumerate(result.records):
            ax.plot(record.axis.scale * record.t, record.inputs[name], **_styles(result, k)[1])
        _finish(ax, f"input {name}")
    axes[-1].set_xlabel(result.records[0].axis.word)
    figure.align_ylabels(axes)
    stated = any(record.sigma for record in result.records)
    title = f"points: measured, lines: model; residual = model − measured, ± {'2σ' if stated else '2 rms'}"
    more = len(result.records) - MANY
    title += f"; and {counted(more, 'more record')}" if more > 0 else ""
    legend_below(above, axes, 3, title=title)
    draw_parameters(result, below.subplots())
    return figure


def draw_signal(result: Fit, name: str, axes: Axes) -> None:
    """Measured samples (points) of an output and the fitted model (lines, fine between samples) over time."""
    names = [PurePath(record.name).name for record in result.records]
    for k, record in enumerate(result.records):
        label = names[k] if names.count(names[k]) == 1 else f"record {k + 1}"
        if name in record.outputs:
            mark = _styles(result, k)[0] | ({"label": label} if k < MANY else {})
            axes.plot(record.axis.scale * record.t, record.outputs[name], **mark)
    for k, (record, run) in enumerate(zip(result.records, result.simulations, strict=False)):
        if run.integrator not in STEPWISE and 1 < len(record) < CURVE_POINTS:
            finer, _ = refined(record, -(-CURVE_POINTS // (len(record) - 1)))
            run = simulate(result.models[k], result.estimate.solution, finer, sensitivities=False)
        y = run.y[:, result.model.outputs.index(name)]
        axes.plot(record.axis.scale * run.t, y, **_styles(result, k)[1])
    _finish(axes, name)


def draw_residuals(result: Fit, name: str, axes: Axes) -> None:
    """Model minus measured over time, in a band of ± 2σ: as stated, or twice the rms of this output."""
    j, runs = result.model.outputs.index(name), result.simulations
    residuals = {
        k: runs[k].y[:, j] - record.outputs[name]
        for k, record in enumerate(result.records if runs else ())
        if name in record.outputs
    }
    for k, r in residuals.items():
        record, rms = result.records[k], np.sqrt(np.nanmean(np.concatenate([*residuals.values()]) ** 2))
        band = 2 * np.broadcast_to((record.sigma or {name: rms})[name], len(record))
        t = record.axis.scale * record.t
        axes.fill_between(t, -band, band, color="#d9dde3", lw=0, zorder=0.5)
        axes.plot(t, r, **_styles(result, k)[0])
    axes.axhline(0.0, color=QUIET, lw=0.8)
    _finish(axes, "residual")
    axes.margins(y=0.1)


def draw_parameters(result: Fit, axes: Axes) -> None:
    """Parameters with their 95 % intervals in percent of each, below how the search ended."""
    values, n = result.values, len(result.parameters)
    half = np.full(n, np.nan) if result.ci95 is None else np.diff(result.ci95)[:, 0] / 2
    shares = 100 * half / np.where(values, np.abs(values), np.nan)
    axes.errorbar(0 * values, range(n), xerr=shares, fmt="o", color=DARK, capsize=4)
    beside, names = axes.get_yaxis_transform(), []
    for k, (name, value, share) in enumerate(zip(result.parameters, values, shares, strict=True)):
        words = "not determined" if np.isnan(value) else "no interval"
        words = f"± {share:.2g} %" if np.isfinite(share) else words
        axes.text(1.02, k, words, va="center", transform=beside, fontsize=TEXT)
        names.append(name if np.isnan(value) else f"{name} = {value:.4g}")
    axes.set_yticks(range(n), names)
    widest = 1.15 * max(filter(np.isfinite, shares), default=1.0)
    axes.set(xlim=(-widest, widest), ylim=(n - 0.4, -0.6), xlabel="95 % interval, % of the value")
    plain(axes)
    state = "converged" if result.converged else "not converged"
    axes.set_title(f"{result.method}: {state} after {counted(result.iterations, 'iteration')}", fontsize=TEXT)


def _styles(result: Fit, k: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """Points and line of a record; points of a single one are grey, and the line of one sample is a dash."""
    several, count = len(result.records) > 1, len(result.records[k])
    line = look(k) if several else {"color": BLUE}
    marks = {
        "linestyle": "",
        "marker": MARKERS[k % len(MARKERS)],
        "ms": 5.0 if count <= 60 else 2.5,
        "alpha": 0.6,
    }
    marks["color"] = line["color"] if several else DARK
    return marks, line | ({"marker": "_", "ms": 22.0} if count == 1 else {"lw": 1.3})


def _finish(axes: Axes, name: str) -> None:
    """Name with its unit, and powers of ten but no offsets."""
    axes.set_ylabel(f"{name}, \nas recorded", fontsize=TEXT)
    axes.ticklabel_format(axis="y", style="sci", scilimits=(-3, 4), useMathText=True, useOffset=False)
    axes.tick_params(labelsize=TEXT)
    plain(axes)
