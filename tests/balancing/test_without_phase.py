"""Amplitudes alone: printed examples, brute force over a grid, what is refused, named and told."""

import balancing_data
import numpy as np
import pytest
from balancing_data import complex_normal
from scipy.optimize import minimize

from balancing import (
    Labels,
    Limits,
    ReadingErrors,
    RunScatter,
    UndeterminedError,
    balance_without_phase,
)
from balancing.without_phase_fit import Fit

AT = {120: (0, 120, 240), 180: (0, 180)}


def job(read, angles=AT[120], mass=1.0, **more):
    """Runs of one sensor: a baseline, then one weight at each angle."""
    weights = np.concatenate(([0.0], np.broadcast_to(mass, len(angles)) * turned(angles)))
    return trials(np.array(read, dtype=float)[:, None], weights[:, None], **more)


def trials(read, weights, **more):
    """Runs with amplitudes (R, C) and weights (R, P)."""
    return balancing_data.job(
        read, weights, labels=Labels("mm_s_rms", 1.0, "g", 1.0), amplitudes_only=True, **more
    )


def turned(degrees):
    return balancing_data.polar(1, degrees)


def misfit(T, a, s, places):
    """χ² where a weight at a place leaves nothing, in the best scale."""
    g, a = abs(T - np.asarray(places)[..., None]) / s, a / s
    return a @ a - (g @ a) ** 2 / (g * g).sum(axis=-1)


def holds(answer, weights):
    """Whether the intervals of the first solution hold sizes and angles of weights."""
    low, high, angle = answer.solutions[0].intervals
    off = abs(np.angle(weights / answer.weights))
    return ((low <= abs(weights)) & (abs(weights) <= high) & (off <= angle)).all()


def polar(weight):
    return abs(weight), np.degrees(np.angle(weight)) % 360


def test_two_trials_half_a_turn_apart_as_printed():
    """O = 3, T1 = 5, T2 = 4 (a shop's instruction of 1998): 0.885 of the trial weight at 103° or 257°."""
    answer = balance_without_phase(job([3, 5, 4], AT[180]))
    sizes, angles = zip(*(polar(one.weights[0]) for one in answer.solutions), strict=True)
    assert sizes == pytest.approx((0.885, 0.885), abs=5e-4)
    assert sorted(angles) == pytest.approx([102.8, 257.2], abs=0.05)
    assert not answer.sound


def test_three_points_as_printed():
    """8, 11.05, 3.82, 15.09 with 4.5 g: printed 4.68 g at 90.3°, by differences of squares."""
    read, printed = np.array([8, 11.05, 3.82, 15.09]), 4.68 * turned(90.3)
    answer = balance_without_phase(job(read, mass=4.5, errors=ReadingErrors(0.05)))
    assert polar(answer.weights[0]) == pytest.approx((4.77, 91.6), abs=0.05)
    assert holds(answer, np.array([printed]))
    assert answer.sound


def test_two_points_as_printed():
    """A. Lindholm's (a reliability forum, quoted on eng-tips): test mass : balancing mass = d : 2a.

    Readings a of the bare rotor, b and c with the mass at 0° and 180°: sides b, c and 2a are a triangle's,
    d² = 2b² + 2c² − 4a². By the law of cosines its angles, to either side, are those of the solutions.
    """
    rng = np.random.default_rng(20)
    for mass, size, place, scale in rng.uniform((0.5, 0.5, 0, 1), (2, 2, 2 * np.pi, 20), (20, 4)):
        a, b, c = scale * abs(np.array([0, mass, -mass]) - size * np.exp(1j * place))
        d = np.sqrt(2 * b**2 + 2 * c**2 - 4 * a**2)
        turn = np.exp(1j * np.arccos((a**2 + d**2 / 4 - b**2) / (a * d)))
        answer = balance_without_phase(job([a, b, c], AT[180], mass, errors=ReadingErrors(0.02)))
        both = sorted((one.weights[0] for one in answer.solutions), key=np.angle)
        assert both == pytest.approx(2 * a / d * mass * np.array([turn.conj(), turn]), abs=1e-6)


