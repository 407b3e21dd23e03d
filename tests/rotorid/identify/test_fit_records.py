"""Fits to records by every method: [Q], [F], starts far off, steps of Gauss–Newton, starts in the record."""

from dataclasses import replace

import numpy as np
import pytest
from cases import each_of
from repetitions import FULL
from timedomain_cases import (
    CHAIN_ERRORS,
    CHAIN_OPTIMUM,
    chain,
    chain_record,
    decay,
    decay_record,
)

from rotorid.base.choices import names
from rotorid.files import read_ode_model, read_record
from rotorid.identify.fit_records import METHODS, fit
from rotorid.identify.ode import ode_model
from rotorid.identify.records import Record
from rotorid.identify.simulation import simulate
from rotorid.samples import sample_data

FOLDER = sample_data() / "fit" / "three_masses"
EVERY_METHOD = pytest.mark.parametrize("method", names(METHODS))


def curve(output, estimate, y, t, **options):
    """The fit of a curve without states."""
    model = ode_model({}, outputs={"y": output}, estimate=estimate, bounds=options.pop("bounds", None))
    return fit(model, Record(t, {"y": y}), **options)


@EVERY_METHOD
@pytest.mark.parametrize("integrator", ["auto", "dop853", "lsoda"])
def test_three_masses_with_each_method(method, integrator):
    result = fit(chain(), chain_record(), method=method, integrator=integrator)
    assert result.converged
    assert integrator in (result.integrator, "auto")
    assert result.values == pytest.approx(CHAIN_OPTIMUM, rel=1e-7)
    assert result.std == pytest.approx(CHAIN_ERRORS, rel=0.05)
    if method in ("gauss-newton", "quasilinearization"):
        assert result.iterations <= 6
    (warning,) = result.warnings  # the record is rounded to five digits, whatever the size of a value
    assert "the outputs have different errors" in warning


def as_f_prints(record, beta):
    """[F] step by step: (3.1) to (3.3) and sensitivities (3.7) by the printed Runge–Kutta, and Δβ."""
    c2, c3, c4, m3 = 0.3, 0.2, 0.12, 18.0
    y = np.stack(list(record.outputs.values()), axis=1)

    def f(z):
        c1, m1, m2 = beta
        A, by_beta, x = np.zeros((6, 6)), np.zeros((6, 3)), z[:, 0]
        A[0, 1] = A[2, 3] = A[4, 5] = 1.0
        A[1, [0, 2]] = -(c2 + c1) / m1, c2 / m1
        A[3, [0, 2, 4]] = c2 / m2, -(c2 + c3) / m2, c3 / m2
        A[5, [2, 4]] = c3 / m3, -(c4 + c3) / m3
        by_beta[1, :2] = -x[0] / m1, -(A[1] @ x) / m1
        by_beta[3, 2] = -(A[3] @ x) / m2
        return np.column_stack([A @ x, A @ z[:, 1:] + by_beta])

    while True:
        yield beta
        z = [np.column_stack([y[0], np.zeros((6, 3))])]  # y(t0) of the record, U(t0) = 0
        for h in np.diff(record.t):
            k1 = h * f(z[-1])
            k2 = h * f(z[-1] + k1 / 2)
            k3 = h * f(z[-1] + k2 / 2)
            z.append(z[-1] + (k1 + 2 * k2 + 2 * k3 + h * f(z[-1] + k3)) / 6)
        x, U = np.array(z)[:, :, 0], np.array(z)[:, :, 1:]
        normal = np.einsum("tij,tik->jk", U, U)
        beta = beta + np.linalg.solve(normal, np.einsum("tij,ti->j", U, y - x))


