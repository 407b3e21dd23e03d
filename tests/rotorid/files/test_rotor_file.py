"""Rotor files in full: model, geometry of discs, bearings over speed, pedestals, seals; and writing them."""

from __future__ import annotations

import math

import pytest
from tables_data import complaints, replaced, the_only, write_book, write_csv

from fem import Disc, Model, Pedestal, Rotor, Support
from rotorid.files import InputError, read_rotor, rotor_files, write_rotor
from rotorid.samples import sample_data

SHAFT = [["length_m", "diameter_m"], [0.3, 0.1], [0.4, 0.12], [0.3, 0.1]]
TABLE = [
    ["speed_rad_s", "kxx_N_per_m", "kyy_N_per_m", "kxy_N_per_m", "cxx_N_s_per_m", "cyy_N_s_per_m"],
    [100, 1e7, 3e7, 2e6, 1e4, 2e4],
    [200, 2e7, 4e7, 1e6, 5e3, 1e4],
]


@pytest.fixture
def file(tmp_path):
    """Read a rotor file beside a shaft of three elements and a table of coefficients."""
    write_csv(tmp_path / "shaft.csv", SHAFT)
    write_csv(tmp_path / "b.csv", TABLE)

    def read(text):
        (tmp_path / "rotor.toml").write_text('shaft = "shaft.csv"\n' + text, encoding="utf-8")
        return read_rotor(tmp_path / "rotor.toml")

    read.folder = tmp_path
    return read


def bearing(*lines, kind="bearing"):
    return "\n".join([f"[[{kind}]]", "node = 2", *lines])


def the_support(file, *lines, kind="bearing"):
    (support,) = file(bearing(*lines, kind=kind)).supports
    return support


def test_model_and_material(file):
    rotor = file("[model]\nshear = true\ngyroscopic = true\n[material]\nmaterial_damping_s = 2e-5")
    assert rotor.model == Model(shear=True, gyroscopic=True)
    assert rotor.material_damping.tolist() == [2e-5] * 3
    assert rotor.poisson_ratio.tolist() == [0.3] * 3


def test_properties_of_single_elements(file):
    write_csv(
        file.folder / "shaft.csv",
        [[*SHAFT[0], "poisson_ratio", "material_damping_ms"], *([*row, 0.25, 0.5] for row in SHAFT[1:])],
    )
    rotor = file("")
    assert rotor.poisson_ratio.tolist() == [0.25] * 3
    assert rotor.material_damping.tolist() == [5e-4] * 3


def test_a_disc_by_its_geometry(file):
    text = "[[disc]]\nnode = 2\nwidth_m = 0.05\nouter_diameter_m = 0.4\n"
    assert file(text).discs == (Disc.from_geometry(2, 0.05, 0.4, density=7800),)
    # The material of the file unless the disc says another.
    light = "[material]\ndensity_kg_per_m3 = 2700\n" + text
    assert file(light).discs == (Disc.from_geometry(2, 0.05, 0.4, density=2700),)
    more = light + 'inner_diameter_m = 0.1\ndensity_kg_per_m3 = 8000\nname = "wheel"'
    assert file(more).discs == (Disc.from_geometry(2, 0.05, 0.4, 0.1, 8000, "wheel"),)


def test_coefficients_with_and_without_units(file):
    matrix = ((1e7, 2e6), (-1e6, 3e7))
    spelt = ("kxx_N_per_m = 1e7", "kxy_N_per_m = 2e6", "kyx_N_per_m = -1e6", "kyy_N_per_m = 3e7")
    bare = tuple(line.replace("_N_per_m", "") for line in spelt)
    damping = ("cxx_N_s_per_m = 10", "cyy = 20")
    assert the_support(file, *spelt) == Support(2, matrix)
    assert the_support(file, *bare, *damping) == Support(2, matrix, ((10, 0), (0, 20)))
    assert the_support(file, *bare, "damping_N_s_per_m = 5") == Support(2, matrix, 5.0)
    assert the_support(file, "kxx = 1e7", "kyy = 3e7") == Support(2, ((1e7, 0), (0, 3e7)))
    assert the_support(file, "kxx = 1e7", "kyy = 1e7") == Support(2, 1e7)


