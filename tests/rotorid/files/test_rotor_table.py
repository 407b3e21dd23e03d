"""Rotor tables and rotor files."""

from __future__ import annotations

import numpy as np
import pytest
from tables_data import complaints, replaced, the_only, write_book, write_csv

from fem import Disc, Rotor, Support
from rotorid.files import read_rotor, rotor_files

HEADER = ["element", "length_m", "diameter_m", "support_stiffness_N_per_m", "mass_kg"]
TABLE = [
    HEADER,
    ["1", 0.318, 0.11, 0, 0],
    ["2", 0.145, 0.11, 1e8, 0],
    ["3", 0.135, 0.115, 0, 25],
]
SHAFT = Rotor(
    length=np.array([0.318, 0.145, 0.135]),
    outer_diameter=np.array([0.11, 0.11, 0.115]),
    discs=(Disc(3, 25.0),),
    supports=(Support(2, 1e8),),
)


@pytest.fixture
def table(tmp_path):
    def read(table):
        return read_rotor(write_csv(tmp_path / "rotor.csv", table))

    return read


def test_a_rotor_table(table):
    assert table(TABLE) == SHAFT


def test_other_units_give_the_same_rotor(table):
    scale = (1, 1000, 1000, 1e-6, 1000)
    header = ["element", "length_mm", "diameter_mm", "support_stiffness_N_per_um", "mass_g"]
    small = [
        header,
        *([row[0], *(v * s for v, s in zip(row[1:], scale[1:], strict=True))] for row in TABLE[1:]),
    ]
    assert table(small) == SHAFT


def test_every_column(table):
    header = [
        "length_in",
        "diameter_m",
        "inner_diameter_mm",
        "mass_lb",
        "polar_inertia_kg_m2",
        "diametral_inertia_kg_m2",
        "support_stiffness_N_per_m",
        "support_damping_N_s_per_m",
        "youngs_modulus_Pa",
        "density_kg_per_m3",
    ]
    rotor = table([header, [10, 0.2, 50, 1, 2, 3, 0, 40, 2e11, 7700], [0, "", "", 0, 0, 0, 1e7, 0, "", ""]])
    expected = Rotor(
        length=np.array([0.254]),
        outer_diameter=np.array([0.2]),
        inner_diameter=np.array([0.05]),
        youngs_modulus=np.array([2e11]),
        density=np.array([7700.0]),
        discs=(Disc(1, 0.45359237, 2.0, 3.0),),
        supports=(Support(1, 0.0, 40.0), Support(2, 1e7)),
    )
    assert rotor == expected


def test_a_last_row_of_length_0_attaches_to_the_right_end(table):
    rotor = table([*TABLE, ["end", 0, 0, 2e7, 3]])
    assert rotor.n_elements == 3
    assert rotor.supports == (Support(2, 1e8), Support(4, 2e7))
    assert rotor.discs == (Disc(3, 25.0), Disc(4, 3.0))


BAD_CELLS = [
    ("length_m", 0, "a length above 0 (0 only in the last row"),
    ("length_m", -1, "a length above 0"),
    ("diameter_m", 0, "a number above 0"),
    ("mass_kg", -5, "0 or more"),
    ("support_stiffness_N_per_m", "rigid", "a number"),
    ("support_stiffness_N_per_m", -1, "0 or more; what pushes outwards"),
]


@pytest.mark.parametrize(("column", "value", "words"), BAD_CELLS)
def test_bad_cells(table, column, value, words):
    problems = complaints(table, replaced(TABLE, 3, column, value))
    the_only(problems, "rotor.csv", 3, column, str(value), words)


NOTHING = {
    "inner_diameter_m": (0.05, "inner_diameter", 0.0),
    "youngs_modulus_Pa": (2e11, "youngs_modulus", 2.1e11),
    "density_kg_per_m3": (7700, "density", 7800.0),
    "poisson_ratio": (0.2, "poisson_ratio", 0.3),
    "material_damping_s": (0.05, "material_damping", 0.0),
}


