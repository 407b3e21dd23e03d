"""Exports of instruments: the same content as a runs table, or one message that says what to change."""

from __future__ import annotations

import csv
import io
import re
from dataclasses import fields

import numpy as np
import pytest
from cases import each_of
from tables_data import RUNS, WEIGHTS, csv_text, write_book, write_csv

from rotorid.files import InputError, read_job, read_trials

UNITS_ROW = """\
run,speed,sensor,amplitude,phase
,rpm,,um pp,deg
initial,1000,A,7.2,238
initial,1000,B,13.5,296
trial 1,1000,A,4.9,114
trial 1,1000,B,9.2,347
trial 2,1000,A,4.0,79
trial 2,1000,B,12.0,292
"""
PREAMBLE = """\
Vibration analyser 7;serial 12,5 / "B"
Date;1.5.2024;10:30;
Speed: 1000 rpm;Phase: see below

Run;Speed (rpm);Sensor;Amplitude (µm pk-pk);Phase (°)
initial;1000;A;7,2;238
initial;1000;B;13,5;296
trial 1;1000;A;4,9;114
trial 1;1000;B;9,2;347
trial 2;1000;A;4,0;79
trial 2;1000;B;12,0;292
"""
CELLS_WITH_UNITS = """\
Run\tSpeed\tSensor\tAmplitude\tPhase
initial\t1000 rpm\tA\t7.2 um pp\t238°
initial\t1000 rpm\tB\t13.5 µm p-p\t296 deg
trial 1\t1000 rpm\tA\t4.9UM PP\t114°
trial 1\t1000 rpm\tB\t9.2 um peak to peak\t347 °
trial 2\t1000 RPM\tA\t4.0 um pp\t79 degrees
trial 2\t1000 rpm\tB\t12.0 um pp\t292°
"""
VECTORS = """\
RUN;RPM;PROBE;1X [um pp]
initial;1000;A;7,2 @ 238°
initial;1000;B;13,5<296°
trial 1;1000;A;4,9∠114°
trial 1;1000;B;9,2 / 347°
trial 2;1000;A;4,0@79 deg
trial 2;1000;B;12,0 < 292°
"""
VECTORS_WITH_UNITS = """\
Run no.,Shaft speed [r/min],Point,Vector
initial,1000,A,7.2 um pp @ 238
initial,1000,B,13.5 um pp @ 296
trial 1,1000,A,4.9 um pp @ 114
trial 1,1000,B,9.2 um pp @ 347
trial 2,1000,A,4.0 um pp @ 79
trial 2,1000,B,12.0 um pp @ 292
"""
SLASHES = """\
run,speed_rpm,sensor,Amplitude / Phase (um pp / deg)
initial,1000,A,7.2 / 238
initial,1000,B,13.5 / 296
trial 1,1000,A,4.9 / 114
trial 1,1000,B,9.2 / 347
trial 2,1000,A,4.0 / 79
trial 2,1000,B,12.0 / 292
"""
HEADINGS = """\
Phase angle [°],1X Ampl. pk-pk [um],Channel,Speed rpm,Run
238,7.2,A,1000,initial
296,13.5,B,1000,initial
114,4.9,A,1000,trial 1
347,9.2,B,1000,trial 1
79,4.0,A,1000,trial 2
292,12.0,B,1000,trial 2
"""
WIDE = """\
run,speed_rpm,A_amplitude_um_pp,A_phase_deg,B_amplitude_um_pp,B_phase_deg,note
initial,1000,7.2,238,13.5,296,cold
trial 1,1000,4.9,114,9.2,347,
trial 2,1000,4.0,79,12.0,292,
"""
WIDE_COMMAS = """\
sep=;
Run;Speed (rpm);A 1X Ampl (um pp);A 1X Phase (deg);B 1X Ampl (um pp);B 1X Phase (deg);
initial;1000;7,2;238;13,5;296;
trial 1;1000;4,9;114;9,2;347;
trial 2;1000;4,0;79;12,0;292;
"""
WIDE_VECTORS = """\
Run;RPM;A;B
;;um pp;um pp
initial;1000;7,2 @ 238°;13,5 @ 296°
trial 1;1000;4,9 @ 114°;9,2 @ 347°
trial 2;1000;4,0 @ 79°;12,0 @ 292°
"""
WIDE_BY_WORD = """\
Balancing protocol
Pump 3
run,Speed,Ampl A,Phase A,Ampl B,Phase B
-,rpm,um p-p,deg,um p-p,deg
initial,1000,7.2,238,13.5,296
trial 1,1000,4.9,114,9.2,347
trial 2,1000,4.0,79,12.0,292
"""
SENSORS_1_2 = """\
run,speed (rpm),1 ampl (um pp),1 phase (deg),2 ampl (um pp),2 phase (deg)
initial,1000,7.2,238,13.5,296
trial 1,1000,4.9,114,9.2,347
trial 2,1000,4.0,79,12.0,292
"""
PROBES_X_Y = SENSORS_1_2.replace("1 ampl", "1X ampl").replace("1 phase", "1X phase")
PROBES_X_Y = PROBES_X_Y.replace("2 ampl", "1Y ampl").replace("2 phase", "1Y phase")
COMMENTS = """\
# made by hand; 5,5
Pump 3, as found

"# quoted; comment";;
Run;Speed (rpm);Sensor;Amplitude;Phase
# and here
;;;um pp;°

initial;1000;A;7,2;238
initial;1000;B;13,5;296
trial 1;1000;A;4,9;114
# between
trial 1;1000;B;9,2;347
trial 2;1000;A;4,0;79
trial 2;1000;B;12,0;292
"""
LABELS = """\
Run,Speed (Hz),Sensor,Amplitude,Phase (rad)
initial,20,A,7.2,2.38
initial,20,B,13.5,2.96
trial 1,20,A,4.9,1.14
trial 1,20,B,9.2,3.47
trial 2,20,A,4.0,0.79
trial 2,20,B,12.0,2.92
"""
DIRECTION = PREAMBLE.replace("Phase (°)", "Phase lag (°)").replace("238", "238 lag")
READ = {
    "units row": UNITS_ROW,
    "preamble": PREAMBLE,
    "cells with units": CELLS_WITH_UNITS,
    "vectors": VECTORS,
    "vectors with units": VECTORS_WITH_UNITS,
    "slashes": SLASHES,
    "headings": HEADINGS,
    "wide": WIDE,
    "wide, commas": WIDE_COMMAS,
    "wide, vectors": WIDE_VECTORS,
    "wide, by word": WIDE_BY_WORD,
    "sensors 1 and 2": SENSORS_1_2,
    "probes X and Y": PROBES_X_Y,
    "comments": COMMENTS,
    "labels": LABELS,
    "direction": DIRECTION,
}
SENSORS = {"sensors 1 and 2": ("1", "2"), "probes X and Y": ("1X", "1Y")}
DIGITS = [["7.2", "238"], ["13.5", "296"], ["4.9", "114"], ["9.2", "347"], ["4.0", "79"], ["12.0", "292"]]


