"""Jobs that say what can be mounted where: holes, weights, removal, trial radius; files and workbooks."""

from __future__ import annotations

import numpy as np
import pytest
from tables_data import RUNS, WEIGHTS, complaints, the_only, write_csv

from balancing import correct, estimate_influence
from rotorid.commands.option_quantities import limited
from rotorid.files import read_job

HEAD = 'runs = "runs.csv"\nweights = "weights.csv"\n'
AGAINST = 'angles = "against rotation"\n'
UNBALANCES = [["run", "plane", "unbalance_g_mm", "angle_deg"], *WEIGHTS[1:]]
EQUAL = "holes = 8\nfirst_hole_deg = 10\navailable_g = [5, 2.5]\n"


@pytest.fixture
def folder(tmp_path):
    write_csv(tmp_path / "runs.csv", RUNS)
    write_csv(tmp_path / "weights.csv", WEIGHTS)
    return tmp_path


@pytest.fixture
def job(folder):
    def read(lines="", head=HEAD, plane="1"):
        (folder / "job.toml").write_text(f"{head}[planes.{plane}]\n{lines}\n", encoding="utf-8")
        return read_job(folder / "job.toml")

    return read


def test_equal_holes_with_pieces(job):
    read = job(EQUAL + 'per_hole = 2\nstock = [3, 8]\ntaken = { "3" = 10, "7" = 0.5 }\nmax_mass_g = 60')
    assert tuple(read.holes) == ("1",)
    holes = read.holes["1"]
    np.testing.assert_allclose(holes.angles, np.deg2rad(np.arange(8) * 45 + 10), rtol=1e-14)
    np.testing.assert_allclose(holes.pieces, [5e-3, 2.5e-3], rtol=1e-14)
    np.testing.assert_allclose(holes.taken, [0, 0, 0.01, 0, 0, 0, 5e-4, 0], rtol=1e-14)
    assert (holes.per_hole, holes.step, holes.max_weight) == (2, 0.0, 0.06)
    assert holes.stock.tolist() == [3, 8]
    assert holes.names == tuple("12345678")
    assert (read.planes["1"].remove, read.planes["1"].trial_radius, read.slow_roll) == (False, None, None)


def test_listed_holes_with_a_step(job):
    holes = job("holes_deg = [-90, 0, 45, 180]\nstep_g = 0.5").holes["1"]
    np.testing.assert_allclose(np.rad2deg(holes.angles), [270, 0, 45, 180], rtol=1e-14)
    assert (len(holes.pieces), holes.step, holes.stock) == (0, 5e-4, None)
    assert job("holes = 3").holes["1"].step == 0.0


def test_names_of_holes(job):
    lines = 'holes_deg = [0, 90]\nhole_names = ["A", "B"]\ntaken = { B = 1 }'
    holes = job(lines).holes["1"]
    assert holes.names == ("A", "B")
    assert holes.taken.tolist() == [0.0, 1e-3]


def test_holes_count_in_the_direction_of_the_jobs_angles(job):
    with_it, against = job(EQUAL).holes["1"], job(EQUAL, HEAD + AGAINST).holes["1"]
    np.testing.assert_allclose(np.exp(1j * against.angles), np.exp(-1j * with_it.angles), rtol=1e-12)
    seen = job(EQUAL, HEAD + 'angles = "clockwise"\nrotation = "counter-clockwise"\n').holes["1"]
    np.testing.assert_array_equal(seen.angles, against.angles)


@pytest.mark.parametrize("direction", ["", AGAINST])
def test_removal_turns_holes_and_forbidden_arcs_by_half_a_turn(job, direction):
    lines = EQUAL + "forbidden_deg = [50, 60]"
    added, removed = job(lines, HEAD + direction), job(lines + "\nremove = true", HEAD + direction)
    assert removed.planes["1"].remove
    assert added.holes["1"].names == removed.holes["1"].names == ("1", *"345678")
    turned = np.exp(1j * removed.holes["1"].angles)
    np.testing.assert_allclose(turned, -np.exp(1j * added.holes["1"].angles), atol=1e-14)
    (start, width), (opposite, same) = (read.limits.forbidden[0][0] for read in (added, removed))
    assert abs(np.exp(1j * start) + np.exp(1j * opposite)) < 1e-14
    assert width == pytest.approx(same, rel=1e-14)


def test_holes_in_forbidden_arcs_are_left_out_unless_they_are_taken(job):
    lines = 'holes = 4\nforbidden_deg = [80, 200]\ntaken = { "3" = 1 }'
    assert job(lines).holes["1"].names == ("1", "3", "4")
    assert job("holes = 4\nforbidden_deg = [90, 180]").holes["1"].names == tuple("1234")  # ends are allowed
    found = complaints(job, "holes_deg = [90]\nforbidden_deg = [80, 200]")
    the_only(found, "job.toml", None, "planes.1.holes_deg", "[90]", "holes outside forbidden_deg in which")


@pytest.mark.parametrize(
    ("key", "expected"),
    [
        ("available_kg", 5.0),
        ("available_mg", 5e-6),
        ("available_oz", 5 * 0.45359237 / 16),
        ("available_lb", 5 * 0.45359237),
    ],
)
def test_units_of_available_weights(job, key, expected):
    assert job(f"holes = 4\n{key} = 5").holes["1"].pieces[0] == pytest.approx(expected, rel=1e-14)


