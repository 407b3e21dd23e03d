"""Quantities of options with units, one reader for each kind: 500kg, 8mm, 35g@120, left=100mm.

From Python they are given in SI: kg, m, N, rad/s, kg·m; complex weights count their angle with the rotation.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from math import radians
from typing import TYPE_CHECKING, get_args

from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.base.words import Angles
from rotorid.commands.quantities import degrees, one_of, one_speed, pairs
from rotorid.files import units
from rotorid.files.decimal_numbers import LARGEST_STATED, NotANumber, check_size, parse_number
from rotorid.files.units import Unit, UnitError, spelt

if TYPE_CHECKING:
    from balancing import Labels
    from rotorid.files.units import Quantity
    from rotorid.tables import Job

Amount = str | float
"""A number with its unit, or a number in SI."""
Vector = str | complex
"""Weights at angles as `vectors` reads them, or one in kg."""
Positions = str | Mapping[str, float | None]
"""As `positions` reads them, or m by plane; None: without."""
Weights = Amount | Mapping[str, Amount]
"""One of all planes, or by plane, in SI as the weights of the job are: kg or kg·m."""
Amplitudes = str | Sequence[str] | Mapping[str, Amount]
"""`SENSOR=VALUE`, one or several, or amplitudes by sensor in SI."""
_WORD = re.compile(r"\s*([+-]?[0-9.]+(?:[eE][+-]?[0-9]+)?)\s*([^\W\d].*)?")
_PLUS = re.compile(r"(?<=[0-9.])\s*\+\s*(?=[0-9.])")


def quantity(given: Amount, what: str, known: Mapping[str, Unit], example: str) -> float:
    """Read "500kg" or "500 kg" in SI.

    Raises
    ------
    ValueError
        For no number, no unit or another one; says which there are.
    """
    if not isinstance(given, str):
        return given
    body = given.strip()
    split = next((i for i in range(len(body), 0, -1) if body[i - 1] in "0123456789."), 0)
    unit = known.get(spelt(body[split:].strip()))
    try:
        value = parse_number(body[:split].strip())
    except NotANumber:
        unit = None
    if unit is None:
        raise ValueError(
            f"{what} {given!r}: a number with its unit ({', '.join(known)}) is needed, such as {example}"
        )
    return unit.to_si(value)


def mass(given: Amount, what: str, example: str = "500kg") -> float:
    """Read "500kg" in kg."""
    return quantity(given, what, units.MASS, example)


def length(given: Amount, what: str, example: str = "100mm") -> float:
    """Read "350mm" in m."""
    return quantity(given, what, units.LENGTH, example)


def size(given: Amount, what: str, example: str = "100mm") -> float:
    """Read "8mm" as a length above 0, m."""
    return _above_zero(length(given, what, example), given, what, example)


def speed_with_unit(given: Amount, what: str) -> float:
    """Read "3000rpm" in rad/s.

    Raises
    ------
    ValueError
        Without a unit: a number alone would be taken for rad/s by one, and for rpm by the other.
    """
    if isinstance(given, str) and not any(letter.isalpha() for letter in given):
        raise ValueError(f"{what} {given!r}: a speed needs its unit here, such as 3000rpm, 50Hz or 314rad_s")
    return one_speed(given, what)


def positions(given: Positions, what: str = "--planes") -> dict[str, float | None]:
    """Read "left=100mm,right=600mm" in m; None where there is no position."""

    def read(name: str, text: str) -> float | None:
        return length(text, f"{what} {name}")

    return pairs(given, what, read, "left=100mm,right=600mm", lambda name: {name: None})


def two_positions(given: str | tuple[float, float], what: str = "--bearings") -> tuple[float, float]:
    """Read "0mm,700mm" in m."""
    parts = given.split(",") if isinstance(given, str) else given
    if len(parts) != 2:
        raise ValueError(f"{what} {given!r}: two positions are needed, such as 0mm,700mm")
    first, second = (length(part, what, "0mm,700mm") for part in parts)
    return first, second


def weight(
    given: Amount, what: str, labels: Labels, radius: float | None = None, example: str = "10g"
) -> float:
    """Read "10g" as a weight above 0 as those of `labels` are, kg or kg·m.

    Raises
    ------
    ValueError
        Naming the option, for anything else, and for a mass where the labels have unbalances (or the reverse)
        without a radius, m.
    """
    from rotorid.files.units import Quantity
    from rotorid.files.weights_with_units import in_job_units

    own = labels.weight_unit
    value, unit = _weight(given, what, example) if isinstance(given, str) else (given, _si(own))
    _above_zero(value, given, what, example)
    found = in_job_units(Quantity(what, value, unit), own, radius)
    if found is None:
        raise ValueError(
            f"{what}: the weight to be split is in {own}, to which {unit.name} converts only with --radius"
        )
    return found[0]


def weights(
    given: str | Sequence[float], what: str, labels: Labels, radius: float | None = None
) -> list[float]:
    """Weights with commas between them, "10g,20g", each as `weight` reads it."""
    parts = given.split(",") if isinstance(given, str) else given
    return [weight(part, what, labels, radius) for part in parts]


def vectors(given: Vector, angles: str, what: str = "VECTOR") -> tuple[Labels, list[complex]]:
    """Weights at angles, "35g@120" or "20g@30+10g@200": how to print them, and each with the rotation.

    Raises
    ------
    ValueError
        For anything else, and for units that do not convert to that of the first one.
    """
    from balancing import Labels

    way: Angles = one_of(angles, "--angles", get_args(Angles))
    if not isinstance(given, str | int | float | complex):
        raise ValueError(f"{what}: a text such as 35g@120 or one complex weight is needed, not {given!r}")
    if not isinstance(given, str):
        return Labels(weight_unit="g", weight_scale=1e3, angles=way), [complex(given)]
    labels, found = None, []
    for part in _PLUS.split(given):
        head, at, tail = part.partition("@")
        if not at:
            raise ValueError(
                f"{what} {part.strip()!r}: write a weight at an angle in degrees, such as 35g@120"
            )
        value, unit = _weight(head, what, "35g@120")
        if value < 0:
            raise ValueError(
                f"{what} {head.strip()!r}: a weight must not be negative; turn its angle by 180°"
            )
        if labels is None:
            labels = Labels(weight_unit=unit.name, weight_scale=unit.scale, angles=way)
        elif units.weight(labels.weight_unit).kind != unit.kind:
            raise ValueError(
                f"{what} {given!r}: masses and unbalances (mass × radius) cannot be added; "
                "write all as one kind"
            )
        angle = radians(degrees(tail.removesuffix("°"), what))
        found.append(complex(labels.weight_from(unit.to_si(value), angle)))
    assert labels is not None  # a split text has at least one part
    return labels, found


def largest_weights(job: Job, given: Weights | None, what: str = "--max-mass") -> dict[str, Quantity]:
    """Largest weights by plane: "5g" of every plane that is not left out, "left=5g,right=3g" of these.

    Without a unit in that of the job's weights; numbers in SI.

    Raises
    ------
    ValueError
        Naming the option and what is wrong with it.
    """
    own = job.trials.labels.weight_unit
    example = "5g; to use no weight at all, leave the plane out"

    def read(value: Amount) -> Quantity:
        if not isinstance(value, str):
            return _limit(value, _si(own), value, what, "0.005 kg")
        size, word = _number(value, what, "5g")
        return _limit(size, _weight_unit(word or own, value, what), value, what, example)

    if given is None:
        return {}
    if isinstance(given, str) and "," in given and "=" not in given:
        raise ValueError(
            f"{what} {given!r}: give one value for all planes, or each plane once (a decimal sign is a point)"
        )
    return _limits(given, what, read, "5g or left=5g,right=3g", "plane", list(job.planes), job.used)


def largest_amplitudes(job: Job, given: Amplitudes, what: str = "--limit") -> dict[str, Quantity]:
    """Largest amplitudes by sensor: each `SENSOR=VALUE`, or `VALUE` of every sensor.

    In the job's amplitude unit, or with one that converts to it; numbers in SI.

    Raises
    ------
    ValueError
        Naming the option and what is wrong with it.
    """
    own, sensors = units.vibration(job.trials.labels.vibration_unit), job.trials.sensors

    def read(value: Amount) -> Quantity:
        if not isinstance(value, str):
            return _limit(value * own.scale, own, value, what, "20e-6")
        size, word = _number(value, what, "20")
        try:
            unit = units.vibration(word or own.name)
        except UnitError as error:
            raise ValueError(f"{what} {value!r}: expected {error}") from None
        if unit.kind != own.kind:
            raise ValueError(
                f"{what} {value!r}: the readings are in {own.name or 'no unit'}, to which {word} does not "
                "convert"
            )
        return _limit(size, unit, value, what, "20")

    several = [given] if isinstance(given, str | Mapping) else given
    found: dict[str, Quantity] = {}
    for one in several:
        if not isinstance(one, str | Mapping):
            raise ValueError(f"{what} {given!r}: texts are needed, such as SENSOR=20")
        found |= _limits(one, what, read, "SENSOR=20", "sensor", sensors, sensors)
    return found


def limited(job: Job, max_mass: Weights | None, limits: Amplitudes) -> Job:
    """The job with these limits in place of its own."""
    from rotorid.files.job import with_limits

    return with_limits(job, largest_weights(job, max_mass), largest_amplitudes(job, limits))


def _limits(
    given: Amount | Mapping[str, Amount],
    what: str,
    read: Callable[[Amount], Quantity],
    example: str,
    kind: str,
    known: Sequence[str],
    every: Sequence[str],
) -> dict[str, Quantity]:
    """Limits of known planes or sensors, or one of every."""
    if isinstance(given, Mapping):
        found = {name: read(value) for name, value in given.items()}
    elif isinstance(given, str):
        found = pairs(
            [given] if kind == "sensor" else given,
            what,
            lambda _, text: read(text),
            example,
            lambda text: dict.fromkeys(every, read(text)),
        )
    else:
        found = dict.fromkeys(every, read(given))
    for name in found:
        if name not in known:
            raise ValueError(
                f"{what} {given!r}: there is no {kind} {name!r}{did_you_mean(name, known)}; "
                f"there are {listing(map(repr, known), 'and')}"
            )
    return found


def _limit(value: float, unit: Unit, given: object, what: str, example: str) -> Quantity:
    from rotorid.files.units import Quantity

    return Quantity(f"{what} {given!r}", _above_zero(value, given, what, example), unit)


def _number(text: str, what: str, example: str) -> tuple[float, str]:
    """A number and the unit behind it ("" without)."""
    match = _WORD.fullmatch(text)
    try:
        value = parse_number(match[1] if match else text.strip())
        check_size(value, LARGEST_STATED)
    except NotANumber as error:
        raise ValueError(f"{what} {text.strip()!r}: expected {error}, such as {example}") from None
    return value, (match[2] or "").strip() if match else ""


def _above_zero(value: float, given: object, what: str, example: str) -> float:
    if not value > 0:
        raise ValueError(f"{what} {str(given).strip()!r}: expected a value above 0, such as {example}")
    return value


def _weight(text: str, what: str, example: str) -> tuple[float, Unit]:
    value, word = _number(text, what, example)
    if not word:
        raise ValueError(f"{what} {text.strip()!r}: a weight needs its unit, such as {example}")
    return value, _weight_unit(word, text, what)


def _weight_unit(word: str, text: str, what: str) -> Unit:
    try:
        return units.weight(word)
    except UnitError as error:
        raise ValueError(f"{what} {text.strip()!r}: expected {error}") from None


def _si(unit: str) -> Unit:
    """The SI unit of the same kind of weights."""
    return units.MASS["kg"] if unit in units.MASS else units.UNBALANCE["kg_m"]


def grade(text: str | float) -> float:
    """Read "G2.5", "g 2.5", "2,5" or 2.5 as a grade, mm/s.

    Raises
    ------
    ValueError
        For a grade that the standard does not have, with its neighbours.
    """
    from balancing import GRADES

    body = str(text).strip().lstrip("Gg").strip().replace(",", ".")
    value = float(body) if body.replace(".", "", 1).isdecimal() else float("nan")
    if value in GRADES:
        return value
    near = [g for g in GRADES if g < value][-1:] + [g for g in GRADES if g > value][:1]
    hint = f"the nearest are {' and '.join(f'G{g:g}' for g in near)}; " if near else ""
    known = ", ".join(f"G{g:g}" for g in GRADES)
    raise ValueError(f"there is no balance quality grade {str(text)!r}: {hint}the grades are {known}")
