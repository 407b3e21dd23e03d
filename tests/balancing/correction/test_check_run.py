"""Check runs beside their prediction: false alarms, detection, words, and what is mounted."""

import json
from dataclasses import replace

import numpy as np
import pytest
from balancing_data import GRAM, bruel_kjaer, complex_normal, job
from fem_rotors import rotor23
from repetitions import FULL
from scipy.stats import binom

import fem
from balancing import Labels, ReadingErrors, correct, estimate_influence
from balancing.correction.check_run import compare_check
from balancing.data.reading_errors import reading_covariance
from balancing.solvers.error_propagation import prediction_covariance

ERRORS = ReadingErrors(amplitude=0.02, phase=np.deg2rad(1.0))
P, C, S = 2, 4, 3
READ = ((), (5, 1), (1, 3))
"""Repeats of a check run: none, five runs, three readings of one."""
REPEATED = 300 if FULL else 150
"""Jobs whose check runs are repeated, too."""


def noisy(rng, Y, errors=ERRORS, shape=()):
    """Readings with radial and tangential errors, drawn without using the code under test."""
    radial, tangential = rng.standard_normal((2, *shape, *Y.shape))
    return Y * (1 + errors.amplitude * radial + 1j * errors.phase * tangential)


def rotor(rng):
    """W, Y0 and trial weights that change the vibration well."""
    W, Y0 = complex_normal(rng, (S, C, P)) * 1e3, complex_normal(rng, (S, C))
    return W, Y0, np.vstack((np.zeros(P), np.eye(P))) * GRAM


def runs_of(readings, weights, **options):
    return job(readings, weights, speeds=100.0 * np.arange(1, S + 1), **options)


def check_of(readings, **options):
    """A check run (or several) without weights: the proposed corrections were mounted."""
    readings = np.asarray(readings)
    R = 1 if readings.ndim == 2 else readings.shape[-3]
    readings = readings[None] if readings.ndim == 2 else readings
    return runs_of(readings, np.zeros((R, 0)), **options)


def balanced(rng, W, Y0, T, *, errors=ERRORS, repeats=()):
    """Influence and correction from noisy trial runs."""
    exact = Y0 + np.einsum("scp,rp->rsc", W, T)
    influence = estimate_influence(runs_of(noisy(rng, exact, errors or ERRORS, repeats), T, errors=errors))
    return influence, correct(influence, refuse=False)


def simulated(seed, n=300, *, repeats=(), errors=ERRORS, read=((),)):
    """Comparisons of n linear jobs whose proposed corrections were mounted, by the repeats of the check."""
    rng = np.random.default_rng(seed)
    out = {check_repeats: [] for check_repeats in read}
    for k in range(n):
        W, Y0, T = rotor(rng)
        influence, correction = balanced(rng, W, Y0, T, errors=errors, repeats=repeats)
        true = Y0 + W @ correction.weights
        for check_repeats in read[: None if k < REPEATED else 1]:
            check = check_of(noisy(rng, true, shape=check_repeats or (1, 1)), errors=errors)
            out[check_repeats].append(compare_check(correction, check, influence))
    return out


@pytest.fixture(scope="module")
def stated():
    """300 jobs, errors stated; the same weights checked once and by repeats."""
    return simulated(71, read=READ)


@pytest.fixture(scope="module")
def plain(stated):
    """300 jobs read once, errors stated."""
    return stated[()]


def alarms(comparisons):
    return sum(not c.explained for c in comparisons)


def expected(n):
    """Of n jobs 5 % (binomial): within these bounds lie 99.9 % of all experiments, 4 … 29 of 300."""
    return binom.ppf((0.0005, 0.9995), n, 0.05)


@pytest.mark.full
@pytest.mark.parametrize("check_repeats", READ)
def test_false_alarms_near_5_percent(stated, check_repeats):
    """Errors stated 1.2 times too small would be seen, or so large that nothing is an alarm."""
    low, high = expected(len(stated[check_repeats]))
    assert 0 < low <= alarms(stated[check_repeats]) <= high


def test_chi_square_has_its_degrees_of_freedom(plain):
    """Mean 24 and variance 48; the mean of 300 within 4 standard errors."""
    assert all(c.n == 2 * S * C for c in plain)
    assert abs(np.mean([c.chi_square for c in plain]) - 24) < 4 * np.sqrt(48 / 300)


def test_each_distance_is_that_of_two_dimensions(plain):
    distance = np.array([c.distance for c in plain])
    assert abs(np.mean(distance < np.sqrt(5.991)) - 0.95) < 0.015


