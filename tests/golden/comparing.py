"""What differs between two outcomes beyond rounding.

Keys, lengths of lists, categorical words and the exit status are compared exactly; numbers to 1e-6 of the
largest of their array (all numbers of one key, whatever the indices). `TOLERANCES` names what may
differ more, and why.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from golden.document import Arrays, is_number
from golden.tolerances import TOLERANCES, Tolerance

RELATIVE = 1e-6


@dataclass(frozen=True)
class Difference:
    """What one key of one case was, and is."""

    key: str
    words: str

    def __str__(self) -> str:
        return f"{self.key}: {self.words}"


def compare(
    case: str, old: Arrays, new: Arrays, tolerances: Sequence[Tolerance] = TOLERANCES
) -> list[Difference]:
    """Differences by key; empty if there are none. Arrays may be thinned, both in the same way."""
    different = [Difference(key, "is no more") for key in old if key not in new]
    different += [Difference(key, "is new") for key in new if key not in old]
    for key in [key for key in old if key in new]:
        mine = [each for each in tolerances if each.holds(case, key)]
        if words := _array(old[key], new[key], mine):
            different.append(Difference(key, words))
    return different


def _array(old: Any, new: Any, tolerances: Iterable[Tolerance]) -> str:
    before, after = dict(_leaves(old)), dict(_leaves(new))
    if list(before) != list(after):
        return f"{_count(old)} values are now {_count(new)}"
    exact = [place for place in before if not (is_number(before[place]) and is_number(after[place]))]
    for place in exact:
        if before[place] != after[place] or type(before[place]) is not type(after[place]):
            return f"{place}: {before[place]!r} is now {after[place]!r}"
    pairs = {place: (before[place], after[place]) for place in before if place not in exact}
    largest = max((abs(a) for place, (a, _) in pairs.items() if place not in ("sum", "moment")), default=0.0)
    allowed = max(
        [RELATIVE * largest, *(_allowed(each, [a for a, _ in pairs.values()]) for each in tolerances)]
    )
    wrong = {place: abs(a - b) for place, (a, b) in pairs.items() if not abs(a - b) <= allowed}
    if not wrong:
        return ""
    worst = max(wrong, key=lambda place: wrong[place])
    a, b = pairs[worst]
    share = f", {wrong[worst] / largest:.1e} of the largest" if largest else ""
    return f"{len(wrong)} of {len(pairs)} numbers, most {worst}: {a!r} is now {b!r}{share}"


def _allowed(tolerance: Tolerance, numbers: Sequence[float]) -> float:
    """How far a number of an array may be off."""
    size = max(map(abs, numbers), default=0.0)
    if tolerance.interval:
        ends = zip(numbers[::2], numbers[1::2], strict=False)
        size = max((abs(high - low) / 2 for low, high in ends), default=0.0)
    return max(tolerance.relative * size, tolerance.absolute)


def _count(values: Any) -> Any:
    return values.get("count") if isinstance(values, dict) else len(values)


def _leaves(values: Any, place: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(values, dict):
        for key, value in values.items():
            yield from _leaves(value, f"{place}{key}")
    elif isinstance(values, list):
        for i, value in enumerate(values):
            yield from _leaves(value, f"{place}[{i}]")
    else:
        yield place, values
