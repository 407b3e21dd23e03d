"""Correction weights: closed forms, printed jobs, what must hold for every job, regions, and refusals."""

from dataclasses import replace

import numpy as np
import pytest
from balancing_data import (
    GRAM,
    bruel_kjaer,
    complex_normal,
    feese_grazier,
    job,
    limits_by_name,
    noisy,
    stored,
    synthetic,
)
from cases import each_of
from hypothesis import given, settings
from hypothesis import strategies as st
from repetitions import FULL, lowest_share

from balancing import Labels, ReadingErrors, Trials, UndeterminedError, correct, estimate_influence

ERRORS = ReadingErrors(0.01, 0.01)
seeds = st.integers(0, 2**32 - 1)
unhurried = settings(deadline=None, max_examples=100 if FULL else 10)  # a busy machine is no failure


def plain(trials, **options):
    return correct(estimate_influence(trials), method="least-squares", **options)


def rotor(seed, *, outside=0.0, effect=0.6, error=0.02):
    """A job with errors, of two planes, and the weights that would be right."""
    rng = np.random.default_rng(seed)
    W, D = complex_normal(rng, (3, 4, 2)), complex_normal(rng, 2)
    Y0 = -W @ D + outside * complex_normal(rng, (3, 4))
    T = np.vstack((np.zeros(2), effect * np.eye(2)))
    exact = Y0 + np.einsum("scp,rp->rsc", W, T)
    errors = ReadingErrors(error, error)
    return job(noisy(rng, exact, errors), T, errors=errors, speeds=[100.0, 150.0, 200.0]), D


def real(z):
    return np.ascontiguousarray(z).view(float)


# prints


def test_two_planes_of_application_note_17_227():
    c = correct(estimate_influence(bruel_kjaer()))
    shown = [(row["mass"], row["angle_deg"]) for row in c.to_dict()["corrections"]]
    assert np.allclose(shown, [(2.951, 50.2), (2.844, 278.1)], atol=0.05)
    assert np.abs(c.after).max() < 1e-12


def test_over_determined_example_of_goodman():
    """Goodman's weights minimise |Y + W D|, as the corrections here do, to 1e-9."""
    W = np.array([[[3, -2], [5, -2], [5, -3]]])
    c = correct(stored(W), np.array([[1, -1, 0]]))
    assert np.allclose(c.weights, np.linalg.lstsq(W[0], [-1, 1, 0], rcond=None)[0], rtol=1e-9)
    assert c.method == "least-squares"


def test_trial_weights_left_in_of_feese_and_grazier():
    c = plain(feese_grazier())
    assert c.mounted.run == "run 2"
    assert np.allclose(c.to_add + c.mounted.weights, c.weights, rtol=1e-12)
    assert "add if 'run 2' stays" in c.answer.whole()


@pytest.mark.parametrize("phase", ["lead", "lag"])
@pytest.mark.parametrize("angles", ["with rotation", "against rotation"])
def test_one_physical_job_in_every_convention(phase, angles):
    """The labels turn the numbers round; the weights stay where they are on the rotor."""
    labels = Labels("mm_s", 1e3, "g", 1e3, phase, angles)
    document = correct(estimate_influence(bruel_kjaer(labels=labels, errors=ERRORS))).to_dict()
    usual = correct(estimate_influence(bruel_kjaer(errors=ERRORS))).to_dict()
    sign = 1 if angles == "with rotation" else -1
    for row, other in zip(document["corrections"], usual["corrections"], strict=True):
        assert row["mass"] == pytest.approx(other["mass"], rel=1e-9)
        assert row["angle_deg"] == pytest.approx(sign * other["angle_deg"] % 360, abs=1e-6)
        flip = np.array([[1, sign], [sign, 1]])
        assert np.allclose(row["covariance"], other["covariance"] * flip, rtol=1e-6)
    first = document["residuals"][0]
    assert first["before"] == pytest.approx(7200)
    assert first["before_phase_deg"] == pytest.approx(238 if phase == "lead" else 122)


