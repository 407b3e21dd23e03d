"""Coefficients of a type: few machines, reasons of odd ones."""

from dataclasses import replace

import numpy as np
import pytest

from balancing import Labels, ReadingErrors, Trials, UndeterminedError, estimate_influence
from rotorid.fleet.jobs import known_errors
from rotorid.fleet.machine_type import MachineRecord, fit_type

GRID = np.array([100.0]), ("x", "y"), ("L", "R")
NOISE = 0.005


def drawn_type(seed, machines=30):
    """Runs of machines with trial weights at odd angles."""
    rng = np.random.default_rng(seed)
    cn = lambda *shape: rng.standard_normal(shape) + 1j * rng.standard_normal(shape)  # noqa: E731
    W = cn(1, 2, 2) * (1 + 0.1 * cn(machines, 1, 2, 2))
    T = np.array([[0, 0], [0.7 * np.exp(1j), 0], [0, 0.7 * np.exp(2j)]])
    Y = np.einsum("mscp,rp->mrsc", W, T) + cn(machines, 1, 1, 2)
    Y = Y * (1 + NOISE * cn(*Y.shape))
    return [Trials(tuple("abc"), *GRID, one, T, errors=ReadingErrors(NOISE, NOISE)) for one in Y]


def records(runs):
    each = enumerate(map(estimate_influence, runs))
    return [MachineRecord(f"m{k}", str(k), one.W, known_errors(one)) for k, one in each]


def changed(what, trials, record):
    """A machine's record as it is where something of it was written down wrongly."""
    W, std = record.W, record.std
    if what == "lag":
        W = estimate_influence(replace(trials, readings=np.conj(trials.readings))).W
    if what == "sensors":
        W, std = W[:, ::-1], std[:, ::-1]
    if not isinstance(what, str):
        W = W * np.exp(1j * np.radians(what))
    return record._replace(W=W, std=std)


@pytest.mark.parametrize(
    ("what", "words"),
    [
        ("lag", "its phases were of the other sense (lag for lead)"),
        ("sensors", "its sensors x and y were exchanged"),
        (84, "its phases lagged {}° more (another keyphasor mark)"),
    ],
)
def test_an_odd_machine_is_found_with_what_would_make_it_fit(what, words):
    """Also lag, where trial weights stood at other angles than 0°; a mark with its angle."""
    runs = drawn_type(2)
    every = records(runs)
    every[7] = changed(what, runs[7], every[7])
    kind = fit_type(every, *GRID)
    assert [record.machine for record, _ in kind.odd] == ["m7"]
    near = [words.format(abs(what) + off) for off in range(-8, 9)] if "{}" in words else [words]
    assert kind.why_odd(every[7]) in near
    assert kind.why_odd(every[7]._replace(W=every[7].W * 30)) is None


def test_few_machines_are_refused_and_widen_the_answer():
    every = records(drawn_type(5, machines=8))
    with pytest.raises(UndeterminedError, match=r"2 machines with these speeds.*3 or more"):
        fit_type(every[:2], *GRID)
    assert "nothing tells an odd one" in fit_type(every[:4], *GRID).notes[0]
    kind = fit_type(every, *GRID)
    effects, prior = kind.effects, kind.influence(Labels(), "m3").channels()[0, 0, 2:, 2:]
    assert np.trace(prior[:2, :2]) == pytest.approx(
        2 * 4.7374 / 5.9915 * np.trace((effects.known(3)[1] + effects.within)[:2, :2]),
        rel=1e-3,  # F(2, 7)
    )
