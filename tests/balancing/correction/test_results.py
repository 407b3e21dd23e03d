"""How a correction is shown: JSON types, tables, text and pictures."""

import json
import re
from dataclasses import replace

import matplotlib
import numpy as np
import pytest
from balancing_data import bruel_kjaer, feese_grazier, job, synthetic
from matplotlib.figure import Figure

from balancing import Labels, ReadingErrors, correct, estimate_influence
from balancing.plots import correction_polar as plots
from rotorid.plots import plot

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
    assert frame["mass_std"].isna().all() == (correction.covariance is None)
    residuals = correction.residuals_frame()
    assert list(residuals.columns[:3]) == ["speed_rpm", "sensor", "before"]
    assert len(residuals) == 2


def test_influence_frame():
    influence = estimate_influence(bruel_kjaer(labels=Labels("mm_s", 1e3, "g", 1e3)))
    frame = influence.to_frame()
    assert influence.unit == "mm_s/g"
    by_hand = (4.9 * np.exp(1j * np.deg2rad(114)) - 7.2 * np.exp(1j * np.deg2rad(238))) / 2.5
    assert frame["influence"][0] == pytest.approx(abs(by_hand) * 1000)
    assert frame["phase_deg"][0] == pytest.approx(np.degrees(np.angle(by_hand)) % 360)
    json.dumps(influence.to_dict(), allow_nan=False)
    assert len(influence.to_dict()["rows"]) == 4


def test_the_text_fits_a_terminal(correction):
    text, whole = correction.summary(), correction.answer.whole()
    assert max(map(len, text.splitlines())) <= 100
    for words in ("2.951", "50.2°", "bare rotor", "13.5"):
        assert words in text
    for words in ("rank 2 of 2", "condition number 2.48", *correction.answer.tables):
        assert words in whole
    assert ("95 %" in text) == (correction.covariance is not None)


def test_long_names_and_many_warnings_fit_too():
    sensors = tuple(f"turbine bearing number {i} in horizontal direction, drive end" for i in range(4))
    labels = Labels("mil_pp", 1e3, "oz", 35.27, "lag", "against rotation")
    c = correct(estimate_influence(feese_grazier(errors=ERRORS, sensors=sensors, labels=labels)))
    text = c.summary()
    assert max(map(len, text.splitlines())) <= 100
    assert len(text.splitlines()) <= 24
    assert "against the rotation; phases as lag" in text
    assert "mil pp" in text
    assert max(len(line) for table in c.answer.tables for line in table.splitlines()) <= 80


def test_a_warning_is_told_in_the_brief_text():
    apart = bruel_kjaer()
    again = np.concatenate((apart.readings[0], 1.5 * apart.readings[0, :1]))
    c = correct(estimate_influence(job(again, np.vstack((apart.weights, [[0, 0]])))), refuse=False)
    assert "runs 'run 0' and 'run 3' have the same weights mounted" in c.warnings[0]
    assert "Warning: runs 'run 0' and 'run 3' have the same weights mounted" in c.summary()


def test_the_95_percent_of_the_text_is_that_of_the_numbers():
    c = correct(estimate_influence(bruel_kjaer(errors=ERRORS)))
    line = next(x for x in c.summary().splitlines() if x.startswith("  A "))
    half, angle = (float(x) for x in re.findall(r"± ([\d.]+)", line))
    assert half == pytest.approx(1.96 * c.mass_std[0] * 1000, abs=0.005)
    assert angle == pytest.approx(1.96 * np.degrees(c.angle_std[0]), abs=0.05)


def test_results_cannot_be_changed(correction):
    for array in (correction.weights, correction.before, correction.after):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


def test_pictures(correction, tmp_path):
    before = {k: v for k, v in matplotlib.rcParams.items() if k != "backend"}
    figure = plot(correction)
    assert isinstance(figure, Figure)
    figure.savefig(tmp_path / "sheet.png", dpi=40)
    polar = Figure().add_subplot(projection="polar")
    assert plot(correction, polar) is polar
    texts = [t.get_text() for t in polar.get_legend().get_texts()]
    assert texts[0].startswith("A: 2.951 g at 50.2°")
    bars = Figure().add_subplot()
    assert plot(correction, bars) is bars
    assert len(bars.patches) == 2
    assert {k: v for k, v in matplotlib.rcParams.items() if k != "backend"} == before
    with pytest.raises(ValueError, match="projection='polar'"):
        plots.corrections(correction, bars)


@pytest.mark.parametrize(("angles", "direction"), [("with rotation", 1), ("against rotation", -1)])
def test_angles_of_the_picture_run_as_the_job_counts_them(angles, direction):
    labels = Labels("um_pp", 1e6, "g", 1e3, "lag", angles)
    c = correct(estimate_influence(bruel_kjaer(labels=labels)))
    ax = plots.corrections(c)
    assert ax.get_theta_direction() == direction
    tip = next(line for line in ax.lines if line.get_marker() == "o" and len(line.get_xdata()))
    assert np.degrees(tip.get_xdata()[0]) == pytest.approx(direction * 50.19 % 360, abs=0.01)
    assert plots.vectors(c).get_theta_direction() == -1
    assert ax.get_title() == "Weights on the bare rotor, g"
    assert plot(c, Figure().add_subplot()).get_ylabel() == "vibration, µm pp"


def test_many_speeds_and_sensors_are_drawn_too(tmp_path):
    trials, _, _ = synthetic(np.random.default_rng(2), planes=3, sensors=9, speeds=14, errors=ERRORS)
    c = correct(estimate_influence(trials))
    plot(c).savefig(tmp_path / "many.png", dpi=40)
    # of 14 speeds every other has its name, the first among them, from left to right
    ax = plot(c, Figure().add_subplot())
    [upper] = ax.child_axes
    texts = [text.get_text() for text in upper.get_xticklabels()]
    assert texts == [f"{v * 30 / np.pi:.6g}" for v in c.speeds[::2]]
    assert upper.get_xticks()[0] < upper.get_xticks()[1]


def test_speeds_in_the_unit_of_the_readings():
    trials, _, _ = synthetic(np.random.default_rng(3), speeds=2)
    turns = replace(trials, speeds=np.array([20.0, 25.5]) * 2 * np.pi)
    hertz = replace(turns, labels=replace(trials.labels, speed_unit="Hz"))
    told, usual = (correct(estimate_influence(made)).answer for made in (hertz, turns))
    assert " at 20 Hz " in told.brief()
    assert " rpm" not in told.whole()
    head, *rows = told.tables[1].splitlines()[1:]
    assert head.split()[0] == "Hz"
    assert {row.split()[0] for row in rows[:-1]} == {"20", "25.5"}
    assert " at 1530 rpm " in usual.whole()