def test_the_algorithm_of_f_step_by_step():
    """The same parameters after every step, from the printed start; y(t0) is exact in this record."""
    model = read_ode_model(FOLDER / "model.toml")
    record = read_record(FOLDER / "record.csv", model)
    result = fit(model, record, method="gauss-newton", integrator="rk4")
    expected = as_f_prints(record, np.array([0.1, 11.0, 23.0]))
    for ours, theirs in zip(result.history, expected, strict=False):
        np.testing.assert_allclose(ours, theirs, rtol=1e-9)
    assert result.history[-1] == pytest.approx([0.14, 12.0, 28.0], rel=1e-5)


def test_the_best_of_several_starts_counts():
    t = np.linspace(0, 10, 101)
    given = "sin(w*t)", {"w": 5.0}, np.sin(2 * t), t
    assert not curve(*given, bounds={"w": (0.5, 8.0)}).reliable
    result = curve(*given, bounds={"w": (0.5, 8.0)}, starts=12)
    assert result.values == pytest.approx([2.0], abs=1e-8)
    assert result.warnings == ()


def test_another_minimum_that_is_as_good_is_said():
    """y = a² t does not tell the sign of a."""
    t, noise = np.linspace(0.1, 3, 30), 0.01 * np.random.default_rng(0).standard_normal(30)
    result = curve("a**2*t", {"a": 1.0}, 4 * t + noise, t, bounds={"a": (-5.0, 5.0)}, starts=8)
    assert abs(result.values[0]) == pytest.approx(2.0, rel=0.01)
    assert result.warnings[0].startswith(f"another start ends at a = {-result.values[0]:.6g}")


def test_robust_loss_resists_gross_errors():
    record = decay_record()
    record.outputs["x"][[5, 17, 30]] += 3.0
    assert np.abs(fit(decay(), record).values - [0.8, 2.0]).max() > 0.05
    assert np.abs(fit(decay(), record, loss="huber").values - [0.8, 2.0]).max() < 0.02


@EVERY_METHOD
def test_measured_inputs_curves_and_combinations_by_each_method(method):
    model = ode_model({"x": "-a*x + b*u"}, initial={"x": 0.0}, inputs=["u"], estimate={"a": 1.0, "b": 1.0})
    t = np.linspace(0, 5, 51)
    record = Record(t, {"x": 1.5 / 4 * (2 * t - 1 + np.exp(-2 * t))}, {"u": t})
    assert fit(model, record, method=method).values == pytest.approx([2.0, 1.5], rel=1e-6)
    y, start = 2.0 * np.exp(-0.8 * t) + 0.3, {"a": 1.5, "b": 0.5, "c": 0.0}
    assert curve("a*exp(-b*t) + c", start, y, t, method=method).values == pytest.approx([2, 0.8, 0.3])
    model = ode_model({"x": "-(a + b)*x"}, initial={"x": 2.0}, estimate={"a": 0.3, "b": 0.3})
    result = fit(model, decay_record(), method=method)
    assert np.isnan(result.values).all()
    (combination,) = result.estimate.combinations
    assert combination.words == "a + b"
    assert combination.value == pytest.approx(0.8, abs=0.02)


@EVERY_METHOD
def test_as_many_readings_as_parameters_give_no_interval(method, tmp_path):
    """Initial values that are known fix the first sample, which is no degree of freedom then."""
    (tmp_path / "one.toml").write_text('[states]\nx = "-a*x"\n[initial]\nx = 1.0\n[estimate]\na = 0.5\n')
    (tmp_path / "one.csv").write_text("t_s,x\n0,1.0\n1,0.37\n")
    model = read_ode_model(tmp_path / "one.toml")
    result = fit(model, read_record(tmp_path / "one.csv", model), method=method)
    assert (result.std, result.estimate.dof) == (None, 0)
    assert result.values == pytest.approx([-np.log(0.37)], rel=1e-8)
    assert "no intervals: no errors are stated and there are no more equations" in result.summary()
    two = ode_model({"x": "-a*x + b"}, initial={"x": 1.0}, estimate={"a": 0.6, "b": 0.1})
    y = simulate(two, [0.8, 0.2], [0.0, 0.3, 0.9], sensitivities=False).y[:, 0]
    result = fit(two, Record([0.0, 0.3, 0.9], {"x": y}), method=method)
    assert (result.std, result.estimate.dof, result.converged) == (None, 0, True)


