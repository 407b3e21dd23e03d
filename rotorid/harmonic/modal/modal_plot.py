"""Picture of modes fitted to amplitudes: what was read around each resonance, and the fit to it."""

from __future__ import annotations

from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.plot_style import COLORS, MARKERS, TEXT, WARNING, legend_below, look, new_figure, plain
from rotorid.base.text import sentence
from rotorid.identify.plots import CURVE_POINTS, MODEL_UNIT, scale_amplitudes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rotorid.harmonic.modal.modal_result import FittedModes

MODES, POINTS, WARNINGS = 4, len(COLORS), 8
"""Most modes, points and lines of warnings of a picture."""
ROW, LINE, LETTERS = 2.2, 0.17, 105
"""Inches a mode and a line of words; letters of a line."""


def figure_modes(found: FittedModes) -> Figure:
    """A row a mode: readings and fit in the complex plane, where a mode is a circle, and over frequency."""
    k, omega, force = (
        min(len(found.ends), MODES),
        found.readings.answers.omega,
        found.experiments.signals.get("F"),
    )
    misfit = [r @ r / max(len(r), 1) for r in found.readings.each(0, found.fit.estimate.solution)]
    points = [int(p) for p in sorted(np.argsort(misfit)[-POINTS:])]
    seen = np.any([(low <= omega) & (omega <= high) for low, high in found.ends[:k]], axis=0)
    parts = (
        (k, len(found.ends), "modes"),
        (len(points), len(misfit), "points (that fit worst)"),
        (seen.sum(), len(seen), "frequencies (around resonances)"),
    )
    drawn = ", ".join(f"{part} of {whole} {words}" for part, whole, words in parts if part < whole)
    told = ["hollow: readings, joined with the fit at their frequencies", *[f"drawn: {drawn}"] * bool(drawn)]
    if force is not None and not np.allclose(force, force[0], rtol=1e-9, atol=0.0):
        told.append("all of it for the force at the lowest frequency")
    warned = [line for words in found.warnings for line in wrap(sentence(words), LETTERS)]
    warned[WARNINGS:] = ["…"] * (len(warned) > WARNINGS)
    columns = max(1, LETTERS // (9 + max(len(found.points[p]) for p in points)))
    figure = new_figure(ROW * k + LINE * (2 + len(warned) + len(told) + len(points) / columns))
    axes = figure.subplots(k, 2, squeeze=False, width_ratios=(2, 3))
    for mode, pair in enumerate(axes):
        _draw_mode(found, mode, points, *pair)
    figure.align_ylabels(axes)
    legend_below(figure, axes[:1, 0], columns, title="\n".join(told))
    figure.legends[0].get_title().set_multialignment("center")
    if warned:
        figure.suptitle("\n".join(warned), fontsize=TEXT, color=WARNING)
    return figure


def _draw_mode(found: FittedModes, mode: int, points: list[int], circle: Axes, peak: Axes) -> None:
    """What was read around a resonance, all of it for the force at the lowest frequency."""
    data, q, (low, high) = found.experiments, found.fit.estimate.solution, found.ends[mode]
    unit = next((data.units[name] for name in found.points if name in data.units), MODEL_UNIT)
    force = data.signals.get("F", np.ones(len(data)))
    rows, force = (data.frequencies >= low) & (data.frequencies <= high), force / force[0]
    omega, read = data.frequencies[rows], unit.scale * (found.readings.Z / force[:, None])[rows]
    grid = np.unique(np.concatenate((np.linspace(low, high, CURVE_POINTS), omega)))
    fit = found.readings.answers.at(grid).basis(q)[0] @ np.transpose(found.readings.each(2, q))
    fit = unit.scale * fit / np.interp(grid**2, data.frequencies**2, force)[:, None]
    for p, color, marker, line in zip(points, COLORS, MARKERS, map(look, range(POINTS)), strict=False):
        mark = {"ls": "", "marker": marker, "mfc": "none", "ms": np.clip(120 / len(omega), 3, 6)}
        z, x, ends = fit[:, p], read[:, p], np.stack((read[:, p], fit[np.searchsorted(grid, omega), p]))
        circle.plot(ends.real, ends.imag, color=color, linewidth=0.8)
        circle.plot(x.real, x.imag, label=found.points[p], color=color, **mark)
        circle.plot(z.real, z.imag, **line)
        peak.plot(data.axis.scale * omega, np.abs(x), color=color, **mark)
        peak.plot(data.axis.scale * grid, np.abs(z), **line)
    told = f"{data.axis.scale * q[mode]:.5g} {data.axis.word.rpartition(', ')[2]}"
    told = f": {told}, ζ = {100 * q[len(found.ends) + mode]:.3g} %" if not found.undetermined else ""
    circle.set_title(f"mode {mode + 1}{told}", loc="left", fontsize=TEXT)
    circle.set(xlabel=f"real part, {unit.word}", ylabel=f"imaginary part, {unit.word}")
    circle.set_aspect("equal", adjustable="datalim")
    circle.locator_params(nbins=4)
    peak.locator_params("x", nbins=6)
    peak.set(xlabel=data.axis.word, ylabel=f"amplitude, {unit.word}")
    plain(circle)
    scale_amplitudes(peak)
