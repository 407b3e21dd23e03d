"""Sheets of critical, response and reduce: the document's numbers, the rotor's data, nothing from outside."""

import numpy as np
import pytest
from sheets import COMMANDS, ESTIMATES, Shown, disagreement, disagreements, make, read_sheet, rows_of, run

import fem
from rotorid.base.tables import evenly
from rotorid.commands import CriticalOptions, critical
from rotorid.report.number_tables import every_warning
from rotorid.report.rotor_description import rotor_sheet, unbalance_table
from rotorid.samples import sample_data
from rotorid.tables import read_rotor

MINE = [name for name in COMMANDS if not name.startswith("balance") and name not in ESTIMATES]


@pytest.mark.parametrize("name", MINE)
def test_the_sheet_holds_the_printed_document_and_shows_its_numbers(name):
    made = make(name)
    sheet = read_sheet(made.html)
    assert sheet.document == made.document
    assert len(sheet.shown) > 20
    assert disagreements(sheet.shown, sheet.document) == []


@pytest.mark.parametrize("name", MINE)
def test_nothing_from_outside_and_ids_once(name):
    sheet = read_sheet(make(name).html)
    assert not [r for r in sheet.references if not r.startswith(("#", "data:"))]
    assert sheet.text.replace('xmlns="http://www.w3.org/2000/svg"', "").count("http") == 0
    assert len(sheet.ids) == len(set(sheet.ids))
    assert [tag for tag, *_ in sheet.order].count("script") == 1


def test_every_critical_speed_and_shape_is_shown():
    sheet = read_sheet(make("critical table").html)
    count, nodes = len(sheet.document["mode_shapes"]), len(sheet.document["positions_m"])
    assert (count, nodes) == (5, 24)
    assert {f"mode_shapes.{k}.{i}" for k in range(count) for i in range(nodes)} <= sheet.keys
    for key in ("critical_speeds_rad_s", "critical_speeds_rpm"):
        assert {f"{key}.{k}" for k in range(count)} <= sheet.keys
    hertz = [s for s in sheet.shown if s.key == "critical_speeds_rad_s.0" and s.scale != 1]
    assert float(hertz[0].text) == pytest.approx(135.2404 / (2 * np.pi), abs=1e-4)


def test_the_rotor_is_written_down_as_it_was_read():
    rotor = read_rotor(sample_data() / "compressor" / "rotor.toml")
    sheet = read_sheet(make("critical").html)
    shaft = rows_of(sheet, "Shaft")
    assert len(shaft) == rotor.n_elements
    assert [float(row[2]) for row in shaft] == pytest.approx(1e3 * rotor.length, rel=1e-6)
    assert [float(row[3]) for row in shaft] == pytest.approx(1e3 * rotor.outer_diameter, rel=1e-6)
    discs = {row[1]: row for row in rows_of(sheet, "Discs")}
    for disc in rotor.discs:
        assert int(discs[disc.name][0]) == disc.node
        numbers = [float(cell) for cell in discs[disc.name][2:]]
        assert numbers == pytest.approx([disc.mass, disc.polar_inertia, disc.diametral_inertia], rel=1e-5)
    supports = rows_of(sheet, "Supports")
    assert [row[0].split()[0] for row in supports] == [str(s.node) for s in rotor.supports]
    assert "pedestal 900 kg, 7e+08 and 1.2e+09 N/m (x and y), 20000 N·s/m" in supports[1][4]
    k, _ = rotor.supports[0].at(rotor.supports[0].speeds)
    table = rows_of(sheet, "Stiffness, MN/m: bearing DE, bearing NDE")
    shown = np.array([[float(cell.replace("−", "-")) for cell in row] for row in table])
    assert shown[:, 1:] == pytest.approx(k.reshape(-1, 4) / 1e6, rel=1e-5)
    assert shown[:, 0] == pytest.approx(np.array(rotor.supports[0].speeds) * 30 / np.pi, rel=1e-5)


def test_bores_materials_and_springs_that_differ_get_their_columns():
    rotor = fem.Rotor(
        [0.2, 0.3],
        [0.05, 0.06],
        [0.0, 0.02],
        youngs_modulus=[2.1e11, 7e10],
        discs=[fem.Disc(2, 4.0)],
        supports=[
            fem.Support(1, ((1e6, 2e5), (-2e5, 1e6)), 10.0),
            fem.Support(3, 2e6, tilting_stiffness=50.0),
        ],
    )
    grids = {grid.caption.split(",")[0]: grid for grid in rotor_sheet(rotor).tables}
    assert grids["Shaft"].heads[-2:] == ("bore, mm", "Young's modulus, GPa")
    assert grids["Shaft"].rows[1] == ("2", "0.2", "300", "60", "20", "70")
    assert grids["Discs and masses"].rows == (("2", "4"),)
    first, second = grids["Supports"].rows
    assert first[2:] == ("xx 1e+06, xy 200000, yx -200000, yy 1e+06", "10", "–")
    assert second[2:] == ("2e+06", "0", "tilting 50 N·m/rad")


def test_unbalance_is_printed_in_gram_millimetres_with_the_rotation():
    rotor = fem.Rotor([0.2, 0.3], 0.05, stations={"fan": 2})
    table = unbalance_table(rotor, {3: -2e-5j, 2: 1e-4})
    texts = zip(*(column.texts for column in table.columns), strict=True)
    assert list(texts) == [("2 (fan)", "0.2", "100", "0"), ("3", "0.5", "20", "270")]


