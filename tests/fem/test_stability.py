"""Thresholds and ranges of instability, against closed forms and dense matrices of drawn rotors."""

import dataclasses

import dense_rotor
import numpy as np
import pytest
from exact_solutions import whirl_exactly
from fem_rotors import rotor23
from jeffcott import CRITICAL, STIFFNESS, jeffcott
from repetitions import FULL
from whirl_rotors import machine

import fem
from fem.stability import judge, within


@pytest.mark.parametrize("ratio", [0.2, 1.0, 5.0])
def test_internal_damping(ratio):
    """Stable up to ω0 (1 + c_e / c_i)."""
    material = 1e-4
    rotor = jeffcott(fem.Support(2, 0.0, ratio * material * STIFFNESS), material=material)
    expected = CRITICAL * (1 + ratio)
    found = fem.stability_threshold(rotor, 2 * expected)
    assert found.status == "threshold"
    assert found.threshold == pytest.approx(expected, rel=1e-7)
    assert found.frequency == pytest.approx(CRITICAL, rel=1e-7)
    assert found.whirl_ratio == pytest.approx(1 / (1 + ratio), rel=1e-7)
    assert found.direction == 1


@pytest.mark.parametrize(("factor", "status"), [(1 - 1e-6, "stable"), (1 + 1e-6, "unstable")])
def test_cross_coupling_at_the_limit(factor, status):
    """q = b ω0 is the limit."""
    damping = 150.0
    q = factor * damping * CRITICAL
    rotor = jeffcott(fem.Support(2, ((0, q), (-q, 0)), damping, kind="seal"))
    assert fem.stability_threshold(rotor, 500.0).status == status


def test_cross_coupling_that_grows_with_speed():
    """q = b Ω / 2, as in a plain seal: stable up to 2 ω0, whirl ratio 1/2."""
    damping, top = 150.0, 1000.0
    q = damping * top / 2
    seal = fem.Support(
        2, [((0, 0), (0, 0)), ((0, q), (-q, 0))], [damping, damping], speeds=(0.0, top), kind="seal"
    )
    found = fem.stability_threshold(jeffcott(seal), top)
    assert found.threshold == pytest.approx(2 * CRITICAL, rel=1e-7)
    assert found.whirl_ratio == pytest.approx(0.5, rel=1e-8)


def test_the_margin_is_the_least_decrement_of_the_range():
    """Internal damping takes away from the forward whirl, the more the faster the rotor runs."""
    material = 1e-4
    rotor = jeffcott(fem.Support(2, 0.0, 5 * material * STIFFNESS), material=material)
    found = fem.stability_threshold(rotor, 4 * CRITICAL)  # the threshold lies at 6 times
    last = whirl_exactly(rotor, 4 * CRITICAL, 2).eigenvalues
    expected = (-2 * np.pi * last.real / abs(last.imag)).min()
    assert found.status == "stable"
    assert found.margin == pytest.approx(expected, rel=1e-6)
    assert found.margin < 0.6 * fem.stability_threshold(rotor, CRITICAL).margin


def test_stable_and_unstable_from_the_start():
    seal = fem.Support(2, ((0, 1e6), (-1e6, 0)), 10.0, kind="seal")
    driven = fem.stability_threshold(jeffcott(seal), 500.0)
    assert (driven.status, driven.direction) == ("unstable", 1)
    assert driven.to_dict()["threshold_rad_s"] is None
    pushed = jeffcott(fem.Support(2, -2 * STIFFNESS, 10.0, kind="seal"))
    assert fem.stability_threshold(pushed, 500.0, n=1).status == "unstable"
    still = fem.stability_threshold(rotor23(), 1000.0)
    assert (still.status, still.threshold, still.whirl_ratio) == ("stable", None, None)


@pytest.mark.parametrize(
    ("highest", "options", "message"),
    [
        (10.0, {"lowest": 20.0}, "range of speeds is empty"),
        (10.0, {"steps": 0}, "at least one step"),
        (10.0, {"steps": 2.5}, "at least one step"),
        (10.0, {"lowest": -5.0}, "not negative"),
        (150.0, {}, "support 'seal' at node 2: its table holds 100 to 200"),
    ],
)
def test_bad_input(highest, options, message):
    rotor = jeffcott(fem.Support(2, [1e3, 1e3], [1.0, 1.0], speeds=(100.0, 200.0), name="seal"))
    with pytest.raises(ValueError, match=message):
        fem.stability_threshold(rotor, highest, **options)
    assert fem.stability_threshold(rotor, 200.0, lowest=100.0).status == "stable"


