"""Settings as models: what `read_settings` makes of a table and says of it, and its schema."""

from __future__ import annotations

import json
import tomllib
from pkgutil import resolve_name
from typing import Annotated, Literal

from cases import each_of
from jsonschema import Draft202012Validator
from pydantic import Field

from rotorid.cli import SCHEMAS
from rotorid.files import units
from rotorid.files.problems import Problems
from rotorid.files.settings import (
    Date,
    Label,
    NotNegative,
    Number,
    Positive,
    Settings,
    Text,
    Turn,
    Whole,
    by_name,
    key,
    listed,
    of,
    read_settings,
    settings_schema,
)
from rotorid.samples import sample_data

SAMPLES = {
    kind: sorted(p for p in sample_data().glob("*/*.toml") if key in tomllib.loads(p.read_text("utf-8")))
    for kind, key in (("job", "runs"), ("rotor", "shaft"), ("small", "masses_kg"))
}
ROTOR = 'shaft = "shaft.csv"\n'
WEIGHT = {**units.MASS, **units.UNBALANCE}


class Inner(Settings):
    size: Annotated[NotNegative, Field(le=10)] = key("how large", expected="the size")
    name: Label = key("a label", default="none")


class Top(Settings):
    most: Annotated[units.Quantity, of(Positive)] | None = key(
        "largest", "most_g most_g_mm", None, units=WEIGHT
    )
    radius: Positive | None = key("radius", "radius_mm", None, units=units.LENGTH)
    amplitude: Annotated[units.Quantity, of(NotNegative)] | None = key(
        "", "amplitude amplitude_um", None, units=units.VIBRATION
    )
    kind: Literal["one", "two"] = key("which", default="one")
    use: bool = key("`false`: not used", default=True)
    holes: Annotated[Whole, Field(ge=1, le=9)] | None = key("", default=None, expected="a number of holes")
    angles: listed(Number) | None = key("where", "angles_deg", None, expected="angles, such as [0, 90]")
    turn: Turn = key("", default=0.0)
    taken: by_name(Positive) = key("what is there", default={})
    day: Date | None = key("", default=None)
    file: Text | None = key("", default=None)
    model: Inner | None = key("one table", default=None)
    planes: dict[str, Inner] = key("tables by name", default={})
    disc: list[Inner] = key("many tables", default=[])

    def wrong(self):
        if self.holes is not None and self.angles is not None:
            yield "angles", "either holes or angles_deg"


def read(where=None, **data):
    problems = Problems()
    found = read_settings(Top, data, "job.toml", problems, where)
    return found, [(p.column, p.value, p.expected) for p in problems]


def test_values_of_all_kinds():
    nothing, problems = read()
    assert problems == []
    assert (nothing.kind, nothing.use, nothing.planes, nothing.radius) == ("one", True, {}, None)
    assert not nothing.has("kind")
    found, problems = read(
        kind="two",
        use="no",
        holes="4",
        taken="3: 10; 5: 20",
        day="2026-03-17",
        radius_in=2,
        amplitude_um_pp=3,
        model={"size": 1},
        planes={"left": {"size": "2,5", "name": 7}},
        disc=[{"size": 3}, {"size": 4}],
    )
    assert problems == []
    assert (found.kind, found.use, found.holes, found.day.month) == ("two", False, 4, 3)
    assert found.taken == {"3": 10.0, "5": 20.0}
    assert (found.radius, found.amplitude.unit) == (2 * 0.0254, units.VIBRATION["um_pp"])
    assert (found.model.size, found.model.name) == (1.0, "none")
    assert (found.planes["left"].size, found.planes["left"].name) == (2.5, "7")
    assert [disc.size for disc in found.disc] == [3.0, 4.0]
    assert read(angles_deg=3)[0].angles == (3.0,)
    assert read(angles_deg="0; 90,5")[0].angles == read(angles_deg=[0, 90.5])[0].angles == (0.0, 90.5)


