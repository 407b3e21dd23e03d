"""The small model beside the full rotor: response and stability."""

import dataclasses
import json

import numpy as np
import pytest
from cases import each_of
from fem_rotors import machines, rotor23
from hypothesis import given, settings
from hypothesis import strategies as st
from jeffcott import BEARING, CRITICAL, MASS, STIFFNESS, jeffcott
from repetitions import FULL
from small_models import compare_response, compare_stability, small_rotor, stability_threshold, whirl_of

import fem
from rotorid.reduction import reduce

NODES = (7, 12, 18)


def book():
    rotor = rotor23()
    return small_rotor(rotor, NODES, reduce(rotor, NODES, 2).masses.solution)


def lumped(supports, *, material=0.0):
    """A massless shaft with masses at nodes 2, 4 and 5: the small model of it is the rotor itself."""
    masses = {2: 40.0, 4: 90.0, 5: 25.0}
    rotor = fem.Rotor(
        [0.2, 0.3, 0.25, 0.15, 0.3],
        [0.05, 0.06, 0.06, 0.05, 0.05],
        density=0.0,
        discs=[fem.Disc(n, m) for n, m in masses.items()],
        supports=supports,
        material_damping=material,
    )
    return small_rotor(rotor, tuple(masses), [*masses.values()])


STAND = fem.Pedestal(60.0, (8e6, 5e6), 2e3)
BEARINGS = {
    "damped": [fem.Support(1, 2e6, 800.0), fem.Support(6, 3e6, 500.0)],
    "whirling": [
        fem.Support(1, ((2e6, 3e5), (-2e5, 3e6)), ((900.0, 50.0), (20.0, 700.0))),
        fem.Support(6, 3e6, 500.0, pedestal=STAND),
    ],
}


# Response


def test_reference_rotor_is_followed_as_in_the_compliance_form_of_the_book():
    """Within 8 % of the largest entry, median below 1 %, up to 1.1 times the second critical speed."""
    small = book()
    cost = compare_response(small)
    second = fem.critical_speeds(rotor23(), 2).frequencies[1]
    assert cost.speeds[-1] == pytest.approx(1.1 * second, rel=1e-12)
    assert cost.sizes["largest"] < 0.08
    assert cost.sizes["median"] < 0.01
    assert cost.warnings == ()
    alpha, m = fem.compliance(rotor23(), NODES), np.diag(small.small.masses[small.small.masses > 0])
    w2 = cost.speeds[:, None, None] ** 2
    W = np.linalg.solve(np.linalg.inv(alpha) - w2 * m, w2 * np.eye(3))
    difference = abs(W - cost.full) / abs(cost.full).max(axis=(1, 2))[:, None, None]
    used = difference[~cost.excluded].max(axis=(1, 2))
    assert cost.sizes["largest"] == pytest.approx(used.max(), rel=1e-8)
    assert cost.sizes["median"] == pytest.approx(np.median(used), rel=1e-8)
    speed, sensor, plane = cost.where
    k = int(np.flatnonzero(cost.speeds == speed)[0])
    at = cost.relative_difference[k, cost.sensors.index(sensor), cost.nodes.index(plane)]
    assert at == cost.sizes["largest"] == cost.worst[~cost.excluded].max()


def test_bands_about_critical_speeds_are_left_out():
    cost = compare_response(book(), np.linspace(0.0, 600.0, 601), bands=0.1)
    criticals = fem.critical_speeds(rotor23(), 2).frequencies
    assert cost.criticals == pytest.approx(criticals)
    near = np.any([abs(cost.speeds / w - 1) < 0.1 for w in criticals], axis=0)
    np.testing.assert_array_equal(cost.excluded, near | (cost.speeds == 0))
    assert cost.bands == 0.1
    assert np.isnan(cost.relative_difference[0]).all()
    assert json.loads(json.dumps(cost.to_dict(), allow_nan=False))["relative_difference"][0] is None
    narrow = compare_response(book(), cost.speeds, bands=0.02)
    assert narrow.sizes["largest"] > cost.sizes["largest"]