def test_impossible_amplitudes_are_named():
    answer = balance_without_phase(job((7, 4, 3.5, 5)))
    assert answer.decision.word == "measure again"
    assert "cannot be below the baseline's 7 " in answer.decision.cause


def brute(T, a, s):
    """Least χ² of a fine grid, exact by simplexes from its 20 best places."""
    places = np.geomspace(0.02, 40, 240)[:, None] * np.exp(2j * np.pi * np.arange(240) / 240)
    best = places.ravel()[np.argsort(misfit(T, a, s, places), axis=None)[:20]]
    at = lambda v: float(misfit(T, a, s, v[0] + 1j * v[1]))  # noqa: E731
    options = {"xatol": 1e-7, "fatol": 1e-9}
    return min(minimize(at, [z.real, z.imag], method="Nelder-Mead", options=options).fun for z in best)


def drawn_job(rng):
    """Weights at random places or in one line, with scatter or without."""
    R = int(rng.integers(4, 8))
    T = np.concatenate(([0], np.exp(rng.uniform(-0.5, 0.5, R - 1) + 2j * np.pi * rng.random(R - 1))))
    if rng.random() < 0.3:
        T = T.real * np.exp(2j * np.pi * rng.random())
    D = np.exp(rng.uniform(-1, 1) + 2j * np.pi * rng.random())
    a = abs(abs(T - D) * (1 + rng.choice([0.0, 0.1]) * rng.standard_normal(R)))
    return T, a / a.max()


def test_no_place_of_a_grid_fits_better():
    rng = np.random.default_rng(51)
    for _ in range(60):
        T, a = drawn_job(rng)
        s = 0.1 * np.maximum(a, 0.02)
        assert Fit(T[:, None] / abs(T).max(), a, s).chi_square[0] <= brute(T, a, s) + 1e-5


def test_two_solutions_differ_and_their_intervals_are_those_of_a_grid():
    """Places 1/D̄ of D have nearly the same distances from weights on a circle around the origin."""
    T = np.array([0, *turned(np.arange(0, 360, 60))])
    a = abs(T - 0.8j) * (1 + 0.1 * np.random.default_rng(4).standard_normal(7))
    first, second = balance_without_phase(job(a, range(0, 360, 60), errors=ReadingErrors(0.1))).solutions
    grid = np.geomspace(0.2, 5, 601)[:, None] * turned(np.arange(0, 360, 0.5))
    own = abs(np.log(grid / first.weights)) < abs(np.log(grid / second.weights))
    size = abs(grid[own & (misfit(T, a, 0.1 * a, grid) <= first.chi_square + 5.0)])
    assert np.ravel(first.intervals[:2]) == pytest.approx((size.min(), size.max()), abs=0.02)


def test_several_sensors_and_speeds_are_one_fit():
    rng, T, D = np.random.default_rng(3), np.array([0, 1, *turned([120, 240])])[:, None], 0.7 * np.exp(1j)
    W = complex_normal(rng, (2, 3))
    Y = -W * D + 0.05 * complex_normal(rng, (2, 3))
    runs = trials(abs(Y + W * T[..., None]), T, speeds=(100, 200), errors=ReadingErrors(0.01))
    best = np.linalg.lstsq(W.reshape(-1, 1), -Y.ravel(), None)[0]
    answer = balance_without_phase(runs)
    assert answer.weights == pytest.approx(best, abs=1e-5)
    assert answer.sound
    assert answer.to_dict()["rms_after"] == pytest.approx(balancing_data.rms(Y + W * best), rel=1e-4)


def two_planes(runs=7):
    T = np.zeros((7, 2), dtype=complex)
    T[1:4, 0], T[4:7, 1] = turned(AT[120]), 0.8 * turned([30, 150, 270])
    return T[:runs]


