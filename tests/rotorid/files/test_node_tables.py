"""Tables whose rows stand at nodes: unbalance, bow, modes, compliances."""

import math

import numpy as np
import pytest
from cases import each_of
from tables_data import complaints, replaced, the_only, write_csv

import fem
from rotorid.files import read_bow, read_compliance, read_modes, read_unbalance

MODES = [
    ["mode", "frequency_rad_s", "node", "shape"],
    [1, 135.2, 7, 1.0],
    [1, "", 12, 1.46],
    [1, "", 18, 1.02],
    [2, 540.7, 7, 1.0],
    [2, 540.7, 12, 0.12],
    [2, "", 18, -1.047],
]
STATED = [
    [*MODES[0], "frequency_std_percent", "shape_std_percent"],
    *(
        row + std
        for row, std in zip(
            MODES[1:], [[0.5, 1], ["", 2], [0.5, 3], [0.25, 4], ["", 5], ["", 0]], strict=True
        )
    ),
]
COMPLIANCE = [
    ["node", "force_node", "compliance_m_per_N"],
    [7, 7, 8.92e-8],
    [7, 12, 11.2e-8],
    [7, 18, 6.8e-8],
    [12, 12, 16.4e-8],
    [12, 18, 11.07e-8],
    [18, 18, 9.35e-8],
]
ALPHA = np.array([[8.92, 11.2, 6.8], [11.2, 16.4, 11.07], [6.8, 11.07, 9.35]]) * 1e-8
BOW = [["node", "bow_um", "angle_deg"], ["7", 0, 0], ["wheel", 50, 90], ["18", 20, -180]]
ROTOR = fem.Rotor(
    [0.1] * 20, 0.1, supports=[fem.Support(2, 1e8), fem.Support(20, 1e8)], stations={"wheel": 12, "fan": 18}
)


@pytest.fixture
def read(tmp_path):
    return lambda reader, table, *more: reader(write_csv(tmp_path / "t.csv", table), *more)


def test_unbalance(read):
    header = ["plane", "mass_g", "radius_mm", "angle_deg"]
    found = read(
        read_unbalance, [header, ["wheel", 10, 200, 90], ["7", 3, 100, 0], ["12", 5, 200, 90]], ROTOR
    )
    assert found == {12: pytest.approx(3e-3j), 7: pytest.approx(3e-4)}
    oz = [["plane", "unbalance_oz_in", "angle_rad"], ["fan", 2, math.pi]]
    assert read(read_unbalance, oz, ROTOR) == {18: pytest.approx(-2 * 0.45359237 / 16 * 0.0254)}


def test_a_bow(read):
    bow = read(read_bow, BOW, ROTOR)
    assert [*bow] == [7, 12, 18]
    np.testing.assert_allclose([*bow.values()], [0.0, 5e-5j, -2e-5], atol=1e-20)


@each_of(
    "reader, table, row, column, words",
    [
        (read_bow, BOW[:3], None, "node", "three nodes or more"),
        (read_bow, [*BOW, ["12", 1, 0]], 5, "node", "no other row"),
        (read_unbalance, [["plane", "mass_g", "angle_deg"], [1, 2, 3]], 1, "unbalance_g_mm", "or both mass_"),
    ],
)
def test_what_is_no_bow_or_unbalance(read, reader, table, row, column, words):
    [problem] = complaints(read, reader, table, ROTOR)
    assert (problem.row, problem.column, words in problem.expected) == (row, column, True)


def test_modes(read):
    found = read(read_modes, STATED)
    assert found.nodes == (7, 12, 18)
    assert found.frequencies.tolist() == [135.2, 540.7]
    assert found.shapes.tolist() == [[1, 1], [1.46, 0.12], [1.02, -1.047]]
    np.testing.assert_allclose(found.frequency_std, [0.005, 0.0025])
    np.testing.assert_allclose(found.shape_std, [[0.01, 0.04], [0.02, 0.05], [0.03, 0.0]])
    turned = read(read_modes, [MODES[0], *MODES[4:], *MODES[1:4]])
    assert turned.shapes.tolist() == found.shapes.tolist()
    assert turned.frequency_std is turned.shape_std is None


@each_of("name, factor", [("frequency_Hz", 2 * math.pi), ("critical_speed_rpm", math.pi / 30)])
def test_units_of_frequency(tmp_path, name, factor):
    found = read_modes(write_csv(tmp_path / "t.csv", replaced(MODES, 1, "frequency_rad_s", name)))
    np.testing.assert_allclose(found.frequencies, [135.2 * factor, 540.7 * factor], rtol=1e-15)
    assert found.critical == name.startswith("critical")