@pytest.mark.parametrize("kind", BEARINGS)
def test_masses_that_are_lumped(kind):
    """A massless shaft with discs: nothing is lost by the reduction, in x and in y, with phases."""
    small = lumped(BEARINGS[kind], material=1e-5 if kind == "whirling" else 0.0)
    cost = compare_response(small, np.linspace(3.0, 700.0, 60), bands=0.05)
    assert cost.sizes["largest"] < 1e-8
    size = abs(cost.full).max(axis=(1, 2))[:, None, None]
    assert np.nanmax(abs(cost.small - cost.full) / size) < 1e-6  # in the bands, too
    assert cost.full.shape[1] == (3 if small.rotor.symmetric else 6)


def test_what_no_steady_response_follows_is_said():
    q = 1e6
    small = lumped([*BEARINGS["damped"], fem.Support(4, ((0, q), (-q, 0)), kind="seal")])
    assert "the steady response does not exist" in " ".join(compare_response(small, [50.0, 100.0]).warnings)
    plain = lumped(
        [fem.Support(n, [2e6, 2e6], [500.0, 500.0], speeds=(0.0, 20.0), name="plain") for n in (1, 6)]
    )
    cost = compare_response(plain, [5.0, 10.0, 20.0])
    assert not cost.criticals.size
    assert not cost.excluded.any()
    assert any("no band is left out" in text for text in cost.warnings)
    with pytest.raises(ValueError, match="plain"):
        compare_response(plain, [5.0, 30.0])


@each_of(
    ("speeds", "options", "message"),
    [
        ([10.0, 5.0], {}, "ascend"),
        ([10.0], {"bands": 1.0}, "part of the critical speed"),
        ([0.0, 135.0], {}, "other speeds, or narrower bands"),
        ([200.0, 100.0], {}, "must ascend, each once: sort them; 100 rad/s follows 200 rad/s"),
    ],
)
def test_bad_speeds_and_bands_are_refused(speeds, options, message):
    with pytest.raises(ValueError, match=message):
        compare_response(book(), speeds, **options)


# Stability


def one_mass(*supports, material=0.0, modal=()):
    """The Jeffcott rotor and its small model."""
    return small_rotor(jeffcott(*supports, material=material), (2,), [MASS], modal_damping=modal)


def growth(pair, speed):
    """Largest Re λ / |λ| of the state space's eigenvalues: another way than the search's."""
    values = pair.eigenvalues(speed)
    return float((values.real / abs(values)).max())


def test_modal_damping_is_external():
    """2 ζ ω0 m of the surroundings: stable up to ω0 (1 + 2 ζ / (β ω0))."""
    material, ratio = 1e-4, 0.004
    result = stability_threshold(one_mass(material=material, modal=(ratio,)), 1000.0)
    expected = CRITICAL * (1 + 2 * ratio / (material * CRITICAL))
    assert result.threshold == pytest.approx(expected, rel=1e-6)


def test_thresholds_and_decrements_of_a_lumped_rotor_are_the_rotor_s():
    """Discs on a massless shaft with whirling tables and a pedestal."""
    tables = [
        [((2e6, 1e5), (-1e5, 2.4e6)), ((2e6, 2.5e6), (-2.5e6, 2.6e6))],
        [((900.0, 0.0), (0.0, 700.0)), ((500.0, 0.0), (0.0, 600.0))],
    ]
    supports = [fem.Support(1, *tables, speeds=(0.0, 900.0)), fem.Support(6, 3e6, 500.0, pedestal=STAND)]
    cost = compare_stability(lumped(supports, material=2e-6), 900.0)
    assert cost.small.threshold == pytest.approx(cost.full.threshold, rel=1e-8)
    assert cost.small.frequency == pytest.approx(cost.full.frequency, rel=1e-8)
    assert (cost.small.mode, cost.small.direction) == (cost.full.mode, cost.full.direction)
    assert cost.small_decrement == pytest.approx(cost.full_decrement, rel=1e-6, abs=1e-9)
    assert cost.warnings == ()


