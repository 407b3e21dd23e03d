"""A real rig calibrated by three runs: the weights of eight other runs at two speeds are known (sample rk4).

Bounds: 4 g·mm in the sum of both discs, and for a disc the 9 g·mm with which the source's own influence
coefficients, from the same three runs, estimate them at best.
"""

from __future__ import annotations

import importlib.util
import re
import shlex
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from repetitions import FULL

from rotorid import read_job, read_rotor
from rotorid.samples import sample_data
from rotorid.workflows.calibration.calibrate import CalibrateOptions, calibrate
from rotorid.workflows.coefficients import choose

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
def found(speeds, span=560, stiffness=1e6):
    return example().calibration(speeds, span, stiffness)


def estimates(rpm, kind, rotor=None, method="weighted"):
    """Of the eight other runs, and errors of disc 1, disc 2 and their sum, g·mm rms."""
    coefficients = example().known(rpm, kind, rotor)
    all_ = [example().estimated(coefficients, one, method) for one in example().others(rpm).values()]
    assert len(all_) == 8
    return all_, np.sqrt(np.mean([each.errors**2 for each in all_], axis=0))


@pytest.mark.full
@pytest.mark.parametrize("method", ["weighted", "least-squares"])
@pytest.mark.parametrize("rpm", SPEEDS)
@pytest.mark.parametrize("speeds", [SPEEDS, (1206,), (1005,)], ids=str)
def test_weights_of_other_runs_at_both_speeds_also_from_the_other_one_alone(speeds, rpm, method):
    runs, (disc_1, disc_2, both) = estimates(rpm, "computed", found(speeds).rotor, method)
    assert both <= SUM
    assert max(disc_1, disc_2) <= PUBLISHED
    assert np.all([each.inside for each in runs])  # 24 regions of 95 %


@pytest.mark.parametrize("rpm", SPEEDS)
def test_beside_the_trial_runs_alone_with_the_same_errors_and_method(rpm):
    """The discs are better than with plain coefficients; the sum may be worse, by less than 0.4 g·mm."""
    plain, model = (
        estimates(rpm, kind, rotor)[1]
        for kind, rotor in (("measured", None), ("computed", found(SPEEDS).rotor))
    )
    assert (model[:2] < plain[:2]).all()
    assert model[2] < plain[2] + 0.4


@pytest.mark.parametrize("rpm", SPEEDS)
def test_combined_with_the_trial_runs_at_a_speed_that_did_not_calibrate(rpm):
    (other,) = {*SPEEDS} - {rpm}
    rotor = found((other,)).rotor
    assert choose(replace(read_job(FOLDER / example().JOBS[rpm][0]), rotor=rotor))[0].parameters is not None
    runs, (disc_1, disc_2, both) = estimates(rpm, "combined", rotor)
    assert both <= SUM
    assert max(disc_1, disc_2) <= PUBLISHED
    assert np.all([each.inside for each in runs])


def test_what_the_runs_determine_and_what_not():
    one = found(SPEEDS)
    assert one.explained
    assert one.other_ends == ()
    share = dict(zip(one.prior.rows.own, one.prior.share, strict=True))
    determined = {name for name, value in share.items() if value > 0.8}
    gains = {f"probe[{name}].gain" for name in example().PROBES}
    assert determined == {*gains, "bearing.tilting_stiffness", "key_phasor.angle"}
    unknown = {name for name, value in share.items() if value < 0.05}
    assert {"bearing.kxx", "bearing.kyy", "bearing.cxx", "bearing.cyy"} <= unknown


@pytest.mark.full
@pytest.mark.parametrize("stiffness", [1e6, 7e4] if FULL else [7e4])
def test_the_runs_contradict_a_distance_of_480_mm_between_the_bearings(stiffness):
    assert not found(SPEEDS, 480, stiffness).explained
    assert found(SPEEDS, 480, stiffness).chi_square > found(SPEEDS).chi_square + 40


@pytest.mark.full
def test_they_do_not_contradict_bearings_five_times_as_soft():
    assert found(SPEEDS, 560, 2e5).explained
    assert abs(found(SPEEDS, 560, 2e5).chi_square - found(SPEEDS).chi_square) < 4


@pytest.mark.full
def test_other_starts_end_at_the_same_numbers():
    start = read_rotor(FOLDER / "rotor.toml")
    files = [FOLDER / name for name in ("few.toml", "few_1005.toml")]
    options = CalibrateOptions(estimate=example().ESTIMATE, prior=example().PRIOR, starts=10 if FULL else 5)
    again = calibrate(start, files, options).found
    assert again.other_ends == ()
    assert again.chi_square == pytest.approx(found(SPEEDS).chi_square, rel=1e-6)
    assert (np.abs(again.values - found(SPEEDS).values) < 1e-3 * found(SPEEDS).std).all()


@pytest.mark.full
def test_the_command_of_the_sample_makes_its_calibrated_rotor(tmp_path, cli, monkeypatch):
    (line,) = re.findall(r"^rotorid (calibrate .*)$", (FOLDER / "README.md").read_text("utf-8"), re.MULTILINE)
    monkeypatch.chdir(FOLDER)
    words = shlex.split(line)
    assert cli(*words[:-1], str(tmp_path / words[-1])).code == 0
    new, kept = (read_rotor(folder / "calibrated.toml") for folder in (tmp_path, FOLDER))
    assert new.calibration.names == kept.calibration.names
    np.testing.assert_allclose(new.calibration.values, kept.calibration.values, rtol=1e-7)
    np.testing.assert_allclose(new.calibration.std, kept.calibration.std, rtol=1e-6)
    np.testing.assert_allclose(new.calibration.correlation, kept.calibration.correlation, atol=1e-6)
    assert new.calibration.data == kept.calibration.data
    assert {*words} >= {example().ESTIMATE, example().PRIOR}


@pytest.mark.parametrize(("few", "all_"), [("few.toml", "job.toml"), ("few_1005.toml", "job_1004.toml")])
def test_the_small_jobs_hold_the_trial_runs_as_an_instrument_counts(few, all_):
    """The mirror image of the large job: the same weights in its own words."""
    small, large = read_job(FOLDER / few).trials, read_job(FOLDER / all_).trials
    rows = [large.runs.index(run) for run in ("BASE", "A007", "A015")]
    assert small.runs == ("BASE", "A007", "A015")
    np.testing.assert_array_equal(small.readings, large.readings[:, rows].conj())
    np.testing.assert_array_equal(small.weights, large.weights[rows].conj())
