"""Runs and weights tables as fitters and instruments write them: each a kind, from ../shared/cases/files."""

from __future__ import annotations

import numpy as np
import openpyxl
import pytest
from cases import each_of

import balancing
from rotorid.files import InputError, read_job, read_trials
from rotorid.samples import sample_data

FAN = """\
Run,RPM,Bearing 1 mils,Bearing 1 deg,Bearing 2 mils,Bearing 2 deg
Original,1185,4.8,212,3.1,188
TW plane 1,1186,3.4,255,2.7,203
TW plane 2,1184,4.1,197,4.4,222
"""
FAN_WEIGHTS = """\
run,plane,mass_oz,angle_deg
TW plane 1,1,2.5,0
TW plane 2,2,2.5,0
"""
TWO_ROWS = [
    ["Fan 3 - two plane"],
    [None, None, "Bearing 1", None, "Bearing 2", None],
    ["Run", "RPM", "mils", "deg", "mils", "deg"],
    ["Original", 1185, 4.8, 212, 3.1, 188],
    ["TW plane 1", 1186, 3.4, 255, 2.7, 203],
    ["TW plane 2", 1184, 4.1, 197, 4.4, 222],
]
PUMP = """\
run,speed_rpm,sensor,amplitude_mm_s,phase_deg
as found,1485,DE,5.62,182
as found,1485,NDE,4.28,25
trial P1,1485,DE,10.4,202
trial P1,1485,NDE,3.01,57
trial P2,1485,DE,3.58,189
trial P2,1485,NDE,9.91,45
"""
PUMP_ROWS = [
    ("as found", 5.62, 182, 4.28, 25),
    ("trial P1", 10.4, 202, 3.01, 57),
    ("trial P2", 3.58, 189, 9.91, 45),
]


def wide(header, row):
    return header + "\n" + "".join(row.format(*values) + "\n" for values in PUMP_ROWS)


ONE_UNIT = wide("Run,rpm,DE mm/s,DE deg,NDE mm/s,NDE deg", "{},1485,{},{},{},{}")
SAME_RUNS = {
    "unit at the end": ONE_UNIT,
    "units row": wide(
        "Run,Speed,DE Amp,DE Phase,NDE Amp,NDE Phase\n,rpm,mm/s,deg,mm/s,deg", "{},1485,{},{},{},{}"
    ),
    "vib": wide("Run,rpm,DE Vib (mm/s),DE Angle (deg),NDE Vib (mm/s),NDE Angle (deg)", "{},1485,{},{},{},{}"),
    "vectors": wide("Run,rpm,DE,NDE\n,,mm/s,mm/s", "{},1485,{} @ {}°,{} @ {}°"),
    "vectors without a sign of degrees": wide("Run,rpm,DE,NDE\n,,mm/s,mm/s", "{},1485,{}<{},{}<{}"),
    "vectors with a word": wide("Run,rpm,DE,NDE\n,,mm/s,mm/s", "{},1485,{} at {}°,{} at {} deg"),
    "two rows": wide("Run,rpm,DE,,NDE,\n,,mm/s,deg,mm/s,deg", "{},1485,{},{},{},{}"),
    "two rows with words": wide(
        ",,DE,,NDE,\nRun,rpm,Amp (mm/s),Phase (deg),Amp (mm/s),Phase (deg)", "{},1485,{},{},{},{}"
    ),
    "what was mounted, in words": ONE_UNIT.replace("NDE deg", "NDE deg,Trial weight")
    .replace(",25\n", ",25,\n")
    .replace(",57\n", ",57,10 g at 90° in P1\n")
    .replace(",45\n", ",45,10 g at 270° in P2\n"),
    "coefficients beside": ONE_UNIT.replace("NDE deg", "NDE deg,Amp. Coeff. plane 1")
    .replace(",25\n", ",25,\n")
    .replace(",57\n", ",57,0.1\n")
    .replace(",45\n", ",45,0.2\n"),
    "phase without a unit": ONE_UNIT.replace("DE deg", "DE Phase").replace("NNDE", "NDE"),
}


