"""Picture of estimated values with their intervals, whatever units they have."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.plot_style import DARK, TEXT, plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ROOM = (0.6, 0.26)
"""Inches that such a picture needs, and that each value adds."""


def draw_intervals(axes: Axes, intervals: Sequence[tuple[str, float, float, str]]) -> None:
    """Draw intervals, each in percent of its own value, from the first value at the top.

    Parameters
    ----------
    axes
        Where.
    intervals
        Name, value, half width of the interval, and what is said where one of the two is NaN.
    """
    percent = [100 * half / abs(value) if value else np.nan for _, value, half, _ in intervals]
    widest = max((share for share in percent if np.isfinite(share)), default=0.0)
    for i, ((_, value, _, words), share) in enumerate(zip(intervals, percent, strict=True)):
        bounded = np.isfinite(share)
        if np.isfinite(value):
            face = DARK if bounded else "none"
            axes.errorbar(0.0, i, xerr=share if bounded else None, fmt="o", color=DARK, mfc=face, capsize=4)
        text = f"± {share:.2g} %" if bounded else words
        axes.text(1.02, i, text, va="center", transform=axes.get_yaxis_transform(), fontsize=TEXT)
    names = [f"{name} = {value:.4g}" if np.isfinite(value) else name for name, value, *_ in intervals]
    axes.set_yticks(range(len(intervals)), names)
    axes.set(xlim=(-1.15, 1.15), ylim=(len(intervals) - 0.4, -0.6))
    if widest:
        axes.set(xlim=(-1.15 * widest, 1.15 * widest), xlabel="95 % interval, % of the value")
        axes.locator_params(axis="x", nbins=6)
        axes.ticklabel_format(axis="x", scilimits=(-2, 4), useMathText=True)
    else:
        axes.set_xticks([])
    plain(axes)
