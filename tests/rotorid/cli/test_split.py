"""`rotorid split`: what it prints and writes, and what it refuses."""

import numpy as np
import pytest

from rotorid.commands.option_quantities import mass, vectors
from rotorid.commands.split import SplitOptions, split


@pytest.fixture
def run(cli):
    """Run `rotorid split ARGS`."""
    return lambda *args: cli("split", *args)


def vector(rows):
    return sum(r["mass"] * np.exp(1j * np.radians(r["angle_deg"])) for r in rows)


def test_holes_pieces_and_what_is_taken(run, tmp_path):
    args = ("35g@120", "--holes", "24", "--pieces", "10g,20g", "--taken", "9:10g")
    document = run(*args, "--json").json
    assert document["method"] == "holes"
    assert document["unit"] == "g"
    assert "9" not in [row["hole"] for row in document["holes"]]
    for row in document["holes"]:
        assert row["angle_deg"] == pytest.approx(15 * (int(row["hole"]) - 1))
    target = 35 * np.exp(2j * np.pi / 3)
    error = vector(document["holes"]) - target
    assert document["error"]["mass"] == pytest.approx(abs(error), rel=1e-9)
    assert document["relative_error"] == pytest.approx(abs(error) / 35, rel=1e-9)
    outcome = run(*args, "--plot", tmp_path / "d.png")
    assert outcome.code == 0, outcome.err
    assert document["words"] == ["20 g in holes 7 (90°), 11 (150°)"]
    assert (tmp_path / "d.png").read_bytes().startswith(b"\x89PNG")
    options = SplitOptions(holes=24, pieces="10g,20g", taken="9:10g")
    assert list(split("35g@120", options).to_frame()["mass_g"]) == [row["mass"] for row in document["holes"]]


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


def test_two_weights_at_free_angles(run, tmp_path):
    document = run("35g@120", "--two", "20g,30g", "--json").json
    assert document["masses"] == pytest.approx([20, 30], rel=1e-12)
    assert (document["unit"], len(document["solutions"])) == ("g", 2)
    for solution in document["solutions"]:
        a, b = np.exp(1j * np.radians(solution["angles_deg"]))
        assert 20 * a + 30 * b == pytest.approx(35 * np.exp(2j * np.pi / 3), rel=1e-9)
    assert run("35g@120", "--two", "20g,30g", "--plot", tmp_path / "two.svg").code == 0
    table = split("35g@120", SplitOptions(two="20g,30g")).to_frame()
    assert table["solution"].tolist() == [1, 1, 2, 2]
    assert table["mass_g"].to_numpy() == pytest.approx([20, 30, 20, 30], rel=1e-12)
    assert table["angle_deg"].to_numpy() == pytest.approx(
        [angle for solution in document["solutions"] for angle in solution["angles_deg"]]
    )


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
    (row,) = split("3g@120", SplitOptions(drill="8mm", radius="100mm")).to_frame().to_dict("records")
    grams, depth_mm = 1e3 * document["mass_kg"], 1e3 * depth
    assert row == pytest.approx({"angle_deg": 300, "mass_g": grams, "radius_mm": 100, "depth_mm": depth_mm})


@pytest.mark.parametrize(
    ("args", "words"),
    [
        ("35@120 --drill 8mm", "expected one of the units kg, g"),
        ("35g --drill 8mm", "a weight at an angle in degrees"),
        ("35gg@120 --drill 8mm", "expected one of the units kg, g"),
        ("-35g@120 --drill 8mm", "No such option"),
        ("35g@500 --drill 8mm", "no angle from -360 to 360"),
        ("1e999g@1 --drill 8mm", "expected a finite number"),
        ("35g@120", "say how to mount the weight"),
        ("0g@120 --holes 4", "there is nothing to mount"),
        ("35g@120 --holes 4 --two 3g,4g", "in one way: --holes, --two or --drill"),
        ("3g@0+4g_mm@90 --holes 4", "cannot be added"),
        ("35g@120 --two 20g,30g --pieces 3g", "--pieces means something only with --holes"),
        ("35g@120 --holes 0,90,30", "in the order of their angles"),
        ("35g@120 --holes 0,90,90", "list each hole once"),
        ("35g@120 --holes 0,90,360", "within one turn"),
        ("35g@120 --holes 0", "number of equally spaced holes, 1 to 1000"),
        ("35g@120 --holes 4 --pieces 0g", "expected a value above 0"),
        ("35g@120 --holes 4 --pieces 10", "expected one of the units kg, g"),
        ("35g@120 --holes 4 --pieces 10g,10g", "listed twice"),
        ("35g@120 --holes 4 --pieces 10g_mm", "converts only with --radius"),
        ("35g@120 --holes 4 --taken 5:10g", "the number of a hole, 1 to 4"),
        ("35g@120 --holes 4 --taken 1:10g,1:3g", "1 stands twice"),
        ("35g@120 --holes 2 --taken 1:3g,2:3g", "nothing can be mounted"),
        ("35g@120 --drill 8mm --radius 0mm", "expected a value above 0"),
        ("35g@120 --drill 8mm", "--drill needs --radius"),
        ("35g@120 --drill 8 --radius 100mm", "--drill '8': expected one of the units m, mm, um, mil or in"),
        ("35g@120 --drill 8mm --radius 100mm", "use a larger drill, or share the weight (--holes)"),
        ("35g@120 --two 2g", "give two weights"),
    ],
)
def test_bad_input_gives_one_message(run, args, words):
    outcome = run(*args.split())
    assert outcome.code == 2
    assert words in " ".join(outcome.err.split())
    assert "Traceback" not in outcome.err
    assert not outcome.out


def test_wrong_way_of_angles(run):
    outcome = run("35g@120", "--drill", "8mm", "--radius", "1m", "--angles", "sideways")
    assert (outcome.code, "--angles 'sideways' is not known" in outcome.err) == (2, True)


def test_vectors_are_read_exactly():
    labels, (one,) = vectors("1e+1g@90", "against rotation")
    assert one == -0.01j
    assert labels.weight_unit == "g"
    _, several = vectors("2g@0 + 3g@-90°", "with rotation")
    assert several == [0.002, -0.003j]


def test_weights_are_added_and_what_is_mounted_counts(run):
    both = run("3g@0+4g@90", "--two", "3g,4g", "--json").json
    assert both["target"]["mass"] == pytest.approx(5)
    rest = run("3g@0+4g@90+3g@180", "--holes", "4", "--json").json
    assert rest["target"] == {"mass": pytest.approx(4), "angle_deg": pytest.approx(90)}


def test_a_mass_in_pounds_and_ounces():
    for text, pounds in (("1000lbs", 1000), ("1000 lb", 1000), ("5oz", 5 / 16)):
        assert mass(text, "--mass") == pytest.approx(pounds * 0.45359237, rel=1e-14)