@pytest.mark.parametrize(("loss", "highest"), [(1e-13, 5000.0), (1e-10, 700.0), (1e-7, 1000.0)])
def test_a_threshold_does_not_depend_on_the_size_of_tiny_losses(loss, highest):
    # internal damping alone: stable up to the critical speed, whatever its size
    ends = [fem.Support(1, 1e8), fem.Support(5, 1e8)]
    rotor = fem.Rotor([0.25] * 4, 0.05, supports=ends, material_damping=loss)
    critical = fem.critical_speeds(rotor, 1).frequencies[0]
    assert fem.stability_threshold(rotor, highest).threshold == pytest.approx(critical, rel=1e-10)
    (window,) = fem.campbell(rotor, np.arange(100.0, 1000.0, 100.0)).windows
    assert window.first == pytest.approx(critical, rel=1e-10)
    assert not fem.campbell(rotor, np.arange(100.0, 650.0, 100.0)).windows


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


def test_growth_is_told_with_its_threshold():
    rotor, speeds = inner(2e-4), SPEEDS[::6]
    threshold = fem.stability_threshold(rotor, 1500.0).threshold
    for result in (
        fem.unbalance_response(rotor, {5: 1e-4}, speeds[::-1]),
        fem.influence(rotor, [5], [7], speeds),
    ):
        assert f"does not exist above {threshold:.6g} rad/s" in result.warnings[-1]
        assert f"up to the last speed, {speeds[-1]:.6g} rad/s" in result.warnings[-1]
        assert "mode 2 (forward whirl" in result.warnings[-1]
    above = fem.unbalance_response(rotor, {5: 1e-4}, 1.05 * threshold)
    assert f"does not exist at {1.05 * threshold:.6g} rad/s" in above.warnings[-1]
    assert fem.unbalance_response(rotor, {5: 1e-4}, 0.95 * threshold).warnings == ()
    assert fem.unbalance_response(inner(1e-7), {5: 1e-4}, SPEEDS).warnings == ()


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


def largest_growth(rotor, speed, highest=np.inf):
    """max Re λ / |λ| from dense matrices of the whole rotor, of frequencies up to the highest."""
    lam = dense_rotor.whirl(rotor, speed)[0]
    lam = lam[(abs(lam) > 1e-3) & (abs(lam) < highest)]
    return float((lam.real / abs(lam)).max())


@pytest.mark.full
def test_no_window_of_instability_is_missed_in_drawn_rotors():
    rng = np.random.default_rng(16)
    speeds = np.linspace(2.0, 1498.0, 120 if FULL else 40)
    wrong, windows = {}, 0
    for number in range(200 if FULL else 15):
        rotor = drawn(rng)
        found = unstable_windows(rotor, speeds)
        windows += len(found)
        every, low = ([largest_growth(rotor, speed, top) for speed in speeds] for top in (np.inf, 3000.0))
        inside = within(found, speeds)  # looked for up to twice the highest speed
        missed, false = (np.array(low) > 1e-6) & ~inside, (np.array(every) < -1e-6) & inside
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


def pushed_at_rest():
    """Held by bearings, pushed aside by a seal at low speed and at rest."""
    seal = fem.Support(2, [-2e6, -1e5], speeds=(0.0, 500.0), kind="seal")
    bearings = [fem.Support(node, 1e6, 100.0) for node in (1, 3)]
    disc, model = fem.Disc(2, 10.0, 0.1, 0.05), fem.Model(rotary_inertia=True, gyroscopic=True)
    return fem.Rotor([0.3, 0.3], 0.04, discs=[disc], supports=[*bearings, seal], model=model)


@pytest.mark.parametrize("speeds", [[0.0, 400.0], [0.0, 1.0, 100.0, 400.0]])
def test_a_rotor_that_is_pushed_aside_at_rest(speeds):
    rotor = pushed_at_rest()
    assert largest_growth(rotor, 0.0) > 0.5
    assert largest_growth(rotor, 400.0) < 0
    (window,) = unstable_windows(rotor, np.array(speeds))
    assert window.first == 0.0
    assert not window.begins
    assert window.mode is None
    assert window.last < 400.0
    said = [text for text in fem.campbell(rotor, speeds).warnings if "runs away" in text]
    assert [f"to {window.last:.6g} rad/s" in text for text in said] == [True]
    with pytest.raises(ValueError, match="statically unstable"):
        unstable_windows(rotor, np.array([0.0]))


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
