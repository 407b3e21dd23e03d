"""Simulation and sensitivities: closed forms, differences, orders, and what diverges."""

import time

import numpy as np
import pytest
from repetitions import FULL
from timedomain_cases import book_model

from rotorid.identify.fit_records import fit
from rotorid.identify.ode import SimulationError, ode_model
from rotorid.identify.records import Record
from rotorid.identify.simulation import simulate

ADAPTIVE, STEPS = ("auto", "dop853", "lsoda"), ("heun", "sequential-heun", "rk4")


def chain():
    """Three masses between springs of stiffness 1, as [F]."""
    return ode_model(
        {
            "y1": "v1", "v1": "(-c1*v1 + c2*(v2 - v1) - 2*y1 + y2)/m1",
            "y2": "v2", "v2": "(-c2*(v2 - v1) + c3*(v3 - v2) + y1 - 2*y2 + y3)/m2",
            "y3": "v3", "v3": "(-c3*(v3 - v2) - c4*v3 + y2 - 2*y3)/m3",
        },
        initial={"y1": 0.5, "v1": 0.1, "y2": -0.2, "v2": -0.1, "y3": 0.3, "v3": 0.1},
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


def one_state(rate, start=1.0, **options):
    return ode_model({"x": rate}, initial={"x": start}, **options)


def differences(model, theta, t, h=1e-3, **options):
    """Derivatives of states and outputs by the parameters: central differences of sixth order."""

    def run(moved):
        one = simulate(model, moved, t, sensitivities=False, **options)
        return np.hstack([one.x, one.y])

    weights = ((1, 45 / 60), (2, -9 / 60), (3, 1 / 60))
    return np.stack(
        [
            sum(w * (run(theta + k * step) - run(theta - k * step)) / h for k, w in weights)
            for step in h * np.eye(len(theta))
        ],
        axis=-1,
    )


@pytest.mark.parametrize("integrator", [*ADAPTIVE, *STEPS])
@pytest.mark.parametrize("make", [book_model, chain, pendulum])
def test_sensitivities_against_differences(make, integrator):
    """Those of Heun and Runge–Kutta are the derivatives of the scheme itself."""
    model, t = make(), np.linspace(0, 4, 41)
    theta = np.array([1.0, -1.0, -1.0]) if make is book_model else model.start
    run = simulate(model, theta, t, integrator=integrator, rtol=1e-12)
    smooth = "dop853" if integrator == "lsoda" else integrator  # its errors are not smooth enough
    slopes = differences(model, theta, t, integrator=smooth, rtol=1e-12)
    np.testing.assert_allclose(np.concatenate([run.S, run.y_theta], 1), slopes, atol=3e-8)
    plain = simulate(model, theta, t, integrator=integrator, rtol=1e-12, sensitivities=False)
    np.testing.assert_allclose(plain.x, run.x, atol=1e-8)
    assert plain.S.shape[2] == plain.y_theta.shape[2] == 0


@pytest.mark.parametrize("begin", [1e3, 1.7e9])
def test_time_stamps_far_from_zero_cost_no_more_than_their_digits(begin):
    """Steps between such times are rounded; the error of one must not add up over the record."""
    model = ode_model({"x": "v", "v": "-1e4*x - a*v"}, initial={"x": 1, "v": 0}, estimate={"a": 2.0})
    t = begin + 1e-3 * np.arange(1001)
    run = simulate(model, [2.0], t)
    passed, w = t - t[0], np.sqrt(1e4 - 1)
    assert run.integrator == "expm"
    x = np.exp(-passed) * (np.cos(w * passed) + np.sin(w * passed) / w)
    np.testing.assert_allclose(run.x[:, 0], x, atol=2e-16 * begin * w + 1e-10)


def test_the_closed_form_of_q_and_orders_of_fixed_steps():
    model, theta, w = book_model(), [1, -1, -1], np.sqrt(3) / 2
    for integrator, order in ((None, None), ("heun", 2), ("sequential-heun", 2), ("rk4", 4)):
        errors = []
        for n in (40, 80, 160):
            t = np.linspace(0, np.pi, n + 1)
            wave = 1.5 * np.cos(w * t) + w * np.sin(w * t)
            turned = -1.5 * w * np.sin(w * t) + w**2 * np.cos(w * t)
            exact = np.stack([np.sin(t), np.cos(t)], 1)
            exact += np.exp(-t / 2)[:, None] * np.stack([wave, turned - wave / 2], 1)
            accurate = simulate(model, theta, t, rtol=1e-12)
            np.testing.assert_allclose(accurate.x, exact, atol=1e-9)
            np.testing.assert_allclose(accurate.y, exact @ [[1, 2], [2, 1]], atol=3e-9)
            if integrator:
                run = simulate(model, theta, t, integrator=integrator)
                errors.append([np.abs(run.x - exact).max(), np.abs(run.S - accurate.S).max()])
        if integrator:
            np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), order, atol=0.1)


