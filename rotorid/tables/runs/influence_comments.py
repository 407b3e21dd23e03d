"""What the comment lines of an influence table say: its conventions, and the errors of a reading."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple, cast, get_args

import numpy as np
from numpy.typing import ArrayLike

from balancing.coefficients.influence import Influence
from balancing.coefficients.run_errors import Origin, RunErrors
from balancing.data.conventions import Labels
from balancing.data.reading_errors import Source
from balancing.data.trials import ReadingErrors
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.tables.reader.columns import Table
from rotorid.tables.reader.decimal_numbers import NotANumber, parse_number
from rotorid.tables.reader.problems import Problems
from rotorid.tables.reader.units import Unit
from rotorid.tables.runs.stated_conventions import ANGLES, PHASES, StatedErrors

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
_RUN = ("run_percent", "run_weights_percent", "run_floor")
"""Own, common at a speed, common to the run; one number alone: common to the run."""
_DEGREES = ("degrees_of_freedom", "reading_degrees_of_freedom")
_KEYS: dict[str, tuple[int, ...] | tuple[str, ...]] = {
    **dict.fromkeys(_SIZES, (1,)),
    "source": tuple(word for word in get_args(Source) if word != "unknown"),
    **dict.fromkeys(_DEGREES, (1,)),
    **dict.fromkeys(_RUN, (1, 3)),
    "run_source": get_args(Origin),
    "run_share": (1,),
    "run_interval": (2,),
    "run_case": (4,),
    "run_merged": ("yes", "no"),
}
"""What may stand at each key: so many numbers, or one of some words."""
_ERRORS = re.compile(r"errors?\s*[.:=].*", re.IGNORECASE)
_STATEMENT = re.compile(r"errors\.(\w+)\s*=\s*(.*)")


class Errors(NamedTuple):
    """Errors of a single reading, degrees of freedom of the coefficients, where they come from.

    Degrees of freedom of a reading, errors between runs, and their share as `Influence.own_between`.
    """

    reading: ReadingErrors | None = None
    dof: float | None = None
    source: Source = "unknown"
    reading_dof: float | None = None
    run: RunErrors = RunErrors()
    between: float = 0.0


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
    before = len(problems)
    numbers: dict[str, list[list[float]]] = {}
    words: dict[str, str] = {}
    first = ""
    for number, comment in enumerate(table.comments):
        if _ERRORS.fullmatch(comment) is None:
            continue
        statement = _STATEMENT.fullmatch(comment)
        key, text = statement.groups() if statement else ("", "")
        try:
            if key not in _KEYS:
                hint = did_you_mean(key, _KEYS)
                raise NotANumber(f"# errors.KEY = VALUE with one of the keys {listing(_KEYS)}{hint}")
            if (key in numbers or key in words) and key != "run_case":
                raise NotANumber(f"errors.{key} once")
            if isinstance(_KEYS[key][0], str):
                words[key] = _word(text, key)
            else:
                numbers.setdefault(key, []).append(_numbers(text, key))
        except NotANumber as reason:
            problems.add(table.source, _row(table, number), None, f"# {comment}", str(reason))
        first = first or comment
    if len(problems) > before or not (numbers or words):
        return Errors()
    value = {key: found[0][0] for key, found in numbers.items()}
    sizes = {key: value[key] for key in _SIZES if key in value}
    if not any(sizes.values()):
        expected = f"an error of a reading above 0 with it: # errors.{listing(_SIZES)}"
        problems.add(table.source, _row(table, table.comments.index(first)), None, f"# {first}", expected)
        return Errors()
    dof, reading_dof = (value.get(key) for key in _DEGREES)
    if not any(key.startswith("run_") for key in (*numbers, *words)):
        reading_dof = reading_dof or dof
    return Errors(
        StatedErrors(**sizes).in_si(Labels(vibration_scale=vibration.scale)),
        dof,
        cast("Source", words.get("source", "stated")),
        reading_dof,
        _run_errors(numbers, words, vibration.scale),
        value.get("run_share", 0.0),
    )


def _numbers(text: str, key: str) -> list[float]:
    values = [parse_number(word) for word in text.split()]
    if len(values) not in _KEYS[key]:
        counts = listing(map(str, _KEYS[key]))
        raise NotANumber("one number" if counts == "1" else f"{counts} numbers with spaces between them")
    if min(values) < 0:
        raise NotANumber("a number of 0 or more")
    if key in _DEGREES and not values[0]:
        raise NotANumber("a number above 0")
    return values


def _word(text: str, key: str) -> str:
    known = [str(word) for word in _KEYS[key]]
    if text not in known:
        raise NotANumber(f"one of {listing(map(repr, known))}{did_you_mean(text, known)}")
    return text


def _run_errors(
    numbers: Mapping[str, list[list[float]]], words: Mapping[str, str], scale: float
) -> RunErrors:
    sizes = np.zeros((3, 3))
    for k, key in enumerate(_RUN):
        if key in numbers:
            row = numbers[key][0]
            sizes[k, -len(row) :] = np.array(row) / (scale if key == "run_floor" else 100.0)
    cases = np.array(numbers.get("run_case", []))
    if not (cases.any() and cases[:, 0].any() and cases[:, 1:].any()):
        cases = np.ones((1, 4))
    interval = numbers.get("run_interval")
    return RunErrors(
        sizes,
        cast("Origin", words.get("run_source", "stated" if sizes.any() else "none")),
        None if interval is None else (interval[0][0] / scale, interval[0][1] / scale),
        cases[:, 0] / cases[:, 0].sum(),
        cases[:, 1:],
        words.get("run_merged") == "yes",
    )


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
    lines = [] if influence.covariance is None else [ERRORS_MEANING]
    lines += [] if influence.baseline is None else [BASELINE_MEANING]
    errors, run, scale = influence.errors, influence.run_errors, labels.vibration_scale
    if errors is None:
        return tuple(lines)
    said: dict[str, ArrayLike | None] = {
        "amplitude_percent": 100 * errors.amplitude,
        "phase_deg": np.degrees(errors.phase),
        "floor": errors.floor * scale,
        "degrees_of_freedom": influence.dof,
        "reading_degrees_of_freedom": influence.reading_dof,
    }
    words: dict[str, str] = {"source": influence.error_source} if influence.error_source != "unknown" else {}
    cases = np.zeros((0, 4))
    if run.origin != "none":
        said |= dict(zip(_RUN, run.sizes * [[100.0], [100.0], [scale]], strict=True))
        said["run_share"] = influence.own_between
        said["run_interval"] = None if run.interval is None else np.multiply(run.interval, scale)
        words |= {"run_source": run.origin, "run_merged": "yes" if run.merged else "no"}
        cases = np.column_stack((run.probability, run.ratios))
    lines += [f"errors.{key} = {_shown(value)}" for key, value in said.items() if np.any(value)]
    lines += [f"errors.{key} = {word}" for key, word in words.items()]
    return (*lines, *(f"errors.run_case = {_shown(case)}" for case in cases))


def _shown(values: ArrayLike | None) -> str:
    return " ".join(repr(float(value)) for value in np.ravel(np.asarray(values, dtype=float)))
