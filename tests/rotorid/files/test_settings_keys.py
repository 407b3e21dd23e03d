"""Keys told once: what `take` reads and says, and the schema and the tables that come from the same tuple."""

from __future__ import annotations

import pytest
from cases import each_of

from rotorid.files import units, value_kinds
from rotorid.files.problems import InputError, Problems
from rotorid.files.settings_keys import Key, Quantity, file_schema, object_schema, take
from rotorid.files.toml_file import Section

WEIGHT = {**units.MASS, **units.UNBALANCE}
INNER = (
    Key("size", value_kinds.number(0.0, 10.0), "how large", required="the size"),
    Key("name", value_kinds.TEXT, "a label", default="none"),
)
KEYS = (
    Key("most_g most_g_mm", value_kinds.ABOVE_ZERO, "largest weight", WEIGHT),
    Key("amplitude", value_kinds.number(0.0), "`amplitude_<unit>` too", units.vibration),
    Key("kind", value_kinds.choice(("one", "two")), "which", default="one"),
    Key("use", value_kinds.FLAG, "`false`: not used", default=True),
    Key("holes", value_kinds.whole("the number of holes", 1, 9), "how many"),
    Key("angles_deg", value_kinds.numbers("angles, such as [0, 90]", "0; 90"), "where"),
    Key("taken", value_kinds.by_name('weights, such as { "3" = 10 }', "3: 10; 5: 20"), "what is there"),
    Key("model", value_kinds.table(INNER), "one table"),
    Key("planes", value_kinds.named(INNER), "tables by name"),
    Key("disc", value_kinds.each(INNER), "many tables"),
)


def said(**data):
    problems = Problems()
    found = take(Section("job.toml", data, problems), KEYS)
    try:
        problems.stop()
    except InputError as error:
        return found, [(p.column, p.value, p.expected) for p in error.problems]
    return found, []


def test_nothing_said_gives_the_defaults():
    found, problems = said()
    assert problems == []
    assert list(found) == [key.names[0] for key in KEYS]
    assert found == dict.fromkeys(found) | {"kind": "one", "use": True}


def test_values_of_all_kinds():
    found, problems = said(
        kind="two",
        use=False,
        holes="4",
        angles_deg="0; 90,5",
        taken="3: 10; 5: 20",
        model={"size": 1},
        planes={"left": {"size": 2, "name": " a "}},
        disc=[{"size": 3}, {"size": 4}],
    )
    assert problems == []
    assert (found["kind"], found["use"], found["holes"]) == ("two", False, 4)
    assert found["angles_deg"] == (0.0, 90.5)
    assert found["taken"] == {"3": 10.0, "5": 20.0}
    assert found["model"] == {"size": 1.0, "name": "none"}
    assert found["planes"] == {"left": {"size": 2.0, "name": "a"}}
    assert [disc["size"] for disc in found["disc"]] == [3.0, 4.0]


@each_of("name", ["most_g", "most_kg", "most_oz_in"])
def test_a_key_in_every_unit(name):
    found, problems = said(**{name: 3})
    assert problems == []
    unit = WEIGHT[name.removeprefix("most_")]
    assert found["most_g"] == Quantity(name, 3.0, unit)
    assert found["most_g"].si == unit.to_si(3.0)


def test_a_reader_of_units_takes_every_unit_that_it_knows():
    assert said(amplitude_um_pp=3)[0]["amplitude"].unit == units.VIBRATION["um_pp"]
    assert said(amplitude=3)[0]["amplitude"].unit.name == ""
    ((column, value, expected),) = said(amplitude_MM=3)[1]
    assert (column, value, expected) == ("amplitude_MM", "3", "the unit written mm, not MM")


@pytest.mark.parametrize(
    ("data", "column", "expected"),
    [
        ({"most_g": 0}, "most_g", "a number above 0"),
        ({"most_kg": 1, "most_g_mm": 2}, "most_g_mm", "one key of them; most_kg says it already"),
        ({"kind": "on"}, "kind", "'one' or 'two' (did you mean 'one'?)"),
        ({"use": "no"}, "use", "true or false, without quotes (in a sheet: yes or no)"),
        ({"holes": 2.5}, "holes", "the number of holes, a whole number from 1 to 9"),
        ({"angles_deg": []}, "angles_deg", "at least one number: angles, such as [0, 90]"),
        ({"angles_deg": [1, "b"]}, "angles_deg", "numbers, not 'b': angles, such as [0, 90]"),
        ({"taken": "3: 1; 3: 2"}, "taken", "each name once"),
        ({"taken": "3"}, "taken", 'weights, such as { "3" = 10 }, in a sheet "3: 10; 5: 20"'),
        ({"taken": {"3": 0}}, "taken", "a number above 0 for '3', not 0: weights, such as { \"3\" = 10 }"),
        ({"model": {}}, "model.size", "the size"),
        ({"planes": {"left": {"size": 11}}}, "planes.left.size", "a number from 0 to 10"),
        ({"disc": [{"size": 1}, {"sze": 1}]}, "disc[2].sze", "a known key (did you mean 'size'?); known are"),
    ],
)
def test_what_is_wrong_is_said_with_its_key(data, column, expected):
    problems = said(**data)[1]
    assert expected in {name: words for name, _, words in problems}[column][: len(expected)]


def test_known_keys_are_named_as_usual_and_each_once():
    ((column, _, expected),) = said(most_kg=1, hole=1)[1]
    names = [name for key in KEYS for name in key.names]
    known = f"{', '.join(names[:-1])} and {names[-1]}"
    assert (column, expected) == ("hole", f"a known key (did you mean 'holes'?); known are {known}")


def test_a_key_that_was_complained_about_is_not_read_again():
    problems = Problems()
    section = Section("job.xlsx", {"holes": "many"}, problems)
    section.complain("holes", "no holes here")
    assert take(section, KEYS)["holes"] is None
    assert len(problems) == 1


def test_schema():
    schema = file_schema(KEYS, "a job")
    assert schema["$schema"].endswith("2020-12/schema")
    assert schema["additionalProperties"] is False
    own = schema["properties"]
    assert {"most_g", "most_lb", "most_g_mm", "most_oz_in"} <= set(own)
    assert own["most_kg"] == {"type": "number", "exclusiveMinimum": 0, "description": "largest weight"}
    assert own["kind"] == {"enum": ["one", "two"], "description": "which", "default": "one"}
    assert own["use"] == {"type": "boolean", "description": "false: not used", "default": True}
    assert own["holes"]["maximum"] == 9
    assert set(schema["patternProperties"]) == {"^amplitude_"}
    inner = object_schema(INNER)
    assert inner["required"] == ["size"]
    assert own["planes"]["additionalProperties"] == inner
    assert own["disc"]["items"] == inner