# what must hold for every job


@unhurried
@given(seeds, st.integers(1, 4), st.integers(1, 3))
def test_an_exact_job_gives_its_coefficients_and_the_least_squares_weights(seed, planes, speeds):
    trials, W, Y0 = synthetic(np.random.default_rng(seed), planes=planes, speeds=speeds)
    influence = estimate_influence(trials)
    assert np.allclose(influence.W, W, rtol=1e-9, atol=1e-9 * np.abs(W).max())
    assert np.allclose(influence.baseline, Y0, rtol=1e-9)
    expected = np.linalg.lstsq(W.reshape(-1, planes), -Y0.ravel(), rcond=None)[0]
    assert np.allclose(plain(trials).weights, expected, rtol=1e-7, atol=1e-9 * np.abs(expected).max())


@unhurried
@given(seeds, st.floats(1e-6, 1e6), st.floats(-np.pi, np.pi))
def test_units_of_weights_and_a_turned_mark(seed, factor, turn):
    """A mark moved by `turn` with the rotation takes `turn` from every angle and from every phase."""
    trials, _, _ = synthetic(np.random.default_rng(seed), errors=ReadingErrors(0.001, 0.001))
    by = np.exp(-1j * turn)
    other = job(
        trials.readings * by, trials.weights * by * factor, speeds=trials.speeds, errors=trials.errors
    )
    a, b = correct(estimate_influence(trials)), correct(estimate_influence(other))
    assert np.allclose(b.weights, a.weights * by * factor, rtol=1e-7)
    # draws are others where axes are turned
    assert np.allclose(b.mass_std, a.mass_std * factor, rtol=0.2)
    assert b.check_rms == pytest.approx(a.check_rms, rel=0.2)
    assert np.allclose(np.abs(b.after), np.abs(a.after), rtol=1e-6, atol=1e-12)
    assert a.conditioning.condition_number == pytest.approx(b.conditioning.condition_number)


@unhurried
@given(seeds, st.permutations(range(5)))
def test_the_order_of_the_runs_does_not_matter(seed, order):
    rng = np.random.default_rng(seed)
    T = np.array([[0, 0], [1, 0], [0, 1], [1, 1j], [-1, 0]]) * GRAM
    trials, _, _ = synthetic(rng, weights=T)
    read = trials.readings[0] * (1 + 0.01 * complex_normal(rng, trials.readings.shape[1:]))
    a, b = (
        correct(estimate_influence(job(read[i], T[i], speeds=trials.speeds))) for i in (range(5), list(order))
    )
    assert np.allclose(b.weights, a.weights, rtol=1e-5)
    assert np.allclose(b.mass_std, a.mass_std, rtol=0.2)


@unhurried
@given(seeds)
def test_trial_weights_removed_or_left_in_or_without_a_baseline_run_say_the_same(seed):
    rng = np.random.default_rng(seed)
    W, Y0 = complex_normal(rng, (2, 3, 2)) * 1e3, complex_normal(rng, (2, 3))
    found = []
    for T in ([[0, 0], [1, 0], [1, 1j]], [[0, 0], [1, 0], [0, 1j]], [[1, 0], [-1, 0], [0, 1], [0, -1j]]):
        weights = np.array(T) * GRAM
        trials = job(Y0 + np.einsum("scp,rp->rsc", W, weights), weights, speeds=(100.0, 200.0))
        found.append(plain(trials))
        assert np.allclose(found[-1].to_add, found[-1].weights - weights[-1], rtol=1e-12)
    assert np.allclose(found[1].weights, found[0].weights, rtol=1e-6)
    assert np.allclose(found[2].weights, found[0].weights, rtol=1e-6)


