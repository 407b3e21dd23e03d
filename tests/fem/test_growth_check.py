"""The steady response of a rotor that whirls by itself does not exist, and this is said."""

import dataclasses

import dense_rotor
import numpy as np
import pytest
from fem_rotors import rotor23
from repetitions import FULL
from whirl_rotors import machine

import fem
from fem.growth_check import growth_bound, unstable_windows
from fem.windows import within

SPEEDS = np.linspace(50.0, 1500.0, 60)


def inner(material):
    base = machine()
    return dataclasses.replace(
        base,
        supports=[fem.Support(s.node, 1e8, 1e4) for s in base.supports],
        material_damping=np.full(23, material),
    )


def test_growth_is_said_with_its_threshold():
    rotor = inner(2e-4)
    threshold = fem.stability_threshold(rotor, 1500.0).threshold
    for result in (
        fem.unbalance_response(rotor, {5: 1e-4}, SPEEDS),
        fem.unbalance_response(rotor, {5: 1e-4}, SPEEDS[::-1]),
        fem.influence(rotor, [5], [7], SPEEDS),
    ):
        assert f"does not exist above {threshold:.6g} rad/s" in result.warnings[-1]
        assert f"up to the last speed, {SPEEDS[-1]:.6g} rad/s" in result.warnings[-1]
        assert "mode 2 (forward whirl" in result.warnings[-1]


def test_one_speed():
    rotor = inner(2e-4)
    threshold = fem.stability_threshold(rotor, 1500.0).threshold
    above = fem.unbalance_response(rotor, {5: 1e-4}, 1.05 * threshold)
    assert f"does not exist at {1.05 * threshold:.6g} rad/s" in above.warnings[-1]
    assert fem.unbalance_response(rotor, {5: 1e-4}, 0.95 * threshold).warnings == ()


def test_a_stable_rotor_with_material_damping_is_not_suspected():
    assert (growth_bound(inner(1e-7), SPEEDS) > 0).all()
    assert fem.unbalance_response(inner(1e-7), {5: 1e-4}, SPEEDS).warnings == ()


def test_a_rotor_that_is_pushed_aside():
    rotor = machine()
    pushed = dataclasses.replace(rotor, supports=[*rotor.supports, fem.Support(12, -1e9, kind="seal")])
    with pytest.raises(ValueError, match="statically unstable"):
        fem.unbalance_response(pushed, {5: 1e-4}, SPEEDS)


@pytest.mark.parametrize(
    ("stiffness", "damping", "sure"),
    [
        (1e8, 1e3, True),
        (((1e8, 0), (0, 2e8)), ((1e3, 0), (0, 5e2)), True),
        (((1e8, 3e7), (3e7, 2e8)), 1e3, True),
        (((1e8, 3e7), (-3e7, 1e8)), 1e3, False),
        (((1e8, 2e8), (2e8, 1e8)), 1e3, False),
        (1e8, ((1e3, 2e3), (2e3, 1e3)), False),
        (1e8, ((1e3, 2e3), (-2e3, 1e3)), True),
    ],
)
def test_what_is_surely_stable(stiffness, damping, sure):
    base = rotor23()
    rotor = dataclasses.replace(
        base, supports=[fem.Support(s.node, stiffness, damping) for s in base.supports]
    )
    assert (growth_bound(rotor, np.array([0.0, 100.0])) == 0).all() == sure