@pytest.mark.parametrize("sequential", [False, True])
def test_heun_is_the_scheme_of_the_reference(sequential):
    """By hand; in sequence, x2 is from the prediction and the new x1."""
    t, (a, b) = np.linspace(0, np.pi, 31), (1.5, 1.0)
    run = simulate(book_model(), [1.0, -1.0, -1.0], t, integrator="sequential-heun" if sequential else "heun")
    for i, h in enumerate(np.diff(t)):
        rate = b, -a - b + np.cos(t[i])
        first, second = a + h * rate[0], b + h * rate[1]
        a = a + h / 2 * (rate[0] + second)
        b = b + h / 2 * (rate[1] - (a if sequential else first) - second + np.cos(t[i + 1]))
        np.testing.assert_allclose(run.x[i + 1], [a, b], rtol=1e-13, atol=1e-15)


@pytest.mark.parametrize("integrator", ["dop853", "lsoda", "expm"])
def test_measured_inputs_are_straight_lines_between_samples(integrator):
    """dx/dt = −a x + b u with a triangle as u, whose corners no step may cross."""
    t, u = np.array([0.0, 1.0, 1.5, 4.0]), [0, 2, 0, 0]
    model = one_state("-a*x + b*u", 0, estimate={"a": 0.7, "b": 1.3}, inputs=["u"])
    run = simulate(model, [0.7, 1.3], Record(t, inputs={"u": u}), integrator=integrator)
    a, expected = 0.7, [0.0]
    for h, u0, u1 in zip(np.diff(t), u, u[1:], strict=False):
        e, k = np.exp(-a * h), (u1 - u0) / h
        expected.append(expected[-1] * e + 1.3 * (u0 * (1 - e) / a + k * (h / a - (1 - e) / a**2)))
    np.testing.assert_allclose(run.x[:, 0], expected, atol=1e-10)
    np.testing.assert_allclose(run.S[:, 0, 1], np.array(expected) / 1.3, atol=1e-10)


def test_driven_linear_models_are_solved_exactly(monkeypatch):
    """Two inputs, a constant, uneven times: as the integration that stops at every sample; also in pieces."""
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
    monkeypatch.setattr("rotorid.identify.integrators.BATCH", 400)
    pieces = simulate(model, model.start, record)
    for name in ("x", "S"):
        values = getattr(exact, name)
        np.testing.assert_allclose(getattr(integrated, name), values, atol=1e-9)
        np.testing.assert_allclose(getattr(pieces, name), values, rtol=0, atol=1e-13)


def test_inputs_in_outputs_alone_and_curves_without_states():
    options = {"estimate": {"a": 1.0, "g": 2.0}, "inputs": ["u"], "outputs": {"y": "x + g*u"}}
    run = simulate(one_state("-a*x", **options), [1.0, 2.0], Record([0, 1, 2], inputs={"u": [1.0, 2, 3]}))
    np.testing.assert_allclose(run.y[:, 0], np.exp(-np.arange(3)) + 2 * np.arange(1, 4), rtol=1e-14)
    np.testing.assert_allclose(run.y_theta[:, 0, 1], [1, 2, 3], rtol=1e-14)
    model, t = ode_model({}, outputs={"y": "a*exp(-b*t)"}, estimate={"a": 2.0, "b": 0.5}), np.arange(7)
    run = simulate(model, [2.0, 0.5], t)
    np.testing.assert_allclose(run.y_theta[:, 0, 1], -2 * t * np.exp(-t / 2), rtol=1e-14)
    assert (run.integrator, run.x.shape, run.S.shape) == ("none", (7, 0), (7, 0, 2))


