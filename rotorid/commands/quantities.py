"""Values of options as people write them: speeds, ranges, nodes, sensors, names, pairs, a reader each.

Each takes a text of the command line or, from Python, what it stands for, in SI. Weights, lengths and other
quantities with units are read by `rotorid.commands.option_quantities`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import TypeVar

from rotorid.base.suggestions import did_you_mean
from rotorid.base.suggestions import one_of as one_of
from rotorid.base.text import listing
from rotorid.report.options import option_name as option_name

_T = TypeVar("_T")
Speeds = str | Sequence[float | str]
"""As `speeds` reads them, or one by one: rad/s, or "3000rpm"."""
Times = str | Sequence[float]
"""As `times` reads them, or one by one, s."""
Band = str | tuple[float | str, float | str]
"""As `band` reads it, or the lowest and highest speed, rad/s or "3000rpm"."""
Span = str | tuple[float, float]
"""As `span_at` reads it, or the least and the most, in SI."""
Nodes = str | Sequence[str | int]
"""As `nodes` reads them, or numbers of nodes and names of stations."""
Sensor = str | int | tuple[str | int, float]
"""A node or station, in x or at an angle in degrees from x, with the rotation."""
Names = str | Sequence[str]
"""As `names` reads them."""
SLOWEST, FASTEST = 1e-9, 1e9
"""rad/s; no rotor turns so slowly or so fast, and squares of other numbers may overflow."""
_SPEED_UNITS = {"rad_s": 1.0, "rad/s": 1.0, "rpm": math.pi / 30.0, "Hz": 2.0 * math.pi}
_SPEED = re.compile(r"\s*([-+.\d]+(?:[eE][-+]?\d+)?)\s*(rad_s|rad/s|rpm|Hz|)\s*")


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
    if not parts or not all(part != "" for part in parts):
        raise ValueError(
            f"{what} takes nodes or names of stations with commas, such as 7,12,18; got {given!r}"
        )
    return [int(part) if isinstance(part, str) and part.isdecimal() else part for part in parts]


def sensors(given: str | Sequence[Sensor], what: str = "--sensors") -> list[Sensor]:
    """Read "2,22:45,probe DE:-30" as nodes with angles in degrees from x, with the rotation; 0 without."""
    if not isinstance(given, str):
        if not given:
            raise ValueError(f"{what}: at least one node or station is needed")
        return list(given)
    found: list[Sensor] = []
    for part in given.split(","):
        head, colon, tail = part.partition(":")
        angle = degrees(tail, what) if colon else None  # names of stations hold no colon
        (node,) = nodes(head, what)
        found.append(node if angle is None else (node, angle))
    return found


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
    found = [part.strip() for part in given.split(",")] if isinstance(given, str) else list(given)
    if not found or not all(found):
        raise ValueError(f"names with commas between them are needed, such as left,right; got {given!r}")
    return found


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
    parts = given.split(",") if isinstance(given, str) else given
    if not all(isinstance(part, str) for part in parts):
        raise ValueError(f"{what} {given!r}: texts are needed, such as {example}")
    shown, found = ",".join(parts), dict[str, _T]()
    for part in parts:
        name, found_sign, text = (piece.strip() for piece in part.rpartition(sign))
        if not (name and found_sign) and (found_sign or not text or alone is None):
            raise ValueError(f"{what} {shown!r}: {part.strip()!r} is no NAME{sign}VALUE; use {example}")
        new = alone(text) if alone is not None and not found_sign else {name: read(name, text)}
        if twice := next((one for one in new if one in found), None):
            raise ValueError(f"{what} {shown!r}: {twice} stands twice")
        found |= new
    return found


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


def band(given: Band | None, what: str = "--operating", usual: str = "rad_s") -> tuple[float, float] | None:
    """Read "9000:10500rpm" (without a unit: the usual) as the ends of a range in rad/s; None stays None."""
    if given is None:
        return None
    ends = given.replace(":", ",") if isinstance(given, str) else given
    try:
        low, high = speeds(ends, usual, what)
    except ValueError:
        low = high = 0.0
    if not low < high:
        unit = usual.replace("_", "/")
        raise ValueError(
            f"{what} {given!r} is not a range: use LOWEST:HIGHEST, in {unit}, or with "
            f"{_others(unit)} at the end"
        )
    return low, high


def _others(unit: str) -> str:
    return " or ".join(name for name in ("rad/s", "rpm", "Hz") if name != unit)


def span_at(given: Span, what: str, example: str) -> tuple[tuple[float, float], str | None]:
    """Read "0:5e7" or "0:5e7@impeller 3" as a range of numbers and where it is meant; None: nowhere said."""
    text, _, place = given.partition("@") if isinstance(given, str) else ("", "", "")
    ends = [number(part) for part in text.split(":")] if isinstance(given, str) else [*given]
    if len(ends) != 2 or not 0 <= ends[0] < ends[1] < math.inf:
        raise ValueError(f"{what} {given!r} is not a range: use LEAST:MOST, such as {example}")
    return (ends[0], ends[1]), place.strip() or None


def speeds(given: Speeds, unit: str = "rad_s", what: str = "--speeds") -> list[float]:
    """Read speeds, rad/s: "100:700:50" (first:last:step) or "100,200", "1000:6000:50rpm", "20Hz,1500rpm".

    A unit at the end holds for all; or each speed has its own. Without any it is `unit`. The last speed of a
    range is included where the steps meet it.
    """
    if not isinstance(given, str):
        each = [one_speed(value, what) if isinstance(value, str) else value for value in given]
        return _possible([float(value) for value in each], what, given)
    sign = ":" if ":" in given else ","
    read = [_SPEED.fullmatch(part) for part in given.split(sign)]
    values = [math.nan if one is None else number(one[1]) for one in read]
    if any(map(math.isnan, values)) or (sign == ":" and len(values) != 3):
        usual = unit.replace("_", "/")
        raise ValueError(
            f"{what} {given!r} is not a range: use FIRST:LAST:STEP or a list with commas, in {usual}, "
            f"or with {_others(usual)} at the end"
        )
    own = [one[2] for one in read if one is not None]
    if any(own[:-1]) and not all(own):
        raise ValueError(f"{what} {given!r}: give the unit at every speed, or once at the end")
    if sign == ":" and any(own[:-1]) and len({*own}) > 1:
        raise ValueError(f"{what} {given!r}: a range has one unit")
    factors = [_SPEED_UNITS[name or own[-1] or unit] for name in own]
    if sign == ":":
        values = [*_range(values, what, given)]
        factors = factors[:1] * len(values)
    return _possible([v * factor for v, factor in zip(values, factors, strict=True)], what, given)


def times(given: Times, what: str = "--times") -> list[float]:
    """Read times, s: "0:50:0.2" (first:last:step) or "0,0.5,2"."""
    parts = given.split(":" if ":" in given else ",") if isinstance(given, str) else given
    found = [number(part) if isinstance(part, str) else part for part in parts]
    ranged = isinstance(given, str) and ":" in given
    if not found or not all(map(math.isfinite, found)) or (ranged and len(found) != 3):
        raise ValueError(f"{what} {given!r}: use FIRST:LAST:STEP or a list with commas, in seconds")
    return [float(f"{t:.12g}") for t in _range(found, what, given, "time")] if ranged else found


def rising_speeds(given: Speeds, what: str = "--speeds") -> list[float]:
    """`speeds` in ascending order, each once."""
    return sorted(set(speeds(given, what=what)))


def one_speed(given: str | float, what: str) -> float:
    """Read "9000rpm" as one speed, rad/s."""
    values = speeds(given if isinstance(given, str) else [given], what=what)
    if len(values) != 1:
        raise ValueError(f"{what} takes one speed, such as 9000rpm; got {given!r}")
    return values[0]


def _range(ends: Sequence[float], what: str, given: object, noun: str = "speed") -> tuple[float, ...]:
    """First, last and step as all values between them."""
    first, last, step = ends
    if step <= 0 or last < first:
        raise ValueError(
            f"{what} {given!r}: the step must be positive and the last {noun} not below the first"
        )
    if (last - first) / step > 1e6:
        raise ValueError(f"{what} {given!r} has more than a million {noun}s")
    return tuple(first + step * i for i in range(math.floor((last - first) / step * (1 + 1e-12) + 1e-9) + 1))


def _possible(found: list[float], what: str, given: Speeds) -> list[float]:
    if not found or not all(value == 0 or SLOWEST <= value <= FASTEST for value in found):
        raise ValueError(f"{what} {given!r}: speeds must be 0 or from {SLOWEST:g} to {FASTEST:g} rad/s")
    return found
