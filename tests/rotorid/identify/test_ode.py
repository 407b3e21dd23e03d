"""Models and records in time: what they mean, and what they refuse; second-order systems from matrices."""

import numpy as np
import pytest
from cases import each_of

from rotorid.identify.expressions import FUNCTIONS
from rotorid.identify.integrators import written_out
from rotorid.identify.ode import SimulationError, ode_model
from rotorid.identify.records import Record
from rotorid.identify.second_order import second_order
from rotorid.identify.simulation import simulate


@each_of("function", FUNCTIONS)
def test_derivatives_of_every_function(function):
    """Against central differences, on either side of zero where the function exists."""
    rate = f"a*{function}(x) + b*{function}(a*x)"
    model = ode_model({"x": rate}, initial={"x": 1}, estimate={"a": 1.0, "b": 2.0})
    for x in (0.4,) if function in ("log", "sqrt") else (0.4, -0.4):
        z = np.array([x, 0.7, 1.3])
        slopes = model.f(0.0, z[:1], z[1:])[0, 1:]
        for slope, step in zip(slopes, 1e-5 * np.eye(3), strict=True):
            up, down = (model.f(0.0, p[:1], p[1:])[0, 0] for p in (z + step, z - step))
            assert slope == pytest.approx((up - down) / 2e-5, rel=1e-7, abs=1e-9)


def test_names_of_sympy_python_and_numpy_are_free():
    names = ["lambda", "E", "I", "N", "S", "beta", "gamma", "zeta", "pi", "v0", "x0", "import", "array", "θ"]
    rate, estimate = " + ".join(f"{name}*Q" for name in names), dict.fromkeys(names, 1.0)
    model = ode_model({"Q": rate}, initial={"Q": 1}, estimate=estimate)
    assert model.f(0.0, [2.0], model.start)[0, 0] == 2 * len(names)
    assert written_out(model, 0).one([0.0, 2.0, *model.start]) == 2 * len(names)
    assert model.linear_driven


@each_of(
    ("rate", "linear"),
    [
        *((rate, True) for rate in ("-a*x + a**2", "sin(a)*x", "-a*x + u", "-a*x - sign(a)")),
        *((rate, False) for rate in ("-a*x + cos(t)", "-t*a*x", "-a*x**2", "-a*x - sign(x)")),
        *((rate, False) for rate in ("-a*x - sign(t)", "-a*x - sign(u)")),
    ],
)
def test_linear_only_with_constant_coefficients(rate, linear):
    outputs = {"y": "x + u"}
    model = ode_model({"x": rate}, initial={"x": 1}, outputs=outputs, estimate={"a": 1.0}, inputs=["u"])
    assert model.linear_driven is linear


@each_of(
    ("changes", "message"),
    [
        ({"states": {"x": "-a*x +"}}, r"state x: '-a\*x \+', character 7"),
        ({"states": {"x": "-a*z"}}, "state x: '-a\\*z': z is not defined here"),
        ({"states": {"x": "-alpha1*x"}, "estimate": {"alpha": 1.0}}, "did you mean 'alpha'"),
        ({"states": {"t": "-a"}, "initial": {"t": 1}}, "state t: t is the time"),
        ({"states": {"sin": "-a"}, "initial": {"sin": 1}}, "state 'sin' is no name"),
        ({"initial": {}}, "initial: the value of the state x is missing"),
        ({"initial": {"x": 1, "z": 2}}, "initial: z is no state; states are x"),
        ({"initial": {"x": "t"}}, "initial x: 't': t is not defined here; it may use a"),
        ({"initial": {"x": float("nan")}}, "initial x: its value must be a finite number"),
        ({"estimate": {"x": 1.0}}, "parameter x: x is already a state"),
        ({"estimate": {"a": float("inf")}}, "a: its value must be a finite number"),
        ({"known": {"a": 1.0}}, "known value a: a is already a parameter"),
        ({"known": {"k": "2"}}, "k: its value must be a finite number"),
        ({"states": {"x": "a/k"}, "known": {"k": 0}}, "state x: 'a/k' has no finite real value"),
        ({"inputs": ["a"]}, "input a: a is already a parameter"),
        ({"inputs": ["u", "u"]}, "input u: u is already given"),
        ({"outputs": {"y 1": "x"}}, "output 'y 1' is no name"),
        ({"outputs": {"y": "x + w"}}, "output y: 'x \\+ w': w is not defined here"),
        ({"bounds": {"b": (0, 1)}}, "bounds: b is no parameter; parameters are a"),
        ({"bounds": {"a": (2, 1)}}, "bounds of a: the lower one, 2, must be below"),
        ({"bounds": {"a": (2, 3)}}, "bounds of a: the starting value 1 is outside 2 … 3"),
        ({"states": {}, "initial": {}}, "a model needs states, or outputs"),
    ],
)
def test_bad_models_are_refused_with_the_place(changes, message):
    options = {"states": {"x": "-a*x"}, "initial": {"x": 1.0}, "estimate": {"a": 1.0}} | changes
    with pytest.raises(ValueError, match=message):
        ode_model(options.pop("states"), **options)


