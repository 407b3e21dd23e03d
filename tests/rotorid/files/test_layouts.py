"""Runs tables as fitters and instruments write them: the same trials, or one message."""

from __future__ import annotations

import re

import numpy as np
import openpyxl
import pytest
from cases import each_of
from pump_job import EIGHT_HOLES, JOB, LONG, PUMP, WIDE, assert_same, job_of, refused, rows, trials_of, write
from tables_data import write_book

import balancing
from rotorid.files import read_trials
from rotorid.samples import sample_data

SIX, VECTORS = "{},1485,{},{},{},{}", "{},1485,{} @ {}°,{} @ {}°"
PREAMBLE = rows(
    'Analyser 7;serial 12,5 / "B"\nDate;1.5.2024;10:30;\nSpeed: 1000 rpm;Phase: see below\n\n'
    "Run;Speed (rpm);Sensor;Amplitude (mm/s peak);Phase (°)",
    "{};1485;{};{};{}",
    LONG,
).replace(".", ",")
COMMENTS = rows('# by hand; 5,5\nPump 3\n\n"# quoted; too";;\nRun;Speed (rpm);Sensor;Amplitude;Phase\n'
                "# and here\n;;;mm/s;°\n", "# between\n{};1485;{};{};{}", LONG)  # fmt: skip
CELLS = rows("Run\tSpeed\tSensor\tAmplitude\tPhase", "{}\t1485 rpm\t{}\t{} mm/s\t{}°", LONG)
NO_UNITS = rows("Phase,1X Ampl. pk [mm/s],Channel,Speed rpm,Run", "{3},{2},{1},1485,{0}", LONG)
UNITS_ROW = rows("run,speed,sensor,amplitude,phase\n,rpm,,mm/s,deg", "{},1485,{},{},{}", LONG)
LAG = rows("Run,RPM,Sensor,mm/s,Phase lag (°)", "{},1485,{},{},{} lag", LONG)
PROBE = rows("RUN;RPM;PROBE;1X [mm/s]", "{};1485;{};{} @ {}°", LONG)
ONE_UNIT = rows("Run,rpm,DE mm/s,DE deg,NDE mm/s,NDE deg", SIX)
WIDE_VECTORS = rows("Run,rpm,DE,NDE\n,,mm/s,mm/s", VECTORS)
TIDY = rows("run,speed_rpm,DE_amplitude_mm_s,DE_phase_deg,NDE_amplitude_mm_s,NDE_phase_deg,note", f"{SIX},x")
SAME = {
    "preamble": PREAMBLE,
    "comments": COMMENTS.replace(".", ","),
    "headings": NO_UNITS.replace("Phase", "Phase angle [°]"),
    "units row": UNITS_ROW,
    "lag": LAG,
    "vectors": PROBE,
    "wide, commas": rows(
        "sep=;\nRun;Speed (rpm);DE 1X Ampl (mm/s);DE 1X Phase (deg);NDE 1X Ampl (mm/s);NDE 1X Phase (deg);",
        "{};1485;{};{};{};{};",
    ).replace(".", ","),
    "wide vectors": WIDE_VECTORS,
    "L": rows("Run,RPM,DE,NDE", "{},1485,{} mm/s L{},{} mm/s L{}"),
    "sign and unit behind": rows("Run,RPM,DE mm/s@deg,NDE (mm/s / deg)", "{},1485,{}@{},{}/{}"),
    "coefficients beside": rows(
        "Date,Time,Run,Condition,RPM,DE overall,DE mm/s,DE deg,NDE mm/s,NDE deg,Amp. Coeff. plane 1",
        "2026-01-02,10:11,{},hot,1485,9.9,{},{},{},{},0.1",
    ),
} | {
    header: rows(header, SIX)
    for header in (
        "RUN #,SPEED RPM,DE AMP (MM/S),DE PHASE (DEG),NDE AMP (MM/S),NDE PHASE (DEG)",
        "Run,Speed rpm,DE Vib mm/s,DE Ph deg,NDE Vib mm/s,NDE Ph deg",
        "Run,rpm,DE,,NDE,\n,,mm/s,deg,mm/s,deg",
        ",,DE,,NDE,\nRun,rpm,Amp (mm/s),Phase (deg),Amp (mm/s),Phase (deg)",
        ",,DE,,NDE,\nRun,RPM,Amplitude,Phase,Amplitude,Phase\n,,mm/s,deg,mm/s,deg",
        ",,Pump 3,,,\nRun,rpm,DE mm/s,DE deg,NDE mm/s,NDE deg",
    )
}


