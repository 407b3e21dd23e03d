"""Weights tables as people and spreadsheets write them, and the pieces of a check run."""

from __future__ import annotations

import datetime

import numpy as np
import pytest
from cases import each_of
from pump_job import EIGHT_HOLES, PUMP, WEIGHTS, assert_same, job_of, refused, trials_of, write
from tables_data import write_book

from balancing import UndeterminedError, estimate_influence
from rotorid.files import read_trials

SAME = {
    "capitals": "Run,Plane,Mass (g),Angle (deg)\ntrial P1,P1,10,90\ntrial P2,P2,10,270\n",
    "brackets": "Run,Plane,Weight [g],Angle\nTrial P1,P1,10,90°\nTrial P2,P2,10,270°\n",
    "units in cells": "run,plane,weight,angle\ntrial P1,P1,10 g,90°\ntrial P2,P2,10 g,270 deg\n",
    "clock in the angle": "run,plane,mass_g,angle_deg\ntrial P1,P1,10,3:00\ntrial P2,P2,10,9 o'clock\n",
    "hole or blade": "run,plane,mass_g,hole,blade\ntrial P1,P1,10,3,\ntrial P2,P2,10,,7\n",
    "position": "run,plane,mass_g,Position\ntrial P1,P1,10,3\ntrial P2,P2,10,7\n",
    "hole in the angle": "run,plane,mass_g,angle\ntrial P1,P1,10,hole 3\ntrial P2,P2,10,#7\n",
    "columns for each plane": "Run,P1 weight (g),P1 angle (deg),P2 weight (g),P2 angle (deg)\n"
    "as found,,,,\ntrial P1,10,90,,\ntrial P2,,,10,270\n",
    "units row and a title": "Pump 3\n\nTest,Plane,Amount,Location\n,,g,deg\n"
    "trial P1,P1,10,90\ntrial P2,P2,10,270\n",
    "two that add up": "run,plane,mass_g,angle_deg\ntrial P1,P1,4,90\ntrial P1,P1,6,90\ntrial P2,P2,10,-90\n",
}


@each_of("name", SAME)
def test_each_way_to_write_weights_is_the_same(tmp_path, name):
    assert_same(job_of(tmp_path, weights=SAME[name]).trials, job_of(tmp_path).trials)


def test_the_clock_runs_with_the_angles_of_the_job(tmp_path):
    """A spreadsheet takes a clock for a time."""
    write(tmp_path, runs=PUMP)
    cells = [["run", "plane", "mass_g", "clock"], ["trial P1", "P1", 10, datetime.time(10, 20)]]
    book = write_book(tmp_path / "weights.xlsx", {"weights": cells})
    for angles, sign in (("with rotation", 1), ("against rotation", -1)):
        trials = read_trials(tmp_path / "runs.csv", book, phase="lag", angles=angles)
        np.testing.assert_allclose(trials.weights[1], 0.01 * np.exp(1j * np.radians(sign * 310)), rtol=1e-12)


@pytest.mark.parametrize(
    ("heading", "unit", "si"),
    [
        ("Weight [oz·in]", "oz_in", 0.45359237 / 16 * 0.0254),
        ("Weight, grams", "g", 1e-3),
        ("Weight [g·mm]", "g_mm", 1e-6),
    ],
)
def test_units_of_weights_as_people_write_them(tmp_path, heading, unit, si):
    trials = trials_of(tmp_path, weights=f'run,plane,"{heading}",angle_deg\ntrial P1,P1,2,0\n')
    assert trials.labels.weight_unit == unit
    np.testing.assert_allclose(trials.weights[1], [2 * si], rtol=1e-14)


BAD = {
    "no holes": ("mass_g,hole", "10,3", "row 2, column hole: found '3', expected an angle, or the holes of"),
    "hole and blade": ("mass_g,hole,blade", "10,3,4", "row 2, column hole: found '3', expected nothing here"),
    "no clock": ("mass_g,clock", "10,13:20", "row 2, column clock: found '13:20', expected a time of the"),
    "radians or degrees": ("Mass (g),Angle", "10,3", "row 1, column Angle: found 'Angle', expected its unit"),
    "nothing": ("mass_g,angle_deg", "0,3", "row 2, column mass_g: found '0', expected a weight above 0"),
    "blank mass": ("mass_g,angle_deg", ",3", "row 2, column mass_g: found nothing (a blank), expected a num"),
    "no mass": ("angle_deg", "3", "row 1, column mass_g: expected a column mass_g"),
}
ROWS = {
    "row 3, column weight: found '10', expected a number in g, as row 2": (
        "run,plane,weight,angle_deg\ntrial P1,P1,10 g,3\ntrial P2,P2,10,3\n"
    ),
    "row 2, column run: found 'trialP1', expected a run of the runs table (did you mean 'trial P1'?)": (
        "run,plane,mass_g,angle_deg\ntrialP1,P1,10,3\n"
    ),
    "row 2, column run: found nothing (a blank), expected a name": ("run,plane,mass_g,angle_deg\n,P1,10,3\n"),
    "row 3, column run: found 'trial P1', expected each weight once (row 2 says the same)": (
        "run,plane,mass_g,angle_deg\ntrial P1,P1,10,3\ntrial P1,P1,10,3\n"
    ),
    "row 4, column P2 angle (deg): found '400', expected an angle from -360": (
        SAME["columns for each plane"].replace(",10,270", ",10,400")
    ),
} | {words: f"run,plane,{header}\ntrial P1,P1,{row}\n" for header, row, words in BAD.values()}


