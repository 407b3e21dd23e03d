"""Pass, fail, not decidable: regions against closed forms, residual unbalance against what is mounted."""

from dataclasses import replace

import numpy as np
import pytest
from balancing_data import ERRORS, check_run, complex_normal, limits_by_name, rigid, synthetic

from balancing import correct, estimate_influence, tolerance, verdict_of_check, verdict_of_prediction
from balancing.pass_or_fail import judge, judge_unbalance
from balancing.regions import NORMAL_RADIUS as RADIUS
from balancing.regions import Region


def one(value, limit, covariance):
    return judge(
        "sensor", "s", limit, Region(np.array([value], dtype=complex), np.asarray(covariance), RADIUS)
    )


def test_a_round_region():
    row = one(3 + 4j, 5.0, 0.04 * np.eye(2))
    assert (row.low, row.high) == pytest.approx((5 - 0.2 * RADIUS, 5 + 0.2 * RADIUS), rel=1e-6)
    words = {5.49: "pass", 5.48: "not decidable", 4.50: "fail", 4.52: "not decidable"}
    assert {limit: one(3 + 4j, limit, 0.04 * np.eye(2)).verdict for limit in words} == words


def test_an_oblong_region():
    # on the axis: 10 ± 0.1 ρ along, 3 ρ across: the farthest points are off the axis
    row = one(10.0, 20.0, np.diag([0.01, 9.0]))
    a, b = 0.1 * RADIUS, 3 * RADIUS
    cos = -10 * a / (a**2 - b**2)  # stationary point of |10 + a cos t + i b sin t|²
    assert row.high == pytest.approx(np.hypot(10 + a * cos, b * np.sqrt(1 - cos**2)), rel=1e-5)
    assert row.low == pytest.approx(10 - a, rel=1e-6)
    assert one(0.1, 1.0, np.eye(2)).low == 0.0


def test_planes_bearings_and_radii():
    whole = tolerance(100, 300, 2.5, planes={"A": 0.25, "B": 0.75}, bearings=(0, 1), centre=0.5)
    u = whole.total * np.array([0.6, -0.2])  # A over its half, but together below at the bearings
    # errors of A alone: at bearing A 0.75 of them
    some = u + 0.1 * whole.total * np.outer(complex_normal(np.random.default_rng(0), 400), [1, 0])
    radii = {"A": 0.2, "B": 0.4}
    rows = judge_unbalance(u / [0.2, 0.4], some / [0.2, 0.4], whole, ("A", "B"), radii=radii)
    assert [(r.kind, r.name) for r in rows] == [
        (kind, name) for kind in ("plane", "bearing") for name in "AB"
    ]
    # 0.75·0.6 − 0.25·0.2 = 0.4, 0.25·0.6 − 0.75·0.2 = 0
    assert [r.size / whole.total for r in rows[2:]] == pytest.approx([0.4, 0.0], abs=1e-12)
    assert rows[2].high / whole.total == pytest.approx(0.4 + 0.075 * RADIUS, rel=0.05)
    assert rows[0].limit == pytest.approx(whole.total / 2 / 0.2)
    turned = judge_unbalance(u[::-1], some[:, ::-1], whole, ("B", "A"))
    assert [r.size / whole.total for r in turned[2:]] == pytest.approx([0.4, 0.0], abs=1e-12)
    with pytest.raises(ValueError, match="name the same planes in both"):
        judge_unbalance(u, some, whole, ("A", "C"))


@pytest.fixture
def job():
    made, W, Y0 = synthetic(np.random.default_rng(5), errors=ERRORS)
    return made, W, Y0, estimate_influence(made)


@pytest.mark.parametrize(
    ("limit", "words"),
    [(1.5e-4, ["fail", "pass"]), (2e-4, ["not decidable", "pass"]), (3e-4, ["pass", "pass"])],
)
def test_residual_unbalance_of_a_check_run(job, limit, words):
    made, W, _, influence = job
    residual = np.array([2e-4, 1e-4j])
    check = check_run(made, W, residual)
    found = verdict_of_check(influence, check, tolerance=rigid(limit))
    assert [r.value for r in found.rows] == pytest.approx(residual, rel=1e-9)
    assert [r.verdict for r in found.rows] == words
    assert found.overall == words[0]
    # what was mounted does not matter
    mounted = replace(check, planes=made.planes, weights=np.array([[1e-3, 2e-3]]))
    assert verdict_of_check(influence, mounted, tolerance=rigid(limit)).to_dict() == found.to_dict()


def test_readings_against_limits(job):
    made, W, _, influence = job
    residual = np.array([2e-4, 1e-4j])
    check = check_run(made, W, residual)
    limits = limits_by_name(made, residual={"s1": 5.0, "s3": 1e-3})
    found = verdict_of_check(influence, check, limits=limits)
    assert len(found.rows) == 2 * len(made.speeds)
    for row in found.rows:
        s, c = list(made.speeds).index(row.speed), made.sensors.index(row.name)
        size = abs(W[s, c] @ residual)
        assert row.size == pytest.approx(size)
        assert row.high == pytest.approx(size * (1 + 0.01 * RADIUS), rel=1e-3)
        assert row.verdict == ("pass" if size * (1 + 0.01 * RADIUS) < row.limit else "fail")
    assert {row.verdict for row in found.rows} == {"pass", "fail"}
    with pytest.raises(ValueError, match="nothing to judge by"):
        verdict_of_check(influence, check)


def test_prediction(job):
    made, W, Y0, influence = job
    c = correct(influence, limits=limits_by_name(made, residual={"s1": 5.0}))
    wide = 10 * np.sqrt(np.trace(c.covariance))
    found = verdict_of_prediction(c, tolerance=rigid(wide))
    assert [r.kind for r in found.rows] == ["plane"] * 2 + ["sensor"] * 3
    assert (found.rows[0].size, found.rows[0].verdict) == (0.0, "pass")
    reach = RADIUS * np.sqrt(np.linalg.eigvalsh(c.covariance[:2, :2])[-1])
    assert found.rows[0].high == pytest.approx(reach, rel=0.1)
    # pieces 5 tolerances off
    mounted = c.weights + np.array([5 * wide, 0])
    after = Y0 + W @ mounted
    off = verdict_of_prediction(c, tolerance=rigid(wide), mounted=mounted, after=after)
    assert (off.rows[0].verdict, off.rows[2].value) == ("fail", pytest.approx(after[0, 1]))