def tidy_text(name):
    """The same content as a runs table, in the same digits."""
    names = dict(zip("AB", SENSORS.get(name, "AB"), strict=True))
    rows = [[line[0], "1000", names[line[2]], *digits] for line, digits in zip(RUNS[1:], DIGITS, strict=True)]
    if name == "labels":
        rows = [[run, "20", sensor, size, f"{int(phase) / 100:g}"] for run, _, sensor, size, phase in rows]
        return csv_text([["run", "speed_Hz", "sensor", "amplitude", "phase_rad"], *rows])
    return csv_text([RUNS[0], *rows])


def job_text(*, phase="lag", more=""):
    return f'runs = "runs.csv"\nweights = "weights.csv"\nphase = "{phase}"\n{more}'


def read(folder, text, more="", **options):
    """Read a job of these runs."""
    (folder / "runs.csv").write_text(text, encoding="utf-8")
    write_csv(folder / "weights.csv", WEIGHTS)
    (folder / "job.toml").write_text(job_text(more=more, **options), encoding="utf-8")
    return read_job(folder / "job.toml")


def refused(folder, text, more="", **options):
    """The one message about a job of these runs, without the folder."""
    with pytest.raises(InputError) as caught:
        read(folder, text, more, **options)
    return str(caught.value).replace(f"{folder}/", "")


