"""Pictures of a fit to time records. Nothing is shown or saved: functions draw on axes.

Legends stand below the axes, where they cover no curve; give the figure the layout "constrained".
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.arrays import BoolArray, FloatArray
from rotorid.base.plot_style import COLORS
from rotorid.base.text import counted

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rotorid.timedomain.integration.simulate import Trajectory
    from rotorid.timedomain.models.record import Record
    from rotorid.timedomain.result import Fit


CURVE_POINTS = 600
MANY = 8
"""Outputs, parameters or records that a legend still names."""
STYLES: tuple[str | tuple[int, tuple[int, ...]], ...] = (
    "-",
    "--",
    ":",
    "-.",
    (0, (8, 2)),
    (0, (4, 1, 1, 1, 1, 1)),
    (0, (1, 4)),
    (0, (8, 4, 2, 4)),
)
MARKS = ("o", "s", "^", "D", "v", "P", "X", "*")
UNLIKE = 20.0
"""Ratio of sizes above which curves on one plain scale cannot be read together."""
FLOOR = 1e-4
"""Smallest sensitivity that a logarithmic axis shows, relative to the largest."""
ROUNDING = 1e-13
"""Residuals relative to the output that are rounding errors, and not enlarged."""
FAR = 1e6
"""Ratio to the last value beyond which iterations are drawn at this ratio."""


def figure_fit(result: Fit) -> Figure:
    """All about a fit: record and model, residuals, sensitivities, iterations of the parameters."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.5, 8.5), layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=(3, 2))
    above = figure.add_subplot(grid[0, 0])
    curves = fine_curves(result)
    draw_records(result, above, curves)
    draw_residuals(result, figure.add_subplot(grid[1, 0], sharex=above))
    draw_sensitivities(result, figure.add_subplot(grid[0, 1]), curves)
    draw_iterations(result, figure.add_subplot(grid[1, 1]))
    return figure


def fine_curves(result: Fit) -> tuple[Trajectory, ...]:
    """Model and sensitivities of each record, smooth where the integrator allows it."""
    return tuple(_fine(result, k) for k in range(len(result.simulations)))


def draw_records(result: Fit, axes: Axes, curves: Sequence[Trajectory] | None = None) -> None:
    """Measured samples (points) and the fitted model (lines) over time.

    Outputs of very different size are drawn over their largest measured value, which the legend gives.
    """
    curves = fine_curves(result) if curves is None else curves
    scales, unlike = _scales(result)
    for k, record in enumerate(result.records):
        for j, (name, scale) in enumerate(_named(result, scales)):
            if name in record.outputs:
                measured = record.outputs[name] / scale
                axes.plot(record.t, measured, _mark(k), color=_color(j), ms=_size(record), alpha=0.5)
            if k < len(curves):
                y = curves[k].y[:, j] / scale
                axes.plot(curves[k].t, y, color=_color(j), **_line(k, y))
    axes.set(xlabel="t, s", ylabel="output / largest value" if unlike else "output")
    axes.set_title("measured (points) and fitted model (lines)", fontsize=10)
    _plain_numbers(axes)
    words = [f"{name} ({_short(s)})" if unlike else name for name, s in _named(result, scales)]
    _legend(axes, _colored(words) + _record_keys(result, lines=bool(curves)))


def draw_residuals(result: Fit, axes: Axes) -> None:
    """Model minus measured, over time; over the rms of each output where these are very different."""
    rms, sizes, unlike = _residual_sizes(result)
    for k, j, r in _residuals(result):
        t = result.records[k].t
        axes.plot(t, r / sizes[j], _mark(k), color=_color(j), ms=2.5 if len(t) > 60 else 4.0)
    axes.axhline(0.0, color="0.6", lw=0.8)
    axes.set(xlabel="t, s", ylabel="(model − measured) / own rms" if unlike else "model − measured")
    one = f"residuals (rms {result.residual_rms:.3g})"
    axes.set_title("residuals, each output over its own rms" if unlike else one, fontsize=10)
    _plain_numbers(axes)
    if not result.simulations:
        _say(axes, "the states diverge with the last values:\nno residuals")
        return
    words = list(result.model.outputs)
    if unlike:
        notes = [
            "" if size == own or own == 0 else ": rounding" for size, own in zip(sizes, rms, strict=True)
        ]
        words = [
            f"{n} (rms {_short(s)}{note})" for (n, s), note in zip(_named(result, rms), notes, strict=True)
        ]
    _legend(axes, _colored(words, line="", mark="o") + _record_keys(result, lines=False))