@each_of("message", ROWS)
def test_what_is_wrong_or_not_clear_has_one_message(tmp_path, message):
    words = refused(trials_of, tmp_path, weights=ROWS[message])
    assert words.startswith(f"{tmp_path}/weights.csv, {message}")
    assert "\n" not in words


def test_holes_that_there_are_and_where_material_is_taken_away(tmp_path):
    words = refused(job_of, tmp_path, weights="run,plane,mass_g,hole\ntrial P1,P1,10,9\n")
    assert "column hole: found '9', expected a hole of plane 'P1'" in words
    settings = EIGHT_HOLES.replace("[planes.P1]", "[planes.P1]\nremove = true")
    words = refused(job_of, tmp_path, settings, weights="run,plane,mass_g,hole\ntrial P1,P1,10,3\n")
    assert "expected a column action with add or remove" in words
    removed = "run,plane,mass_g,hole,action\ntrial P1,P1,10,3,remove\ntrial P2,P2,10,3,add\n"
    trials = job_of(tmp_path, settings, weights=removed).trials
    np.testing.assert_allclose(trials.weights[1:], [[-0.01j, 0], [0, 0.01j]], rtol=1e-12, atol=1e-17)


def test_no_weights(tmp_path):
    """No table, one without rows (nothing was mounted), an empty file, and none in one plane."""
    assert trials_of(tmp_path).weights.shape == (3, 0)
    trials = trials_of(tmp_path, weights=WEIGHTS.splitlines()[0])
    assert (trials.planes, trials.weights.shape) == ((), (3, 0))
    with pytest.raises(UndeterminedError, match="no run has a trial weight, so the effect of none is"):
        estimate_influence(trials)
    words = refused(job_of, tmp_path, weights=WEIGHTS.replace("trial P2,P2,10,270\n", ""))
    assert "no trial weight in plane 'P2'" in words
    assert "\n" not in words


PIECES = """\
plane,action,hole,angle_deg,mass,unit,pieces
P1,add,1,0.0,3.0,g,1.000 + 2.000
P2,add,4,135.0,4.0,g,4.000
P2,add,6,225.0,10.000000000000002,g,2.000 + 8.000
"""
CHECKED = 'check = "check.csv"\ncheck_weights = "pieces.csv"\n'
CHECKED += EIGHT_HOLES.replace("holes = 8", "holes = 8\navailable_g = [1, 2]\nstock = [3, 2]")
CHECK = "run,speed_rpm,sensor,amplitude_mm_s,phase_deg\ncheck,1485,DE,{},{}\ncheck,1485,NDE,{},{}\n"


def test_the_pieces_that_a_split_wrote_are_those_of_the_check_run(tmp_path):
    """Their holes are taken, they are out of stock; also what the job says is taken; weights between holes
    take none.

    The table names no run: it is the only one, whatever its name.
    """
    check = CHECK.format(0.5, 10, 0.4, 20).replace("check", "fifth run")
    job = job_of(tmp_path, CHECKED, check=check, pieces=PIECES)
    turn = np.exp(1j * np.radians([0, 135, 225]))
    np.testing.assert_allclose(job.check.weights[0], [0.003, 0.004 * turn[1] + 0.01 * turn[2]], rtol=1e-12)
    assert job.holes["P1"].stock.tolist() == [2, 1]
    np.testing.assert_allclose(job.holes["P2"].taken, [0, 0, 0, 0.004, 0, 0.01, 0, 0])
    stated = CHECKED.replace("[planes.P2]", 'taken = { "2" = 7 }\n[planes.P2]')
    between = PIECES.replace("135.0", "140.0").replace(",4,", ",,")
    holes = job_of(tmp_path, stated, check=check, pieces=between).holes
    np.testing.assert_allclose(holes["P1"].taken, [0.003, 0.007, 0, 0, 0, 0, 0, 0])
    assert not holes["P2"].taken.any()


def test_tables_of_a_check_run_add(tmp_path):
    """Pieces and the trim beside them: one weight a plane, their holes taken, both files named."""
    check, turn = CHECK.format(0.5, 10, 0.4, 20), np.exp(1j * np.radians([0, 135, 225]))
    trim = "plane,action,hole,angle_deg,mass_mg,pieces\nP2,add,4,135.0,2000,2.000\nP2,remove,2,45,1000,1\n"
    several = CHECKED.replace('"pieces.csv"', '["pieces.csv", "trim.csv"]')
    job = job_of(tmp_path, several, check=check, pieces=PIECES, trim=trim)
    P2 = 0.006 * turn[1] + 0.011 * turn[2]
    np.testing.assert_allclose(job.check.weights[0], [0.003, P2], rtol=1e-12)
    np.testing.assert_allclose(job.holes["P2"].taken, [0, 0, 0, 0.006, 0, 0.011, 0, 0])
    assert {"pieces.csv", "trim.csv"} < {file.name for file in job.files}
    words = refused(job_of, tmp_path, several, check=check, pieces=PIECES, trim=trim.replace("_mg", "_g_mm"))
    assert "trim.csv" in words
    assert "pieces.csv, in g" in words