def assert_same(a, b):
    """All that trials hold: names, readings, weights, digits, units, and without further words."""
    for field in fields(a):
        one, other = getattr(a, field.name), getattr(b, field.name)
        if isinstance(one, np.ndarray):
            np.testing.assert_array_equal(one, other, err_msg=field.name)
        else:
            assert one == other, field.name


def sheet_of(text):
    """Cells of a sheet: numbers as numbers, where they have a decimal point or none; the rest as text."""
    lines = text.splitlines()
    separator = ";" if ";" in text else "\t" if "\t" in text else ","
    cells = [next(csv.reader(io.StringIO(line), delimiter=separator), []) for line in lines]
    number = re.compile(r"[0-9]+(\.[0-9]+)?")
    return [
        [float(cell) if number.fullmatch(cell) else cell or None for cell in line]
        for line in cells
        if not line[:1] or not line[0].startswith("sep=")
    ]


@each_of("name", READ)
def test_an_export_is_read_as_the_same_runs_table(tmp_path, name):
    assert_same(read(tmp_path, READ[name]).trials, read(tmp_path, tidy_text(name)).trials)


@each_of("name", READ)
def test_the_same_as_a_sheet(tmp_path, name):
    """The digits are those that a sheet keeps, 4 of 4.0."""
    write_book(tmp_path / "tidy.xlsx", {"runs": sheet_of(tidy_text(name))})
    write_book(tmp_path / "export.xlsx", {"runs": sheet_of(READ[name])})
    weights = write_csv(tmp_path / "weights.csv", WEIGHTS)
    tidy = read_trials(tmp_path / "tidy.xlsx", weights, phase="lag")
    assert_same(read_trials(tmp_path / "export.xlsx", weights, phase="lag"), tidy)