@each_of("name", ["most_g", "most_oz_in"])
def test_a_key_in_every_unit(name):
    unit = WEIGHT[name.removeprefix("most_")]
    found, problems = read(**{name: 3})
    assert problems == []
    assert found.most == units.Quantity(name, 3.0, unit)
    assert (found.most.si, found.written("most")) == (unit.to_si(3.0), name)


@each_of(
    ("data", "column", "value", "expected"),
    [
        ({"most_kg": 1, "most_g_mm": 2}, "most_g_mm", "2", "one key of them; most_kg says it already"),
        ({"amplitude_MM": 3}, "amplitude_MM", "3", "a known key (did you mean 'amplitude_um'?)"),
        ({"radius_mm": 10**40}, "radius_mm", str(10**40), "a finite number, up to"),
        ({"kind": "on"}, "kind", "on", "'one' or 'two' (did you mean 'one'?)"),
        ({"use": 3}, "use", "3", "true or false, without quotes (in a sheet: yes or no)"),
        ({"day": "2026-03-17 or so"}, "day", "2026-03-17 or so", "a date, such as 2026-03-17"),
        ({"model": {}}, "model.size", None, "the size"),
        ({"model": 3}, "model", "3", "a table of settings, [model]"),
        (
            {"disc": [{"size": 1}, {"size": 1, "sze": 1}]},
            "disc[2].sze",
            "1",
            "a known key (did you mean 'size'?)",
        ),
        ({"password": "secret"}, "password", None, "a known key; known are"),
        ({"holes": 2, "angles_deg": [1]}, "angles_deg", "[1]", "either holes or angles_deg"),
    ],
)
def test_what_is_wrong_has_its_key_its_value_and_what_is_expected(data, column, value, expected):
    ((at, shown, words),) = read(**data)[1]
    assert (at, shown) == (column, value)
    assert words.startswith(expected)


def test_all_problems_at_once():
    found, problems = read(kind="on", use=False, holes=-1, model={"sizze": 2, "size": 2}, disc=[{}])
    assert [column for column, _, _ in problems] == ["kind", "holes", "model.sizze", "disc[1].size"]
    assert found is None


def test_a_problem_found_later_stands_where_the_key_is_written():
    where = {"planes.left": ("job.xlsx, sheet planes", 3, "plane")}
    found, _ = read(where, most_oz=3, planes={"left": {"size": 2}})
    problem = found.problem("most", "less")
    assert (problem.file, problem.column, problem.value) == ("job.toml", "most_oz", "3")
    problem = found.planes["left"].problem("size", "less")
    assert (problem.file, problem.row, problem.value) == ("job.xlsx, sheet planes", 3, "2")


def schema_of(model):
    """A schema, for a validator as editors have it."""
    schema = json.loads(json.dumps(settings_schema(model, "")))
    Draft202012Validator.check_schema(schema)
    return schema


@each_of("kind", SCHEMAS)
def test_samples_keep_to_their_schema_which_describes_each_key(kind):
    schema = schema_of(resolve_name(SCHEMAS[kind][1]))
    for path in SAMPLES.get(kind, []):
        assert Draft202012Validator(schema).is_valid(tomllib.loads(path.read_text("utf-8"))), path
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"


@each_of(
    ("kind", "text"),
    [
        ("rotor", ROTOR + "[material]\npoisson_ratio = 0.6"),
        ("rotor", ROTOR + "[[bearing]]\nnode = 1\nkind = 'seel'"),
        ("job", "[slow_roll.A]\namplitude_um = 2"),
        ("job", '[planes.1]\nuse = "no"'),
        ("job", "[sensors.A]\nlimit = 0"),
    ],
)
def test_what_the_reader_refuses_does_not_keep_to_its_schema(kind, text):
    schema = schema_of(resolve_name(SCHEMAS[kind][1]))
    assert not Draft202012Validator(schema).is_valid(tomllib.loads(text))