def draw_sensitivities(result: Fit, axes: Axes, curves: Sequence[Trajectory] | None = None) -> None:
    """How much the outputs change, all together, per 1 % of each parameter, over time.

    The root of the sum of squares over the outputs, each over its largest value if sizes are very different.
    Logarithmic where one parameter acts much more than another.
    """
    curves = fine_curves(result) if curves is None else curves
    axes.set_title("sensitivity: effect of 1 % of each parameter", fontsize=10)
    axes.set_xlabel("t, s")
    if not curves:
        axes.set_xticks([])
        _say(axes, "the states diverge with the last values:\nno sensitivities")
        return
    unlike = _scales(result)[1]
    effects = [_effects(result, curve) for curve in curves]
    largest = np.max([effect.max(axis=0) for effect in effects], axis=0)
    top = float(largest.max())
    acting = largest[largest > 0]
    logarithmic = bool(acting.size and top > UNLIKE * acting.min())
    for k, (curve, effect) in enumerate(zip(curves, effects, strict=True)):
        # just below the frame: a curve that falls below the floor leaves the picture
        drawn = np.maximum(effect, FLOOR / 2 * top) if logarithmic else effect
        for i in np.flatnonzero(effect.any(axis=0)).tolist():
            axes.plot(curve.t, drawn[:, i], color=_color(i), **_line(k, drawn[:, i]))
    axes.set_ylabel("change of outputs" + (" / largest value" if unlike else "") + "\n(root sum of squares)")
    if logarithmic:
        axes.set_yscale("log")
        axes.set_ylim(FLOOR * top, 2 * top)
        axes.grid(alpha=0.3)
    else:
        _plain_numbers(axes)
    if not acting.size:
        axes.set_xticks([])
        _say(axes, "no output depends on any parameter")
    words = _effect_words(result, largest, logarithmic)
    _legend(axes, _colored(words, shown=largest > 0) + _record_keys(result, marks=False))


def draw_iterations(result: Fit, axes: Axes) -> None:
    """Parameters after each iteration, relative to the last value; those not determined are left out."""
    steps = np.arange(len(result.history))
    known = ~np.isnan(result.values)
    words, far = [], 1.0
    for i, name in enumerate(result.parameters):
        values, word = _relative(result.history[:, i], name)
        words.append(word if known[i] else f"{name}: not determined")
        if known[i]:
            far = max(far, float(np.nanmax(np.abs(values), initial=0.0)))
            axes.plot(steps, values, "o-", color=_color(i), ms=4, lw=1.2)
    if known.any():
        axes.axhline(1.0, color="0.6", lw=0.8)
    _plain_numbers(axes)
    wide = far > UNLIKE
    if wide:
        _linear_near_the_end(axes, far)
    axes.set_xlim(-0.3, max(1, len(steps) - 1) + 0.3)
    axes.locator_params(axis="x", integer=True)
    axes.set(xlabel="iteration", ylabel="value / last value" + ("\n(logarithmic beyond ±2)" if wide else ""))
    state = "converged" if result.converged else "not converged"
    axes.set_title(f"{result.method}: {state} after {counted(result.iterations, 'iteration')}", fontsize=10)
    if not known.any():
        _say(axes, "no parameter by itself is determined\nby these data")
    _legend(axes, _colored(words, mark="o", shown=known))


def _named(result: Fit, sizes: FloatArray) -> list[tuple[str, float]]:
    return list(zip(result.model.outputs, sizes.tolist(), strict=True))


def _largest(result: Fit) -> FloatArray:
    """Largest measured value of each output; of the model where nothing was measured."""
    sizes = np.zeros(len(result.model.outputs))
    for j, name in enumerate(result.model.outputs):
        measured = [np.abs(record.outputs[name]) for record in result.records if name in record.outputs]
        found = measured or [np.abs(run.y[:, j]) for run in result.simulations]
        sizes[j] = max((np.nanmax(part, initial=0.0) for part in found), default=0.0)
    return sizes


def _scales(result: Fit) -> tuple[FloatArray, bool]:
    """What outputs are drawn over: their largest values where these are very different, and whether."""
    sizes = _largest(result)
    unlike = _unlike(sizes)
    return np.where((sizes > 0) & unlike, sizes, 1.0), unlike


def _residuals(result: Fit) -> Iterator[tuple[int, int, FloatArray]]:
    """Record, output, and model minus measured of every measured series."""
    for k, (record, run) in enumerate(zip(result.records, result.simulations, strict=False)):
        for j, name in enumerate(result.model.outputs):
            if name in record.outputs:
                yield k, j, run.y[:, j] - record.outputs[name]


