"""Runs that do not determine the weights, trials that are too weak, and runs that disagree: every message."""

import numpy as np
import pytest
from balancing_data import GRAM, bruel_kjaer, complex_normal, job, polar, synthetic
from cases import each_of

from balancing import (
    Influence,
    Labels,
    ReadingErrors,
    Trials,
    UndeterminedError,
    correct,
    estimate_influence,
)

RNG = np.random.default_rng(11)


def refused(trials):
    with pytest.raises(UndeterminedError) as error:
        estimate_influence(trials)
    return str(error.value)


def with_weights(T):
    return synthetic(np.random.default_rng(1), planes=np.shape(T)[1], weights=np.asarray(T) * GRAM)[0]


def test_a_baseline_that_the_runs_do_not_determine():
    words = refused(with_weights([[1, 0], [0, 1]]))
    assert "do not determine the vibration without weights" in words
    assert "add a baseline run" in words


def test_two_planes_whose_weights_always_stand_in_one_proportion():
    words = refused(with_weights([[0, 0, 0], [1, 1j, 0], [2, 2j, 0], [0, 0, 1]]))
    assert "no run separates plane 'A' from plane 'B'" in words
    assert "add a run with a weight in only one of them" in words
    assert "'C'" not in words


def test_three_planes_that_the_runs_do_not_separate():
    words = refused(with_weights([[0, 0, 0], [1, 1, 1], [2, 1, 1]]))
    assert "'B'" in words
    assert "'C'" in words
    assert "3 different sets of weights; 3 planes need at least 4" in words


def test_neither_baseline_nor_planes():
    words = refused(with_weights([[1, 1], [2, 2]]))
    assert "no run separates plane 'A' from plane 'B'" in words


def test_the_same_weights_in_every_run():
    words = refused(with_weights([[1], [1]]))
    assert "add a baseline run" in words


def test_a_zero_trial_weight():
    words = refused(with_weights([[0, 0], [1, 0], [0, 0]]))
    assert "no run has a weight greater than zero in plane 'B'" in words


def test_a_trial_that_changed_nothing():
    readings = [[1.0, 2.0], [1.0, 2.0], [1.5j, 2.5]]
    words = refused(job(readings, np.array([[0, 0], [1, 0], [0, 1]]) * GRAM))
    assert "the trial weight in plane 'A' (run 'run 1') changed no reading" in words


def test_a_trial_within_the_errors_of_the_readings():
    readings = [[polar(1, 0), polar(2, 10)], [polar(1.02, 1), polar(2.03, 10)], [1.5j, 2.5]]
    T = np.array([[0, 0], [1, 0], [0, 1]]) * GRAM
    words = refused(job(readings, T, errors=ReadingErrors(0.03, np.deg2rad(2))))
    assert "plane 'A' (run 'run 1')" in words
    assert "no more than their errors explain" in words
    # without stated errors nobody knows, but the engineers' rule warns
    influence = estimate_influence(job(readings, T))
    assert any("plane 'A' changed no reading by 30 % or 30°" in w for w in influence.notes)
    assert not any("plane 'B'" in w for w in influence.notes)


def test_one_sensor_that_sees_the_trial_is_enough():
    """A clear change of one reading counts although a hundred other sensors see nothing."""
    quiet = np.ones(100)
    readings = np.array([[1.0, *quiet], [1.3, *quiet]])
    influence = estimate_influence(job(readings, [[0], [GRAM]], errors=ReadingErrors(0.03, 0.03)))
    assert abs(influence.W[0, 0, 0]) == pytest.approx(0.3 / GRAM)


def test_a_repeated_set_of_weights_is_fine_and_averages():
    readings = [[1.0], [1.2], [3.0]]
    influence = estimate_influence(job(readings, np.array([[0], [0], [1]]) * GRAM))
    assert influence.baseline[0, 0] == pytest.approx(1.1, rel=0.01)
    assert influence.error_source == "residuals"
    # two numbers tell the size: the region is that of Student with about as many degrees of freedom
    assert 1.5 < influence.dof < 5


def test_runs_that_disagree_by_more_than_the_stated_errors_are_named():
    T = np.array([[0], [0], [1], [1]]) * GRAM
    readings = [[1.0], [1.01], [3.0], [2.0]]
    influence = estimate_influence(job(readings, T, errors=ReadingErrors(0.01, 0.01)))
    assert any("the runs disagree by" in w and "run" in w for w in influence.warnings)
    agreeing = estimate_influence(job([[1.0], [1.01], [3.0], [2.98]], T, errors=ReadingErrors(0.01, 0.01)))
    assert agreeing.warnings == ()