def test_the_response_shows_peaks_margins_and_forces():
    sheet = read_sheet(make("response").html)
    peaks = sheet.document["peaks"]
    assert len(peaks) == 6
    for key in ("speed_rpm", "amplification_factor", "separation_margin_percent", "required_margin_percent"):
        assert {f"peaks.{k}.{key}" for k in range(6)} <= sheet.keys
    words = {True: "enough", False: "NOT ENOUGH", None: "–"}
    shown = [row[-1] for row in rows_of(sheet, "peaks of every reading")]
    assert shown == [words[p["enough"]] for p in peaks]
    assert {f"bearing_forces.largest_N.{k}" for k in range(3)} <= sheet.keys
    micro = next(s for s in sheet.shown if s.key == "largest.0.amplitude_m")
    assert float(micro.text) == pytest.approx(1e6 * sheet.document["largest"][0]["amplitude_m"], rel=1e-3)


def test_a_margin_that_is_too_small_is_a_warning(tmp_path):
    folder = sample_data() / "compressor"
    made = run(
        "response", folder / "rotor.toml", "--unbalance", folder / "unbalance.csv", "--speeds",
        "3000:6000:200rpm", "--sensors", "probe DE:45", "--operating", "4600:5600rpm",
        report=tmp_path / "sheet.html",
    )  # fmt: skip
    short = [peak for peak in made.document["peaks"] if peak["enough"] is False]
    first = read_sheet(made.html).text.split("<main>")[1].split("<svg")[0]
    assert short
    assert "NOT far enough" in first
    for peak in short:
        assert f"{peak['speed_rpm']:.6g} rpm" in first


def test_a_free_rotor_has_rigid_body_modes_and_no_supports():
    rotor = fem.Rotor([0.3, 0.3], 0.05, discs=[fem.Disc(2, 3.0)])
    sheet = read_sheet(critical(rotor, CriticalOptions(number=1)).sheet())
    table = rows_of(sheet, "critical speeds")
    assert [row[1] for row in table] == ["rigid body", "rigid body", "forward"]
    assert "<caption>Supports" not in sheet.text


def test_names_are_text_not_markup():
    name = '<img src=x onerror="alert(1)">&'
    rotor = fem.Rotor(
        [0.3, 0.3], 0.05, discs=[fem.Disc(2, 3.0, name=name)], stations={name: 2},
        supports=[fem.Support(1, 1e7, name=name), fem.Support(3, 1e7)],
    )  # fmt: skip
    sheet = read_sheet(critical(rotor, CriticalOptions(number=1)).sheet())
    assert "img" not in [tag for tag, *_ in sheet.order]
    assert sheet.text.count("&lt;img src=x onerror=&#34;alert(1)&#34;&gt;&amp;") >= 3


def test_the_reduction_shows_masses_modes_and_comparisons():
    sheet = read_sheet(make("reduce").html)
    document = sheet.document
    for key in ("masses_kg", "natural_frequencies_rad_s", "rotor_frequencies_rad_s", "relative_error", "mac"):
        assert {f"{key}.{k}" for k in range(3)} <= sheet.keys
    assert {f"compliance_m_per_N.{i}.{j}" for i in range(3) for j in range(3)} <= sheet.keys
    assert {f"uncertainty.masses_std_kg.{k}" for k in range(3)} <= sheet.keys
    assert {f"methods.methods.{m}.mac.2" for m in range(len(document["methods"]["methods"]))} <= sheet.keys
    assert len(document["placement"]["choices"]) == 20
    assert {f"placement.choices.{r}.smallest_mac" for r in range(10)} <= sheet.keys
    assert "no damping acts on either model" in sheet.text
    error = next(s for s in sheet.shown if s.key == "relative_error.2")
    assert float(error.text.replace("−", "-")) == pytest.approx(-8.124, abs=5e-4)


@pytest.mark.parametrize(
    ("text", "value", "scale"),
    [("135.25", 135.2404, 1.0), ("3.2", -3.24e-6, 1e6), ("150", 147.76, 1.0), ("0.1°", 359.96, 1.0),
     ("2.4e-07", 2.46e-7, 1.0), ("0", None, 1.0), ("backward", "forward", 1.0), ("–", 1.0, 1.0)],
)  # fmt: skip
def test_what_disagrees(text, value, scale):
    assert disagreement(Shown("a", text, scale), {"a": value})


def test_warnings_of_parts_are_found_once():
    document = {"warnings": ["a"], "part": {"warnings": ["b", "a"], "deep": {"warnings": ["c"]}}, "n": [1]}
    assert every_warning(document) == ["a", "b", "c"]


def test_a_long_list_is_thinned_evenly():
    assert evenly(3, 12) == [0, 1, 2]
    picked = evenly(281, 12)
    assert (len(picked), picked[0], picked[-1]) == (12, 0, 280)
    assert set(np.diff(picked)) <= {25, 26}


def test_what_the_critical_speeds_leave_out_is_said():
    """The compressor's bearings are damped and coupled: its critical speeds are those without that."""
    rotor = read_rotor(sample_data() / "compressor" / "rotor.toml")
    plain = dict(rotor_sheet(rotor).facts)
    critical = dict(rotor_sheet(rotor, conservative=True).facts)
    reduced = dict(rotor_sheet(rotor, at_rest=True).facts)
    assert plain["Left out"] == "nothing"
    assert critical["Left out"] == "damping, cross-coupling that does work (kxy − kyx)"
    assert reduced["Left out by formula (50)"].startswith("gyroscopic moments, damping, coupling of x and y")
    assert (
        dict(rotor_sheet(read_rotor(sample_data() / "rotor23.csv"), conservative=True).facts)["Left out"]
        == "shear, rotary inertia, gyroscopic moments"
    )