@unhurried
@given(seeds)
def test_unbalance_in_the_planes_is_undone(seed):
    rng = np.random.default_rng(seed)
    W, U = complex_normal(rng, (2, 4, 2)) * 1e3, complex_normal(rng, 2) * GRAM
    T = np.vstack((np.zeros(2), np.diag(complex_normal(rng, 2)))) * GRAM
    trials = job(np.einsum("scp,rp->rsc", W, T + U), T, speeds=(100.0, 200.0))
    assert np.allclose(plain(trials).weights, -U, rtol=1e-6, atol=1e-9 * GRAM)


# errors


@each_of("method, outside", [("least-squares", 0.0), ("weighted", 0.5)])
def test_regions_hold_the_truth(method, outside):
    n, inside = 100, []
    for seed in range(n):
        trials, D = rotor(seed, outside=outside, effect=1.5)
        inside.append(correct(estimate_influence(trials), method=method).region().holds(D))
    assert lowest_share(n, 0.94) <= np.mean(inside)
    assert np.mean(inside) < 1


def test_the_covariance_of_weights_and_of_a_check_run_against_simulated_jobs():
    """Floors of the same size for all, so that nothing depends on what was read: drawn again 3000 times."""
    rng = np.random.default_rng(8)
    floor = ReadingErrors(floor=0.02)
    trials, W, Y0 = synthetic(rng, sensors=3, speeds=2, errors=floor)
    exact = trials.readings[0]
    read = exact + 0.02 * complex_normal(rng, (3000, *exact.shape))
    w = np.moveaxis(read[:, 1:] - read[:, :1], 1, -1).reshape(3000, 6, 2) / GRAM
    D = -np.einsum("kpn,kn->kp", np.linalg.pinv(w), read[:, 0].reshape(3000, 6))
    c = plain(trials)
    assert np.allclose(np.std(real(D), axis=0), np.sqrt(np.diag(c.covariance)), rtol=0.15)
    assert np.allclose(np.abs(D).std(axis=0), c.mass_std, rtol=0.15)
    assert np.allclose(np.angle(D / c.weights).std(axis=0), c.angle_std, rtol=0.15)
    # a check run on the true rotor with the weights of each job
    check = Y0.ravel() + np.einsum("np,kp->kn", W.reshape(6, 2), D) + 0.02 * complex_normal(rng, (3000, 6))
    off = check - read[:, 0].reshape(3000, 6) - np.einsum("knp,kp->kn", w, D)
    stated = np.trace(c.after_covariance, axis1=-2, axis2=-1).ravel()
    assert np.allclose(np.mean(np.abs(off) ** 2, axis=0), stated, rtol=0.25)
    assert np.mean(np.sqrt(np.mean(np.abs(check) ** 2, axis=1)) < c.check_rms) > 0.93


def test_the_mean_of_four_repeats_has_half_the_error():
    single = bruel_kjaer(errors=ERRORS)
    four = job(np.repeat(single.readings, 4, axis=0), single.weights, errors=ERRORS)
    a, b = plain(single), plain(four)
    assert np.allclose(b.mass_std, a.mass_std / 2, rtol=0.05)


def test_where_nothing_is_known_of_errors_nothing_is_said_of_them():
    c = correct(stored(estimate_influence(bruel_kjaer()).W, estimate_influence(bruel_kjaer()).baseline))
    assert not c.errors_known
    assert not c.region_known
    assert np.isnan([*c.mass_std, *c.angle_std, *c.covariance.ravel(), c.check_rms, *c.within.ravel()]).all()
    document = c.to_dict()
    assert document["corrections"][0]["mass_std"] is None
    assert document["residuals"][0]["after_covariance"] is None
    assert "95 %" not in c.answer.whole()


def test_the_angle_of_a_weight_within_its_own_error_is_not_determined():
    """The rotor is balanced already: the proposed weight is noise."""
    readings = np.array([[0.01, 0.02j], [1.0, 2.0]])
    c = correct(estimate_influence(job(readings, [[0], [GRAM]], errors=ReadingErrors(0.01, 0.01, 0.05))))
    row = c.to_dict()["corrections"][0]
    assert row["mass_std"] > row["mass"]
    assert row["angle_std_deg"] is None
    assert "angle not determined" in c.answer.brief()
    assert c.decision.word == "do not mount"


