"""Pictures of a fit to time records. Nothing is shown or saved: functions draw on axes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rotorid.timedomain.record import Record
    from rotorid.timedomain.result import Fit

FloatArray = NDArray[np.float64]

CURVE_POINTS = 600
MANY = 8
"""Outputs or parameters that a legend still names."""
STYLES = ("-", "--", ":", "-.")
MARKS = ("o", "s", "^", "D")


def figure_fit(result: Fit) -> Figure:
    """All about a fit: record and model, residuals, sensitivities, iterations of the parameters."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.5, 7.5), layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=(3, 2))
    above = figure.add_subplot(grid[0, 0])
    draw_records(result, above)
    draw_residuals(result, figure.add_subplot(grid[1, 0], sharex=above))
    above.set_xlabel("")
    draw_sensitivities(result, figure.add_subplot(grid[0, 1]))
    draw_iterations(result, figure.add_subplot(grid[1, 1]))
    return figure


def draw_records(result: Fit, axes: Axes) -> None:
    """Measured samples (points) and the fitted model (lines) over time."""
    for k, record in enumerate(result.records):
        t, curves = _curves(result, k)
        size = 4.0 if len(record.t) <= 60 else 2.0
        for color, j, name in _outputs(result):
            label = name if k == 0 else None
            measured = record.outputs.get(name)
            if measured is not None:
                mark, word = MARKS[k % len(MARKS)], label if curves is None else None
                axes.plot(record.t, measured, mark, color=color, ms=size, alpha=0.5, label=word)
            if curves is not None:
                axes.plot(t, curves[:, j], STYLES[k % len(STYLES)], color=color, lw=1.2, label=label)
    axes.set(xlabel="t, s", ylabel="output")
    axes.set_title("measured (points) and fitted model (lines)", fontsize=10)
    axes.grid(alpha=0.3)
    _legend(axes, len(result.model.outputs))


def draw_residuals(result: Fit, axes: Axes) -> None:
    """Model minus measured, over time."""
    for k, (record, run) in enumerate(zip(result.records, result.simulations, strict=False)):
        for color, j, name in _outputs(result):
            measured = record.outputs.get(name)
            if measured is not None:
                axes.plot(record.t, run.y[:, j] - measured, MARKS[k % len(MARKS)], color=color, ms=2.5)
    axes.axhline(0.0, color="0.6", lw=0.8)
    axes.ticklabel_format(axis="y", style="sci", scilimits=(-2, 3), useMathText=True)
    axes.set(xlabel="t, s", ylabel="model − measured")
    axes.set_title(f"residuals (rms {result.residual_rms:.3g})", fontsize=10)
    axes.grid(alpha=0.3)
    if not result.simulations:
        _say(axes, "the states diverge with the last values:\nno residuals")


def draw_sensitivities(result: Fit, axes: Axes) -> None:
    """How much the outputs change, all together, per 1 % of each parameter, over time."""
    from fem.plots import COLORS

    theta = result.estimate.solution
    for k, run in enumerate(result.simulations):
        for i, name in enumerate(result.parameters):
            scale = 0.01 * (abs(theta[i]) or 1.0)
            effect = scale * np.linalg.norm(run.y_theta[:, :, i], axis=1)
            label = name if k == 0 else None
            style = STYLES[k % len(STYLES)]
            axes.plot(run.t, effect, style, color=COLORS[i % len(COLORS)], lw=1.2, label=label)
    axes.set(xlabel="t, s", ylabel="change of the outputs")
    axes.ticklabel_format(axis="y", style="sci", scilimits=(-2, 3), useMathText=True)
    axes.set_title("sensitivity: effect of 1 % of each parameter", fontsize=10)
    axes.grid(alpha=0.3)
    if result.simulations:
        _legend(axes, len(result.parameters))
    else:
        _say(axes, "the states diverge with the last values:\nno sensitivities")


def draw_iterations(result: Fit, axes: Axes) -> None:
    """Parameters after each iteration, relative to the last value."""
    from fem.plots import COLORS

    steps = np.arange(len(result.history))
    for i, name in enumerate(result.parameters):
        last = result.history[-1, i]
        values = result.history[:, i] / (last or 1.0)
        axes.plot(steps, values, "o-", color=COLORS[i % len(COLORS)], ms=4, lw=1.2, label=name)
    axes.axhline(1.0, color="0.6", lw=0.8)
    axes.locator_params(axis="x", integer=True)
    axes.set(xlabel="iteration", ylabel="value / last value")
    state = "converged" if result.converged else "not converged"
    axes.set_title(f"{result.method}: {state} after {result.iterations} iterations", fontsize=10)
    axes.grid(alpha=0.3)
    _legend(axes, len(result.parameters))


def _outputs(result: Fit) -> list[tuple[str, int, str]]:
    """Color, index and name of every output."""
    from fem.plots import COLORS

    return [(COLORS[j % len(COLORS)], j, name) for j, name in enumerate(result.model.outputs)]


def _curves(result: Fit, k: int) -> tuple[FloatArray, FloatArray | None]:
    """Times and outputs of the fitted model for one record, smooth where the integrator allows it."""
    from rotorid.timedomain.simulate import simulate

    record = result.records[k]
    if k >= len(result.simulations):
        return record.t, None
    run = result.simulations[k]
    if run.method in ("heun", "rk4") or len(record.t) >= CURVE_POINTS:
        return run.t, run.y
    fine = _refined(record)
    try:
        return fine.t, simulate(result.model, result.estimate.solution, fine, sensitivities=False).y
    except ValueError:
        return run.t, run.y


def _refined(record: Record) -> Record:
    """The same record with more times, inputs on straight lines."""
    from rotorid.timedomain.record import Record

    t = np.unique(np.concatenate((record.t, np.linspace(record.t[0], record.t[-1], CURVE_POINTS))))
    # a step that is rounding alone would be no step for an integrator
    t = t[np.diff(t, prepend=-np.inf) > 1e-9 * max(1e-300, float(np.ptp(record.t)))]
    return Record(t, inputs={name: np.interp(t, record.t, u) for name, u in record.inputs.items()})


def _legend(axes: Axes, count: int) -> None:
    if count <= MANY:
        axes.legend(frameon=False, fontsize=9, ncols=1 if count <= 4 else 2)


def _say(axes: Axes, text: str) -> None:
    axes.text(0.5, 0.5, text, ha="center", va="center", transform=axes.transAxes, color="0.4")
