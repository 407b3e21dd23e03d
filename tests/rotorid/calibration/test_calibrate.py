"""Numbers from data of a known truth: exact data give them back, noise as stated their errors."""

import functools
import sys
from dataclasses import replace

import numpy as np
import pytest
from fem_rotors import uniform
from helpers.calibration.jobs import Runs, machine

import fem
from balancing import ReadingErrors
from fem.parameters import with_parameters
from rotorid.calibration import Unknown, calibrate
from rotorid.commands.calibrate import outcome
from rotorid.regression import nonlinear

ERRORS = ReadingErrors(0.02, 0.02)


def off(values):
    """Unknowns that start so far off the truth, now to one side, now to the other."""
    signs = [1 if k % 2 else -1 for k in range(len(values))]
    start = [v * (1 + 0.2 * s) if v else 2e5 * s for v, s in zip(values.values(), signs, strict=True)]
    return [Unknown(path, start=first) for path, first in zip(values, start, strict=True)]


def tabled():
    """The machine with the first bearing tabulated over speed."""
    first, second = machine().supports
    k = np.array(first.stiffness)
    table = replace(
        first, speeds=(100.0, 300.0, 500.0), stiffness=[k, 0.8 * k, 0.7 * k], damping=[2e4, 2.5e4, 2e4]
    )
    return replace(machine(), supports=[table, second])


def with_seal():
    seal = fem.Support(6, ((1e6, 0.0), (0.0, 1e6)), 500.0, kind="seal")
    return replace(machine(), supports=[*machine().supports, seal])


COEFFICIENTS = {
    "bearing[1].kxx": 4.7e7,
    "bearing[1].kxy": 4e6,
    "bearing[1].kyx": -3e6,
    "bearing[1].kyy": 5.2e7,
    "bearing[1].cxx": 2.3e4,
    "bearing[1].cyy": 2.6e4,
    "bearing[2].kxx": 4.4e7,
    "bearing[2].cyy": 1.7e4,
}
SCALES = {
    "bearing[1].stiffness.scale": 1.15,
    "bearing[1].cxx.scale": 0.9,
    "bearing[1].kyy.offset": 3e6,
    "bearing[2].damping.scale": 1.2,
    "bearing[2].pedestal_stiffness_x": 1.7e8,
    "bearing[2].pedestal_mass": 18.0,
}
MASSES = {
    "disc[1].mass": 27.0,
    "disc[2].scale": 1.1,
    "material.youngs_modulus.scale": 0.96,
    "material.density": 8000.0,
    "bearing[2].kxx.offset": 3e6,
    "bearing[1].kyy.offset": 2e6,
}
NEGATIVE = {"seal[1].kxx": -8e5, "bearing[1].kxx.offset": -5e6}
"""Offsets and the stiffness of a seal have either sign."""
"""Of supports that are alike in x and y: their derivatives couple forward and backward whirl."""
PROBES = {
    "bearing[1].kxx": 4.6e7,
    "probe[a].angle": 5.0,
    "probe[b].gain": 0.93,
    "probe[d].angle": -4.0,
    "key_phasor.angle": 3.0,
}


def truth_of(runs, values):
    """With probes and key phasor that stand and read as the values say, where the job says otherwise."""
    turned = {p[6]: v for p, v in values.items() if p.startswith("probe") and p.endswith("angle")}
    gains = {p[6]: v for p, v in values.items() if p.endswith("gain")}
    at = runs.key_phasor + values.get("key_phasor.angle", 0.0)
    return replace(runs, turned=turned, gains=gains, key_phasor=at)


@pytest.mark.parametrize(
    ("rotor", "values", "more"),
    [
        (with_seal(), NEGATIVE, {}),
        (machine(), COEFFICIENTS, {"free": False, "derivative": 2, "key_phasor": 40.0}),
        (tabled(), SCALES, {"derivative": 1, "planes": {"P": (4, 0.12), "Q": (8, 0.2)}}),
        (machine(), MASSES, {"free": False}),
        (machine(), PROBES, {"key_phasor": 15.0}),
    ],
)
def test_exact_data_give_the_numbers_back(rotor, values, more):
    """By the dense rotor; free baselines and unknown unbalances, velocities, accelerations, masses."""
    runs = Runs(speeds=tuple(np.linspace(120.0, 480.0, 7)), **more)
    truth = with_parameters(rotor, values)
    readings = truth_of(runs, values).readings(truth)
    data = runs.data(np.stack((readings, readings)), errors=ERRORS)  # repeats
    found = calibrate(rotor, off(values), [data])
    assert found.fit.converged
    assert found.values == pytest.approx(list(values.values()), rel=1e-6)
    assert found.chi_square < 1e-6
    if data.modelled:
        assert found.unbalance[0] == pytest.approx(list(runs.unbalance.values()), rel=1e-6)


def jeffcott(k, c, speed, K, m):
    """z of the disc per unbalance: mass m on a massless shaft of stiffness K, in series with two supports."""
    held = 2 * (k + 1j * speed * c)
    series = K * held / (K + held)
    return speed**2 / (series - m * speed**2)


