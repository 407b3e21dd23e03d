"""Where the small model loses stability, beside the full rotor, against closed forms."""

import dataclasses
import json
import math

import numpy as np
import pytest
from fem_rotors import ROOT, machines, rotor23
from hypothesis import given, settings
from hypothesis import strategies as st
from repetitions import FULL
from small_models import compare_stability, small_rotor, stability_threshold, whirl_of

import fem
import rotorid
from rotorid.reduction import reduce

MASS, SHAFT, DIAMETER = 20.0, 1.0, 0.03
STIFFNESS = 48 * fem.STEEL_MODULUS * math.pi / 64 * DIAMETER**4 / SHAFT**3  # of a simply supported shaft
CRITICAL = math.sqrt(STIFFNESS / MASS)
COMPRESSOR = ROOT / "sample_data" / "compressor" / "rotor.toml"


def jeffcott(*supports, bearing=1e13, material=0.0, modal=()):
    """A disc in the middle of a massless shaft, as a small rotor of one mass.

    Bearings of 1e13 N/m take 2e-8 of the shaft's stiffness away: far less than the 1e-6 asked for.
    """
    rotor = fem.Rotor(
        [SHAFT / 2, SHAFT / 2],
        DIAMETER,
        density=0.0,
        discs=[fem.Disc(2, MASS)],
        supports=[fem.Support(1, bearing), fem.Support(3, bearing), *supports],
        material_damping=material,
    )
    return small_rotor(rotor, (2,), [MASS], modal_damping=modal)


def compressor(nodes, modes):
    rotor = rotorid.read_rotor(COMPRESSOR)
    return small_rotor(rotor, nodes, reduce(rotor, nodes, modes).masses.solution)


def growth(small, speed):
    """Largest Re λ / |λ| of the state space's eigenvalues: another way than the search's."""
    values = small.eigenvalues(speed)
    return float((values.real / np.abs(values)).max())


@pytest.mark.parametrize("ratio", [0.0, 0.2, 1.0, 5.0])
def test_internal_damping(ratio):
    """Stable up to ω0 (1 + c_e / c_i), in both models.

    Material damping β resists the rate of strain in the turning shaft: the force on the disc is k z +
    β k (z' − i Ω z), so that c_i = β k. With z = e^{iωt} and c_e outside, (c_e + c_i) ω = c_i Ω at the
    threshold, and ω = ω0.
    """
    material = 1e-4
    internal = material * STIFFNESS
    expected = CRITICAL * (1 + ratio)
    cost = compare_stability(
        jeffcott(fem.Support(2, 0.0, ratio * internal), material=material), 2.3 * expected
    )
    for found, threshold in ((cost.full, cost.full.threshold), (cost.small, cost.small.threshold)):
        assert threshold == pytest.approx(expected, rel=1e-6)
        assert found.frequency == pytest.approx(CRITICAL, rel=1e-6)
        assert found.whirl_ratio == pytest.approx(1 / (1 + ratio), rel=1e-6)
        assert (found.mode, found.direction) == (2, 1)  # backward whirl comes first
    assert cost.small.threshold == pytest.approx(cost.full.threshold, rel=1e-10)


@settings(max_examples=25, deadline=None)
@given(
    bearing=st.floats(-1.0, 4.0),
    material=st.floats(-5.5, -3.5),
    external=st.floats(0.02, 4.0),
)
def test_internal_damping_on_flexible_bearings(bearing, material, external):
    """Exact: only the shaft's share of the deflection is damped inside.

    k_s (1 + iβ (ω − Ω)) in series with the bearings' 2 k_b must balance m ω² − i c_e ω.
    """
    beta, support = 10.0**material, 10.0**bearing * STIFFNESS
    c = external * beta * STIFFNESS
    small = jeffcott(fem.Support(2, 0.0, c), bearing=support, material=beta)
    # In series the inner damping counts by the square of the shaft's share.
    share = 2 * support / (2 * support + STIFFNESS)
    estimate = CRITICAL * math.sqrt(share) * (1 + c / (beta * STIFFNESS * share**2))
    found = stability_threshold(small, 1.7 * estimate)
    assert found.status == "threshold"
    shaft = STIFFNESS * (1 + 1j * beta * (found.frequency - found.threshold))
    balance = shaft * 2 * support / (shaft + 2 * support) - MASS * found.frequency**2
    assert abs(balance + 1j * c * found.frequency) < 1e-9 * STIFFNESS


