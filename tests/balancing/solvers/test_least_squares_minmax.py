"""The one entry to correction weights: closed form, limits, and what other programs answer silently wrong."""

import minmax_problems
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from repetitions import FULL

from balancing.coefficients.identifiability import UndeterminedError
from balancing.data.limits import Limits
from balancing.solvers.cone import InfeasibleError, problem
from balancing.solvers.conflicting_limits import relax
from balancing.solvers.forbidden_angles import allowed_sectors
from balancing.solvers.least_squares_minmax import solve

METHODS = ("least-squares", "minmax")
seeds = st.integers(0, 2**32 - 1)
methods = st.sampled_from(METHODS)


def numbers(seed, N=10, P=3):
    rng = np.random.default_rng(seed)
    return rng, minmax_problems.normal(rng, (N, P)), minmax_problems.normal(rng, N)


def limits(N, P, *, max_weight=np.inf, residual=np.inf, forbidden=None):
    return Limits(
        np.broadcast_to(np.asarray(max_weight, dtype=float), P).copy(),
        np.broadcast_to(np.asarray(residual, dtype=float), (1, N)).copy(),
        ((),) * P if forbidden is None else forbidden,
    )


@given(seeds, st.integers(1, 5), st.booleans())
def test_least_squares_is_the_closed_form(seed, P, weighted):
    rng, W, Y = numbers(seed, 12, P)
    w = rng.uniform(0, 2, 12) if weighted else np.ones(12)
    found = solve(W, Y, row_weights=w if weighted else None)
    expected = np.linalg.lstsq(w[:, None] * W, -w * Y, rcond=None)[0]
    np.testing.assert_allclose(found.weights, expected, rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(found.residual, Y + W @ expected, rtol=1e-8, atol=1e-9)
    assert found.objective == pytest.approx(np.linalg.norm(w * found.residual), rel=1e-12)
    assert found.gap is None
    assert not found.active_weights.any()
    assert not found.active_residuals.any()


@given(seeds, methods, st.floats(1e-8, 1e8), st.floats(1e-8, 1e8))
def test_units_scale_the_weights(seed, method, amplitude, weight):
    """Readings times a, weights in units of b: the same problem, with limits too."""
    _, W, Y = numbers(seed)
    free = solve(W, Y, method=method)
    most = 0.7 * np.abs(free.weights)
    a = solve(W, Y, method=method, limits=limits(10, 3, max_weight=most))
    scaled = limits(10, 3, max_weight=most * weight)
    b = solve(W * (amplitude / weight), Y * amplitude, method=method, limits=scaled)
    assert b.objective == pytest.approx(a.objective * amplitude, rel=1e-7)
    # weights are known to the root of the gap
    np.testing.assert_allclose(b.weights / weight, a.weights, atol=1e-3 * np.abs(a.weights).max())


@given(seeds, methods, st.floats(-7, 7))
def test_a_turn_of_all_readings_turns_the_weights(seed, method, turn):
    _, W, Y = numbers(seed)
    free = solve(W, Y, method=method)
    most = limits(10, 3, max_weight=0.7 * np.abs(free.weights))
    a = solve(W, Y, method=method, limits=most)
    b = solve(W, Y * np.exp(1j * turn), method=method, limits=most)
    assert b.objective == pytest.approx(a.objective, rel=1e-7)
    np.testing.assert_allclose(b.weights, a.weights * np.exp(1j * turn), atol=1e-3 * np.abs(a.weights).max())


@given(seeds, methods, st.floats(0.3, 1.0))
def test_a_tighter_limit_never_improves_the_objective(seed, method, share):
    _, W, Y = numbers(seed)
    free = solve(W, Y, method=method)
    loose = 0.9 * np.abs(free.weights)
    tight = loose * np.array([share, 1, 1])
    one = solve(W, Y, method=method, limits=limits(10, 3, max_weight=loose))
    two = solve(W, Y, method=method, limits=limits(10, 3, max_weight=tight))
    assert free.objective <= one.objective * (1 + 1e-8)
    assert one.objective <= two.objective * (1 + 1e-8)
    highest = np.abs(two.residual) * (1 + 1e-6)
    three = solve(W, Y, method=method, limits=limits(10, 3, max_weight=tight, residual=highest))
    assert two.objective <= three.objective * (1 + 1e-8)
    assert (np.abs(three.residual) <= highest).all()


@given(seeds, st.integers(1, 4), st.booleans())
def test_minmax_is_below_the_maximum_of_least_squares(seed, P, limited):
    _, W, Y = numbers(seed, 10, P)
    squares = solve(W, Y)
    most = limits(10, P, max_weight=0.8 * np.abs(squares.weights)) if limited else None
    squares, minmax = solve(W, Y, limits=most), solve(W, Y, method="minmax", limits=most)
    top = np.abs(squares.residual).max()
    assert minmax.objective <= top * (1 + 1e-8)
    assert minmax.objective * (1 - minmax.gap) >= np.linalg.norm(squares.residual) / np.sqrt(10) * (1 - 1e-7)
    assert minmax.gap < 1e-6
    # at least P + 1 readings share the maximum where nothing is limited (Haar: linear programs' vertices)
    assert minmax.active_residuals.sum() + minmax.active_weights.sum() >= min(P + 1, 2)


def test_one_plane_minmax_by_hand():
    """|3 + D| = |5 + D| at D = −4, where least squares stands as well; a third reading 0 pulls to −5/2."""
    found = solve([[1.0], [1.0], [1.0]], [0.0, 3.0, 5.0], method="minmax")
    assert found.weights[0] == pytest.approx(-2.5, abs=1e-7)
    assert found.objective == pytest.approx(2.5, rel=1e-9)
    np.testing.assert_array_equal(found.active_residuals, [True, False, True])
    assert solve([[1.0], [1.0], [1.0]], [0.0, 3.0, 5.0]).weights[0] == pytest.approx(-8 / 3)


@pytest.mark.parametrize("method", METHODS)
def test_as_many_planes_as_readings_leave_nothing(method):
    _, W, Y = numbers(3, 3, 3)
    found = solve(W, Y, method=method)
    assert np.abs(found.residual).max() < 1e-13
    assert found.gap is None


@pytest.mark.parametrize("method", METHODS)
def test_a_plane_without_weight_is_left_out(method):
    """The third plane follows from the others; with at most zero in it the two are determined."""
    _, W, Y = numbers(4, 8, 2)
    three = np.column_stack((W, W @ [1, 2j]))
    found = solve(three, Y, method=method, limits=limits(8, 3, max_weight=[np.inf, np.inf, 0]))
    assert found.weights[2] == 0
    np.testing.assert_array_equal(found.active_weights, [False, False, True])
    two = solve(W, Y, method=method)
    np.testing.assert_allclose(found.weights[:2], two.weights, rtol=1e-9)
    none = solve(W, Y, method=method, limits=limits(8, 2, max_weight=0))
    assert (none.weights == 0).all()
    np.testing.assert_array_equal(none.residual, Y)


def test_limits_that_do_not_bind_leave_the_closed_form():
    _, W, Y = numbers(5)
    free = solve(W, Y)
    loose = limits(10, 3, max_weight=1.01 * np.abs(free.weights), residual=1.01 * np.abs(free.residual))
    found = solve(W, Y, limits=loose)
    np.testing.assert_array_equal(found.weights, free.weights)
    assert found.gap is None


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("limited", [False, True])
class TestSilentWrongAnswers:
    def of(self, W, Y, method, limited, **more):
        W = np.asarray(W, dtype=complex)
        most = limits(len(W), W.shape[1], max_weight=100.0) if limited and W.ndim == 2 and W.size else None
        return solve(W, Y, method=method, limits=most, **more)

    @pytest.mark.parametrize("bad", [np.nan, np.inf, complex(0, np.nan)])
    def test_a_reading_that_is_no_number(self, method, limited, bad):
        with pytest.raises(ValueError, match="must be finite; found NaN or infinity"):
            self.of([[1], [2], [3j]], [1, bad, 2], method, limited)
        with pytest.raises(ValueError, match="must be finite; found NaN or infinity"):
            self.of([[1], [bad], [3j]], [1, 3, 2], method, limited)

    def test_no_readings(self, method, limited):
        with pytest.raises(ValueError, match="not empty"):
            self.of(np.zeros((0, 2)), [], method, limited)
        with pytest.raises(ValueError, match="not empty"):
            self.of(np.zeros((2, 0)), [1, 2], method, limited)

    def test_a_dependent_third_plane(self, method, limited):
        _, W, Y = numbers(6, 8, 2)
        three = np.column_stack((W, W @ [1, 2j]))
        with pytest.raises(UndeterminedError, match="planes 'left', 'middle', 'right' act alike"):
            self.of(three, Y, method, limited, names=["left", "middle", "right"])

    def test_a_singular_matrix_of_two_planes(self, method, limited):
        with pytest.raises(UndeterminedError, match=r"planes 'A' and 'B' act alike.*what 0\.5 times"):
            self.of([[1, 2], [1j, 2j]], [1, 3], method, limited, names=["A", "B"])

    def test_a_plane_without_effect(self, method, limited):
        with pytest.raises(UndeterminedError, match="plane '2' has no effect on any reading"):
            self.of([[1, 0], [2, 0]], [1, 3], method, limited)

    def test_fewer_readings_than_planes(self, method, limited):
        with pytest.raises(UndeterminedError, match="2 planes need at least 2 readings"):
            self.of([[1, 2]], [1], method, limited)

    def test_row_weights_that_leave_too_little(self, method, limited):
        with pytest.raises(UndeterminedError, match="2 planes need at least 2 readings"):
            self.of([[1, 2], [2, 1]], [1, 3], method, limited, row_weights=[1, 0])
        for wrong in ([1.0, -1.0], [0.0, 0.0], [1.0], [1.0, np.nan]):
            with pytest.raises(ValueError, match="row weights must be"):
                self.of([[1, 2], [2, 1]], [1, 3], method, limited, row_weights=wrong)

    def test_names_that_do_not_fit(self, method, limited):
        with pytest.raises(ValueError, match="2 planes and 2 readings need as many names"):
            self.of([[1, 2], [2, 1]], [1, 3], method, limited, names=["A"])


def test_an_unknown_method_and_limits_of_another_job():
    with pytest.raises(ValueError, match="must be 'least-squares' or 'minmax'; got 'huber'"):
        solve([[1.0]], [1.0], method="huber")
    with pytest.raises(ValueError, match="the limits are for 3 readings and 1 planes; there are 2 and 1"):
        solve([[1.0], [1.0]], [1.0, 2.0], limits=limits(3, 1, max_weight=1))


LABELS = {
    "names": ["left", "right"],
    "readings": ["sensor 'A' at 3000 rpm", "sensor 'B' at 3000 rpm", "sensor 'C' at 3000 rpm"],
    "amplitude": lambda a: f"{a * 1e6:.3g} um",
    "weight": lambda m: f"{m * 1e3:.3g} g",
}


@pytest.mark.parametrize("method", METHODS)
def test_limits_that_conflict_are_named_with_the_least_relaxation(method):
    """40 um, 2 um per gram: 5 g leave 30 um where 20 um are allowed: 1.5 times, or 10 g, twice as much."""
    W = np.array([[2e-3, 0], [0, 1e-3], [0, 1e-3]])
    Y = np.array([40e-6, 3e-6, 3e-6])
    most = limits(3, 2, max_weight=[5e-3, 5e-3], residual=[20e-6, 20e-6, np.inf])
    with pytest.raises(InfeasibleError) as refused:
        solve(W, Y, method=method, limits=most, **LABELS)
    assert str(refused.value) == (
        "the limits cannot be met: with at most 5 g in plane 'left', sensor 'A' at 3000 rpm (limit 20 um) "
        "stays at 30 um at best; relaxing all amplitude limits 1.51 times works, or all weight limits "
        "2.01 times"
    )


@settings(max_examples=100 if FULL else 40)
@given(seeds, st.booleans(), st.booleans())
def test_the_least_relaxation_works_and_less_does_not(seed, forbid, weights_limited):
    rng, W, Y = numbers(seed, 7, 2)
    best = solve(W, Y, method="minmax")
    arcs = ((((float(np.angle(best.weights[0])) - 0.5), 1.0),), ()) if forbid else ((), ())
    M = np.abs(best.weights) * 0.8 if weights_limited else np.full(2, np.inf)
    L = best.objective * rng.uniform(0.5, 0.8, 7)
    sectors = [allowed_sectors(a) for a in arcs]
    found = relax(problem(W, Y, None, M, L), sectors)
    assert found.amplitudes > 1
    enough = solve(
        W, Y, limits=limits(7, 2, max_weight=M, residual=1.001 * found.amplitudes * L, forbidden=arcs)
    )
    assert (np.abs(enough.residual) <= 1.001 * found.amplitudes * L).all()
    with pytest.raises(InfeasibleError):
        solve(W, Y, limits=limits(7, 2, max_weight=M, residual=0.999 * found.amplitudes * L, forbidden=arcs))
    np.testing.assert_allclose(
        found.best[list(found.readings)] / L[list(found.readings)], found.amplitudes, rtol=1e-4
    )
    if forbid:
        return  # other sectors may conflict with other limits
    # the limits named are enough for the conflict: all others may go
    kept = np.where(np.isin(np.arange(7), found.readings), 0.999 * found.amplitudes * L, np.inf)
    heavy = np.where(np.isin(np.arange(2), found.planes), M, np.inf)
    with pytest.raises(InfeasibleError):
        solve(W, Y, limits=limits(7, 2, max_weight=heavy, residual=kept))


@settings(max_examples=100 if FULL else 40)
@given(seeds)
def test_the_least_factor_of_the_weights(seed):
    _, W, Y = numbers(seed, 7, 2)
    free = solve(W, Y, method="minmax")
    M, L = 0.5 * np.abs(free.weights), np.full(7, 1.02 * free.objective)
    try:
        solve(W, Y, limits=limits(7, 2, max_weight=M, residual=L))
        assume(False)
    except InfeasibleError:
        factor = relax(problem(W, Y, None, M, L), [None, None]).weights
    assert 1 < factor < 2 + 1e-6  # at twice the limits the weights of the optimum may be mounted
    solve(W, Y, limits=limits(7, 2, max_weight=1.001 * factor * M, residual=L))
    with pytest.raises(InfeasibleError, match="or all weight limits"):
        solve(W, Y, limits=limits(7, 2, max_weight=0.999 * factor * M, residual=L))


def refusal(W, Y, most):
    with pytest.raises(InfeasibleError) as refused:
        solve(W, Y, limits=most, **{**LABELS, "readings": LABELS["readings"][: len(Y)]})
    return str(refused.value)


def test_limits_no_weights_meet():
    assert refusal(
        [[1, 0], [1, 0], [0, 1]], [30e-6, 50e-6, 1e-6], limits(3, 2, residual=[5e-6, 8e-6, np.inf])
    ) == (
        "the limits cannot be met: whatever the weights, sensor 'B' at 3000 rpm (limit 8 um) stays at "
        "12.3 um and sensor 'A' at 3000 rpm (limit 5 um) stays at 7.69 um at best; relaxing all amplitude "
        "limits 1.54 times works"
    )


def test_forbidden_angles_that_conflict_are_named():
    arcs = (((np.pi / 2, np.pi),), ())
    words = refusal(np.eye(2), [40e-6, 1e-6], limits(2, 2, residual=20e-6, forbidden=arcs))
    assert words == (
        "the limits cannot be met: with the forbidden angles of plane 'left', sensor 'A' at 3000 rpm "
        "(limit 20 um) stays at 40 um at best; relaxing all amplitude limits 2.01 times works"
    )


def test_planes_left_empty_that_conflict_are_named():
    words = refusal(np.eye(2), [40e-6, 1e-6], limits(2, 2, max_weight=[0, np.inf], residual=20e-6))
    assert words == (
        "the limits cannot be met: with plane 'left' left empty, sensor 'A' at 3000 rpm (limit 20 um) stays "
        "at 40 um at best; relaxing all amplitude limits 2.01 times works"
    )


def test_an_amplitude_of_zero():
    words = refusal([[1, 0], [1, 0], [0, 1]], [30e-6, 50e-6, 1e-6], limits(3, 2, residual=[0, 0, np.inf]))
    assert words.startswith("the limits cannot be met: whatever the weights, sensor ")
    assert words.endswith(
        "at 20 um at best; an amplitude of zero cannot be reached, give a larger limit"
    ) or words.endswith("at 10 um at best; an amplitude of zero cannot be reached, give a larger limit")


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("largest", [0.0, 1e-17])
def test_an_amplitude_of_zero_that_only_exact_numbers_reach(method, largest):
    """Two planes and two readings leave nothing but rounding: more than zero."""
    _, W, Y = numbers(11, 2, 2)
    with pytest.raises(InfeasibleError, match="only to within rounding"):
        solve(W, Y, method=method, limits=limits(2, 2, residual=largest))
    found = solve(W, Y, method=method, limits=limits(2, 2, residual=1e-12))
    assert np.abs(found.residual).max() <= 1e-12


def test_without_limits_of_amplitudes_nothing_is_infeasible():
    with pytest.raises(ValueError, match="zero weights meet every limit"):
        relax(problem([[1.0]], [1.0], None, [0.1]), [None])


def test_hundreds_of_readings():
    """Certified at the size of the benchmark, limits binding."""
    _, W, Y = numbers(1, 600, 12)
    free = solve(W, Y, method="minmax")
    assert free.gap < 1e-7
    most = limits(600, 12, max_weight=0.7 * np.abs(free.weights), residual=1.3 * free.objective)
    for method in METHODS:
        found = solve(W, Y, method=method, limits=most)
        assert found.gap < 1e-6
        assert (np.abs(found.residual) <= 1.3 * free.objective).all()
        assert (np.abs(found.weights) <= most.max_weight).all()
