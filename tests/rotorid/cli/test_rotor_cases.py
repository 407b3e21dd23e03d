"""Rotors that were answered wrongly without a word: windows, tables, peaks, units."""

import warnings

import pytest
from tables_data import write_csv

from rotorid.files import read_rotor

PLAIN = [["length_mm", "diameter_mm"], [250, 40], [250, 40], [250, 40], [250, 40]]
SEAL = [
    ["speed_rpm", *(f"k{e}_N_per_m" for e in ("xx", "xy", "yx", "yy")), "cxx_N_s_per_m", "cyy_N_s_per_m"],
    *(
        [rpm, 0, k, -k, 0, 300, 300]
        for rpm, k in (
            (0, 0), (1336.9015, 0), (1432.3945, 3e5), (1718.8734, 3e5), (1814.3664, 0), (11459.156, 0)
        )
    ),
]  # fmt: skip
DISC = "mass_kg=10\npolar_inertia_kg_m2=0.1\ndiametral_inertia_kg_m2=0.05\n"
INERTIA = "[model]\nrotary_inertia=true\ngyroscopic=true\n"
WINDOW = (
    f'shaft="p4.csv"\n{INERTIA}[[disc]]\nnode=3\n{DISC}[[bearing]]\nnode=1\nstiffness_N_per_m=1e8\n'
    '[[bearing]]\nnode=5\nstiffness_N_per_m=1e8\n[[seal]]\nnode=3\ntable="win.csv"\n'
)


@pytest.fixture
def window(tmp_path):
    """A seal that drives whirl between 140 and 190 rad/s only."""
    write_csv(tmp_path / "p4.csv", PLAIN)
    write_csv(tmp_path / "win.csv", SEAL)
    write_csv(tmp_path / "u.csv", [["plane", "unbalance_g_mm", "angle_deg"], [3, 100, 0]])
    (tmp_path / "win.toml").write_text(WINDOW)
    return tmp_path


@pytest.fixture
def crossings(tmp_path):
    """A disc on springs whose natural frequency meets the speed twice within one interval of the table."""
    write_csv(tmp_path / "ps.csv", [["length_mm", "diameter_mm"], [50, 200], [50, 200]])
    table = [["speed_rpm", "stiffness_N_per_m"], [954.9296586, 99900], [1909.859317, 349900]]
    write_csv(tmp_path / "tab.csv", table)
    bearing = '[[bearing]]\nnode={}\ntable="tab.csv"\n'
    (tmp_path / "r.toml").write_text(
        'shaft="ps.csv"\n[material]\ndensity_kg_per_m3=0\n[[disc]]\nnode=2\nmass_kg=20\n'
        + bearing.format(1)
        + bearing.format(3)
    )
    return tmp_path / "r.toml"


def test_a_window_of_instability_between_the_speeds_that_used_to_be_looked_at(cli, window):
    rotor = window / "win.toml"
    for speeds in ("100,165,220,900", "165", "10:1000:50"):
        command = ("influence", rotor, "--planes", "3", "--sensors", "3", "--speeds", speeds)
        document = cli(*command, "--json").json
        assert len(document["warnings"]) == 1
        (found,) = document["unstable_speeds"]
        if speeds != "165":
            assert found["from_rad_s"] == pytest.approx(142.916, abs=1e-2)
            assert found["to_rad_s"] == pytest.approx(187.084, abs=1e-2)
    beside = ("influence", rotor, "--planes", "3", "--sensors", "3", "--speeds", "100,142.9,187.1,900")
    assert cli(*beside, "--json").json["warnings"] == []


def test_both_crossings_within_one_interval(cli, crossings):
    expected = [100.20, 149.80]
    one = cli("critical", crossings, "-n", 1, "--json").json
    assert one["critical_speeds_rad_s"] == pytest.approx(expected[:1], abs=0.01)
    assert "1 more critical speed in this range; -n 2 lists all" in one["critical_speeds_cut"]
    both = cli("critical", crossings, "-n", 2, "--json").json
    assert both["critical_speeds_rad_s"] == pytest.approx(expected, abs=0.01)
    # 200 rad/s is 1909.8593171 rpm: the table, written with ten digits, does not end before it.
    for speeds in ("100,150,200", "100,200"):
        damped = cli("campbell", crossings, "--speeds", speeds, "-n", 2, "--json").json
        found = sorted({round(v, 2) for v in damped["damped_critical_speeds_rad_s"]})
        assert found == pytest.approx(expected, abs=0.01)
    cut = cli("campbell", crossings, "--speeds", "100,150,200", "-n", 1, "--json").json
    assert "the list of critical speeds is cut" in cut["damped_critical_speeds_cut"]
    assert damped["damped_critical_speeds_cut"] is None


