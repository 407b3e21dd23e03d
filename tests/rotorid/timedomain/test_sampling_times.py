"""Choice of sampling times: against repeated fits, enumeration, and differences of the solution."""

from itertools import combinations

import numpy as np
import pytest

from rotorid.samples import sample_data
from rotorid.timedomain import Record, ode_model
from rotorid.timedomain.sampling_times import design_times
from rotorid.workflows.fit import FitOptions
from rotorid.workflows.fit import fit as work

FOLDER = sample_data() / "fit" / "quasilinearization"
TRUTH = np.array([0.7, 2.0, 0.4])
T = np.linspace(0.0, 6.0, 9)


def decay():
    return ode_model({"x": "u0 - k*x"}, initial={"x": "x0"}, estimate={"k": 1.0, "x0": 1.0, "u0": 0.0})


def closed(t, k, x0, u0):
    return u0 / k + (x0 - u0 / k) * np.exp(-k * t)


def slopes(t):
    step = 1e-6 * np.eye(3)
    return np.column_stack([(closed(t, *(TRUTH + h)) - closed(t, *(TRUTH - h))) / 2e-6 for h in step])


@pytest.mark.parametrize("n", [3, 4, 5])
def test_the_choice_is_the_best_of_all(n):
    found = design_times(decay(), TRUTH, T, n, sigma={"x": 0.05})
    J = slopes(T) / 0.05
    best = max(combinations(range(9), n), key=lambda c: np.linalg.det(J[list(c)].T @ J[list(c)]))
    assert tuple(found.chosen) == best
    part = J[list(best)]
    assert found.std == pytest.approx(np.sqrt(np.diag(np.linalg.inv(part.T @ part))), rel=1e-6)
    assert found.std_all == pytest.approx(np.sqrt(np.diag(np.linalg.inv(J.T @ J))), rel=1e-6)


def test_inputs_between_candidates_are_those_of_the_record():
    model = ode_model({"x": "u - k*x"}, initial={"x": 0.0}, estimate={"k": 1.0}, inputs=["u"])
    pulse = Record(np.array([1.0, 1.4, 1.5, 1.6, 5.0]), inputs={"u": np.array([0.0, 0.0, 10.0, 0.0, 0.0])})
    found = design_times(model, [1.0], [1.0, 3.0, 5.0], 1, sigma={"x": 0.1}, driven_by=pulse)
    # after a pulse of area 1 at 1.5: x = exp(-(t - 1.5)) but for its width, dx/dk = -(t - 1.5) x
    ages = np.array([1.5, 3.5])
    assert found.std_alone[1:, 0] == pytest.approx(0.1 / (ages * np.exp(-ages)), rel=0.01)
    assert np.isinf(found.std_alone[0, 0])
    with pytest.raises(ValueError, match="a record with the input u"):
        design_times(model, [1.0], [1.0, 3.0], 1, sigma={"x": 0.1})
    for outside in ([0.5, 3.0], [2.0, 5.5]):
        with pytest.raises(ValueError, match="must lie from 1 to 5 s"):
            design_times(model, [1.0], outside, 1, sigma={"x": 0.1}, driven_by=pulse)


def test_initial_values_stay_where_they_belong():
    late = design_times(decay(), TRUTH, [2.0, 3.0, 4.0], 3, sigma={"x": 1.0})
    J = slopes(np.array([2.0, 3.0, 4.0]))
    assert late.std == pytest.approx(np.sqrt(np.diag(np.linalg.inv(J.T @ J))), rel=1e-5)


def test_what_the_times_do_not_determine_is_said():
    found = design_times(decay(), TRUTH, [0.0], 1, sigma={"x": 1.0})
    assert np.isinf(found.std).tolist() == [True, False, True]
    assert found.summary().count("these times will not determine it") == 2
    assert list(found.to_frame().columns)[:2] == ["t_s", "chosen"]
    with pytest.raises(ValueError, match="choose from 1 to 1 of the 1 candidate times"):
        design_times(decay(), TRUTH, [0.0], 2, sigma={"x": 1.0})


def test_the_command_takes_the_start_or_the_record():
    model, record = FOLDER / "model.toml", FOLDER / "record_noisy.csv"
    start = {"theta1": 1.0, "theta2": -1.0, "theta3": -1.0}
    alone = work(model, options=FitOptions(start=start, sigma=0.02, design="0:10:0.5", choose=4))
    assert alone.fit is None
    assert alone.to_dict()["design"]["parameters"]["theta2"]["guess"] == -1.0
    assert len(alone.design.where) == 4
    assert alone.to_frame()["chosen"].sum() == 4
    assert alone.to_frame()["theta1_std"].isna().all()  # no time alone determines it
    with pytest.raises(ValueError, match="give a record after the model file"):
        alone.figure()
    both = work(model, record, FitOptions(sigma="auto", design=[1.0, 2.0, 3.0, 4.0]))
    assert both.design.guess == pytest.approx(both.fit.values)
    assert len(both.design.chosen) == 3


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({}, "give a record"),
        ({"design": "0:10:1"}, "--design needs the errors of the samples"),
        ({"design": "0:10:1", "sigma": "auto"}, "--design needs the errors of the samples"),
        ({"design": "0:10", "sigma": 1.0}, "use FIRST:LAST:STEP or a list"),
        ({"design": "1,x", "sigma": 1.0}, "use FIRST:LAST:STEP or a list"),
        ({"design": [], "sigma": 1.0}, "use FIRST:LAST:STEP or a list"),
        ({"design": "0:10:-1", "sigma": 1.0}, "the step must be positive"),
        ({"design": "0:10:0.001", "sigma": 1.0}, "at most 2000 times, not 10001"),
        ({"choose": 3}, "--choose belongs to --design"),
        ({"design": "0:10:1", "sigma": 1.0, "choose": 12}, "choose from 1 to 11"),
        ({"design": "-1:10:1", "sigma": 1.0}, "must lie from 0 to inf s"),
    ],
)
def test_what_cannot_be_is_refused(options, expected):
    with pytest.raises(ValueError, match=expected):
        work(FOLDER / "model.toml", options=FitOptions(**options))