def test_two_planes_take_seven_runs():
    rng, D = np.random.default_rng(8), np.array([0.6 * np.exp(1j), 0.9 * np.exp(-2j)])
    W = complex_normal(rng, (3, 2))
    read = abs((two_planes() - D) @ W.T)
    answer = balance_without_phase(trials(read, two_planes(), errors=ReadingErrors(0.01)))
    assert answer.weights == pytest.approx(D, abs=1e-5)
    assert holds(answer, D)
    limits = Limits(np.array([0.5, 2.0]), np.full((1, 3), np.inf), ((), ()))
    limited = balance_without_phase(trials(read, two_planes(), errors=ReadingErrors(0.01)), limits=limits)
    assert abs(limited.weights) == pytest.approx([0.5, 0.9], abs=1e-5)
    with pytest.raises(UndeterminedError, match=r"seven.* 6 with .*in plane 'B'"):
        balance_without_phase(trials(read[:6], two_planes(6)))


def test_too_few_runs_name_those_that_are_missing():
    with pytest.raises(UndeterminedError, match=r"four runs.*1 g at 120\.0° in plane 'A' and 1 g at 240\.0°"):
        balance_without_phase(job([3, 4], [0]))
    with pytest.raises(UndeterminedError, match="without weights"):
        balance_without_phase(trials(np.array([[3.0], [4.0]]), np.array([[1], [1j]])))
    with pytest.raises(ValueError, match="one or two planes"):
        balance_without_phase(trials(np.ones((4, 1)), np.eye(4)))


def test_errors_are_stated_assumed_or_estimated():
    read = [8, 11.05, 3.82, 15.09]
    assumed = balance_without_phase(job(read))
    stated = balance_without_phase(job(read, errors=ReadingErrors(0.03), run_errors=RunScatter(0.04)))
    assert (assumed.scatter.relative, assumed.scatter.origin) == (0.1, "assumed")
    assert (stated.scatter.relative, stated.scatter.origin) == (pytest.approx(0.05), "stated")
    assert stated.solutions[0].left < 0.7 * assumed.solutions[0].left
    rng, T = np.random.default_rng(0), np.array([0, *turned(np.arange(0, 360, 18))])[:, None]
    read = abs(T - 0.7j) * (1 + 0.04 * rng.standard_normal((21, 1)))
    many = balance_without_phase(trials(read, T))
    assert many.scatter.origin == "estimated"
    assert 0.02 < many.scatter.relative < 0.06
    assert "taken to scatter by 10 %" in assumed.summary()


def test_trial_weights_that_did_nothing_ask_for_heavier_ones():
    answer = balance_without_phase(job([5, 5.1, 4.9, 5]))
    assert "no more than their errors" in answer.sentence()


def test_a_sensor_that_reads_nothing_is_named_and_a_second_baseline_does_no_harm():
    T = np.array([0, 0, 1, *turned([120, 240])])[:, None]
    read = abs(T - 0.7j) * [[1.0, 0.0]]
    with pytest.raises(ValueError, match="'s1' reads 0 in every run: leave it out"):
        balance_without_phase(trials(read, T))
    answer = balance_without_phase(trials(read[:, :1], T, errors=ReadingErrors(0.02)))
    assert answer.weights == pytest.approx([0.7j], abs=1e-6)


def test_a_solution_where_nothing_may_be_mounted_is_not_mounted():
    runs, arc = job([8, 11.05, 3.82, 15.09], errors=ReadingErrors(0.02)), ((np.radians(80.0), 0.3),)
    for arcs, allowed in ((arc, False), ((), True)):
        limits = Limits(np.array([np.inf]), np.full((1, 1), np.inf), (arcs,))
        answer = balance_without_phase(runs, limits=limits)
        assert answer.sound == allowed
        assert ("where the job forbids" in answer.sentence()) != allowed