@each_of("name", SAME)
def test_each_layout_is_the_same_runs(tmp_path, name):
    assert_same(trials_of(tmp_path, SAME[name]), trials_of(tmp_path))


@each_of("name", SAME)
def test_the_same_as_a_sheet(tmp_path, name):
    text = SAME[name].removeprefix("sep=;\n")
    separator = next(sign for sign in "\t;," if sign in text.splitlines()[-1])
    number = re.compile(r"[0-9]+(\.[0-9]+)?")
    cells = [
        [float(cell) if number.fullmatch(cell) else cell or None for cell in line.split(separator)]
        for line in text.replace('"', "").splitlines()
    ]
    sheet = read_trials(write_book(tmp_path / "runs.xlsx", {"runs": cells}), None, phase="lag")
    assert_same(sheet, trials_of(tmp_path))


EXPLAINED = {
    "radians or degrees": (
        re.sub("(?m)^[0-9]+,", "3,", NO_UNITS),
        "row 1, column Phase: found 'Phase', expected its unit, as in 'Phase (deg)'",
    ),
    "amplitude units differ": (
        CELLS.replace("10.4 mm/s", "10.4 mil"),
        "row 4, column Amplitude: found '10.4 mil', expected a number in mm_s, as row 2 says",
    ),
    "lag and lead": (
        LAG.replace("202 lag", "202 lead"),
        "row 4, column Phase lag (°): found '202 lead', expected phases that lag, as the job says",
    ),
    "two orders": (
        SAME["wide, commas"].replace("NDE 1X Ampl", "NDE 2X Ampl"),
        "row 1, column NDE 2X Ampl (mm/s): found 'NDE 2X Ampl (mm/s)', expected readings at the running",
    ),
    "a sensor in another unit": (
        TIDY.replace("NDE_amplitude_mm_s", "NDE_amplitude_in_s"),
        "row 1, column NDE_amplitude_in_s: found 'NDE_amplitude_in_s', expected the unit of all sensors",
    ),
    "a reading without its sensor": (
        TIDY.replace("NDE_", ""),
        "row 1, column amplitude_mm_s: found 'amplitude_mm_s', expected amplitude and phase of each sensor",
    ),
    "a unit against the heading": (
        PREAMBLE.replace("10,4", "10,4 um"),
        "row 8, column Amplitude (mm/s peak): found '10,4 um', expected a number in mm_s, as the heading",
    ),
    "three unknown columns": (
        PUMP.replace("_deg", "_deg,who,when,why").replace("\n", ",,,\n").replace("why,,,", "why"),
        "row 1: found 'who, when and why', expected known columns: run, speed_rpm",
    ),
}


@each_of("name", EXPLAINED)
def test_what_is_not_clear_is_explained_in_one_message(tmp_path, name):
    text, message = EXPLAINED[name]
    words = refused(trials_of, tmp_path, text)
    assert words.startswith(f"{tmp_path}/runs.csv, {message}")
    assert "\n" not in words


FAN = """\
Run,RPM,Bearing 1 mils,Bearing 1 deg,Bearing 2 mils,Bearing 2 deg
Original,1185,4.8,212,3.1,188
TW plane 1,1186,3.4,255,2.7,203
TW plane 2,1184,4.1,197,4.4,222
"""
FAN_WEIGHTS = "run,plane,mass_oz,angle_deg\nTW plane 1,1,2.5,0\nTW plane 2,2,2.5,0\n"