def drawn(rng):
    """A rotor with a seal whose tabulated cross-coupling comes and goes: it drives whirl in windows."""
    n = int(rng.integers(3, 7))
    tilting = rng.uniform(0.02, 0.5)
    ends = rng.choice(np.arange(1, n + 2), 2, replace=False)
    stiff = 10 ** rng.uniform(6.5, 8.5, 2)
    bearings = [
        fem.Support(
            int(node),
            k if rng.random() < 0.5 else ((k, 0.0), (0.0, k * rng.uniform(0.5, 2.0))),
            10 ** rng.uniform(1, 4),
            pedestal=fem.Pedestal(rng.uniform(0, 80), 1e8, 100.0) if rng.random() < 0.2 else None,
        )
        for node, k in zip(ends, stiff, strict=True)
    ]
    knots = np.unique(np.concatenate(([0.0, 1500.0], rng.uniform(0, 1500, int(rng.integers(3, 8))))))
    q = np.where(rng.random(knots.size) < 0.5, 0.0, 10 ** rng.uniform(4, 7, knots.size))
    back = rng.choice([1.0, 0.6])
    seal = fem.Support(
        int(rng.integers(1, n + 2)),
        [((0.0, k), (-back * k, 0.0)) for k in q],
        rng.choice([0.0, 30.0, 1000.0]),
        speeds=tuple(knots),
        kind="seal",
    )
    return fem.Rotor(
        rng.uniform(0.05, 0.2, n),
        rng.uniform(0.03, 0.1, n),
        discs=[fem.Disc(int(rng.integers(1, n + 2)), rng.uniform(5, 50), tilting, 0.6 * tilting)],
        supports=[*bearings, seal],
        material_damping=float(rng.choice([0.0, 1e-5])),
        model=fem.Model(rotary_inertia=True, gyroscopic=True),
    )


def largest_growth(rotor, speed):
    """max Re λ / |λ| from dense matrices of the whole rotor."""
    D = dense_rotor.assemble(rotor, speed)
    shift, size = 77.0, len(D.M)
    inverse = np.linalg.inv(D.dynamic(shift))
    companion = np.block(
        [[-inverse @ (D.C + 2 * shift * D.M), -inverse @ D.M], [np.eye(size), np.zeros((size, size))]]
    )
    mu = np.linalg.eigvals(companion)
    lam = 1 / mu[np.abs(mu) > 1e-7 * np.abs(mu).max()] + shift
    lam = lam[np.abs(lam) > 1e-3]
    return float((lam.real / np.abs(lam)).max())


def test_no_window_of_instability_is_missed_in_drawn_rotors():
    rng = np.random.default_rng(16)
    speeds = np.linspace(2.0, 1498.0, 120 if FULL else 40)
    wrong, windows = {}, 0
    for number in range(200 if FULL else 15):
        rotor = drawn(rng)
        found = unstable_windows(rotor, speeds)
        windows += len(found)
        growth = np.array([largest_growth(rotor, speed) for speed in speeds])
        inside = within(found, speeds)
        missed, false = (growth > 1e-6) & ~inside, (growth < -1e-6) & inside
        if missed.any() or false.any():
            wrong[number] = speeds[missed], speeds[false]
        for window in found:
            for edge, there in ((window.first, window.begins), (window.last, window.ends)):
                if there:
                    assert abs(largest_growth(rotor, edge)) < 1e-5
    assert wrong == {}
    assert windows > 5


def test_the_threshold_is_the_edge_of_the_first_window_whatever_mode_grows():
    rng = np.random.default_rng(5)
    speeds = np.linspace(2.0, 1498.0, 41)
    highest = 0
    for _ in range(12):
        rotor = drawn(rng)
        windows = unstable_windows(rotor, speeds)
        found = fem.stability_threshold(rotor, 1498.0, lowest=2.0, n=1)
        if not windows or not windows[0].begins:
            assert found.status == ("unstable" if windows else "stable")
            continue
        assert found.threshold == pytest.approx(windows[0].first, rel=1e-5)
        assert (found.mode, found.direction) == (windows[0].mode, windows[0].direction)
        highest = max(highest, found.mode)
    assert highest > 8  # among the modes that were watched before there was none


def test_many_speeds_are_judged_as_each_alone():
    """Ranges that are certified as a whole hold what single speeds say."""
    for material in (0.0, 2e-4):
        rotor = inner(material) if material else machine()
        speeds = np.linspace(20.0, 1500.0, 400)
        together = within(unstable_windows(rotor, speeds), speeds)
        alone = [bool(unstable_windows(rotor, np.array([speed]))) for speed in speeds[::16]]
        np.testing.assert_array_equal(together[::16], alone)


def test_no_mode_grows_above_its_bound():
    rng = np.random.default_rng(4)
    for _ in range(10):
        rotor = drawn(rng)
        speeds = rng.uniform(2.0, 1498.0, 5)
        for speed, bound in zip(speeds, growth_bound(rotor, speeds), strict=True):
            lam = dense_rotor.whirl(rotor, speed)[0]
            growing = lam[lam.real > 1e-6 * np.abs(lam)]
            assert (growing.imag <= bound * (1 + 1e-9)).all()