def test_planes_that_act_alike():
    influence, _, _ = _influence(np.array([[1, 2, 1], [2, 4, 0], [3, 6, 1j]]))
    with pytest.raises(
        UndeterminedError, match="planes 'A' and 'B' act alike at every sensor and speed"
    ) as error:
        correct(influence)
    assert "0.5 times that weight does in 'B'" in str(error.value)
    # without one of them the others are determined
    assert correct(influence, planes=["A", "C"]).rank == 2


def test_a_third_plane_that_follows_from_two():
    influence, _, _ = _influence(np.array([[1, 2, 3], [2, 1, 3], [0, 1j, 1j], [1, 0, 1]]))
    with pytest.raises(UndeterminedError, match="planes 'A', 'B', 'C' act alike"):
        correct(influence)


def test_more_planes_than_readings():
    influence, _, _ = _influence(np.array([[1, 2]]))
    with pytest.raises(UndeterminedError, match="2 planes need at least 2 readings"):
        correct(influence)


def test_a_plane_without_effect_at_the_chosen_speed():
    W = np.array([[[1, 0], [1, 0]], [[1, 2], [2, 1]]])
    influence = Influence(np.array([100.0, 200.0]), ("1", "2"), ("A", "B"), W, baseline=np.ones((2, 2)))
    with pytest.raises(UndeterminedError, match="plane 'B' has no effect"):
        correct(influence, speeds=[100.0])


def test_planes_that_act_nearly_alike_are_a_warning():
    influence, _, _ = _influence(np.array([[1, 2, 0], [2, 4.01, 0], [0, 0, 1], [1, 2, 1]]))
    c = correct(influence)
    assert c.condition_number > 100
    assert any("planes 'A', 'B' act nearly alike" in w for w in c.warnings)


def test_a_speed_left_out_where_the_vibration_rises_is_named():
    W = np.array([[[1.0]], [[-1.0]]])
    influence = Influence(np.array([100.0, 200.0]), ("1",), ("A",), W, baseline=np.ones((2, 1)))
    c = correct(influence, speeds=100.0)
    assert any("1909.86 rpm, a speed left out is predicted to rise from 1 to 2" in w for w in c.warnings)


def test_many_rising_readings_are_counted_not_listed():
    W = np.concatenate(([10.0], np.linspace(0.5, 1, 9)))[None, :, None]
    Y0 = np.concatenate(([-10.0], 0.1 + 0.01 * np.arange(9)))[None]
    c = correct(Influence(np.array([100.0]), tuple("abcdefghij"), ("A",), W, baseline=Y0))
    assert len(c.notes) == 3
    assert "sensor 'j' at 954.93 rpm is predicted to rise from 0.18 to" in c.notes[0]
    assert c.notes[-1].endswith("6 more readings rise less")


def test_stored_coefficients_need_a_baseline_and_take_one():
    known = estimate_influence(bruel_kjaer())
    stored = Influence(known.speeds, known.sensors, known.planes, known.W, labels=known.labels)
    with pytest.raises(ValueError, match="give the readings of a baseline run"):
        correct(stored)
    c = correct(stored, known.baseline)
    np.testing.assert_allclose(c.weights, correct(known).weights)
    assert c.mounted is None
    assert c.covariance is None


def test_runs_with_weights_serve_as_baseline_of_stored_coefficients():
    """Y₀ = Y − W T: the total weights do not depend on what is mounted in the new run."""
    known = estimate_influence(bruel_kjaer(errors=ReadingErrors(0.02, 0.02)))
    T = np.array([[0.7, 0.2j]]) * GRAM
    reading = known.baseline + (known.W @ T[0])
    new = Trials(("now",), known.speeds, known.sensors[::-1], known.planes, reading[None, :, ::-1], T)
    c = correct(known, new)
    np.testing.assert_allclose(c.weights, correct(known).weights)
    np.testing.assert_allclose(c.to_add, c.weights - T[0])
    assert c.covariance is not None


