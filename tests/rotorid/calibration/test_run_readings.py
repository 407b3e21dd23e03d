"""Rows of readings: what they compute against the dense rotor, their errors against one joint covariance."""

from dataclasses import replace

import dense_rotor
import numpy as np
import pytest
from helpers.calibration.jobs import Runs, machine
from scipy.linalg import eigh

import fem
from balancing import ReadingErrors, RunScatter, usual_run_errors
from fem.parameters import parameter_value, with_parameters

ERRORS = ReadingErrors(0.02, 0.03)


def coefficients_of(runs, rotor):
    """(S, C, P + q) by the dense rotor, a unit in each plane and at each node."""
    units = {f"P{k}": place for k, place in enumerate(runs.planes.values())}
    units |= {} if runs.free else {f"u{node}": (node, 1.0) for node in runs.unbalance}
    each = replace(runs, planes=units, weights=tuple(np.eye(len(units))), unbalance={})
    return np.moveaxis(each.readings(rotor), 0, -1)


@pytest.mark.parametrize("pedestal", [None, machine().supports[1].pedestal])
def test_derivatives_are_differences_of_the_dense_rotor(pedestal):
    """Also at further numbers, after those of the rotor as it is."""
    runs = Runs(derivative=1, planes={"P": (4, 0.12)}, weights=((0,), (1,)), free=False)
    first, second = machine().supports
    rotor = replace(machine(), supports=[first, replace(second, pedestal=pedestal)])
    data = runs.data(runs.readings(rotor))
    values = {
        "bearing[1].kxx": 4.4e7,
        "bearing[1].kxx.offset": 2e6,
        "bearing[2].kyy.scale": 1.2,
        "bearing[2].damping.offset": 3e3,
        "disc[1].scale": 1.05,
        "disc[2].mass": 17.0,
        "material.youngs_modulus.scale": 0.98,
        "material.density": 8100.0,
        "probe[a].angle": 3.0,
        "probe[b].gain": 1.1,
        "key_phasor.angle": -4.0,
    } | ({"bearing[2].pedestal_stiffness.scale": 0.9} if pedestal else {})

    def W(at):
        shown = replace(runs, turned={"a": at["probe[a].angle"]}, gains={"b": at["probe[b].gain"]})
        shown.key_phasor = at["key_phasor.angle"]
        return coefficients_of(shown, with_parameters(rotor, at))

    data.coefficients(rotor, {path: parameter_value(rotor, path) for path in values}, list(values))
    _, found = data.coefficients(rotor, values, list(values))
    for (path, value), own in zip(values.items(), found, strict=True):
        h = 1e-4 * abs(value)
        expected = (W({**values, path: value + h}) - W({**values, path: value - h})) / (2 * h)
        assert abs(own - expected).max() < 1e-6 * abs(expected).max(), path


def joint_covariance(data, W, run):
    """Of all rows (S, x, C, real and imaginary), by what each independent error of size 1 changes."""
    own, common, loads, further = run.typical
    trials, P = data.trials, len(data.nodes)
    Y, e, scale = trials.mean, trials.errors, 1 / np.sqrt(trials.repeats)
    R = len(Y)
    loaded = np.einsum("scp,rp->rsc", W[..., :P], trials.weights)
    unit = np.moveaxis(W[..., :P], -1, 0)
    unit = (
        unit / np.sqrt((abs(unit) ** 2).mean(axis=(1, 2)) * P)[:, None, None] * np.sqrt(np.mean(abs(Y) ** 2))
    )
    here, of_run = np.eye(Y.size).reshape(-1, *Y.shape), np.eye(R)[:, :, None, None]
    alike = np.mean(abs(Y) ** 2, axis=2, keepdims=True)
    size = np.sqrt(run.evenly * alike + (1 - run.evenly) * abs(Y) ** 2)
    parts = [here * e.floor * scale, here * own * size]
    parts += [of_run * part for part in (common * Y, loads * loaded, *(further * one for one in unit))]
    changes = [here * Y * e.amplitude * scale, here * 1j * Y * e.phase * scale]
    columns = np.concatenate([*changes, *parts, *(1j * part for part in parts)])
    take = np.eye(R) if data.modelled else np.hstack((-np.ones((R - 1, 1)), np.eye(R - 1)))
    rows = np.einsum("xr,krsc->ksxc", take, columns).reshape(len(columns), -1)
    real = np.stack((rows.real, rows.imag), axis=-1).reshape(len(columns), -1)
    return real.T @ real


def noisy(runs, **trials):
    """With readings that scatter, repeats of some, and a model beside the truth."""
    rng = np.random.default_rng(5)
    exact = runs.readings(machine())
    noise = rng.standard_normal((2, 2, *exact.shape))
    readings = exact * (1 + 0.03 * (noise[0] + 1j * noise[1]))
    readings[1, 1:] = np.nan
    data = runs.data(readings, errors=replace(ERRORS, floor=1e-6), **trials)
    return data, data.coefficients(machine(), {"bearing[1].kxx": 4.3e7})[0]


@pytest.mark.parametrize("free", [True, False])
@pytest.mark.parametrize("scatter", [None, RunScatter(0.05, 2e-6)])
def test_whitening_is_that_of_one_joint_covariance(free, scatter):
    data, W = noisy(Runs(free=free), run_errors=scatter)
    C = joint_covariance(data, W, usual_run_errors(data.trials))
    rows = data.rows(W)
    raw = rows.raw(W).ravel()
    x = np.stack((raw.real, raw.imag), axis=-1).ravel()
    if not free:  # the least χ² over all unbalances
        basis = np.repeat(W[:, None, :, 2:], 3, axis=1).reshape(raw.size, -1)
        both = np.hstack(
            [np.stack((b.real, b.imag), axis=1).reshape(x.size, -1) for b in (basis, 1j * basis)]
        )
        left = np.linalg.solve(C, both)
        x = x - both @ np.linalg.solve(both.T @ left, left.T @ x)
    residual = rows.residual(W)[0]
    assert residual.size == x.size
    assert residual @ residual == pytest.approx(x @ np.linalg.solve(C, x), rel=1e-6)
    assert rows.stated


@pytest.mark.parametrize(("tables", "tilting"), [(False, 0.0), (True, 1e5)])
def test_a_bow_is_found_in_metres(tables, tilting):
    """Of the lowest bending shape on the supports: from M and K of the dense rotor in one plane."""
    k = 5e7
    speeds = (0.0, 1000.0) if tables else ()
    supports = [fem.Support(node, k, ((2e4, 0), (0, 3e4)), speeds=speeds) for node in (1, 11)]
    rotor = replace(machine(), supports=[replace(s, tilting_stiffness=tilting) for s in supports])
    held = dense_rotor.assemble(replace(rotor, supports=[fem.Support(node, k) for node in (1, 11)]), 0.0)
    plane = np.sort(np.concatenate((held.x, held.x + 1)))
    _, shapes = eigh(held.K[np.ix_(plane, plane)], held.M[np.ix_(plane, plane)])
    bow = shapes[:, 0].reshape(-1, 2)
    bow = bow / bow[np.argmax(abs(bow[:, 0])), 0]
    runs = Runs(free=False)
    data = runs.data(runs.readings(rotor, 30e-6 * bow), errors=ERRORS, bow=1)
    W, _ = data.coefficients(rotor, {})
    r, _, u = data.rows(W).residual(W)
    assert u[:2] == pytest.approx(list(runs.unbalance.values()), rel=1e-6)
    assert abs(u[2]) == pytest.approx(30e-6, rel=1e-6)
    assert abs(r).max() < 1e-4