def test_coefficients_over_speed(file):
    k = (((1e7, 2e6), (0, 3e7)), ((2e7, 1e6), (0, 4e7)))
    c = (((1e4, 0), (0, 2e4)), ((5e3, 0), (0, 1e4)))
    expected = Support(2, k, c, "DE", speeds=(100, 200))
    assert the_support(file, 'table = "b.csv"', 'name = "DE"') == expected
    assert the_support(file, 'table = "b.csv"', 'name = "DE"').at(150.0)[0].tolist() == [
        [1.5e7, 1.5e6],
        [0, 3.5e7],
    ]
    write_csv(file.folder / "s.csv", [["speed_rpm", "stiffness_N_per_mm"], [60, 1e4], [120, 2e4]])
    scalar = the_support(file, 'table = "s.csv"', "damping_N_s_per_m = 7")
    assert scalar.stiffness == (1e7, 2e7)
    assert scalar.damping == (7.0, 7.0)
    assert scalar.speeds == pytest.approx((2 * math.pi, 4 * math.pi), rel=1e-15)
    write_book(file.folder / "b.xlsx", {"bearing": TABLE})
    assert the_support(file, 'table = "b.xlsx"', 'name = "DE"') == expected


def test_a_pedestal_a_tilting_stiffness_and_a_seal(file):
    stand = (
        "pedestal_mass_kg = 50",
        "pedestal_stiffness_N_per_m = [1e8, 2e8]",
        "pedestal_damping_N_s_per_m = 9",
    )
    assert the_support(file, "stiffness_N_per_m = 1e7", *stand) == Support(
        2, 1e7, pedestal=Pedestal(50, (1e8, 2e8), 9)
    )
    tilting = the_support(file, "stiffness_N_per_m = 1e7", "tilting_stiffness_N_m_per_rad = 3e5")
    assert tilting == Support(2, 1e7, tilting_stiffness=3e5)
    seal = the_support(file, "stiffness_N_per_m = -1e5", "damping_N_s_per_m = 10", kind="seal")
    assert seal == Support(2, -1e5, 10, kind="seal")


def test_files_of_a_rotor_with_tables(file):
    text = bearing('table = "b.csv"') + "\n" + bearing('table = "b.csv"', kind="seal")
    assert [support.kind for support in file(text).supports] == ["bearing", "seal"]
    assert [path.name for path in rotor_files(file.folder / "rotor.toml")] == [
        "rotor.toml",
        "shaft.csv",
        "b.csv",
    ]


SCALAR = "stiffness_N_per_m = 1e7"
BAD_BEARINGS = [
    ((SCALAR, "kxx = 1e7", "kyy = 1e7"), "", None, "either stiffness_N_per_m, or both kxx_N_per_m"),
    ((SCALAR, "damping_N_s_per_m = 1", "cxx = 3", "cyy = 3"), "", None, "or both cxx_N_s_per_m"),
    (("kxx = 1e7",), "", None, "or both kxx_N_per_m and kyy_N_per_m"),
    (("kxx = 1e7", "kyy = 1e7", "cxy = 3", "cyy = 3"), "", None, "or both cxx_N_s_per_m and cyy_N_s_per_m"),
    (("kxx = 1e7", "kyy = 1e7", "kxx_N_per_m = 1e7"), "kxx_N_per_m", "10000000.0", "kxx says it already"),
    ((SCALAR, "pedestal_mass_kg = 3"), "pedestal_stiffness_N_per_m", None, "the stiffness of the pedestal"),
    ((SCALAR, "pedestal_stiffness_N_per_m = [1, 2, 3]"), "pedestal_stiffness_N_per_m", "[1, 2, 3]", "[x, y]"),
    ((SCALAR, "pedestal_stiffness_N_per_m = [1, nan]"), "pedestal_stiffness_N_per_m", "nan", "finite"),
    ((SCALAR, "pedestal_stiffness_N_per_m = 0"), "", None, "leave out a rigid pedestal"),
    ((SCALAR, "tilting_stiffness_N_m_per_rad = -1"), "tilting_stiffness_N_m_per_rad", "-1", "0 or more"),
    (("tilting_stiffness_N_m_per_rad = 3",), "", None, "its stiffness is missing, or its damping"),
    (("kxx = -5e7", "kyy = 5e7"), "kxx", "-50000000.0", "a finite number, 0 or more"),
    ((SCALAR, "cxx = 1", "cyy_N_s_per_m = -1"), "cyy_N_s_per_m", "-1", "a finite number, 0 or more"),
    (('table = "b.csv"', SCALAR), "", None, "either stiffness_N_per_m, or both"),
    (('table = "b.csv"', "kxx = 3"), "", None, "kxx_N_per_m once: "),
]  # fmt: skip