def test_errors_in_one_direction_only():
    c = correct(estimate_influence(bruel_kjaer(errors=ReadingErrors(amplitude=0.01))))
    assert (c.mass_std > 0).all()
    assert (c.angle_std > 0).all()


def test_large_tables_take_memory_in_proportion_to_their_readings():
    """One matrix of all 600 readings of the run would have 11.5 MB."""
    import tracemalloc

    rng = np.random.default_rng(0)
    trials, _, _ = synthetic(rng, sensors=100, speeds=6)
    correct(estimate_influence(trials))
    tracemalloc.start()
    correct(estimate_influence(trials))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 250e6


# weights of readings, limits, ridge, removal


def test_row_weights_are_those_of_a_weighted_least_squares_problem():
    trials, _ = rotor(0, outside=0.5)
    influence = estimate_influence(trials)
    rows = np.random.default_rng(1).uniform(0.2, 2, (3, 4))
    W, Y, w = influence.W.reshape(-1, 2), influence.baseline.ravel(), rows.ravel()
    expected = np.linalg.lstsq(w[:, None] * W, -w * Y, rcond=None)[0]
    assert np.allclose(plain(trials, row_weights=rows).weights, expected, rtol=1e-9)


@each_of("options", [{"method": m} for m in ("least-squares", "weighted", "minmax")] + [{"strength": 0.05}])
def test_a_reading_of_weight_zero_is_as_if_it_were_not_there(options):
    trials, _ = rotor(0, outside=0.2)
    rows = np.ones((3, 4))
    rows[:, 3] = 0
    influence = estimate_influence(trials)
    found = correct(influence, row_weights=rows, **options)
    direct = correct(influence.part([0, 1, 2], [0, 1, 2]), **options)
    assert np.allclose(found.weights, direct.weights, rtol=1e-6)
    assert found.conditioning.condition_number == pytest.approx(direct.conditioning.condition_number)
    if "strength" not in options:
        assert np.allclose(found.mass_std, direct.mass_std, rtol=0.15)


@pytest.mark.parametrize("method", ["least-squares", "weighted", "minmax"])
def test_limits_are_kept_and_their_errors_are_drawn(method):
    trials, _ = rotor(0)
    influence = estimate_influence(trials)
    free = correct(influence, method=method)
    most, arc = 0.8 * abs(free.weights[0]), (float(np.angle(free.weights[1]) - 0.2), 0.5)
    limits = limits_by_name(influence, max_weight={"A": most}, forbidden={"B": [arc]})
    c = correct(influence, method=method, limits=limits)
    assert abs(c.weights[0]) <= most * (1 + 1e-9)
    turn = np.mod(np.angle(c.weights[1]) - arc[0], 2 * np.pi)
    assert turn >= 0.5 - 1e-6 or turn <= 1e-6 or turn >= 2 * np.pi - 1e-6
    assert len(c.active) == 2
    assert np.isfinite(c.covariance).all()
    assert (np.abs(c.draws[:, 0]) <= most * (1 + 1e-6)).all()
    loose = limits_by_name(influence, max_weight={"A": 100.0})
    assert np.allclose(correct(influence, method=method, limits=loose).weights, free.weights, rtol=1e-6)


def test_a_weight_at_its_limit_has_no_error_of_its_size():
    influence = estimate_influence(rotor(0)[0])
    free = correct(influence)
    limits = limits_by_name(influence, max_weight={"A": 0.8 * abs(free.weights[0])})
    c = correct(influence, limits=limits)
    assert c.held.tolist() == [True, False]
    assert c.mass_std[0] < 1e-5 * free.mass_std[0]
    assert "at its limit" in c.answer.brief()


