"""Forces that are not linear in rotor files: read in field units, refused in words, written back."""

import pytest
from cases import each_of
from tables_data import complaints, write_csv

import fem
from rotorid.files import InputError, TableWarning, read_rotor, write_rotor

SHAFT = [["length_m", "diameter_m", "mass_kg"], [0.3, 0.1, 0], [0.4, 0.12, 20], [0.3, 0.1, 0]]
BEARING = ["length_mm = 30", "diameter_mm = 100", "clearance_um = 100", "viscosity_mPa_s = 100"]
SEAL = ["stiffness_N_per_um = 1", "damping_N_s_per_m = 50", "swirl_ratio = 0.4", "clearance_mm = 0.3"]


@pytest.fixture
def file(tmp_path):
    write_csv(tmp_path / "shaft.csv", SHAFT)

    def read(text):
        station = '[[station]]\nname = "DE"\nnode = 1\n'
        (tmp_path / "rotor.toml").write_text(f'shaft = "shaft.csv"\n{station}{text}', encoding="utf-8")
        return read_rotor(tmp_path / "rotor.toml")

    read.folder = tmp_path
    return read


def table(kind, *lines, node="2"):
    return "\n".join([f"[[{kind}]]", f"node = {node}", *lines, ""])


def test_every_kind_in_field_units(file):
    rotor = file(
        table("stop", "gap_um = 200", "stiffness_N_per_um = 10", "friction = 0.1", "diameter_mm = 100")
        + table("journal_bearing", *BEARING, node='"DE"')
        + table(
            "journal_bearing",
            'name = "NDE"',
            "length_m = 0.03",
            "diameter_in = 4",
            "clearance_mil = 4",
            "viscosity_cP = 28",
            'film = "line of centres"',
            node="4",
        )
        + table("squeeze_film", *BEARING, "centring_stiffness_N_per_mm = 500")
        + table("annular_seal", *SEAL, "fluid_mass_g = 300", "stiffness_exponent = 0")
        + table("cubic_spring", "cubic_stiffness_N_per_mm3 = 2", "stiffness_N_per_m = 5")
        + table("internal_damping", "damping_N_s_per_mm = 0.2")
    )
    film = {"length": 0.03, "diameter": 0.1, "clearance": 1e-4, "viscosity": 0.1}
    assert rotor.forces == (
        fem.JournalBearing(1, **film),
        fem.JournalBearing(4, "NDE", 0.03, 4 * 254 / 1e4, 4 * 254 / 1e7, 28 / 1e3, "line of centres"),
        fem.SqueezeFilm(2, **film, centring_stiffness=5e5),
        fem.MuszynskaSeal(2, "", 1e6, 50.0, 0.3, 0.4, 3e-4, 0.0, 0.5),
        fem.CubicSpring(2, "", 5.0, 2e9),
        fem.Stop(2, "", 2e-4, 1e7, 0.0, 0.1, 0.1, 0.01),
        fem.InternalDamping(2, "", 200.0),
    )
    assert rotor.linear.forces == ()
    write_rotor(file.folder / "again.toml", rotor)
    assert read_rotor(file.folder / "again.toml") == rotor


BAD = [
    ("journal_bearing", BEARING[:3], "viscosity_mPa_s", "viscosity of the fluid in the film"),
    ("journal_bearing", [*BEARING[:3], "viscosity = 3"], "viscosity", "did you mean 'viscosity_mPa_s'?"),
    ("journal_bearing", [*BEARING[:2], "clearance_um = 0", BEARING[3]], "clearance_um", "a number above 0"),
    ("journal_bearing", [*BEARING, "clearance_mm = 0.1"], "clearance_mm", "clearance_um says it already"),
    ("journal_bearing", [*BEARING, 'film = "pi"'], "film", "'pressure' or 'line of centres'"),
    ("journal_bearing", [*BEARING, "orientation_deg = 30"], "orientation_deg", "a known key"),
    ("squeeze_film", [*BEARING[:3], 'viscosity_cP = "thin"'], "viscosity_cP", "a number"),
    (
        "squeeze_film",
        [*BEARING, "centring_stiffness_N_per_m = -1"],
        "centring_stiffness_N_per_m",
        "0 or more",
    ),
    ("annular_seal", SEAL[:3], "clearance_um", "radial clearance"),
    ("annular_seal", [*SEAL, "swirl_exponent = -1"], "swirl_exponent", "0 or more"),
    ("cubic_spring", ["stiffness_N_per_m = 1"], "cubic_stiffness_N_per_m3", "force by the cube"),
    ("stop", ["gap_um = 9"], "stiffness_N_per_m", "of the contact"),
    (
        "stop",
        ["gap_um = 9", "stiffness_N_per_m = 1e6", "friction = 0.1"],
        "diameter_mm",
        "acts against the slip",
    ),
    ("internal_damping", ["damping_N_s_per_m = nan"], "damping_N_s_per_m", "a finite number"),
]