@EVERY_METHOD
def test_what_did_not_converge_has_no_intervals_and_says_nothing_of_what_is_determined(method):
    start = {"a": 3.0, "b": -4.0} if FULL else {"a": 2.0, "b": -0.5}
    model = ode_model({"x": "-a*x**2 + sin(b*x)"}, initial={"x": 1.0}, estimate=start)
    t = np.linspace(0.0, 4.0, 51)
    result = fit(model, Record(t, {"x": np.exp(-t)}, sigma={"x": 0.01}), method=method, max_iterations=1)
    assert result.std is None
    document = result.to_dict()["parameters"].values()
    assert all(part["ci95"] is None and part["std"] is None for part in document)
    assert "determined" not in result.summary()


@each_of(
    ("record", "options", "words"),
    [
        (decay_record(), {"method": "newton"}, "method 'newton' is not known"),
        (decay_record(), {"start": {"z": 1.0}}, "z is no parameter"),
        (decay_record(), {"starts": 0}, "at least 1"),
        (decay_record(), {"loss": "square"}, "loss 'square' is not known"),
        (decay_record(), {"method": "quasilinearization", "loss": "huber"}, "no robust loss"),
        (decay_record(), {"method": "quasilinearization", "integrator": "rk4"}, "heun"),
        (decay_record(), {"method": "gauss-newton", "tolerance": 0.0}, "the tolerance is a number above 0"),
        (decay_record(), {"method": "gauss-newton", "tolerance": np.nan}, "tolerance is a number above 0"),
        (Record([0, 1, 2], {"z": [0, 1, 2]}), {}, "no output of the model"),
        (Record([0, 1, 2]), {}, "no samples"),
        (Record([0, 1, 2], {"x": [np.nan] * 3}), {}, "no samples"),
        ([], {}, "at least one record"),
        ([decay_record(), decay_record(sigma={"x": 1.0})], {}, "for all measured outputs, or for none"),
    ],
)
def test_what_cannot_be_fitted_is_refused(record, options, words):
    with pytest.raises(ValueError, match=words):
        fit(decay(), record, **options)


def test_parameter_at_its_bound():
    result = fit(decay(bounds={"a": (0.0, 0.7)}), decay_record())
    assert (result.at_bounds, result.values[0]) == (("a",), 0.7)
    assert any("stands at its bound" in text for text in result.warnings)


def test_every_record_has_its_own_initial_state():
    rng, records = np.random.default_rng(4), []
    for t, x0 in ((np.linspace(0, 3, 31), 2.0), (np.linspace(1, 5, 21), 1.0)):
        x = x0 * np.exp(-0.8 * (t - t[0])) + 0.01 * rng.standard_normal(len(t))
        records.append(Record(t, {"x": x}, name=f"run {x0}"))
    model = ode_model({"x": "-a*x"}, initial={"x": "x0"}, estimate={"a": 0.5, "x0": 1.5}, per_record=["x0"])
    for method in names(METHODS):
        result = fit(model, records, method=method)
        assert result.parameters == ("a", "x0_1", "x0_2")
        assert result.converged
        assert (np.abs(result.values - [0.8, 2.0, 1.0]) < 4 * result.std).all()
    bounds = np.array([[-np.inf, np.inf], [0.0, 1.9]])
    assert fit(replace(model, bounds=bounds), records, start={"x0": 1.0}).at_bounds == ("x0_1",)
    assert fit(model, records[0]).parameters == ("a", "x0")


# Steps of Gauss–Newton and quasilinearization


