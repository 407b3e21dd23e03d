"""Quantities of options with units, one reader for each kind: 500kg, 8mm, 35g@120, left=100mm.

From Python they are given in SI: kg, m, N, rad/s, kg·m; complex weights count their angle with the rotation.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import radians
from typing import TYPE_CHECKING, get_args

from rotorid.base.choices import did_you_mean
from rotorid.base.text import SHORT_ANGLES, Angles, listing
from rotorid.commands.option_values import WITH_UNIT, degrees, number, one_of, one_speed, pairs
from rotorid.files import units
from rotorid.files.cells import LARGEST_STATED, NotANumber, check_size, parse_number
from rotorid.files.units import Quantity, Unit, UnitError, UnitReader

if TYPE_CHECKING:
    from balancing import Labels, Trials
    from rotorid.files import Job
    from rotorid.identify import AmplitudeErrors

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
Mounted = str | Sequence[str] | Mapping[str, complex]
"""As `mounted_weights` reads them, or kg or kg·m by plane."""
Errors = str | tuple[float, float]
"""One standard deviation of an amplitude, percent, and of a phase, degrees: "2,1"."""
_PLUS = re.compile(r"(?<=[0-9.])\s*\+\s*(?=[0-9.])")
_AND = re.compile(r"(?<![0-9.][eE])\+(?=\s*[0-9.])")
_PLACED = re.compile(r"([^@#]+?)\s*([@#])\s*([^@#]+?)\s*[°º]?")


def read_with_unit(text: str, what: str, unit: UnitReader, example: str) -> tuple[float, Unit]:
    """Read "500 kg" as a number and its unit, which `unit` reads.

    Raises
    ------
    ValueError
        For no number, no unit or another one; says what was expected.
    """
    match = WITH_UNIT.fullmatch(text)
    try:
        value = parse_number(match[1] if match else text.strip())
        check_size(value, LARGEST_STATED)
        return value, unit(match[2] if match else "")
    except (NotANumber, UnitError) as error:
        raise ValueError(f"{what} {text.strip()!r}: expected {error}, such as {example}") from None


def quantity(given: Amount, what: str, named_units: Mapping[str, Unit], example: str) -> float:
    """Read "500kg" or "500 kg" in SI."""
    if not isinstance(given, str):
        return given
    value, unit = read_with_unit(given, what, units.one_of(dict(named_units)), example)
    return unit.to_si(value)


def mass(given: Amount, what: str, example: str = "500kg") -> float:
    """Read "500kg" in kg."""
    return quantity(given, what, units.MASS, example)


def length(given: Amount, what: str, example: str = "100mm") -> float:
    """Read "350mm" in m."""
    return quantity(given, what, units.LENGTH, example)


def size(given: Amount, what: str, example: str = "100mm") -> float:
    """Read "8mm" as a length above 0, m."""
    return above_zero(length(given, what, example), given, what, example)


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


def positions(given: Positions) -> dict[str, float | None]:
    """Read "left=100mm,right=600mm" in m; None where there is no position."""
    return pairs(
        given,
        "--planes",
        lambda name, text: length(text, f"--planes {name}"),
        "left=100mm,right=600mm",
        lambda name: {name: None},
    )


def two_positions(given: str | tuple[float, float]) -> tuple[float, float]:
    """Read "0mm,700mm" in m."""
    parts = given.split(",") if isinstance(given, str) else given
    if len(parts) != 2:
        raise ValueError(f"--bearings {given!r}: two positions are needed, such as 0mm,700mm")
    first, second = (length(part, "--bearings", "0mm,700mm") for part in parts)
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
    unit = labels.weight_unit
    amount = _weight(given, what, example) if isinstance(given, str) else (given, _si(unit))
    above_zero(amount[0], given, what, example)
    converted = units.in_job_units(Quantity(what, *amount), unit, radius)
    if converted is None:
        raise ValueError(
            f"{what}: weights are in {unit} here, to which {amount[1].name} converts only with --radius or "
            "radius_mm of the plane"
        )
    return converted[0]


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

    way: Angles = one_of(SHORT_ANGLES.get(angles, angles), "--angles", get_args(Angles))
    if not isinstance(given, str | int | float | complex):
        raise ValueError(f"{what}: a text such as 35g@120 or one complex weight is needed, not {given!r}")
    if not isinstance(given, str):
        return Labels(weight_unit="g", weight_scale=1e3, angles=way), [complex(given)]
    parts = [(part.strip(), *part.partition("@")) for part in _PLUS.split(given)]
    if lost := [part for part, _, at, _ in parts if not at]:
        raise ValueError(f"{what} {lost[0]!r}: write a weight at an angle in degrees, such as 35g@120")
    each = [_weight(head, what, "35g@120") for _, head, _, _ in parts]
    first = each[0][1]
    if any(value < 0 for value, _ in each):
        raise ValueError(f"{what} {given!r}: a weight must not be negative; turn its angle by 180°")
    if any(unit.kind != first.kind for _, unit in each):
        raise ValueError(
            f"{what} {given!r}: masses and unbalances (mass × radius) cannot be added; write all as one kind"
        )
    labels = Labels(weight_unit=first.name, weight_scale=first.scale, angles=way)
    turned = [radians(degrees(tail.removesuffix("°"), what)) for *_, tail in parts]
    sizes = [unit.to_si(value) for value, unit in each]
    return labels, [complex(labels.weight_from(*one)) for one in zip(sizes, turned, strict=True)]


def mounted_weights(job: Job, given: Mounted, what: str = "--weights") -> dict[str, complex]:
    """Read "left=5g@120; right=10g#3+4@90": at angles as the job counts them, or in its holes; all add.

    Without a unit in that of the job's weights. Where material is removed it is the place to remove it from.

    Raises
    ------
    ValueError
        Naming the option and what is wrong with it.
    """
    labels, example = job.trials.labels, "left=5g@120; right=10g#3"

    def one(plane: str, text: str) -> complex:
        match, holes = _PLACED.fullmatch(text.strip()), job.conventions.holes.get(plane, {})
        if match is None:
            raise ValueError(f"{what} {text.strip()!r}: a weight at an angle or in a hole, such as {example}")
        size, sign, place = match.groups()
        size += labels.weight_unit * (not any(map(str.isalpha, size)))
        mass = weight(size, what, labels, job.planes[plane].radius)
        if sign == "#" and place not in holes:
            there = f"holes are {next(iter(holes))} to {[*holes][-1]}" if holes else "the job states none"
            raise ValueError(f"{what}: there is no hole {place} in plane {plane!r}: {there}")
        at = holes[place] if sign == "#" else degrees(place, what)
        removed = -1 if job.planes[plane].remove else 1
        return removed * complex(labels.weight_from(mass, radians(at)))

    def read(plane: str, text: str) -> complex:
        one_of(plane, what, tuple(job.planes))
        return sum((one(plane, part) for part in _AND.split(text)), 0j)

    if isinstance(given, Mapping):
        return pairs(given, what, read, example)
    total = dict[str, complex]()
    for part in given.split(";" if ";" in given else ",") if isinstance(given, str) else given:
        for plane, added in pairs([part], what, read, example).items():
            total[plane] = total.get(plane, 0j) + added
    return total


def limited(job: Job, max_mass: Weights | None, limits: Amplitudes) -> Job:
    """The job with these limits in place of its own; holes keep to the largest weight of their plane.

    Without a unit they are in that of the job's weights and readings.

    Raises
    ------
    ValueError
        Naming the option and what is wrong with it.
    """
    import numpy as np

    from balancing import Limits

    trials, unit, weights = job.trials, job.trials.labels.weight_unit, dict[str, Quantity]()
    if isinstance(max_mass, str) and "," in max_mass and "=" not in max_mass:
        once = "give one value for all planes, or each plane once (a decimal sign is a point)"
        raise ValueError(f"--max-mass {max_mass!r}: {once}")
    if max_mass is not None:
        example = "5g or left=5g,right=3g; to use no weight at all, leave the plane out"
        planes, used, si = [*job.planes], job.used, _si(unit)
        weights = _limits(
            max_mass, "--max-mass", lambda w: units.weight(w or unit), si, example, "plane", planes, used
        )
    amplitudes = _amplitudes(trials, limits) if limits else {}
    if not weights and not amplitudes:
        return job
    old = job.limits or Limits.none(len(trials.speeds), len(trials.sensors), len(job.planes))
    most, residual = dict(zip(job.planes, old.max_weight.tolist(), strict=True)), old.residual.copy()
    for plane, weight in weights.items():
        size = units.in_job_units(weight, unit, job.planes[plane].radius)
        if size is None:
            raise ValueError(
                f"{weight.key}: the weights of the job are in {unit}, to which {weight.unit.name} converts "
                f"only with a radius_mm of plane {plane!r} in the job"
            )
        most[plane] = size[0]
    for sensor, amplitude in amplitudes.items():
        residual[:, trials.sensors.index(sensor)] = amplitude.si
    return replace(job, limits=Limits(np.array([*most.values()]), residual, old.forbidden))


def _amplitudes(trials: Trials, given: Amplitudes) -> dict[str, Quantity]:
    """Largest amplitudes by sensor: each `SENSOR=VALUE`, or `VALUE` of every sensor."""
    unit, sensors = units.vibration(trials.labels.vibration_unit), trials.sensors
    si, limits = Unit("", unit.kind), dict[str, Quantity]()

    def unit_of(word: str) -> Unit:
        other = units.vibration(word or unit.name)
        if other.kind != unit.kind:
            raise UnitError(
                f"a unit that converts to that of the readings, {unit.name or 'none'}, not {word}"
            )
        return other

    for one in [given] if isinstance(given, str | Mapping) else given:
        names = one if isinstance(one, Mapping) else [one]  # names of sensors may hold commas
        limits |= _limits(names, "--limit", unit_of, si, "SENSOR=20", "sensor", sensors, sensors)
    return limits


def _limits(
    given: Amount | Sequence[str] | Mapping[str, Amount],
    what: str,
    unit_of: UnitReader,
    si: Unit,
    example: str,
    noun: str,
    there: Sequence[str],
    every: Sequence[str],
) -> dict[str, Quantity]:
    """Limits above 0 of some planes or sensors of those that are there, or one of every; numbers in SI."""
    texts: dict[str, Amount]
    if isinstance(given, int | float):
        texts = dict.fromkeys(every, given)
    else:
        texts = pairs(given, what, lambda _, text: text, example, lambda text: dict.fromkeys(every, text))
    limits = {}
    for name, text in texts.items():
        if name not in there:
            raise ValueError(
                f"{what} {given!r}: there is no {noun} {name!r}{did_you_mean(name, there)}; there are "
                f"{listing(map(repr, there), 'and')}"
            )
        value, unit = read_with_unit(text, what, unit_of, example) if isinstance(text, str) else (text, si)
        limits[name] = Quantity(f"{what} {text!r}", above_zero(value, text, what, example), unit)
    return limits


def above_zero(value: float, given: object, what: str, example: str) -> float:
    """A value above 0; ValueError for another."""
    if not value > 0:
        raise ValueError(f"{what} {str(given).strip()!r}: expected a value above 0, such as {example}")
    return value


def _weight(text: str, what: str, example: str) -> tuple[float, Unit]:
    return read_with_unit(text, what, units.weight, example)


def _si(unit: str) -> Unit:
    """The SI unit of the same kind of weights."""
    return units.MASS["kg"] if unit in units.MASS else units.UNBALANCE["kg_m"]


def grade(text: str | float) -> float:
    """Read "G2.5", "g 2.5", "2,5" or 2.5 as a grade, mm/s.

    Raises
    ------
    ValueError
        For a grade that the standard does not have.
    """
    from balancing import GRADES

    body = str(text).strip().lstrip("Gg").strip().replace(",", ".")
    value = float(body) if body.replace(".", "", 1).isdecimal() else float("nan")
    if value not in GRADES:
        grades = ", ".join(f"G{g:g}" for g in GRADES)
        raise ValueError(f"there is no balance quality grade {str(text)!r}: the grades are {grades}")
    return value


def percent_and_degrees(given: Errors) -> tuple[float, float]:
    """Read "2,1".

    Raises
    ------
    ValueError
        For anything else, an amplitude's below 0 or above 1000 percent, a phase's above 360 degrees.
    """
    parts = [number(part) for part in given.split(",")] if isinstance(given, str) else given
    if len(parts) != 2 or not (0 <= parts[0] <= 1000 and 0 <= parts[1] <= 360):
        raise ValueError(f"--errors {given!r}: percent of an amplitude and degrees of a phase, 2,1")
    return parts[0], parts[1]


def amplitude_errors(stated: AmplitudeErrors | None, given: Errors | None) -> AmplitudeErrors | None:
    """Errors of the model file; an option takes their place."""
    if given is None:
        return stated
    from rotorid.identify import AmplitudeErrors

    percent, phase = percent_and_degrees(given)
    return AmplitudeErrors(percent / 100.0, radians(phase), stated.floor if stated else 0.0)
