"""Simulation and sensitivities: closed forms, differences, orders, and what diverges."""

from __future__ import annotations

import time

import numpy as np
import pytest

from rotorid.identify.ode import SimulationError, ode_model
from rotorid.identify.records import Record
from rotorid.identify.simulation import simulate

CHAIN_START = {"y1": 0.5, "v1": 0.1, "y2": -0.2, "v2": -0.1, "y3": 0.3, "v3": 0.1}


def q_model():
    """[Q], with its true parameters."""
    return ode_model(
        {"x1": "theta1*x2", "x2": "theta2*x1 + theta3*x2 + cos(t)"},
        initial={"x1": 1.5, "x2": 1.0},
        outputs={"y1": "x1 + 2*x2", "y2": "2*x1 + x2"},
        estimate={"theta1": 1.0, "theta2": -1.0, "theta3": -1.0},
    )


def q_solution(t):
    """Closed form of the book's notes."""
    w = np.sqrt(3) / 2
    wave, turned = 1.5 * np.cos(w * t) + w * np.sin(w * t), -1.5 * w * np.sin(w * t) + w**2 * np.cos(w * t)
    decay = np.exp(-t / 2)
    return np.stack([np.sin(t) + decay * wave, np.cos(t) + decay * (turned - wave / 2)], axis=1)


def chain():
    """Three masses between springs of stiffness 1, as [F]."""
    return ode_model(
        {
            "y1": "v1", "v1": "(-c1*v1 + c2*(v2 - v1) - 2*y1 + y2)/m1",
            "y2": "v2", "v2": "(-c2*(v2 - v1) + c3*(v3 - v2) + y1 - 2*y2 + y3)/m2",
            "y3": "v3", "v3": "(-c3*(v3 - v2) - c4*v3 + y2 - 2*y3)/m3",
        },
        initial=CHAIN_START,
        estimate={"c1": 0.14, "m1": 12.0, "m2": 28.0},
        known={"c2": 0.3, "c3": 0.2, "c4": 0.12, "m3": 18.0},
    )  # fmt: skip


def pendulum():
    return ode_model(
        {"x": "v", "v": "-a*sin(x) - d*v*abs(v) - b*x**3"},
        initial={"x": "x0", "v": 0.0},
        outputs={"y": "s*x + v**2"},
        estimate={"a": 2.0, "d": 0.1, "x0": 1.2, "s": 3.0},
        known={"b": 0.3},
    )


def oscillator(**initial):
    return ode_model(
        {"x": "v", "v": "-w**2*x - 2*d*v"},
        initial={"x": 1.0, "v": 0.0} | initial,
        outputs={"x": "x"},
        estimate={"w": 2.0, "d": 0.3},
    )


def damped(t, w, d):
    """Closed form of `oscillator`."""
    f = np.sqrt(w**2 - d**2)
    return np.exp(-d * t) * (np.cos(f * t) + d / f * np.sin(f * t))


def damped_slopes(t, w, d):
    """Its derivatives by w and d: complex steps, exact to rounding."""
    h = 1e-30
    f = damped
    return np.stack([f(t, w + 1j * h, d + 0j).imag / h, f(t, w + 0j, d + 1j * h).imag / h], axis=1)


def differences(model, theta, t, h=1e-3, **options):
    """Derivatives of states and outputs by the parameters: central differences of sixth order."""
    parts = []
    for j in range(len(theta)):
        total = [0.0, 0.0]
        for k, weight in ((1, 45 / 60), (2, -9 / 60), (3, 1 / 60)):
            for sign in (1, -1):
                moved = np.array(theta)
                moved[j] += sign * k * h
                run = simulate(model, moved, t, sensitivities=False, **options)
                total = [a + sign * weight * b / h for a, b in zip(total, (run.x, run.y), strict=True)]
        parts.append(total)
    return np.stack([x for x, _ in parts], axis=-1), np.stack([y for _, y in parts], axis=-1)


