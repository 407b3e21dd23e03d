"""Tables of the balancing sheet, made of its document: every number with its place in it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from rotorid.base.rpm import RPM
from rotorid.base.tables import Column, Table, html
from rotorid.files import units
from rotorid.report.document import Document, fixed, significant

if TYPE_CHECKING:
    from markupsafe import Markup

    from balancing import Labels

_RUNS = 4
"""Whose readings stand side by side."""
_BOX = '<span class="box" aria-label="to tick"></span>'


def sheet_tables(document: Document, labels: Labels) -> dict[str, Markup]:
    """The tables of a sheet by name; nothing where there is none.

    Parameters
    ----------
    document
        What `balance --json` prints, with what `balance_data.sheet_data` gives under "sheet".
    labels
        Units and conventions of the job.
    """
    make = _Maker(document, labels)
    left, mounting = (key in document for key in ("left_to_do", "mounting"))
    tables: dict[str, Sequence[Table]] = {
        "weights": [] if left or mounting else [make.wanted(boxes=True)],
        "wanted": [make.wanted(boxes=False)] if left or mounting else [],
        "trim": [make.trim()] if left else [],
        "holes": make.holes("left_to_do.holes" if left else "mounting.holes") if left or mounting else [],
        "add": [] if left or mounting or not document.found("sheet.add") else [make.add()],
        "check": [make.check()] if "check" in document else [],
        "verdict": [make.verdict()] if "verdict" in document else [],
        "residuals": [make.residuals(blank="check" not in document)],
        "planes": [make.planes()],
        "runs": make.runs(),
    }
    from markupsafe import Markup

    return {
        name: Markup("\n").join(html(table, len(table.rows)) for table in each)
        for name, each in tables.items()
    }


def degrees(value: float) -> str:
    """An angle to 0.1°."""
    return f"{fixed(value, 1, angle=True)}°"


def digits(number: int) -> Callable[[float], str]:
    """Prints so many significant digits."""
    return partial(significant, digits=number)


@dataclass(frozen=True)
class _Maker:
    """Makes the tables of a document."""

    document: Document
    labels: Labels

    def rows(self, path: str) -> Sequence[Mapping[str, Any]]:
        """What the document lists there."""
        rows: Sequence[Mapping[str, Any]] = self.document.found(path)
        return rows

    def numbers(
        self, path: str, headings: Mapping[str, tuple[str, Callable[[float], str]]]
    ) -> Iterable[Column]:
        """Columns of numbers by their keys, each with its heading; those without any number are left out."""
        for key, (heading, shown) in headings.items():
            values = [row.get(key) for row in self.rows(path)]
            if any(value is not None for value in values):
                yield Column(heading, values, shown, f"{path}.*.{key}")

    def words(self, path: str, key: str, heading: str) -> Column:
        """A column of words."""
        return Column(heading, [str(row[key]) for row in self.rows(path)])

    def speed(self, path: str) -> Column:
        """The speeds, in the job's unit."""
        unit = self.labels.speed_unit
        scale = 1.0 if unit == "rpm" else units.SPEED[unit].scale / RPM
        values = [None if row["speed_rpm"] is None else row["speed_rpm"] * scale for row in self.rows(path)]
        return Column(self.labels.speed_in, values, "{:.6g}".format, f"{path}.*.speed_rpm", scale)

    def does(self, path: str) -> Column:
        """Whether to add, or to take away."""
        acts = ["take away" if row.get("action") == "remove" else "add" for row in self.rows(path)]
        return Column("do", acts)

    def wanted(self, *, boxes: bool) -> Table:
        """Weights of the bare rotor."""
        weight, own = self.labels.weight_in, self.rows("sheet.corrections")
        held = [row["plane"] for row in own if row["held_by_a_limit"]]
        unit = own[0]["mass_unit"]
        columns = (
            self.words("corrections", "plane", "plane"),
            self.does("corrections"),
            *self.numbers("corrections", {"mass": (weight, digits(4))}),
            *self.numbers(
                "sheet.corrections",
                {
                    "place_deg": ("angle", degrees),
                    "mass_95": (f"± {weight}, 95 %", digits(3)),
                    "angle_95_deg": ("± °, 95 %", digits(2)),
                    "mass_at_radius": (f"{unit} at radius", digits(4)),
                },
            ),
            *([_boxes(len(own))] if boxes else []),
        )
        return Table("", columns, f"At its limit: {', '.join(held)}." if held else "")

    def trim(self) -> Table:
        """What is mounted, and what is to come on top."""
        weight, path = self.labels.weight_in, "left_to_do.add"
        there = {"mass": (f"mounted, {weight}", digits(4)), "angle_deg": ("at", degrees)}
        rows = self.rows(path)
        at = [row.get("remove_at_deg") or row["angle_deg"] if row["mass"] else None for row in rows]
        columns = (
            self.words("left_to_do.mounted", "plane", "plane"),
            *self.numbers("left_to_do.mounted", there),
            self.does(path),
            *self.numbers(path, {"mass": (f"trim, {weight}", digits(4))}),
            Column("angle", at, degrees),
            _boxes(len(rows)),
        )
        return Table("", columns)

    def holes(self, path: str) -> list[Table]:
        """What goes into each hole."""
        rows = self.rows(path)
        if not rows:
            return []
        numbers = {"angle_deg": ("angle", degrees), "mass": (self.labels.weight_in, digits(4))}
        words = (self.words(path, key, key) for key in ("plane", "hole"))
        pieces = self.words(path, "pieces", "pieces")
        return [Table("", (*words, self.does(path), *self.numbers(path, numbers), pieces, _boxes(len(rows))))]

    def add(self) -> Table:
        """What to do instead where the weights of the last run stay."""
        weight, there, path = self.labels.weight_in, "mounted_in_last_run.weights", "sheet.add"
        mounted = {"mass": (f"mounted, {weight}", digits(4)), "angle_deg": ("at", degrees)}
        numbers = {"mass": (weight, digits(4)), "place_deg": ("angle", degrees)}
        columns = (
            self.words(path, "plane", "plane"),
            *self.numbers(there, mounted),
            self.does(path),
            *self.numbers(path, numbers),
        )
        return Table("", columns)

    def check(self) -> Table:
        """Readings of the check runs beside their prediction."""
        path = "check.readings"
        numbers = {
            "predicted": ("predicted", digits(3)),
            "predicted_phase_deg": ("at", degrees),
            "achieved": ("achieved", digits(3)),
            "achieved_phase_deg": ("at ", degrees),
            "difference": ("difference", digits(3)),
            "distance": ("in its std", digits(2)),
        }
        run = [self.words(path, "run", "run")] if len(self.rows("check.mounted")) > 1 else []
        sensor = self.words(path, "sensor", "sensor")
        return Table("", (*run, self.speed(path), sensor, *self.numbers(path, numbers)))

    def verdict(self) -> Table:
        """Sizes beside their limits."""
        path = "verdict.rows"
        numbers = {
            "size": ("value", digits(3)),
            "low": ("95 % from", digits(3)),
            "high": ("to", digits(3)),
            "limit": ("limit", digits(4)),
        }
        rows = self.rows(path)
        what = [f"{row['kind']} {row['name']}, {row['unit'].replace('_', '·')}" for row in rows]
        what = [name.rstrip(", ") for name in what]
        speed = [self.speed(path)] if any(row["speed_rpm"] is not None for row in rows) else []
        last = self.words(path, "verdict", "verdict")
        return Table("", (Column("what", what), *speed, *self.numbers(path, numbers), last))

    def residuals(self, *, blank: bool) -> Table:
        """Readings before and after, with room for those of a check run."""
        path = "sheet.residuals"
        numbers = {
            "before": ("before", digits(3)),
            "before_phase_deg": ("at", degrees),
            "after": ("predicted", digits(3)),
            "after_phase_deg": ("at ", degrees),
            "within_95": ("95 % within ±", digits(2)),
            "limit": ("limit", digits(4)),
        }
        empty = [""] * len(self.rows(path))
        more = [Column("amplitude read", empty), Column("phase read", empty)] if blank else []
        sensor = self.words(path, "sensor", "sensor")
        return Table("", (self.speed(path), sensor, *self.numbers(path, numbers), *more))

    def planes(self) -> Table:
        """What is known of the planes."""
        path, weight = "sheet.machine.planes", self.labels.weight_in
        numbers = {
            "radius_mm": ("radius, mm", "{:.6g}".format),
            "trial_radius_mm": ("of trial weights", "{:.6g}".format),
            "max_weight": (f"at most, {weight}", digits(4)),
            "holes": ("holes", "{:d}".format),
            "node": ("node of the model", "{:d}".format),
        }
        rows = self.rows(path)
        arcs = [", ".join(f"{low:g}° to {high:g}°" for low, high in row["forbidden_deg"]) for row in rows]
        forbidden = [Column("nothing from", arcs)] if any(arcs) else []
        return Table(
            "",
            (self.words(path, "plane", "plane"), self.does(path), *self.numbers(path, numbers), *forbidden),
        )

    def runs(self) -> list[Table]:
        """Readings of the runs, a few side by side; of repeated readings each."""
        runs = self.rows("sheet.runs")
        first = "sheet.runs.0.readings"
        tables = []
        for k in range(0, len(runs), _RUNS):
            columns = [self.speed(first), self.words(first, "sensor", "sensor")]
            for r in range(k, min(k + _RUNS, len(runs))):
                each = [row["values"] for row in runs[r]["readings"]]
                for again in range(max(map(len, each))):
                    values = [value[again] if again < len(value) else {} for value in each]
                    path = f"sheet.runs.{r}.readings.*.values.{again}"
                    sizes, phases = ([v.get(key) for v in values] for key in ("amplitude", "phase_deg"))
                    name = f"{runs[r]['run']}{' again' * bool(again)}"
                    columns.append(Column(name, sizes, "{:.5g}".format, f"{path}.amplitude"))
                    if any(phase is not None for phase in phases):
                        columns.append(Column("at", phases, degrees, f"{path}.phase_deg"))
            tables.append(Table("", tuple(columns)))
        return tables


def _boxes(count: int) -> Column:
    """A box to tick in each row."""
    from markupsafe import Markup

    return Column("done", ["box"] * count, lambda _: Markup(_BOX))
