"""Units in SI, their spellings, and numbers in the ways that they are written."""

from __future__ import annotations

import math

import pytest
from cases import each_of
from hypothesis import given
from hypothesis import strategies as st
from tables_data import RUNS, WEIGHTS, complaints, csv_text, replaced, write_csv

from rotorid.files import read_trials, units


@each_of(
    ("unit", "shown", "inside"),
    [
        (units.LENGTH["mil"], 1000.0, 0.0254),
        (units.MASS["oz"], 16.0, 0.45359237),
        (units.UNBALANCE["oz_in"], 1.0, 0.45359237 / 16 * 0.0254),
        (units.SPEED["rpm"], 60.0, 2 * math.pi),
        (units.VIBRATION["um_pp"], 2.0, 1e-6),
        (units.VIBRATION["mm_s_rms"], 1.0, math.sqrt(2) * 1e-3),
        (units.VIBRATION["in_s"], 1.0, 0.0254),
        (units.VIBRATION["g"], 1.0, 9.80665),
    ],
)
def test_units_in_si(unit, shown, inside):
    assert unit.to_si(shown) == pytest.approx(inside, rel=1e-15)
    assert inside * unit.scale == pytest.approx(shown, rel=1e-15)


def test_usual_spellings_of_units():
    assert units.vibration("µm_pp") == units.vibration("μm_pp") == units.VIBRATION["um_pp"]
    assert units.weight("g·mm") is units.UNBALANCE["g_mm"]
    assert (units.vibration("g").kind, units.weight("g").kind) == ("acceleration", "mass")
    for name in ("", "V"):  # any other is a label
        assert (units.vibration(name).name, units.vibration(name).scale) == (name, 1.0)
    for name, words in (("MM", "written mm"), ("um_pk", r"um_pp \(peak to peak\)")):
        with pytest.raises(units.UnitError, match=words):
            units.vibration(name)


@given(st.floats(1e-9, 1e9), st.booleans())
def test_every_number_is_read_exactly(tmp_path_factory, value, comma):
    folder = tmp_path_factory.mktemp("numbers")
    table = replaced(RUNS, 2, "amplitude_um_pp", value)
    text = csv_text(table, ";" if comma else ",", comma)
    (folder / "runs.csv").write_text(text, encoding="utf-8")
    read = read_trials(folder / "runs.csv", write_csv(folder / "weights.csv", WEIGHTS))
    assert abs(read.readings[0, 0, 0, 0]) == pytest.approx(value * 0.5e-6, rel=1e-15)


@each_of(
    ("amplitudes", "doubtful"),
    [
        (["720", "1.350", "490"], [3]),
        (["720", "1.350", "0.5"], []),
        (["1.350", "2.125", "3.250"], []),
        (["1.234.567", "3", "4"], [2]),
    ],
)
def test_points_that_may_separate_thousands(tmp_path, amplitudes, doubtful):
    runs = [[*row[:3], amplitude, row[4]] for row, amplitude in zip(RUNS[1::2], amplitudes, strict=True)]
    files = tmp_path / "runs.csv", write_csv(tmp_path / "w.csv", WEIGHTS)
    files[0].write_text(csv_text([RUNS[0], *runs], ";"), encoding="utf-8")
    if doubtful:
        assert [problem.row for problem in complaints(read_trials, *files)] == doubtful
    else:
        assert read_trials(*files).readings.size == 3