@pytest.mark.parametrize(("lines", "key", "value", "words"), BAD_BEARINGS)
def test_bad_bearings(file, lines, key, value, words):
    (problem,) = complaints(file, bearing(*lines))
    assert problem.file.endswith("rotor.toml")
    assert (problem.column, problem.value) == (f"bearing[1].{key}".strip("."), value)
    assert words in problem.expected


BAD_TABLES = [
    (replaced(TABLE, 3, "speed_rad_s", 100), 3, "speed_rad_s", "100", "ascending, each once"),
    (replaced(TABLE, 3, "speed_rad_s", 50), 3, "speed_rad_s", "50", "above that of the row before"),
    (replaced(TABLE, 2, "speed_rad_s", -1), 2, "speed_rad_s", "-1", "a speed of 0 or more"),
    (replaced(TABLE, 1, "kxx_N_per_m", "kxx"), 1, "kxx", "kxx", "one of the units N_per_m, "),
    ([row[1:] for row in TABLE], 1, "speed_rpm", None, "a column speed_rpm, speed_rad_s or speed_Hz"),
]  # fmt: skip


@pytest.mark.parametrize(("table", "row", "column", "value", "words"), BAD_TABLES)
def test_bad_tables_of_bearings(file, table, row, column, value, words):
    write_csv(file.folder / "b.csv", table)
    the_only(complaints(file, bearing('table = "b.csv"')), "b.csv", row, column, value, words)


def test_a_table_of_one_speed_or_of_none_at_all(file):
    write_csv(file.folder / "b.csv", TABLE[:2])
    problems = complaints(file, bearing('table = "b.csv"'))
    the_only(problems, "b.csv", 2, "speed_rad_s", str(TABLE[1][TABLE[0].index("speed_rad_s")]), "two speeds")
    problems = complaints(file, bearing('table = "c.csv"'))
    the_only(problems, "c.csv", None, None, None, "did you mean 'b.csv'?")
    write_csv(file.folder / "b.csv", [row[:1] for row in TABLE])
    problems = complaints(file, bearing('table = "b.csv"'))
    the_only(
        problems, "rotor.toml", None, "bearing[1]", None, "its stiffness is missing, or its damping, here"
    )


def test_a_negative_stiffness_is_for_seals(file):
    table = [["speed_Hz", "stiffness_N_per_m"], [1, -1e5], [2, -2e5]]
    write_csv(file.folder / "s.csv", table)
    seal = the_support(file, 'table = "s.csv"', kind="seal")
    assert seal.stiffness == (-1e5, -2e5)
    problems = complaints(file, bearing('table = "s.csv"'))
    assert [p.row for p in problems] == [2, 3]
    assert all("[[seal]]" in p.expected for p in problems)
    write_csv(
        file.folder / "s.csv", [["speed_Hz", "kxx_N_per_m", "kyy_N_per_m"], [1, 1e5, 1e5], [2, 1e5, -1]]
    )
    assert the_support(file, 'table = "s.csv"', kind="seal").stiffness == (1e5, ((1e5, 0.0), (0.0, -1.0)))
    (problem,) = complaints(file, bearing('table = "s.csv"'))
    assert (problem.row, problem.column) == (3, "kyy_N_per_m")
    assert "[[seal]]" in problem.expected
    assert the_support(file, "kxx = -1", "kyy = -2", kind="seal").stiffness == ((-1.0, 0.0), (0.0, -2.0))


def test_dampers_and_cross_coupling_alone_are_supports(file):
    assert the_support(file, "damping_N_s_per_m = 3").damping == 3
    seal = the_support(file, "cxx = 3", "cyy = 4", kind="seal")
    assert (seal.stiffness, seal.damping) == (0.0, ((3.0, 0.0), (0.0, 4.0)))
    seal = the_support(file, "kxy = 1e6", "kyx = -1e6", kind="seal")
    assert (seal.stiffness, seal.damping) == (((0.0, 1e6), (-1e6, 0.0)), 0.0)
    write_csv(file.folder / "d.csv", [["speed_Hz", "damping_N_s_per_m"], [1, 5], [2, 6]])
    assert the_support(file, 'table = "d.csv"').damping == (5.0, 6.0)


@pytest.mark.parametrize("name", ["disc:a", "left, right"])
def test_names_that_a_command_line_would_take_apart_are_refused(file, name):
    (problem,) = complaints(file, f'[[station]]\nname = "{name}"\nnode = 2\n{bearing(SCALAR)}')
    assert problem.value == name
    assert "without ':' and ','" in problem.expected


