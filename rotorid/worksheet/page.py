"""The page as HTML: the job as its files hold it, and what is computed of it; the edits of its buttons."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

from rotorid.files.problems import quote
from rotorid.worksheet.calculation import Results
from rotorid.worksheet.job_files import JobFiles
from rotorid.worksheet.job_settings import setting, text_of
from rotorid.worksheet.text_table import content

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
    ("angles", "against rotation", "Angles from the mark against the rotation: rising for a fixed pointer"),
)
CHOICES = {
    "speed": {"speed_rpm": "rpm", "speed_Hz": "Hz", "speed_rad_s": "rad/s"},
    "amplitude": {
        "amplitude_um_pp": "µm peak to peak",
        "amplitude_um": "µm peak",
        "amplitude_mil_pp": "mil peak to peak",
        "amplitude_mm_s_rms": "mm/s rms",
        "amplitude_mm_s": "mm/s peak",
        "amplitude_in_s": "in/s peak",
        "amplitude_g": "g peak",
    },
    "weight": {
        "mass_g": "g",
        "mass_kg": "kg",
        "mass_oz": "oz",
        "unbalance_g_mm": "g·mm",
        "unbalance_oz_in": "oz·in",
    },
    "lag": {
        "": "not known",
        "below": "below the critical",
        "at": "at the critical",
        "above": "above the critical",
    },
}
"""Of the page's forms: what a file or an option says, and the words of it."""
Edit = dict[str, Any]
Fields = Mapping[str, str]
Row = dict[str, str]


class Cell(NamedTuple):
    """A field to type in; `why` says what is wrong with it."""

    id: str
    text: str
    label: str
    closed: bool
    why: str = ""


