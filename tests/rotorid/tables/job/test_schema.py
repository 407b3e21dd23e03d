"""JSON schemas of job and rotor files: sample files keep to them, and what the reader refuses they refuse."""

from __future__ import annotations

import json
import re
import tomllib

import pytest
from cases import each_of

from rotorid.samples import sample_data
from rotorid.tables.job.job_keys import JOB, PLANE
from rotorid.tables.schema import FILES, schema

FILES_OF = {
    kind: sorted(p for p in sample_data().glob("*/*.toml") if key in tomllib.loads(p.read_text("utf-8")))
    for kind, key in (("job", "runs"), ("rotor", "shaft"))
}
TYPES = {
    "object": dict,
    "array": list,
    "string": str,
    "boolean": bool,
    "integer": int,
    "number": (int, float),
}


def fits(value, rule):
    """Whether a value keeps to a schema, in the words that schemas of this project use."""
    known = {
        "anyOf",
        "type",
        "enum",
        "minimum",
        "maximum",
        "exclusiveMinimum",
        "items",
        "minItems",
        "maxItems",
    }
    known |= {"properties", "patternProperties", "additionalProperties", "required", "minProperties"}
    known |= {"$schema", "title", "description", "default"}
    assert set(rule) <= known
    if "anyOf" in rule:
        return any(fits(value, one) for one in rule["anyOf"])
    if "enum" in rule:
        return value in rule["enum"]
    kinds = [rule["type"]] if isinstance(rule["type"], str) else rule["type"]
    if not any(isinstance(value, TYPES[k]) and (k == "boolean" or value is not True) for k in kinds):
        return False
    if isinstance(value, dict):
        return fits_table(value, rule)
    if isinstance(value, list):
        size = rule.get("minItems", 0) <= len(value) <= rule.get("maxItems", 1000)
        return size and all(fits(one, rule["items"]) for one in value)
    if isinstance(value, (int, float)):
        within = rule.get("minimum", value) <= value <= rule.get("maximum", value)
        return within and value > rule.get("exclusiveMinimum", value - 1)
    return True


def fits_table(value, rule):
    own, more = rule.get("properties", {}), rule.get("additionalProperties")
    if set(rule.get("required", ())) - set(value) or len(value) < rule.get("minProperties", 0):
        return False
    for name, one in value.items():
        patterns = [part for form, part in rule.get("patternProperties", {}).items() if re.match(form, name)]
        found = [own[name]] if name in own else patterns or ([more] if more else [])
        if not found or not all(fits(one, part) for part in found):
            return False
    return True


@each_of("kind", FILES_OF)
def test_every_sample_keeps_to_it(kind):
    assert FILES_OF[kind]
    for path in FILES_OF[kind]:
        assert fits(tomllib.loads(path.read_text("utf-8")), schema(kind)), path


ROTOR = 'shaft = "shaft.csv"\n'


@each_of(
    "text",
    [
        "",
        ROTOR + "shft = 2",
        ROTOR + "[material]\npoisson_ratio = 0.6",
        ROTOR + "[model]\nshear = 1",
        ROTOR + "[[disc]]\nnode = 2\nmass_kg = -1",
        ROTOR + "[[bearing]]\nnode = 0",
        ROTOR + "[[bearing]]\nnode = 1\nkind = 'seel'",
        ROTOR + "[[bearing]]\nnode = 1\npedestal_stiffness_N_per_m = [1, 2, 3]",
        ROTOR + "[[seal]]\nnode = 1\nkind = 'seal'",
        ROTOR + "[[seal]]\nnode = 1\nkxx = '2'",
    ],
)
def test_what_no_rotor_file_may_say_does_not_keep_to_it(text):
    assert not fits(tomllib.loads(text), schema("rotor"))


def test_it_is_json_with_every_key_in_every_unit():
    found = json.loads(json.dumps(schema("job")))
    assert found["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert set(found["properties"]) == {name for key in JOB for name in key.names}
    planes = found["properties"]["planes"]["additionalProperties"]
    assert set(planes["properties"]) == {name for key in PLANE for name in key.variants}
    assert {"max_mass_lb", "max_unbalance_oz_in", "radius_in", "step_kg_m"} <= set(planes["properties"])
    assert planes["additionalProperties"] is False
    assert all(rule["description"] for rule in planes["properties"].values())


@each_of(
    "text",
    [
        'phase = "lagg"',
        "speed_tolerance_percent = 21",
        "rotr = 'rotor.csv'",
        "runs = 3",
        "speed_weights = 3",
        "slow_roll = 3",
        "[errors]\nphase = 2",
        "[key_phasor]",
        "[slow_roll.A]\namplitude_um = 2",
        "[planes.1]\nmax_mass_stone = 2",
        "[planes.1]\nradius_mm = 0",
        "[planes.1]\nholes = 2.5",
        "[planes.1]\nforbidden_deg = [1, 2, 3]",
        "[planes.1]\ntaken = {}",
        '[planes.1]\nuse = "no"',
        "[sensors.A]\nlimit = 0",
        "[sensors.A]\nweight = -1",
    ],
)
def test_what_the_reader_refuses_does_not_keep_to_it(text):
    assert not fits(tomllib.loads(text), schema("job"))


def test_of_another_kind_there_is_none():
    with pytest.raises(ValueError, match=r"schema 'jop' is not known \(did you mean 'job'\?\)"):
        schema("jop")
    assert "job" in FILES