@pytest.mark.parametrize("integrator", ["auto", "dop853", "lsoda"])
def test_q_closed_form(integrator):
    t = np.linspace(0, np.pi, 31)
    run = simulate(q_model(), [1, -1, -1], t, integrator=integrator)
    np.testing.assert_allclose(run.x, q_solution(t), atol=1e-9)
    np.testing.assert_allclose(run.y, q_solution(t) @ [[1, 2], [2, 1]], atol=3e-9)
    assert run.integrator == ("lsoda" if integrator == "lsoda" else "dop853")


@pytest.mark.parametrize("integrator", ["expm", "dop853", "lsoda"])
def test_damped_oscillator_and_its_sensitivities(integrator):
    t = np.linspace(0, 12, 61)
    run = simulate(oscillator(), [2.0, 0.3], t, integrator=integrator)
    tolerance = 1e-13 if integrator == "expm" else 1e-8
    np.testing.assert_allclose(run.x[:, 0], damped(t, 2.0, 0.3), atol=tolerance)
    np.testing.assert_allclose(run.y_theta[:, 0], damped_slopes(t, 2.0, 0.3), atol=tolerance)


@pytest.mark.parametrize("integrator", ["auto", "dop853", "lsoda", "heun", "sequential-heun", "rk4"])
@pytest.mark.parametrize("make", [q_model, chain, pendulum])
def test_sensitivities_against_differences(make, integrator):
    """Those of Heun and Runge–Kutta are the derivatives of the scheme itself."""
    model, t = make(), np.linspace(0, 4, 41)
    options = {"integrator": integrator, "rtol": 1e-12}
    run = simulate(model, model.start, t, **options)
    if integrator == "lsoda":  # its errors are not smooth enough for differences
        options["integrator"] = "dop853"
    s, y_theta = differences(model, model.start, t, **options)
    np.testing.assert_allclose(run.S, s, atol=1e-8)
    np.testing.assert_allclose(run.y_theta, y_theta, atol=3e-8)


@pytest.mark.parametrize("make", [chain, oscillator])
def test_uneven_times_do_not_matter(make):
    """Gaps, repeated and single steps: each time has the value that it has alone."""
    model = make()
    t = np.concatenate(
        [np.arange(0, 3, 0.1), [3.05, 3.2, 3.21], np.arange(5, 8, 0.2), np.sqrt(np.arange(70, 80))]
    )
    run = simulate(model, model.start, t, integrator="expm")
    for i in (5, 29, 31, 34, 45, 57):
        alone = simulate(model, model.start, t[[0, i]], integrator="expm")
        np.testing.assert_allclose(run.x[i], alone.x[1], atol=1e-13)
        np.testing.assert_allclose(run.S[i], alone.S[1], atol=1e-12)


@pytest.mark.parametrize("begin", [1e3, 1e6, 1.7e9])
def test_time_stamps_far_from_zero_cost_no_more_than_their_digits(begin):
    """Steps between such times are rounded; the error of one must not add up over the record."""
    model = ode_model({"x": "v", "v": "-1e4*x - a*v"}, initial={"x": 1, "v": 0}, estimate={"a": 2.0})
    t = begin + 1e-3 * np.arange(1001)
    run = simulate(model, [2.0], t)
    passed, w = t - t[0], np.sqrt(1e4 - 1)
    assert run.integrator == "expm"
    x = np.exp(-passed) * (np.cos(w * passed) + np.sin(w * passed) / w)
    np.testing.assert_allclose(run.x[:, 0], x, atol=2e-16 * begin * w + 1e-10)


