"""The drawings of the documentation: conventions and spots, by the sheet's functions where it has them."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from balancing import Labels
from rotorid.report.conventions_explained import phase_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BLUE, ORANGE = "#0072b2", "#d55e00"
"""Told apart by the colour-blind, too; what they mean is written beside them."""


def svg(name: str) -> bytes:
    """A drawing as SVG, the same bytes every time.

    Raises
    ------
    KeyError
        For a name that is not in `DRAWINGS`.
    """
    import matplotlib

    target = io.BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": name, "font.size": 9.0}):
        DRAWINGS[name]().savefig(target, format="svg", metadata={"Date": None})
    return target.getvalue()


def turning() -> Figure:
    """The rotor at the time t, with every angle of docs/conventions.md."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.4, 4.2))
    ax = figure.add_axes((0, 0, 1, 1))
    _end(ax, (-2.6, 2.8), (-2.1, 2.1))
    time, alpha, beta, kappa = np.radians([40.0, 55.0, 150.0, -40.0])
    _ray(ax, 0.0, (0.0, 2.35), color="0.4", ls="--")
    _text(ax, 2.45, 0.0, "x")
    _ray(ax, time, (0.0, 1.0))
    ax.plot(np.cos(time), np.sin(time), marker=(3, 0, np.degrees(time) + 90), color="black", ms=10)
    _text(ax, 1.32, time, "mark")
    _ray(ax, time + alpha, (0.0, 0.88), color=ORANGE)
    _dot(ax, 0.88, time + alpha)
    _text(ax, 1.16, time + alpha, "weight", color=ORANGE)
    _arc(ax, 0.42, (0.0, time), "ωt")
    _arc(ax, 0.6, (time, time + alpha), "α", color=ORANGE)
    _arc(ax, 1.75, (0.0, beta), "β", color=BLUE)
    _ray(ax, beta, (1.12, 1.34), color=BLUE, lw=6)
    _text(ax, 2.05, beta, "probe\n(fixed)", color=BLUE)
    _arc(ax, 1.75, (0.0, kappa), "κ", color="0.35")
    _ray(ax, kappa, (1.12, 1.34), color="0.35", lw=6)
    _text(ax, 2.1, kappa - 0.1, "key phasor (fixed),\nhere with κ below 0", color="0.35")
    _arc(ax, 0.8, (np.radians(195), np.radians(285)))
    _text(ax, 0.5, np.radians(235), "rotation")
    return figure


def amplitudes() -> Figure:
    """Two turns of a reading: peak, peak to peak and rms."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.2, 2.0), layout="constrained")
    ax = figure.add_subplot()
    turn = np.linspace(0.0, 2.0, 400)
    rms = float(np.sqrt(0.5))
    ax.plot(turn, np.cos(2 * np.pi * turn), color="black")
    for level, far in ((1.0, 3.4), (rms, 2.2), (0.0, 4.0), (-1.0, 3.4)):
        ax.plot([0.0 if level == 0 else 1.0, far], [level, level], color="0.6", lw=0.7)
    for at, low, high, words in (
        (2.15, 0.0, rms, "rms\n7.07 µm rms"),
        (2.9, 0.0, 1.0, "peak\n10 µm"),
        (3.35, -1.0, 1.0, "peak to peak\n20 µm pp"),
    ):
        ax.annotate("", (at, high), (at, low), arrowprops={"arrowstyle": "<|-|>", "color": BLUE})
        ax.text(at + 0.06, 0.4 if high + low else -0.4, words, color=BLUE, va="center")
    ax.set(xlim=(-0.02, 4.0), ylim=(-1.1, 1.1))
    ax.axis("off")
    return figure


def spots() -> Figure:
    """Heavy spot and high spot far below, at and far above a critical speed, and where the weight belongs."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.9, 2.9))
    for i, (lag, words) in enumerate(
        ((12, "far below the critical speed"), (90, "at it"), (168, "far above it"))
    ):
        ax = figure.add_axes((i / 3, 0.0, 1 / 3, 0.86))
        _end(ax, (-1.45, 1.45), (-1.3, 1.3))
        heavy, high = np.radians(90.0), np.radians(90.0 - lag)
        _dot(ax, 0.86, heavy)
        _text(ax, 1.17, heavy, "heavy spot", color=ORANGE)
        ax.plot(0, -0.86, "s", color="black", ms=9, mfc="white")
        _text(ax, 1.17, -heavy, "weight to mount")
        _ray(ax, high, (0.0, 0.75), color=BLUE, lw=2)
        _text(ax, 0.75, high, "●", color=BLUE)
        ax.text(0.34, {12: 0.3, 90: -0.25, 168: -0.4}[lag], "high\nspot", color=BLUE, va="center")
        if lag > 30:
            _arc(ax, 0.28, (heavy, high), color="0.35")
        figure.text((i + 0.5) / 3, 0.88, f"{words}:\nlag {lag}°", ha="center", va="bottom")
    return figure