SIX = "{},1485,{},{},{},{}"
SAME_RUNS |= {
    f"headings {k}": wide(header, SIX)
    for k, header in enumerate(
        (
            "RUN #,SPEED RPM,DE AMP (MM/S),DE PHASE (DEG),NDE AMP (MM/S),NDE PHASE (DEG)",
            "Step,CPM,DE mm/sec,DE deg,NDE mm/sec,NDE deg",
            "Test,n [1/min],DE_mm_s,DE_deg,NDE_mm_s,NDE_deg",
            "Run,Speed rpm,DE Vib mm/s,DE Ph deg,NDE Vib mm/s,NDE Ph deg",
            ",,DE,DE,NDE,NDE\nCondition,RPM,mm/s,deg,mm/s,deg",
            "Run,RPM,DE,DE,NDE,NDE\n,,mm/s,deg,mm/s,deg",
            ",,DE,,NDE,\nRun,RPM,Amplitude,Phase,Amplitude,Phase\n,,mm/s,deg,mm/s,deg",
        )
    )
}
SAME_RUNS |= {
    "sign and unit behind": wide("Run,RPM,DE mm/s@deg,NDE (mm/s / deg)", "{},1485,{}@{},{}/{}"),
    "L": wide("Run,RPM,DE,NDE", "{},1485,{} mm/s L{},{} mm/s L{}"),
    "columns beside": wide(
        "Date,Time,Run,Condition,RPM,DE overall,DE mm/s,DE deg,NDE mm/s,NDE deg",
        "2026-01-02,10:11,{},hot,1485,9.9,{},{},{},{}",
    ),
}


def test_a_column_of_weights_among_the_readings_is_passed_over_and_said(tmp_path):
    runs = ONE_UNIT.replace("NDE deg", "NDE deg,Trial weight (g)").replace(",25\n", ",25,\n")
    runs = runs.replace(",57\n", ",57,10\n").replace(",45\n", ",45,10\n")
    trials = trials_of(tmp_path, runs)
    assert trials.sensors == ("DE", "NDE")
    assert len([word for word in trials.warnings if "'Trial weight (g)' is passed over" in word]) == 1


def test_amplitudes_and_phases_numbered_alike_are_one_sensor(tmp_path):
    runs = wide("Run;n [1/min];A1 [µm];φ1 [°];A2 [µm];φ2 [°]", "{};1485;{};{};{};{}")
    trials = trials_of(tmp_path, runs)
    assert trials.sensors == ("1", "2")
    assert_same(
        trials, trials_of(tmp_path, PUMP.replace("mm_s", "um").replace("NDE", "2").replace("DE", "1"))
    )


def trials_of(folder, runs, weights=None, **options):
    (folder / "runs.csv").write_text(runs, encoding="utf-8")
    if weights is not None:
        (folder / "weights.csv").write_text(weights, encoding="utf-8")
    return read_trials(
        folder / "runs.csv", None if weights is None else folder / "weights.csv", phase="lag", **options
    )


def job_of(folder, settings, phase="lag", **files):
    for name, text in files.items():
        (folder / f"{name}.csv").write_text(text, encoding="utf-8")
    stated = "" if phase is None else f'phase = "{phase}"\n'
    text = f'{stated}angles = "with rotation"\n{settings}'
    (folder / "job.toml").write_text(text, encoding="utf-8")
    return read_job(folder / "job.toml")


def refused(read, *args, **options):
    with pytest.raises(InputError) as caught:
        read(*args, **options)
    return str(caught.value)


def assert_same(trials, other):
    assert (trials.runs, trials.sensors, trials.planes) == (other.runs, other.sensors, other.planes)
    assert trials.labels == other.labels
    np.testing.assert_allclose(trials.readings, other.readings, rtol=1e-14)
    np.testing.assert_allclose(trials.weights, other.weights, rtol=1e-14, atol=1e-17)
    np.testing.assert_allclose(trials.speeds, other.speeds, rtol=1e-14)
    np.testing.assert_array_equal(trials.steps, other.steps)


