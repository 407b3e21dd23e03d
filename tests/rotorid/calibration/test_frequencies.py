"""Critical speeds, natural frequencies, shapes as rows: against dense eigenvalues and Rayleigh quotients."""

from dataclasses import replace

import dense_rotor
import numpy as np
import pytest
from fem_rotors import rotor23, uniform
from helpers.calibration.jobs import machine
from scipy.linalg import eigh

import fem
from fem.parameters import with_parameters
from rotorid.calibration import MeasuredFrequencies
from rotorid.calibration.frequencies import at_rest


def plane_x(rotor):
    """Frequencies, shapes w and vectors of the dense rotor at rest in the plane x: M and K alone."""
    D = dense_rotor.assemble(rotor, 0.0)
    keep = np.flatnonzero(~np.isin(np.arange(len(D.M)), np.concatenate((D.y, D.y + 1))))
    keep = keep[keep < D.y[-1] + 2]
    pedestals = np.arange(D.y[-1] + 2, len(D.M), 2)  # each x, then y
    keep = np.concatenate((keep, pedestals)) if pedestals.size else keep
    squares, vectors = eigh(D.K[np.ix_(keep, keep)], D.M[np.ix_(keep, keep)])
    where = np.searchsorted(keep, D.x)
    return np.sqrt(squares), vectors[where]


def measured(modes, frequencies, std=0.01, **more):
    values = np.asarray(frequencies, dtype=float)
    return MeasuredFrequencies(np.asarray(modes), values, np.full(values.shape, std), **more)


def test_frequencies_at_rest_and_shapes_are_those_of_the_dense_rotor():
    """Damping, cross-coupling of pedestals and gyroscopic moments play no part."""
    rotor = replace(
        machine(), supports=[replace(s, stiffness=((4e7, 0), (0, 7e7))) for s in machine().supports]
    )
    frequencies, shapes = plane_x(rotor)
    nodes = (2, 5, 9)
    at = shapes[np.array(nodes) - 1][:, [0, 2]] * (-3.0, 0.1)
    data = measured([1, 3], frequencies[[0, 2]], rest=True, nodes=nodes, shapes=at, shape_std=0.01)
    r = data.residual(rotor, {})
    assert r.shape == (2 + 2 * 3,)
    assert abs(r).max() < 1e-5
    off = replace(data, shapes=at + [[0.02 * abs(at[:, 0]).max(), 0.0]] * 3)
    size = 0.01 * abs(off.shapes[:, 0]).max()
    least = np.linalg.lstsq(at[:, :1], off.shapes[:, 0], rcond=None)[1][0]  # whatever the scale
    assert np.sum(off.residual(rotor, {})[2::2] ** 2) == pytest.approx(least / size**2, rel=1e-4)


def test_critical_speeds_meet_the_dense_whirl_frequencies():
    listed = measured([1, 2, 3, 4], np.ones(4), 1.0)
    speeds = 1 + listed.residual(machine(), {})
    bare = replace(
        machine(),
        supports=[
            replace(
                s,
                stiffness=(np.array(s.stiffness) + np.transpose(s.stiffness)) / 2,
                damping=0.0,
                pedestal=s.pedestal and replace(s.pedestal, damping=0.0),
            )
            for s in machine().supports
        ],
    )
    for speed in speeds:
        lam, _, _ = dense_rotor.whirl(bare, speed)
        assert abs(lam.imag / speed - 1).min() < 1e-7


@pytest.mark.parametrize("rest", [True, False])
def test_derivatives_are_rayleigh_quotients(rest):
    """∂ω/∂k = φ(support)² / 2ω, ∂ω/∂m = −ω φ(disc)² / 2, ∂ω/∂E = φᵀ (K of the shaft) φ / 2ωE."""
    rotor = rotor23()
    frequencies, shapes = plane_x(rotor)
    data = measured([1, 2, 3], frequencies[:3] + 1.0, std=0.5, rest=rest)
    values = {
        "bearing[1].stiffness": 7e7,
        "disc[1].mass": rotor.discs[0].mass,
        "material.youngs_modulus": 2.1e11,
    }
    K = data.jacobian(rotor, values, [*values, "probe[a].angle"])
    w = frequencies[:3]
    held = rotor23().supports[0].node, rotor.discs[0].node
    rotor = with_parameters(rotor, values)
    w, shapes = plane_x(rotor)
    w, shapes = w[:3], shapes[:, :3]
    springs = sum(s.stiffness * shapes[s.node - 1] ** 2 for s in rotor.supports)
    expected = [shapes[held[0] - 1] ** 2 / (2 * w), -w * shapes[held[1] - 1] ** 2 / 2]
    expected += [(w**2 - springs) / (2 * w * 2.1e11), 0 * w]
    assert np.transpose(expected) / 0.5 == pytest.approx(K, rel=1e-5)