@each_of(
    ("arguments", "message"),
    [
        (([0, 2, 1],), "the times must increase, but t = 1 in row 3 follows 2"),
        (([0, 1, 1],), "the times must increase, but t = 1 in row 3 follows 1"),
        (([0, np.nan, 1],), "the times: the value in row 2 is nan"),
        (([],), "no samples"),
        (([[0, 1]],), "one column"),
        ((["a", "b"],), "must be numbers"),
        (([0, 1], {"y": [1]}), "y must be one column of a number for each time"),
        (([0, 1], {"y": [1, np.inf]}), "y: the value in row 2 is inf"),
        (([0, 1], {}, {"u": [1, np.nan]}), "u: the value in row 2 is nan"),
        (([0, 1], {"y": [1, 2]}, {}, {"y": 0.0}), "deviation of y must be above 0"),
        (([0, 1], {"y": [1, 2]}, {}, {"y": [1.0, 2.0, 3.0]}), "one column of a number for each time"),
        (([0, 1], {"y": [1, 2]}, {}, {"z": 1.0}), "z, which is no output"),
    ],
)
def test_bad_records_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        Record(*arguments)


# Second-order systems from matrices


MATRICES = [["m1", "a"], ["a", 18.0]], [["c1 + c2", "-c2"], ["-c2", "c2"]], np.array([[2.0, -1], [-1, 1.5]])
COMMON = {"estimate": {"m1": 12.0, "c1": 0.14, "a": 1.5, "start": 0.5}, "known": {"c2": 0.3}}
STATE = {"y1": "start", "v_y2": -0.2}


def by_hand(force="0"):
    """The same with the mass matrix inverted on paper."""
    r1 = f"({force} - (c1 + c2)*v_y1 + c2*v_y2 - 2*y1 + y2)"
    r2 = "(c2*v_y1 - c2*v_y2 + y1 - 1.5*y2)"
    first, second = (f"({p} - a*{q})/(18*m1 - a**2)" for p, q in ((f"18*{r1}", r2), (f"m1*{r2}", r1)))
    states = {"y1": "v_y1", "v_y1": first, "y2": "v_y2", "v_y2": second}
    outputs = {"y1": "y1", "y2": "y2"}
    return ode_model(states, initial={"v_y1": 0, "y2": 0, **STATE}, outputs=outputs, **COMMON)


def test_forces_of_time_inputs_and_states():
    t = np.linspace(0, 5, 11)
    model = second_order(*MATRICES, initial=STATE, force={"y1": "u*cos(t) - y1**3"}, inputs=["u"], **COMMON)
    run = simulate(model, model.start, Record(t, inputs={"u": np.full(11, 0.7)}))
    plain = simulate(by_hand("(0.7*cos(t) - y1**3)"), model.start, t)
    np.testing.assert_allclose(run.y, plain.y, atol=1e-9)
    np.testing.assert_allclose(run.y_theta, plain.y_theta, atol=1e-8)


def test_names_and_rest_by_default():
    model = second_order([[2.0]], [["d"]], [[8.0]], estimate={"d": 0.1}, names=["tip"], force={"tip": 4})
    assert (model.states, model.outputs) == (("tip", "v_tip"), ("tip",))
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
