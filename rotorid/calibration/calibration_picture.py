"""Picture of a calibration: the numbers beside what was known of them, and what is left of the readings."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rotorid.calibration.calibrated_rotor import CalibratedRotor

_ROW, _LEAST = 0.24, 2.5
"""Height of a row and of the picture, in."""


def calibration_figure(result: CalibratedRotor) -> Figure:
    """Each number less its prior in prior deviations with its 95 % interval; residuals by row of the data."""
    from rotorid.base.plot_style import new_figure

    figure = new_figure(height=max(_LEAST, 1.4 + _ROW * len(result.names)))
    left, right = figure.subplots(1, 2, width_ratios=(3, 2))
    _numbers(result, left)
    _residuals(result, right)
    return figure


def _numbers(result: CalibratedRotor, ax: Axes) -> None:
    values = result.found.estimate.solution
    prior = [unknown.prior for unknown in result.unknowns]
    middle = np.array([p[0] if p else v for p, v in zip(prior, values, strict=True)])
    size = np.array([p[1] if p else s for p, s in zip(prior, result.std, strict=True)])
    size = np.where(np.nan_to_num(size) > 0, size, 1.0)
    rows = np.arange(len(values))
    known = np.array([p is not None for p in prior])
    ax.barh(rows[known], 3.92, 0.7, -1.96, color="0.88", label="known before (95 %)")
    spread = 1.96 * np.nan_to_num(result.std) / size
    ax.errorbar(
        (values - middle) / size, rows, xerr=spread, fmt="o", ms=4, capsize=2, label="calibrated (95 %)"
    )
    ax.set_yticks(rows, result.names)
    ax.invert_yaxis()
    ax.set_xlabel("change from what was known, in its deviations")
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, frameon=False)


def _residuals(result: CalibratedRotor, ax: Axes) -> None:
    r = np.sort(result.found.estimate.residuals)
    from scipy.special import ndtri

    expected = ndtri((np.arange(r.size) + 0.5) / r.size)
    reach = 1.1 * max(np.abs(r).max(), np.abs(expected).max())
    ax.plot([-reach, reach], [-reach, reach], color="0.6", lw=0.8)
    ax.plot(expected, r, "o", ms=3, fillstyle="none")
    ax.set_xlabel("expected of normal errors, in deviations")
    ax.set_ylabel("what is left, in deviations")