@pytest.mark.full
def test_errors_from_repeats_are_compared_with_f():
    """Estimated errors: 3 repeats of 3 runs, 72 degrees of freedom of each direction; less between runs."""
    found = simulated(75, REPEATED, repeats=(3,), errors=None)[()]
    assert found[0].dof > 30
    assert "estimated errors" in found[0].verdict
    assert alarms(found) <= expected(REPEATED)[1]  # errors between runs are assumed, and there are none


def test_unbalance_outside_the_planes_is_found():
    """The 23-element rotor: planes at nodes 4 and 20, and a part at node 12 that moved before the check."""
    model = fem.influence(rotor23(2e4), [4, 20, 12], [3, 8, 16, 22], [150.0, 280.0, 420.0])
    W, outside = model.W[..., :2], model.W[..., 2]
    T = np.vstack((np.zeros(2), np.eye(2)))
    rng = np.random.default_rng(76)
    found = {0.0: [], 1.0: []}
    for _ in range(100):
        U = complex_normal(rng, 3)
        influence, correction = balanced(rng, W, model.W @ U, T)
        for moved, comparisons in found.items():
            true = model.W @ U + W @ correction.weights + moved * outside
            check = check_of(noisy(rng, true), errors=ERRORS)
            comparisons.append(compare_check(correction, check, influence))
    assert alarms(found[0.0]) <= 13  # 5 ± 2.2, 99.9 %
    assert alarms(found[1.0]) == 100
    # in a few noisy jobs weights in the planes could have done the same
    assert sum("unbalance outside the planes, or a nonlinearity" in c.verdict for c in found[1.0]) > 90
    assert all("unbalance outside the planes" in c.verdict for c in found[1.0])
    assert all((c.change is None) == ("check what was mounted" not in c.verdict) for c in found[1.0])


def test_a_stiffening_bearing_is_found():
    """A cubic restoring force: the amplitude that linear balancing leaves out, Y (1 − 0.15 |Y|²)."""
    rng = np.random.default_rng(77)

    def read(Y):
        return Y * (1 - 0.15 * np.minimum(np.abs(Y), 1.5) ** 2)

    found = 0
    for _ in range(60):
        W, Y0, T = rotor(rng)
        exact = read(Y0 + np.einsum("scp,rp->rsc", W, T))
        influence = estimate_influence(runs_of(noisy(rng, exact), T, errors=ERRORS))
        correction = correct(influence, refuse=False)
        check = check_of(noisy(rng, read(Y0 + W @ correction.weights)), errors=ERRORS)
        found += not compare_check(correction, check, influence).explained
    assert found == 60


def test_a_wrongly_mounted_weight_is_named():
    """The weight of plane B at the wrong angle: the change that explains it, within its error, is named."""
    rng, fine = np.random.default_rng(78), ReadingErrors(0.004, 0.004)
    W, Y0, T = rotor(rng)
    influence, correction = balanced(rng, W, Y0, T, errors=fine)
    mounted = correction.weights * np.array([1.0, np.exp(1j * np.deg2rad(60))])
    check = check_of(noisy(rng, Y0 + W @ mounted, fine), errors=fine)
    found = compare_check(correction, check, influence)
    assert found.explained is False
    delta = mounted - correction.weights
    np.testing.assert_allclose(found.change, delta, atol=0.06 * np.abs(delta).max())
    assert "check what was mounted" in found.verdict
    assert "in plane 'B'" in found.verdict
    assert "in plane 'A'" not in found.verdict
    # the same check, with what was mounted said, is explained
    said = runs_of(check.readings, mounted[None], errors=fine)
    told = compare_check(correction, said, influence)
    assert told.explained is True
    assert told.as_proposed is False
    assert found.as_proposed is True
    assert told.change is None