def test_constant_rates_are_part_of_the_exact_solution():
    """A mass falling in a fluid: v = (g/c)(1 − e^{−ct}), with g and c unknown."""
    model = ode_model({"v": "g - c*v"}, initial={"v": 0}, estimate={"g": 9.81, "c": 0.5})
    t = np.linspace(1, 7, 13)
    run = simulate(model, [9.81, 0.5], t)
    e, passed = np.exp(-0.5 * (t - 1)), t - 1
    assert run.integrator == "expm"
    np.testing.assert_allclose(run.x[:, 0], 9.81 / 0.5 * (1 - e), rtol=1e-13, atol=1e-14)
    np.testing.assert_allclose(run.S[:, 0, 0], (1 - e) / 0.5, rtol=1e-13, atol=1e-14)
    slope = -9.81 / 0.25 * (1 - e) + 9.81 / 0.5 * passed * e
    np.testing.assert_allclose(run.S[:, 0, 1], slope, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize(("integrator", "order"), [("heun", 2), ("sequential-heun", 2), ("rk4", 4)])
@pytest.mark.parametrize("what", ["x", "S"])
def test_orders_of_fixed_steps(integrator, order, what):
    model = q_model()
    errors = []
    for n in (40, 80, 160):
        t = np.linspace(0, np.pi, n + 1)
        exact = getattr(simulate(model, model.start, t, rtol=1e-12), what)
        errors.append(
            np.abs(getattr(simulate(model, model.start, t, integrator=integrator), what) - exact).max()
        )
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(rates, order, atol=0.1)


def test_heun_is_the_scheme_of_the_reference():
    """By hand: z + h/2 (f(t, z) + f(t + h, z + h f(t, z)))."""
    model, t = q_model(), np.linspace(0, np.pi, 31)
    theta, x = np.array([0.5, -0.4, -0.9]), np.array([1.5, 1.0])
    run = simulate(model, theta, t, integrator="heun")
    for i, h in enumerate(np.diff(t)):
        k = model.f(t[i], x, theta)[:, 0]
        x = x + h / 2 * (k + model.f(t[i + 1], x + h * k, theta)[:, 0])
        np.testing.assert_allclose(run.x[i + 1], x, rtol=1e-13)


def test_sequential_heun_by_hand_and_its_second_order():
    """x1 from the prediction, x2 from the prediction and the new x1; towards the closed form as h²."""
    model, errors = q_model(), []
    for n in (30, 60, 120, 240):
        t = np.linspace(0, np.pi, n + 1)
        run = simulate(model, [1.0, -1.0, -1.0], t, integrator="sequential-heun")
        a, b = 1.5, 1.0
        for i, h in enumerate(np.diff(t)):
            rate = b, -a - b + np.cos(t[i])
            first, second = a + h * rate[0], b + h * rate[1]
            a = a + h / 2 * (rate[0] + second)
            b = b + h / 2 * (rate[1] - a - second + np.cos(t[i + 1]))
            assert run.x[i + 1] == pytest.approx([a, b], rel=1e-13, abs=1e-15)
            assert abs(a - first) > 0
        errors.append(np.abs(run.x - q_solution(t)).max())
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 2, atol=0.05)


@pytest.mark.parametrize("integrator", ["dop853", "lsoda", "expm"])
def test_measured_inputs_are_straight_lines_between_samples(integrator):
    """dx/dt = −a x + b u with a triangle as u, whose corners no step may cross."""
    t = np.array([0.0, 1.0, 1.5, 4.0])
    record = Record(t, inputs={"u": [0, 2, 0, 0]})
    model = ode_model({"x": "-a*x + b*u"}, initial={"x": 0}, estimate={"a": 0.7, "b": 1.3}, inputs=["u"])
    run = simulate(model, [0.7, 1.3], record, integrator=integrator)
    a, x, expected = 0.7, 0.0, [0.0]
    for h, u0, u1 in ((1.0, 0, 2), (0.5, 2, 0), (2.5, 0, 0)):
        k = (u1 - u0) / h
        e = np.exp(-a * h)
        x = x * e + 1.3 * (u0 * (1 - e) / a + k * (h / a - (1 - e) / a**2))
        expected.append(x)
    np.testing.assert_allclose(run.x[:, 0], expected, atol=1e-10)
    np.testing.assert_allclose(run.S[:, 0, 1], np.array(expected) / 1.3, atol=1e-10)


