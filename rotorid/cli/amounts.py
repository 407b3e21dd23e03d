"""Weights, lengths and weights at angles as people write them on the command line: 35g@120, 10g,20g, 8mm."""

from __future__ import annotations

import re

import numpy as np

from balancing.data.conventions import Labels
from rotorid.base.text import listing
from rotorid.tables.job.quantity import Quantity, to_job_weight
from rotorid.tables.reader import units
from rotorid.tables.reader.number import LARGEST_STATED, NotANumber, check_size, parse_number
from rotorid.tables.reader.units import Unit, UnitError
from rotorid.tables.runs.conventions import ANGLES, as_angles, polar

_WORD = re.compile(r"\s*([+-]?[0-9.]+(?:[eE][+-]?[0-9]+)?)\s*([^\W\d].*)?")
_PLUS = re.compile(r"(?<=[0-9.])\s*\+\s*(?=[0-9.])")


def amount(text: str, what: str, example: str) -> tuple[float, str]:
    """A number and the unit behind it ("" without).

    Raises
    ------
    ValueError
        Naming the option, for anything else.
    """
    match = _WORD.fullmatch(text)
    try:
        if match is None:
            raise NotANumber("a number with a unit")
        value = parse_number(match[1])
        check_size(value, LARGEST_STATED)
    except NotANumber as error:
        raise ValueError(f"{what} {text.strip()!r}: expected {error}, such as {example}") from None
    return value, (match[2] or "").strip()


def weight_of(text: str, what: str, example: str = "10g") -> Quantity:
    """A weight above 0 with its unit, as given."""
    value, word = amount(text, what, example)
    unit = _weight_unit(word, text, what, example)
    if value <= 0:
        raise ValueError(f"{what} {text.strip()!r}: a weight must be above 0, such as {example}")
    return Quantity(what, value, unit)


def inside(weight: Quantity, labels: Labels, radius: float | None) -> float:
    """A weight in SI as those of `labels` are: kg or kg·m."""
    size = to_job_weight(weight, labels.weight_unit, radius)
    if size is None:
        raise ValueError(
            f"{weight.key}: the weight to be split is in {labels.weight_unit}, to which {weight.unit.name} "
            "converts only with --radius"
        )
    return size


def weights_of(text: str, what: str, labels: Labels, radius: float | None) -> list[float]:
    """Weights with commas between them, "10g,20g", in SI as those of `labels` are."""
    return [inside(weight_of(part, what), labels, radius) for part in text.split(",")]


def length_of(text: str, what: str, example: str = "100mm") -> float:
    """A length above 0, m; without a unit it is refused."""
    value, word = amount(text, what, example)
    try:
        unit = units.one_of(units.LENGTH)(word)
    except UnitError as error:
        raise ValueError(f"{what} {text.strip()!r}: expected {error}, such as {example}") from None
    if value <= 0:
        raise ValueError(f"{what} {text.strip()!r}: a length must be above 0, such as {example}")
    return unit.to_si(value)


def vectors_of(text: str, angles: str, what: str = "VECTOR") -> tuple[Labels, list[complex]]:
    """Weights at angles, "35g@120" or "20g@30+10g@200": how to print them, and each with the rotation.

    Raises
    ------
    ValueError
        For anything else, and for units that do not convert to that of the first one.
    """
    if angles not in ANGLES:
        raise ValueError(f"--angles must be {listing(map(repr, ANGLES))}, not {angles!r}")
    labels, found = None, []
    for part in _PLUS.split(text):
        head, at, tail = part.partition("@")
        if not at:
            raise ValueError(
                f"{what} {part.strip()!r}: write a weight at an angle in degrees, such as 35g@120"
            )
        size, unit = _size(head, what)
        if labels is None:
            labels = Labels(weight_unit=unit.name, weight_scale=unit.scale, angles=as_angles(angles))
        elif units.weight(labels.weight_unit).kind != unit.kind:
            raise ValueError(
                f"{what} {text!r}: masses and unbalances (mass × radius) cannot be added; "
                "write all as one kind"
            )
        angle = np.radians(degrees(tail.removesuffix("°"), what))
        found.append(complex(polar(np.array(unit.to_si(size)), np.array(angle), labels.angle_sign)))
    assert labels is not None  # a split text has at least one part
    return labels, found


def degrees(text: str, what: str) -> float:
    """An angle from −360 to 360 degrees."""
    try:
        angle = parse_number(text.strip())
    except NotANumber:
        angle = float("nan")
    if not -360 <= angle <= 360:
        raise ValueError(f"{what}: {text.strip()!r} is no angle from -360 to 360 degrees")
    return angle


def _size(text: str, what: str) -> tuple[float, Unit]:
    value, word = amount(text, what, "35g@120")
    if value < 0:
        raise ValueError(f"{what} {text.strip()!r}: a weight must not be negative; turn its angle by 180°")
    return value, _weight_unit(word, text, what, "35g@120")


def _weight_unit(word: str, text: str, what: str, example: str) -> Unit:
    if not word:
        raise ValueError(f"{what} {text.strip()!r}: a weight needs its unit, such as {example}")
    try:
        return units.weight(word)
    except UnitError as error:
        raise ValueError(f"{what} {text.strip()!r}: expected {error}") from None