@pytest.mark.parametrize("form", ["sheet", "text", "merged"])
def test_two_rows_of_headings_and_the_weights_that_follow(tmp_path, form):
    """README: 4.332 oz at 42.7° and 1.668 oz at 113.2°, lag and against the rotation."""
    write(tmp_path, fan=FAN, weights=FAN_WEIGHTS)
    runs = tmp_path / "fan.csv"
    if form != "text":
        runs, book = tmp_path / "fan.xlsx", openpyxl.Workbook()
        book.active.append(["Fan 3 - two plane"])
        book.active.append([None, None, "Bearing 1", None, "Bearing 2", None])
        book.active.append(["Run", "RPM", "mils", "deg", "mils", "deg"])
        for line in FAN.splitlines()[1:]:
            name, *numbers = line.split(",")
            book.active.append([name, *map(float, numbers)])
        for cells in ("A1:G1", "C2:D2", "E2:F2") if form == "merged" else ():
            book.active.merge_cells(cells)
        book.save(runs)
    trials = read_trials(runs, tmp_path / "weights.csv", phase="lag", angles="against rotation")
    assert trials.sensors == ("Bearing 1", "Bearing 2")
    assert (trials.labels.vibration_unit, trials.labels.weight_unit) == ("mil", "oz")
    weights = np.linalg.solve(balancing.estimate_influence(trials).W[0], -trials.readings[0, 0, 0])
    np.testing.assert_allclose(
        trials.labels.weight(weights), [[4.332, 1.668], [42.7, 113.2]], atol=0.06, rtol=2e-4
    )


@pytest.mark.parametrize(
    ("old", "new", "unit", "words"),
    [
        ("DE mm/s", "DE Velocity mm/s", "mm_s_rms", "is read as mm/s rms"),
        ("mm/s", "mm/s", "mm_s", "'DE mm/s' is read as mm/s peak"),
        ("mm/s", "ips", "in_s", ""),
    ],
)
def test_units_of_readings(tmp_path, old, new, unit, words):
    """mm/s alone are rms where the heading says velocity, and the warning says which."""
    trials = trials_of(tmp_path, ONE_UNIT.replace(old, new))
    assert trials.labels.vibration_unit == unit
    assert len(trials.warnings) == bool(words)
    assert all(words in word for word in trials.warnings)
    size, _ = trials.labels.vibration(trials.readings)
    np.testing.assert_allclose(size[0, :, 0, 0], [line[1] for line in WIDE], rtol=1e-14)


def test_what_the_headings_say_of_phases(tmp_path):
    runs = "Run,RPM,Amp (mils),Lag (deg)\nfirst,1185,4.8,212\nsecond,1185,3.4,255\n"
    trials = trials_of(tmp_path, runs, phase=None)
    assert (trials.sensors, trials.labels.phase, trials.labels.assumed) == (("1",), "lag", ())
    assert "expected phases that lead, as the job says" in refused(trials_of, tmp_path, runs, phase="lead")


def test_one_sensor_and_one_speed_need_no_columns(tmp_path):
    """The speed is the job's; two readings of one run are no single sensor."""
    runs = "Run,Amp (mils),Phase (deg)\nfirst,4.8,212\nsecond,3.4,255\n"
    tables = {"runs": runs, "weights": "run,plane,mass_oz,angle_deg\nsecond,1,2.5,0\n"}
    trials = job_of(tmp_path, f"{JOB}speed_rpm = 1185\n", **tables).trials
    assert (trials.sensors, trials.labels.speed_unit) == (("1",), "rpm")
    np.testing.assert_allclose(trials.speeds, [1185 * np.pi / 30], rtol=1e-15)
    assert "a column speed_rpm" in refused(trials_of, tmp_path, runs)
    tables["runs"] = runs.replace("\nfirst", "\nfirst,1.2,7\nfirst")
    assert "a column sensor" in refused(job_of, tmp_path, f"{JOB}speed_rpm = 1185\n", **tables)


STEP = "Sensor position;Rotational speed [rpm];Amplitude [mm/s RMS];Phase [°];Amp. Coeff. plane 1\n"
STEPS = {
    "step1": f"{STEP}Drive end;1490;6,21;123;\nFan end;1490;4,08;98;\n",
    "step2": f"{STEP}Drive end;1491;4,77;160;0,152\nFan end;1491;3,62;121;0,071\n",
}


