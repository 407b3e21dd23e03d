"""Jobs with limits, weights of readings, planes left out: job files, workbooks, command line."""

from __future__ import annotations

import numpy as np
import pytest
from tables_data import RUNS, WEIGHTS, complaints, the_only, write_csv

from rotorid.commands.option_quantities import limited
from rotorid.files import job_from_files, read_job

FAST = [[*row[:1], 2000, *row[2:]] for row in RUNS[1:]]
TWO_SPEEDS = [*RUNS, *FAST]
UNBALANCES = [["run", "plane", "unbalance_g_mm", "angle_deg"], *WEIGHTS[1:]]
HEAD = 'runs = "runs.csv"\nweights = "weights.csv"\n'
JOB = (
    HEAD
    + """
speed_weights = { "2000" = 0.5 }
[planes.1]
max_mass_g = 20
radius_mm = 150
forbidden_deg = [[20, 60], [350, 10]]
[planes.2]
use = false
[sensors.A]
limit = 4
weight = 2
[sensors.B]
limit = { "2000" = 6 }
weight = 0
"""
)


@pytest.fixture
def folder(tmp_path):
    write_csv(tmp_path / "runs.csv", TWO_SPEEDS)
    write_csv(tmp_path / "weights.csv", WEIGHTS)
    return tmp_path


@pytest.fixture
def job(folder):
    def read(text=JOB, **options):
        (folder / "job.toml").write_text(text, encoding="utf-8")
        return read_job(folder / "job.toml", **options)

    return read


def plane(lines, head=HEAD):
    return f"{head}[planes.1]\n{lines}\n"


def sensor(lines):
    return f"{HEAD}[sensors.A]\n{lines}\n"


def test_limits_and_weights_of_a_job_file(job):
    read = job()
    assert tuple(read.planes) == read.trials.planes == ("1", "2")
    assert (read.used, read.radii) == (("1",), {"1": 0.15})
    np.testing.assert_array_equal(read.limits.max_weight, [0.02, np.inf])
    um_pp = 0.5e-6
    np.testing.assert_allclose(
        read.limits.residual, [[4 * um_pp, np.inf], [4 * um_pp, 6 * um_pp]], rtol=1e-14
    )
    expected = np.deg2rad([[20, 40], [350, 20]])
    np.testing.assert_allclose(read.limits.forbidden[0], expected, rtol=1e-14)
    assert read.limits.forbidden[1] == ()
    np.testing.assert_array_equal(read.row_weights, [[2, 0], [1, 0]])
    assert read.limits_of(["1"]).max_weight.tolist() == [0.02]


def test_a_job_without_any(job):
    read = job(HEAD)
    assert (read.limits, read.row_weights, read.check, read.rotor) == (None, None, None, None)
    assert read.limits_of(["1"]) is None
    assert job(sensor("weight = 1")).row_weights is None
    assert job(plane("use = true")).used == ("1", "2")


@pytest.mark.parametrize(
    ("pair", "side", "first", "last"),
    [
        ((20, 60), "with", 20, 60),
        ((350, 10), "with", 350, 370),
        ((-10, 10), "with", 350, 370),
        ((10, -10), "with", 10, 350),
        ((20, 60), "against", 300, 340),
        ((350, 10), "against", 350, 370),
        ((300, 30), "against", 330, 420),
    ],
)
def test_arcs(job, pair, side, first, last):
    read = job(plane(f"forbidden_deg = {list(pair)}", f'angles = "{side} rotation"\n{HEAD}'))
    labels, ((start, width),) = read.trials.labels, read.limits.forbidden[0]
    assert np.degrees(start) == pytest.approx(first)
    assert np.degrees(width) == pytest.approx(last - first)
    assert labels.arc(start, width) == pytest.approx([pair[0] % 360, pair[1] % 360])


@pytest.mark.parametrize(
    ("key", "value", "kg"),
    [
        ("max_mass_kg", 0.02, 0.02),
        ("max_mass_mg", 20, 2e-5),
        ("max_mass_oz", 16, 0.45359237),
        ("max_mass_lb", 1, 0.45359237),
        ("max_unbalance_g_mm", 3000, 0.02),
        ("max_unbalance_kg_m", 0.3, 2.0),
    ],
)
@pytest.mark.parametrize("radius", ["radius_mm = 150", "radius_m = 0.15", f"radius_in = {150 / 25.4!r}"])
def test_units_of_the_largest_weight(job, key, value, kg, radius):
    read = job(plane(f"{key} = {value}\n{radius}"))
    assert read.limits.max_weight[0] == pytest.approx(kg, rel=1e-12)


