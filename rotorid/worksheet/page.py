"""The page as HTML: the job as its files hold it, and what is computed of it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from typing import Any

from jinja2 import Environment, PackageLoader

from rotorid.base.text import figures, vibration_unit_words, weight_unit_words
from rotorid.files.problems import quote
from rotorid.worksheet.calculation import Results
from rotorid.worksheet.job_files import JobFiles
from rotorid.worksheet.job_text import Table, content, text_of

_PAGES = Environment(
    loader=PackageLoader("rotorid.worksheet", "page"), autoescape=True, trim_blocks=True, lstrip_blocks=True
)
_PAGES.filters["figures"] = figures
Row = dict[str, str]
"""Cells of a table by what they hold, and of the row its `id`, where it is `at`, and its `place`."""


def page(files: JobFiles, results: Results, notice: str, busy: str) -> str:
    """The page as it is now."""
    view = View(files, results)
    return _PAGES.get_template("body.html").render(results, view=view, notice=notice, busy=busy)


class View:
    """What the page shows of a job, part by part."""

    def __init__(self, files: JobFiles, results: Results) -> None:
        self.path, self.job, tables = files.job, files.now, files.now.tables
        self.names = {key: table.columns() for key, table in tables.items()}
        self.rows = {key: [*_rows(key, table)] for key, table in tables.items()}
        self.sensors = self.values("sensor", "runs", "check")
        groups = self._stated("groups")
        inside = [plane for name in groups for plane in self._stated("groups", name, "planes")]
        weighed = [name for name in self.values("plane", "weights") if name not in groups]
        self.planes, self.groups = _each([*self._stated("planes"), *inside, *weighed]), [*groups]
        self.runs, others = self.values("run", "runs", "weights"), self.values("run", "weights")
        self.baseline = next((run for run in self.runs if run not in others), "baseline")
        self.trials = [run for run in self.runs if run != self.baseline]
        self.problems = defaultdict[str, list[str]](list)
        ids = {row["at"]: row["id"] for rows in self.rows.values() for row in rows}
        for one in results.get("problems", ()):
            text, cell = self._problem(one, ids.get(f"{files.job.parent / one['file']} {one['row']}"))
            self.problems[text].append(cell)

    def values(self, what: str, *keys: str) -> list[str]:
        """What stands in columns of tables, each once."""
        return _each(row.get(what, "") for key in keys for row in self.rows.get(key, ()))

    def of_run(self, key: str, run: str) -> list[Row]:
        """Rows of a run in a table."""
        return [row for row in self.rows.get(key, ()) if row["run"] == run]

    def places(self, key: str, run: str) -> dict[str, dict[str, Row]]:
        """Readings of a run by place and sensor."""
        places = defaultdict[str, dict[str, Row]](dict)
        for row in self.of_run(key, run):
            places[row["place"]][row["sensor"]] = row
        return places

    def unit(self, what: str, key: str = "runs") -> str:
        """The unit of a column, as people write it."""
        unit = self.column(what, key).partition("_")[2]
        if what == "weight":
            return weight_unit_words(unit)
        return vibration_unit_words(unit).replace("rad_s", "rad/s")

    def column(self, what: str, key: str = "runs") -> str:
        """The name of a column in the file."""
        return self.names.get(key, {}).get(what, {"weight": "mass_g"}.get(what, ""))

    def setting(self, top: str, name: str, usual: str) -> tuple[str, str]:
        """The id and the text of a setting; one that is stated in another unit has the key of that."""
        path = [top, name] if name else [top]
        stated = self._stated(*path)
        key = next((one for one in stated if name and content(one) == content(usual)), usual)
        return "|".join([*path, key]), text_of(stated.get(key))

    def wrong(self, cell: str) -> str:
        """What is wrong with a cell."""
        return "; ".join(text for text, cells in self.problems.items() if cell in cells)

    def _stated(self, *path: str) -> Mapping[str, Any]:
        """Settings of a table of the job, none where there is no table."""
        its = self.job.setting(path)
        return its if isinstance(its, dict) else {}

    def _problem(self, one: Mapping[str, Any], row: str | None) -> tuple[str, str]:
        """A problem of a file in words, and the cell of the page, "" for none."""
        column = one["column"]
        if row is None:
            no_weights = (one["row"], column) == (None, "weights")
            return ("no trial run yet" if no_weights else one["text"]), ""
        key, run, *_ = row.split("|")
        there = f"{quote(one['value'])} stands here; expected" if one["value"] else "still missing:"
        first = self.column("amplitude", key) or self.column("plane", key)
        text = f"{content(column or 'reading')} of {run}: {there} {one['expected']}"
        return text, f"{row}|{column or first}"


def _rows(key: str, table: Table) -> Iterable[Row]:
    """Rows of a table; at a speed that comes again the place says how many times."""
    for line in table.rows():
        row = {what: line.cells[name] for what, name in table.columns().items()}
        time = line.id.rpartition("|")[2]
        place = row.get("speed", "") + f" ({time})" * (time != "1")
        at = {"id": f"{key}|{line.id}", "at": f"{table.path} {line.number}", "place": place}
        yield {"run": "", "sensor": "", **row, **at}


def _each(values: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(filter(None, values)))
