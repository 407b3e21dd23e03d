"""`rotorid split`: what it prints and writes, and what it refuses."""

import numpy as np
import pytest

from rotorid.commands.option_units import mass, vectors


@pytest.fixture
def run(cli):
    """Run `rotorid split ARGS`."""
    return lambda *args: cli("split", *args)


def test_against_the_rotation_is_the_same_split_with_the_same_numbers(run):
    holes = ",".join(str(7.5 + 15 * k) for k in range(24))
    args = ("35g@122", "--holes", holes, "--pieces", "10g,20g")
    one, other = (run(*args, "--angles", way, "--json").json for way in ("with rotation", "against rotation"))
    assert one["mounted"]["mass"] == pytest.approx(other["mounted"]["mass"], rel=1e-9)
    assert [r["angle_deg"] for r in one["holes"]] == pytest.approx([r["angle_deg"] for r in other["holes"]])
    assert other["angles"] == "against rotation"


def test_units_mix_over_the_radius(run):
    mass = run(
        "35g@120", "--holes", "12", "--pieces", "1000g_mm,2000g_mm", "--radius", "100mm", "--json"
    ).json
    same = run("35g@120", "--holes", "12", "--pieces", "10g,20g", "--json").json
    assert mass["holes"] == same["holes"]
    unbalance = run(
        "3500g_mm@120", "--holes", "12", "--pieces", "10g,20g", "--radius", "100mm", "--json"
    ).json
    assert unbalance["unit"] == "g_mm"
    assert [r["hole"] for r in unbalance["holes"]] == [r["hole"] for r in same["holes"]]


def test_drilling_takes_away_opposite(run, tmp_path):
    args = ("3g@120", "--drill", "8mm", "--radius", "100mm")
    document = run(*args, "--json").json
    assert document["target"] == {"mass": pytest.approx(3), "angle_deg": pytest.approx(120)}
    assert document["angle_deg"] == pytest.approx(300)
    outcome = run(*args, "--plot", tmp_path / "d.png")
    assert outcome.code == 0, outcome.err
    # what the drill takes, a cylinder and the cone of its tip, 118° wide
    cone, depth = 0.004 / np.tan(np.radians(59)), document["depth_m"]
    assert document["tip_depth_m"] - depth == pytest.approx(cone, rel=1e-9)
    area = 7850 * np.pi * 0.004**2
    assert document["mass_kg"] == pytest.approx(area * (depth + cone / 3), rel=1e-9)
    moment = area * (depth * (0.1 - depth / 2) + cone / 3 * (0.1 - depth - cone / 4))
    assert moment == pytest.approx(0.003 * 0.1, rel=1e-9)


def test_vectors_are_read_exactly():
    labels, (one,) = vectors("1e+1g@90", "against rotation")
    assert one == -0.01j
    assert labels.weight_unit == "g"
    _, several = vectors("2g@0 + 3g@-90°", "with rotation")
    assert several == [0.002, -0.003j]


def test_a_mass_in_pounds_and_ounces():
    for text, pounds in (("1000lbs", 1000), ("1000 lb", 1000), ("5oz", 5 / 16)):
        assert mass(text, "--mass") == pytest.approx(pounds * 0.45359237, rel=1e-14)