@pytest.mark.parametrize("runs", ['["step1.csv", "step2.csv"]', '"steps"'])
def test_one_file_a_run(tmp_path, runs):
    (tmp_path / "steps").mkdir()
    write(tmp_path / "steps" if runs == '"steps"' else tmp_path, **STEPS)
    settings = f'runs = {runs}\nweights = "w.csv"\n'
    job = job_of(tmp_path, settings, w="run,plane,mass_g,angle_deg\nstep2,P1,10,0\n")
    assert (job.trials.runs, job.trials.sensors) == (("step1", "step2"), ("Drive end", "Fan end"))
    shown = np.reshape(job.trials.labels.vibration(job.trials.readings), (2, 4))
    np.testing.assert_allclose(shown, [[6.21, 4.08, 4.77, 3.62], [123, 98, 160, 121]], rtol=1e-13)
    assert {file.name for file in job.files} == {"job.toml", "step1.csv", "step2.csv", "w.csv"}
    if runs != '"steps"':
        words = refused(job_of, tmp_path, settings, step2=STEPS["step2"].replace("4,77", "n/a"))
        assert "step2.csv, row 2, column Amplitude [mm/s RMS]: found 'n/a'" in words
        assert "\n" not in words


def test_files_in_the_order_of_their_numbers(tmp_path):
    write(tmp_path, **{f"step{k}": STEPS["step1"] for k in (1, 2, 10)})
    assert read_trials(tmp_path, None, phase="lag").runs == ("step1", "step2", "step10")


def test_a_column_of_weights_among_the_readings_is_passed_over_and_said(tmp_path):
    runs = rows("Run,rpm,DE mm/s,DE deg,NDE mm/s,NDE deg,Trial weight (g)", f"{SIX},10 g at 90° in P1")
    trials = trials_of(tmp_path, runs)
    assert_same(trials, trials_of(tmp_path))
    assert len([word for word in trials.warnings if "'Trial weight (g)' is passed over" in word]) == 1


def test_exchanged_columns_are_asked_about_and_the_answer_is_a_key(tmp_path, cli):
    numbers = [(176, 3.51), (258, 2.59), (113, 2.23), (240, 2.09), (194, 3.09), (300, 4.17)]
    values = [(*row[:2], *pair) for row, pair in zip(LONG, numbers, strict=True)]
    runs = rows("run,speed_rpm,sensor,amplitude_mm_s_rms,phase_deg", "{},1485,{},{},{}", values)
    words = refused(job_of, tmp_path, runs=runs)
    assert words.count("?") == 1
    assert cli("balance", tmp_path / "job.toml").code == 2
    for answer, sign in (("exchanged = false", 1), ("exchanged = true", -1)):
        assert answer in words
        trials = job_of(tmp_path, f"{answer}\n{EIGHT_HOLES}", runs=runs).trials
        shown = np.reshape(trials.labels.vibration(trials.readings), (2, 6))[::sign]
        np.testing.assert_allclose(shown.T, numbers, rtol=1e-12)
    assert trials_of(tmp_path, runs.replace(",176,", ",176.2,")).sensors == ("DE", "NDE")


def test_the_speeds_of_the_sensors_of_one_steady_run_are_one(tmp_path):
    runs = PUMP.replace("1485,DE", "1486.02,DE").replace("1485,NDE", "1482.7,NDE")
    trials = trials_of(tmp_path, runs)
    np.testing.assert_allclose(trials.speeds, [1484.36 * np.pi / 30], rtol=1e-12)
    assert trials.warnings == ("speeds within 0.5 % count as one, such as 1482.7 rpm and 1486.02 rpm",)
    words = refused(trials_of, tmp_path, runs, speed_tolerance_percent=0.1)
    assert "a reading of sensor 'NDE' in run 'as found' at 1486.02 rpm" in words


@each_of(
    "command, files, words, lines",
    [
        ("modes", ["modes/modes.csv"], "there are mode, ", 1),
        ("balance", ["bk_two_plane/weights.csv", "bk_two_plane/runs.csv"], "there are run, ", 2),
        ("critical", ["bk_two_plane/runs.csv"], "names of columns", 1),
    ],
)
def test_the_wrong_kind_of_file_is_one_message(command, files, words, lines, cli):
    outcome = cli(command, *(sample_data() / file for file in files))
    assert (outcome.code, outcome.out) == (2, "")
    assert words in outcome.err
    assert len(outcome.err.strip().splitlines()) == lines
