"""Models and records in time: what they mean, and what they refuse."""

from __future__ import annotations

import numpy as np
import pytest
from cases import each_of
from hypothesis import given, settings
from hypothesis import strategies as st

from rotorid.identify.expressions import FUNCTIONS, ExpressionError
from rotorid.identify.ode import ode_model
from rotorid.identify.records import Record


def q_model():
    return ode_model(
        {"x1": "theta1*x2", "x2": "theta2*x1 + theta3*x2 + cos(t)"},
        initial={"x1": 1.5, "x2": 1.0},
        outputs={"y1": "x1 + 2*x2", "y2": "2*x1 + x2"},
        estimate={"theta1": 1.0, "theta2": -1.0, "theta3": -1.0},
    )


def parts(model, table):
    """What it is of, and its derivatives by states and parameters."""
    n = len(model.states)
    return table[..., 0], table[..., 1 : 1 + n], table[..., 1 + n :]


def test_functions_over_many_points_have_the_shapes_promised():
    model = q_model()
    t, x = np.linspace(0, 1, 5), np.arange(10.0).reshape(5, 2)
    theta = [2.0, 3.0, 5.0]
    np.testing.assert_allclose(
        parts(model, model.f(t, x, theta))[0],
        np.stack([2 * x[:, 1], 3 * x[:, 0] + 5 * x[:, 1] + np.cos(t)], 1),
        rtol=1e-15,
    )
    np.testing.assert_array_equal(
        parts(model, model.f(t, x, theta))[1], np.broadcast_to([[0, 2], [3, 5]], (5, 2, 2))
    )
    expected = np.zeros((5, 2, 3))
    expected[:, 0, 0], expected[:, 1, 1], expected[:, 1, 2] = x[:, 1], x[:, 0], x[:, 1]
    np.testing.assert_array_equal(parts(model, model.f(t, x, theta))[2], expected)
    y, y_x, y_theta = parts(model, model.h(t, x, theta))
    np.testing.assert_array_equal(y, x @ [[1, 2], [2, 1]])
    np.testing.assert_array_equal(y_x[3], [[1, 2], [2, 1]])
    assert y_theta.shape == (5, 2, 3)
    assert not y_theta.any()
    assert model.f(0.0, [1.0, 2.0], theta).shape == (2, 6)


def test_one_point_agrees_with_many():
    model = q_model()
    theta, x = np.array([2.0, 3.0, 5.0]), np.array([0.3, -0.7])
    table = model.f(0.4, x, theta)
    np.testing.assert_allclose(table, model.f(np.array([0.4]), x, theta)[0], rtol=1e-15)
    np.testing.assert_array_equal(model.augmented(0.4, x[:, None], theta, np.zeros(0)), table[:, :1])


@pytest.mark.parametrize("function", FUNCTIONS)
def test_derivatives_of_every_function(function):
    """Against central differences, on either side of zero where the function exists."""
    model = ode_model(
        {"x": f"a*{function}(x) + b*{function}(a*x)"}, initial={"x": 1}, estimate={"a": 1.0, "b": 2.0}
    )
    for x in (0.4, -0.4):
        if x < 0 and function in ("log", "sqrt"):
            continue
        theta, h = np.array([0.7, 1.3]), 1e-5

        def f(x, theta, model=model):
            return model.f(0.0, [x], theta)[0, 0]

        slope = (f(x + h, theta) - f(x - h, theta)) / (2 * h)
        assert model.f(0.0, [x], theta)[0, 1] == pytest.approx(slope, rel=1e-7, abs=1e-9)
        for j in range(2):
            d = h * np.eye(2)[j]
            slope = (f(x, theta + d) - f(x, theta - d)) / (2 * h)
            assert model.f(0.0, [x], theta)[0, 2 + j] == pytest.approx(slope, rel=1e-7, abs=1e-9)


def test_names_of_sympy_python_and_numpy_are_free():
    names = ["lambda", "E", "I", "N", "S", "beta", "gamma", "zeta", "pi", "v0", "x0", "import", "array", "θ"]
    model = ode_model(
        {"Q": " + ".join(f"{name}*Q" for name in names)},
        initial={"Q": 1},
        estimate={name: float(i + 1) for i, name in enumerate(names)},
    )
    total = len(names) * (len(names) + 1) / 2
    assert model.f(0.0, [2.0], model.start)[0, 0] == 2 * total
    assert model.augmented(0.0, np.array([[2.0]]), model.start, np.zeros(0)) == 2 * total
    assert model.linear_driven