def test_driven_linear_models_are_solved_exactly():
    """Two inputs, a constant, uneven times: as the integration that stops at every sample."""
    random = np.random.default_rng(3)
    t = np.concatenate([np.arange(0, 4, 0.25), 4 + np.cumsum(random.uniform(0.1, 0.5, 10))])
    record = Record(t, inputs={"u": random.standard_normal(26), "w": random.standard_normal(26)})
    model = ode_model(
        {"x": "v", "v": "-k*x - c*v + g*u + k*w + k/2"},
        initial={"x": "s", "v": 0.2},
        estimate={"k": 4.0, "c": 0.3, "g": 1.5, "s": 0.7},
        inputs=["w", "u"],
    )
    exact = simulate(model, model.start, record)
    assert exact.integrator == "expm"
    integrated = simulate(model, model.start, record, integrator="dop853")
    np.testing.assert_allclose(exact.x, integrated.x, atol=1e-9)
    np.testing.assert_allclose(exact.S, integrated.S, atol=1e-9)


@pytest.mark.parametrize("rate", ["-k*x - c*v", "-k*x - c*v + u"])
def test_long_records_are_solved_in_pieces(rate, monkeypatch):
    """Many different steps: a few matrix exponentials at a time, with the same result."""
    t = np.cumsum(np.random.default_rng(5).uniform(0.1, 0.2, 40))
    record = Record(t, inputs={"u": np.sin(t)})
    model = ode_model(
        {"x": "v", "v": rate}, initial={"x": 1, "v": 0}, estimate={"k": 4.0, "c": 0.3}, inputs=["u"]
    )
    whole = simulate(model, model.start, record)
    monkeypatch.setattr("rotorid.identify.integrators.BATCH", 400)
    pieces = simulate(model, model.start, record)
    np.testing.assert_allclose(pieces.x, whole.x, rtol=0, atol=1e-13)
    np.testing.assert_allclose(pieces.S, whole.S, rtol=0, atol=1e-13)


def test_inputs_may_stand_in_outputs_alone():
    model = ode_model(
        {"x": "-a*x"}, initial={"x": 1}, outputs={"y": "x + g*u"}, estimate={"a": 1.0, "g": 2.0}, inputs=["u"]
    )
    run = simulate(model, [1.0, 2.0], Record([0, 1, 2], inputs={"u": [1.0, 2, 3]}))
    assert run.integrator == "expm"
    np.testing.assert_allclose(run.y[:, 0], np.exp(-np.arange(3)) + 2 * np.arange(1, 4), rtol=1e-14)
    np.testing.assert_allclose(run.y_theta[:, 0, 1], [1, 2, 3], rtol=1e-14)


def test_curves_without_states():
    model = ode_model({}, outputs={"y": "a*exp(-b*t)"}, estimate={"a": 2.0, "b": 0.5})
    t = np.linspace(0, 3, 7)
    run = simulate(model, [2.0, 0.5], t)
    np.testing.assert_allclose(run.y_theta[:, 0, 1], -2 * t * np.exp(-t / 2), rtol=1e-14)
    assert (run.integrator, run.x.shape, run.S.shape) == ("none", (7, 0), (7, 0, 2))


@pytest.mark.parametrize("integrator", ["auto", "dop853", "lsoda", "heun", "sequential-heun", "rk4"])
def test_without_sensitivities_the_states_are_the_same(integrator):
    model, t = pendulum(), np.linspace(0, 5, 21)
    plain = simulate(model, model.start, t, integrator=integrator, sensitivities=False)
    full = simulate(model, model.start, t, integrator=integrator)
    np.testing.assert_allclose(plain.x, full.x, atol=1e-8)
    assert plain.S.shape == full.S.shape
    assert not plain.S.any()
    assert not plain.y_theta.any()


