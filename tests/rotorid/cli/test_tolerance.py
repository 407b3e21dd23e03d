"""`rotorid tolerance`."""

import pytest
from cases import each_of

from rotorid.samples import sample_data

USUAL = ("tolerance", "--mass", "500kg", "--speed", "3000rpm", "--grade", "G2.5")
SHAFT = ("--planes", "left=100mm,right=600mm", "--bearings", "0mm,700mm", "--centre", "350mm")


def test_the_known_example(cli):
    outcome = cli(*USUAL)
    assert outcome.code == 0
    found = cli(*USUAL, "--json").json
    assert found["permissible_g_mm"] == pytest.approx(3978.87, abs=0.01)
    assert found["specific_um"] == pytest.approx(7.958, abs=0.001)
    assert found["grade"] == "G2.5"
    assert found["planes"] == []
    assert found["bearings"] is None
    assert found["provenance"]["options"]["speed"] == "3000rpm"


def test_units_are_converted(cli):
    pounds = cli("tolerance", "--mass", "1102.3113 lb", "--speed", "50Hz", "--grade", "2,5", "--json").json
    assert pounds["permissible_g_mm"] == pytest.approx(3978.87, abs=0.01)


def test_planes(cli, tmp_path):
    found = cli(*USUAL, *SHAFT, "--json").json
    # symmetric about 350 mm: half at each bearing, 1989.4; planes at 100 and 600 as well
    assert [b["limit_g_mm"] for b in found["bearings"]] == pytest.approx([1989.44, 1989.44], abs=0.01)
    assert [p["plane"] for p in found["planes"]] == ["left", "right"]
    # 6/7 u₁ + 1/7 u₂ = 0.5 and mirrored: 0.5 each
    assert [p["limit_g_mm"] for p in found["planes"]] == pytest.approx([1989.44, 1989.44], abs=0.01)
    half = cli(*USUAL, "--planes", "left,right", "--json").json
    assert half["planes"][1]["limit_g_mm"] == pytest.approx(1989.44, abs=0.01)
    picture = tmp_path / "t.png"
    outcome = cli(*USUAL, *SHAFT, "--plot", picture)
    assert outcome.code == 0
    assert f"written: {picture}" in outcome.out
    assert picture.read_bytes().startswith(b"\x89PNG")


@each_of(
    ("options", "words"),
    [
        ({"--grade": "G3"}, "'G3': the grades are G0.4"),
        ({"--mass": "500"}, "--mass '500': expected one of the units kg, g, mg, oz or lb"),
        ({"--mass": "heavy"}, "--mass 'heavy': expected a number, such as 500kg"),
        ({"--mass": "500N"}, "--mass '500N'"),
        ({"--mass": "0kg"}, "mass of the rotor must be a finite number above 0"),
        ({"--speed": "0rpm"}, "service speed must be a finite number above 0"),
        ({"--speed": "fast"}, "not a range"),
        ({"--planes": "left=1,right=2"}, "--planes left '1': expected one of the units"),
        ({"--planes": "left=,right"}, "--planes left '': expected a number"),
        ({"--planes": "left,left"}, "left stands twice"),
        ({"--planes": "a,b,c"}, "one or two planes, not 3"),
        ({"--planes": "a=0mm,b=100mm"}, "needs the position of the centre of mass"),
        ({"--bearings": "0mm"}, "--bearings '0mm': two positions are needed"),
        ({"--plot": "picture.gif"}, "cannot write this kind of file"),
    ],
)
def test_bad_input_is_one_message(cli, options, words):
    given = {"--mass": "500kg", "--speed": "3000rpm", "--grade": "G2.5", **options}
    outcome = cli("tolerance", *(part for pair in given.items() for part in pair))
    assert outcome.code == 2
    assert words in outcome.err
    assert "Traceback" not in outcome.err
    assert len(outcome.err.strip().splitlines()) == 1
    assert outcome.out == ""


@pytest.mark.parametrize(
    "args",
    [
        ("tolerance", "--mass", "500kg", "--speed", "3000", "--grade", "G2.5"),
        ("trial-weight", "--load", "500kg", "--speed", "3000", "--radius", "200mm"),
        (
            *("balance", sample_data() / "turbo_job" / "job.toml", "--planes", "left,right"),
            *("--grade", "G2.5", "--rotor-mass", "500kg", "--service-speed", "3000"),
        ),
    ],
)
def test_speeds_need_their_unit(cli, args):
    outcome = cli(*args)
    assert outcome.code == 2
    assert "needs its unit" in outcome.err
