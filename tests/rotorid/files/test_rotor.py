"""Rotor tables, rotor files with supports, discs and forces, and writing them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from cases import each_of
from tables_data import complaints, replaced, the_only, write_book, write_csv

from fem import (
    CubicSpring,
    Disc,
    InternalDamping,
    JournalBearing,
    Model,
    MuszynskaSeal,
    Pedestal,
    Rotor,
    SqueezeFilm,
    Stop,
    Support,
)
from rotorid.files import InputError, read_rotor, rotor_files, write_rotor
from rotorid.samples import sample_data

INCH, POUND, FORCE = 0.0254, 0.45359237, 4.4482216152605
TABLE = [
    ["element", "length_m", "diameter_m", "support_stiffness_N_per_m", "mass_kg"],
    ["1", 0.318, 0.11, 0, 0],
    ["2", 0.145, 0.11, 1e8, 0],
    ["3", 0.135, 0.115, 0, 25],
]
SHAFT = Rotor([0.318, 0.145, 0.135], [0.11, 0.11, 0.115], discs=(Disc(3, 25.0),), supports=(Support(2, 1e8),))
SPEEDS = [
    ["speed_rad_s", "kxx_N_per_m", "kyy_N_per_m", "kxy_N_per_m", "cxx_N_s_per_m", "cyy_N_s_per_m"],
    [100, 1e7, 3e7, 2e6, 1e4, 2e4],
    [200, 2e7, 4e7, 1e6, 5e3, 1e4],
]
FILE = """
shaft = "shaft.csv"
[material]
youngs_modulus_Pa = 2e11
density_kg_per_m3 = 7700
poisson_ratio = 0.28
[model]
shear = false
[[disc]]
node = "thrust"
mass_kg = 4
name = "collar"
[[bearing]]
node = 4
stiffness_N_per_m = 1e7
damping_N_s_per_m = 300
[[station]]
name = "thrust"
node = 1
"""


@pytest.fixture
def table(tmp_path):
    return lambda rows: read_rotor(write_csv(tmp_path / "rotor.csv", rows))


@pytest.fixture
def file(tmp_path):
    """Read a rotor file beside a shaft of three elements and a table of coefficients."""
    write_csv(tmp_path / "shaft.csv", TABLE)
    write_csv(tmp_path / "b.csv", SPEEDS)

    def read(text, head='shaft = "shaft.csv"\n'):
        (tmp_path / "rotor.toml").write_text(head + text, encoding="utf-8")
        return read_rotor(tmp_path / "rotor.toml")

    read.folder = tmp_path
    return read


def at_node_2(kind, *lines):
    return "\n".join([f"[[{kind}]]", "node = 2", *lines, ""])


def the_support(file, *lines, kind="bearing"):
    return file(at_node_2(kind, *lines)).supports[-1]


# --- tables


def test_a_rotor_table(table, tmp_path):
    assert table(TABLE) == read_rotor(write_book(tmp_path / "a.xlsx", {"rotor": TABLE})) == SHAFT
    header = ["element", "length_mm", "diameter_mm", "support_stiffness_N_per_um", "mass_g"]
    small = [[row[0], 1e3 * row[1], 1e3 * row[2], 1e-6 * row[3], 1e3 * row[4]] for row in TABLE[1:]]
    assert table([header, *small]) == SHAFT


@pytest.mark.parametrize("book", [False, True])
def test_every_column_in_us_units_with_blank_cells(tmp_path, book):
    header = [
        "length_in",
        "diameter_in",
        "inner_diameter_in",
        "mass_lb",
        "polar_inertia_lb_in2",
        "diametral_inertia_kg_m2",
        "support_stiffness_lbf_per_in",
        "support_damping_lbf_s_per_in",
        "youngs_modulus_psi",
        "density_lb_per_in3",
        "poisson_ratio",
        "material_damping_ms",
    ]
    rows = [
        [10, 2, "", "", "", "", 1e5, 50, "", "", "", 0.5],
        [12, 2.5, 1, 20, 90, 3, "", "", 30e6, 0.283, 0.25, ""],
        [0, "", "", "", "", "", 1e5, "", "", "", "", ""],
    ]
    path = tmp_path / ("a.xlsx" if book else "a.csv")
    rotor = read_rotor(
        write_book(path, {"rotor": [header, *rows]}) if book else write_csv(path, [header, *rows])
    )
    expected = {
        "length": [10 * INCH, 12 * INCH],
        "outer_diameter": [2 * INCH, 2.5 * INCH],
        "inner_diameter": [0, INCH],
        "youngs_modulus": [2.1e11, 30e6 * FORCE / INCH**2],
        "density": [7800, 0.283 * POUND / INCH**3],
        "poisson_ratio": [0.3, 0.25],
        "material_damping": [5e-4, 0],
    }
    for name, values in expected.items():
        np.testing.assert_allclose(getattr(rotor, name), values, rtol=1e-14, err_msg=name)
    [disc] = rotor.discs
    inertia = [20 * POUND, 90 * POUND * INCH**2, 3.0]
    np.testing.assert_allclose([disc.mass, disc.polar_inertia, disc.diametral_inertia], inertia, rtol=1e-14)
    first, last = rotor.supports
    assert (first.node, last.node, last.damping) == (1, 3, 0)
    np.testing.assert_allclose([first.stiffness, first.damping], [1e5 * FORCE / INCH, 50 * FORCE / INCH])


@each_of(
    "row, column, value, words",
    [
        (3, "length_m", 0, "a length above 0 (0 only in the last row"),
        (4, "inner_diameter_mm", 115, "less than the outer diameter"),
        (4, "poisson_ratio", -1, "above -1, up to 0.5"),
    ],
)
def test_bad_cells(table, row, column, value, words):
    wide = TABLE if column in TABLE[0] else [[*TABLE[0], column], *([*line, ""] for line in TABLE[1:])]
    problems = complaints(table, replaced(wide, row, column, value))
    the_only(problems, "rotor.csv", row, column, str(value), words)


# --- files


def test_a_rotor_file(file):
    rotor = file(FILE, "")
    assert rotor == Rotor(
        SHAFT.length,
        SHAFT.outer_diameter,
        youngs_modulus=2e11,
        density=7700.0,
        poisson_ratio=0.28,
        discs=(Disc(3, 25.0), Disc(1, 4.0, name="collar")),
        supports=(Support(2, 1e8), Support(4, 1e7, 300.0)),
        stations={"thrust": 1},
    )
    assert file("") == file("", "\ufeffshaft = 'shaft.csv'\r\n") == SHAFT
    effects = file("[model]\nrotary_inertia = true\ngyroscopic = true\n[material]\nmaterial_damping_s = 2e-5")
    assert effects.model == Model(rotary_inertia=True, gyroscopic=True)
    assert effects.material_damping.tolist() == [2e-5] * 3


@each_of(
    "material, model, shear",
    [
        ("", "", False),
        ("poisson_ratio = 0.29", "", True),
        ("poisson_ratio = 0.29", "shear = false", False),
        ("", "shear = true", True),
    ],
)
def test_shear_is_counted_where_the_ratio_is_given_and_nothing_else_is_written(file, material, model, shear):
    assert file(f"[material]\n{material}\n[model]\n{model}\n").model.shear is shear


@each_of(
    "old, new, key, value, words",
    [
        ("modulus_Pa = 2e11", "modulus = 2e11", "material.youngs_modulus", "200000000000.0", "did you mean"),
        ("ratio = 0.28", "ratio = 2", "material.poisson_ratio", "2", "a number up to 0.5"),
        ("mass_kg = 4", "", "disc[1].mass_kg", None, "the mass of the disc"),
        ('node = "thrust"', 'node = "trust"', "disc[1].node", "trust", "did you mean 'thrust'?"),
        ("node = 4", "node = 5", "bearing[1].node", "5", "a node from 1 to 4 or a station"),
        ('shaft = "shaft.csv"', "", "shaft", None, "the file of the shaft"),
        (
            "node = 1\n",
            'node = 1\n[[station]]\nname = "thrust"\nnode = 2',
            "station[2].name",
            "thrust",
            "no other station",
        ),
    ],
)
def test_bad_rotor_files(file, old, new, key, value, words):
    assert old in FILE
    text = FILE.replace(old, new, 1)
    the_only(complaints(file, text, ""), "rotor.toml", None, key, value, words)


def test_rotor_files_that_are_none(file, tmp_path):
    the_only(complaints(file, "", ""), "rotor.toml", None, None, None, "the file is empty")
    problems = complaints(file, 'shaft = "saft.csv"', "")
    the_only(problems, "saft.csv", None, None, None, "did you mean 'shaft.csv'?")
    (tmp_path / "x.toml").write_bytes("shaft = 'Welle süd.csv'".encode("cp1252"))
    the_only(complaints(read_rotor, tmp_path / "x.toml"), "x.toml", None, None, None, "in UTF-8")
    [problem] = complaints(read_rotor, sample_data() / "motion" / "small.toml")
    assert "this is a small model, for `rotorid motion`" in str(problem)


def test_a_disc_by_its_geometry(file):
    text = (
        "[material]\ndensity_kg_per_m3 = 2700\n[[disc]]\nnode = 2\nwidth_m = 0.05\nouter_diameter_m = 0.4\n"
    )
    assert file(text).discs[-1] == Disc.from_geometry(2, 0.05, 0.4, density=2700)


# --- supports

SCALAR = "stiffness_N_per_m = 1e7"
MATRIX = ["kxx_N_per_mm = 1e4", "kxy = 2e6", "kyx_N_per_m = -1e6", "kyy_N_per_um = 30"]
STAND = ["pedestal_mass_lb = 50", "pedestal_stiffness_N_per_m = [1e8, 2e8]", "pedestal_damping_N_s_per_m = 9"]


@each_of(
    "kind, lines, expected",
    [
        (
            "bearing",
            [*MATRIX, "cxx_N_s_per_m = 10", "cyy = 20"],
            [((1e7, 2e6), (-1e6, 3e7)), ((10, 0), (0, 20))],
        ),
        ("seal", ["kxy = 1e6", "kyx = -1e6"], [((0.0, 1e6), (-1e6, 0.0)), 0.0]),
        ("seal", ["kxx = -1", "kyy = -2", "cxx = 3", "cyy = 4"], [((-1, 0), (0, -2)), ((3, 0), (0, 4))]),
        ("bearing", [SCALAR, 'name = "DE"', "tilting_stiffness_N_m_per_rad = 3e5"], [1e7, 0.0, "DE"]),
    ],
)
def test_coefficients(file, kind, lines, expected):
    tilting = 3e5 if "tilting" in lines[-1] else 0.0
    assert the_support(file, *lines, kind=kind) == Support(2, *expected, kind=kind, tilting_stiffness=tilting)


def test_pedestals(file):
    stand = Pedestal(50 * POUND, (1e8, 2e8), 9)
    assert the_support(file, SCALAR, *STAND) == Support(2, 1e7, pedestal=stand)
    assert the_support(file, SCALAR, "pedestal_stiffness_N_per_m = 5").pedestal == Pedestal(0.0, 5)


def test_coefficients_over_speed(file):
    k = (((1e7, 2e6), (0, 3e7)), ((2e7, 1e6), (0, 4e7)))
    c = (((1e4, 0), (0, 2e4)), ((5e3, 0), (0, 1e4)))
    expected = Support(2, k, c, "DE", speeds=(100, 200))
    assert the_support(file, 'table = "b.csv"', 'name = "DE"') == expected
    write_csv(file.folder / "s.csv", [["speed_rpm", "stiffness_lbf_per_in"], [0, -1e4], [120, 2e4]])
    seal = the_support(file, 'table = "s.csv"', "damping_N_s_per_m = 7", kind="seal")
    np.testing.assert_allclose(seal.stiffness, np.array([-1e4, 2e4]) * FORCE / INCH, rtol=1e-14)
    assert (seal.damping, seal.speeds) == ((7.0, 7.0), (0.0, pytest.approx(4 * math.pi)))


@each_of(
    "lines, key, value, words",
    [
        ((SCALAR, "kxx = 1e7", "kyy = 1e7"), "", None, "either stiffness_N_per_m, or both kxx_N_per_m"),
        (("kxx = 1e7", "kyy = 1e7", "kxx_N_per_m = 1e7"), "kxx_N_per_m", "10000000.0", "kxx says it already"),
        (
            ("kxx_N_per_mm = -5e7", "kyy = 5e7"),
            "kxx_N_per_mm",
            "-50000000.0",
            "0 or more; what pushes outwards",
        ),
        (('table = "b.csv"', "kxx = 3"), "", None, "kxx_N_per_m once: "),
    ],
)
def test_bad_bearings(file, lines, key, value, words):
    problems = complaints(file, at_node_2("bearing", *lines))
    the_only(problems, "rotor.toml", None, f"bearing[1].{key}".strip("."), value, words)


@each_of(
    "table, row, column, value, words",
    [
        (replaced(SPEEDS, 3, "speed_rad_s", 100), 3, "speed_rad_s", "100", "above that of the row before"),
        (replaced(SPEEDS, 3, "kyy_N_per_m", -1), 3, "kyy_N_per_m", "-1", "is a [[seal]]"),
    ],
)
def test_bad_tables_of_bearings(file, table, row, column, value, words):
    write_csv(file.folder / "b.csv", table)
    problems = complaints(file, at_node_2("bearing", 'table = "b.csv"'))
    the_only(problems, "b.csv", row, column, value, words)


# --- forces

BEARING = ["length_mm = 30", "diameter_mm = 100", "clearance_um = 100", "viscosity_mPa_s = 100"]
SEAL = ["stiffness_N_per_um = 1", "damping_N_s_per_m = 50", "swirl_ratio = 0.4", "clearance_mm = 0.3"]
STOP = ["gap_um = 200", "stiffness_N_per_um = 10", "friction = 0.1"]


def test_every_kind_of_force_in_field_units(file):
    other = ["length_m = 0.03", "diameter_in = 4", "clearance_mil = 4", "viscosity_cP = 28"]
    rotor = file(
        at_node_2("stop", *STOP, "diameter_mm = 100")
        + at_node_2("journal_bearing", 'name = "NDE"', *other, 'film = "line of centres"')
        + at_node_2("squeeze_film", *BEARING, "centring_stiffness_N_per_mm = 500")
        + at_node_2("annular_seal", *SEAL, "fluid_mass_g = 300", "stiffness_exponent = 0")
        + at_node_2("cubic_spring", "cubic_stiffness_N_per_mm3 = 2", "stiffness_N_per_m = 5")
        + at_node_2("internal_damping", "damping_N_s_per_mm = 0.2")
    )
    film = {"length": 0.03, "diameter": 0.1, "clearance": 1e-4, "viscosity": 0.1}
    assert rotor.forces == (
        JournalBearing(2, "NDE", 0.03, 4 * 254 / 1e4, 4 * 254 / 1e7, 28 / 1e3, "line of centres"),
        SqueezeFilm(2, **film, centring_stiffness=5e5),
        MuszynskaSeal(2, "", 1e6, 50.0, 0.3, 0.4, 3e-4, 0.0, 0.5),
        CubicSpring(2, "", 5.0, 2e9),
        Stop(2, "", 2e-4, 1e7, 0.0, 0.1, 0.1, 0.01),
        InternalDamping(2, "", 200.0),
    )
    write_rotor(file.folder / "again.toml", rotor)
    assert read_rotor(file.folder / "again.toml") == rotor


@each_of(
    "kind, lines, key, words",
    [
        ("journal_bearing", BEARING[:3], "viscosity_mPa_s", "viscosity of the fluid in the film"),
        (
            "journal_bearing",
            [*BEARING[:2], "clearance_um = 0", BEARING[3]],
            "clearance_um",
            "a number above 0",
        ),
        ("journal_bearing", [*BEARING, 'film = "pi"'], "film", "'pressure' or 'line of centres'"),
    ],
)
def test_bad_forces(file, kind, lines, key, words):
    [problem] = complaints(file, at_node_2(kind, *lines))
    assert (problem.column, words in problem.expected) == (f"{kind}[1].{key}", True)


# --- writing


def test_a_rotor_with_everything_comes_back_from_its_file(tmp_path):
    matrix = ((1e7, 2e5), (-3e5, 2e7))
    rotor = Rotor(
        [0.1, 1 / 3, 0.2],
        [0.05, 0.07, 0.06],
        [0.0, 0.01, 0.0],
        [2e11, 7e10, 2.1e11],
        [7700.0, 2700.0, 7850.0],
        [Disc(2, 2.5, 3.0, 1.7, "a, b"), Disc(2, 0.0, 1.0), Disc(1, 1e-3)],
        [
            Support(1, matrix, ((10.0, 0.0), (0.0, 20.0)), 'D"E', pedestal=Pedestal(5.0, (1e8, 2e8), 10.0)),
            Support(4, (1e7, matrix), (0.0, matrix), speeds=(0.0, 1 / 7), tilting_stiffness=50.0),
            Support(3, -1e5, ((-1.0, 2.0), (3.0, 4.0)), "ß", kind="seal"),
            Support(3, (-1e5, 2e5), (3.0, 4.0), "", (1.0, 2.0), kind="seal"),
        ],
        {"fan": 2, "a b": 4},
        [0.3, -0.5, 0.0],
        [0.0, 1e-5, 2e-5],
        Model(True, False, True),
    )
    path = tmp_path / "again.toml"
    written = write_rotor(path, rotor)
    assert read_rotor(path) == rotor
    assert set(written) == set(rotor_files(path))
    assert written[0] == path


def test_what_would_not_come_back_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"key station.1..name: found '12', expected a name, not a number"):
        write_rotor(tmp_path / "r.toml", Rotor([1.0], 0.1, stations={"12": 1}))
    with pytest.raises(ValueError, match=r"would not come back from its file: .*surrogates not allowed"):
        write_rotor(tmp_path / "r.toml", Rotor([1.0], 0.1, discs=[Disc(1, 2, name="\ud800")]))
    with pytest.raises(InputError, match=r"ends in \.toml"):
        write_rotor(tmp_path / "r.txt", Rotor([1.0], 0.1))
    assert list(tmp_path.iterdir()) == []
