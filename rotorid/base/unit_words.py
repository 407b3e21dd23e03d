"""Units written for people: `µm pp` for `um_pp`, `g·mm` for `g_mm`; files keep the plain names."""

from __future__ import annotations

import math
from dataclasses import dataclass

SPEEDS = {"rpm": ("rpm", 60 / math.tau), "rad_s": ("rad/s", 1.0), "Hz": ("Hz", 1 / math.tau)}
"""Words and scales of speeds by the units of files."""
_BASES = {
    "m": "m",
    "mm": "mm",
    "um": "µm",
    "mil": "mil",
    "in": "in",
    "m_s": "m/s",
    "mm_s": "mm/s",
    "in_s": "in/s",
    "g": "g",
    "m_s2": "m/s²",
    "mm_s2": "mm/s²",
}


@dataclass(frozen=True)
class Shown:
    """How people see a quantity: its number in SI times `scale`, and this unit or name of an axis."""

    word: str
    scale: float = 1.0


def vibration_unit_words(unit: str) -> str:
    """The unit of a reading; one that is only printed stays as it is.

    >>> [vibration_unit_words(unit) for unit in ("um_pp", "mm_s_rms", "mm", "V", "")]
    ['µm pp', 'mm/s rms', 'mm peak', 'V', '']
    """
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
