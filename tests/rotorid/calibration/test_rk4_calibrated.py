"""A real rig calibrated by three runs: the weights of eight other runs at two speeds are known (sample rk4).

Bounds: 4 g·mm in the sum of both discs, and for a disc the 9 g·mm with which the source's own influence
coefficients, from the same three runs, estimate them at best.
"""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from rotorid import read_job
from rotorid.commands.choice_of_coefficients import choose
from rotorid.samples import sample_data

FOLDER = sample_data() / "rk4"
SPEEDS = (1206, 1005)
PUBLISHED, SUM = 9.0, 4.0  # g·mm


@cache
def example():
    path = Path(__file__).resolve().parents[3] / "examples" / "rk4_calibrated.py"
    spec = importlib.util.spec_from_file_location("examples_rk4_calibrated", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@cache
def found(speeds):
    return example().calibration(speeds, 560, 1e6)


def estimates(rpm, kind, rotor=None):
    """Of the eight other runs, and errors of disc 1, disc 2 and their sum, g·mm rms."""
    coefficients = example().known(rpm, kind, rotor)
    all_ = [example().estimated(coefficients, one, "weighted") for one in example().others(rpm).values()]
    assert len(all_) == 8
    return all_, np.sqrt(np.mean([each.errors**2 for each in all_], axis=0))


@pytest.mark.parametrize("rpm", SPEEDS)
def test_combined_with_the_trial_runs_at_a_speed_that_did_not_calibrate(rpm):
    (other,) = {*SPEEDS} - {rpm}
    rotor = found((other,)).rotor
    job = read_job(FOLDER / example().JOBS[rpm][0])
    combined, measured = (choose(replace(job, rotor=rotor), kind)[0] for kind in (None, "measured"))
    assert len(combined.columns()) > len(measured.columns())
    runs, (disc_1, disc_2, both) = estimates(rpm, "combined", rotor)
    assert both <= SUM
    assert max(disc_1, disc_2) <= PUBLISHED
    assert np.all([each.inside for each in runs])