VECTOR = "expected amplitude and phase, unmistakable as 6.93 @ 98°"
EXPLAINED = {
    "radians or degrees": (
        re.sub("(?m)^[0-9]+,", "3,", HEADINGS.replace("Phase angle [°]", "Phase")),
        "runs.csv, row 1, column Phase: found 'Phase', expected "
        "its unit, as in 'Phase (deg)' or 98°: phases so small may be radians",
    ),
    "radians or degrees in vectors": (
        re.sub(r"([@<∠/]) ?[0-9]+(°| deg)", r"\1 3", VECTORS.replace(" / ", "@")),
        "runs.csv, row 1, column 1X [um pp]: found '1X [um pp]', expected its unit, as in "
        "'Phase (deg)' or 98°: phases so small may be radians",
    ),
    "amplitude units differ": (
        CELLS_WITH_UNITS.replace("4.9UM PP", "4.9 mil pp"),
        "runs.csv, row 4, column Amplitude: found '4.9 mil pp', expected a number in um_pp, as row 2 says",
    ),
    "peak or peak to peak": (
        CELLS_WITH_UNITS.replace("4.9UM PP", "4.9um"),
        "runs.csv, row 4, column Amplitude: found '4.9um', expected a number in um_pp, as row 2 says",
    ),
    "two speeds": (
        HEADINGS.replace("\n", ",1001\n").replace("Run,1001", "Run,RPM"),
        "runs.csv, row 1, column RPM: found 'RPM', expected one column of the speed, and 'Speed rpm' could "
        "be it too: begin the name of one with note",
    ),
    "no run": (
        re.sub(r",[^,\n]*\n", "\n", HEADINGS),
        "runs.csv, row 1, column run: expected a column run; the columns are Channel, Speed rpm, 1X "
        "Ampl. pk-pk [um] and Phase angle [°]",
    ),
    "lag and lead": (
        DIRECTION.replace("238 lag", "238 lead"),
        "runs.csv, row 6, column Phase lag (°): found '238 lead', expected phases that lag, as the job says "
        'or is assumed: state phase = "lag" or "lead" in the job, as the instrument shows it, without words '
        "here",
    ),
    "two orders": (
        SENSORS_1_2.replace("1 ampl", "1X ampl").replace("2 ampl", "2X ampl"),
        "runs.csv, row 1, column 2X ampl (um pp): found '2X ampl (um pp)', expected readings at the running "
        "speed (1X) alone: delete the column, or begin its name with note (if it is a probe: with P)",
    ),
    "fractions": (
        VECTORS.replace("∠114°", " / 114"),
        "runs.csv, row 4, column 1X [um pp]: found '114', expected a number in deg, as row 2 says",
    ),
    "a comma beside the sign": (
        VECTORS.replace("@79", "@,79"),
        f"runs.csv, row 6, column 1X [um pp]: found '4,0@,79 deg', {VECTOR}",
    ),
    "a sensor without a phase": (
        WIDE.replace("B_phase_deg", "note 2"),
        "runs.csv, row 1, column B_amplitude_um_pp: found 'B_amplitude_um_pp', expected amplitude and "
        "phase of each sensor, in columns such as 'A amplitude' and 'A phase'",
    ),
    "sensors in a column and in headings": (
        WIDE.replace("run,", "run,sensor,").replace("\ninitial,", "\ninitial,A,").replace("\ntrial ", "\nt,"),
        "runs.csv, row 1, column A_amplitude_um_pp: found 'A_amplitude_um_pp', expected the amplitude alone, "
        "as another column has the sensors: leave 'A' out, or begin the name with note",
    ),
    "a sensor in another unit": (
        WIDE.replace("B_amplitude_um_pp", "B_amplitude_mil_pp"),
        "runs.csv, row 1, column B_amplitude_mil_pp: found 'B_amplitude_mil_pp', expected the unit of all "
        "sensors, amplitude_um_pp",
    ),
    "a reading without its sensor": (
        WIDE.replace("B_", ""),
        "runs.csv, row 1, column amplitude_um_pp: found 'amplitude_um_pp', expected amplitude and phase "
        "of each sensor, in columns such as 'A amplitude' and 'A phase'",
    ),
    "units row against headings": (
        UNITS_ROW.replace("amplitude,", "amplitude_um,"),
        "runs.csv, row 2, column amplitude (um, um pp): found 'amplitude (um, um pp)', expected a unit of "
        "vibration, such as um pp or mm/s rms, not 'um, um pp' (a label: amplitude_div)",
    ),
    "units row with a word": (
        UNITS_ROW.replace("um pp", "um px"),
        "runs.csv, row 2, column amplitude (um px): found 'amplitude (um px)', expected a unit of vibration, "
        "such as um pp or mm/s rms, not 'um px' (a label: amplitude_div)",
    ),
    "a unit against the heading": (
        PREAMBLE.replace("4,9", "4,9 um"),
        "runs.csv, row 8, column Amplitude (µm pk-pk): found '4,9 um', expected a number in um_pp, as the "
        "heading says",
    ),
    "thousands": (
        VECTORS.replace("4,9∠", "1.004,9∠"),
        "runs.csv, row 4, column 1X [um pp]: found '1.004,9', expected a number without thousands separators",
    ),
    "commas between commas": (
        VECTORS_WITH_UNITS.replace("4.9 um pp @ 114", '"4,9 um pp @ 114"'),
        "runs.csv, row 4, column Vector: found '4,9', expected a number with a decimal point: in a "
        "comma-separated file a comma is not a decimal sign (separate by ;)",
    ),
}


@each_of("name", EXPLAINED)
def test_what_is_not_clear_is_explained_in_one_message(tmp_path, name):
    text, message = EXPLAINED[name]
    assert refused(tmp_path, text) == message


def test_a_phase_that_says_lag_must_be_what_the_job_says(tmp_path):
    for phase in ("lag", "lead"):
        text = PREAMBLE.replace("Phase (°)", f"Phase ({phase}, deg)")
        assert read(tmp_path, text, phase=phase).conventions.labels.phase == phase
        other = {"lag": "lead", "lead": "lag"}[phase]
        assert f"expected phases that {other}, as the job says" in refused(tmp_path, text, phase=other)
