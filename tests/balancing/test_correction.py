"""How a correction is shown: JSON types, tables, text and pictures."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from balancing_data import bruel_kjaer, feese_grazier, synthetic

from balancing import Labels, ReadingErrors, correct, estimate_influence

ERRORS = ReadingErrors(0.02, np.deg2rad(1))
KEYS = {
    *(
        "method",
        "conventions",
        "corrections",
        "residuals",
        "rms_before",
        "rms_after",
        "max_before",
        "max_after",
    ),
    *("condition_number", "rank", "warnings"),
}


@pytest.fixture(params=[None, ERRORS], ids=["errors assumed", "errors stated"])
def correction(request):
    return correct(estimate_influence(bruel_kjaer(errors=request.param)))


def test_the_keys_of_the_interface(correction):
    d = correction.to_dict()
    assert set(d) >= KEYS
    assert d["method"] == "weighted"
    row = ["plane", "mass", "unit", "angle_deg", "mass_std", "angle_std_deg", "covariance"]
    assert list(d["corrections"][0]) == [*row, "action", "remove_at_deg"]
    row = [
        "speed_rpm",
        "sensor",
        "before",
        "before_phase_deg",
        "after",
        "after_phase_deg",
        "after_covariance",
    ]
    assert list(d["residuals"][0]) == row
    json.dumps(d, allow_nan=False)
    assert d["rank"] == 2
    assert d["rms_before"] == pytest.approx(np.sqrt((7.2**2 + 13.5**2) / 2))
    assert d["max_before"] == pytest.approx(13.5)
    assert d["mounted_in_last_run"]["run"] == "run 2"
    assert [w["mass"] for w in d["mounted_in_last_run"]["weights"]] == pytest.approx([0, 2.5])


def test_speeds_come_back_as_the_job_wrote_them():
    rpm = np.array([1220.0, 3000.0, 5400.0])
    trials, _, _ = synthetic(np.random.default_rng(0), speeds=3)
    c = correct(estimate_influence(replace(trials, speeds=rpm * np.pi / 30)))
    assert [r["speed_rpm"] for r in c.to_dict()["residuals"][::4]] == rpm.tolist()


def test_frames(correction):
    frame = correction.to_frame()
    assert list(frame["plane"]) == ["A", "B"]
    assert frame["mass_std"].isna().all() == (not correction.region_known)


def test_the_text_fits_a_terminal(correction):
    text, whole = correction.answer.brief(), correction.answer.whole()
    assert max(map(len, text.splitlines())) <= 100
    for words in ("2.951", "50.2°", "bare rotor", "13.5"):
        assert words in text
    for words in ("rank 2 of 2", "condition number 2.48", *correction.answer.tables):
        assert words in whole
    assert ("95 %" in text) == correction.region_known


def test_long_names_and_many_warnings_fit_too():
    sensors = tuple(f"turbine bearing number {i} in horizontal direction, drive end" for i in range(4))
    labels = Labels("mil_pp", 1e3, "oz", 35.27, "lag", "against rotation")
    c = correct(estimate_influence(feese_grazier(errors=ERRORS, sensors=sensors, labels=labels)))
    text = c.answer.brief()
    assert max(map(len, text.splitlines())) <= 100
    assert len(text.splitlines()) <= 24
    assert "against the rotation; phases as lag" in text
    assert "mil pp" in text
    assert max(len(line) for table in c.answer.tables for line in table.splitlines()) <= 80


def test_the_95_percent_of_the_text_is_that_of_the_numbers():
    c = correct(estimate_influence(bruel_kjaer(errors=ERRORS)))
    line = next(x for x in c.answer.brief().splitlines() if x.startswith("  A "))
    half, angle = (float(x) for x in re.findall(r"± ([\d.]+)", line))
    assert half == pytest.approx(1.96 * c.mass_std[0] * 1000, rel=0.15)
    assert angle == pytest.approx(1.96 * np.degrees(c.angle_std[0]), rel=0.15)


def test_speeds_in_the_unit_of_the_readings():
    trials, _, _ = synthetic(np.random.default_rng(3), speeds=2)
    turns = replace(trials, speeds=np.array([20.0, 25.5]) * 2 * np.pi)
    hertz = replace(turns, labels=replace(trials.labels, speed_unit="Hz"))
    told, usual = (correct(estimate_influence(made)).answer for made in (hertz, turns))
    assert " at 20 Hz " in told.brief()
    assert " rpm" not in told.whole()
    [table] = [one for one in told.tables if one.startswith("Vibration")]
    head, *rows = table.splitlines()[1:]
    assert head.split()[0] == "Hz"
    assert {row.split()[0] for row in rows[:-1]} == {"20", "25.5"}
    assert " at 1530 rpm " in usual.whole()