def test_a_jeffcott_rotor_on_damped_supports():
    """The closed form gives k and c, and their standard deviations by linear propagation."""
    m, L, d = 30.0, 1.0, 0.05
    E, second = 2.1e11, np.pi / 64 * d**4
    K = 48 * E * second / L**3
    k, c = 3e6, 4e3
    shaft = fem.Rotor(
        [L / 2] * 2,
        d,
        density=0.0,
        discs=[fem.Disc(2, m)],
        supports=[fem.Support(node, 2.5e6, 5e3) for node in (1, 3)],
    )
    w = np.sqrt(K * 2 * k / (K + 2 * k) / m)
    runs = Runs(
        speeds=tuple(w * np.array([0.7, 0.93, 1.02, 1.2])),
        sensors={"x": (2, 0.0), "y": (2, 90.0)},
        planes={"disc": (2, 1.0)},
        weights=((0,), (1e-4,)),
        unbalance={},
    )
    speeds = np.array(runs.speeds)
    z = 1e-4 * jeffcott(k, c, speeds, K, m)
    effect = np.stack((z, -1j * z), axis=1)  # y follows x by a quarter
    base = 2e-5 * np.ones_like(effect)
    floor = 1e-7
    data = runs.data(np.stack((base, base + effect)), errors=ReadingErrors(floor=floor))
    found = calibrate(shaft, [Unknown("bearing.stiffness"), Unknown("bearing.damping")], [data])
    assert found.values == pytest.approx([k, c], rel=1e-6)

    z = [
        [jeffcott(k * (1 + h), c, speeds, K, m), jeffcott(k, c * (1 + h), speeds, K, m)]
        for h in (1e-5, -1e-5)
    ]
    columns = 1e-4 * (np.array(z[0]) - z[1]).T / (2e-5 * np.array([k, c]))
    J = np.concatenate([part for z in (columns, -1j * columns) for part in (z.real, z.imag)])
    covariance = 2 * floor**2 * np.linalg.inv(J.T @ J)  # a difference of two readings
    assert found.std == pytest.approx(np.sqrt(np.diag(covariance)), rel=1e-5)


def mirrored(k1, k2):
    """A rotor that is alike to both sides, but for its bearings, and what is read at its middle."""
    supports = [fem.Support(node, k, 1e3) for node, k in ((1, k1), (11, k2))]
    rotor = uniform(10, discs=[fem.Disc(6, 20.0)], supports=supports)
    sensors = {"x": (6, 0.0), "y": (6, 90.0)}
    runs = Runs(sensors=sensors, planes={"P": (6, 1.0)}, weights=((0,), (1e-3,)), unbalance={})
    return rotor, runs.data(runs.readings(rotor), errors=ReadingErrors(0.002, 0.002))


BOTH = ("bearing[1].stiffness", "bearing[2].stiffness")


@pytest.mark.parametrize(
    ("bounds", "start", "ends"),
    [(None, (4.5e7, 1.8e7), 1), ((3e7, 1e9), (3e7, 1.8e7), 0), ((1e6, 3e7), (2.9e7, 4.5e7), 0)],
)
def test_the_search_looks_for_another_pair_that_explains_as_well(bounds, start, ends):
    """The middle does not tell which bearing is the stiffer one; bounds do."""
    rotor, data = mirrored(4e7, 2e7)
    first, second = (Unknown(path, start=value) for path, value in zip(BOTH, start, strict=True))
    found = calibrate(rotor, [replace(first, bounds=bounds) if bounds else first, second], [data])
    assert sorted(found.values) == pytest.approx([2e7, 4e7], rel=1e-4)
    assert len(found.other_ends) == ends
    if ends:
        assert found.other_ends[0] == pytest.approx(found.values[::-1], rel=1e-3)
        assert "other numbers explain the data as well: bearing[1].stiffness = " in found.warnings[-1]
    else:
        assert (found.values[0] > 3e7) == (bounds[0] == 3e7)


@pytest.mark.full
def test_a_model_that_lacks_something_says_so_and_widens_its_intervals():
    """Readings of a rotor with another modulus: χ² is too large."""
    truth = with_parameters(machine(), {"material.youngs_modulus.scale": 0.7})
    data = Runs().data(Runs().readings(truth), errors=ReadingErrors(0.002, 0.002))
    found, honest = (calibrate(rotor, [Unknown("bearing[1].kxx")], [data]) for rotor in (machine(), truth))
    assert (found.explained, honest.explained) == (False, True)
    assert found.rotor.calibration.needs_trial_run
    assert found.rotor.calibration.lack_of_fit == found.lack_of_fit > 0.002
    assert honest.lack_of_fit == 0
    assert found.std[0] > 3 * honest.std[0]