def test_modal_damping_is_external():
    """2 ζ ω0 m of the surroundings: stable up to ω0 (1 + 2 ζ / (β ω0))."""
    material, ratio = 1e-4, 0.004
    found = stability_threshold(jeffcott(material=material, modal=(ratio,)), 1000.0)
    expected = CRITICAL * (1 + 2 * ratio / (material * CRITICAL))
    assert found.threshold == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("kyy", [1e6, 2e6])
def test_modal_damping_in_both_models_of_the_planes(kyy):
    """With the complex coordinate and with both planes the state space says the same."""
    bearings = [fem.Support(n, ((1e6, 0.0), (0.0, kyy))) for n in (1, 3)]
    rotor = dataclasses.replace(jeffcott(material=1e-4).rotor, supports=bearings)
    assert rotor.symmetric == (kyy == 1e6)
    small = small_rotor(rotor, (2,), [MASS], modal_damping=(0.03,))
    found = stability_threshold(small, 3000.0)
    assert found.status == "threshold"
    assert abs(growth(small, found.threshold)) < 1e-11


def test_beside_an_undamped_mode():
    """Three equal masses, a seal at the middle one: the mode (1, 0, -1) stays undamped, another grows.

    Damping is so small that growth beyond rounding begins well above the threshold q = b ω1. With the seal in
    the shaft's middle, masses at equal distances: ω1 is the lower symmetric mode of the undamped rotor.
    """
    damping, top = 0.01, 1000.0
    plain = fem.Rotor(
        [0.25] * 4,
        0.03,
        density=0.0,
        discs=[fem.Disc(n, MASS) for n in (2, 3, 4)],
        supports=[fem.Support(1, 1e7), fem.Support(5, 1e7)],
    )
    first = fem.critical_speeds(plain, 1).frequencies[0]
    q = damping * first / 600.0 * top
    seal = fem.Support(
        3, [((0, 0), (0, 0)), ((0, q), (-q, 0))], [damping, damping], speeds=(0.0, top), kind="seal"
    )
    rotor = dataclasses.replace(plain, supports=[*plain.supports, seal])
    found = stability_threshold(small_rotor(rotor, (2, 3, 4), [MASS] * 3), top, steps=7)
    assert found.threshold == pytest.approx(600.0, rel=1e-8)
    assert found.frequency == pytest.approx(first, rel=1e-8)


@pytest.mark.parametrize(("factor", "status"), [(1 - 1e-6, "stable"), (1 + 1e-6, "unstable")])
def test_cross_coupling_at_the_limit(factor, status):
    """[S] (26): m x'' + b x' + c x + q y = 0, m y'' + b y' + c y − q x = 0 is stable up to q = b ω0."""
    damping = 150.0
    q = factor * damping * CRITICAL
    cost = compare_stability(jeffcott(fem.Support(2, ((0, q), (-q, 0)), damping, kind="seal")), 500.0)
    assert cost.full.status == cost.small.status == status
    assert cost.summary().startswith(f"Full rotor: {status}")
    assert f"\n1-mass model: {status}" in cost.summary()


@pytest.mark.parametrize("part", [0.3, 0.5, 0.8])
def test_cross_coupling_that_grows_with_speed(part):
    """A seal's q = part · b Ω: stable up to ω0 / part, where q = b ω0."""
    damping, top = 150.0, 1000.0
    q = part * damping * top
    seal = fem.Support(
        2, [((0, 0), (0, 0)), ((0, q), (-q, 0))], [damping, damping], speeds=(0.0, top), kind="seal"
    )
    cost = compare_stability(jeffcott(seal), top)
    for found in (cost.full, cost.small):
        assert found.threshold * part * damping == pytest.approx(damping * CRITICAL, rel=1e-6)
        assert found.whirl_ratio == pytest.approx(part, rel=1e-6)
        assert found.direction == 1
    assert cost.relative_difference == pytest.approx(0.0, abs=1e-10)