@each_of("name", SAME_RUNS)
def test_each_layout_is_the_same_runs(tmp_path, name):
    assert_same(trials_of(tmp_path, SAME_RUNS[name]), trials_of(tmp_path, PUMP))


@pytest.mark.parametrize("form", ["sheet", "text", "merged"])
def test_two_rows_of_headings_and_the_weights_that_follow(tmp_path, form):
    """README: 4.332 oz at 42.7° and 1.668 oz at 113.2°, lag and against the rotation."""
    (tmp_path / "weights.csv").write_text(FAN_WEIGHTS)
    if form == "text":
        (tmp_path / "fan.csv").write_text(FAN)
        runs = tmp_path / "fan.csv"
    else:
        runs, book = tmp_path / "fan.xlsx", openpyxl.Workbook()
        for row in TWO_ROWS:
            book.active.append(row)
        if form == "merged":
            for cells in ("A1:G1", "C2:D2", "E2:F2"):
                book.active.merge_cells(cells)
        book.save(runs)
    trials = read_trials(runs, tmp_path / "weights.csv", phase="lag", angles="against rotation")
    assert trials.sensors == ("Bearing 1", "Bearing 2")
    assert (trials.labels.vibration_unit, trials.labels.weight_unit) == ("mil", "oz")
    influence = balancing.estimate_influence(trials)
    weights = np.linalg.solve(influence.W[0], -trials.readings[0, 0, 0])
    size, angle = trials.labels.weight(weights)
    np.testing.assert_allclose(size, [4.332, 1.668], atol=6e-4)
    np.testing.assert_allclose(angle, [42.7, 113.2], atol=0.06)


def test_a_title_over_one_row_of_headings_is_no_name_of_a_sensor(tmp_path):
    runs = ONE_UNIT.replace("Run,", ",,Pump 3,,,\nRun,", 1)
    assert trials_of(tmp_path, runs).sensors == ("DE", "NDE")


def test_velocity_in_mm_s_is_rms_and_says_so(tmp_path):
    runs = ONE_UNIT.replace("DE mm/s", "DE Velocity mm/s").replace("NNDE", "NDE")
    trials = trials_of(tmp_path, runs)
    assert trials.labels.vibration_unit == "mm_s_rms"
    assert [word for word in trials.warnings if "is read as mm/s rms" in word]
    plain = trials_of(tmp_path, ONE_UNIT)
    assert plain.labels.vibration_unit == "mm_s"
    assert [word for word in plain.warnings if "'DE mm/s' is read as mm/s peak" in word]
    assert trials_of(tmp_path, PUMP).warnings == ()
    assert trials_of(tmp_path, ONE_UNIT.replace("mm/s", "mm/s pk")).warnings == ()
    np.testing.assert_allclose(trials.readings, plain.readings * np.sqrt(2), rtol=1e-14)


def test_lag_as_a_heading_is_the_phase_of_a_job_that_lags(tmp_path):
    runs = "Run,RPM,Amp (mils),Lag (deg)\nfirst,1185,4.8,212\nsecond,1185,3.4,255\n"
    trials = trials_of(tmp_path, runs)
    assert trials.sensors == ("1",)
    np.testing.assert_allclose(trials.labels.vibration(trials.readings)[1].ravel(), [212, 255])
    unstated = read_trials(tmp_path / "runs.csv", None)
    assert (unstated.labels.phase, unstated.labels.assumed) == ("lag", ())
    np.testing.assert_allclose(unstated.readings, trials.readings)
    words = refused(read_trials, tmp_path / "runs.csv", None, phase="lead")
    assert "expected phases that lead, as the job says" in words


def test_what_the_headings_say_of_phases_is_said_for_a_job(tmp_path):
    runs = ONE_UNIT.replace("DE deg", "DE phase lag").replace("NNDE", "NDE")
    files = {"runs": runs, "weights": PLAIN_WEIGHTS}
    job = job_of(tmp_path, EIGHT, phase=None, **files)
    assert (job.trials.labels.phase, job.trials.labels.assumed) == ("lag", ())
    assert_same(job.trials, job_of(tmp_path, EIGHT, **files).trials)


