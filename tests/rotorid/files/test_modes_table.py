"""Tables of measured modes and of compliances: what they mean, and every complaint."""

import math

import numpy as np
import pytest
from cases import each_of
from tables_data import complaints, replaced, the_only, write_book, write_csv

import fem
from rotorid.files.modes import read_compliance, read_modes

MODES = [
    ["mode", "frequency_rad_s", "node", "shape"],
    [1, 135.2, 7, 1.0],
    [1, "", 12, 1.46],
    [1, "", 18, 1.02],
    [2, 540.7, 7, 1.0],
    [2, 540.7, 12, 0.12],
    [2, "", 18, -1.047],
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
ROTOR = fem.Rotor(
    [0.1] * 20, 0.1, supports=[fem.Support(2, 1e8), fem.Support(20, 1e8)], stations={"wheel": 12, "fan": 18}
)


def modes_of(tmp_path, table, **options):
    return read_modes(write_csv(tmp_path / "modes.csv", table), **options)


def compliance_of(tmp_path, table, *arguments, **options):
    return read_compliance(write_csv(tmp_path / "alpha.csv", table), *arguments, **options)


def bad_modes(tmp_path, table, **options):
    return complaints(read_modes, write_csv(tmp_path / "modes.csv", table), **options)


def bad_compliance(tmp_path, table, *arguments, **options):
    return complaints(read_compliance, write_csv(tmp_path / "alpha.csv", table), *arguments, **options)


def test_modes_are_read(tmp_path):
    found = modes_of(tmp_path, MODES)
    assert found.nodes == (7, 12, 18)
    assert found.frequencies.tolist() == [135.2, 540.7]
    assert found.shapes.tolist() == [[1, 1], [1.46, 0.12], [1.02, -1.047]]
    assert found.frequency_std is None
    assert found.shape_std is None


@pytest.mark.parametrize(
    ("name", "factor"),
    [
        ("frequency_rad_s", 1.0),
        ("frequency_Hz", 2 * math.pi),
        ("frequency_rpm", math.pi / 30),
        ("speed_rpm", math.pi / 30),
    ],
)
def test_units_of_frequency(tmp_path, name, factor):
    found = modes_of(tmp_path, replaced(MODES, 1, "frequency_rad_s", name))
    np.testing.assert_allclose(found.frequencies, [135.2 * factor, 540.7 * factor], rtol=1e-15)


def test_standard_deviations_are_relative(tmp_path):
    head = [*MODES[0], "frequency_std_percent", "shape_std_percent"]
    stds = [[0.5, 1], ["", 2], ["", 3], [0.25, 4], [0.25, 5], ["", 0]]
    found = modes_of(tmp_path, [head, *(row + std for row, std in zip(MODES[1:], stds, strict=True))])
    np.testing.assert_allclose(found.frequency_std, [0.005, 0.0025])
    np.testing.assert_allclose(found.shape_std, [[0.01, 0.04], [0.02, 0.05], [0.03, 0.0]])


def test_names_of_stations_are_nodes_of_the_rotor(tmp_path):
    named = [[{12: "wheel", 18: "fan"}.get(cell, cell) for cell in row] for row in MODES]
    assert modes_of(tmp_path, named, rotor=ROTOR).nodes == (7, 12, 18)
    assert modes_of(tmp_path, named).nodes == (7, "wheel", "fan")
    both = [*named, [1, "", 12, 1.46]]  # the wheel again, by its number
    the_only(
        bad_modes(tmp_path, both, rotor=ROTOR), "modes.csv", 8, "node", "12", "another node than in row 3"
    )


def test_a_workbook_holds_both_tables(tmp_path):
    path = write_book(tmp_path / "book.xlsx", {"compliance": COMPLIANCE, "modes": MODES})
    modes = read_modes(path)
    assert modes.nodes == (7, 12, 18)
    assert modes.frequencies.tolist() == [135.2, 540.7]
    nodes, alpha = read_compliance(path, modes.nodes)
    assert nodes == (7, 12, 18)
    np.testing.assert_allclose(alpha, ALPHA, rtol=1e-15)


@each_of(
    ("row", "column", "value", "words"),
    [
        (2, "mode", 1.5, "a mode number: 1, 2"),
        (2, "mode", 0, "a mode number"),
        (2, "mode", "", "a number"),
        (2, "mode", "first", "a number"),
        (2, "frequency_rad_s", "", "a number in the first row of mode 1"),
        (2, "frequency_rad_s", 0, "a frequency above 0"),
        (2, "frequency_rad_s", "nan", "a finite number"),
        (3, "frequency_rad_s", 135.3, "135.2 as in row 2, the same mode, or a blank"),
        (4, "node", "", "a name"),
        (4, "shape", "", "a number"),
        (4, "shape", "NaN", "a finite number"),
        (4, "shape", "1 mm", "unit in the header"),
    ],
)
def test_a_cell_that_does_not_fit(tmp_path, row, column, value, words):
    problems = bad_modes(tmp_path, replaced(MODES, row, column, value))
    the_only(problems, "modes.csv", row, column, str(value), words)


def test_a_node_twice_in_a_mode(tmp_path):
    problems = bad_modes(tmp_path, [*MODES, [2, "", 12, 0.12]])
    the_only(problems, "modes.csv", 8, "node", "12", "another node than in row 6")


def test_frequencies_ascend_with_the_mode(tmp_path):
    lower = replaced(replaced(MODES, 5, "frequency_rad_s", 135.2), 6, "frequency_rad_s", "")
    words = "above that of the mode before (135.2 in row 2): modes are numbered from the lowest"
    the_only(bad_modes(tmp_path, lower), "modes.csv", 5, "frequency_rad_s", "135.2", words)


def test_modes_have_no_gap(tmp_path):
    third = [MODES[0], *([3 if row[0] == 2 else row[0], *row[1:]] for row in MODES[1:])]
    the_only(bad_modes(tmp_path, third), "modes.csv", 5, "mode", "3", "there is no mode 2")


def test_every_mode_has_the_same_nodes(tmp_path):
    problem = the_only(bad_modes(tmp_path, MODES[:-1]), "modes.csv", 6, "node", None, "mode 2 at node 18 too")
    assert "same nodes" in problem.expected
    more = [*MODES, [2, "", 20, 0.1]]
    the_only(bad_modes(tmp_path, more), "modes.csv", 4, "node", None, "mode 1 at node 20 too")


def test_a_shape_of_zeros_is_none(tmp_path):
    still = MODES
    for row in (5, 6, 7):
        still = replaced(still, row, "shape", 0)
    the_only(bad_modes(tmp_path, still), "modes.csv", 5, "shape", "0", "not 0 at every node")


@pytest.mark.parametrize(
    ("column", "value", "words"),
    [
        ("frequency_std_percent", -1, "of 0 or more"),
        ("frequency_std_percent", "", "a number in the first row of mode 1"),
        ("shape_std_percent", -1, "of 0 or more"),
        ("shape_std_percent", "", "a number"),
    ],
)
def test_standard_deviations_that_do_not_fit(tmp_path, column, value, words):
    first = column.startswith("frequency")
    table = [[*MODES[0], column], *([*row, "" if first and row[2] != 7 else 1.0] for row in MODES[1:])]
    table = replaced(table, 2, column, value)
    the_only(bad_modes(tmp_path, table), "modes.csv", 2, column, str(value), words)


def test_standard_deviations_of_one_frequency_agree(tmp_path):
    table = [[*MODES[0], "frequency_std_percent"], *([*row, 1.0] for row in MODES[1:])]
    table = replaced(table, 4, "frequency_std_percent", 2.0)
    the_only(bad_modes(tmp_path, table), "modes.csv", 4, "frequency_std_percent", "2.0", "1.0 as in row 2")


@pytest.mark.parametrize(
    ("name", "value", "row", "words"),
    [
        ("node", 30, 2, "a node from 1 to 21 or a station"),
        ("node", "weel", 2, "did you mean 'wheel'?"),
        ("node", "0", 2, "a node from 1 to 21"),
    ],
)
def test_nodes_that_the_rotor_does_not_have(tmp_path, name, value, row, words):
    problems = bad_modes(tmp_path, replaced(MODES, row, name, value), rotor=ROTOR)
    the_only(problems, "modes.csv", row, name, str(value), words)


def test_two_columns_of_frequency(tmp_path):
    table = [[*MODES[0], "speed_rpm"], *([*row, 1291] for row in MODES[1:])]
    the_only(bad_modes(tmp_path, table), "modes.csv", 1, "speed_rpm", None, "one column")


def test_compliances_are_read(tmp_path):
    nodes, alpha = compliance_of(tmp_path, COMPLIANCE)
    assert nodes == (7, 12, 18)
    np.testing.assert_allclose(alpha, ALPHA, rtol=1e-15)
    nodes, alpha = compliance_of(tmp_path, COMPLIANCE, (18, 7, 12))
    assert nodes == (18, 7, 12)
    order = [2, 0, 1]
    np.testing.assert_allclose(alpha, ALPHA[np.ix_(order, order)], rtol=1e-15)


@pytest.mark.parametrize(("unit", "factor"), [("mm_per_N", 1e3), ("um_per_N", 1e6)])
def test_units_of_compliance(tmp_path, unit, factor):
    table = [[a, b, value * factor] for a, b, value in COMPLIANCE[1:]]
    _, alpha = compliance_of(tmp_path, [["node", "force_node", f"compliance_{unit}"], *table])
    np.testing.assert_allclose(alpha, ALPHA, rtol=1e-15)


def test_stations_and_labels(tmp_path):
    named = [[{12: "wheel"}.get(cell, cell) for cell in row] for row in COMPLIANCE]
    assert compliance_of(tmp_path, named, rotor=ROTOR)[0] == (7, 12, 18)
    assert compliance_of(tmp_path, named)[0] == (7, "wheel", 18)
    problems = bad_compliance(tmp_path, replaced(COMPLIANCE, 3, "force_node", "wheal"), rotor=ROTOR)
    the_only(problems, "alpha.csv", 3, "force_node", "wheal", "did you mean 'wheel'?")


def test_both_entries_of_a_pair_agree_to_a_thousandth(tmp_path):
    _, alpha = compliance_of(tmp_path, [*COMPLIANCE, [12, 7, 11.21e-8]])
    assert alpha[0, 1] == alpha[1, 0] == pytest.approx(11.205e-8, rel=1e-14)
    compliance_of(tmp_path, [*COMPLIANCE, [12, 7, 11.19e-8]])
    for other in (11.22e-8, 11.18e-8):
        problem = the_only(
            bad_compliance(tmp_path, [*COMPLIANCE, [12, 7, other]]),
            "alpha.csv",
            8,
            "compliance_m_per_N",
            repr(other),
            "1.12e-07 to 0.1 %, as in row 3",
        )
        assert "a force at node 12 moves node 7" in problem.expected


def test_a_pair_twice(tmp_path):
    problems = bad_compliance(tmp_path, [*COMPLIANCE, [7, 12, 11.2e-8]])
    the_only(problems, "alpha.csv", 8, "force_node", "12", "another pair of nodes than in row 3")


def test_missing_pairs_are_named(tmp_path):
    less = [row for row in COMPLIANCE if row[:2] not in ([7, 18], [18, 18])]
    words = "missing: 7 with 18 and 18 with 18"
    the_only(bad_compliance(tmp_path, less), "alpha.csv", None, "compliance_m_per_N", None, words)
    problems = bad_compliance(tmp_path, COMPLIANCE, (7, 12, 18, 20))
    words = "missing: 7 with 20, 12 with 20, 18 with 20 and 20 with 20"
    the_only(problems, "alpha.csv", None, "compliance_m_per_N", None, words)


def test_nodes_that_are_not_wanted_are_not_dropped(tmp_path):
    problems = bad_compliance(tmp_path, COMPLIANCE, (7, 12))
    where = [(p.row, p.column, p.value) for p in problems]
    assert where == [
        (4, "force_node", "18"),
        (6, "force_node", "18"),
        (7, "node", "18"),
        (7, "force_node", "18"),
    ]
    assert all("one of the nodes 7 or 12" in p.expected for p in problems)


@pytest.mark.parametrize(
    ("row", "value", "words"),
    [
        (2, -8.92e-8, "above 0: a node moves in the direction of a force"),
        (2, 0, "above 0"),
        (3, "nan", "a finite number"),
        (3, "", "a number"),
        (3, "inf", "a finite number"),
    ],
)
def test_a_compliance_that_does_not_fit(tmp_path, row, value, words):
    problems = bad_compliance(tmp_path, replaced(COMPLIANCE, row, "compliance_m_per_N", value))
    the_only(problems, "alpha.csv", row, "compliance_m_per_N", str(value), words)


def test_compliances_of_no_shaft_are_refused(tmp_path):
    wrong = replaced(COMPLIANCE, 5, "compliance_m_per_N", 9.35e-8)  # as [S] misprints α22
    words = "positive definite matrix"
    the_only(bad_compliance(tmp_path, wrong), "alpha.csv", None, "compliance_m_per_N", None, words)
    unlikely = replaced(COMPLIANCE, 4, "compliance_m_per_N", 1e-8)  # every pair possible, the three not
    the_only(bad_compliance(tmp_path, unlikely), "alpha.csv", None, "compliance_m_per_N", None, words)
    close = [
        COMPLIANCE[0],
        [7, 7, 1e-7],
        [7, 8, 1.001e-7],
        [8, 8, 1.002e-7],
        [7, 9, 1.0e-7],
        [8, 9, 1.001e-7],
    ]
    problems = bad_compliance(tmp_path, [*close, [9, 9, 1.0005e-7]])
    the_only(problems, "alpha.csv", None, "compliance_m_per_N", None, "positive definite")


def test_rows_in_any_order_give_the_same(tmp_path):
    """Frequencies stand in the first row of a mode; a pair is named either way round."""
    found = modes_of(tmp_path, [MODES[0], *MODES[4:], *MODES[1:4]])
    order = [(7, 12, 18).index(node) for node in found.nodes]
    assert found.frequencies.tolist() == [135.2, 540.7]
    np.testing.assert_array_equal(found.shapes, modes_of(tmp_path, MODES).shapes[order])
    turned = [COMPLIANCE[0], *([b, a, x] for a, b, x in COMPLIANCE[:0:-1])]
    np.testing.assert_allclose(compliance_of(tmp_path, turned, (7, 12, 18))[1], ALPHA, rtol=1e-15)