def test_of_a_number_at_its_end_the_derivative_is_to_one_side():
    rotor = uniform(10, supports=[fem.Support(1, 1e7), fem.Support(11, 1e7), fem.Support(6, 0.0)])
    data = measured([1, 2], [300.0, 900.0], rest=True)
    w, shapes = plane_x(rotor)
    K = data.jacobian(rotor, {"bearing[3].stiffness": 0.0}, ["bearing[3].stiffness"])
    assert K[0, 0] * 0.01 == pytest.approx(shapes[5, 0] ** 2 / (2 * w[0]), rel=1e-3)


def test_numbers_that_change_which_critical_speeds_are_listed_are_refused():
    """On supports alike in x and y forward ones are listed alone, on others all: twice as many."""
    data = measured([1, 2], [250.0, 500.0])
    with pytest.raises(ValueError, match=r"bearing\[1\].kxx alone makes supports differ in x and y"):
        data.check(
            rotor23(), {"bearing[1].kxx": 7e7, "bearing[1].kyy": 7e7}, ["bearing[1].kxx", "bearing[1].kyy"]
        )
    data.check(rotor23(), {"bearing[1].stiffness": 7e7, "probe[a].angle": 0.0}, ["bearing[1].stiffness"])
    data.check(
        rotor23(), {"bearing[1].kxx": 7e7, "bearing[1].kyy": 8e7}, ["bearing[1].kxx", "bearing[1].kyy"]
    )
    replace(data, rest=True).check(rotor23(), {"bearing[1].kxx": 7e7}, ["bearing[1].kxx"])


def test_critical_speeds_below_bearing_tables_are_not_numbered():
    """The first that is listed would not be the first of the machine."""
    plain = rotor23()
    first = fem.critical_speeds(plain, 2).frequencies
    inside = {"speeds": (0.5 * first[0], 2 * first[1])}
    above = {"speeds": (1.1 * first[0], 2 * first[1])}
    ok, cut = (replace(plain, supports=[replace(s, **at) for s in plain.supports]) for at in (inside, above))
    assert abs(measured([1, 2], first).residual(ok, {})).max() < 1e-3
    with pytest.raises(ValueError, match="below the tables are not known, nor counted: extend the tables"):
        measured([1], first[1:]).residual(cut, {})


def test_modes_that_the_model_does_not_have():
    with pytest.raises(ValueError, match=r"the model has only 4 critical speeds, up to .* rpm, not 9"):
        measured([9], [1e5]).residual(uniform(1, supports=[fem.Support(1, 1e7), fem.Support(2, 1e7)]), {})


def test_at_rest_the_pedestal_counts_in_x():
    stand = fem.Pedestal(20.0, (1e8, 5e7), 1e3)
    support = fem.Support(1, ((3e7, 1e6), (2e6, 9e7)), 1e3, pedestal=stand)
    found = at_rest(uniform(4, supports=[support, fem.Support(5, 1e7)])).supports[0]
    assert (found.stiffness, found.damping, found.pedestal) == (3e7, 0.0, fem.Pedestal(20.0, 1e8))


def test_over_tables_derivatives_are_those_of_the_critical_speeds_themselves():
    """Of steep tables, by differences of what `critical_speeds` finds, whose own tests judge it."""
    stiffness = [3e7, 5e7, 9e7, 1.2e8]
    tables = [replace(s, speeds=(1.0, 300.0, 800.0, 3000.0), stiffness=stiffness) for s in rotor23().supports]
    rotor = replace(rotor23(), supports=tables, model=fem.Model(gyroscopic=True, rotary_inertia=True))
    values = {"bearing[1].stiffness.scale": 1.2, "bearing[2].stiffness.offset": 4e6, "disc[3].scale": 0.9}
    found = measured([1, 2, 3], [200.0, 400.0, 900.0], 1.0).jacobian(rotor, values, list(values))
    for k, (path, value) in enumerate(values.items()):
        h = 1e-3 * (value if value < 1e3 else 1e7)
        two = [with_parameters(rotor, {**values, path: value + by}) for by in (h, -h)]
        up, down = (fem.critical_speeds(each, 3).frequencies for each in two)
        assert found[:, k] == pytest.approx((up - down) / (2 * h), rel=1e-4)
