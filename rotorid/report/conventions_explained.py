"""Conventions of a job explained on its sheet: words and two small figures, for who has only the sheet."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rotorid.files import units

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from balancing import Labels

_SAMPLE = 60.0
"""Angle, degrees, of the weight and of the phase that the figures show."""
_SIDE, _TALL, _FLAT, _INNER, _OUTER, _KEY = 2.45, 2.1, 1.6, 1.3, 1.52, 1.13
_ASSUMED = " Assumed: neither the job nor the command line says so."


def plain(name: str) -> str:
    r"""Keep a name in a figure from being read as a formula.

    Examples
    --------
    >>> plain("A$1$")
    'A\\$1\\$'
    """
    return name.replace("$", r"\$")


def seen_from(labels: Labels) -> str:
    """Say from which end discs are drawn and how the rotor turns there."""
    if labels.view is not None:
        return f"seen from the {labels.view}, where the rotor turns {labels.rotation}"
    way = "counter-clockwise" if labels.drawn_sign > 0 else "clockwise"
    return f"seen from the end from which the rotor turns {way}"


def words(
    labels: Labels, places: Mapping[str, float] | None = None, key_phasor: float | None = None
) -> list[tuple[str, str]]:
    """Say every convention of a job, as pairs of what it is about and what holds.

    Parameters
    ----------
    labels
        Units and conventions.
    places
        Direction of each sensor that has one, degrees with the rotation from x.
    key_phasor
        Direction of the key phasor, degrees with the rotation from x; None where nobody states it.
    """
    key, sensors = (
        "Its place is not stated.",
        "their directions are not stated: they stay as during the runs.",
    )
    if key_phasor is not None:
        key = f"It stands at {_stated(labels, key_phasor)} from x."
    if places:
        at = "; ".join(f"{name} at {_stated(labels, angle)}" for name, angle in places.items())
        sensors = f"{at}; from x, in the direction in which weights are counted."
    said = {
        "Rotation": _rotation(labels),
        "Angles of weights": _angles(labels) + _ASSUMED * ("angles" in labels.assumed),
        "Phase": _phase(labels) + _ASSUMED * ("phase" in labels.assumed),
        "Key phasor": f"gives a pulse when the mark on the rotor passes it. {key}",
        "Sensors": sensors,
        "Vibration": _amplitude(labels),
        "Weights": _weight(labels),
    }
    return [*said.items()]


def _rotation(labels: Labels) -> str:
    if labels.rotation is None:
        return (
            "the job does not say which way the rotor turns: look at the machine before you count angles. "
            "With the rotation means: the way in which the surface of the rotor moves."
        )
    end = "" if labels.view is None else f" seen from the {labels.view}"
    more = "" if labels.view is not None else "; from which end that is seen is not stated"
    return f"{labels.rotation}{end}{more}."


def _angles(labels: Labels) -> str:
    if labels.clock:
        end = "" if labels.view is None else f" seen from the {labels.view}"
        return f"degrees from the mark, {labels.angle_words}{end}, which is {labels.side} the rotation."
    if labels.side == "with":
        return (
            "degrees from the mark, with the rotation: go from the mark the way in which the surface moves."
        )
    return (
        "degrees from the mark, against the rotation: go from the mark against the way in which the surface "
        "moves. A fixed pointer sees the numbers rise while the rotor turns."
    )


def _phase(labels: Labels) -> str:
    if labels.phase == "lag":
        return (
            "lag: the angle by which the rotor turns from the pulse to the next positive peak of the sensor."
        )
    return "lead: the angle by which the rotor turns from a positive peak of the sensor to the next pulse."


def _amplitude(labels: Labels) -> str:
    unit = labels.vibration_unit
    if unit not in units.VIBRATION:
        return f"in {unit}, as the runs give it." if unit else "in the unit of the runs, which is not stated."
    kind = (
        "from peak to peak" if unit.endswith("_pp") else "rms" if unit.endswith("_rms") else "peak amplitude"
    )
    return f"in {labels.vibration_in} ({kind}), the part that turns with the rotor (1×)."


def _weight(labels: Labels) -> str:
    shown = labels.weight_in
    if "·" in shown:
        return f"in {shown}: mass times radius. Divide by the radius to get the mass."
    return f"in {shown}, at the radius of the plane."


def _stated(labels: Labels, angle: float) -> str:
    """An angle with the rotation as the job counts it."""
    return f"{np.mod(labels.with_rotation(angle), 360.0):g}°"


def rotor_figure(
    labels: Labels, places: Mapping[str, float] | None = None, key_phasor: float | None = None
) -> Figure:
    """Draw the rotor from its end at the moment of the pulse: rotation, mark, angles, sensors, key phasor.

    Parameters
    ----------
    labels, places, key_phasor
        As of `words`.
    """
    from matplotlib.figure import Figure
    from matplotlib.patches import Circle

    steep = [abs(np.sin(np.radians(angle))) > 0.6 for angle in (places or {}).values()]
    tall = _TALL if any(steep) else _FLAT
    figure = Figure(figsize=(3.4, 3.4 * tall / _SIDE))
    ax = figure.add_axes((0, 0, 1, 1))
    ax.set_aspect("equal")
    ax.set(xlim=(-_SIDE, _SIDE), ylim=(-tall, tall))
    ax.axis("off")
    drawn = labels.drawn_sign
    mark = drawn * np.radians(key_phasor or 0.0)
    count = labels.angles_on_paper
    ax.add_patch(Circle((0, 0), 1.0, fc="white", ec="black", lw=1.4))
    _turning(ax, 0.27, np.radians(100), drawn * np.radians(250))
    _say(ax, 0.0, "rotation", bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5})
    for degrees in (0, 90, 180, 270):
        way = np.exp(1j * (mark + count * np.radians(degrees)))
        _line(ax, [0.94 * way, way], color="black", lw=1)
        if degrees:
            _say(ax, complex(1.24 * way.real, 1.18 * way.imag), f"{degrees}°")
    tip = np.exp(1j * mark)
    _line(ax, 0.93 * tip, marker=(3, 0, 90 + np.degrees(mark)), color="black", ms=11, zorder=5)
    _say(ax, 0.66 * tip, "mark\n0°")
    _weight_at(ax, mark, count)
    _sensors(ax, labels, places, key_phasor)
    return figure


def _weight_at(ax: Axes, mark: float, count: int) -> None:
    """A weight, and the arrow along which its angle is counted."""
    from matplotlib.patches import Circle

    way = np.exp(1j * (mark + count * np.radians(_SAMPLE)))
    _line(ax, [0, 0.78 * way], color="black", lw=0.8, ls=":")
    ax.add_patch(Circle((0.84 * way.real, 0.84 * way.imag), 0.075, fc="black", zorder=5))
    _turning(ax, 0.48, mark + count * 0.42, count * (np.radians(_SAMPLE) - 0.42))
    beside = np.exp(1j * (mark + count * np.radians(_SAMPLE + 34))) * 0.7
    _say(ax, beside, f"weight\nat {_SAMPLE:g}°")


def _sensors(ax: Axes, labels: Labels, places: Mapping[str, float] | None, key_phasor: float | None) -> None:
    """The key phasor, and the sensors whose directions are stated; several at one angle have one label."""
    drawn = labels.drawn_sign
    key = np.exp(1j * drawn * np.radians(key_phasor or 0.0))
    _line(ax, _KEY * key, marker=(3, 0, 90 + np.degrees(np.angle(key))), color="black", mfc="white", ms=11)
    _say(ax, 1.18 * key - 0.2j, "key phasor", ha=_beside(key.real), va="top")
    by_angle: dict[float, list[str]] = {}
    for name, angle in (places or {}).items():
        by_angle.setdefault(float(np.mod(angle, 360.0)), []).append(name)
    for angle, names in by_angle.items():
        first, *more = names
        shown = plain(first if len(first) <= 12 else f"{first[:11]}…") + " …" * bool(more)
        way = np.exp(1j * np.radians(drawn * angle))
        _line(ax, [_INNER * way, _OUTER * way], color="black", lw=6, solid_capstyle="butt")
        level = "center" if abs(way.imag) < 0.5 else "bottom" if way.imag > 0 else "top"
        words = f"{shown}\n{_stated(labels, angle)}"
        _say(ax, (_OUTER + 0.07) * way, words, ha=_beside(way.real), va=level)


def _beside(across: float) -> str:
    """On which side of its place a text begins, so that it points away from the rotor."""
    return "center" if abs(across) <= 0.5 else "left" if across > 0 else "right"


def _say(ax: Axes, at: complex, words: str, **style: Any) -> None:  # noqa: ANN401  as of matplotlib
    """A text around a point of the complex plane."""
    options: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 9, **style}
    ax.text(at.real, at.imag, words, **options)


def _line(ax: Axes, points: ArrayLike, **style: Any) -> None:  # noqa: ANN401  as of matplotlib
    """A line, or a mark, through points of the complex plane."""
    ax.plot(np.real(points), np.imag(points), **style)


def _turning(ax: Axes, radius: float, start: float, turn: float) -> None:
    """An arc with an arrow at its end; rad on the paper."""
    around = start + np.linspace(0.0, turn, 61)
    x, y = radius * np.cos(around), radius * np.sin(around)
    ax.plot(x[:-3], y[:-3], color="black", lw=1.3)
    ax.annotate(
        "",
        (x[-1], y[-1]),
        (x[-6], y[-6]),
        arrowprops={"arrowstyle": "-|>,head_length=0.45,head_width=0.22", "color": "black", "lw": 1.3},
    )


def phase_figure(labels: Labels) -> Figure:
    """Draw a reading over time with the pulses of the key phasor, and what its phase is."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(3.4, 2.1), layout="constrained")
    ax = figure.add_subplot()
    ax.axis("off")
    turn = np.linspace(-100.0, 560.0, 600)
    peak = _SAMPLE if labels.phase == "lag" else -_SAMPLE
    ax.plot(turn, np.cos(np.radians(turn - peak)), color="black", lw=1.5)
    ax.plot([-100, 575], [0, 0], color="0.5", lw=0.7)
    _say(ax, 585, "time", ha="left")
    for pulse in (0.0, 360.0):
        ax.plot([pulse, pulse], [-1.75, 1.5], color="0.5", lw=0.7, ls=":")
        ax.plot(
            [pulse - 12, pulse - 6, pulse, pulse + 6, pulse + 12], [-1.75, -1.75, -1.35, -1.75, -1.75], "k-"
        )
        _say(ax, complex(pulse, -1.8), "pulse", va="top")
    ax.plot([360 + peak] * 2, [1.0, 1.5], color="0.5", lw=0.7, ls=":")
    ends = (360.0, 360.0 + peak) if labels.phase == "lag" else (360.0 + peak, 360.0)
    ax.annotate("", (ends[1], 1.38), (ends[0], 1.38), arrowprops={"arrowstyle": "-|>", "lw": 1.2})
    _say(ax, complex(sum(ends) / 2, 1.5), f"phase {_SAMPLE:g}° ({labels.phase})", va="bottom")
    _say(ax, -100 + 1.12j, "reading of\na sensor", ha="left", va="bottom")
    ax.set(xlim=(-110, 660), ylim=(-2.15, 1.95))
    return figure