def test_one_sensor_and_one_speed_need_no_columns(tmp_path):
    """The speed is the job's; two readings of one run are no single sensor."""
    runs = "Run,Amp (mils),Phase (deg)\nfirst,4.8,212\nsecond,3.4,255\n"
    settings = 'runs = "runs.csv"\nweights = "w.csv"\nspeed_rpm = 1185\n'
    job = job_of(tmp_path, settings, runs=runs, w="run,plane,mass_oz,angle_deg\nsecond,1,2.5,0\n")
    assert (job.trials.sensors, job.trials.labels.speed_unit) == (("1",), "rpm")
    np.testing.assert_allclose(job.trials.speeds, [1185 * np.pi / 30], rtol=1e-15)
    text = refused(trials_of, tmp_path, runs)
    assert "a column speed_rpm" in text
    both = runs.replace("\nfirst", "\nfirst,1.2,7\nfirst")
    assert "a column sensor" in refused(job_of, tmp_path, settings, runs=both)


STEPS = {
    "step1": """\
Sensor position;Rotational speed [rpm];Amplitude [mm/s RMS];Phase [°];Amp. Coeff. plane 1;Ph. Coeff. plane 1
Drive end;1490;6,21;123;;
Fan end;1490;4,08;98;;
""",
    "step2": """\
Sensor position;Rotational speed [rpm];Amplitude [mm/s RMS];Phase [°];Amp. Coeff. plane 1;Ph. Coeff. plane 1
Drive end;1491;4,77;160;0,152;20
Fan end;1491;3,62;121;0,071;3
""",
}
STEP_WEIGHTS = "run,plane,mass_g,angle_deg\nstep2,P1,10,0\n"


@pytest.mark.parametrize("runs", ['["step1.csv", "step2.csv"]', '"steps"'])
def test_one_file_a_run(tmp_path, runs):
    place = tmp_path / "steps" if runs == '"steps"' else tmp_path
    place.mkdir(exist_ok=True)
    for name, text in STEPS.items():
        (place / f"{name}.csv").write_text(text, encoding="utf-8")
    job = job_of(tmp_path, f'runs = {runs}\nweights = "w.csv"\n', w=STEP_WEIGHTS)
    assert job.trials.runs == ("step1", "step2")
    assert job.trials.sensors == ("Drive end", "Fan end")
    size, phase = job.trials.labels.vibration(job.trials.readings)
    np.testing.assert_allclose(size.ravel(), [6.21, 4.08, 4.77, 3.62], rtol=1e-14)
    np.testing.assert_allclose(phase.ravel(), [123, 98, 160, 121], rtol=1e-13)
    assert {file.name for file in job.files} == {"job.toml", "step1.csv", "step2.csv", "w.csv"}


def test_a_wrong_cell_of_one_file_names_that_file(tmp_path):
    bad = {**STEPS, "step2": STEPS["step2"].replace("4,77", "n/a")}
    text = refused(
        job_of, tmp_path, 'runs = ["step1.csv", "step2.csv"]\nweights = "w.csv"\n', **bad, w=STEP_WEIGHTS
    )
    assert "step2.csv, row 2, column Amplitude [mm/s RMS]: found 'n/a'" in text
    assert text.count("\n") == 0


def test_files_in_the_order_of_their_numbers(tmp_path):
    for k in (1, 2, 10):
        (tmp_path / f"step{k}.csv").write_text(STEPS["step1"], encoding="utf-8")
    assert read_trials(tmp_path, None, phase="lag").runs == ("step1", "step2", "step10")