def test_errors_of_the_baseline_alone_are_said_to_be_too_small():
    known = estimate_influence(bruel_kjaer())
    stored = Influence(known.speeds, known.sensors, known.planes, known.W, labels=known.labels)
    new = Trials(
        ("b",), known.speeds, known.sensors, (), known.baseline[None], np.zeros((1, 0)), ReadingErrors(0.02)
    )
    c = correct(stored, new)
    assert c.mass_std is not None
    assert any("errors of the influence coefficients are not known" in w for w in c.warnings)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"sensors": ("1", "x")}, "no readings of sensor '2'"),
        ({"speeds": np.array([110.0])}, "no baseline readings at 954.93 rpm"),
        ({"planes": ("C",), "weights": np.array([[GRAM]])}, "plane 'C', for which there are no influence"),
    ],
)
def test_baseline_runs_that_do_not_fit(change, message):
    known = estimate_influence(bruel_kjaer(sensors=("1", "2")))
    fields = {
        "sensors": ("1", "2"),
        "speeds": known.speeds,
        "planes": (),
        "weights": np.zeros((1, 0)),
    } | change
    new = Trials(runs=("b",), readings=known.baseline[None], **fields)
    with pytest.raises(ValueError, match=message):
        correct(known, new)


def test_unknown_planes_and_speeds():
    influence = estimate_influence(bruel_kjaer())
    with pytest.raises(ValueError, match="there is no plane 'Z'; the planes are 'A', 'B'"):
        correct(influence, planes=["Z"])
    with pytest.raises(ValueError, match=r"no coefficients at 1909\.86 rpm"):
        correct(influence, speeds=[200.0])
    with pytest.raises(ValueError, match="each once"):
        correct(influence, planes=["A", "A"])
    with pytest.raises(ValueError, match="a speed is given twice"):
        correct(influence, speeds=[100.0, 100.1])


@each_of(
    ("change", "message"),
    [
        ({"sensors": ("1", "1")}, "sensors need different names; found twice: 1"),
        ({"runs": ()}, "there are no runs"),
        ({"speeds": np.array([-1.0])}, "greater than zero"),
        ({"speeds": np.array([1.0, 1.0])}, "only once"),
        ({"speeds": np.array(1.0)}, "shape"),
        ({"weights": np.zeros((2, 2))}, "weights must have shape"),
        (
            {"weights": np.array([[0, 0], [np.nan, 0], [0, 1]])},
            "plane 'A' of run 'run 1' is not a finite number",
        ),
        ({"readings": np.ones((3, 2))}, "readings must have shape"),
        ({"readings": np.full((1, 3, 1, 2), np.nan)}, "sensor '1' in run 'run 0' at 954.93 rpm is missing"),
        ({"readings": np.full((1, 3, 1, 2), np.inf)}, "is infinite"),
    ],
)
def test_impossible_trials(change, message):
    fields = {
        "runs": ("run 0", "run 1", "run 2"),
        "speeds": np.array([100.0]),
        "sensors": ("1", "2"),
        "planes": ("A", "B"),
        "readings": np.ones((1, 3, 1, 2)),
        "weights": np.zeros((3, 2)),
    }
    with pytest.raises(ValueError, match=message):
        Trials(**(fields | change))


def test_a_reading_after_a_gap_is_not_lost_silently():
    readings = np.ones((3, 1, 1, 1), dtype=complex)
    readings[1] = np.nan
    with pytest.raises(ValueError, match="missing"):
        Trials(("0",), np.array([1.0]), ("1",), ("A",), readings, np.zeros((1, 1)))


@pytest.mark.parametrize("bad", [{"amplitude": -0.1}, {"phase": np.nan}, {"floor": np.inf}])
def test_impossible_errors(bad):
    with pytest.raises(
        ValueError, match=f"the {next(iter(bad))} error of a reading must be a finite number ≥ 0"
    ):
        ReadingErrors(**bad)


def test_errors_that_are_all_zero():
    with pytest.raises(ValueError, match="all zero"):
        ReadingErrors()


def _influence(W):
    """Coefficients of one speed as stored ones would be, with a random vibration to correct."""
    sensors = tuple(str(i + 1) for i in range(len(W)))
    planes = tuple("ABC"[: W.shape[1]])
    Y0 = complex_normal(RNG, (1, len(W)))
    return Influence(np.array([100.0]), sensors, planes, W[None], baseline=Y0, labels=Labels()), W, Y0
