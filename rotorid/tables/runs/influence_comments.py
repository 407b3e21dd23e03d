"""What the comment lines of an influence table say: its conventions, and the errors of a reading."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from typing import NamedTuple, cast, get_args

import numpy as np

from balancing import Influence, Labels, Reading, RunErrors
from rotorid.base.arrays import FloatArray
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.base.words import ErrorSource, Origin
from rotorid.files.columns import Table
from rotorid.files.conventions import ANGLES, PHASES, StatedErrors
from rotorid.files.decimal_numbers import NotANumber, parse_number
from rotorid.files.problems import Problems
from rotorid.files.units import Unit

_ALLOWED = {"phase": PHASES, "angles": ANGLES}
_CONVENTION = re.compile(r"(phase|angles)\s*=\s*(.*)")
_DOUBTFUL = re.compile(
    r"(phase|angle)s?\b\s*([:=]|is\b|are\b|lead|lag).*"
    r"|(?=.*\bphases?\b).*\b(lead|lag).*"
    r"|.*\bangles?\b.*\b(with|against)\b.*"
    r"|.*\b(with|against) (the )?rotation\b.*",
    re.IGNORECASE,
)
"""Comments that may mean a convention in other words."""
PHASE_MEANING = "phase_deg is the phase reading that a weight at angle 0 causes"
ERRORS_MEANING = (
    "std and correlation are those of influence*cos(phase_deg), re, and of influence*sin(phase_deg), im"
)
BASELINE_MEANING = "rows of (baseline): the vibration without weights, in the unit of the vibration"
_SIZES = ("amplitude_percent", "phase_deg", "floor")
_DEGREES, _RUN = "reading_degrees_of_freedom", "run_percent"
_PARTS = ("own", "common", "weights", "unbalance")
"""Sizes of `RunErrors`, in their order."""
_NUMBERS = (*_SIZES, _DEGREES, _RUN)
_SOURCES = tuple(word for word in get_args(ErrorSource) if word != "unknown")
_KEYS = (*_NUMBERS, "source", "runs")
_ERRORS = re.compile(r"errors?\s*[.:=].*", re.IGNORECASE)
_STATEMENT = re.compile(r"errors\.(\w+)\s*=\s*(.*)")


class Errors(NamedTuple):
    """Errors of a single reading and between runs."""

    reading: Reading
    run: RunErrors


def read_conventions(source: str, comments: Sequence[str], problems: Problems) -> dict[str, str]:
    """What comment lines of the table say about its conventions: `phase = lag`, `angles = with rotation`.

    A comment that may mean a convention in other words is a problem, because passing over it would turn the
    weights round.
    """
    said: dict[str, str] = {}
    for comment in comments:
        found = _CONVENTION.fullmatch(comment)
        expected = ""
        if found is not None:
            key, word = found.groups()
            if word not in _ALLOWED[key] or said.setdefault(key, word) != word:
                expected = f"# {key} = {listing(_ALLOWED[key])}, once{did_you_mean(word, _ALLOWED[key])}"
        elif _DOUBTFUL.fullmatch(comment):
            lines = [f"# {key} = {listing(words)}" for key, words in _ALLOWED.items()]
            expected = f"{listing(lines, 'and')}, in these words"
        if expected:
            problems.add(source, None, None, f"# {comment}", expected)
    return said


def read_errors(table: Table, vibration: Unit, problems: Problems) -> Errors:
    """Errors of a reading from comment lines such as `# errors.phase_deg = 2`, or what is unknown."""
    before, scale = len(problems), vibration.scale
    numbers: dict[str, float] = {}
    run, source, first = RunErrors(np.zeros((1, len(_PARTS))), np.ones(1), "none"), "", ""
    seen: set[str] = set()
    for number, comment in enumerate(table.comments):
        if _ERRORS.fullmatch(comment) is None:
            continue
        statement = _STATEMENT.fullmatch(comment)
        key, text = statement.groups() if statement else ("", "")
        first = first or comment
        try:
            if key not in _KEYS:
                hint = did_you_mean(key, _KEYS)
                raise NotANumber(f"# errors.KEY = VALUE with one of the keys {listing(_KEYS)}{hint}")
            if key in seen:
                raise NotANumber(f"errors.{key} once")
            seen.add(key)
            if key == "runs":
                run = _runs(text, scale)
            elif key in _NUMBERS:
                numbers[key] = _size(text, above_zero=key == _DEGREES)
            elif text in _SOURCES:
                source = text
            else:
                raise NotANumber(f"one of {listing(map(repr, _SOURCES))}{did_you_mean(text, _SOURCES)}")
        except NotANumber as reason:
            problems.add(table.source, _row(table, number), None, f"# {comment}", str(reason))
    if len(problems) > before or not seen:
        return Errors(Reading(), run)
    if _RUN in numbers and "runs" not in seen:
        half = numbers[_RUN] / 100 / np.sqrt(2)
        run = RunErrors(np.array([[half, half, 0.0, 0.0]]), np.ones(1), "stated")
    sizes = {key: numbers[key] for key in _SIZES if key in numbers}
    if not any(sizes.values()):
        expected = f"an error of a reading above 0 with it: # errors.{listing(_SIZES)}"
        problems.add(table.source, _row(table, table.comments.index(first)), None, f"# {first}", expected)
        return Errors(Reading(), run)
    reading = StatedErrors(**sizes).in_si(Labels(vibration_scale=scale))
    dof = numbers.get(_DEGREES, np.inf)
    return Errors(Reading(reading, cast("ErrorSource", source or "stated"), dof=dof), run)


def _runs(text: str, scale: float) -> RunErrors:
    """Errors between runs from the JSON that `error_comments` writes."""
    try:
        value = json.loads(text)
        columns = np.array([value[f"{part}_percent"] for part in _PARTS], dtype=np.float64) / 100
        probability = np.array(value["probability"], dtype=np.float64)
        single = np.array([value["level"], value["evenly"]], dtype=np.float64)
        sound = columns.shape == (len(_PARTS), len(probability)) and value["source"] in get_args(Origin)
        everything = np.concatenate((columns.ravel(), probability, single))
        if not (sound and (everything >= 0).all() and np.isfinite(everything).all() and probability.any()):
            raise ValueError
    except (ValueError, TypeError, KeyError):
        keys = [*(f"{part}_percent" for part in _PARTS), "probability"]
        raise NotANumber(
            "JSON with source, level, evenly and equally many numbers of 0 or more in each of "
            + listing(keys, "and")
        ) from None
    probability /= probability.sum()
    return RunErrors(columns.T, probability, value["source"], float(single[0]) / scale, float(single[1]))


def _size(text: str, *, above_zero: bool) -> float:
    value = parse_number(text.strip())
    if value < 0 or (above_zero and not value):
        raise NotANumber("a number above 0" if above_zero else "a number of 0 or more")
    return value


def _row(table: Table, number: int) -> int | None:
    """Row of a comment line, where all of them stand above the header without a gap."""
    return number + 1 if table.header_row == len(table.comments) + 1 else None


def check_notes(notes: Sequence[str]) -> None:
    """Refuse notes that a reader would take for a statement about conventions or errors.

    Raises
    ------
    ValueError
        Naming the note.
    """
    problems = Problems()
    for note in notes:
        if _ERRORS.fullmatch(note) or read_conventions("", [note], problems) or len(problems):
            raise ValueError(
                f"the note {note!r} would be read as a statement about conventions or errors: reword it"
            )


def error_comments(influence: Influence, labels: Labels) -> tuple[str, ...]:
    """Comment lines that `read_errors` reads; none where nothing is known."""
    lines = [ERRORS_MEANING] if influence.known_errors else []
    lines += [BASELINE_MEANING] if influence.has_baseline else []
    reading, run, scale = influence.reading, influence.run_errors, labels.vibration_scale
    if reading.errors is not None:
        errors = reading.errors
        sizes = 100 * errors.amplitude, float(np.degrees(errors.phase)), errors.floor * scale
        lines += [f"errors.{key} = {value!r}" for key, value in zip(_SIZES, sizes, strict=True) if value]
        lines += [f"errors.source = {reading.source}"] if reading.source != "unknown" else []
        lines += [f"errors.{_DEGREES} = {float(reading.dof)!r}"] if np.isfinite(reading.dof) else []
    if reading.errors is not None and run.origin != "none":
        likely = run.probability > 1e-4
        percent = zip(_PARTS, 100 * run.sizes[likely].T, strict=True)
        told = {
            "source": run.origin,
            "level": run.level * scale,
            "evenly": run.evenly,
            **{f"{part}_percent": _rounded(sizes) for part, sizes in percent},
            "probability": _rounded(run.probability[likely]),
        }
        lines.append(f"errors.runs = {json.dumps(told)}")
    return tuple(lines)


def _rounded(values: FloatArray) -> list[float]:
    """To six figures."""
    return [float(f"{value:.6g}") for value in values]
