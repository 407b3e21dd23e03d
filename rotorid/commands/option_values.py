"""Values of options as people write them: speeds, ranges, times, nodes, sensors, names, pairs, a reader each.

Each takes a text of the command line or, from Python, what it stands for, in SI. Weights, lengths and other
quantities with units are read by `rotorid.commands.option_units`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import TypeVar

from rotorid.base.choices import did_you_mean
from rotorid.base.choices import one_of as one_of
from rotorid.base.text import listing
from rotorid.files.units import SPEED, TIME, Unit, spelt
from rotorid.report.options import option_name as option_name

_T = TypeVar("_T")
Speeds = str | Sequence[float | str]
"""As `speeds` reads them, or one by one: rad/s, or "3000rpm"."""
Times = str | Sequence[float]
"""As `times` reads them, or one by one, s."""
Band = str | tuple[float | str, float | str]
"""As `band` reads it, or the lowest and highest speed, rad/s or "3000rpm"."""
Nodes = str | Sequence[str | int]
"""As `nodes` reads them, or numbers of nodes and names of stations."""
Sensor = str | int | tuple[str | int, float]
"""A node or station, in x or at an angle in degrees from x, with the rotation."""
Names = str | Sequence[str]
"""As `names` reads them."""
SLOWEST, FASTEST = 1e-9, 1e9
"""rad/s; no rotor turns so slowly or so fast, and squares of other numbers may overflow."""
WITH_UNIT = re.compile(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(|[^\W\d].*?)\s*")
"""A number, and the unit behind it, which may be missing."""


def number(text: str) -> float:
    """A finite number, or NaN for anything else."""
    try:
        value = float(text)
    except ValueError:
        return math.nan
    return value if math.isfinite(value) else math.nan


def nodes(given: Nodes, what: str) -> list[str | int]:
    """Read "7,12,impeller 3" as node numbers and names of stations."""
    parts = [part.strip() for part in given.split(",")] if isinstance(given, str) else list(given)
    if not parts or "" in parts:
        raise ValueError(
            f"{what} takes nodes or names of stations with commas, such as 7,12,18; got {given!r}"
        )
    return [int(part) if isinstance(part, str) and part.isdecimal() else part for part in parts]


def sensors(given: str | Sequence[Sensor], what: str = "--sensors") -> list[Sensor]:
    """Read "2,22:45,probe DE:-30" as nodes with angles in degrees from x, with the rotation; 0 without."""
    if not given:
        raise ValueError(f"{what}: at least one node or station is needed")
    if not isinstance(given, str):
        return list(given)
    places = []
    for part in given.split(","):
        head, colon, tail = part.partition(":")  # names of stations hold no colon
        (node,) = nodes(head, what)
        places.append((node, degrees(tail, what)) if colon else node)
    return places


def degrees(given: str | float, what: str) -> float:
    """An angle from −360 to 360 degrees."""
    angle = number(given) if isinstance(given, str) else given
    if not -360 <= angle <= 360:
        raise ValueError(f"{what}: {str(given).strip()!r} is no angle from -360 to 360 degrees")
    return angle


def names(given: Names | None) -> list[str] | None:
    """Read "A,B" as names; None stays None."""
    if given is None:
        return None
    parts = [part.strip() for part in given.split(",")] if isinstance(given, str) else list(given)
    if not parts or not all(parts):
        raise ValueError(f"names with commas between them are needed, such as left,right; got {given!r}")
    return parts


def pairs(
    given: str | Sequence[str] | Mapping[str, _T] | Mapping[str, str],
    what: str,
    read: Callable[[str, str], _T],
    example: str,
    alone: Callable[[str], Mapping[str, _T]] | None = None,
    sign: str = "=",
) -> dict[str, _T]:
    """Read "alpha12=1.3,U31=-0.3" as names with values.

    Parameters
    ----------
    given
        The text, its parts, or the pairs themselves.
    what
        The option, for complaints.
    read
        Makes a value of its name and its text.
    example
        How it is written.
    alone
        What a part without `sign` stands for; None: nothing.
    sign
        Between name and value.

    Raises
    ------
    ValueError
        For anything else, and for a name that stands twice.
    """
    if isinstance(given, Mapping):
        return {str(key): read(str(key), v) if isinstance(v, str) else v for key, v in given.items()}
    parts, values = given.split(",") if isinstance(given, str) else given, dict[str, _T]()
    if not all(isinstance(part, str) for part in parts):
        raise ValueError(f"{what} {given!r}: texts are needed, such as {example}")
    for part in parts:
        name, paired, text = (piece.strip() for piece in part.rpartition(sign))
        new = {name: read(name, text)} if name else alone(text) if alone and text and not paired else {}
        if not new:
            raise ValueError(
                f"{what} {','.join(parts)!r}: {part.strip()!r} is no NAME{sign}VALUE; use {example}"
            )
        if twice := next((one for one in new if one in values), None):
            raise ValueError(f"{what} {','.join(parts)!r}: {twice} stands twice")
        values |= new
    return values


def numbers(
    given: str | Mapping[str, float], what: str, example: str, whole: float = 1.0
) -> dict[str, float]:
    """`pairs` of names with finite numbers, those of texts divided by `whole`."""

    def read(name: str, text: str) -> float:
        value = number(text)
        if math.isnan(value):
            raise ValueError(f"{what} {given!r}: {name}={text} is no NAME=NUMBER; use {example}")
        return value / whole

    return pairs(given, what, read, example)


def check_names(
    given: Collection[str], what: str, names: Collection[str], noun: str, needed: Collection[str] = ()
) -> None:
    """Refuse names that the model does not have, with the nearest, and the lack of a value."""
    for name in given:
        if name not in names:
            hint = did_you_mean(name, names) or (f"; {noun}s are {listing(names, 'and')}" if names else "")
            raise ValueError(f"{what}: {name!r} is no {noun} of the model{hint}")
    if lost := [name for name in needed if name not in given]:
        raise ValueError(f"{what}: the value of {listing(lost, 'and')} is missing, such as {lost[0]}=1")


def speeds(given: Speeds, unit: str = "rad_s", what: str = "--speeds") -> list[float]:
    """Read speeds, rad/s: "100:700:50" (first:last:step) or "100,200", "1000:6000:50rpm", "20Hz,1500rpm".

    A unit at the end holds for all; or each speed has its own. Without any it is `unit`. The last speed of a
    range is included where the steps meet it.
    """
    if isinstance(given, str):
        values = _series(given, SPEED, unit, what)
    else:
        values = [one_speed(value, what) if isinstance(value, str) else float(value) for value in given]
    if not values or not all(value == 0 or SLOWEST <= value <= FASTEST for value in values):
        raise ValueError(f"{what} {given!r}: speeds must be 0 or from {SLOWEST:g} to {FASTEST:g} rad/s")
    return values


def times(given: Times, what: str = "--times") -> list[float]:
    """Read times, s: "0:50:0.2" (first:last:step) or "0,0.5,2"."""
    values = _series(given, TIME, "s", what) if isinstance(given, str) else list(given)
    if not values or not all(map(math.isfinite, values)):
        raise ValueError(f"{what} {given!r}: finite numbers are needed, seconds")
    return [float(f"{value:.12g}") for value in values]


def rising_speeds(given: Speeds, what: str = "--speeds") -> list[float]:
    """`speeds` in ascending order, each once."""
    return sorted(set(speeds(given, what=what)))


def one_speed(given: str | float, what: str) -> float:
    """Read "9000rpm" as one speed, rad/s."""
    values = speeds(given if isinstance(given, str) else [given], what=what)
    if len(values) != 1:
        raise ValueError(f"{what} takes one speed, such as 9000rpm; got {given!r}")
    return values[0]


def acceleration(given: str | float, what: str) -> float:
    """Read "-50rpm/s" or "0" in rad/s²."""
    if not isinstance(given, str):
        return given
    text = re.sub(r"/s(²|\^?2)$", "/s/s", given.strip())
    size = text.lstrip("+-").removesuffix("/s")
    if math.isnan(alone := number(text)):
        unit = WITH_UNIT.fullmatch(size)
        if f"{size}/s" == text.lstrip("+-") and unit and spelt(unit[2]) in SPEED:
            return (-1.0 if text.startswith("-") else 1.0) * one_speed(size, what)
    elif alone == 0:
        return alone
    raise ValueError(f"{what} {given!r}: a speed a second is needed, such as 300rpm/s or 5Hz/s")


def two_speeds(given: Speeds, what: str, example: str, usual: str = "rad_s") -> tuple[float, float]:
    """Read "500:9000rpm" (without a unit: the usual) as two speeds, rad/s."""
    ends = speeds(given.replace(":", ",") if isinstance(given, str) else given, usual, what)
    if len(ends) != 2:
        raise ValueError(f"{what} {given!r} is not a range: use {example}, such as 500:9000rpm")
    return ends[0], ends[1]


def band(given: Band | None, what: str = "--operating", usual: str = "rad_s") -> tuple[float, float] | None:
    """`two_speeds`, the lower one first; None stays None."""
    if given is None:
        return None
    low, high = two_speeds(given, what, "LOWEST:HIGHEST", usual)
    if not low < high:
        raise ValueError(f"{what} {given!r} is not a range: the lower speed comes first, and both differ")
    return low, high


def _series(given: str, unit_scales: Mapping[str, Unit], usual: str, what: str) -> list[float]:
    """First:last:step, or a list, in SI; each with a unit, or once at the end for all."""
    sign = ":" if ":" in given else ","
    parts = [WITH_UNIT.fullmatch(part) for part in given.split(sign)]
    values = [math.nan if part is None else number(part[1]) for part in parts]
    words = [part[2] if part else "" for part in parts]
    if not any(words[:-1]):
        words = [words[-1] or usual] * len(words)
    scales = [unit_scales.get(spelt(word)) for word in words]
    if (
        any(map(math.isnan, values))
        or not all(scales)
        or (sign == ":" and (len(values) != 3 or len({*words}) > 1))
    ):
        others = listing(name.replace("_", "/") for name in unit_scales if name != usual)
        raise ValueError(
            f"{what} {given!r} is not a range: use FIRST:LAST:STEP or a list with commas, in "
            f"{usual.replace('_', '/')}, or with {others} at the end, or at every one"
        )
    if sign == ":":
        first, last, step = values
        if step <= 0 or last < first:
            raise ValueError(f"{what} {given!r}: the step must be positive, the last one not below the first")
        if (last - first) / step > 1e6:
            raise ValueError(f"{what} {given!r}: more than a million are too many")
        count = math.floor((last - first) / step * (1 + 1e-12) + 1e-9) + 1
        values, scales = [first + step * k for k in range(count)], scales[:1] * count
    return [scale.to_si(value) for scale, value in zip(scales, values, strict=True) if scale]