PLAIN_WEIGHTS = "run,plane,mass_g,angle_deg\ntrial P1,P1,10,90\ntrial P2,P2,10,270\n"
SAME_WEIGHTS = {
    "capitals": "Run,Plane,Mass (g),Angle (deg)\ntrial P1,P1,10,90\ntrial P2,P2,10,270\n",
    "brackets": "Run,Plane,Weight [g],Angle\nTrial P1,P1,10,90°\nTrial P2,P2,10,270°\n",
    "units in cells": "run,plane,weight,angle\ntrial P1,P1,10 g,90°\ntrial P2,P2,10 g,270 deg\n",
    "a column of units": "run,plane,mass,unit,angle_deg\ntrial P1,P1,10,g,90\ntrial P2,P2,10,g,270\n",
    "vectors": "run,plane,Trial weight\ntrial P1,P1,10 g @ 90°\ntrial P2,P2,10 g at 270°\n",
    "clock": "run,plane,mass_g,angle_clock\ntrial P1,P1,10,3:00\ntrial P2,P2,10,9\n",
    "clock in the angle": "run,plane,mass_g,angle_deg\ntrial P1,P1,10,3:00\ntrial P2,P2,10,9 o'clock\n",
    "hole": "run,plane,mass_g,hole\ntrial P1,P1,10,3\ntrial P2,P2,10,7\n",
    "blade": "run,plane,mass_g,Blade no.\ntrial P1,P1,10,3\ntrial P2,P2,10,7\n",
    "position": "run,plane,mass_g,Position\ntrial P1,P1,10,3\ntrial P2,P2,10,7\n",
    "hole in the angle": "run,plane,mass_g,angle\ntrial P1,P1,10,hole 3\ntrial P2,P2,10,#7\n",
    "columns for each plane": "Run,P1 weight (g),P1 angle (deg),P2 weight (g),P2 angle (deg)\n"
    "as found,,,,\ntrial P1,10,90,,\ntrial P2,,,10,270\n",
    "units row and a title": "Pump 3\n\nTest,Plane,Amount,Location\n,,g,deg\n"
    "trial P1,P1,10,90\ntrial P2,P2,10,270\n",
    "grams and degrees": "Date,Trial run,Plane,Grams,Degrees\n2026-01-02,trial P1,P1,10,90\n"
    "2026-01-03,trial P2,P2,10,270\n",
    "a run without a weight": "run,plane,weight (gm),phase (deg)\nas found,,,\n"
    "trial P1,P1,10,90\ntrial P2,P2,10,270\n",
    "removed on the other side": "run,plane,action,mass_g,angle_deg\n"
    "trial P1,P1,add,10,90\ntrial P2,P2,remove,10,90\n",
}
EIGHT = 'runs = "runs.csv"\nweights = "weights.csv"\n[planes.P1]\nholes = 8\n[planes.P2]\nholes = 8\n'


@each_of("name", SAME_WEIGHTS)
def test_each_way_to_write_weights_is_the_same(tmp_path, name):
    other = job_of(tmp_path, EIGHT, runs=PUMP, weights=SAME_WEIGHTS[name]).trials
    assert_same(other, job_of(tmp_path, EIGHT, runs=PUMP, weights=PLAIN_WEIGHTS).trials)


def test_the_clock_runs_with_the_angles_of_the_job(tmp_path):
    weights = "run,plane,mass_g,angle_clock\ntrial P1,P1,10,10:20\n"
    trials = trials_of(tmp_path, PUMP, weights, angles="against rotation")
    np.testing.assert_allclose(trials.labels.weight(trials.weights[1])[1], [310], rtol=1e-12)
    np.testing.assert_allclose(trials.weights[1], 0.01 * np.exp(-1j * np.radians(310)), rtol=1e-12)


def test_a_spreadsheet_takes_a_clock_for_a_time(tmp_path):
    import datetime

    book = openpyxl.Workbook()
    for row in (["run", "plane", "mass_g", "clock"], ["trial P1", "P1", 10, datetime.time(10, 20)]):
        book.active.append(row)
    book.save(tmp_path / "weights.xlsx")
    (tmp_path / "runs.csv").write_text(PUMP)
    trials = read_trials(tmp_path / "runs.csv", tmp_path / "weights.xlsx", phase="lag")
    np.testing.assert_allclose(trials.labels.weight(trials.weights[1])[1], [310], rtol=1e-12)