def test_a_mass_where_the_weights_are_unbalances(job, folder):
    write_csv(folder / "weights.csv", UNBALANCES)
    assert job(plane("max_mass_g = 20\nradius_mm = 150")).limits.max_weight[0] == pytest.approx(3e-3)
    assert job(plane("max_unbalance_g_mm = 20")).limits.max_weight[0] == pytest.approx(2e-5)
    found = complaints(job, plane("max_mass_g = 20"))
    words = "unbalances (mass × radius), as the weights of the job are, or radius_mm too, to convert"
    the_only(found, "job.toml", None, "planes.1.max_mass_g", "20", words)


BAD_PLANES = [
    (
        "max_unbalance_g_mm = 20",
        "max_unbalance_g_mm",
        "20",
        "masses, as the weights of the job are",
    ),
    ("max_mass_g = 0", "max_mass_g", "0", "a number above 0"),
    ("max_mass = 1", "max_mass", "1", "did you mean 'max_mass_g'?"),
    ("forbidden_deg = 20", "forbidden_deg", "20", "pairs [from, to]"),
    ("forbidden_deg = [20, 60, 80]", "forbidden_deg", "[20, 60, 80]", "pairs [from, to]"),
    ("forbidden_deg = [20, 400]", "forbidden_deg", "400", "from -360 to 360 degrees"),
    ("forbidden_deg = [20, true]", "forbidden_deg", "true", "a number: pairs [from, to]"),
    ("forbidden_deg = [20, 20]", "forbidden_deg", "[20, 20]", "of different angles"),
    ("forbidden_deg = [0, 360]", "forbidden_deg", "[0, 360]", "use = false leaves a plane out"),
    ("node = 3", "node", "3", "the rotor model of this node too"),
    ('station = "disc"', "station", "disc", "the rotor model of this station too"),
    ('node = 3\nstation = "disc"', "station", "disc", "either node or station, not both"),
    ("node = 0", "node", "0", "a number of 1 or more"),
    ("station = 4", "station", "4", "the name of a station"),
]


@pytest.mark.parametrize(("lines", "key", "value", "words"), BAD_PLANES)
def test_bad_planes(job, lines, key, value, words):
    the_only(complaints(job, plane(lines)), "job.toml", None, f"planes.1.{key}", value, words)


BAD_SENSORS = [
    ("limit = 0", "limit", "0", "largest amplitude above 0"),
    ('limit = "3 um"', "limit", "3 um", "the unit stands in the name of the key"),
    (
        'limit = { "1500" = 3 }',
        "limit",
        None,
        "speeds of the runs table, each once, not 1500: there are 1000 rpm and 2000",
    ),
    ('limit = { "1000" = 3, "1001" = 4 }', "limit", None, "each once, not 1001: there are"),
    ('limit = { "fast" = 3 }', "limit", None, "speeds of the runs table, each once, not fast"),
    (
        'limit = { "1000" = 0 }',
        "limit.1000",
        "0",
        "a number above 0: largest amplitude above 0, in the unit of the readings",
    ),
    ('limit = "1000: 3; 1000: 4"', "limit", "1000: 3; 1000: 4", "each name once"),
    ("weight = -1", "weight", "-1", "0 or more"),
    ("angle_deg = 400", "angle_deg", "400", "a number up to 360"),
    ("node = 3", "node", "3", 'rotor = "rotor.toml"'),
]


@pytest.mark.parametrize(("lines", "key", "value", "words"), BAD_SENSORS)
def test_bad_sensors(job, lines, key, value, words):
    the_only(complaints(job, sensor(lines)), "job.toml", None, f"sensors.A.{key}", value, words)


@pytest.mark.parametrize(
    ("line", "value", "words"),
    [
        ("speed_weights = 2", "2", "a table of weights by speed"),
        ('speed_weights = { "3000" = 1 }', None, "speeds of the runs table, each once, not 3000"),
        ('speed_weights = { "1000" = 0, "2000" = 0 }', None, "at least one weight above 0"),
    ],
)
def test_bad_weights_of_speeds(job, line, value, words):
    the_only(complaints(job, f"{line}\n{HEAD}"), "job.toml", None, "speed_weights", value, words)