def test_of_bearing_and_pedestal_in_series_one_speed_tells_one_number():
    """Neither is given a value, nor a deviation: only the stiffness of both in series is seen."""
    stand = fem.Pedestal(0.0, 1e8)
    supports = [fem.Support(1, 4e7, pedestal=stand), fem.Support(11, 5e7)]
    rotor = uniform(10, discs=[fem.Disc(5, 20.0)], supports=supports)
    runs = Runs(speeds=(200.0,), unbalance={})
    data = runs.data(runs.readings(rotor), errors=ERRORS)
    unknowns = [
        Unknown(f"bearing[1].{name}", start=start)
        for name, start in (("stiffness", 5e7), ("pedestal_stiffness", 9e7))
    ]
    found = calibrate(rotor, unknowns, [data])
    assert np.isnan(found.values).all()
    assert np.isnan(found.std).all()
    (k, p) = found.fit.estimate.solution
    assert k * p / (k + p) == pytest.approx(4e7 * 1e8 / 1.4e8, rel=1e-5)
    with_prior = calibrate(rotor, [unknowns[0], replace(unknowns[1], prior=(1e8, 1e6))], [data])
    assert with_prior.values == pytest.approx([4e7, 1e8], rel=1e-4)
    assert with_prior.std[1] == pytest.approx(1e6, rel=1e-3)


def test_a_search_that_does_not_converge_says_so_and_gives_no_deviation(monkeypatch):
    once = functools.partial(nonlinear.nonlinear_least_squares, max_iterations=1)
    monkeypatch.setattr(sys.modules[calibrate.__module__], "nonlinear_least_squares", once)
    monkeypatch.setattr(nonlinear, "POLISH", 0)
    data = Runs().data(Runs().readings(machine()), errors=ERRORS)
    found = calibrate(machine(), [Unknown("bearing[1].kxx", start=1e7)], [data], side_starts=False)
    assert np.isnan(found.std).all()
    assert found.undetermined == found.warnings[0]
    assert found.rotor.calibration.needs_trial_run


@pytest.mark.parametrize(
    ("paths", "said"),
    [
        (("bearing[1].kxx", "bearing[DE].kxx"), "are the same number"),
        (("bearing[1].kxx", "bearing[1].stiffness.scale"), "are the same number"),
        (("bearing[1].kxx.scale", "bearing.kxx.offset"), "adds to more numbers than bearing[1].kxx.scale"),
        (("probe[z].angle",), "no data have readings of probe[z].angle"),
        ((), "needs data and at least one unknown number"),
    ],
)
def test_numbers_that_cannot_be_estimated_are_refused(paths, said):
    runs = Runs()
    data = runs.data(runs.readings(machine()), errors=ERRORS)
    with pytest.raises(ValueError) as error:
        calibrate(machine(), [Unknown(path) for path in paths], [data])
    assert said in str(error.value)


def test_unbalances_that_the_readings_do_not_tell_apart_have_no_number():
    """Two sensors at one speed tell two numbers, not three; degrees of freedom count those."""
    runs = Runs(speeds=(250.0,), sensors={"a": (2, 0.0), "b": (10, 90.0)}, free=False)
    runs.unbalance = {3: 1e-3, 6: 2e-3j, 9: -1e-3}
    data = runs.data(runs.readings(machine()), errors=ERRORS)
    found = calibrate(machine(), [Unknown("bearing[1].kxx", prior=(4e7, 1e6))], [data], side_starts=False)
    assert np.isnan(found.unbalance[0]).all()
    assert np.isnan(found.unbalance_std[0]).all()
    assert found.dof == 2 * 2 * 3 + 1 - 4 - 1
    assert "do not determine the unbalance of node 3, node 6 and node 9: name fewer" in found.warnings[-1]


def test_errors_count_what_numbers_taken_as_exact_may_be_off():
    """Density off by 1 %: the stiffness moves by as much as the difference of two fits says."""
    runs = Runs()
    data = runs.data(runs.readings(machine()), errors=ERRORS)
    unknown = [Unknown("bearing[1].kxx"), Unknown("bearing[1].cxx")]
    exact = Unknown("disc[1].scale", prior=(1.0, 0.01))
    plain, wide = (calibrate(machine(), unknown, [data], exact=each) for each in ((), (exact,)))
    ends = [
        calibrate(with_parameters(machine(), {exact.path: 1.0 + by}), unknown, [data]).values
        for by in (0.001, -0.001)
    ]
    moved = (ends[0] - ends[1]) / 0.002 * 0.01
    assert wide.values == pytest.approx(plain.values, rel=1e-6)
    expected = plain.covariance + np.outer(moved, moved)
    assert wide.covariance == pytest.approx(expected, rel=1e-2, abs=1e-3 * np.abs(expected).max())
    assert (wide.std > 1.1 * plain.std).any()
    joint = wide.rotor.calibration
    assert joint.names == ("bearing[1].kxx", "bearing[1].cxx", "disc[1].scale")
    assert joint.covariance[:2, 2] == pytest.approx(0.01 * moved, rel=1e-2)  # together with its disc
    assert joint.std[2] == pytest.approx(0.01)
    assert "± count what 1 number taken as exact may be off" in outcome(wide, {}).answer.notes