@pytest.mark.parametrize(
    ("heading", "unit", "si"),
    [
        ("Weight [oz·in]", "oz_in", 0.45359237 / 16 * 0.0254),
        ("Unbalance (oz-in)", "oz_in", 0.45359237 / 16 * 0.0254),
        ("Weight (oz in)", "oz_in", 0.45359237 / 16 * 0.0254),
        ("weight lbs", "lb", 0.45359237),
        ("Weight, grams", "g", 1e-3),
        ("Weight [g·mm]", "g_mm", 1e-6),
        ("Weight [gmm]", "g_mm", 1e-6),
    ],
)
def test_units_of_weights_as_people_write_them(tmp_path, heading, unit, si):
    weights = f"run,plane,{heading},angle_deg\n".replace(heading, f'"{heading}"') + "trial P1,P1,2,0\n"
    trials = trials_of(tmp_path, PUMP, weights)
    assert trials.labels.weight_unit == unit
    np.testing.assert_allclose(trials.weights[1], [2 * si], rtol=1e-14)


@pytest.mark.parametrize(
    ("runs", "unit"), [("in/s", "in_s"), ("ips", "in_s"), ("mils pp", "mil_pp"), ("in/s rms", "in_s_rms")]
)
def test_us_units_of_readings(tmp_path, runs, unit):
    assert trials_of(tmp_path, ONE_UNIT.replace("mm/s", runs)).labels.vibration_unit == unit


PIECES = """\
plane,action,hole,angle_deg,mass,unit,pieces
P1,add,1,0.0,3.0,g,1.000 + 2.000
P2,add,4,135.0,4.0,g,4.000
P2,add,6,225.0,10.000000000000002,g,2.000 + 8.000
"""


def test_the_pieces_that_a_split_wrote_are_those_of_the_check_run(tmp_path):
    check = PUMP.splitlines(keepends=True)[0] + "check,1485,DE,0.5,10\ncheck,1485,NDE,0.4,20\n"
    top, planes = EIGHT.split("[planes.P1]", 1)
    settings = f'{top}check = "check.csv"\ncheck_weights = "pieces.csv"\n[planes.P1]{planes}'
    files = {"runs": PUMP, "weights": PLAIN_WEIGHTS, "check": check}
    job = job_of(tmp_path, settings, **files, pieces=PIECES)
    turn = np.exp(1j * np.radians([0, 135, 225]))
    np.testing.assert_allclose(job.check.weights[0], [0.003, 0.004 * turn[1] + 0.01 * turn[2]], rtol=1e-12)


def test_a_wrong_cell_of_a_plane_names_its_column(tmp_path):
    weights = SAME_WEIGHTS["columns for each plane"].replace(",10,270", ",10,400")
    words = refused(trials_of, tmp_path, PUMP, weights)
    assert "row 4, column P2 angle (deg): found '400', expected an angle from -360" in words


QUESTIONS = {
    "a hole without holes": (
        "run,plane,mass_g,hole\ntrial P1,P1,10,3\n",
        "row 2, column hole: found '3', expected an angle, or the holes of the plane in the job, [planes.P1] "
        "holes = 12 or holes_deg = [0, 30, 75]",
    ),
    "no clock": (
        "run,plane,mass_g,clock\ntrial P1,P1,10,13:20\n",
        "row 2, column clock: found '13:20', expected a time of the clock face, such as 10:20",
    ),
    "radians or degrees": (
        "Run,Plane,Mass (g),Angle\ntrial P1,P1,10,3\n",
        "row 1, column Angle: found 'Angle', expected its unit, as in 'Angle (deg)' or 98°: angles so small "
        "may be radians",
    ),
    "no unit in one cell": (
        "run,plane,weight,angle_deg\ntrial P1,P1,10 g,3\ntrial P2,P2,10,3\n",
        "row 3, column weight: found '10', expected a number in g, as row 2 says",
    ),
}


@each_of("name", QUESTIONS)
def test_what_is_not_clear_in_weights_is_asked_about(tmp_path, name):
    weights, message = QUESTIONS[name]
    assert refused(trials_of, tmp_path, PUMP, weights) == f"{tmp_path}/weights.csv, {message}"


