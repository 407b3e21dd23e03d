"""Whirl over speed; no damped critical speed over tabulated bearings is missed, also not two in a step."""

import dataclasses

import dense_rotor
import matplotlib as mpl
import numpy as np
import pytest
import repetitions
from exact_solutions import whirl_exactly
from fem_rotors import rotor23
from whirl_rotors import FULL, machine, on_tables

import fem

mpl.use("Agg")


def symmetric(damping=1e4):
    base = machine()
    return dataclasses.replace(base, supports=[fem.Support(s.node, 1e8, damping) for s in base.supports])


def overhung():
    """A flywheel at the end of the shaft: its forward tilting rises steeply and crosses another mode."""
    return fem.Rotor(
        np.full(10, 0.1),
        0.06,
        discs=[fem.Disc(11, 30.0, 1.5, 0.8), fem.Disc(4, 20.0, 0.1, 0.05)],
        supports=[fem.Support(1, 5e7, 200.0), fem.Support(8, 5e7, 200.0)],
        model=FULL,
    )


def test_modes_of_an_axisymmetric_rotor_keep_their_direction_through_crossings():
    speeds = np.linspace(10.0, 1500.0, 30)
    found = fem.campbell(overhung(), speeds, n=6)
    # Forward and backward whirl of a symmetric rotor are different families: they cross, and never mix.
    assert (found.direction == found.direction[0]).all()
    omega = found.frequencies
    assert (np.diff(omega, axis=0)[:, found.direction[0] > 0] > -1e-6).all()
    assert (np.diff(omega, axis=0)[:, found.direction[0] < 0] < 1e-6).all()
    # There is a crossing: the order of frequencies changes.
    assert (np.argsort(omega[0]) != np.argsort(omega[-1])).any()
    assert found.warnings == ()


def test_damped_critical_speeds_are_roots():
    rotor = machine()
    found = fem.campbell(rotor, np.linspace(0.0, 1000.0, 26))
    assert found.critical_speeds.size == 4
    for k, speed in enumerate(found.critical_speeds):
        there = whirl_exactly(rotor, speed, 6)
        i = int(np.argmin(abs(there.frequencies - speed)))
        assert there.frequencies[i] == pytest.approx(speed, rel=1e-9)
        assert there.log_decrements[i] == pytest.approx(found.critical_log_decrements[k], abs=1e-9)
        assert there.direction[i] == found.critical_direction[k]
        crossing = np.sign(found.frequencies[:, found.critical_modes[k] - 1] - found.speeds)
        assert (np.diff(crossing) != 0).sum() == 1
    few = fem.campbell(rotor, np.linspace(100.0, 1000.0, 5)).critical_speeds
    np.testing.assert_allclose(few, found.critical_speeds, rtol=1e-8)


def test_undamped_forward_critical_speeds_are_those_of_critical_speeds():
    rotor = symmetric(damping=0.0)
    found = fem.campbell(rotor, np.linspace(0.0, 1300.0, 20), n=8)
    forward = found.critical_speeds[found.critical_direction > 0]
    np.testing.assert_allclose(forward, fem.critical_speeds(rotor, forward.size).frequencies, rtol=3e-9)
    assert forward.size >= 3


def test_a_mode_that_ceases_to_oscillate():
    """Damping that grows with speed until a motion is overdamped."""
    k, c = [((1e5, 0), (0, 3e5))] * 2, [((0, 0), (0, 0)), ((3e3, 0), (0, 10.0))]
    rotor = fem.Rotor(
        [0.1, 0.1],
        0.1,
        density=0.0,
        discs=[fem.Disc(2, 10.0)],
        supports=[fem.Support(n, k, c, speeds=(0, 100)) for n in (1, 3)],
    )
    found = fem.campbell(rotor, np.linspace(0.0, 100.0, 21), n=2)
    assert np.isfinite(found.frequencies[-1]).tolist() == [False, True]
    assert "mode 1 does not oscillate" in found.warnings[0]
    assert found.to_dict()["frequencies_rad_s"][0][-1] is None


@pytest.mark.parametrize(
    ("speeds", "n", "message"),
    [
        ([100.0, 50.0], 2, "must ascend, each once: sort them; 50 rad/s follows 100 rad/s"),
        ([-1.0, 50.0], 2, "not negative"),
        ([], 2, "at least one"),
        ([1.0, float("nan")], 2, "finite"),
        ([1.0, 2.0], 0, "0 modes cannot be found"),
    ],
)
def test_bad_input(speeds, n, message):
    with pytest.raises(ValueError, match=message):
        fem.campbell(rotor23(), speeds, n)


def isotropic():
    """An ordinary machine on round bearings, whose pairs of modes coincide at rest."""
    return fem.Rotor(
        np.full(14, 0.1),
        0.08,
        discs=[fem.Disc(7, 80.0, 1.0, 0.6)],
        supports=[fem.Support(2, 5e7, 2e3), fem.Support(13, 5e7, 2e3)],
        model=fem.Model(True, True, True),
    )


@pytest.mark.parametrize("n", [4, 5])
def test_pairs_that_coincide_at_rest_are_not_cut(n):
    found = fem.campbell(isotropic(), np.linspace(0.0, 20000.0, 51), n)
    assert np.isfinite(found.frequencies).all()
    assert found.warnings == ()
    assert found.direction[0].tolist() == [-1.0, 1.0, -1.0, 1.0, -1.0][:n]
    assert (found.direction == found.direction[0]).all()
    # All damped critical speeds from the bottom up: those of many more modes begin with them.
    more = fem.campbell(isotropic(), np.arange(10.0, 20000.0, 370.0), 10)
    np.testing.assert_allclose(found.critical_speeds, more.critical_speeds[:n], rtol=1e-9)
    assert found.critical_speeds.size == n


