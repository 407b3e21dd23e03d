"""Settings as models: what `read_settings` makes of a table and says of it, and its schema."""

from __future__ import annotations

from typing import Annotated, Literal

import pytest
from cases import each_of
from jsonschema import Draft202012Validator
from pydantic import Field

from rotorid.files import InputError, read_harmonic_model, read_job, units
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


def test_nothing_gives_the_defaults():
    found, problems = read()
    assert problems == []
    assert (found.kind, found.use, found.planes, found.radius) == ("one", True, {}, None)
    assert not found.has("kind")


def test_values_of_all_kinds():
    found, problems = read(
        kind="two",
        use="no",
        holes="4",
        taken="3: 10; 5: 20",
        day="2026-03-17",
        model={"size": 1},
        planes={"left": {"size": "2,5", "name": 7}},
        disc=[{"size": 3}, {"size": 4}],
    )
    assert problems == []
    assert (found.kind, found.use, found.holes, found.day.month) == ("two", False, 4, 3)
    assert found.taken == {"3": 10.0, "5": 20.0}
    assert (found.model.size, found.model.name) == (1.0, "none")
    assert (found.planes["left"].size, found.planes["left"].name) == (2.5, "7")
    assert [disc.size for disc in found.disc] == [3.0, 4.0]


@each_of("text", ["0; 90,5", [0, 90.5]])
def test_a_list_as_a_list_and_as_a_sheet_has_it(text):
    assert read(angles_deg=text)[0].angles == (0.0, 90.5)
    assert read(angles_deg=3)[0].angles == (3.0,)


@each_of("name", ["most_g", "most_kg", "most_oz_in"])
def test_a_key_in_every_unit(name):
    unit = WEIGHT[name.removeprefix("most_")]
    found, problems = read(**{name: 3})
    assert problems == []
    assert found.most == units.Quantity(name, 3.0, unit)
    assert found.most.si == unit.to_si(3.0)
    assert found.written("most") == name


def test_a_field_with_a_unit_is_in_si():
    assert read(radius_in=2)[0].radius == 2 * 0.0254
    assert read(amplitude_um_pp=3)[0].amplitude.unit == units.VIBRATION["um_pp"]


@pytest.mark.parametrize(
    ("data", "column", "value", "expected"),
    [
        ({"most_g": 0}, "most_g", "0", "a number above 0"),
        ({"most_kg": 1, "most_g_mm": 2}, "most_g_mm", "2", "one key of them; most_kg says it already"),
        ({"amplitude_MM": 3}, "amplitude_MM", "3", "a known key (did you mean 'amplitude_um'?)"),
        ({"radius_mm": True}, "radius_mm", "true", "a number"),
        ({"radius_mm": "1,350"}, "radius_mm", "1,350", "a number; the cell holds text, whose comma may"),
        ({"radius_mm": 10**40}, "radius_mm", str(10**40), "a finite number, up to"),
        ({"turn": 400}, "turn", "400", "a number up to 360"),
        ({"kind": "on"}, "kind", "on", "'one' or 'two' (did you mean 'one'?)"),
        ({"use": 3}, "use", "3", "true or false, without quotes (in a sheet: yes or no)"),
        ({"holes": 2.5}, "holes", "2.5", "a whole number: a number of holes"),
        ({"angles_deg": []}, "angles_deg", "[]", "a list with at least 1: angles, such as"),
        ({"angles_deg": [1, "b"]}, "angles_deg", "b", "a number: angles, such as [0, 90]"),
        ({"taken": "3: 1; 3: 2"}, "taken", "3: 1; 3: 2", "each name once"),
        ({"taken": {"3": 0}}, "taken.3", "0", "a number above 0"),
        ({"day": "tomorrow"}, "day", "tomorrow", "a date, such as 2026-03-17"),
        ({"day": "2026-03-17 or so"}, "day", "2026-03-17 or so", "a date, such as 2026-03-17"),
        ({"file": " "}, "file", " ", "a text in quotes"),
        ({"model": {}}, "model.size", None, "the size"),
        ({"model": 3}, "model", "3", "a table of settings, [model]"),
        ({"disc": {}}, "disc", "a table", "a list, or tables that begin with [[disc]]"),
        ({"planes": {"left": {"size": 11}}}, "planes.left.size", "11", "a number up to 10"),
        (
            {"disc": [{"size": 1}, {"size": 1, "sze": 1}]},
            "disc[2].sze",
            "1",
            "a known key (did you mean 'size'?)",
        ),
        (
            {"most_kg": 1, "hole": 2},
            "hole",
            "2",
            "a known key (did you mean 'holes'?); known are most_g, most_g",
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


def test_the_schema_has_every_key_in_every_unit_and_refuses_what_the_reader_refuses():
    schema = settings_schema(Top, "Top")
    Draft202012Validator.check_schema(schema)
    validator = Draft202012Validator(schema)
    assert {"most_lb", "most_oz_in", "radius_in", "schema_version"} <= set(schema["properties"])
    for good in ({"most_lb": 1, "angles_deg": "0; 90"}, {"amplitude_mil": 2}, {"model": {"size": 1}}):
        assert validator.is_valid(good), good
    for bad in (
        {"most_stone": 1},
        {"most_g": 0},
        {"model": {}},
        {"kind": "on"},
        {"use": "no"},
        {"taken": {}},
    ):
        assert not validator.is_valid(bad), bad


@pytest.mark.parametrize("arcs", ["[[20]]", "[20]", "[[20, 60], [300]]", "[[]]"])
def test_a_pair_that_is_too_short_is_a_problem_of_its_key(tmp_path, arcs):
    path = tmp_path / "job.toml"
    text = f'runs = "r.csv"\nweights = "w.csv"\n[planes.P1]\nforbidden_deg = {arcs}\n'
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"key planes\.P1\.forbidden_deg: found .* pairs \[from, to\]"):
        read_job(path)


def test_a_bare_limit_in_mm_s_beside_rms_readings_is_asked_about(tmp_path):
    lines = ["run,speed_rpm,sensor,amplitude_mm_s_rms,phase_deg", "base,1500,A,3,20", "trial,1500,A,2,80"]
    (tmp_path / "r.csv").write_text("\n".join(lines), encoding="utf-8")
    (tmp_path / "w.csv").write_text("run,plane,mass_g,angle_deg\ntrial,P,5,0\n", encoding="utf-8")
    path = tmp_path / "job.toml"
    for name, limit in (("limit_mm_s_rms", 1.0), ("limit_mm_s_pp", 1 / 8**0.5)):
        path.write_text(f'runs = "r.csv"\nweights = "w.csv"\n[sensors.A]\n{name} = 1\n', encoding="utf-8")
        job = read_job(path)
        assert job.limits.residual * job.trials.labels.vibration_scale == pytest.approx(limit)
    path.write_text('runs = "r.csv"\nweights = "w.csv"\n[sensors.A]\nlimit_mm_s = 1\n', encoding="utf-8")
    with pytest.raises(InputError, match=r"key sensors\.A\.limit_mm_s: found '1', expected limit_mm_s_rms"):
        read_job(path)


def test_true_is_no_bound(tmp_path):
    text = 'equations = ["c*X = F"]\n[estimate]\nc = 1\n[bounds]\nc = [false, true]\n'
    path = tmp_path / "model.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"key bounds\.c: found 'false', expected a number"):
        read_harmonic_model(path)