def test_a_hole_that_the_plane_does_not_have(tmp_path):
    weights = "run,plane,mass_g,hole\ntrial P1,P1,10,9\n"
    words = refused(job_of, tmp_path, EIGHT, runs=PUMP, weights=weights)
    assert "column hole: found '9', expected a hole of plane 'P1'" in words


def test_a_hole_where_material_is_taken_away_needs_the_action(tmp_path):
    settings = EIGHT.replace("[planes.P1]", "[planes.P1]\nremove = true")
    weights = "run,plane,mass_g,hole\ntrial P1,P1,10,3\n"
    words = refused(job_of, tmp_path, settings, runs=PUMP, weights=weights)
    assert "expected a column action with add or remove" in words
    removed = "run,plane,mass_g,hole,action\ntrial P1,P1,10,3,remove\n"
    removed += "trial P2,P2,10,3,add\n"
    trials = job_of(tmp_path, settings, runs=PUMP, weights=removed).trials
    np.testing.assert_allclose(trials.weights[1:], [[-0.01j, 0], [0, 0.01j]], rtol=1e-12, atol=1e-17)


EXCHANGED = """\
run,speed_rpm,sensor,amplitude_mm_s_rms,phase_deg
0,1480,A,176,3.51
0,1480,B,258,2.59
1,1480,A,113,2.23
1,1480,B,240,2.09
2,1480,A,194,3.09
2,1480,B,300,4.17
"""
EXCHANGED_WEIGHTS = "run,plane,mass_g,angle_deg\n1,P1,10,0\n2,P2,10,0\n"


def test_exchanged_columns_are_asked_about_and_the_answer_is_a_key(tmp_path, cli):
    files = {"runs": EXCHANGED, "weights": EXCHANGED_WEIGHTS}
    settings = 'runs = "runs.csv"\nweights = "weights.csv"\n'
    words = refused(job_of, tmp_path, settings, **files)
    assert words.count("?") == 1
    outcome = cli("balance", tmp_path / "job.toml")
    assert (outcome.code, outcome.out) == (2, "")
    answers = ("exchanged = false", "exchanged = true")
    assert all(answer in words for answer in answers)
    readings = [job_of(tmp_path, settings + answer, **files).trials for answer in answers]
    plain, exchanged = (trials.labels.vibration(trials.readings) for trials in readings)
    np.testing.assert_allclose(plain[0].ravel()[:2], [176, 258])
    np.testing.assert_allclose(exchanged[0], plain[1], rtol=1e-12)
    np.testing.assert_allclose(exchanged[1], plain[0], rtol=1e-12)


def test_small_phases_of_large_amplitudes_with_decimals_are_no_exchange(tmp_path):
    assert trials_of(tmp_path, EXCHANGED.replace(",176,", ",176.2,")).sensors == ("A", "B")


CHECKED = """\
runs = "runs.csv"
weights = "weights.csv"
check = "check.csv"
check_weights = "pieces.csv"
[planes.P1]
holes = 8
available_g = [1, 2]
[planes.P2]
holes = 8
available_g = [1, 2]
"""
CHECK = "run,speed_rpm,sensor,amplitude_mm_s,phase_deg\ncheck,1485,DE,0.5,10\ncheck,1485,NDE,0.4,20\n"


def test_the_holes_of_a_check_run_are_taken(tmp_path):
    """What the job says itself counts first; weights between the holes say nothing of holes."""
    files = {"runs": PUMP, "weights": PLAIN_WEIGHTS, "check": CHECK}
    holes = job_of(tmp_path, CHECKED, **files, pieces=PIECES).holes
    np.testing.assert_allclose(holes["P1"].taken, [0.003, 0, 0, 0, 0, 0, 0, 0])
    np.testing.assert_allclose(holes["P2"].taken, [0, 0, 0, 0.004, 0, 0.01, 0, 0])
    stated = CHECKED.replace("[planes.P2]", 'taken = { "2" = 7 }\n[planes.P2]')
    holes = job_of(
        tmp_path, stated, **files, pieces=PIECES.replace("135.0", "140.0").replace(",4,", ",,")
    ).holes
    np.testing.assert_allclose(holes["P1"].taken, [0, 0.007, 0, 0, 0, 0, 0, 0])
    assert not holes["P2"].taken.any()