def decaying(noise, method="gauss-newton", **options):
    """x = e^−t, with normal errors of this size; the start is a = 0.5."""
    t = np.linspace(0.0, 4.0, 41)
    y = np.exp(-t) + noise * np.random.default_rng(3).standard_normal(len(t))
    model = ode_model({"x": "-a*x"}, initial={"x": 1.0}, estimate={"a": 0.5})
    return fit(model, Record(t, {"x": y}), method=method, **options)


@pytest.mark.parametrize("method", ["gauss-newton", "quasilinearization"])
@pytest.mark.parametrize("tolerance", [0.3, 0.03])
def test_epsilon_ends_at_the_first_step_or_integral_below_it(method, tolerance):
    """[F] step 5: Δβ < ε, or I(β) < ε."""
    every, result = decaying(0.2, method), decaying(0.2, method, tolerance=tolerance)
    steps = np.abs(np.diff(every.history[:, 0]))
    first = next(k for k, step in enumerate(steps, 1) if step < tolerance or every.integrals[k] < tolerance)
    assert result.iterations == first
    assert result.stopped_by == ("step" if steps[first - 1] < tolerance else "cost")
    np.testing.assert_array_equal(result.history[:, 0], every.history[: first + 1, 0])


def test_the_integral_has_its_step():
    """I(β) of [F]: the sum of squares times Δt = 0.1, the exact first sample apart."""
    result = decaying(0.2)
    r = result.simulations[0].x[:, 0] - result.records[0].outputs["x"]
    assert result.integrals[-1] == pytest.approx(0.1 * float(r[1:] @ r[1:]), rel=1e-12)
    assert len(result.integrals) == len(result.history) == result.iterations + 1


def test_a_stop_far_from_the_minimum_is_no_estimate():
    coarse, fine = decaying(0.01, tolerance=0.45), decaying(0.01, tolerance=1e-5)
    assert (coarse.converged, coarse.std) == (False, None)
    assert "the next step still matters; lower --tolerance" in coarse.message
    assert fine.converged
    assert abs(fine.values[0] - decaying(0.01).values[0]) < 0.1 * fine.std[0]


def test_quasilinearization_of_several_records_with_gaps_and_uneven_times():
    record, gaps = decay_record(), decay_record()
    gaps.outputs["x"][3:9] = np.nan
    for records in (record, [record, gaps]):
        one, other = (fit(decay(), records, method=m) for m in ("quasilinearization", "levenberg-marquardt"))
        assert one.values == pytest.approx(other.values, rel=1e-7)
        assert one.std == pytest.approx(other.std, rel=1e-5)
    assert len(one.estimate.residuals) == 2 * 41 - 6
    uneven = Record(np.delete(record.t, [3, 4, 10]), {"x": np.delete(record.outputs["x"], [3, 4, 10])})
    for integrator in ("heun", "sequential-heun"):
        result = fit(decay(), uneven, method="quasilinearization", integrator=integrator)
        # at the minimum the trajectory is the solution by the same scheme
        np.testing.assert_allclose(result.trajectories[-1][0], result.simulations[0].x, rtol=1e-7)
    model = ode_model({"x": "a*x**2"}, initial={"x": 1.0}, estimate={"a": 5.0})
    with pytest.raises(ValueError, match="diverge"):
        fit(model, Record(np.linspace(0, 1, 21), {"x": np.ones(21)}), method="quasilinearization")


# Initial states from the record: `[initial] x = "record"`


FROM_RECORD = {"x": "record", "v": "record"}
TIMES = np.linspace(0.0, 3.0, 16)


def oscillator(initial, **options):
    options = {"outputs": {"x": "x", "v": "v"}, "estimate": {"k": 3.5, "d": 0.3}} | options
    return ode_model({"x": "v", "v": "-k*x - d*v"}, initial=initial, **options)


def drawn(seed, sigma=None):
    exact = simulate(oscillator({"x": 1.0, "v": 0.5}), [4.0, 0.4], TIMES, sensitivities=False).y
    y = exact + 0.05 * np.random.default_rng(seed).standard_normal(exact.shape)
    return Record(TIMES, {"x": y[:, 0], "v": y[:, 1]}, sigma=sigma and {"x": sigma, "v": sigma})