@each_of("kind, lines, key, words", BAD)
def test_bad_forces(file, kind, lines, key, words):
    found = {problem.column: problem.expected for problem in complaints(file, table(kind, *lines))}
    assert words in found.pop(f"{kind}[1].{key}")
    assert not found or (key == "viscosity" and len(found) == 1), "misspelt, thus missing, too"


@each_of("node", ["0", "5", '"NDE"', "1.5"])
def test_a_node_that_is_none(file, node):
    with pytest.raises(
        InputError, match=r"key internal_damping\[1\]\.node: .* a node( from 1 to 4|: its number)"
    ):
        file(table("internal_damping", "damping_N_s_per_m = 1", node=node))


UNLIKELY = [
    (
        "journal_bearing",
        [*BEARING[:2], "clearance_m = 100", BEARING[3]],
        "clearance 100 m; is this in another unit?",
    ),
    ("journal_bearing", [*BEARING[:2], "clearance_mm = 100", BEARING[3]], "clearance 0.1 m; is this in"),
    (
        "journal_bearing",
        [*BEARING[:2], "clearance_um = 0.1", BEARING[3]],
        "clearance 1e-07 m; is this in another",
    ),
    ("journal_bearing", [*BEARING[:3], "viscosity_Pa_s = 28"], "viscosity 28 Pa·s; is this in another unit?"),
    ("squeeze_film", [*BEARING[:3], "viscosity_mPa_s = 0.005"], "viscosity 5e-06 Pa·s; is this"),
    ("squeeze_film", ["length_m = 300", *BEARING[1:]], "length 300 m; is this in mm?"),
    ("stop", ["gap_m = 0.2", "stiffness_N_per_m = 1e7"], "gap 0.2 m; is this in another unit?"),
]


@each_of("kind, lines, words", UNLIKELY)
def test_values_that_are_no_machine_s(file, kind, lines, words):
    with pytest.warns(TableWarning) as caught:
        file(table(kind, *lines))
    (warning,) = caught
    assert " at node 2: " in str(warning.message)
    assert words in str(warning.message)


LINEAR = [
    "critical rotor.toml",
    "campbell rotor.toml --speeds 1000:9000:1000rpm --output o.csv",
    "influence rotor.toml --planes 2 --sensors 3 --speeds 1000,2000rpm",
    "balance job.toml",
]


@each_of("command", LINEAR)
def test_linear_commands_refuse_and_say_what_helps(file, command, monkeypatch, cli):
    file(table("journal_bearing", *BEARING, node="1") + table("journal_bearing", *BEARING, node="4"))
    write_csv(
        file.folder / "runs.csv",
        [["run", "speed_rpm", "sensor", "amplitude_um", "phase_deg"], ["a", 1000, "s", 10, 20]],
    )
    job = 'runs = "runs.csv"\nrotor = "rotor.toml"\nphase = "lead"\n'
    job += "[planes.p]\nnode = 2\n[sensors.s]\nnode = 3\n"
    (file.folder / "job.toml").write_text(job, encoding="utf-8")
    before = sorted(file.folder.iterdir())
    monkeypatch.chdir(file.folder)
    ended = cli(*command.split())
    assert (ended.code, ended.out) == (2, "")
    assert "the journal bearing at node 1 is not linear" in ended.err
    assert sorted(file.folder.iterdir()) == before