def test_a_trim_leaves_the_holes_of_the_pieces_alone(tmp_path, cli):
    files = {"runs": PUMP, "weights": PLAIN_WEIGHTS, "pieces": PIECES}
    job = job_of(tmp_path, CHECKED, **files, check=CHECK)
    trials = job.trials
    W = balancing.estimate_influence(trials).W[0]
    size, phase = trials.labels.vibration(trials.readings[0, 0, 0] + W @ job.check.weights[0])
    check = CHECK.replace("0.5,10", f"{size[0]:.4f},{phase[0]:.3f}").replace(
        "0.4,20", f"{size[1]:.4f},{phase[1]:.3f}"
    )
    job_of(tmp_path, CHECKED, **files, check=check)
    rows = cli("balance", tmp_path / "job.toml", "--split", "--refine", "--json").json["mounting"]["holes"]
    used = {(row["plane"], row["hole"]) for row in rows}
    assert used
    assert not used & {("P1", "1"), ("P2", "4"), ("P2", "6")}


def test_the_speeds_of_the_sensors_of_one_steady_run_are_one(tmp_path):
    runs = PUMP.replace("1485,DE", "1486.02,DE").replace("1485,NDE", "1482.7,NDE")
    trials = trials_of(tmp_path, runs)
    np.testing.assert_allclose(trials.speeds, [1484.36 * np.pi / 30], rtol=1e-12)
    assert trials.readings.shape == (1, 3, 1, 2)
    assert trials.warnings == ("speeds within 0.5 % count as one: 1482.7, 1486.02 as 1484.36 rpm",)
    words = refused(trials_of, tmp_path, runs, speed_tolerance_percent=0.1)
    assert "readings of run 'as found'" in words or "a reading of sensor" in words
    twice = runs + "trial P2,1484,DE,3.6,188\n"
    assert "one speed: run 'trial P2' has 1486.02 as well" in refused(trials_of, tmp_path, twice)


WRONG_KINDS = {
    "modes": (["modes", "modes/modes.csv"], "it seems to be a table of modes", 1),
    "exchanged": (
        ["balance", "bk_two_plane/weights.csv", "bk_two_plane/runs.csv"],
        "it seems to be a weights",
        2,
    ),
    "rotor": (["critical", "bk_two_plane/runs.csv"], "it seems to be a runs table", 1),
}


@each_of("name", WRONG_KINDS)
def test_the_wrong_kind_of_file_is_one_message(name, cli):
    (command, *files), words, lines = WRONG_KINDS[name]
    outcome = cli(command, *(sample_data() / file for file in files))
    assert (outcome.code, outcome.out) == (2, "")
    assert words in outcome.err
    assert outcome.err.strip().count("\n") == lines - 1


def test_fractions_are_no_vectors(tmp_path):
    runs = wide("Run,rpm,DE,DE deg,Batch", "{},1485,{},{},1/12").replace("DE,DE deg", "DE Amp,DE deg")
    assert "found 'Batch', expected a known column" in refused(trials_of, tmp_path, runs)


def test_a_header_that_was_taken_out_is_none(tmp_path):
    assert "found '//run', expected a known column" in refused(trials_of, tmp_path, f"//{PUMP}")


def test_a_column_list_stands_once(tmp_path):
    runs = PUMP.replace("phase_deg", "phase_deg,who,when,why").replace("\n", ",,,\n").replace("why,,,", "why")
    words = refused(trials_of, tmp_path, runs)
    assert words.count("remarks go into 'note'") == 1
    assert "found 'who, when and why', expected known columns: run, speed_rpm" in words


def test_a_plane_without_a_trial_weight_is_named(tmp_path):
    files = {"runs": PUMP, "weights": PLAIN_WEIGHTS.replace("trial P2,P2,10,270\n", "")}
    words = refused(job_of, tmp_path, EIGHT, **files)
    assert "no trial weight in plane 'P2'" in words
    assert "\n" not in words