@pytest.mark.parametrize("column", NOTHING)
@pytest.mark.parametrize("book", [False, True])
def test_blanks_in_optional_columns_of_elements_say_nothing(table, tmp_path, column, book):
    usual, name, default = NOTHING[column]
    wide = [[*TABLE[0], column], *([*row, usual] for row in TABLE[1:])]
    blank = replaced(wide, 4, column, "")
    rotor = read_rotor(write_book(tmp_path / "a.xlsx", {"rotor": blank})) if book else table(blank)
    assert getattr(rotor, name).tolist() == [usual, usual, default]
    the_only(complaints(table, replaced(wide, 4, column, -1)), "rotor.csv", 4, column, "-1", "")


def test_blanks_in_columns_of_nodes_attach_nothing(table, tmp_path):
    columns = ["mass_kg", "polar_inertia_kg_m2", "support_stiffness_N_per_m", "support_damping_N_s_per_m"]
    header = ["length_m", "diameter_m", *columns]
    blank = [header, [0.1, 0.05, "", "", 1e8, ""], [0.1, 0.05, 2, "", "", ""], [0, "", "", "", 1e8, 30]]
    for rotor in (table(blank), read_rotor(write_book(tmp_path / "a.xlsx", {"rotor": blank}))):
        assert rotor.discs == (Disc(2, 2.0),)
        assert rotor.supports == (Support(1, 1e8), Support(3, 1e8, 30.0))


def test_an_element_much_shorter_than_its_neighbour(table):
    short = [[*TABLE[0]], *([*row] for row in TABLE[1:]), ["end", 0, 0, 2e7, 3]]
    assert table(replaced(short, 3, "length_m", 1.1e-4)).n_elements == 3
    problems = complaints(table, replaced(short, 3, "length_m", 1e-4))
    the_only(problems, "rotor.csv", None, None, None, "element 2: length must be 1/3000 of its longer neigh")


def test_a_bore_larger_than_the_shaft(table):
    wide = [[*TABLE[0], "inner_diameter_mm"], *([*row, 110] for row in TABLE[1:])]
    problems = complaints(table, wide)
    assert [(p.row, p.value, p.expected) for p in problems] == [
        (2, "110", "less than the outer diameter"),
        (3, "110", "less than the outer diameter"),
    ]


def test_missing_column_and_no_element(table):
    problems = complaints(table, [[row[0], *row[2:]] for row in TABLE])
    the_only(
        problems, "rotor.csv", 1, "length_m", None, "a column length_m or length_mm; the columns are element"
    )
    problems = complaints(table, [HEADER, ["end", 0, 0, 1, 1]])
    the_only(problems, "rotor.csv", 1, "length_m", None, "at least one row with a length above 0")


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
def file(tmp_path):
    write_csv(tmp_path / "shaft.csv", TABLE)

    def read(text):
        path = tmp_path / "rotor.toml"
        path.write_text(text, encoding="utf-8")
        return read_rotor(path)

    return read


def test_a_rotor_file(file):
    rotor = file(FILE)
    assert rotor == Rotor(
        length=SHAFT.length,
        outer_diameter=SHAFT.outer_diameter,
        youngs_modulus=np.full(3, 2e11),
        density=np.full(3, 7700.0),
        poisson_ratio=np.full(3, 0.28),
        discs=(Disc(3, 25.0), Disc(1, 4.0, name="collar")),
        supports=(Support(2, 1e8), Support(4, 1e7, 300.0)),
        stations={"thrust": 1},
    )
    assert file('shaft = "shaft.csv"') == SHAFT
    assert file("\ufeffshaft = 'shaft.csv'\r\n") == SHAFT


def test_files_of_a_rotor(file, tmp_path):
    file(FILE)
    assert rotor_files(tmp_path / "rotor.toml") == (tmp_path / "rotor.toml", tmp_path / "shaft.csv")
    assert rotor_files(tmp_path / "shaft.csv") == (tmp_path / "shaft.csv",)
    assert rotor_files(tmp_path / "none.toml") == (tmp_path / "none.toml",)