def _residual_sizes(result: Fit) -> tuple[FloatArray, FloatArray, bool]:
    """Rms of the residuals of each output, what they are drawn over, and whether that is the rms."""
    squares, counts = np.zeros((2, len(result.model.outputs)))
    for _, j, r in _residuals(result):
        squares[j] += np.nansum(r**2)
        counts[j] += np.count_nonzero(~np.isnan(r))
    rms = np.sqrt(squares / np.maximum(counts, 1))
    largest = _largest(result)
    real = rms > ROUNDING * largest
    unlike = _unlike(rms[real]) or _unlike(largest)
    return rms, np.where(real & unlike, rms, np.where((largest > 0) & unlike, largest, 1.0)), unlike


def _unlike(sizes: FloatArray) -> bool:
    some = sizes[sizes > 0]
    return bool(some.size and some.max() > UNLIKE * some.min())


def _effects(result: Fit, curve: Trajectory) -> FloatArray:
    """Change of all outputs together by 1 % of each parameter, by 0.01 where it is 0, (n, n_p)."""
    size = np.abs(result.estimate.solution)
    steps = 0.01 * np.where(size > 0, size, 1.0)
    return np.asarray(np.linalg.norm(curve.y_theta / _scales(result)[0][:, None] * steps, axis=1))


def _effect_words(result: Fit, largest: FloatArray, logarithmic: bool) -> list[str]:
    words, known = [], ~np.isnan(result.values)
    for i, name in enumerate(result.parameters):
        notes = [] if known[i] else ["not determined"]
        if result.estimate.solution[i] == 0:
            notes.append("by 0.01")
        if largest[i] == 0:
            notes.append("no effect")
        elif logarithmic and largest[i] < FLOOR * largest.max():
            notes.append(f"at most {largest[i]:.1g}")
        words.append(f"{name} ({', '.join(notes)})" if notes else name)
    return words


def _relative(history: FloatArray, name: str) -> tuple[FloatArray, str]:
    """Values over the last one, at most `FAR`; over the largest where the last one is 0."""
    last, word = float(history[-1]), name
    if last == 0:
        last = float(np.nanmax(np.abs(history))) or 1.0
        word = f"{name} / {last:.3g} (ends at 0)"
    with np.errstate(over="ignore"):
        values: FloatArray = history / last
    if np.nanmax(np.abs(values)) > FAR:
        word += f" (cut at ±{FAR:.0e})".replace("e+0", "e")
    return np.clip(values, -FAR, FAR), word


def _linear_near_the_end(axes: Axes, far: float) -> None:
    """A symmetric logarithmic axis, linear up to twice the last value."""
    axes.set_yscale("symlog", linthresh=2.0, linscale=1.5)
    most = int(np.ceil(np.log10(far)))
    powers = range(2 if most > 3 else 1, most + 1, 2 if most > 3 else 1)
    places = {-2.0: "−2", -1.0: "−1", 0.0: "0", 1.0: "1", 2.0: "2"}
    for n in powers:
        places |= {10.0**n: f"$10^{{{n}}}$", -(10.0**n): f"$-10^{{{n}}}$"}
    axes.set_yticks(list(places), list(places.values()))
    low, high = axes.dataLim.intervaly
    axes.set_ylim(1.5 * low if low < -1 else low - 0.3, 1.5 * high if high > 1 else high + 0.3)


def _fine(result: Fit, k: int) -> Trajectory:
    from rotorid.timedomain.integration.simulate import simulate

    record, run = result.records[k], result.simulations[k]
    if run.method in ("heun", "rk4") or len(record) == 1 or len(record) >= CURVE_POINTS:
        return run
    try:
        return simulate(result.models[k], result.estimate.solution, _refined(record))
    except ValueError:
        return run


def _refined(record: Record) -> Record:
    """The same record with more times, inputs on straight lines."""
    from rotorid.timedomain.models.record import Record

    t = np.unique(np.concatenate((record.t, np.linspace(record.t[0], record.t[-1], CURVE_POINTS))))
    # a step that is rounding alone would be no step for an integrator
    t = t[np.diff(t, prepend=-np.inf) > 1e-9 * max(1e-300, float(np.ptp(record.t)))]
    return Record(t, inputs={name: np.interp(t, record.t, u) for name, u in record.inputs.items()})


def _color(i: int) -> str:
    return COLORS[i % len(COLORS)]


def _mark(k: int) -> str:
    return MARKS[k % len(MARKS)]


