"""The steady response of a rotor that whirls by itself does not exist, and this is said."""

import dataclasses

import dense_rotor
import numpy as np
import pytest
from fem_rotors import rotor23
from repetitions import FULL
from whirl_rotors import machine

import fem
from fem._new.stability import growth_bound, judge, within

SPEEDS = np.linspace(50.0, 1500.0, 60)


def unstable_windows(rotor, speeds):
    return judge(rotor, speeds)[0]


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


@pytest.mark.full
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


def test_the_windows_of_a_campbell_diagram_are_those_of_the_rotor():
    rng = np.random.default_rng(8)
    speeds = np.linspace(2.0, 1498.0, 41)
    from_list = windows = 0
    for _ in range(24 if FULL else 14):
        rotor = drawn(rng)
        expected, found = unstable_windows(rotor, speeds), fem.campbell(rotor, speeds, 4)
        windows += len(expected)
        from_list += len(expected) > 0 and len(found.unstable) > 0
        ends = [
            [end for window in some for end in (window.first, window.last)]
            for some in (found.windows, expected)
        ]
        assert ends[0] == pytest.approx(ends[1], rel=1e-6)
        assert [w.begins for w in found.windows] == [w.begins for w in expected]
        assert [w.ends for w in found.windows] == [w.ends for w in expected]
    assert windows > 10
    assert from_list > 5


def pushed_at_rest():
    """Held by bearings, pushed aside by a seal at low speed and at rest."""
    seal = fem.Support(2, [-2e6, -1e5], speeds=(0.0, 500.0), kind="seal")
    bearings = [fem.Support(node, 1e6, 100.0) for node in (1, 3)]
    disc, model = fem.Disc(2, 10.0, 0.1, 0.05), fem.Model(rotary_inertia=True, gyroscopic=True)
    return fem.Rotor([0.3, 0.3], 0.04, discs=[disc], supports=[*bearings, seal], model=model)


@pytest.mark.parametrize("speeds", [[0.0], [0.0, 400.0], [0.0, 1.0, 100.0, 400.0]])
def test_a_rotor_that_is_pushed_aside_at_rest(speeds):
    rotor = pushed_at_rest()
    assert largest_growth(rotor, 0.0) > 0.5
    assert largest_growth(rotor, 400.0) < 0
    (window,) = unstable_windows(rotor, np.array(speeds))
    assert window.first == 0.0
    assert not window.begins
    assert window.mode is None
    assert window.last < 400.0
    if len(speeds) > 1:
        said = [text for text in fem.campbell(rotor, speeds).warnings if "runs away" in text]
        assert [f"to {window.last:.6g} rad/s" in text for text in said] == [True]


def of_many_elements(rng):
    """More unknowns than the whole space is taken for; seals, and material damping here and there."""
    n = int(rng.integers(22, 28))
    kinds = rng.permutation(["cross", "push", "none"])
    stiff = 10 ** rng.uniform(6, 8.5, 3)
    supports = [
        fem.Support(int(node), ((k, 0.0), (0.0, k * rng.uniform(0.5, 2))), 10 ** rng.uniform(1.5, 4.5))
        for node, k in zip(rng.choice(np.arange(1, n + 2), 3, replace=False), stiff, strict=True)
    ]
    knots = np.unique(np.concatenate(([0.0, 1500.0], rng.uniform(0, 1500, 4))))
    for kind in kinds[:2]:
        q = np.where(rng.random(knots.size) < 0.5, 0.0, 10 ** rng.uniform(4, 7, knots.size))
        k = {"cross": [((0.0, one), (-one, 0.0)) for one in q], "push": (-0.3 * q).tolist()}.get(kind)
        if k is not None:
            node, c = int(rng.integers(1, n + 2)), rng.choice([30.0, 1000.0])
            supports.append(fem.Support(node, k, c, speeds=tuple(knots), kind="seal"))
    disc = rng.uniform(5, 50)
    return fem.Rotor(
        rng.dirichlet(np.full(n, 8.0)) * rng.uniform(0.6, 3.0),
        rng.uniform(0.03, 0.12, n),
        discs=[fem.Disc(int(rng.integers(1, n + 2)), disc, 0.015 * disc, 0.01 * disc)],
        supports=supports,
        material_damping=np.where(rng.random(n) < 0.5, 10 ** rng.uniform(-6, -3.5), 0.0),
        model=fem.Model(rotary_inertia=True, gyroscopic=True),
    ), knots


@pytest.mark.full
def test_no_window_is_missed_where_the_basis_is_a_part_of_the_space():
    rng = np.random.default_rng(3)
    wrong, unstable = {}, 0
    for number in range(60 if FULL else 8):
        rotor, knots = of_many_elements(rng)
        speeds = np.union1d(np.linspace(0.0, 1500.0, int(rng.choice([3, 40, 200]))), knots)
        inside = within(unstable_windows(rotor, speeds), speeds)
        edges = np.flatnonzero(np.diff(inside.astype(int)))
        looked = np.unique(np.concatenate((edges, edges + 1, rng.integers(0, speeds.size, 8))))
        growth = np.array([largest_growth(rotor, speed) for speed in speeds[looked]])
        unstable += int((growth > 1e-6).sum())
        bad = ((growth > 1e-6) & ~inside[looked]) | ((growth < -1e-6) & inside[looked])
        if bad.any():
            wrong[number] = speeds[looked][bad]
    assert wrong == {}
    assert unstable > 5


def test_two_windows_are_not_one_where_no_speed_between_is_asked_for():
    rotor = two_windows()
    windows = unstable_windows(rotor, np.array([110.0, 295.0, 296.0]))
    assert [window.first for window in windows] == pytest.approx([110.0, 286.458], abs=1e-3)
    assert [window.last for window in windows] == pytest.approx([117.084, 296.0], abs=1e-3)
    assert [(window.begins, window.ends) for window in windows] == [(False, True), (True, False)]
    (only,) = unstable_windows(rotor, np.array([50.0, 295.0, 350.0]))  # that about 110 is not asked about
    assert (only.first, only.last) == pytest.approx((286.458, 303.542), abs=1e-3)


def two_windows():
    """A seal that drives whirl about 110 and about 295 rad/s, and nowhere else."""
    knots = (0.0, 100.0, 110.0, 120.0, 285.0, 290.0, 300.0, 305.0, 1200.0)
    q = [3e5 * (speed in (110.0, 290.0, 300.0)) for speed in knots]
    seal = fem.Support(3, [((0.0, k), (-k, 0.0)) for k in q], 300.0, speeds=knots, kind="seal")
    disc, model = fem.Disc(3, 10.0, 0.1, 0.05), fem.Model(rotary_inertia=True, gyroscopic=True)
    bearings = [fem.Support(node, 1e8) for node in (1, 5)]
    return fem.Rotor([0.25] * 4, 0.04, discs=[disc], supports=[*bearings, seal], model=model)


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
