"""What a job says of its planes and sensors: limits, weights of readings, holes, removal, trial radius."""

from __future__ import annotations

import numpy as np
import pytest
from cases import each_of
from tables_data import RUNS, WEIGHTS, complaints, replaced, the_only, write_csv

from rotorid.commands.option_units import limited

FAST = [[*row[:1], 2000, *row[2:]] for row in RUNS[1:]]
UNBALANCES = [["run", "plane", "unbalance_g_mm", "angle_deg"], *WEIGHTS[1:]]
AGAINST = 'angles = "against rotation"\n'
LIMITS = """speed_weights = { "2000" = 0.5 }
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
EQUAL = "holes = 8\nfirst_hole_deg = 10\navailable_g = [5, 2.5]\n"
UM_PP = 0.5e-6


@pytest.fixture
def two_speeds(folder):
    write_csv(folder / "runs.csv", [*RUNS, *FAST])


@pytest.fixture
def plane(job):
    """Reads the job with these lines of plane 1."""
    return lambda lines="", before="": job(f"{before}[planes.1]\n{lines}")


def test_limits_and_weights_of_readings(job, two_speeds):
    read = job(LIMITS)
    assert tuple(read.planes) == read.trials.planes == ("1", "2")
    assert (read.used, read.radii) == (("1",), {"1": 0.15})
    np.testing.assert_array_equal(read.limits.max_weight, [0.02, np.inf])
    expected = np.array([[4, np.inf], [4, 6]]) * UM_PP
    np.testing.assert_allclose(read.limits.residual, expected, rtol=1e-14)
    np.testing.assert_allclose(read.limits.forbidden[0], np.deg2rad([[20, 40], [350, 20]]), rtol=1e-14)
    assert read.limits.forbidden[1] == ()
    np.testing.assert_array_equal(read.row_weights, [[2, 0], [1, 0]])
    assert read.limits_of(["1"]).max_weight.tolist() == [0.02]
    read = job("[planes.1]\nuse = true\n[sensors.A]\nweight = 1")
    assert (read.limits, read.row_weights, read.used) == (None, None, ("1", "2"))


def test_unbalances_and_masses_convert_by_the_radius(plane, folder):
    holes = plane("holes = 4\navailable_g_mm = [300]\nradius_mm = 150").holes["1"]
    assert holes.pieces[0] == pytest.approx(2e-3, rel=1e-14)
    found = complaints(plane, "holes = 4\navailable_g_mm = [300]")
    words = "masses, as the weights of the job are, or radius_mm too"
    the_only(found, "job.toml", None, "planes.1.available_g_mm", "[300]", words)
    write_csv(folder / "weights.csv", UNBALANCES)
    read = plane("max_mass_g = 20\nradius_mm = 150\nholes = 4\nstep_g = 2")
    assert read.limits.max_weight[0] == pytest.approx(3e-3)
    assert read.holes["1"].step == pytest.approx(300e-6)
    assert plane("max_unbalance_g_mm = 20").limits.max_weight[0] == pytest.approx(2e-5)
    in_inches = plane(f"max_mass_oz = 16\nradius_in = {150 / 25.4!r}").limits.max_weight[0]
    assert in_inches == pytest.approx(0.45359237 * 0.15)
    words = "unbalances (mass × radius), as the weights of the job are, or radius_mm too, to convert"
    found = complaints(plane, "max_mass_g = 20")
    the_only(found, "job.toml", None, "planes.1.max_mass_g", "20", words)


def test_trial_weights_at_another_radius(plane, folder):
    """A mass at 200 mm does what 4/3 of it do at 150 mm."""
    lines = "radius_mm = 150\ntrial_radius_mm = 200"
    plain, read = plane("radius_mm = 150"), plane(lines)
    np.testing.assert_allclose(read.trials.weights, plain.trials.weights * [4 / 3, 1], rtol=1e-14)
    write_csv(folder / "weights.csv", UNBALANCES)
    np.testing.assert_array_equal(plane(lines).trials.weights, plane().trials.weights)


def test_holes_with_pieces_or_a_step(plane):
    lines = 'per_hole = 2\nstock = [3, 8]\ntaken = { "3" = 10, "7" = 0.5 }\nmax_mass_g = 60'
    read = plane(EQUAL + lines)
    holes = read.holes["1"]
    np.testing.assert_allclose(holes.angles, np.deg2rad(np.arange(8) * 45 + 10), rtol=1e-14)
    np.testing.assert_allclose(holes.pieces, [5e-3, 2.5e-3], rtol=1e-14)
    np.testing.assert_allclose(holes.taken, [0, 0, 0.01, 0, 0, 0, 5e-4, 0], rtol=1e-14)
    assert (holes.per_hole, holes.step, read.limits.max_weight[0]) == (2, 0.0, 0.06)
    assert (holes.stock.tolist(), holes.names) == ([3, 8], tuple("12345678"))
    holes = plane('holes_deg = [-90, 0]\nstep_g = 0.5\nhole_names = ["A", "B"]\ntaken = { B = 1 }').holes["1"]
    np.testing.assert_allclose(np.rad2deg(holes.angles), [270, 0], rtol=1e-14)
    assert (len(holes.pieces), holes.step, holes.stock) == (0, 5e-4, None)
    assert (holes.names, holes.taken.tolist()) == (("A", "B"), [0.0, 1e-3])


@each_of("direction", ["", AGAINST])
def test_removal_turns_holes_and_forbidden_arcs_by_half_a_turn(plane, direction):
    """Holes in the arcs are left out, unless they are taken."""
    lines = EQUAL + 'forbidden_deg = [50, 105]\ntaken = { "3" = 1 }'
    added, removed = plane(lines, direction), plane(lines + "\nremove = true", direction)
    assert added.holes["1"].names == removed.holes["1"].names == ("1", *"345678")
    turned = np.exp(1j * removed.holes["1"].angles)
    np.testing.assert_allclose(turned, -np.exp(1j * added.holes["1"].angles), atol=1e-14)
    (start, width), (opposite, same) = (read.limits.forbidden[0][0] for read in (added, removed))
    assert abs(np.exp(1j * start) + np.exp(1j * opposite)) < 1e-14
    assert width == pytest.approx(same, rel=1e-14)
    assert added.trials.labels.arc(start, width) == pytest.approx([50, 105])
    sign = -1 if direction else 1
    np.testing.assert_allclose(added.holes["1"].angles[1] % (2 * np.pi), np.deg2rad(sign * 100) % (2 * np.pi))


def test_a_limit_in_a_unit_of_its_own(job, folder):
    """Alone, mm/s of the readings are rms where a limit is."""
    assert job("[sensors.A]\nlimit_mm_pp = 0.004").limits.residual[0, 0] == pytest.approx(4 * UM_PP)
    write_csv(folder / "runs.csv", [["run", "rpm", "sensor", "mm/s", "phase (deg)"], *RUNS[1:]])
    for line, unit, words in (
        ("limit_mm_s_rms = 2.8", "mm_s_rms", "mm/s rms"),
        ("limit = 2.8", "mm_s", "mm/s peak"),
    ):
        read = job(f"[sensors.A]\n{line}")
        assert read.trials.labels.vibration_unit == unit
        assert read.limits.residual[0, 0] * read.trials.labels.vibration_scale == pytest.approx(2.8)
        assert any(f"is read as {words}" in text for text in read.trials.warnings)
    write_csv(folder / "runs.csv", replaced(RUNS, 1, "amplitude_um_pp", "amplitude_mm_s_rms"))
    found = complaints(job, "[sensors.A]\nlimit_mm_s = 1")
    the_only(found, "job.toml", None, "sensors.A.limit_mm_s", "1", "limit_mm_s_rms, as the readings are")


def test_limits_of_the_command_line(job, two_speeds):
    read = job(LIMITS)
    both = limited(read, "5g", ["B=3"])  # of the job the others stay
    np.testing.assert_allclose(both.limits.max_weight, [0.005, np.inf])  # plane 2 is left out
    np.testing.assert_allclose(both.limits.residual[:, 1], 1.5e-6)
    np.testing.assert_array_equal(both.limits.residual[:, 0], read.limits.residual[:, 0])
    np.testing.assert_allclose(limited(read, "1=3000g_mm", []).limits.max_weight[0], 0.02)
    each = limited(job(), "1=0.01lb,2=3000mg", ["20", "A=10um"])
    np.testing.assert_allclose(each.limits.max_weight, [0.0045359237, 0.003])
    np.testing.assert_allclose(each.limits.residual, [[10e-6, 10e-6], [10e-6, 10e-6]])
    assert limited(job("[planes.1]\nmax_mass_g = 6\n" + EQUAL), "8g", []).limits.max_weight[0] == 8e-3
    for mass, limits, words in (
        ("five", [], "a number, such as 5g"),
        ("3=5g", [], "no plane '3'"),
        ("1=5g,1=3g", [], "1 stands twice"),
        (None, ["A=3mm_s"], "converts to that of the readings"),
    ):
        with pytest.raises(ValueError, match=words):
            limited(job(), mass, limits)