BAD_DISCS = [
    ("mass_kg = 3\nwidth_m = 1", "mass_kg", "3", "either the mass of the disc or its geometry"),
    ("width_m = 1", "width_m", "1", "the disc's width and outer diameter"),
    (
        "width_m = 1\nouter_diameter_m = 2\npolar_inertia_kg_m2 = 1",
        "polar_inertia_kg_m2",
        "1",
        "beside the geom",
    ),
    ("width_m = 0\nouter_diameter_m = 1", "width_m", "0", "a number above 0"),
    ("mass_kg = 3\npolar_inertia_kg_m2 = nan", "polar_inertia_kg_m2", "nan", "a finite number"),
    ("mass_kg = 3\nmas = 1", "mas", "1", "did you mean 'mass_kg'?"),
]


@pytest.mark.parametrize(("lines", "key", "value", "words"), BAD_DISCS)
def test_bad_discs(file, lines, key, value, words):
    problems = complaints(file, f"[[disc]]\nnode = 2\n{lines}")
    the_only(problems, "rotor.toml", None, f"disc[1].{key}", value, words)


def test_a_disc_with_too_large_a_bore(file):
    problems = complaints(
        file, "[[disc]]\nnode = 2\nwidth_m = 1\nouter_diameter_m = 0.1\ninner_diameter_m = 0.2"
    )
    the_only(
        problems, "rotor.toml", None, "disc[1]", None, "a possible disc: disc at node 2: the inner diameter"
    )


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


def test_names_that_would_not_come_back_are_refused(tmp_path):
    with pytest.raises(ValueError, match=r"key station.1..name: found '12', expected a name, not a number"):
        write_rotor(tmp_path / "r.toml", Rotor([1.0], 0.1, stations={"12": 1}))
    with pytest.raises(ValueError, match=r"would not come back from its file: .*surrogates not allowed"):
        write_rotor(tmp_path / "r.toml", Rotor([1.0], 0.1, discs=[Disc(1, 2, name="\ud800")]))
    with pytest.raises(ValueError, match=r"r_shaft.csv, row 2, column length_m: found '1e-31'"):
        write_rotor(tmp_path / "r.toml", Rotor([1e-31], 0.1))
    with pytest.raises(InputError, match=r"ends in \.toml"):
        write_rotor(tmp_path / "r.txt", Rotor([1.0], 0.1))
    assert list(tmp_path.iterdir()) == []


def test_all_files_or_none(tmp_path):
    old, new = Rotor([1.0], 0.1), Rotor([2.0], 0.2, supports=[Support(1, (1, 2), speeds=(1, 2))])
    write_rotor(tmp_path / "r.toml", old)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    (tmp_path / "r_bearing_1.csv").mkdir()  # what stands in the way of the last but one
    (tmp_path / "r_bearing_1.csv" / "x").touch()
    with pytest.raises(InputError, match=r"r_bearing_1\.csv: expected a file that can be written"):
        write_rotor(tmp_path / "r.toml", new)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()} == before
    with pytest.raises(InputError, match="a file that can be written"):
        write_rotor(tmp_path / "no" / "r.toml", new)


def test_a_small_model_is_no_rotor_and_said_so_once():
    (found,) = complaints(read_rotor, sample_data() / "motion" / "small.toml")
    assert "this is a small model, for `rotorid motion`" in str(found)


def test_a_ratio_without_shear_comes_back(tmp_path):
    bare = Rotor([0.1, 1 / 3], [0.05, 0.07], poisson_ratio=0.25, material_damping=1e-5)
    write_rotor(tmp_path / "bare.toml", bare)
    assert read_rotor(tmp_path / "bare.toml") == bare


@pytest.mark.parametrize(
    ("material", "model", "shear"),
    [
        ("", "", False),
        ("poisson_ratio = 0.29", "", True),
        ("poisson_ratio = 0.29", "shear = false", False),
        ("", "shear = true", True),
    ],
)
def test_shear_is_counted_where_the_ratio_is_given_and_nothing_else_is_written(
    tmp_path, material, model, shear
):
    (tmp_path / "s.csv").write_text("length_m,diameter_m\n0.5,0.05\n0.5,0.05\n")
    text = f'shaft = "s.csv"\n[material]\n{material}\n[model]\n{model}\n'
    (tmp_path / "r.toml").write_text(text)
    assert read_rotor(tmp_path / "r.toml").model.shear is shear