def test_unbalances_and_masses_convert_by_the_radius(job, folder):
    lines = "holes = 4\navailable_g_mm = [300]\nradius_mm = 150"
    assert job(lines).holes["1"].pieces[0] == pytest.approx(2e-3, rel=1e-14)
    lines = "holes = 4\nstep_g_mm = 300\nradius_mm = 150"
    assert job(lines).holes["1"].step == pytest.approx(2e-3, rel=1e-14)
    found = complaints(job, "holes = 4\navailable_g_mm = [300]")
    words = "masses, as the weights of the job are, or radius_mm too"
    the_only(found, "job.toml", None, "planes.1.available_g_mm", "[300]", words)
    write_csv(folder / "weights.csv", UNBALANCES)
    lines = "holes = 4\navailable_g = [2]\nradius_mm = 150"
    assert job(lines).holes["1"].pieces[0] == pytest.approx(300e-6, rel=1e-14)
    found = complaints(job, "holes = 4\nstep_g = 2")
    the_only(found, "job.toml", None, "planes.1.step_g", "2", "unbalances (mass × radius), as")


def test_trial_weights_at_another_radius(job, folder):
    """A mass at 200 mm does what 4/3 of it do at 150 mm."""
    plain = job("radius_mm = 150")
    read = job("radius_mm = 150\ntrial_radius_mm = 200")
    assert read.planes["1"].trial_radius == pytest.approx(0.2)
    expected = plain.trials.weights * [4 / 3, 1]
    np.testing.assert_allclose(read.trials.weights, expected, rtol=1e-14)
    ours, theirs = (correct(estimate_influence(each.trials)).weights for each in (read, plain))
    np.testing.assert_allclose(ours, theirs * [4 / 3, 1], rtol=1e-9)
    found = complaints(job, "trial_radius_mm = 200")
    the_only(
        found, "job.toml", None, "planes.1.trial_radius_mm", "200", "the correction radius too, radius_mm"
    )
    write_csv(folder / "weights.csv", UNBALANCES)
    np.testing.assert_array_equal(
        job("radius_mm = 150\ntrial_radius_mm = 200").trials.weights, job().trials.weights
    )


def test_a_largest_weight_of_the_command_line_holds_for_the_holes(job):
    read = job(EQUAL + "max_mass_g = 6")
    assert read.holes["1"].max_weight == 6e-3
    assert limited(read, "8g", []).holes["1"].max_weight == 8e-3
    assert limited(read, None, ["2"]).holes["1"].max_weight == 6e-3
    with pytest.raises(ValueError, match=r"--max-mass '0g'"):
        limited(read, "0g", [])


BAD = [
    ("holes = 4\nholes_deg = [0, 90]", "holes", "4", "either holes, equally spaced, or holes_deg"),
    ("holes = 0", "holes", "0", "a number of 1 or more: a number of equally spaced holes, up to 1,000"),
    ("holes = 2.5", "holes", "2.5", "a whole number: a number of equally spaced holes, up to 1,000"),
    ("holes = 4\nfirst_hole_deg = 400", "first_hole_deg", "400", "a number up to 360"),
    ("holes_deg = [0]\nfirst_hole_deg = 5", "first_hole_deg", "5", "equally spaced holes too, holes = 12"),
    ("holes_deg = [0, 45, 45]", "holes_deg", "[0, 45, 45]", "holes 2 and 3 stand at the same angle"),
    ("holes_deg = [0, 90, 360]", "holes_deg", "[0, 90, 360]", "holes 1 and 3 stand"),
    ('holes = 2\nhole_names = ["A"]', "hole_names", "['A']", "a different name for each of the 2 holes"),
    (
        'holes = 2\nhole_names = ["A", "A"]',
        "hole_names",
        "['A', 'A']",
        "a different name for each of the 2 holes",
    ),
    ("available_g = [5]", "available_g", "[5]", "the holes of the plane too, holes = 12"),
    ("per_hole = 2", "per_hole", "2", "the holes of the plane too"),
    (
        "holes = 4\navailable_g = [5, 0]",
        "available_g",
        "0",
        "a number above 0: weights, in any unit, of which",
    ),
    ("holes = 4\navailable_g = [5, 5]", "holes", "4", "a piece is listed twice"),
    ("holes = 4\navailable_g = 5\nstep_g = 1", "holes", "4", "either pieces or a smallest step"),
    ("holes = 4\nstep_g = 0", "step_g", "0", "a number above 0"),
    ("holes = 4\navailable_g = 5\nper_hole = 0", "per_hole", "0", "a number of 1 or more"),
    ("holes = 4\nper_hole = 2", "per_hole", "2", "the weights that are available too"),
    ('holes = 4\ntaken = { "5" = 1 }', "taken", None, "holes of the plane, 1 … 4, not '5'"),
    ('holes = 4\ntaken = { "3" = 0 }', "taken.3", "0", "a number above 0"),
    ('holes = 1\ntaken = { "1" = 1 }', "holes", "1", "something is mounted in every hole"),
    ("holes = 4\navailable_g = 5\nstock = [1, 2]", "holes", "4", "one for each of the 1 pieces"),
    ("holes = 4\navailable_g = 5\nstock = 1.5", "stock", "1.5", "a whole number: how many"),
    ("holes = 4\navailable_g = 5\nstock = 0", "holes", "4", "the stock is empty"),
    ("holes = 4\nstock = 3", "holes", "4", "one for each of the 0 pieces"),
    ("radius_mm = 9\ntrial_radius_mm = 0", "trial_radius_mm", "0", "a number above 0"),
]


@pytest.mark.parametrize(("lines", "key", "value", "words"), BAD)
def test_bad_holes(job, lines, key, value, words):
    the_only(complaints(job, lines), "job.toml", None, f"planes.1.{key}", value, words)