def test_nothing_left(job):
    found = complaints(job, HEAD + "[planes.1]\nuse = false\n[planes.2]\nuse = false\n")
    the_only(found, "job.toml", None, "planes", None, "at least one plane without use = false")
    found = complaints(job, HEAD + "[sensors.A]\nweight = 0\n[sensors.B]\nweight = 0\n")
    the_only(found, "job.toml", None, "sensors", None, "at least one weight above 0")


def test_limits_of_the_command_line(job):
    read = job()
    both = limited(read, "5g", ["B=3"])
    np.testing.assert_allclose(both.limits.max_weight, [0.005, np.inf])  # plane 2 is left out
    np.testing.assert_allclose(both.limits.residual[:, 1], 1.5e-6)
    np.testing.assert_array_equal(both.limits.residual[:, 0], read.limits.residual[:, 0])
    assert both.limits.forbidden == read.limits.forbidden
    one = limited(read, " 2 = 7 ", [])  # the unit of the job
    np.testing.assert_allclose(one.limits.max_weight, [0.02, 0.007])
    plain = job(HEAD)
    assert limited(plain, None, []) is plain
    each = limited(plain, "1=0.01lb,2=3000mg", ["20", "A=10um"])
    np.testing.assert_allclose(each.limits.max_weight, [0.0045359237, 0.003])
    np.testing.assert_allclose(each.limits.residual, [[10e-6, 10e-6], [10e-6, 10e-6]])
    np.testing.assert_allclose(limited(read, "1=3000g_mm", []).limits.max_weight[0], 0.02)
    tables = [p for p in plain.files if p.suffix == ".csv"]
    assert limited(job_from_files(tables), "5", []).limits.max_weight.tolist() == [0.005, 0.005]


@pytest.mark.parametrize(
    ("mass", "limits", "words"),
    [
        ("five", [], "--max-mass 'five': expected a number, such as 5g"),
        ("0g", [], "--max-mass '0g': expected a value above 0"),
        ("5stone", [], "expected a unit of weight"),
        ("3=5g", [], "there is no plane '3'; there are '1' and '2'"),
        ("=5g", [], "use 5g or left=5g,right=3g"),
        ("1=5g,1=3g", [], "--max-mass '1=5g,1=3g': 1 stands twice"),
        ("3000g_mm", [], "the weights of the job are in g, to which g_mm converts only with a radius_mm"),
        (None, ["a=3"], "there is no sensor 'a' (did you mean 'A'?); there are 'A' and 'B'"),
        (None, ["A=3mm_s"], "a unit that converts to that of the readings, um_pp, not mm_s"),
        (None, ["A=0"], "expected a value above 0"),
    ],
)
def test_bad_limits_of_the_command_line(job, mass, limits, words):
    with pytest.raises(ValueError) as caught:
        limited(job(HEAD), mass, limits)
    assert words in str(caught.value)


def test_a_limit_in_a_unit_of_its_own(job):
    um_pp = 0.5e-6
    assert job(sensor("limit_mm_pp = 0.004")).limits.residual[0, 0] == pytest.approx(4 * um_pp)
    found = complaints(job, sensor("limit_mm_s_rms = 4"))
    the_only(
        found,
        "job.toml",
        None,
        "sensors.A.limit_mm_s_rms",
        "4",
        "an amplitude in a unit that converts to um_pp",
    )


@pytest.mark.parametrize(
    ("line", "unit", "said"),
    [("limit_mm_s_rms = 2.8", "mm_s_rms", "mm/s rms"), ("limit = 2.8", "mm_s", "mm/s peak")],
)
def test_mm_s_alone_are_rms_where_a_limit_is(job, folder, line, unit, said):
    write_csv(folder / "runs.csv", [["run", "rpm", "sensor", "mm/s", "phase (deg)"], *RUNS[1:]])
    read = job(sensor(line))
    assert read.trials.labels.vibration_unit == unit
    assert read.limits.residual[0, 0] == pytest.approx(2.8e-3 * (2**0.5 if unit == "mm_s_rms" else 1.0))
    assert any(f"is read as {said}" in text for text in read.trials.warnings)


def test_a_file_of_something_else_has_one_message(job):
    found = complaints(job, 'shaft = "shaft.csv"\n[[bearing]]\nnode = 1\n')
    the_only(found, "job.toml", None, "runs", None, "a job, which names the runs table")


def test_a_forgotten_row_of_weights_is_named(job):
    found = complaints(job, HEAD + "[planes.P2]\nradius_mm = 100\n")
    the_only(found, "job.toml", None, "planes.P2", "P2", "there is no trial weight in plane 'P2'")