@pytest.mark.parametrize("stiffness", [300.0, 1000.0])
def test_stiff_models_change_to_lsoda_by_themselves(stiffness):
    model = ode_model(
        {"x": "v", "v": "k*(1 - x**2)*v - x"}, initial={"x": 2.0, "v": 0.0}, estimate={"k": 1.0}
    )
    t = np.linspace(0, 50, 51)
    run = simulate(model, [stiffness], t)
    assert run.integrator == "lsoda"
    # on the slow branch, to first order in 1/k²: dx/dt = x/(k (1 − x²)), so log x − x²/2 = t/k + const
    x = run.x[1:, 0]
    drift = np.log(x / 2) - (x**2 - 4) / 2
    np.testing.assert_allclose(drift, t[1:] / stiffness, atol=3 / stiffness**2)


@pytest.mark.parametrize(
    ("rate", "integrator"),
    [
        *(
            ("a*x**2", integrator)
            for integrator in ("auto", "dop853", "lsoda", "heun", "sequential-heun", "rk4")
        ),
        *(
            ("a*x", integrator)
            for integrator in ("auto", "expm", "dop853", "lsoda", "heun", "sequential-heun", "rk4")
        ),
        *(("-exp(a*x)", integrator) for integrator in ("auto", "dop853", "heun")),
        *(("-a*sqrt(x - 1/2)*x**4 - 1", integrator) for integrator in ("auto", "dop853", "lsoda", "heun")),
    ],
)
def test_divergence_is_told_promptly_with_time_and_state(rate, integrator):
    model = ode_model({"z": "-z", "x": rate}, initial={"x": 1, "z": 1}, estimate={"a": 1000.0})
    begin = time.process_time()
    with pytest.raises(SimulationError, match=r"diverges: at t = [0-9.e+-]+ the state x is "):
        simulate(model, [1000.0], np.linspace(0, 20, 41), integrator=integrator)
    assert time.process_time() - begin < 2.0


@pytest.mark.full
def test_too_many_steps_end_with_an_error():
    model = ode_model({"x": "v", "v": "-w**2*x + cos(t)"}, initial={"x": 1, "v": 0}, estimate={"w": 1.0})
    begin = time.process_time()
    with pytest.raises(SimulationError, match=r"too many steps: it has come to t = [0-9.]+ only"):
        simulate(model, [1e6], [0, 100.0], integrator="dop853")
    assert time.process_time() - begin < 5.0


def test_an_output_without_value_is_an_error():
    model = ode_model({"x": "-a"}, initial={"x": 1}, outputs={"y": "log(x)"}, estimate={"a": 1.0})
    with pytest.raises(SimulationError, match=r"output y has no finite value at t = 1\.5"):
        simulate(model, [1.0], [0, 0.5, 1.5])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"integrator": "euler"}, "integrator 'euler' is not known: one of auto, expm"),
        ({"integrator": "expm"}, "expm solves linear models"),
        ({"rtol": 0.0}, "rtol must be between"),
        ({"theta": [1.0]}, "theta must be 3 finite numbers"),
        ({"theta": [1.0, np.nan, 1.0]}, "theta must be 3 finite numbers"),
        ({"record": [0, 2, 1]}, "the times must increase"),
    ],
)
def test_bad_options_are_refused(options, message):
    given_ = {"theta": [1, -1, -1], "record": [0, 1]} | options
    with pytest.raises(ValueError, match=message):
        simulate(q_model(), given_.pop("theta"), given_.pop("record"), **given_)


def test_missing_inputs_are_named():
    model = ode_model({"x": "-a*x + u"}, initial={"x": 0}, estimate={"a": 1.0}, inputs=["u"])
    with pytest.raises(ValueError, match="run 7: the input u is missing; inputs are: w"):
        simulate(model, [1.0], Record([0, 1], inputs={"w": [1, 2]}, name="run 7"))