@pytest.mark.parametrize("stiffness", [300.0, 1000.0])
def test_stiff_models_change_to_lsoda_by_themselves(stiffness):
    """On the slow branch of van der Pol, to first order in 1/k²: log x − x²/2 = t/k + const."""
    rates = {"x": "v", "v": "k*(1 - x**2)*v - x"}
    t = np.linspace(0, 50, 51)
    run = simulate(ode_model(rates, initial={"x": 2, "v": 0}, estimate={"k": 1}), [stiffness], t, rtol=1e-11)
    assert run.integrator == "lsoda"
    drift = np.log(run.x[1:, 0] / 2) - (run.x[1:, 0] ** 2 - 4) / 2
    np.testing.assert_allclose(drift, t[1:] / stiffness, atol=3 / stiffness**2)


@pytest.mark.parametrize(
    ("rate", "integrators"),
    [
        ("a*x**2", (*ADAPTIVE, *STEPS)),
        ("a*x", ("expm", *ADAPTIVE, *STEPS)),
        ("-exp(a*x)", ("auto", "dop853", "heun")),
        ("-a*sqrt(x - 1/2)*x**4 - 1", (*ADAPTIVE, "heun")),
    ],
)
def test_divergence_is_told_promptly_with_time_and_state(rate, integrators):
    model = ode_model({"z": "-z", "x": rate}, initial={"x": 1, "z": 1}, estimate={"a": 1000.0})
    for integrator in integrators:
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
    model = one_state("-a", outputs={"y": "log(x)"}, estimate={"a": 1.0})
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
    options = {"theta": [1, -1, -1], "record": [0, 1]} | options
    with pytest.raises(ValueError, match=message):
        simulate(book_model(), options.pop("theta"), options.pop("record"), **options)


def test_missing_inputs_are_named():
    model = one_state("-a*x + u", 0, estimate={"a": 1.0}, inputs=["u"])
    with pytest.raises(ValueError, match="run 7: the input u is missing; inputs are: w"):
        simulate(model, [1.0], Record([0, 1], inputs={"w": [1, 2]}, name="run 7"))


# The extra `rotorid[fast]`


PARTS = (
    "x", "v", "a", "b", "t", "u", "2.5", "-3", "(1/3)", "x**2", "v**3", "(3 + x)**-2", "sin(x)", "cos(t)",
    "tan(v/9)", "exp(-x)", "log(2 + x**2)", "sqrt(1 + v**2)", "tanh(v)", "sinh(a)", "cosh(b)", "asin(x/9)",
    "acos(v/9)", "atan(x)", "(1 + x**2)**b", "(1 + x**2)**(1/3)", "1/(2 + u)",
)  # fmt: skip
RATES = {"x": "v", "v": "-a*x - b*x**3 - 0.1*v"}


def drawn_rate(rng, size):
    """A rate whose state has another unit: x stands for size*x."""
    words = " ".join(f"{rng.choice(['+', '-', '*'])} {rng.choice(PARTS)}" for _ in range(rng.integers(2, 6)))
    rate = f"{size!r}*(1 {words})".replace("exp", "EXP")
    return rate.replace("x", f"(x/{size!r})").replace("EXP", "exp")


def model_of(rates, size=1.0, **options):
    estimate = {"a": 0.5, "b": 1.2, "c": -0.3}
    return ode_model(rates, initial={"x": 0.4 * size, "v": "c"}, estimate=estimate, **options)


@pytest.fixture
def heyoka():
    return pytest.importorskip("heyoka", reason="the extra rotorid[fast] (heyoka) is not installed")


