"""JSON schemas of job and rotor files: sample files keep to them, and what the reader refuses they refuse."""

from __future__ import annotations

import json
import tomllib

import pytest
from cases import each_of
from jsonschema import Draft202012Validator

from rotorid.files.job_models import JobSettings, Plane
from rotorid.files.schema import FILES, schema
from rotorid.samples import sample_data

FILES_OF = {
    kind: sorted(p for p in sample_data().glob("*/*.toml") if key in tomllib.loads(p.read_text("utf-8")))
    for kind, key in (("job", "runs"), ("rotor", "shaft"), ("small", "masses_kg"))
}


def keeps_to(text, kind):
    """Whether a file of this text keeps to its schema, for a validator as editors have it."""
    return Draft202012Validator(schema(kind)).is_valid(tomllib.loads(text))


@each_of("kind", FILES)
def test_each_is_a_schema(kind):
    Draft202012Validator.check_schema(json.loads(json.dumps(schema(kind))))


@each_of("kind", FILES_OF)
def test_every_sample_keeps_to_it(kind):
    assert FILES_OF[kind]
    for path in FILES_OF[kind]:
        assert keeps_to(path.read_text("utf-8"), kind), path


ROTOR = 'shaft = "shaft.csv"\n'


@each_of(
    "text",
    [
        "",
        ROTOR + "shafty = 2",
        ROTOR + "[material]\npoisson_ratio = 0.6",
        ROTOR + "[[disc]]\nnode = 2\nmass_kg = -1",
        ROTOR + "[[bearing]]\nnode = 1\nkind = 'seel'",
        ROTOR + "[[seal]]\nnode = 1\nkind = 'bearing'",
    ],
)
def test_what_no_rotor_file_may_say_does_not_keep_to_it(text):
    assert not keeps_to(text, "rotor")


def test_it_is_json_with_every_key_in_every_unit():
    found = json.loads(json.dumps(schema("job")))
    assert found["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    every = [name for key in JobSettings.known_keys().values() for name in key.variants]
    assert set(found["properties"]) == {"schema_version", *every}
    planes = found["$defs"]["Plane"]
    assert set(planes["properties"]) == {name for key in Plane.known_keys().values() for name in key.variants}
    assert {"max_mass_lb", "max_unbalance_oz_in", "radius_in", "step_kg_m"} <= set(planes["properties"])
    assert planes["additionalProperties"] is False
    assert all(rule["description"] for rule in planes["properties"].values())


@each_of(
    "text",
    [
        'phase = "lagg"',
        "speed_tolerance_percent = 21",
        "rotr = 'rotor.csv'",
        "[errors]\nphase = 2",
        "[slow_roll.A]\namplitude_um = 2",
        "[planes.1]\nmax_mass_stone = 2",
        "[planes.1]\nholes = 2.5",
        "[planes.1]\nforbidden_deg = [1, 2, 3]",
        "[planes.1]\ntaken = {}",
        '[planes.1]\nuse = "no"',
        "[sensors.A]\nlimit = 0",
    ],
)
def test_what_the_reader_refuses_does_not_keep_to_it(text):
    assert not keeps_to(text, "job")


def test_of_another_kind_there_is_none():
    with pytest.raises(ValueError, match=r"schema 'jop' is not known \(did you mean 'job'\?\)"):
        schema("jop")
    assert "job" in FILES