def test_a_mode_that_grows_is_told_from_its_threshold_on():
    rotor = dataclasses.replace(symmetric(), material_damping=np.full(23, 2e-4))
    threshold = fem.stability_threshold(rotor, 3000.0)
    found = fem.campbell(rotor, np.linspace(0.0, 3000.0, 31), 4)
    (window,) = found.unstable
    assert (window.first, window.frequency) == pytest.approx(
        (threshold.threshold, threshold.frequency), rel=1e-6
    )
    assert window.mode == threshold.mode
    assert f"mode {threshold.mode} (forward whirl" in found.warnings[0]
    assert f"does not exist above {threshold.threshold:.6g} rad/s" in found.warnings[0]
    (document,) = found.to_dict()["unstable"]
    assert document["speed_rad_s"] == window.first
    assert document["lowest_log_decrement"] == found.log_decrements[:, threshold.mode - 1].min() < 0
    assert not document["from_start"]
    below = fem.campbell(rotor, np.linspace(0.0, 0.99 * threshold.threshold, 11), 4)
    assert below.unstable == below.warnings == ()
    above = fem.campbell(rotor, np.linspace(1.01 * threshold.threshold, 3000.0, 11), 4)
    assert above.to_dict()["unstable"][0]["from_start"]


def test_heavily_damped_modes_push_no_other_out():
    """On strongly damped pedestals two pairs of modes below the second of the shaft hardly oscillate."""
    stand = fem.Pedestal(60.0, 2e7, 6e4)
    rotor = fem.Rotor(
        np.full(8, 0.15),
        0.05,
        discs=[fem.Disc(5, 40.0, 0.8, 0.5)],
        supports=[fem.Support(node, ((2e6, 0), (0, 3e6)), 200.0, pedestal=stand) for node in (1, 9)],
        model=FULL,
    )
    speeds = np.linspace(10.0, 900.0, 25)
    light, all_modes = fem.campbell(rotor, speeds, 4), fem.campbell(rotor, speeds, 8, heavy=np.inf)
    assert (all_modes.log_decrements > 6).all(axis=0).sum() == 4
    assert (light.log_decrements < 6).all()
    some = (all_modes.log_decrements < 6).all(axis=0)
    np.testing.assert_allclose(light.frequencies, all_modes.frequencies[:, some], rtol=1e-9)
    some = all_modes.critical_log_decrements < 6
    np.testing.assert_allclose(light.critical_speeds, all_modes.critical_speeds[some], rtol=1e-9)


def test_json_and_mesh_change():
    found = fem.campbell(machine(), np.linspace(0.0, 1000.0, 11), n=4)
    assert np.shape(found.to_dict()["frequencies_rad_s"]) == (4, 11)
    assert len(found.to_frame()) == 44
    frequencies, speeds = found.mesh_change()
    assert 0 < frequencies < 1e-4
    assert 0 < speeds < 1e-4


DRAWN = 200 if repetitions.FULL else 20
SCAN = 500 if repetitions.FULL else 150
HEAVY = 0.69  # damping ratio of a decrement of 6; beyond, modes are not counted


def missed(rotor, asked):
    """Steps of a dense scan in which the answer and the number of modes below the 1× line disagree."""
    found = fem.campbell(rotor, asked, 12)
    for speed in found.critical_speeds:
        lam = dense_rotor.whirl(rotor, speed)[0]
        assert abs(abs(lam.imag) - speed).min() < 1e-6 * speed
    if found.cut:
        return 0
    speeds = np.linspace(asked[0], asked[-1], SCAN)
    lam = [dense_rotor.whirl(rotor, speed)[0] for speed in speeds]
    # What does not oscillate is below the line: a mode that ceases to oscillate crosses it before.
    above = [(each.imag > speed).sum() for each, speed in zip(lam, speeds, strict=True)]
    there = np.histogram(found.critical_speeds, speeds)[0]
    extra = there - abs(np.diff(above))
    wrong = np.flatnonzero((extra < 0) | (extra % 2 != 0))
    # Heavy ones come and go, by rounding alone where they are double: what passes there must be light.
    return sum(light_crossings(*lam[k : k + 2], speeds[k : k + 2]) > there[k] for k in wrong.tolist())


def light_crossings(one, other, speeds):
    """How many lightly damped modes cross the 1× line in a step, each the nearest to one before it."""
    one = one[(one.imag > 0) & (-one.real < HEAVY * abs(one))]
    other = other[abs(one[:, None] - other).argmin(axis=1)]
    return int(((one.imag > speeds[0]) != (other.imag > speeds[1])).sum())


def test_no_damped_crossing_is_missed_in_drawn_tables():
    rng = np.random.default_rng(16)
    wrong = {number: count for number in range(DRAWN) if (count := missed(*on_tables(rng)))}
    assert wrong == {}


def test_searches_of_two_crossings_that_end_at_one_are_told_apart():
    rng = np.random.default_rng(16)
    tables = [on_tables(rng) for _ in range(115)]
    # In the last one a matrix is singular to the last bit, beside others of much larger entries.
    for k, expected in ((88, [120.09996837, 121.67021609]), (114, [41.51229148, 43.1761842])):
        np.testing.assert_allclose(fem.campbell(*tables[k], 12).critical_speeds, expected, 1e-8)
