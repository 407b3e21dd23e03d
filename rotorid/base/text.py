"""Numbers, quantities, lists and tables in words: text of 80 columns; units as people write them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from rotorid.base.arrays import FloatArray

Phase = Literal["lead", "lag"]
Angles = Literal["with rotation", "against rotation"]
Rotation = Literal["clockwise", "counter-clockwise"]
SHORT_ANGLES = {"with": "with rotation", "against": "against rotation"}
View = Literal["drive end", "free end"]
Quantity = Literal["displacement", "velocity", "acceleration"]

WIDTH = 80
MOST_NAMES = 40
ROUNDING = 1e-12
"""A share that is nothing but rounding."""
RPM = 60 / math.tau  # of 1 rad/s
SPEEDS = {"rpm": ("rpm", RPM), "rad_s": ("rad/s", 1.0), "Hz": ("Hz", 1 / math.tau)}
"""Words and scales of speeds by the units of files."""
_BASES = {"m_s": "m/s", "mm_s": "mm/s", "in_s": "in/s", "m_s2": "m/s²", "mm_s2": "mm/s²", "um": "µm"}
_MASSES = ("g_", "kg_", "mg_", "oz_", "lb_")
_BASES |= {unit: unit for unit in ("m", "mm", "mil", "in", "g")}


def percent(share: float) -> str:
    """A share in percent, two digits, never as 1e+02; rounding is 0."""
    if share < ROUNDING:
        return "0"
    return f"{100 * share:.0f}" if share >= 0.0995 else f"{100 * share:.2g}"


def figures(value: float, digits: int = 4) -> str:
    """A number with so many significant digits, written out where that is short.

    >>> figures(0.99996), figures(12345.6, 3), figures(2.5e-7)
    ('1.000', '12346', '2.500e-07')
    """
    if not 1e-4 <= abs(value) < 1e6:
        return "0" if value == 0 else f"{value:.{digits - 1}e}"
    exponent = int(f"{value:.{digits - 1}e}".rpartition("e")[2])  # of the rounded number: 0.99996 is 1.000
    places = max(digits - 1 - exponent, 0)
    return f"{value:.{places}f}"


def error_figures(error: float) -> str:
    """A standard deviation, two digits."""
    return figures(error, 2) if error == error else "unknown"


def capital(text: str) -> str:
    """The text with a capital at its beginning."""
    return text[:1].upper() + text[1:]


def sentence(text: str) -> str:
    """A clause as a sentence.

    >>> sentence("the runs agree")
    'The runs agree.'
    """
    return capital(text) + ("" if text.endswith(".") else ".")


def cut(text: str, width: int) -> str:
    """The text, shortened to so many characters."""
    return text if len(text) <= width else text[: width - 1] + "…"


def counted(n: int, noun: str, nouns: str = "") -> str:
    """So many of something.

    >>> counted(1, "plane"), counted(0, "plane"), counted(2, "mass", "masses")
    ('1 plane', '0 planes', '2 masses')
    """
    return f"{n} {noun if n == 1 else nouns or f'{noun}s'}"


def listing(names: Iterable[str], conjunction: str = "or") -> str:
    """`a, b or c`; of a great many only the first."""
    items = list(names)
    if len(items) > MOST_NAMES:
        items = [*items[: MOST_NAMES - 1], f"{len(items) - MOST_NAMES + 1} more"]
        conjunction = "and"
    if len(items) < 2:
        return "".join(items)
    return f"{', '.join(items[:-1])} {conjunction} {items[-1]}"


def aligned(columns: Sequence[Sequence[str]], left: int = 1, width: int = WIDTH) -> str:
    """Columns of cells, the first `left` to the left, the others to the right; too long names are cut."""
    widths, name = [max(map(len, column)) for column in columns], left - 1
    over = sum(widths) + 2 * len(widths) - width
    widths[name] = max(widths[name] - max(over, 0), 8)
    padded = [
        [f"{cut(cell, wide):{'<' if k < left else '>'}{wide}}" for cell in column]
        for k, (column, wide) in enumerate(zip(columns, widths, strict=True))
    ]
    return "\n".join(("  " + "  ".join(row)).rstrip() for row in zip(*padded, strict=True))


def rpm(speed: float) -> float:
    """Revolutions per minute to 12 digits: 3000 come back as 3000, not as 3000.0000000000005."""
    return float(f"{speed * RPM:.12g}")


def rpm_text(speed: float) -> str:
    """A speed in rad/s as `2980.5 rpm`."""
    return f"{speed * RPM:.6g} rpm"


def speed_text(speed: float) -> str:
    """A speed in both units, `312.114 rad/s = 2980.5 rpm`."""
    return f"{speed:.6g} rad/s = {speed * RPM:.6g} rpm"


def range_text(low: float, high: float) -> str:
    """A range of speeds in both units, `1000 to 3000 rpm (104.72 to 314.159 rad/s)`."""
    return f"{low * RPM:.6g} to {rpm_text(high)} ({low:.6g} to {high:.6g} rad/s)"


def phase_deg(z: ArrayLike) -> FloatArray:
    """Phases of complex numbers, 0 ≤ phase < 360 degrees."""
    import numpy as np

    # −1e-20 modulo 360 is rounded to 360
    return np.asarray(np.degrees(np.angle(np.asarray(z))) % 360.0 % 360.0)


@dataclass(frozen=True)
class Shown:
    """How people see a quantity: its number in SI times `scale`, and this unit or name of an axis."""

    word: str
    scale: float = 1.0


def vibration_unit_words(unit: str) -> str:
    """The unit of a reading; one that is only printed stays as it is.

    >>> [vibration_unit_words(unit) for unit in ("um_pp", "mm_s_rms", "mm", "V", "g_mm", "")]
    ['µm pp', 'mm/s rms', 'mm peak', 'V', 'g·mm', '']
    """
    if unit.startswith(_MASSES) and unit.endswith(("_mm", "_m", "_in")):
        return weight_unit_words(unit)
    for suffix, word in (("_pp", "pp"), ("_rms", "rms"), ("", "peak")):
        base = unit.removesuffix(suffix)
        if unit.endswith(suffix) and base in _BASES:
            return f"{_BASES[base]} {word}"
    return unit


def weight_unit_words(unit: str) -> str:
    """The unit of a weight.

    >>> weight_unit_words("g_mm"), weight_unit_words("g")
    ('g·mm', 'g')
    """
    return unit.replace("_", "·")


def speed_axis(name: str, unit: str) -> Shown:
    """An axis of speeds or frequencies in rad/s, shown in the unit of a file.

    >>> speed_axis("speed", "rpm").word
    'speed, rpm'
    """
    word, scale = SPEEDS[unit]
    return Shown(f"{name}, {word}", scale)