@pytest.mark.full
def test_drawn_models_in_drawn_units_are_integrated_as_without_it(heyoka):
    rng, compiled, t = np.random.default_rng(1), 0, np.linspace(0.5, 1.5, 6)
    for _ in range(40 if FULL else 6):
        size = float(rng.choice((1e-6, 1.0, 1e4)))
        rates = {"x": drawn_rate(rng, size), "v": f"{drawn_rate(rng, size)}/{size!r}"}
        model, record = model_of(rates, size, inputs=["u"]), Record(t, {}, {"u": np.sin(3 * t)})
        try:
            slow = simulate(model, model.start, record, rtol=1e-12)
        except SimulationError:
            continue
        quick = simulate(model, model.start, record, integrator="taylor")
        compiled += quick.integrator == "taylor"
        for ours, theirs in ((quick.x, slow.x), (quick.S, slow.S)):
            limit = 1e-7 * np.abs(theirs).max(axis=0)
            assert (np.abs(ours - theirs).max(axis=0) <= limit).all(), rates
    assert compiled >= (20 if FULL else 3)


def test_fits_are_the_same_with_and_without(heyoka, monkeypatch):
    t, rng = np.linspace(0.0, 30.0, 301), np.random.default_rng(0)
    truth = simulate(model_of(RATES), [1.0, 0.5, 0.2], t, sensitivities=False).x
    noisy = truth + 1e-3 * rng.standard_normal(truth.shape)
    record = Record(t, dict(zip("xv", noisy.T, strict=True)))
    slow, quick = (fit(model_of(RATES), record, integrator=name) for name in ("dop853", "taylor"))
    monkeypatch.setattr("rotorid.identify.record_least_squares.worth_compiling", lambda *_: True)
    again = fit(model_of(RATES), record)
    monkeypatch.undo()
    assert (again.integrator, again.values.tobytes()) == ("taylor", quick.values.tobytes())
    np.testing.assert_allclose(quick.values, slow.values, rtol=1e-8)
    np.testing.assert_allclose(quick.std, slow.std, rtol=1e-6)
    assert quick.warnings == slow.warnings
    monkeypatch.setitem(__import__("sys").modules, "heyoka", None)
    np.testing.assert_allclose(fit(model_of(RATES), record).values, slow.values, rtol=1e-8)
    with pytest.raises(ValueError, match="needs heyoka: pip install heyoka"):
        fit(model_of(RATES), record, integrator="taylor")


def test_what_it_cannot_compile_and_what_diverges_is_said(heyoka):
    rates = {"x": "v", "v": "-a*x - 0.1*v*abs(v)"}
    with pytest.raises(ValueError, match="taylor cannot compile this model"):
        simulate(model_of(rates), [1.0, 0.5, 0.2], [0.0, 1.0], integrator="taylor")
    t, model = np.linspace(0.0, 0.9, 10), one_state("a*x**2", estimate={"a": 1.0})
    run = simulate(model, [0.6], t, integrator="taylor")
    np.testing.assert_allclose(run.x[:, 0], 1 / (1 - 0.6 * t), rtol=1e-9)
    with pytest.raises(SimulationError, match=r"diverges: at t = 0\.[89]"):
        simulate(model, [1.25], t, integrator="taylor")


def test_a_pulse_is_not_stepped_over(heyoka):
    model = one_state("a*exp(-((t - 5)/0.05)**2) - x", 0.0, estimate={"a": 1.0})
    t = np.linspace(0.0, 10.0, 101)
    runs = [simulate(model, [1.0], t, integrator=name) for name in ("dop853", "auto", "taylor")]
    assert [run.integrator for run in runs] == ["dop853", "lsoda", "taylor"]
    assert np.ptp([run.x for run in runs], axis=0).max() < 1e-9


@pytest.mark.parametrize("integrator", ["auto", "taylor"])
def test_the_same_input_gives_the_same_bytes_however_often(integrator):
    if integrator == "taylor":
        pytest.importorskip("heyoka")
    model, t = model_of(RATES), np.linspace(0.0, 10.0, 101)
    runs = [simulate(model, [1.0, 0.5, 0.2], t, integrator=integrator) for _ in range(30)]
    assert len({(one.integrator, one.S.tobytes()) for one in runs}) == 1