def without(record, name, at=0):
    """The record without a sample."""
    outputs = {n: y.copy() for n, y in record.outputs.items()}
    outputs[name][at] = np.nan
    return replace(record, outputs=outputs)


def test_the_sample_counts_once():
    """The same as a parameter by hand: one row of the first sample, no prior; without it less is sure."""
    record = drawn(1, 0.05)
    unknown = oscillator({"x": "x_0", "v": "v_0"}, estimate={"k": 3.5, "d": 0.3, "x_0": 1.1, "v_0": 0.6})
    by_hand, result = fit(unknown, record), fit(oscillator(FROM_RECORD), record)
    assert result.parameters == by_hand.parameters
    assert result.values == pytest.approx(by_hand.values, rel=1e-7)
    assert result.std == pytest.approx(by_hand.std, rel=1e-7)
    assert result.estimate.dof == by_hand.estimate.dof == 2 * 16 - 4
    lost = fit(unknown, without(without(record, "x"), "v"))
    assert (result.std < lost.std).all()


def test_starts_of_several_records_of_one_state_and_given():
    records = [drawn(3), Record(TIMES + 7.0, drawn(4).outputs, name="b")]
    result = fit(oscillator(FROM_RECORD), records, method="gauss-newton")
    assert result.parameters == ("k", "d", "x_0_1", "x_0_2", "v_0_1", "v_0_2")
    firsts = [records[k].outputs[name][0] for name in ("x", "v") for k in range(2)]
    np.testing.assert_array_equal(result.history[0], [3.5, 0.3, *firsts])
    result = fit(oscillator(FROM_RECORD), drawn(5), start={"x_0": 2.0}, method="gauss-newton")
    np.testing.assert_array_equal(result.history[0, 2:], [2.0, drawn(5).outputs["v"][0]])
    result = fit(oscillator({"x": "record", "v": 0.5}), drawn(6))
    assert result.parameters == ("k", "d", "x_0")
    assert result.estimate.dof == 2 * 16 - 1 - 3  # the first sample of v tells nothing


@each_of(
    ("options", "words"),
    [
        ({"known": {"x_0": 2.0}}, "known value x_0: x_0 is already a parameter"),
        ({"outputs": {"x": "x"}}, 'initial v: "record" needs an output that is v alone'),
        ({"outputs": {"x": "1000*x", "v": "v"}}, 'initial x: "record" needs an output that is x alone'),
        ({"outputs": {"x": "x + 0.1", "v": "v"}}, 'initial x: "record" needs an output that is x alone'),
    ],
)
def test_a_state_that_no_output_measures_by_itself_is_refused(options, words):
    with pytest.raises(ValueError, match=words):
        oscillator(FROM_RECORD, **options)


def test_what_a_record_does_not_give_is_refused(tmp_path):
    text = (FOLDER / "from_record.toml").read_text()
    path = tmp_path / "model.toml"
    for changed, words in (
        (text + "\n[nuisance]\noffset = true\n", 'initial y1: "record" needs an output that is y1 alone'),
        (text.replace('y1 = "record"', 'y1 = "measured"'), "measured is not defined here"),
    ):
        path.write_text(changed)
        with pytest.raises(ValueError, match=words) as stop:
            read_ode_model(path)
        assert len(str(stop.value).splitlines()) <= 2
    model, x = oscillator(FROM_RECORD), drawn(7).outputs["x"]
    for record, name in ((without(drawn(7), "x"), "x"), (Record(TIMES, {"x": x}), "v")):
        with pytest.raises(ValueError, match=f"{name} has no sample at the first time"):
            fit(model, record)
    with pytest.raises(ValueError, match="finite numbers"):
        simulate(model, model.start, TIMES)