Line = tuple[str, Sequence[Cell | None], str]
"""A heading, cells, and the row that its button removes, "" for none."""


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
    pages.globals |= {"CONVENTIONS": CONVENTIONS, "CHOICES": CHOICES}
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
    sensors, planes, groups, runs, baseline, trials
        Names that occur; the run without weights, and the others.
    problems
        Of the files: words, and the cells that they are about, "" for none.
    """

    def __init__(self, files: JobFiles, results: Results) -> None:
        self.job, self.results = files.now, results
        self.names = {key: table.columns() for key, table in self.job.tables.items()}
        self.rows = {key: [*self._rows(key)] for key in self.job.tables}
        self.sensors = self.values("sensor", "runs", "check")
        groups = self._stated("groups")
        inside = [plane for name in groups for plane in self._stated("groups", name, "planes")]
        weighed_planes = [name for name in self.values("plane", "weights") if name not in groups]
        self.planes, self.groups = _each([*self._stated("planes"), *inside, *weighed_planes]), [*groups]
        self.runs, weighed = self.values("run", "runs", "weights"), self.values("run", "weights")
        self.baseline = next((run for run in self.runs if run not in weighed), "baseline")
        self.trials = [run for run in self.runs if run != self.baseline]
        self.problems = defaultdict[str, list[str]](list)
        for one in results.problems:
            text, cell = self._problem(one, files.place(one["file"], one["row"]))
            self.problems[text].append(cell)

    def values(self, what: str, *keys: str) -> list[str]:
        """What stands in columns of tables, each once."""
        return _each(row.get(what, "") for key in keys for row in self.rows.get(key, ()))

    def of_run(self, key: str, run: str) -> list[Row]:
        """Rows of a run in a table."""
        return [row for row in self.rows.get(key, ()) if row.get("run") == run]

    def unit(self, what: str, key: str = "runs") -> str:
        """The unit of a column, as people write it."""
        unit = self.column(what, key).partition("_")[2].replace("um", "µm")
        return re.sub("(m|in)_s", r"\1/s", re.sub("_(pp|rms)$", r" \1", unit)).replace("_", "·")

    def column(self, what: str, key: str = "runs") -> str:
        """The name of a column in the file."""
        return self.names.get(key, {}).get(what, {"weight": "mass_g"}.get(what, ""))

    def readings(self, key: str, run: str) -> list[Line]:
        """Amplitude and phase, if there is one, of each sensor, a line for each speed."""
        rows = self.of_run(key, run)
        at = {(row["place"], row["sensor"]): row for row in rows}
        read = [what for what in ("amplitude", "phase") if what in self.names[key]]
        pairs = [(sensor, what) for sensor in self.sensors for what in read]
        return [
            (place, [self._cell(key, at.get((place, s)), what, f"{s}, {place}") for s, what in pairs], "")
            for place in _each(row["place"] for row in rows)
        ]

    def weights(self, key: str, run: str) -> list[Line]:
        """What was mounted, a line for each weight."""
        columns = [what for what in ("plane", "weight", "angle", "action") if what in self.names[key]]
        return [
            (f"{n}", [self._cell(key, row, what, f"weight {n}") for what in columns], f"{key}|{row['id']}")
            for n, row in enumerate(self.of_run(key, run), start=1)
        ]

    def machine(self) -> list[tuple[list[str], list[Line]]]:
        """Settings of planes, sensors and errors: headings, and lines of cells."""
        weight, unit = self.column("weight", "weights"), self.unit("weight", "weights")
        plane = {
            f"max_{weight}": f"largest, {unit}",
            "radius_mm": "radius, mm",
            "holes": "holes",
            "first_hole_deg": "first hole, °",
            f"available_{weight.partition('_')[2]}": f"pieces, {unit}",
            "per_hole": "per hole",
            "stock": "stock",
        }
        tables = {
            "planes": (self.planes, plane),
            "sensors": (self.sensors, {"limit": "largest"}),
            "errors": ([""], ERRORS),
        }
        return [
            ([top, *columns.values()], [(name, self._settings(top, name, columns), "") for name in names])
            for top, (names, columns) in tables.items()
        ]

    def removal(self, key: str, run: str) -> list[Edit]:
        """Edits that remove a run, its readings and weights."""
        keys = [one for one in self.rows if one.startswith("check") == key.startswith("check")]
        return [{"delete": f"{one}|{row['id']}"} for one in keys for row in self.of_run(one, run)]

    def _rows(self, key: str) -> Iterable[Row]:
        table = self.job.tables[key]
        for line in table.rows():
            row = {what: line.cells[table.column(name)] for what, name in self.names[key].items()}
            time = line.id.rpartition("|")[2]
            yield {**row, "id": line.id, "place": row.get("speed", "") + f" ({time})" * (time != "1")}

    def _cell(self, key: str, row: Row | None, what: str, place: str) -> Cell | None:
        if row is None:
            return None
        name, closed = f"{key}|{row['id']}|{self.column(what, key)}", self.job.tables[key].read_only
        why = "; ".join(text for text, cells in self.problems.items() if row[what] and name in cells)
        label = f"{what}, {row['run']}, {place}"
        return Cell(name, row[what], label, bool(self.job.read_only or closed), why)

    def _settings(self, top: str, name: str, columns: Mapping[str, str]) -> list[Cell]:
        """Cells of settings; one that is stated in another unit has the key of that."""
        path, cells = [top, name] if name else [top], list[Cell]()
        stated = self._stated(*path)
        for usual, words in columns.items():
            others = (one for one in stated if name and content(one) == content(usual))
            key = next(others, usual)
            text, label = text_of(stated.get(key)), f"{words}, {name or top}"
            cells.append(Cell("|".join([*path, key]), text, label, bool(self.job.read_only)))
        return cells

    def _stated(self, *path: str) -> Mapping[str, Any]:
        """Settings of a table of the job, none where there is no table."""
        its = setting(self.job.settings, path)
        return its if isinstance(its, dict) else {}

    def _problem(self, one: Mapping[str, Any], place: tuple[str, str] | None) -> tuple[str, str]:
        """A problem of a file in words, and the cell of the page, "" for none."""
        column = one["column"]
        if place is None:
            no_weights = (one["row"], column) == (None, "weights")
            return ("no trial run yet" if no_weights else one["text"]), ""
        key, row = place
        there = f"{quote(one['value'])} stands here; expected" if one["value"] else "still missing:"
        text = f"{content(column or 'reading')} of {row.partition('|')[0]}: {there} {one['expected']}"
        first = self.column("amplitude", key) or self.column("plane", key)
        return text, f"{key}|{row}|{column or first}"


def _each(values: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(filter(None, values)))


def setup(view: View, fields: Fields) -> list[Edit]:
    """Rows for sensors and speeds: of a first table, or for each run there is."""
    speeds, sensors = (_each(re.split(r"\s*[,;]\s*", fields[name].strip())) for name in ("speeds", "sensors"))
    names, made = view.names.get("runs"), list[Edit]()
    if names is None:
        header = ["run", fields["speed_unit"], "sensor", fields["amplitude_unit"]]
        header += [] if "no_phase" in fields else ["phase_deg"]
        names = {content(name): name for name in header}
        made.append({"create": "runs", "header": header})
    places = [(speed, sensor) for speed in speeds for sensor in sensors]
    return made + _readings("runs", names, view.runs or ["baseline"], places)


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
    header = ["run", "plane", view.column("weight", "weights"), "angle_deg"]
    if any(row["action"] == "remove" for row in answer["to_mount"]):
        header.append("action")  # without it all would be added
    made: list[Edit] = [{"create": "check", "header": view.job.tables["runs"].header}]
    made += [*_as_baseline(view, "check", "check"), {"create": "check_weights", "header": header}]
    for k, row in enumerate(answer["to_mount"]):
        cells = ("check", row["plane"], row["mass"], row["at"], row["action"])
        if f"{k}" in fields:
            made.append({"table": "check_weights", "cells": dict(zip(header, cells, strict=False))})
    return made


def _as_baseline(view: View, key: str, run: str) -> list[Edit]:
    rows = [row for row in view.of_run("runs", view.baseline) if row["place"] == row["speed"]]
    return _readings(key, view.names["runs"], [run], [(row["speed"], row["sensor"]) for row in rows])


def _readings(key: str, names: Row, runs: list[str], places: Sequence[tuple[str, str]]) -> list[Edit]:
    """New rows, without their readings."""
    columns = [names[what] for what in ("run", "speed", "sensor")]
    rows = [dict(zip(columns, (run, *place), strict=True)) for run in runs for place in places]
    return [{"table": key, "cells": cells} for cells in rows]


ACTIONS: Mapping[str, Callable[[View, Fields], list[Edit]]] = {
    one.__name__: one for one in (setup, new_run, check_run)
}
"""What the forms of the page do."""
