"""Picture of a calibration: each number beside what was known of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rotorid.calibration.result import CalibratedRotor

_ROW = 0.24
"""Height of a row, in."""


def calibration_figure(result: CalibratedRotor) -> Figure:
    """95 % intervals before and after, in standard deviations of what was known, else of the estimate."""
    from rotorid.base.plot_style import legend_above, new_figure, plain

    values, std = result.fit.estimate.solution, np.nan_to_num(result.std)
    prior = [unknown.prior for unknown in result.unknowns]
    known = np.array([p is not None for p in prior])
    middle = np.array([p[0] if p else v for p, v in zip(prior, values, strict=True)])
    size = np.array([p[1] if p else s for p, s in zip(prior, std, strict=True)])
    size, rows = np.where(size > 0, size, 1.0), np.arange(len(values))
    figure = new_figure(height=1.2 + _ROW * len(values))
    ax = figure.add_subplot()
    ax.barh(rows[known], 3.92, 0.7, -1.96, color="0.88", label="known before, 95 %")
    ax.errorbar(
        (values - middle) / size,
        rows,
        xerr=1.96 * std / size,
        fmt="o",
        ms=4,
        capsize=2,
        label="calibrated, 95 %",
    )
    ax.set_yticks(rows, result.names)
    ax.set_ylim(len(values) - 0.3, -0.7)
    ax.set_xlabel("change, in standard deviations of what was known")
    plain(ax)
    legend_above(ax, 2)
    return figure
