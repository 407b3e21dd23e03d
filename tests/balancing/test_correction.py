"""How a correction is shown: JSON types, tables, text and pictures."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from balancing_data import GRAM, bruel_kjaer, complex_normal, feese_grazier, job, synthetic

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
    for words in ("2.951", "50.2°", "bare rotor"):
        assert words in text
    for words in ("13.5", "rank 2 of 2", "condition number 2.48", *correction.answer.tables):
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
    assert " at 20 Hz " in told.whole()
    assert " rpm" not in told.whole()
    [table] = [one for one in told.tables if one.startswith("Vibration")]
    head, *rows = table.splitlines()[1:]
    assert head.split()[0] == "Hz"
    assert {row.split()[0] for row in rows[:-1]} == {"20", "25.5"}
    assert " at 1530 rpm " in usual.whole()


def two_planes(ratio, seed=0):
    """Planes of which the second does `ratio` times what the first does, but for 4 %; the right weights."""
    rng = np.random.default_rng(seed)
    w, U = complex_normal(rng, 8), complex_normal(rng, 2) * GRAM
    W = np.column_stack((w, ratio * w + 0.04 * complex_normal(rng, 8))) / GRAM
    T = np.vstack((np.zeros(2), np.eye(2), [0.5, -0.5j])) * GRAM
    read = (T + U) @ W.T
    read = read * (1 + 0.01 * complex_normal(rng, read.shape))
    return job(read[:, None], T, errors=ReadingErrors(0.01, 0.01)), -U


@pytest.mark.parametrize("ratio", [1.0, 0.6 + 0.5j])
def test_what_two_planes_do_together_is_determined_and_told_first(ratio):
    told, inside = 0, 0
    for seed in range(50):
        trials, D = two_planes(ratio, seed)
        c = correct(estimate_influence(trials), refuse=False)
        if not c.combination:
            continue
        told += 1
        first = c.sentence().replace("Static", "static").replace("Planes", "planes")
        assert c.combination in first
        assert ("static part" in c.combination) == (ratio == 1)
        assert not any("act alike" in words for words in c.warnings)
        # the statement by its printed numbers, against the truth
        size, within, angle = re.search(r"([\d.e-]+) ± ([\d.e-]+) \S+ at ([\d.]+)°", c.combination).groups()
        stated = float(size) * np.exp(1j * np.radians(float(angle)))
        true = c.labels.weight_scale * (D[0] + (1 if ratio == 1 else ratio) * D[1])
        inside += abs(stated - true) <= float(within) * 1.1 + 0.02 * abs(true)
        assert float(c.combination.rsplit("± ", 1)[1].split()[0]) > 3 * float(within)
    assert told >= 10
    assert inside >= 0.85 * told


def test_planes_that_are_told_apart_have_their_own_weights():
    c = correct(estimate_influence(bruel_kjaer(errors=ERRORS)))
    assert c.combination == ""
    assert c.sentence().startswith("Mount these weights: rms ")