def test_rows_of_the_table_override_the_material(file, tmp_path):
    write_csv(tmp_path / "shaft.csv", [[*HEADER, "density_kg_per_m3"], *([*row, 2700] for row in TABLE[1:])])
    rotor = file(FILE)
    assert rotor.density.tolist() == [2700.0] * 3
    assert rotor.youngs_modulus.tolist() == [2e11] * 3


BAD_FILES = [
    ("shear = false", 'shear = "none"', "model.shear", "none", "true or false, without quotes"),
    (
        "youngs_modulus_Pa = 2e11",
        "youngs_modulus = 2e11",
        "material.youngs_modulus",
        "200000000000.0",
        "did you mean",
    ),
    (
        "youngs_modulus_Pa = 2e11",
        "youngs_modulus_Pa = 0",
        "material.youngs_modulus_Pa",
        "0",
        "a number above 0",
    ),
    (
        "density_kg_per_m3 = 7700",
        "density_kg_per_m3 = nan",
        "material.density_kg_per_m3",
        "nan",
        "a finite number",
    ),
    ("poisson_ratio = 0.28", "poisson_ratio = 2", "material.poisson_ratio", "2", "a number up to 0.5"),
    ("mass_kg = 4", "mass_kg = -4", "disc[1].mass_kg", "-4", "0 or more"),
    ("mass_kg = 4", "", "disc[1].mass_kg", None, "the mass of the disc"),
    ('node = "thrust"', 'node = "trust"', "disc[1].node", "trust", "did you mean 'thrust'?"),
    ("node = 4", "node = 5", "bearing[1].node", "5", "a node from 1 to 4 or a station"),
    ("node = 4", "node = 0", "bearing[1].node", "0", "a node: its number from 1"),
    ("node = 4", "", "bearing[1].node", None, "a node: its number from 1"),
    (
        "damping_N_s_per_m = 300",
        "damping = 3",
        "bearing[1].damping",
        "3",
        "did you mean 'damping_N_s_per_m'?",
    ),
    ('shaft = "shaft.csv"', "", "shaft", None, "the file of the shaft"),
]


@pytest.mark.parametrize(("old", "new", "key", "value", "words"), BAD_FILES)
def test_bad_rotor_files(file, old, new, key, value, words):
    assert old in FILE
    the_only(complaints(file, FILE.replace(old, new, 1)), "rotor.toml", None, key, value, words)


def test_bad_stations(file):
    station = '\n[[station]]\nname = "{}"\nnode = 2\n'
    problems = complaints(file, FILE + station.format("thrust"))
    the_only(problems, "rotor.toml", None, "station[2].name", "thrust", "a name that no other station has")
    problems = complaints(file, FILE + station.format("12"))
    the_only(problems, "rotor.toml", None, "station[2].name", "12", "a name, not a number")
    problems = complaints(file, FILE + "\n[[station]]\nnode = 2\n")
    the_only(problems, "rotor.toml", None, "station[2].name", None, "a name for the node")


def test_rotor_files_that_are_none(file, tmp_path):
    the_only(complaints(file, ""), "rotor.toml", None, None, None, "the file is empty")
    the_only(complaints(file, "shaft = "), "rotor.toml", None, None, None, "a TOML file: Invalid value")
    the_only(
        complaints(file, 'shaft = "saft.csv"'), "saft.csv", None, None, None, "did you mean 'shaft.csv'?"
    )
    the_only(complaints(file, "disc = 3\nshaft='shaft.csv'"), "rotor.toml", None, "disc", "3", "[[disc]]")
    (tmp_path / "x.toml").write_bytes("shaft = 'Welle süd.csv'".encode("cp1252"))
    the_only(complaints(read_rotor, tmp_path / "x.toml"), "x.toml", None, None, None, "in UTF-8")
