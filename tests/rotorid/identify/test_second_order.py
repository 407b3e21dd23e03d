"""Second-order systems from matrices."""

from __future__ import annotations

import numpy as np
import pytest
from cases import each_of

from rotorid.identify.ode import SimulationError, ode_model
from rotorid.identify.records import Record
from rotorid.identify.second_order import second_order
from rotorid.identify.simulation import simulate

M = [["m1", "a"], ["a", 18.0]]
C = [["c1 + c2", "-c2"], ["-c2", "c2"]]
K = np.array([[2.0, -1.0], [-1.0, 1.5]])
ESTIMATE = {"m1": 12.0, "c1": 0.14, "a": 1.5, "start": 0.5}


def made(**changes):
    options = {"estimate": ESTIMATE, "known": {"c2": 0.3}, "initial": {"y1": "start", "v_y2": -0.2}}
    return second_order(M, C, K, **(options | changes))


def by_hand(force="0"):
    """The same with the mass matrix inverted on paper."""
    r1 = f"({force} - (c1 + c2)*v_y1 + c2*v_y2 - 2*y1 + y2)"
    r2 = "(c2*v_y1 - c2*v_y2 + y1 - 1.5*y2)"
    return ode_model(
        {
            "y1": "v_y1", "v_y1": f"(18*{r1} - a*{r2})/(18*m1 - a**2)",
            "y2": "v_y2", "v_y2": f"(m1*{r2} - a*{r1})/(18*m1 - a**2)",
        },
        initial={"y1": "start", "v_y1": 0, "y2": 0, "v_y2": -0.2},
        outputs={"y1": "y1", "y2": "y2"},
        estimate=ESTIMATE,
        known={"c2": 0.3},
    )  # fmt: skip


def test_functions_and_matrices_agree_with_the_system_by_hand():
    model, plain = made(), by_hand()
    assert model.linear_driven
    assert model.states == plain.states
    for one, other in zip(model.matrices(model.start), plain.matrices(model.start), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-13, atol=1e-15)
    t, x = np.arange(3.0), np.random.default_rng(1).standard_normal((3, 4))
    for name in ("f", "h"):
        ours, theirs = (getattr(m, name)(t, x, model.start) for m in (model, plain))
        np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(
            getattr(model, name)(0.0, x[0], model.start), ours[0], rtol=1e-12, atol=1e-15
        )


@pytest.mark.parametrize("integrator", ["expm", "dop853"])
def test_simulation_agrees_with_the_system_by_hand(integrator):
    t = np.linspace(0, 20, 101)
    run, plain = (
        simulate(made(), [12, 0.14, 1.5, 0.5], t, integrator=integrator),
        simulate(by_hand(), [12, 0.14, 1.5, 0.5], t),
    )
    assert run.integrator == integrator
    np.testing.assert_allclose(run.y, plain.y, atol=1e-9)
    np.testing.assert_allclose(run.y_theta, plain.y_theta, atol=1e-8)


def test_forces_of_time_inputs_and_states():
    t = np.linspace(0, 5, 11)
    model = made(force={"y1": "u*cos(t) - y1**3"}, inputs=["u"])
    assert not model.linear_driven
    assert model.driven
    record = Record(t, inputs={"u": np.full(11, 0.7)})
    run = simulate(model, model.start, record)
    plain = simulate(by_hand("(0.7*cos(t) - y1**3)"), model.start, t)
    np.testing.assert_allclose(run.y, plain.y, atol=1e-9)
    np.testing.assert_allclose(run.y_theta, plain.y_theta, atol=1e-8)


def test_names_and_rest_by_default():
    model = second_order([[2.0]], [["d"]], [[8.0]], estimate={"d": 0.1}, names=["tip"], force={"tip": 4})
    assert model.states == ("tip", "v_tip")
    assert model.outputs == ("tip",)
    run = simulate(model, [0.0], [0.0, np.pi / 2])
    np.testing.assert_allclose(run.x[1], [1.0, 0.0], atol=1e-14)  # 0.5 (1 − cos 2t)


@each_of(
    ("arguments", "options", "message"),
    [
        (([[1, 0]], [[0]], [[1]]), {}, "the mass matrix must be square"),
        (([[1]], np.zeros((2, 2)), [[1]]), {}, "different sizes: mass 1, damping 2, stiffness 1"),
        (([["m - 1"]], [[0]], [[1]]), {}, "the mass matrix is singular at m = 1"),
        (([["y1"]], [[0]], [[1]]), {}, "mass matrix, row 1: 'y1': y1 is not defined here"),
        (([[np.nan]], [[0]], [[1]]), {}, "mass matrix, row 1: .nan.: nan is not defined here"),
        (([[1]], [[0]], [["q"]]), {}, "state v_y1: .* q is not defined"),
        (([[1]], [[0]], [[1]]), {"force": {"z": 1}}, "force: z is no displacement; displacements are y1"),
        (([[1]], [[0]], [[1]]), {"names": ["a", "b"]}, "1 names of displacements are needed, not 2"),
    ],
)
def test_bad_systems_are_refused(arguments, options, message):
    with pytest.raises(ValueError, match=message):
        second_order(*arguments, estimate={"m": 1.0}, **options)


def test_a_mass_matrix_that_becomes_singular_is_an_error():
    model = second_order([["m"]], [[0.1]], [[1.0]], estimate={"m": 1.0}, initial={"y1": 1.0})
    with pytest.raises(SimulationError, match="the mass matrix is singular at m = 0"):
        simulate(model, [0.0], [0.0, 1.0])
