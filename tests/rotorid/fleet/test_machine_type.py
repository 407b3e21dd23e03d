"""Coefficients of a type: what the example prints for many types, with few; reasons of odd machines."""

from dataclasses import replace

import numpy as np
import pytest

from balancing import (
    Labels,
    ReadingErrors,
    Trials,
    UndeterminedError,
    estimate_influence,
)
from rotorid.fleet import MachineRecord, fit_type


def drawn_type(seed=1, machines=30, S=1, C=2, P=2, noise=0.02):
    """Machines with trial weights at odd angles, from runs."""
    rng = np.random.default_rng(seed)
    cn = lambda *shape: rng.standard_normal(shape) + 1j * rng.standard_normal(shape)  # noqa: E731
    W = cn(S, C, P) * (1 + 0.1 * cn(machines, S, C, P))
    T = np.vstack((np.zeros(P), np.diag(0.7 * np.exp(1j * np.arange(1, P + 1)))))
    each = []
    for m in range(machines):
        Y = np.einsum("scp,rp->rsc", W[m], T) + cn(S, C)
        Y = Y * (1 + noise * cn(*Y.shape))
        each.append(
            Trials(
                tuple("abc"[: P + 1]),
                100.0 * np.arange(1, S + 1),
                ("x", "y", "z")[:C],
                ("L", "R")[:P],
                Y,
                T,
                errors=ReadingErrors(noise, noise),
            )
        )
    return each


def records(runs):
    return [MachineRecord.of(estimate_influence(trials), f"m{k}", str(k)) for k, trials in enumerate(runs)]


def test_lag_is_told_where_trial_weights_stood_at_other_angles():
    runs = drawn_type()
    lag = Trials(
        *(getattr(runs[4], name) for name in ("runs", "speeds", "sensors", "planes")),
        np.conj(runs[4].readings),
        runs[4].weights,
        errors=runs[4].errors,
    )
    every = records([*runs[:4], lag, *runs[5:]])
    kind = fit_type(every, runs[0].speeds, runs[0].sensors, runs[0].planes)
    assert [record.machine for record, _ in kind.odd] == ["m4"]
    assert "lag for lead" in kind.why_odd(every[4], lag)
    assert "lag for lead" not in kind.why_odd(every[4])  # conj(W) is another thing
    far = replace(
        lag, weights=lag.weights * [0.5, 2.0]
    )  # masses as they were, at other radii than the type's
    assert "lag for lead" in kind.why_odd(every[4], far)
    bare = replace(lag, runs=lag.runs[:1], readings=lag.readings[:, :1], weights=lag.weights[:1])
    assert kind.why_odd(every[4], bare) == kind.why_odd(every[4])  # stored coefficients: no trial runs


@pytest.mark.parametrize(("degrees", "words"), [(84, "lagged 84° more"), (-120, "led 120° more")])
def test_a_keyphasor_mark_is_told_with_its_angle(degrees, words):
    runs = drawn_type(2)
    every = records(runs)
    W = every[7].W * np.exp(1j * np.radians(degrees))
    every[7] = every[7]._replace(W=W)
    kind = fit_type(every, runs[0].speeds, runs[0].sensors, runs[0].planes)
    told = kind.why_odd(every[7])
    number = words.split()[1].rstrip("°")
    near = [words.replace(number, str(int(number) + off)) for off in range(-8, 9)]
    assert [record.machine for record, _ in kind.odd] == ["m7"]
    assert any(one in told for one in near)


def test_planes_that_were_exchanged_are_told():
    runs = drawn_type(3)
    every = records(runs)
    every[9] = every[9]._replace(W=every[9].W[..., ::-1], covariance=every[9].covariance[:, :, ::-1])
    kind = fit_type(every, runs[0].speeds, runs[0].sensors, runs[0].planes)
    assert "planes L and R were exchanged" in kind.why_odd(every[9])
    broken = every[9]._replace(W=every[9].W * 30)
    assert kind.why_odd(broken) == ""
    assert kind.why_odd(every[0]) == ""  # a turn by 1° is no reason where none is needed


def test_scatter_is_what_was_drawn_and_own_jobs_narrow_it():
    runs = drawn_type(4, machines=400, noise=0.002)
    every = records(runs)
    kind = fit_type(every, runs[0].speeds, runs[0].sensors, runs[0].planes)
    along, across = kind.scatter(kind.effects.between)
    assert along == pytest.approx(0.1, rel=0.15)
    assert across == pytest.approx(0.1, rel=0.15)
    new, own = kind.influence(Labels()), kind.influence(Labels(), "m3")
    assert np.all(own.channels().trace(axis1=-2, axis2=-1) < new.channels().trace(axis1=-2, axis2=-1))
    assert np.abs(own.W - every[3].W).max() < 0.5 * np.abs(new.W - every[3].W).max()


def test_few_machines_are_refused_and_widen_what_is_said():
    runs = drawn_type(5, machines=8)
    grid = runs[0].speeds, runs[0].sensors, runs[0].planes
    every = records(runs)
    with pytest.raises(UndeterminedError, match=r"2 machines with these speeds.*3 or more"):
        fit_type(every[:2], *grid)
    kind = fit_type(every, *grid)
    assert kind.widening == pytest.approx(2 * 4.7374 / 5.9915, rel=1e-3)  # F(2, 7)
    with pytest.raises(ValueError, match="not in"):
        replace(kind, sensors=("x", "q")).measured(runs[0])


def test_a_record_has_its_own_variances():
    influence = estimate_influence(drawn_type(6, machines=1)[0])
    record = MachineRecord.of(influence, "m", "j")
    assert isinstance(record, MachineRecord)
    assert record.covariance[0, 1, 1] == pytest.approx(influence.channels()[0, 1, 4:6, 4:6])
