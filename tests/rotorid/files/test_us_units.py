"""US units of rotor tables and rotor files, and blank cells of optional columns, in text and in workbooks."""

from __future__ import annotations

import csv

import numpy as np
import openpyxl
import pytest

from rotorid.commands.option_quantities import mass
from rotorid.files import InputError, read_rotor

INCH, POUND, FORCE = 0.0254, 0.45359237, 4.4482216152605
TABLE = """\
length_in,diameter_in,inner_diameter_in,mass_lb,polar_inertia_lb_in2,support_stiffness_lbf_per_in,\
support_damping_lbf_s_per_in,youngs_modulus_psi,density_lb_per_in3
10,2,,,,1e5,50,,
12,2.5,1,20,90,,,30e6,0.283
0,,,,,1e5,50,,
"""


def written(folder, form, text=TABLE):
    if form == "csv":
        (folder / "rotor.csv").write_text(text)
        return folder / "rotor.csv"
    book = openpyxl.Workbook()
    for row in csv.reader(text.splitlines()):
        cells = [float(cell) if cell[:1].isdigit() else cell for cell in row]
        book.active.append([cell if cell != "" else None for cell in cells])
    book.save(folder / "rotor.xlsx")
    return folder / "rotor.xlsx"


@pytest.mark.parametrize("form", ["csv", "xlsx"])
def test_a_rotor_table_in_us_units_with_blank_cells(tmp_path, form):
    rotor = read_rotor(written(tmp_path, form))
    np.testing.assert_allclose(rotor.length, [10 * INCH, 12 * INCH], rtol=1e-14)
    np.testing.assert_allclose(rotor.outer_diameter, [2 * INCH, 2.5 * INCH], rtol=1e-14)
    np.testing.assert_allclose(rotor.inner_diameter, [0, INCH], rtol=1e-14)
    np.testing.assert_allclose(rotor.youngs_modulus, [2.1e11, 30e6 * FORCE / INCH**2], rtol=1e-14)
    np.testing.assert_allclose(rotor.density, [7800, 0.283 * POUND / INCH**3], rtol=1e-14)
    [disc] = rotor.discs
    np.testing.assert_allclose(
        [disc.mass, disc.polar_inertia], [20 * POUND, 90 * POUND * INCH**2], rtol=1e-14
    )
    assert [support.node for support in rotor.supports] == [1, 3]
    np.testing.assert_allclose(rotor.supports[0].stiffness, 1e5 * FORCE / INCH, rtol=1e-14)
    np.testing.assert_allclose(rotor.supports[0].damping, 50 * FORCE / INCH, rtol=1e-14)


FILE = """\
shaft = "shaft.csv"
[material]
youngs_modulus_psi = 30e6
density_lb_per_in3 = 0.283
[[disc]]
node = 2
mass_lb = 20
polar_inertia_lb_in2 = 90
[[disc]]
node = 2
width_in = 1
outer_diameter_in = 8
[[bearing]]
node = 1
kxx_lbf_per_in = 1e5
kyy_lbf_per_in = 2e5
damping_lbf_s_per_in = 50
pedestal_mass_lb = 100
pedestal_stiffness_lbf_per_in = [1e6, 2e6]
[[bearing]]
node = 3
table = "b.csv"
[[cubic_spring]]
node = 2
cubic_stiffness_lbf_per_in3 = 2e3
"""


def read_file(folder, text):
    (folder / "shaft.csv").write_text("length_in,diameter_in\n10,2\n12,2\n")
    (folder / "b.csv").write_text("speed_rpm,kxx_lbf_per_in,kyy_lbf_per_in\n0,1e5,2e5\n9000,2e5,2e5\n")
    (folder / "rotor.toml").write_text(text)
    return read_rotor(folder / "rotor.toml")


def test_a_rotor_file_in_us_units(tmp_path):
    rotor = read_file(tmp_path, FILE)
    density = 0.283 * POUND / INCH**3
    np.testing.assert_allclose(rotor.youngs_modulus, 30e6 * FORCE / INCH**2, rtol=1e-14)
    np.testing.assert_allclose(rotor.density, density, rtol=1e-14)
    by_inertia, by_geometry = rotor.discs
    np.testing.assert_allclose(by_inertia.polar_inertia, 90 * POUND * INCH**2, rtol=1e-14)
    np.testing.assert_allclose(by_geometry.mass, density * INCH * np.pi * (4 * INCH) ** 2, rtol=1e-12)
    first, second = rotor.supports
    np.testing.assert_allclose(np.diag(first.stiffness), np.array([1e5, 2e5]) * FORCE / INCH, rtol=1e-14)
    np.testing.assert_allclose(first.damping, 50 * FORCE / INCH, rtol=1e-14)
    np.testing.assert_allclose(first.pedestal.stiffness, np.array([1e6, 2e6]) * FORCE / INCH, rtol=1e-14)
    k = [[[1e5, 0], [0, 2e5]], [[2e5, 0], [0, 2e5]]]
    np.testing.assert_allclose(second.table[0], np.array(k) * FORCE / INCH, rtol=1e-14)
    np.testing.assert_allclose(rotor.forces[0].cubic_stiffness, 2e3 * FORCE / INCH**3, rtol=1e-14)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("mass_lb = 20", "mass_lb = -20", "key disc[1].mass_lb: found '-20', expected a number of 0 or more"),
        ("mass_lb = 20", "mass_lb = 20\nmass_kg = 9", "key disc[1].mass_kg: found '9', expected one key"),
        ("width_in = 1", 'width_in = "wide"', "key disc[2].width_in: found 'wide', expected a number"),
        ("kxx_lbf_per_in = 1e5", "kxx_lbf_per_in = -1e5", "key bearing[1].kxx_lbf_per_in: found '-100000.0'"),
        ("kyy_lbf_per_in", "kyy_lbf_in", "key bearing[1].kyy_lbf_in"),
    ],
)
def test_messages_name_the_key_as_it_is_written(tmp_path, old, new, words):
    with pytest.raises(InputError) as caught:
        read_file(tmp_path, FILE.replace(old, new, 1))
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("text", "si"), [("1000lbs", 1000 * POUND), ("1000 lb", 1000 * POUND), ("5oz", POUND * 5 / 16)]
)
def test_a_mass_in_pounds_of_an_option(text, si):
    assert mass(text, "--mass") == pytest.approx(si, rel=1e-14)
