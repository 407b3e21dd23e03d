"""The page as HTML: the job as its files hold it, and what is computed of it; the edits of its buttons."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

from rotorid.files.problems import quote
from rotorid.worksheet.calculation import Results
from rotorid.worksheet.job_files import JobFiles
from rotorid.worksheet.job_settings import setting, text_of

if TYPE_CHECKING:
    from jinja2 import Template

ERRORS = {
    "amplitude_percent": "reading, %",
    "phase_deg": "phase, °",
    "run_percent": "run to run, %",
    "placement_deg": "place of a weight, °",
    "placement_percent": "weight, %",
}
_WORDS = {
    **ERRORS,
    "[errors]": "errors",
    "check_weights": "weights of the check run",
    "max_weight": "largest",
}
CONVENTIONS = (
    ("phase", "lag", "Phase lag: the rotor turns by it from the pulse to the next peak (most instruments)"),
    ("phase", "lead", "Phase lead: the rotor turns by it from a peak to the next pulse"),
    ("angles", "with rotation", "Angles from the mark with the rotation"),
    (
        "angles",
        "against rotation",
        "Angles from the mark against the rotation: rising for a fixed pointer",
    ),
)
"""Choices of the page: the setting, its value, what it means."""
_PLANE = (
    ("max_", "largest, {unit}", "max_{weight}"),
    ("radius_", "radius, mm", "radius_mm"),
    ("holes", "holes", "holes"),
    ("first_hole", "first hole, °", "first_hole_deg"),
    ("available_", "pieces, {unit}", "available_{pieces}"),
    ("per_", "per hole", "per_hole"),
    ("stock", "stock", "stock"),
)
"""Settings of a plane: how their key begins, the heading, the key where there is none yet."""
Edit = dict[str, Any]
Fields = Mapping[str, str]


class Cell(NamedTuple):
    """A field to type in: `edit` is what it changes, without old and new text; `why` says what is wrong."""

    id: str
    text: str
    label: str
    edit: Edit
    closed: bool
    why: str = ""


class Problem(NamedTuple):
    """Something wrong or missing: in words, and the cell of it, "" for none."""

    text: str
    cell: str
    missing: bool


Line = tuple[str, Sequence[Cell | None], list[Edit]]
"""A heading, cells, and what removes them."""


def page(files: JobFiles, results: Results, notice: str) -> str:
    """The page as it is now."""
    view = View(files, results)
    return _template().render(view=view, job=files.now, files=files, notice=notice, **results._asdict())


@cache
def _template() -> Template:
    from jinja2 import Environment, PackageLoader

    loader = PackageLoader("rotorid.worksheet", "page")
    pages = Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    pages.filters["words"] = in_words
    pages.globals["CONVENTIONS"] = CONVENTIONS
    return pages.get_template("body.html")


def in_words(text: str) -> str:
    """A message in words of the page, not of files."""
    for key, words in _WORDS.items():
        text = text.replace(key, f"“{words}”")
    return text


class View:
    """What the page shows of a job, part by part.

    Attributes
    ----------
    names, rows
        Of each table: its columns by what they hold, and its rows so, each with its `id` and `place`.
    sensors, planes, runs, baseline
        Names that occur; the run without weights.
    problems
        Of the files.
    """

    def __init__(self, files: JobFiles, results: Results) -> None:
        self.job, self.results = files.now, results
        self.names = {key: _names(table.header) for key, table in self.job.tables.items()}
        self.rows = {key: [*self._rows(key)] for key in self.job.tables}
        self.sensors = self.values("sensor", "runs", "check")
        stated = setting(self.job.settings, ["planes"])
        self.planes = _each([*(stated if isinstance(stated, dict) else ()), *self.values("plane", "weights")])
        self.runs, weighed = self.values("run", "runs", "weights"), self.values("run", "weights")
        self.baseline = next((run for run in self.runs if run not in weighed), "baseline")
        self.problems = [self._problem(one, files) for one in results.problems]

    def values(self, what: str, *keys: str) -> list[str]:
        """What stands in columns of tables, each once."""
        return _each(row.get(what, "") for key in keys for row in self.rows.get(key, ()))

    def of_run(self, key: str, run: str) -> list[dict[str, str]]:
        """Rows of a run in a table."""
        return [row for row in self.rows.get(key, ()) if row.get("run") == run]

    def unit(self, what: str, key: str = "runs") -> str:
        """The unit of a column, as people write it."""
        unit = re.sub("^(amplitude|speed|mass|unbalance)_?", "", self.column(what, key)).replace("um", "µm")
        return re.sub("(m|in)_s", r"\1/s", re.sub("_(pp|rms)$", r" \1", unit)).replace("_", "·")

    def column(self, what: str, key: str = "runs") -> str:
        """The name of a column in the file."""
        return self.names.get(key, {}).get(what, {"weight": "mass_g"}.get(what, ""))

    @property
    def closed(self) -> list[str]:
        """Why the job, or tables of it, cannot be edited."""
        return _each([self.job.read_only, *(table.read_only for table in self.job.tables.values())])

    def readings(self, key: str, run: str) -> list[Line]:
        """Amplitude and phase of each sensor, a line for each speed."""
        rows = sorted(self.of_run(key, run), key=lambda row: _number(row["speed"]))
        at = {(row["place"], row["sensor"]): row for row in rows}
        pairs = [(sensor, what) for sensor in self.sensors for what in ("amplitude", "phase")]
        return [
            (place, [self._cell(key, at.get((place, s)), what, f"{s}, {place}") for s, what in pairs], [])
            for place in _each(row["place"] for row in rows)
        ]

    def weights(self, key: str, run: str) -> list[Line]:
        """What was mounted, a line for each weight."""
        columns = [what for what in ("plane", "weight", "angle", "action") if what in self.names[key]]
        old = {line.id: line.cells for line in self.job.tables[key].rows()}
        return [
            (
                f"{n}",
                [self._cell(key, row, what, f"weight {n}") for what in columns],
                [{"table": key, "delete": row["id"], "old": old[row["id"]]}],
            )
            for n, row in enumerate(self.of_run(key, run), start=1)
        ]

    def machine(self) -> list[tuple[list[str], list[Line]]]:
        """Settings of planes, sensors and errors: headings, and lines of cells."""
        weight, unit = self.column("weight", "weights"), self.unit("weight", "weights")
        pieces = re.sub("^(mass|unbalance)_", "", weight)
        names = {"unit": unit, "weight": weight, "pieces": pieces}
        keys = [[part.format(**names) for part in each] for each in _PLANE]
        planes: list[Line] = [(one, self._settings(("planes", one), keys), []) for one in self.planes]
        limits = [cell for one in self.sensors for cell in self._settings(("sensors", one), [["limit"] * 3])]
        errors = self._settings(("errors",), [[key, words, key] for key, words in ERRORS.items()])
        return [
            (["planes", *(words for _, words, _ in keys)], planes),
            (["sensors", *self.sensors], [("largest", limits, [])] if limits else []),
            (["errors", *ERRORS.values()], [("standard", errors, [])] if self.rows else []),
        ]

    def trials(self) -> list[str]:
        """Runs with weights."""
        return [run for run in self.runs if run != self.baseline]

    def new_name(self) -> str:
        """Of the next trial run."""
        return next(name for n in range(1, 10**6) if (name := f"trial {n}") not in self.runs)

    def listed(self, *, missing: bool) -> dict[str, str]:
        """Problems in words, each with its cell; missing ones of a kind are counted."""
        those = [one for one in self.problems if one.missing is missing]
        times, cells = Counter(one.text for one in those), {one.text: one.cell for one in reversed(those)}
        return {
            f"{n} × {text}" if missing and cells[text] else text: cells[text] for text, n in times.items()
        }

    def _rows(self, key: str) -> Iterable[dict[str, str]]:
        table = self.job.tables[key]
        for line in table.rows():
            row = {what: line.cells[table.column(name)] for what, name in self.names[key].items()}
            time = line.id.rpartition("|")[2]
            yield {**row, "id": line.id, "place": row.get("speed", "") + f" ({time})" * (time != "1")}

    def _cell(self, key: str, row: Mapping[str, str] | None, what: str, place: str) -> Cell | None:
        if row is None:
            return None
        column, closed = self.column(what, key), self.job.read_only or self.job.tables[key].read_only
        name = f"{key}|{row['id']}|{column}"
        why = next((one.text for one in self.problems if one.cell == name and not one.missing), "")
        why = why.partition(": ")[2]
        edit = {"table": key, "row": row["id"], "column": column}
        return Cell(name, row[what], f"{what}, {row['run']}, {place}", edit, bool(closed), why)

    def _settings(self, top: Sequence[str], keys: Iterable[Sequence[str]]) -> list[Cell]:
        """Cells of settings by how a key begins, its words, and the key where there is none yet."""
        there, cells = setting(self.job.settings, top), list[Cell]()
        names = there if isinstance(there, dict) else {}
        for begin, words, usual in keys:
            key = [*top, next((key for key in names if key.startswith(begin)), usual)]
            text, edit = text_of(setting(self.job.settings, key)), {"key": key, "typed": True}
            cells.append(Cell(".".join(key), text, f"{words}, {top[-1]}", edit, bool(self.job.read_only)))
        return cells

    def _problem(self, one: Mapping[str, Any], files: JobFiles) -> Problem:
        """A problem of a file, with the cell of the page."""
        column, value, place = one["column"], one["value"], files.place(one["file"], one["row"])
        if place is None:
            no_weights = (one["row"], column) == (None, "weights")
            return Problem("no trial run yet" if no_weights else one["text"], "", not value)
        key, row = place
        first = self.column("amplitude", key) or self.column("plane", key)
        text = f"{_what(column or 'reading')} of {row.partition('|')[0]}"
        if value:
            text += f": {quote(value)} stands here; expected {one['expected']}"
        return Problem(text, f"{key}|{row}|{column or first}", not value)


def _what(column: str) -> str:
    """What a column holds."""
    return "weight" if re.match("mass|unbalance", column) else re.split("[_ ]", column)[0]


def _names(header: Sequence[str]) -> dict[str, str]:
    return {_what(name): name for name in reversed(header)}


def _each(values: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(filter(None, values)))


def _number(text: str) -> float:
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return 0.0


def setup(view: View, fields: Fields) -> list[Edit]:
    """Rows for sensors and speeds: of a first table, or for each run there is."""
    speeds, sensors = (_each(re.split(r"\s*[,;]\s*", fields[name].strip())) for name in ("speeds", "sensors"))
    header = [*view.names.get("runs", {}).values()]
    made: list[Edit] = []
    if not header:
        header = ["run", fields["speed_unit"], "sensor", fields["amplitude_unit"], "phase_deg"]
        made.append({"create": "runs", "header": header})
    names = _names(header)
    places = [(speed, sensor) for speed in speeds for sensor in sensors]
    return made + [
        _reading("runs", names, run, *place) for run in view.runs or ["baseline"] for place in places
    ]


def new_run(view: View, fields: Fields) -> list[Edit]:
    """A trial run with its weight and the rows of the baseline."""
    header, run = ["run", "plane", fields.get("unit", ""), "angle_deg"], fields["name"].strip()
    made: list[Edit] = [] if "weights" in view.rows else [{"create": "weights", "header": header}]
    made.append({"table": "weights", "cells": {"run": run, "plane": fields["plane"].strip()}})
    return made + _as_baseline(view, "runs", run)


def check_run(view: View, fields: Fields) -> list[Edit]:
    """A check run with what was mounted of the answer; ValueError if that is another one meanwhile."""
    answer = view.results.answer
    if answer is None or fields["of"] != answer["judgement"]:
        raise ValueError("the answer has changed meanwhile: look at it, then say again what was mounted")
    unit = answer["unit"]
    header = ["run", "plane", f"{'unbalance' if '_' in unit else 'mass'}_{unit}", "angle_deg"]
    if any(row["action"] == "remove" for row in answer["to_mount"]):
        header.append("action")  # without it all would be added
    made: list[Edit] = [{"create": "check", "header": view.job.tables["runs"].header}]
    made += [*_as_baseline(view, "check", "check"), {"create": "check_weights", "header": header}]
    for k, row in enumerate(answer["to_mount"]):
        at = row["angle_deg"] if row.get("remove_at_deg") is None else row["remove_at_deg"]
        cells = ("check", row["plane"], row["mass"], at, row["action"])
        if f"{k}" in fields:
            made.append({"table": "check_weights", "cells": dict(zip(header, cells, strict=False))})
    return made


def remove_run(view: View, fields: Fields) -> list[Edit]:
    """Without a run, its readings and weights."""
    keys = [key for key in view.rows if key.startswith("check") == fields["table"].startswith("check")]
    return [{"table": key, "delete": row["id"]} for key in keys for row in view.of_run(key, fields["run"])]


def _as_baseline(view: View, key: str, run: str) -> list[Edit]:
    rows = [row for row in view.of_run("runs", view.baseline) if row["place"] == row["speed"]]
    return [_reading(key, view.names["runs"], run, row["speed"], row["sensor"]) for row in rows]


def _reading(key: str, names: Mapping[str, str], run: str, speed: str, sensor: str) -> Edit:
    cells = {names["run"]: run, names["speed"]: speed, names["sensor"]: sensor}
    return {"table": key, "cells": cells}


ACTIONS: Mapping[str, Callable[[View, Fields], list[Edit]]] = {
    one.__name__: one for one in (setup, new_run, check_run, remove_run)
}
"""What the buttons of the page do."""
