"""Numbers and units: strict, and converted once."""

from __future__ import annotations

import math

import pytest
from cases import each_of
from hypothesis import given
from hypothesis import strategies as st

from rotorid.files import units
from rotorid.files.cells import NotANumber, parse_number, thousands_or_decimals
from rotorid.files.problems import InputError, Problem, Problems


@pytest.mark.parametrize(
    ("text", "value"),
    [("1", 1.0), ("-3", -3.0), ("+2.5", 2.5), ("1e3", 1000.0), ("1.5E-2", 0.015), (".5", 0.5), ("5.", 5.0)],
)
def test_plain_numbers(text, value):
    assert parse_number(text) == value
    assert parse_number(text.replace(".", ","), comma=True) == value


@each_of(
    ("text", "words"),
    [
        ("", "a number"),
        ("NaN", "a finite number"),
        ("-Infinity", "a finite number"),
        ("1e999", "a finite number"),
        ("1.#QNAN", "a finite number"),
        ("1 234", "thousands"),
        ("1'234", "thousands"),
        ("2.5 g", "unit in the header"),
        ("−5", "minus sign"),
        ("١", "a number"),
        ("1_000", "a number"),
        (".", "a number"),
    ],
)
def test_what_is_no_number_says_why(text, words):
    with pytest.raises(NotANumber, match=words):
        parse_number(text)


def test_decimal_comma_needs_semicolons():
    with pytest.raises(
        NotANumber, match=r"comma-separated file a comma is not a decimal sign \(separate by ;\)"
    ):
        parse_number("1,5", separator=",")
    with pytest.raises(NotANumber, match="this comma may separate thousands"):
        parse_number("1,5", separator="\t")
    with pytest.raises(NotANumber, match="decimal comma, as elsewhere"):
        parse_number("1.500", comma=True)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_every_float_is_read_back_exactly(value):
    assert parse_number(repr(value)) == value
    assert parse_number(repr(value).replace(".", ","), comma=True) == value


@each_of(
    ("unit", "shown", "inside"),
    [
        (units.LENGTH["mm"], 318.0, 0.318),
        (units.LENGTH["mil"], 1000.0, 0.0254),
        (units.MASS["oz"], 16.0, 0.45359237),
        (units.UNBALANCE["g_mm"], 1.0, 1e-6),
        (units.UNBALANCE["oz_in"], 1.0, 0.45359237 / 16 * 0.0254),
        (units.SPEED["rpm"], 60.0, 2 * math.pi),
        (units.ANGLE["deg"], 180.0, math.pi),
        (units.VIBRATION["um_pp"], 2.0, 1e-6),
        (units.VIBRATION["mm_s_rms"], 1.0, math.sqrt(2) * 1e-3),
        (units.VIBRATION["in_s"], 1.0, 0.0254),
        (units.VIBRATION["g"], 1.0, 9.80665),
        (units.STIFFNESS["N_per_um"], 100.0, 1e8),
    ],
)
def test_units_in_si(unit, shown, inside):
    assert unit.to_si(shown) == pytest.approx(inside, rel=1e-15)
    assert inside * unit.scale == pytest.approx(shown, rel=1e-15)


def test_usual_spellings_of_units():
    assert units.vibration("µm_pp") == units.vibration("μm_pp") == units.VIBRATION["um_pp"]
    assert units.vibration("mm/s_rms") is units.VIBRATION["mm_s_rms"]
    assert units.weight("g·mm") is units.UNBALANCE["g_mm"]
    assert (units.vibration("g").kind, units.weight("g").kind) == ("acceleration", "mass")


def test_any_other_vibration_unit_is_a_label():
    for name in ("", "V", "div", "mV_rms"):
        unit = units.vibration(name)
        assert (unit.name, unit.scale) == (name, 1.0)


@pytest.mark.parametrize(("name", "words"), [("MM", "written mm"), ("um_pk", r"um_pp \(peak to peak\)")])
def test_a_misspelt_vibration_unit_is_not_taken_for_a_label(name, words):
    with pytest.raises(units.UnitError, match=words):
        units.vibration(name)


def test_problem_in_words():
    problem = Problem("a.csv", 3, "phase_deg", "x\ty" * 40, "a number")
    assert str(problem).startswith("a.csv, row 3, column phase_deg: found 'x\\ty")
    assert "…" in str(problem)
    assert str(problem).endswith("expected a number")
    assert str(Problem("j.toml", None, "phase", "", "lead")) == (
        "j.toml, key phase: found nothing (a blank), expected lead"
    )


def test_problems_are_raised_together_in_order_of_files_and_rows():
    problems = Problems()
    problems.stop()
    problems.add("x", "b", 5)
    problems.add("x", "a", 9)
    problems.add("x", "b", 2)
    with pytest.raises(InputError) as caught:
        problems.stop()
    assert [(p.file, p.row) for p in caught.value.problems] == [("b", 2), ("b", 5), ("a", 9)]
    assert len(str(caught.value).splitlines()) == 3


@each_of(
    ("cells", "name", "doubtful"),
    [
        (["720", "1.350", "490"], "amplitude_um", {"1.350"}),
        (["1.350", "2.125"], "amplitude_um", set()),
        (["720", "1.350", "0.5"], "amplitude_um", set()),
        (["3.000", "3.000"], "speed_rpm", {"3.000"}),
        (["3.000", "2.5"], "speed_rpm", set()),
        (["0", "1.350"], "phase_deg", set()),
        (["1.234.567", "3"], "amplitude", {"1.234.567"}),
        (["0.350", "720"], "amplitude", set()),
    ],
)
def test_points_that_may_separate_thousands(cells, name, doubtful):
    assert thousands_or_decimals(cells, name) == doubtful
