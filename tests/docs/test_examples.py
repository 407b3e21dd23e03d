"""The scripts of `examples/` run, print, write pictures only when asked to, and their numbers stay."""

import contextlib
import functools
import importlib.util
import inspect
import io
import os
import subprocess
import sys
from pathlib import Path

import pytest
from docs_blocks import blocks, first_difference

from rotorid import read_ode_model
from rotorid.base.compiled import COMPILED

pytestmark = pytest.mark.full
FOLDER = Path(__file__).parents[2] / "examples"
PINNED = {
    "balance_a_machine": {
        "left_g_mm": 422.983707,
        "left_deg": 168.931814,
        "largest_before_um_pp": 59.7,
        "largest_after_um_pp": 0.648889174,
        "largest_with_pieces_um_pp": 4.98415698,
        "largest_in_check_um_pp": 0.96,
        "trim_left_g_mm": 13.6524444,
    },
    "balance_workflow": {
        "holes": 7,
        "largest_after_um_pp": 1.93020928,
        "readings_that_pass": 20,
    },
    "plan_a_trial_weight": {
        "plain_g": 24.8405346,
        "aimed_deg": 345,
        "modelled_g_mm": 340.033712,
        "modelled_deg": 188.354075,
        "rms_ratio": 0.648286754,
    },
    "rk4": {
        "reading_um": 0.0414698597,
        "run_um": 0.362017947,
        "correlation": 3.02952677,
        "cosine": 0.939968935,
        "sum_um_per_g_mm": 0.882868546,
        "couple_um_per_g_mm": 0.036482639,
    },
    "rk4_calibrated": {
        "both_1206_disk_1": 7.60284254,
        "both_1206_disk_2": 7.38648847,
        "both_1206_sum": 1.66897445,
        "other_1206_disk_1": 8.54412015,
        "other_1206_disk_2": 8.04304263,
        "other_1206_sum": 2.08058216,
        "both_1005_disk_1": 7.12475894,
        "both_1005_disk_2": 6.52582693,
        "both_1005_sum": 2.27974234,
        "other_1005_disk_1": 7.13345203,
        "other_1005_disk_2": 6.34780518,
        "other_1005_sum": 2.43263777,
    },
    "rotor_critical_speeds": {
        "first_critical_rpm": 4066.83591,
        "second_critical_rpm": 4375.18551,
        "first_of_campbell_rpm": 4176.22143,
        "peak_rpm": 4391.83902,
        "peak_um": 3.23613447,
        "amplification": 8.2880193,
        "stability_threshold_rpm": 10932.3852,
    },
    "reduce_for_control": {
        "m7_kg": 134.203177,
        "m12_kg": 196.616759,
        "m18_kg": 157.082577,
        "second_frequency_error": -0.00310917753,
        "states": 12,
        "slowest_decay": -1.35235759,
        "largest_response_error": 0.0471078292,
    },
    "reduce_and_run_up": {
        "mass_kg": 558.534651,
        "load_N": 2789.69582,
        "threshold_rpm": 6407.8,
        "rotor_threshold_rpm": 6407.0,
        "damped_threshold_rpm": 11748.1,
        "whip_rpm": 1302,
        "whip_eccentricity": 0.91,
        "first_critical_rpm": 1416,
        "second_critical_rpm": 5413,
    },
    "identify_bearings": {
        "kxx": 89446567.2,
        "kxy": 30189073.8,
        "kyx": -80283272.4,
        "kyy": 160399371,
        "bxx": 499890.834,
        "bxy": -148301.027,
        "byx": -152711.932,
        "byy": 804743.576,
        "intervals_that_hold_the_truth": 8,
        "condition_number": 5.65612548,
        "worse_kyy_std": 55.5954149,
    },
    "fit_a_record": {
        "d_x7": 880.813588,
        "d_x12": 1595.42826,
        "d_x18": 1333.92006,
        "m_x12": 196.590976,
        "blow": 0.050019356,
        "residual_rms": 1.90700340,
        "largest_difference_of_methods_in_std": 0,
    },
}
PICTURES = ("balance_a_machine", "rotor_critical_speeds", "identify_bearings", "fit_a_record")


def load(name):
    spec = importlib.util.spec_from_file_location(f"examples_{name}", FOLDER / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_example_is_pinned():
    assert {path.stem for path in FOLDER.glob("*.py")} == {*PINNED}


@pytest.fixture(scope="session")
def ran(tmp_path_factory):
    """What an example gives, prints and writes, as a function of its name; each runs once."""

    @functools.cache
    def run(name):
        if name == "reduce_and_run_up" and not COMPILED:
            pytest.skip("hours without the extra rotorid[fast]")
        folder, printed, module = tmp_path_factory.mktemp(name), io.StringIO(), load(name)
        with contextlib.chdir(folder), contextlib.redirect_stdout(printed):
            found = module.main()
        return found, printed.getvalue(), list(folder.iterdir())

    return run


@pytest.mark.parametrize("name", PINNED)
def test_the_numbers_of_an_example(name, ran):
    found, text, files = ran(name)
    assert found == pytest.approx(PINNED[name], rel=1e-6, abs=1e-6)
    assert all(type(value) in (int, float) for value in found.values())
    assert len(text.splitlines()) >= 10
    assert files == []


@pytest.mark.parametrize("name", PICTURES)
def test_pictures_on_request(name, tmp_path):
    module = load(name)
    module.main(str(tmp_path / "p.png"))
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")


def test_the_sheet_of_a_job_in_twelve_lines(tmp_path):
    module = load("balance_workflow")
    module.main(str(tmp_path / "sheet.html"))
    assert "Balancing sheet: turbo_job" in (tmp_path / "sheet.html").read_text(encoding="utf-8")
    lines = inspect.getsource(module.main).splitlines()
    assert len(lines) <= 12


def test_the_model_file_of_a_reduction_is_read_by_fit(tmp_path):
    load("reduce_for_control").main(str(tmp_path / "small.toml"))
    model = read_ode_model(tmp_path / "small.toml")
    assert list(model.parameters) == ["d_x7", "d_x12", "d_x18"]


def test_the_page_on_the_masses_in_motion_shows_what_its_example_prints(ran):
    _, text, _ = ran("reduce_and_run_up")
    (shown,) = [b for b in blocks(FOLDER / "book" / "motion.md") if b.kind == "text"]
    assert len(shown.text.splitlines()) >= 8
    assert first_difference(["...", *shown.text.splitlines()], text) is None


def test_the_methods_of_the_rig(capsys):
    load("rk4").main("weighted")
    assert "regions that hold the truth, of 8" in capsys.readouterr().out


def test_an_example_runs_as_a_script(tmp_path):
    done = subprocess.run(
        [sys.executable, "-W", "error", FOLDER / "plan_a_trial_weight.py"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env={**os.environ, "PYTHONIOENCODING": "utf-8"},
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert "24.84 g at the radius 200 mm" in done.stdout
    assert "rms with the trial weight: 64.8% of what it was" in done.stdout