def test_lumped_rotor_is_the_full_one():
    """Discs on a massless shaft with whirling tables and a pedestal: thresholds and decrements agree."""
    tables = [
        [((2e6, 1e5), (-1e5, 2.4e6)), ((2e6, 2.5e6), (-2.5e6, 2.6e6))],
        [((900.0, 0.0), (0.0, 700.0)), ((500.0, 0.0), (0.0, 600.0))],
    ]
    rotor = fem.Rotor(
        [0.2, 0.3, 0.25, 0.15, 0.3],
        [0.05, 0.06, 0.06, 0.05, 0.05],
        density=0.0,
        discs=[fem.Disc(n, m) for n, m in ((2, 40.0), (4, 90.0), (5, 25.0))],
        supports=[
            fem.Support(1, *tables, speeds=(0.0, 900.0)),
            fem.Support(6, 3e6, 500.0, pedestal=fem.Pedestal(60.0, (8e6, 5e6), 2e3)),
        ],
        material_damping=2e-6,
    )
    small = small_rotor(rotor, (2, 4, 5), [40.0, 90.0, 25.0])
    cost = compare_stability(small, 900.0)
    assert cost.full.status == "threshold"
    assert cost.small.threshold == pytest.approx(cost.full.threshold, rel=1e-8)
    assert cost.small.frequency == pytest.approx(cost.full.frequency, rel=1e-8)
    assert (cost.small.mode, cost.small.direction) == (cost.full.mode, cost.full.direction)
    assert cost.small_decrement == pytest.approx(cost.full_decrement, rel=1e-6, abs=1e-9)
    assert cost.warnings == ()


@pytest.mark.parametrize(("nodes", "modes"), [((8, 14, 20), 1), ((4, 13, 22), 3), ((4, 13, 18, 22), 3)])
def test_compressor(nodes, modes):
    """Speed-dependent bearings and a swirling seal: the small models lose stability within 3 %."""
    small = compressor(nodes, modes)
    cost = compare_stability(small, 1600.0, lowest=110.0, steps=20)
    assert cost.full.threshold == pytest.approx(1144.84, rel=1e-5)
    assert abs(cost.relative_difference) < 0.03
    assert cost.small.frequency == pytest.approx(cost.full.frequency, rel=0.01)
    assert cost.small.whirl_ratio == pytest.approx(cost.full.whirl_ratio, rel=0.06)
    assert cost.small.direction == cost.full.direction == 1
    # The threshold by the state space's eigenvalues.
    at = cost.small.threshold
    assert abs(growth(small, at)) < 1e-9
    assert growth(small, 0.999 * at) < 0 < growth(small, 1.001 * at)
    assert np.sign(cost.small_decrement).tolist() == np.where(cost.speeds < at, 1.0, -1.0).tolist()


def test_decrements_are_those_of_the_eigenvalues():
    small = compressor((8, 14, 20), 1)
    cost = compare_stability(small, 1600.0, lowest=110.0, steps=5)
    campbell = fem.campbell(small.rotor, cost.speeds, 8)
    assert cost.full_decrement == pytest.approx(np.nanmin(campbell.log_decrements, axis=1), rel=1e-6)
    for k, speed in enumerate(cost.speeds):
        values = small.eigenvalues(speed)
        values = values[values.imag > 0.1 * np.abs(values)]
        decrements = -2 * np.pi * values.real / values.imag
        least = int(np.argmin(decrements))
        assert cost.small_decrement[k] == pytest.approx(decrements[least], rel=1e-7)


def test_running_away():
    """A seal whose negative stiffness grows with speed pushes the disc aside where it equals the shaft's."""
    top = 1000.0
    series = STIFFNESS * 2e13 / (STIFFNESS + 2e13)  # with the bearings
    rate = series / 612.0
    seal = fem.Support(2, [0.0, -rate * top], [300.0, 300.0], speeds=(0.0, top), kind="seal")
    small = jeffcott(seal)
    for steps in (3, 7, 40):
        found = stability_threshold(small, top, steps=steps)
        assert found.status == "threshold"
        assert found.threshold == pytest.approx(612.0, rel=1e-10)
        assert found.frequency is None
        assert "runs away" in found.summary()
    cost = compare_stability(small, top)
    assert np.isneginf(cost.small_decrement[cost.speeds > 612.0]).all()
    assert np.isfinite(cost.small_decrement[cost.speeds < 500.0]).all()
    assert json.loads(json.dumps(cost.to_dict(), allow_nan=False))["small_log_decrement"][-1] is None


def test_undamped_is_not_unstable():
    small = small_rotor(rotor23(), (7, 12, 18), [89.0, 196.0, 198.0])
    cost = compare_stability(small, 1000.0)
    assert cost.full.status == cost.small.status == "stable"
    assert cost.small.threshold is None
    assert cost.relative_difference is None
    assert np.abs([cost.full_decrement, cost.small_decrement]).max() < 1e-8


def test_unstable_from_the_start():
    q = 1e6
    cost = compare_stability(jeffcott(fem.Support(2, ((0, q), (-q, 0)), 10.0, kind="seal")), 500.0)
    assert cost.small.status == "unstable"
    assert cost.small.direction == 1
    assert cost.summary().count(": unstable already at 0 rad/s") == 2
    away = stability_threshold(jeffcott(fem.Support(2, -2 * STIFFNESS, 10.0, kind="seal")), 500.0)
    assert (away.status, away.mode) == ("unstable", None)