@pytest.mark.parametrize(
    ("shaft", "rest", "said"),
    [
        (
            [[250, 0.11], [250, 50]],
            "",
            "row 2, column diameter_mm: found '0.11', expected 0.0005 to 10 m; is",
        ),
        ([[250, 50000], [250, 50]], "", "is this in um?"),
        (PLAIN[1:], "[material]\nyoungs_modulus_Pa=2.1e5\n", "is this in MPa?"),
        (
            PLAIN[1:],
            "[material]\nyoungs_modulus_Pa=210\n",
            "key material.youngs_modulus_Pa: found '210', expected 1e+09",
        ),
        (PLAIN[1:], "[material]\ndensity_kg_per_m3=7.8\n", "is this in g_per_cm3?"),
        ([[250000, 40]] * 2, "[[bearing]]\nnode=1\nstiffness_N_per_m=1\n", "is this in um?"),
        (PLAIN[1:], "[material]\nyoungs_modulus_Pa=7e10\ndensity_kg_per_m3=2700\n", ""),
        (PLAIN[1:], "[material]\ndensity_kg_per_m3=0\n[[disc]]\nnode=2\nmass_kg=1\n", ""),
        ([[1000, 6]] * 4, "", ""),
        (
            PLAIN[1:],
            "[[bearing]]\nnode=1\nstiffness_N_per_m=2000\n[[bearing]]\nnode=5\ndamping_N_s_per_m=9\n",
            "",
        ),
    ],
)
def test_what_no_rotor_is_gets_one_warning_with_the_likely_unit(tmp_path, shaft, rest, said):
    write_csv(tmp_path / "s.csv", [["length_mm", "diameter_mm"], *shaft])
    (tmp_path / "r.toml").write_text(f'shaft="s.csv"\n{rest}')
    texts = warnings_of(tmp_path / "r.toml")
    assert len(texts) == bool(said)
    assert said in "".join(texts)


def warnings_of(path):
    """What reading a rotor warns of."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        read_rotor(path)
    return [str(one.message) for one in caught]


def test_a_negative_bearing_stiffness_names_the_seal(cli, tmp_path):
    write_csv(tmp_path / "p4.csv", PLAIN)
    write_csv(tmp_path / "b.csv", [["speed_rpm", "kxx_N_per_m", "kyy_N_per_m"], [0, -1, 1], [9, 1, 1]])
    for rest in ("stiffness_N_per_m=-1e7", "kxx=-1e6\nkyy=1e6", 'table="b.csv"'):
        (tmp_path / "r.toml").write_text(f'shaft="p4.csv"\n[[bearing]]\nnode=1\n{rest}\n')
        assert "is a [[seal]], not a [[bearing]]" in cli("critical", tmp_path / "r.toml").err
    for quantity in ("stiffness_N_per_m", "damping_N_s_per_m"):
        write_csv(tmp_path / "s.csv", [["length_mm", "diameter_mm", f"support_{quantity}"], [250, 40, -1]])
        assert "is a [[seal]]" in cli("critical", tmp_path / "s.csv").err


def test_a_model_of_few_modes_shows_those_that_exist(cli, crossings):
    speeds = ("--speeds", "100,150,199")
    few = cli("campbell", crossings, *speeds, "--json").json
    assert len(few["frequencies_rad_s"]) == 2
    assert few["warnings"] == []
    asked = cli("campbell", crossings, *speeds, "-n", 500, "--json").json
    assert asked["frequencies_rad_s"] == few["frequencies_rad_s"]
    assert asked["warnings"] == ["only 2 of 500 modes oscillate"]
    plain = crossings.with_name("plain.toml")
    bearings = "".join(f"[[bearing]]\nnode={node}\nstiffness_N_per_m=1e5\n" for node in (1, 3))
    plain.write_text(crossings.read_text().split("[[bearing]]")[0] + bearings)
    assert cli("critical", plain, "--json").json["critical_speeds_rad_s"] == pytest.approx([100.0], rel=1e-5)
    assert "2 critical speeds cannot be found: the model has 1 to 1" in cli("critical", plain, "-n", 2).err


def test_nothing_is_taken_from_a_window(cli, window):
    command = ("response", window / "win.toml", "--unbalance", window / "u.csv", "--speeds", "120:280:4")
    outside = cli(*command, "--json", "--plot", window / "b.png").json
    speeds = [row["speed_rad_s"] for row in (*outside["largest"], *outside["peaks"])]
    speeds += outside["bearing_forces"]["largest_at_rad_s"]
    assert not [v for v in speeds if 142.9 < v < 187.1]
    assert (
        len(cli("campbell", window / "win.toml", "--speeds", "10:1000:30", "--json").json["unstable_speeds"])
        == 1
    )
    inside = (*command[:-1], "150:180:5")
    document = cli(*inside, "--json").json
    assert {row["amplitude_m"] for row in document["largest"]} == {None}
    assert document["bearing_forces"]["largest_N"] == [None] * 3
    orbits = ("--view", "orbits", "--plot", window / "o.png")
    assert "no orbit to draw" in cli(*inside, *orbits).err
    assert cli(*command, *orbits).code == 0