def test_minmax_has_the_smallest_largest_reading():
    trials, _ = rotor(1, outside=0.5)
    influence = estimate_influence(trials)
    c = correct(influence, method="minmax")
    largest = np.abs(c.after).max()
    rng = np.random.default_rng(0)
    for size in (0.3, 0.01, 1e-4):
        moved = c.weights + size * complex_normal(rng, (300, 2))
        assert np.abs(c.before + np.einsum("scp,kp->ksc", influence.W, moved)).max(
            axis=(1, 2)
        ).min() > largest * (1 - 1e-6)


def test_ridge_answers_where_planes_act_alike():
    W = np.array([[[1, 1], [2j, 2j], [1, 1]]], dtype=complex)
    influence = stored(W, [[1.0, 2j, 1.0]])
    with pytest.raises(UndeterminedError, match="act alike"):
        correct(influence)
    c = correct(influence, strength=0.01)
    assert (c.method, c.conditioning.rank) == ("ridge", 1)
    assert np.allclose(c.weights, -0.5, rtol=1e-3)
    assert not c.region_known


def test_where_material_is_taken_away_the_place_is_opposite():
    c = correct(estimate_influence(bruel_kjaer()), remove=["A"])
    row, other = c.to_dict()["corrections"]
    assert (row["action"], row["remove_at_deg"]) == ("remove", pytest.approx((row["angle_deg"] + 180) % 360))
    assert (other["action"], other["remove_at_deg"]) == ("add", None)
    frame = c.to_frame()
    assert frame["angle_deg"][0] == pytest.approx(row["remove_at_deg"])
    assert frame["equivalent_added_deg"][0] == pytest.approx(row["angle_deg"])


# a baseline of another day


def test_runs_with_weights_serve_as_baseline_of_known_coefficients():
    """Y₀ = Y − W T: the total weights do not depend on what is mounted in the new run."""
    known = estimate_influence(bruel_kjaer(errors=ReadingErrors(0.02, 0.02)))
    T = np.array([[0.7, 0.2j]]) * GRAM
    reading = known.baseline + known.W @ T[0]
    new = Trials(("now",), known.speeds, known.sensors[::-1], known.planes, reading[None, :, ::-1], T)
    c = correct(known, new)
    assert np.allclose(c.weights, correct(known).weights)
    assert np.allclose(c.to_add, c.weights - T[0])
    assert c.region_known
    bare = correct(stored(known.W), known.baseline)
    assert np.allclose(bare.weights, c.weights)
    assert not bare.mounted.weights.any()


def test_repeated_baselines_that_agree_are_averaged_and_others_questioned():
    trials = bruel_kjaer()
    measured = estimate_influence(trials)
    known = replace(stored(measured.W), sensors=trials.sensors)
    Y = measured.baseline

    def day(second, weights=None):
        return Trials(("a", "b"), known.speeds, known.sensors, (), np.array([Y, second]), np.zeros((2, 0)))

    assert np.allclose(correct(known, day(1.05 * Y)).before, 1.025 * Y)
    with pytest.raises(UndeterminedError, match="give the weights table or keep only the baseline run"):
        correct(known, day(1.5 * Y))
    wrong = replace(trials, weights=2 * trials.weights)
    assert "check the weights table and the stored coefficients" in " ".join(
        correct(known, wrong, refuse=False).warnings
    )


# refusals


W_ALIKE = np.array([[1, 2, 1], [2, 4, 0], [3, 6, 1j]], dtype=complex)[None]


@each_of(
    "W, words",
    [
        (W_ALIKE, "planes 'A' and 'B' act alike"),
        ([[[1, 2, 3], [2, 1, 3], [0, 1j, 1j], [1, 0, 1]]], "planes 'A', 'B'.* 'C' act alike"),
        ([[[1, 2]]], "2 planes need at least 2 readings"),
        ([[[1, 0], [1, 0]]], "plane 'B' has no effect"),
    ],
)
def test_planes_that_readings_do_not_tell_apart(W, words):
    W = np.asarray(W, dtype=complex)
    with pytest.raises(UndeterminedError, match=words):
        correct(stored(W, np.ones(W.shape[:2])))