def test_disagreement_is_said():
    """A mass where the mode that loses stability has a node: the small model does not see it."""
    rotor = rotor23()
    seal = fem.Support(12, ((0.0, 3e6), (-3e6, 0.0)), kind="seal")
    damped = [fem.Support(s.node, s.stiffness, 2e4) for s in rotor.supports]
    driven = fem.Rotor(rotor.length, rotor.outer_diameter, discs=rotor.discs, supports=[*damped, seal])
    heavy = small_rotor(driven, (7, 12, 18), [89.0, 196.0, 198.0])
    first = compare_stability(heavy, 500.0)
    assert first.full.status == first.small.status == "unstable"
    calm = small_rotor(rotor, (7, 12, 18), [89.0, 196.0, 198.0], modal_damping=(0.3, 0.3, 0.3))
    second = dataclasses.replace(first, small=stability_threshold(calm, 500.0))
    assert second.small.status == "stable"
    assert second.summary().startswith("The models DISAGREE. Full rotor: unstable already at 0 rad/s")
    assert "3-mass model: stable from 0 to 500 rad/s" in second.answer.judgement


def test_other_mode_is_said():
    """Masses that are far from the rotor's whirl at another frequency where they lose stability."""
    material = 1e-4
    rotor = jeffcott(fem.Support(2, 0.0, 20.0), material=material).rotor
    cost = compare_stability(small_rotor(rotor, (2,), [2 * MASS]), 900.0)
    assert "not the same mode" in " ".join(cost.warnings)
    assert "\nWarning: the full rotor loses stability with whirl at" in cost.summary()


@settings(max_examples=60 if FULL else 25, deadline=None)
@given(rotor=machines(elements=(4, 12)), seed=st.integers(0, 2**32 - 1))
def test_thresholds_of_random_rotors(rotor, seed):
    """Gyroscopic, cross-coupled, tabulated, on pedestals: the state space's eigenvalues say the same."""
    rng = np.random.default_rng(seed)
    nodes = rng.choice(np.arange(1, rotor.n_nodes + 1), 3, replace=False)
    small = small_rotor(rotor, nodes.tolist(), rng.uniform(5.0, 200.0, 3))
    found = stability_threshold(small, 1000.0)
    grid = np.linspace(0.0, 1000.0, 41)
    if found.status == "stable":
        assert max(growth(small, speed) for speed in grid) < 1e-7
    elif found.status == "unstable":
        assert growth(small, 0.0) > 0
    else:
        at = found.threshold
        assert max(growth(small, speed) for speed in [*grid[grid < at * (1 - 1e-6)], at * (1 - 1e-6)]) < 1e-7
        assert growth(small, at * (1 + 1e-6)) > 0
        if found.frequency is not None:
            assert np.abs(small.eigenvalues(at) - 1j * found.frequency).min() < 1e-6 * found.frequency


def test_no_motion_is_left_out():
    """Gyroscopic moments make a support without mass oscillate, too: seven modes of three masses."""
    rotor = fem.Rotor(
        [0.3] * 4,
        0.0756,
        discs=[fem.Disc(5, 10.0, 5.0, 0.5)],
        supports=[fem.Support(1, 1e7, 1e3), fem.Support(5, ((8e7, 7.5e7), (-7.5e7, 8e7)), 270.0)],
        model=fem.Model(rotary_inertia=True, gyroscopic=True),
    )
    small = small_rotor(rotor, (2, 3, 4), [20.0] * 3)
    values = small.eigenvalues(500.0)
    expected = values[values.imag > 0.1 * np.abs(values)]
    found = whirl_of(small, np.array([500.0])).values[0]
    found = found[np.isfinite(found)]
    assert expected.size == found.size == 7
    both_ways = np.where(found.imag > 0, found, found.conj())
    distance = np.abs(both_ways[:, None] - expected) / np.abs(expected)
    assert distance.min(axis=0) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("highest", "options", "message"),
    [
        (10.0, {"lowest": 20.0}, "range of speeds is empty"),
        (10.0, {"lowest": -5.0}, "not negative"),
        (np.inf, {}, "finite"),
        (np.nan, {}, "finite"),
        (10.0, {"steps": 0}, "at least one step"),
        (10.0, {"steps": 2.5}, "at least one step"),
    ],
)
def test_bad_input(highest, options, message):
    for function in (compare_stability, stability_threshold):
        with pytest.raises(ValueError, match=message):
            function(jeffcott(), highest, **options)