def test_linear_only_with_constant_coefficients():
    def made(rate, **more):
        return ode_model({"x": rate}, initial={"x": 1}, estimate={"a": 1.0}, **more)

    assert made("-a*x + a**2").linear_driven
    assert made("sin(a)*x").linear_driven
    assert not made("-a*x + cos(t)").linear_driven
    assert not made("-t*a*x").linear_driven
    assert not made("-a*x**2").linear_driven
    assert made("-a*x + u", inputs=["u"]).linear_driven
    assert not made("-a*x - sign(x)").linear_driven
    assert not made("-a*x - sign(t)").linear_driven
    assert not made("-a*x - sign(u)", inputs=["u"]).linear_driven
    assert made("-a*x - sign(a)").linear_driven
    assert made("-a*x", inputs=["u"], outputs={"y": "x + u"}).linear_driven


def test_matrices_and_their_derivatives():
    model = ode_model(
        {"x": "v", "v": "(-k*x - c*v + g*m)/m"},
        initial={"x": "x0", "v": 0.5},
        estimate={"m": 2.0, "c": 0.3, "x0": 0.1},
        known={"k": 8, "g": 9.81},
    )
    table = model.matrices([2.0, 0.3, 0.1])
    (a, *da), (b, *db) = table[:, :, :2], table[:, :, 2]
    np.testing.assert_allclose(a, [[0, 1], [-4, -0.15]], rtol=1e-15)
    np.testing.assert_allclose(b, [0, 9.81], rtol=1e-15)
    np.testing.assert_allclose(da, [[[0, 0], [2, 0.075]], [[0, 0], [0, -0.5]], np.zeros((2, 2))], rtol=1e-15)
    assert not np.any(db)
    np.testing.assert_array_equal(model.x0([2.0, 0.3, 0.1])[:, 0], [0.1, 0.5])
    np.testing.assert_array_equal(model.x0([2.0, 0.3, 0.1])[:, 1:], [[0, 0, 1], [0, 0, 0]])
    with pytest.raises(ValueError, match="not linear"):
        q_model().matrices([1, 1, 1])


def test_curve_fitting_needs_no_states():
    model = ode_model({}, outputs={"y": "a*exp(-b*t)"}, estimate={"a": 2.0, "b": 0.5})
    t = np.linspace(0, 1, 4)
    np.testing.assert_allclose(
        model.h(t, np.zeros((4, 0)), [2, 0.5])[:, 0, 0], 2 * np.exp(-0.5 * t), rtol=1e-15
    )
    assert not model.linear_driven


@each_of(
    ("changes", "message"),
    [
        ({"states": {"x": "-a*x +"}}, r"state x: '-a\*x \+', character 7"),
        ({"states": {"x": "-a*z"}}, "state x: '-a\\*z': z is not defined here"),
        ({"states": {"x": "-alpha1*x"}, "estimate": {"alpha": 1.0}}, "did you mean 'alpha'"),
        ({"states": {"x": "__import__('os').system('x')"}}, "state x: .*character 1: _ cannot stand here"),
        ({"states": {"x": "eval(x)"}}, "eval is no function"),
        ({"states": {"x": "-a*x.real"}}, "cannot stand here"),
        ({"states": {"t": "-a"}, "initial": {"t": 1}}, "state t: t is the time"),
        ({"states": {"sin": "-a"}, "initial": {"sin": 1}}, "state 'sin' is no name"),
        ({"states": {"x y": "-a"}, "initial": {"x y": 1}}, "state 'x y' is no name"),
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
    given_ = {"states": {"x": "-a*x"}, "initial": {"x": 1.0}, "estimate": {"a": 1.0}} | changes
    with pytest.raises(ValueError, match=message):
        ode_model(given_.pop("states"), **given_)


@settings(max_examples=200, deadline=None)
@given(st.text(max_size=30))
def test_any_text_is_an_expression_or_a_clear_error(text):
    try:
        model = ode_model({"x": text}, initial={"x": 1}, estimate={"a": 1.0})
    except ValueError as error:
        if "state x" not in str(error):
            raise
    else:
        assert model.states == ("x",)


def test_errors_of_expressions_keep_their_position():
    with pytest.raises(ExpressionError) as caught:
        ode_model({"x": "a*x^2"}, initial={"x": 1}, estimate={"a": 1.0})
    assert caught.value.position == 3


def test_record_keeps_missing_samples():
    record = Record([0, 1, 2], {"y": [1, np.nan, 3]}, {"u": [0, 1, 0]}, {"y": 0.1})
    assert len(record) == 3
    assert np.isnan(record.outputs["y"][1])
    assert record.outputs["y"].dtype == float


def test_record_does_not_share_what_it_was_given():
    t = np.arange(3.0)
    record = Record(t)
    t[0] = 5.0
    assert record.t[0] == 0.0


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