def test_names_of_stations_are_nodes_of_the_rotor(read):
    named = [[{12: "wheel", 18: "fan"}.get(cell, cell) for cell in row] for row in MODES]
    assert read(read_modes, named, ROTOR).nodes == (7, 12, 18)
    assert read(read_modes, named).nodes == (7, "wheel", "fan")
    problems = complaints(read, read_modes, [*named, [1, "", 12, 1.46]], ROTOR)
    the_only(problems, "t.csv", 8, "node", "12", "another node than in row 3")


@each_of(
    "row, column, value, words",
    [
        (2, "frequency_rad_s", "", "a number in the first row"),
        (2, "frequency_rad_s", 0, "a frequency above 0"),
        (3, "frequency_rad_s", 135.3, "what stands in the first row of the mode, or a blank"),
        (4, "node", "weel", "did you mean 'wheel'?"),
        (2, "shape_std_percent", "", "a number"),
    ],
)
def test_a_cell_of_a_table_of_modes_that_does_not_fit(read, row, column, value, words):
    problems = complaints(read, read_modes, replaced(STATED, row, column, value), ROTOR)
    the_only(problems, "t.csv", row, column, str(value), words)


@each_of(
    "table, row, column, value, words",
    [
        ([*MODES, [2, "", 12, 0.12]], 8, "node", "12", "another node than in row 6"),
        (
            replaced(replaced(MODES, 5, "frequency_rad_s", 135.2), 6, "frequency_rad_s", ""),
            5,
            "frequency_rad_s",
            "135.2",
            "above that of the mode before",
        ),
        ([*MODES, [2, "", 20, 0.1]], 2, "mode", "1", "the same nodes in every mode; it lacks 20"),
        ([*MODES[:4], *([*row[:3], 0] for row in MODES[4:])], 5, "shape", "0", "not 0 at every node"),
        (
            [[*MODES[0], "critical_speed_rpm"], *([*row, 1291] for row in MODES[1:])],
            1,
            "critical_speed_rpm",
            None,
            "one column",
        ),
    ],
)
def test_modes_that_contradict_each_other(read, table, row, column, value, words):
    the_only(complaints(read, read_modes, table), "t.csv", row, column, value, words)


def test_compliances(read):
    nodes, alpha = read(read_compliance, COMPLIANCE)
    assert nodes == (7, 12, 18)
    np.testing.assert_allclose(alpha, ALPHA, rtol=1e-15)
    turned = [COMPLIANCE[0], *([b, a, x] for a, b, x in COMPLIANCE[:0:-1])]
    nodes, alpha = read(read_compliance, turned, (18, 7, 12))
    assert nodes == (18, 7, 12)
    np.testing.assert_allclose(alpha, ALPHA[np.ix_([2, 0, 1], [2, 0, 1])], rtol=1e-15)
    rows = [[a, b, value * 1e6] for a, b, value in COMPLIANCE[1:]]
    table = [["node", "force_node", "compliance_um_per_N"], *rows]
    np.testing.assert_allclose(read(read_compliance, table)[1], ALPHA, rtol=1e-15)


def test_both_entries_of_a_pair_agree_to_a_thousandth(read):
    _, alpha = read(read_compliance, [*COMPLIANCE, [12, 7, 11.21e-8]])
    assert alpha[0, 1] == alpha[1, 0] == pytest.approx(11.205e-8, rel=1e-14)
    problems = complaints(read, read_compliance, [*COMPLIANCE, [12, 7, 11.22e-8]])
    assert [(p.row, p.value) for p in problems] == [(3, "1.12e-07"), (8, repr(11.22e-8))]


NAME = "compliance_m_per_N"


@each_of(
    "table, nodes, row, column, value, words",
    [
        (COMPLIANCE, (7, 12, 18, 20), None, NAME, None, "missing: 7 with 20, 12 with 20, 18 with 20 and 20"),
        (replaced(COMPLIANCE, 2, NAME, 0), None, 2, NAME, "0", "above 0: a node moves in the direction"),
        # as [S] misprints α22; every pair possible, the three not
        (replaced(COMPLIANCE, 5, NAME, 9.35e-8), None, None, NAME, None, "positive definite matrix"),
    ],
)
def test_compliances_that_are_none(read, table, nodes, row, column, value, words):
    the_only(complaints(read, read_compliance, table, nodes), "t.csv", row, column, value, words)
