"""Balancing with a calibrated rotor: what it leaves on the true machine, its errors, the next trial run."""

import importlib.util
import shutil

import numpy as np
import pytest

import fem
from fem.parameters import with_parameters
from rotorid import read_job, read_rotor
from rotorid.commands.balance import BalanceOptions, balance
from rotorid.commands.choice_of_coefficients import choose, counted_before
from rotorid.samples import sample_data

FOLDER = sample_data() / "calibration"


@pytest.fixture(scope="module")
def machine():
    """What made the runs of the sample: the true coefficients of its planes, (S, C, P)."""
    spec = importlib.util.spec_from_file_location("make_calibration_data", FOLDER / "make_data.py")
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    rotor = with_parameters(read_rotor(FOLDER.parent / "compressor" / "rotor.toml"), made.MACHINE)
    sensors = [fem.Sensor(node, angle + made.TURNED[name]) for name, (node, angle) in made.SENSORS.items()]
    return fem.influence(rotor, made.PLANES, sensors, made.SPEEDS * np.pi / 30).W


@pytest.fixture(scope="module")
def shot():
    return balance(FOLDER / "later.toml")


def edited(tmp_path, job="later.toml", **changes):
    """The job in a folder of its own, with other text in its files."""
    shutil.copytree(FOLDER, tmp_path / "calibration")
    shutil.copytree(FOLDER.parent / "compressor", tmp_path / "compressor")
    for name, (old, new) in changes.items():
        file = tmp_path / "calibration" / name.replace("__", ".")
        text = file.read_text(encoding="utf-8")
        assert old in text
        file.write_text(text.replace(old, new, 1), encoding="utf-8")
    return tmp_path / "calibration" / job


def test_one_run_balances_the_true_machine_as_well_as_its_exact_coefficients(machine, shot):
    Y = read_job(FOLDER / "later.toml").trials.mean[0]
    exact = -np.linalg.lstsq(machine.reshape(-1, 2), Y.ravel(), rcond=None)[0]
    left = [np.sqrt(np.mean(np.abs(Y + machine @ D) ** 2)) for D in (shot.result.weights, exact)]
    before = np.sqrt(np.mean(np.abs(Y) ** 2))
    assert left[0] < 0.1 * before
    assert left[0] < 1.3 * left[1]
    # and the prediction of each reading holds what the machine then shows, within three of its deviations
    covariance = shot.result.after_covariance
    error = (shot.result.after - (Y + machine @ shot.result.weights)).ravel()
    z = np.stack((error.real, error.imag), axis=-1)
    squares = np.einsum("ni,nij,nj->n", z, np.linalg.inv(covariance.reshape(-1, 2, 2)), z)
    assert squares.max() < 18.0  # of 2 degrees of freedom: 1.2e-4
    assert shot.answer.judgement.startswith("Mount these weights")


def test_runs_that_made_the_calibration_do_not_count_twice(tmp_path):
    rotor = ('rotor = "../compressor/rotor.toml"', 'rotor = "calibrated.toml"')
    job = edited(tmp_path, "trial.toml", trial__toml=rotor, weights__csv=("trial,impeller 5,2000,90", ""))
    same = read_job(job)
    assert counted_before(same)
    assert choose(same)[0].trials is None  # the model's own
    text = (job.parent / "trial.csv").read_text(encoding="utf-8")
    (job.parent / "trial.csv").write_text(text.replace("base,", "first,"), encoding="utf-8")
    other = read_job(job)
    assert not counted_before(other)
    combined, bare = choose(other)
    assert combined.trials is not None
    assert bare is None
    alone = choose(other, "computed")[0]
    k = combined.planes.index("impeller 1")
    own = np.s_[..., 2 + 2 * k, 2 + 2 * k]
    assert (combined.channels()[own] < alone.channels()[own]).all()


def test_a_later_trial_in_all_planes_at_once_leaves_the_model_alone(tmp_path):
    rotor = ('rotor = "../compressor/rotor.toml"', 'rotor = "calibrated.toml"')
    job = edited(tmp_path, "trial.toml", trial__toml=rotor, trial__csv=("base,", "base ,"))
    found = read_job(job)
    assert choose(found)[0].trials is None


def test_a_model_that_contradicts_its_data_asks_for_a_trial_run(tmp_path):
    flag = ("needs_trial_run = false", "needs_trial_run = true")
    found = balance(edited(tmp_path, calibrated__toml=flag))
    assert found.answer.judgement.startswith("Make a trial run first: the calibrated model does not explain")
    assert any("make a trial run" in warning for warning in found.result.warnings)
    stated = balance(FOLDER / "later.toml", BalanceOptions(coefficients="computed"))
    assert not any("trial run, which" in warning for warning in stated.result.warnings)


@pytest.mark.parametrize(
    ("contradicted", "first"), [("true", "the calibrated model does not"), ("false", "the rotor on its")]
)
def test_a_model_without_a_steady_response_gives_no_weights(contradicted, first, tmp_path):
    flag = ("needs_trial_run = false", f"needs_trial_run = {contradicted}")
    path = edited(tmp_path, calibrated__toml=flag)
    seal = "seal = [\n", "seal = [\n    { node = 12, kxx_N_per_m = -1e10, kyy_N_per_m = -1e10 },\n"
    rotor = path.parent / "calibrated.toml"
    rotor.write_text(rotor.read_text(encoding="utf-8").replace(*seal), encoding="utf-8")
    with pytest.raises(ValueError, match=first + ".*statically unstable.*cross-coupling"):
        balance(path)