def test_running_away_and_never_growing():
    """A seal whose negative stiffness grows with speed pushes the disc aside where it equals the shaft's."""
    top, series = 1000.0, STIFFNESS * 2 * BEARING / (STIFFNESS + 2 * BEARING)  # with the bearings
    seal = fem.Support(2, [0.0, -series / 612.0 * top], [300.0, 300.0], speeds=(0.0, top), kind="seal")
    cost = compare_stability(one_mass(seal), top)
    assert cost.small.threshold == pytest.approx(612.0, rel=1e-10)
    assert cost.small.frequency is None
    assert np.isneginf(cost.small_decrement[cost.speeds > 612.0]).all()
    assert json.loads(json.dumps(cost.to_dict(), allow_nan=False))["small_log_decrement"][-1] is None
    cost = compare_stability(book(), 1000.0)
    assert cost.full.status == cost.small.status == "stable"
    assert cost.small.threshold is cost.relative_difference is None
    assert np.abs([cost.full_decrement, cost.small_decrement]).max() < 1e-8


def test_disagreement_and_another_mode_are_said():
    q = 1e6
    first = compare_stability(one_mass(fem.Support(2, ((0, q), (-q, 0)), 10.0, kind="seal")), 500.0)
    assert first.full.status == first.small.status == "unstable"
    assert first.summary().count(": unstable already at 0 rad/s") == 2
    calm = stability_threshold(one_mass(modal=(0.3,)), 500.0)
    second = dataclasses.replace(first, small=calm)
    assert second.summary().startswith("The models DISAGREE. Full rotor: unstable already at 0 rad/s")
    rotor = one_mass(fem.Support(2, 0.0, 20.0), material=1e-4).rotor
    other = compare_stability(small_rotor(rotor, (2,), [2 * MASS]), 900.0)
    assert "not the same mode" in " ".join(other.warnings)


@settings(max_examples=60 if FULL else 25, deadline=None)
@given(rotor=machines(elements=(4, 12)), seed=st.integers(0, 2**32 - 1))
def test_thresholds_of_random_rotors(rotor, seed):
    """Gyroscopic, cross-coupled, tabulated, on pedestals: the state space's eigenvalues say the same."""
    rng = np.random.default_rng(seed)
    nodes = rng.choice(np.arange(1, rotor.n_nodes + 1), 3, replace=False)
    pair = small_rotor(rotor, nodes.tolist(), rng.uniform(5.0, 200.0, 3))
    result = stability_threshold(pair, 1000.0)
    grid = np.linspace(0.0, 1000.0, 41)
    if result.status == "stable":
        assert max(growth(pair, speed) for speed in grid) < 1e-7
    elif result.status == "unstable":
        assert growth(pair, 0.0) > 0
    else:
        at, before = result.threshold, result.threshold * (1 - 1e-6)
        assert max(growth(pair, speed) for speed in [*grid[grid < before], before]) < 1e-7
        assert growth(pair, at * (1 + 1e-6)) > 0
        if result.frequency is not None:
            away = abs(pair.eigenvalues(at) - 1j * result.frequency)
            assert away.min() < 1e-6 * result.frequency


def test_no_motion_is_left_out():
    """Gyroscopic moments make a support without mass oscillate, too: seven modes of three masses."""
    rotor = fem.Rotor(
        [0.3] * 4,
        0.0756,
        discs=[fem.Disc(5, 10.0, 5.0, 0.5)],
        supports=[fem.Support(1, 1e7, 1e3), fem.Support(5, ((8e7, 7.5e7), (-7.5e7, 8e7)), 270.0)],
        model=fem.Model(rotary_inertia=True, gyroscopic=True),
    )
    pair = small_rotor(rotor, (2, 3, 4), [20.0] * 3)
    values = pair.eigenvalues(500.0)
    expected = values[values.imag > 0.1 * abs(values)]
    whirl = whirl_of(pair, np.array([500.0])).values[0]
    whirl = whirl[np.isfinite(whirl)]
    assert expected.size == whirl.size == 7
    both_ways = np.where(whirl.imag > 0, whirl, whirl.conj())
    distance = abs(both_ways[:, None] - expected) / abs(expected)
    assert distance.min(axis=0) == pytest.approx(0.0, abs=1e-9)
