"""What the comment lines of an influence table say: its conventions, and the errors of a reading."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple, get_args

import numpy as np

from balancing.coefficients.influence import Influence
from balancing.data.conventions import Labels
from balancing.data.errors import Source
from balancing.data.trials import ReadingErrors
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.tables.reader.columns import Table
from rotorid.tables.reader.number import NotANumber, parse_number
from rotorid.tables.reader.problems import Problems
from rotorid.tables.reader.units import Unit
from rotorid.tables.runs.conventions import ANGLES, PHASES, StatedErrors

_CONVENTION = re.compile(r"(phase|angle)s?\b\s*([:=]|\bis\b|\bare\b)?\s*[\"']?(.*?)[\"']?\.?", re.IGNORECASE)
_LIKELY = {
    "phase": re.compile(r"\bphases?\b.*\b(lead|lag)|\b(lead|lag).*\bphases?\b", re.IGNORECASE),
    "angles": re.compile(
        r"\bangles?\b.*\b(with|against)\b|\b(against|with) (the )?rotation\b", re.IGNORECASE
    ),
}
PHASE_MEANING = "phase_deg is the phase reading that a weight at angle 0 causes"
ERRORS_MEANING = (
    "std and correlation are those of influence*cos(phase_deg), re, and of influence*sin(phase_deg), im"
)
_SIZES = ("amplitude_percent", "phase_deg", "floor")
_KEYS = (*_SIZES, "source", "degrees_of_freedom")
_SOURCES = tuple(word for word in get_args(Source) if word != "unknown")
_LINE = re.compile(r"errors?\s*[.:=]\s*(.*)", re.IGNORECASE)
_STATEMENT = re.compile(r"(\w+)\s*[:=]\s*[\"']?(.*?)[\"']?")


class Errors(NamedTuple):
    """Errors of a single reading, their degrees of freedom, and where they come from."""

    reading: ReadingErrors | None = None
    dof: int | None = None
    source: Source = "unknown"


def read_conventions(source: str, comments: Sequence[str], problems: Problems) -> dict[str, str]:
    """What comment lines of the table say about its conventions.

    Capitals and the sign between do not matter; a comment that seems to state a convention in other words is
    a problem, because passing over it would turn the weights round.
    """
    said: dict[str, str] = {}
    for comment in comments:
        match = _CONVENTION.fullmatch(comment)
        word, sign = (" ".join(match[3].casefold().split()), match[2]) if match else ("", None)
        key = {"phase": "phase", "angle": "angles"}.get(match[1].casefold() if match else "", "")
        likely = key if sign else next((k for k, words in _LIKELY.items() if words.search(comment)), "")
        if comment == PHASE_MEANING or not (likely or word in (*PHASES, *ANGLES)):
            continue
        key = key or likely
        allowed = PHASES if key == "phase" else ANGLES
        if word not in allowed or said.get(key, word) != word:
            expected = f"# {key} = {listing(allowed)}, once{did_you_mean(word, allowed)}"
            problems.add(source, None, None, f"# {comment}", expected)
        said[key] = word
    return said


def read_errors(table: Table, vibration: Unit, problems: Problems) -> Errors:  # noqa: C901
    """Errors of a reading from comment lines such as `# errors.phase_deg = 2`, or what is unknown."""
    before = len(problems)
    said: dict[str, tuple[str, int]] = {}
    for number, comment in enumerate(table.comments):
        line = _LINE.fullmatch(comment)
        if line is None:
            continue
        statement = _STATEMENT.fullmatch(line[1])
        key = statement[1].casefold() if statement else ""
        if statement is None or key not in _KEYS:
            hint = did_you_mean(key, _KEYS)
            expected = f"# errors.KEY = VALUE with one of the keys {listing(_KEYS)}{hint}"
            problems.add(table.source, _row(table, number), None, f"# {comment}", expected)
        elif key in said:
            problems.add(table.source, _row(table, number), None, f"# {comment}", f"errors.{key} once")
        else:
            said[key] = (statement[2], number)

    def complain(key: str, expected: str) -> None:
        number = said[key][1]
        problems.add(table.source, _row(table, number), None, f"# {table.comments[number]}", expected)

    sizes: dict[str, float] = {}
    for key in (key for key in (*_SIZES, "degrees_of_freedom") if key in said):
        try:
            sizes[key] = parse_number(said[key][0])
        except NotANumber as reason:
            complain(key, str(reason))
            continue
        if sizes[key] < 0:
            complain(key, "a number of 0 or more")
    dof = sizes.pop("degrees_of_freedom", None)
    if dof is not None and dof >= 0 and (dof < 1 or dof != int(dof)):
        complain("degrees_of_freedom", "a whole number from 1")
    source = said["source"][0] if "source" in said else "stated"
    found = next((word for word in _SOURCES if word == " ".join(source.casefold().split())), None)
    if found is None:
        complain("source", f"one of {listing(map(repr, _SOURCES))}{did_you_mean(source, _SOURCES)}")
    if len(problems) > before or not said:
        return Errors()
    if not any(sizes.values()):
        expected = f"an error of a reading above 0 with it: # errors.{listing(_SIZES)}"
        complain(next(iter(said)), expected)
        return Errors()
    assert found is not None
    stated = StatedErrors(**sizes).in_si(Labels(vibration_scale=vibration.scale))
    return Errors(stated, None if dof is None else int(dof), found)


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
        if _LINE.fullmatch(note) or read_conventions("", [note], problems) or len(problems):
            raise ValueError(
                f"the note {note!r} would be read as a statement about conventions or errors: reword it"
            )


def error_comments(influence: Influence, labels: Labels) -> tuple[str, ...]:
    """Comment lines that `read_errors` reads; none where nothing is known."""
    lines = [] if influence.covariance is None else [ERRORS_MEANING]
    errors = influence.errors
    if errors is not None:
        sizes = (100.0 * errors.amplitude, np.degrees(errors.phase), errors.floor * labels.vibration_scale)
        lines += [f"errors.{key} = {float(size)!r}" for key, size in zip(_SIZES, sizes, strict=True) if size]
        if influence.error_source != "unknown":
            lines.append(f"errors.source = {influence.error_source}")
        if influence.dof is not None:
            lines.append(f"errors.degrees_of_freedom = {influence.dof}")
    return tuple(lines)
