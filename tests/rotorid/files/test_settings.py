"""Settings: what is said of a wrong key or value, and the schema."""

from __future__ import annotations

import json
import tomllib
from pkgutil import resolve_name

from cases import each_of
from jsonschema import Draft202012Validator
from tables_data import complaints, the_only

from rotorid.cli import SCHEMAS
from rotorid.files.settings import settings_schema
from rotorid.samples import sample_data

SAMPLES = {
    kind: sorted(p for p in sample_data().glob("*/*.toml") if key in tomllib.loads(p.read_text("utf-8")))
    for kind, key in (("job", "runs"), ("rotor", "shaft"), ("small", "masses_kg"))
}
ROTOR = 'shaft = "shaft.csv"\n'
PLANE, TURNS = "[planes.1]\n", "rotation = 'clockwise'\n"


@each_of(
    ("lines", "column", "value", "words"),
    [
        ("[planes.1]\nradius_mm = true", "planes.1.radius_mm", "true", "a number"),
        ("[planes.1]\nholes = 2.5", "planes.1.holes", "2.5", "a whole number"),
        ("[planes.1]\nholes_deg = [1, 'b']", "planes.1.holes_deg", "b", "a number"),
        ("[planes.1]\nmax_mass_g = 0", "planes.1.max_mass_g", "0", "a number above 0"),
        (
            "[planes.1]\nmax_mass_kg = 1\nmax_mass_g = 2",
            "planes.1.max_mass_g",
            "2",
            "max_mass_kg says it already",
        ),
        ("[planes.1]\nuse = 3", "planes.1.use", "3", "true or false"),
        ("[planes.1]\nholes = 2\ntaken = '1: 1; 1: 2'", "planes.1.taken", "1: 1; 1: 2", "each name once"),
        ("[errors]\nphase_deg = nan", "errors.phase_deg", "nan", "a finite number"),
        ("errors = 3", "errors", "3", "a table of settings, [errors]"),
        ("date = '2026-03-17 or so'", "date", "2026-03-17 or so", "a date"),
        ("phase = 'lagg'", "phase", "lagg", "did you mean 'lag'?"),
        ("check = ' '", "check", " ", "a text in quotes"),
        ("colour = 'red'", "colour", "red", "a known key"),
        ("[planes.1]\nforbidden_deg = 20", "planes.1.forbidden_deg", "20", "pairs [from, to]"),
        ("[planes.1]\nforbidden_deg = [0, 360]", "planes.1.forbidden_deg", "[0, 360]", "use = false leaves"),
        ("[planes.1]\nuse = false\n[planes.2]\nuse = false", "planes", None, "without use = false"),
        ("[planes.1]\ntrial_radius_mm = 2", "planes.1.trial_radius_mm", "2", "radius too, radius_mm"),
        ("[sensors.A]\nlimit_mm_s_rms = 4", "sensors.A.limit_mm_s_rms", "4", "that converts to um_pp"),
        ('[sensors.A]\nlimit = { "1500" = 3 }', "sensors.A.limit", None, "not 1500: there are 1000 rpm"),
        ("[sensors.A]\nweight = 0\n[sensors.B]\nweight = 0", "sensors", None, "at least one weight above 0"),
        (
            "[planes.1]\nholes = 4\nholes_deg = [0, 90]",
            "planes.1.holes",
            "4",
            "either holes, equally spaced, or",
        ),
        (
            "[planes.1]\nholes_deg = [0, 9, 9]",
            "planes.1.holes_deg",
            "[0, 9, 9]",
            "holes 2 and 3 stand at the same",
        ),
        (
            "[planes.1]\nholes_deg = [90]\nforbidden_deg = [80, 200]",
            "planes.1.holes_deg",
            "[90]",
            "holes outside",
        ),
        (
            "[planes.1]\navailable_g = [5]",
            "planes.1.available_g",
            "[5]",
            "the holes of the plane too, holes = 12",
        ),
        (
            "[planes.1]\nholes = 4\navailable_g = 5\nstep_g = 1",
            "planes.1.holes",
            "4",
            "either pieces or a small",
        ),
        (
            PLANE + 'holes = 4\ntaken = { "5" = 1 }',
            "planes.1.taken",
            None,
            "holes of the plane, 1 … 4, not '5'",
        ),
        (
            PLANE + 'holes = 1\ntaken = { "1" = 1 }',
            "planes.1.holes",
            "1",
            "something is mounted in every hole",
        ),
        ("angles = 'clockwise'", "rotation", None, "how the rotor turns"),
        ("view = 'free end'", "rotation", None, "how the rotor turns"),
        (f"angles = 'clockwize'\n{TURNS}", "angles", "clockwize", "did you mean 'clockwise'?"),
        ("rotation = 'with'", "rotation", "with", "'clockwise' or 'counter-clockwise'"),
        (f"{TURNS}view = 'left'", "view", "left", "'drive end' or 'free end'"),
        ("key_phasor = { angle_deg = 'x' }", "key_phasor.angle_deg", "x", "a number"),
        ("key_phasor = { angle_deg = 3, speed = 2 }", "key_phasor.speed", "2", "a known key"),
    ],
)
def test_what_is_wrong_has_its_key_its_value_and_what_is_expected(job, lines, column, value, words):
    the_only(complaints(job, lines), "job.toml", None, column, value, words)


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
        ("waveforms", "pulses = 0\nrecords = { a = 'a.csv' }"),
    ],
)
def test_what_the_reader_refuses_does_not_keep_to_its_schema(kind, text):
    schema = schema_of(resolve_name(SCHEMAS[kind][1]))
    assert not Draft202012Validator(schema).is_valid(tomllib.loads(text))