def test_the_covariance_is_that_of_the_correction():
    """With the proposed weights, once read: `after_covariance`, and with n repeats its own part by n."""
    rng = np.random.default_rng(79)
    influence, correction = balanced(rng, *rotor(rng))
    check = check_of(noisy(rng, correction.after), errors=ERRORS)
    single = compare_check(correction, check, influence)
    np.testing.assert_allclose(single.predicted[0], correction.after, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(single.covariance[0], correction.after_covariance, rtol=1e-9)
    four = check_of(np.repeat(check.readings, 4, axis=0), errors=ERRORS)
    own = reading_covariance(correction.after, ERRORS)
    np.testing.assert_allclose(
        compare_check(correction, four, influence).covariance[0],
        correction.after_covariance - own * 0.75,
        rtol=1e-9,
        atol=1e-15,
    )


def test_several_runs_share_the_errors_of_the_prediction():
    """χ² of two runs against the joint covariance written out here, channel by channel."""
    rng = np.random.default_rng(80)
    W, Y0, T = rotor(rng)
    influence, correction = balanced(rng, W, Y0, T)
    mounted = np.stack((correction.weights, 0.5 * correction.weights))
    check = runs_of(noisy(rng, Y0 + np.einsum("scp,rp->rsc", W, mounted)), mounted, errors=ERRORS)
    found = compare_check(correction, check, influence)
    total = 0.0
    for s in range(S):
        for c in range(C):
            rows = []
            for D in mounted:
                blocks = [[[z.real, -z.imag], [z.imag, z.real]] for z in (1.0 + 0j, *D)]
                rows.append(np.hstack(blocks))
            V = np.vstack(rows) @ influence.covariance[s, c] @ np.vstack(rows).T
            for r in range(2):
                V[2 * r : 2 * r + 2, 2 * r : 2 * r + 2] += reading_covariance(
                    found.predicted[r, s, c], ERRORS
                )
            z = found.difference[:, s, c]
            d = np.array([z[0].real, z[0].imag, z[1].real, z[1].imag])
            total += d @ np.linalg.solve(V, d)
    assert found.chi_square == pytest.approx(total, rel=1e-6)
    assert found.n == 4 * S * C
    assert "sensor" in found.answer.whole()
    channels = influence.covariance.reshape(-1, 2 * P + 2, 2 * P + 2)
    alone = prediction_covariance(mounted[1], channels).reshape(S, C, 2, 2)
    np.testing.assert_allclose(
        found.covariance[1], alone + reading_covariance(found.predicted[1], ERRORS), rtol=1e-9
    )


def test_some_sensors_and_speeds_are_enough():
    rng = np.random.default_rng(81)
    influence, correction = balanced(rng, *rotor(rng))
    whole = compare_check(correction, check_of(noisy(rng, correction.after), errors=ERRORS), influence)
    readings = whole.achieved[:, [2, 0]][..., [3, 1]]
    part = job(readings, np.zeros((1, 0)), speeds=[300.0, 100.0], sensors=("s3", "s1"), errors=ERRORS)
    found = compare_check(correction, part, influence)
    np.testing.assert_allclose(found.distance[0], whole.distance[0][[2, 0]][:, [3, 1]], rtol=1e-6)
    assert found.n == 8
    wrong = job(readings, np.zeros((1, 0)), speeds=[300.0, 100.0], sensors=("s3", "x"), errors=ERRORS)
    with pytest.raises(ValueError, match="no coefficients of sensor 'x'"):
        compare_check(correction, wrong, influence)
    with pytest.raises(ValueError, match="there are no coefficients at 2387"):
        compare_check(correction, replace(part, speeds=np.array([300.0, 250.0])), influence)
    foreign = runs_of(whole.achieved, [[GRAM]], planes=("Z",), errors=ERRORS)
    empty = runs_of(whole.achieved, [[0.0, 0.0]], planes=("A", "Z"), errors=ERRORS)
    np.testing.assert_array_equal(compare_check(correction, empty, influence).weights, 0)
    with pytest.raises(ValueError, match="no coefficients of plane 'Z'"):
        compare_check(correction, foreign, influence)


def test_without_known_errors_there_is_no_verdict():
    influence = replace(
        estimate_influence(bruel_kjaer()), covariance=None, common=None, errors=None, error_source="unknown"
    )
    correction = correct(influence)
    check = job([[0.5, 1.0]], np.zeros((1, 0)))
    found = compare_check(correction, check, influence)
    assert found.explained is None
    assert found.chi_square is None
    assert found.verdict == (
        "no verdict: the errors of the readings are not known (state them, or repeat readings); "
        "sensor 's1' at 954.93 rpm differs most, by 1.00"
    )
    assert found.improvement_predicted is None  # an exact solution leaves nothing
    assert found.improvement_achieved == pytest.approx(np.hypot(7.2, 13.5) / np.hypot(0.5, 1.0))
    assert found.summary().startswith(
        "Not judged: with the weights rms 10.8 → 0.791 (0 predicted). No verdict"
    )
    text = found.answer.whole()
    assert "std" not in text
    document = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert document["explained"] is None
    assert document["readings"][0]["predicted_phase_deg"] is None
    assert (document["readings"][0]["predicted"], document["rms_predicted"]) == (0.0, 0.0)
    assert document["readings"][0]["achieved"] == pytest.approx(0.5)
    assert found.to_frame()["distance"].isna().all()


def test_two_planes_two_sensors():
    """Nothing should be left; 3 % of the vibration before is explained by 2 % and 2°, 30 % is not."""
    errors = ReadingErrors(0.02, np.deg2rad(2))
    influence = estimate_influence(bruel_kjaer(errors=errors))
    correction = correct(influence)
    small, large = (
        compare_check(
            correction, job([[share * 7.2, share * 13.5]], np.zeros((1, 0)), errors=errors), influence
        )
        for share in (0.03, 0.3)
    )
    assert small.explained is True
    assert small.verdict.startswith("the differences are explained by the stated errors (probability ")
    assert large.explained is False
    assert large.change is None  # two planes explain any two readings: that says nothing
    assert "unbalance outside the planes" in large.verdict
    assert "differs most" in large.verdict


def test_json_and_table_in_the_units_of_the_job():
    """Lag and against the rotation: phases, angles and covariances are mirrored; amplitudes in um_pp."""
    rng = np.random.default_rng(82)
    W, Y0, T = rotor(rng)
    labels = Labels("um_pp", 2e6, "g", 1e3, "lag", "against rotation")
    exact = Y0 + np.einsum("scp,rp->rsc", W, T)
    trials = runs_of(noisy(rng, exact), T, errors=ERRORS, labels=labels)
    influence = estimate_influence(trials)
    correction = correct(influence, refuse=False)
    check = check_of(noisy(rng, Y0 + W @ correction.weights), errors=ERRORS, labels=labels)
    found = compare_check(correction, check, influence)
    document = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    row, z, V = document["readings"][5], found.achieved[0, 1, 1], found.covariance[0, 1, 1]
    assert (row["speed_rpm"], row["sensor"]) == (pytest.approx(200 * 30 / np.pi), "s1")
    assert row["achieved"] == pytest.approx(abs(z) * 2e6)
    assert row["achieved_phase_deg"] == pytest.approx(np.degrees(-np.angle(z)) % 360)
    flip = np.diag([1.0, -1.0])
    np.testing.assert_allclose(row["covariance"], 4e12 * flip @ V @ flip)
    assert document["probability"] == found.probability
    mounted = document["mounted"][0]["weights"][1]
    assert mounted["mass"] == pytest.approx(1e3 * abs(correction.weights[1]))
    assert mounted["angle_deg"] == pytest.approx(np.degrees(-np.angle(correction.weights[1])) % 360)
    frame = found.to_frame()
    assert len(frame) == S * C
    assert frame["distance"].to_numpy() == pytest.approx(found.distance.ravel())
    assert found.summary().startswith("As predicted: ")
    assert max(map(len, found.summary().splitlines())) <= 100
    assert max(map(len, found.answer.tables[0].splitlines())) <= 80
    factors = found.improvement_predicted, found.improvement_achieved
    before, after = np.linalg.norm(found.before), np.linalg.norm(found.achieved)
    assert factors[1] == pytest.approx(before / after)
    assert factors[0] == pytest.approx(before / np.linalg.norm(found.predicted))


def test_stored_coefficients_and_a_baseline():
    """The errors of the baseline alone: the comparison says that the coefficients' own are not known."""
    rng = np.random.default_rng(83)
    W, Y0, T = rotor(rng)
    influence, _ = balanced(rng, W, Y0, T)
    stored = replace(influence, baseline=None, covariance=None, errors=None, last_run=None, last_weights=None)
    baseline = check_of(noisy(rng, Y0), errors=ERRORS)
    correction = correct(stored, baseline)
    check = check_of(noisy(rng, Y0 + W @ correction.weights), errors=ERRORS)
    found = compare_check(correction, check, stored, baseline)
    np.testing.assert_allclose(found.covariance[0], correction.after_covariance, rtol=1e-9)
    assert any("errors of the influence coefficients are not known" in w for w in found.warnings)
    assert "Warning: the errors of the influence" in found.summary()


def test_repeats_of_the_check_run_that_scatter_more_count():
    """Stated 2 %, but the check run scatters by 30 %: its own scatter is used and said."""
    rng = np.random.default_rng(84)
    W, Y0, T = rotor(rng)
    influence, correction = balanced(rng, W, Y0, T)
    wild = ReadingErrors(0.3, 0.3)
    check = check_of(noisy(rng, Y0 + W @ correction.weights, wild, (6, 1)), errors=ERRORS)
    found = compare_check(correction, check, influence)
    assert found.dof == 2 * 5 * S * C
    assert any("scatter" in w for w in found.warnings)
    own = found.covariance[0] - (correction.after_covariance - reading_covariance(correction.after, ERRORS))
    size = np.sqrt(np.trace(own, axis1=-2, axis2=-1) / 2) / np.abs(correction.after)
    np.testing.assert_allclose(size, 0.3 / np.sqrt(6), rtol=0.099)