def _end(ax: Axes, across: tuple[float, float], up: tuple[float, float]) -> None:
    """The end of a rotor as a circle of radius 1."""
    from matplotlib.patches import Circle

    ax.set_aspect("equal")
    ax.set(xlim=across, ylim=up)
    ax.axis("off")
    ax.add_patch(Circle((0, 0), 1.0, fc="white", ec="black", lw=1.4))


def _ray(
    ax: Axes, angle: float, ends: tuple[float, float], *, color: str = "black", ls: str = "-", lw: float = 1.2
) -> None:
    way = np.array(ends)
    ax.plot(way * np.cos(angle), way * np.sin(angle), color=color, ls=ls, lw=lw, solid_capstyle="butt")


def _dot(ax: Axes, radius: float, angle: float) -> None:
    ax.plot(radius * np.cos(angle), radius * np.sin(angle), "o", color=ORANGE, ms=9)


def _text(ax: Axes, radius: float, angle: float, words: str, *, color: str = "black") -> None:
    ax.text(radius * np.cos(angle), radius * np.sin(angle), words, color=color, ha="center", va="center")


def _arc(
    ax: Axes, radius: float, ends: tuple[float, float], words: str = "", *, color: str = "black"
) -> None:
    """An arc with an arrow at its end and a word beside it."""
    around = np.linspace(*ends, 60)
    x, y = radius * np.cos(around), radius * np.sin(around)
    ax.plot(x[:-2], y[:-2], color=color, lw=1.2)
    ax.annotate(
        "", (x[-1], y[-1]), (x[-4], y[-4]), arrowprops={"arrowstyle": "-|>", "color": color, "lw": 1.2}
    )
    _text(ax, radius + 0.14, sum(ends) / 2, words, color=color)


def _phase(phase: str) -> Figure:
    """The sheet's drawing of a reading and its pulses."""
    figure = phase_figure(Labels(phase=phase))  # type: ignore[arg-type]
    for text in figure.axes[0].texts:
        text.set_fontsize(9.0)
        text.set_bbox({"fc": "white", "ec": "none", "pad": 1.0})
    return figure


def _counted(left: tuple[str, int, int], right: tuple[str, int, int]) -> Figure:
    """Two ends of a rotor: words, and how rotation and angles turn on the paper, 1 counter-clockwise."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 3.3))
    for i, (words, rotation, angles) in enumerate((left, right)):
        ax = figure.add_axes((i / 2, 0.0, 0.5, 0.86))
        _end(ax, (-1.75, 1.75), (-1.4, 1.4))
        ax.plot(1.0, 0.0, marker=(3, 0, 90), color="black", ms=10)
        for degrees, beside in ((0, "mark, 0°"), (90, "90°"), (180, "180°"), (270, "270°")):
            way = np.radians(degrees * angles)
            _ray(ax, way, (0.95, 1.0))
            _text(ax, 1.38 if degrees == 0 else 1.2, way, beside)
        weight = np.radians(60.0) * angles
        _ray(ax, 0.0, (0.0, 0.9), color="0.4", ls="--")
        _ray(ax, weight, (0.0, 0.8), color=ORANGE)
        _dot(ax, 0.84, weight)
        _arc(ax, 0.5, (0.0, weight), "60°", color=ORANGE)
        around = np.pi + np.radians([-55.0, 55.0]) * rotation
        _arc(ax, 0.78, (around[0], around[1]))
        _text(ax, 0.4, np.pi, "rotation")
        figure.text((i + 0.5) / 2, 0.88, words, ha="center", va="bottom")
    return figure


DRAWINGS: dict[str, Callable[[], Figure]] = {
    "turning": turning,
    "lag": lambda: _phase("lag"),
    "lead": lambda: _phase("lead"),
    "amplitudes": amplitudes,
    "angles": lambda: _counted(("with the rotation", 1, 1), ("against the rotation", 1, -1)),
    "ends": lambda: _counted(
        ("seen from the drive end:\nthe rotor turns clockwise", -1, -1),
        ("seen from the free end:\nthe rotor turns counter-clockwise", 1, 1),
    ),
    "spots": spots,
}
"""Drawings by name."""