def _size(record: Record) -> float:
    return 4.0 if len(record) <= 60 else 3.0 if len(record) <= 400 else 2.0


def _line(k: int, values: FloatArray) -> dict[str, Any]:
    """Style of the lines of one record; a single value is a dash, as a line through it would not show."""
    mark = "_" if len(values) == 1 else None
    return {"ls": STYLES[k % len(STYLES)], "lw": 1.2, "marker": mark, "ms": 22.0}


def _plain_numbers(axes: Axes) -> None:
    """Powers of ten but no offsets at the axis, and room where all values are nearly the same."""
    axes.ticklabel_format(axis="y", style="sci", scilimits=(-2, 3), useMathText=True, useOffset=False)
    axes.grid(alpha=0.3)
    low, high = axes.dataLim.intervaly
    size = max(abs(low), abs(high))
    if np.isfinite(size) and size > 0 and high - low < 1e-6 * size:
        axes.set_ylim((low + high) / 2 - 0.1 * size, (low + high) / 2 + 0.1 * size)


def _colored(
    words: Sequence[str], line: str = "-", mark: str = "", shown: BoolArray | None = None
) -> list[Artist]:
    """Keys of colors, one for each word, without line and mark where nothing is `shown`."""

    def style(i: int) -> dict[str, Any]:
        seen = shown is None or bool(shown[i])
        return {"ls": line if seen else "", "marker": mark if seen else "", "color": _color(i)}

    return _keys(words, style, "more")


def _record_keys(result: Fit, *, lines: bool = True, marks: bool = True) -> list[Artist]:
    """Keys of marks and line styles, one for each of several records."""
    names = record_names([record.name for record in result.records])
    if len(names) < 2:
        return []

    def style(k: int) -> dict[str, Any]:
        return {"ls": STYLES[k] if lines else "", "marker": _mark(k) if marks else "", "color": "0.25"}

    return _keys(names, style, "more records")


def _keys(words: Sequence[str], style: Callable[[int], dict[str, Any]], rest: str) -> list[Artist]:
    """At most `MANY`, and how many more there are."""
    from matplotlib.lines import Line2D

    keys: list[Artist] = [
        Line2D([], [], ms=4.0, lw=1.2, label=word, **style(i)) for i, word in enumerate(words[:MANY])
    ]
    if len(words) > MANY:
        keys.append(Line2D([], [], ls="", label=f"and {len(words) - MANY} {rest}"))
    return keys


def record_names(names: Sequence[str]) -> list[str]:
    """Short names of records that tell them apart: ends of paths, numbers where they are the same.

    Examples
    --------
    >>> record_names(["a/run_1.csv", "a/run_2.csv"]), record_names(["a/x.csv", "b/x.csv"])
    (['run_1.csv', 'run_2.csv'], ['a/x.csv', 'b/x.csv'])
    >>> record_names(["the record", "the record"])
    ['record 1', 'record 2']
    """
    if len(set(names)) < len(names):
        return [f"record {k + 1}" for k in range(len(names))]
    parts = [PurePath(name).parts or (name,) for name in names]
    for depth in range(1, max(len(part) for part in parts) + 1):
        short = ["/".join(part[-depth:]) for part in parts]
        if len(set(short)) == len(short):
            return short
    return list(names)


def _legend(axes: Axes, keys: list[Artist]) -> None:
    """Below the axes and their label, in as many columns as fit."""
    from matplotlib.transforms import ScaledTranslation

    figure = axes.get_figure(root=True)
    if not keys or figure is None:
        return
    longest = max(len(str(key.get_label())) for key in keys)
    width = axes.get_position().width * figure.get_figwidth() * 72
    rows = max(1, -(-len(keys) // max(1, int(1.15 * width / (5.0 * longest + 38)))))
    axes.legend(
        handles=keys,
        loc="upper center",
        bbox_to_anchor=(0.5, 0.0),
        bbox_transform=axes.transAxes + ScaledTranslation(0, -34 / 72, figure.dpi_scale_trans),
        borderaxespad=0.0,
        frameon=False,
        fontsize=9,
        ncols=-(-len(keys) // rows),
        columnspacing=1.4,
    )


def _short(size: float) -> str:
    return f"{size:.3g}" if 0.01 <= size < 1e4 or size == 0 else f"{size:.1e}"


def _say(axes: Axes, text: str) -> None:
    """Words in an empty panel, which needs no numbers at its axis."""
    axes.set_yticks([])
    axes.text(0.5, 0.5, text, ha="center", va="center", transform=axes.transAxes, color="0.4")