def test_a_reading_that_counts_is_needed_for_every_plane():
    rows = np.zeros((3, 4))
    rows[0, 0] = 1
    with pytest.raises(UndeterminedError, match="at least 2 readings"):
        correct(estimate_influence(rotor(0)[0]), row_weights=rows)


def test_without_the_plane_that_acts_like_another_the_rest_is_determined():
    assert correct(stored(W_ALIKE, np.ones((1, 3))), planes=["A", "C"]).conditioning.rank == 2


def test_stated_errors_refuse_what_assumed_ones_only_warn_of():
    rng = np.random.default_rng(24)
    W, Y0 = complex_normal(rng, (8, 2)), complex_normal(rng, 8)
    W[:, 1] = (0.5 + 1j) * W[:, 0] + 0.01 * complex_normal(rng, 8)
    T = np.vstack((np.zeros(2), np.eye(2)))
    runs = job(Y0 + T @ W.T, T)
    assert "act alike" in plain(runs).answer.whole()
    with pytest.raises(UndeterminedError, match=r"act alike .*\nInstead: plane '[AB]' alone"):
        plain(replace(runs, errors=ReadingErrors(0.02, 0.02)))
    assert plain(replace(runs, errors=ReadingErrors(0.02, 0.02)), refuse=False).weights.size == 2
    # errors between runs are assumed where repeats tell those of a reading
    repeats = np.array([1.001, 0.999])[:, None, None, None] * runs.readings
    assert "act alike" in plain(replace(runs, readings=repeats)).answer.whole()


def test_a_condition_number_that_no_instrument_supports():
    rng = np.random.default_rng(23)
    W, Y0 = complex_normal(rng, (6, 2)), complex_normal(rng, 6)
    W[:, 1] = W[:, 0] + 1e-5 * complex_normal(rng, 6)
    T = np.vstack((np.zeros(2), np.eye(2)))
    measured = estimate_influence(job(Y0 + T @ W.T, T))
    with pytest.raises(UndeterminedError, match="no instrument supports"):
        correct(measured)
    # nobody measured stored ones here: they may be exact
    assert correct(stored(measured.W), measured.baseline).conditioning.condition_number > 1e3


def test_a_disagreement_comes_first_in_the_refusal_that_it_causes():
    trials = bruel_kjaer()
    readings = np.concatenate((trials.readings[0], 12 * trials.readings[0, :1]))
    with pytest.raises(UndeterminedError, match=r"^the runs disagree by"):
        correct(estimate_influence(job(readings, np.concatenate((trials.weights, [[0, 0]])))))


@each_of(
    "options, words",
    [
        ({"method": "magic"}, "method 'magic' is not known"),
        ({"strength": 0.1, "method": "minmax"}, "least squares without limits only"),
        ({"row_weights": np.ones(3)}, "shape"),
        ({"row_weights": np.zeros((1, 2))}, "all readings have the weight 0"),
        ({"planes": ["X"]}, "there is no plane 'X'"),
        ({"planes": []}, "at least one plane"),
        ({"speeds": [120.0]}, "there are no coefficients at"),
        ({"speeds": [100.0, 100.1]}, "a speed is given twice"),
        ({"baseline": np.zeros((1, 2))}, "there is nothing to balance"),
        ({"baseline": np.array([[1, np.nan]])}, "missing|finite"),
    ],
)
def test_what_cannot_be(options, words):
    with pytest.raises(ValueError, match=words):
        correct(estimate_influence(bruel_kjaer()), **options)


def test_stored_coefficients_need_a_baseline_and_a_weighted_fit_errors():
    known = stored(complex_normal(np.random.default_rng(0), (1, 3, 2)))
    with pytest.raises(ValueError, match="give the readings of a baseline run"):
        correct(known)
    with pytest.raises(ValueError, match="needs errors of the readings"):
        correct(known, np.ones((1, 3)), method="weighted")
