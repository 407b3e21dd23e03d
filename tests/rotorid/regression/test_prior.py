"""Priors and ridges: against Bayesian linear regression in numpy, and parameters drawn from their prior."""

from dataclasses import replace

import numpy as np
import pytest

from rotorid.commands.fit import FitOptions
from rotorid.commands.fit import fit as work
from rotorid.files import read_harmonic_model, read_ode_model
from rotorid.identify import harmonic_model, identify
from rotorid.identify.amplitudes import experiments
from rotorid.identify.fit_records import fit
from rotorid.identify.ode import ode_model
from rotorid.identify.records import Record
from rotorid.samples import sample_data

T = np.linspace(0.0, 3.0, 25)
K = np.column_stack((np.ones(25), T, np.exp(-T)))
KNOWN = {"b": (-0.4, 0.3), "c": (1.5, 0.2)}
SIGMA = 0.3


def line(prior):
    model = ode_model({}, outputs={"y": "a + b*t + c*exp(-t)"}, estimate={"a": 0.0, "b": 0.0, "c": 0.0})
    return replace(model, prior=prior)


def readings(seed=1, truth=(1.0, -0.5, 1.2)):
    return K @ truth + SIGMA * np.random.default_rng(seed).standard_normal(25)


def record(y, sigma=SIGMA):
    return Record(T, {"y": y}, sigma=None if sigma is None else {"y": sigma})


def bayes(y, known=KNOWN):
    """Mean and covariance of Bayesian linear regression, from the normal matrix."""
    value, std = np.array([known.get(name, (0.0, np.inf)) for name in "abc"]).T
    C = np.linalg.inv(K.T @ K / SIGMA**2 + np.diag(std**-2))
    return C @ (K.T @ y / SIGMA**2 + value / std**2), C


@pytest.mark.parametrize("method", ["levenberg-marquardt", "gauss-newton", "quasilinearization"])
def test_a_fit_with_a_prior_is_bayesian_linear_regression(method):
    y = readings()
    found = fit(line(KNOWN), record(y), method=method)
    mean, C = bayes(y)
    assert found.values == pytest.approx(mean, rel=1e-8)
    assert found.estimate.covariance == pytest.approx(C, rel=1e-8)
    assert found.estimate.errors_stated
    assert found.reliable
    # chi-square and degrees of freedom are those of the data, whatever the prior says
    assert found.estimate.chi_square == pytest.approx(np.linalg.lstsq(K, y, None)[1][0] / SIGMA**2, rel=1e-8)
    assert found.estimate.dof == 22
    shares = 1 - np.diag(C)[1:] / np.array([0.3, 0.2]) ** 2
    assert found.prior.share == pytest.approx(shares, rel=1e-8)
    # what the data pay for: the trace of their hat matrix
    assert 1 + shares.sum() == pytest.approx(np.trace(K @ C @ K.T) / SIGMA**2, rel=1e-10)
    for i, name in enumerate(KNOWN):  # a prior against an estimate that does not know it
        value, std = KNOWN[name]
        without, D = bayes(y, {other: two for other, two in KNOWN.items() if other != name})
        expected = (without[1 + i] - value) / np.hypot(std, np.sqrt(D[1 + i, 1 + i]))
        assert found.prior.away[i] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("sigma", [None, 0.3])
@pytest.mark.parametrize("method", ["levenberg-marquardt", "gauss-newton"])
def test_a_ridge_multiplies_the_diagonal_of_the_normal_matrix(method, sigma):
    y, start = readings(), {"a": 0.5, "b": -1.0, "c": 2.0}
    found = fit(line({}), record(y, sigma), ridge=0.3, method=method, start=start)
    M = K.T @ K
    D = 0.3 * np.diag(np.diag(M))
    expected = np.linalg.solve(M + D, K.T @ y + D @ [*start.values()])
    assert found.values == pytest.approx(expected, rel=1e-8)
    assert found.estimate.covariance is None
    assert sum("biases the estimate" in words for words in found.warnings) == 1
    residual = found.to_dict()["ridge"]["residual_rms"]
    rms = [
        np.sqrt(np.mean((y - K @ x) ** 2)) / (sigma or 1.0)
        for x in (np.linalg.lstsq(K, y, None)[0], expected)
    ]
    assert [*residual.values()] == pytest.approx(rms, rel=1e-8)


def test_a_ridge_is_a_number_above_0_without_a_prior():
    for prior, ridge in (({}, -1.0), (KNOWN, 0.1)):
        with pytest.raises(ValueError, match="--ridge takes a number above 0"):
            fit(line(prior), record(readings()), ridge=ridge)


def test_a_prior_that_the_data_contradict_is_named():
    found = fit(line({"b": (2.0, 0.1), "c": (1.2, 0.5)}), record(readings()))
    (words,) = (w for w in found.warnings if "contradict the prior" in w)
    assert np.abs(found.prior.away).min() > 3
    # not c, that b pulls away
    assert words.startswith(
        f"the data and the other priors contradict the prior b = 2 ± 0.1 by {-found.prior.away[0]:.2g} st"
    )
    assert not any("stated errors" in w for w in found.warnings)  # those of the data are right


def test_what_only_the_prior_knows_is_told_apart():
    estimate = {"a": 0.3, "b": 0.3, "x0": 1.0, "c": 3.0}
    model = ode_model({"x": "-a*b*x"}, initial={"x": "x0"}, outputs={"y": "x + 0*c"}, estimate=estimate)
    model = replace(model, prior={"b": (0.35, 0.05), "c": (1.0, 0.5)})
    y = 2 * np.exp(-0.7 * T) + 0.02 * np.random.default_rng(3).standard_normal(25)
    found = fit(model, record(y, 0.02))
    lines = {line.split()[0]: line for line in found.summary().splitlines() if line.startswith("  ")}
    assert lines["a"].endswith("through the prior")
    assert lines["b"].endswith("by its prior only")
    assert lines["x0"].split()[-1][-1].isdigit()
    assert found.values[[1, 3]] == pytest.approx([0.35, 1.0], rel=1e-6)
    assert found.std[[1, 3]] == pytest.approx([0.05, 0.5], rel=1e-6)
    assert np.isnan(found.prior.away).all()
    prior = found.to_dict()["prior"]
    assert prior["data_alone"].startswith("only x0 and a·b")
    assert prior["parameters"]["b"]["data_share"] == pytest.approx(0.0, abs=1e-6)


def test_copies_for_each_record_have_the_prior_of_their_parameter():
    model = ode_model({"x": "-k*x"}, initial={"x": "x0"}, estimate={"k": 1.0, "x0": 1.0}, per_record=["x0"])
    model = replace(model, prior={"x0": (2.0, 0.01)})
    data = [Record(T, {"x": x * np.exp(-T)}, sigma={"x": 0.1}) for x in (2, 2.005)]
    found = fit(model, data)
    assert found.parameters == ("k", "x0_1", "x0_2")
    assert list(found.to_dict()["prior"]["parameters"]) == ["x0_1", "x0_2"]
    assert found.values[1:] == pytest.approx([2.0, 2.0], abs=0.02)


def test_a_ridge_of_output_error_goes_from_the_estimate_to_the_start():
    model = harmonic_model(["(m*p**2 + b*p + c)*X = F"], known={"m": 10.0}, estimate=["c", "b"])
    w, start = np.array([8.0, 9.0, 11.0]), {"c": 1200.0, "b": 30.0}
    X = 10 / (1000 - 10 * w**2 + 20j * w) * np.array([1.01, 1 + 0.02j, 0.98])
    data = experiments(model, w, {"X": X, "F": 10.0})
    plain = identify(model, data).values
    least, some, most = (identify(model, data, start=start, ridge=ridge) for ridge in (1e-10, 0.1, 1e8))
    assert least.values == pytest.approx(plain, rel=1e-6)
    assert most.values == pytest.approx((1200.0, 30.0), rel=1e-6)
    assert plain[0] + 1 < some.values[0] < 1199
    assert some.covariance is None


@pytest.mark.parametrize(
    ("name", "words"), [("c", "weighed against the errors of the amp"), ("d", "d is no parameter")]
)
def test_identify_says_what_a_prior_needs(name, words):
    model = harmonic_model(["(m*p**2 + b*p + c)*X = F"], known={"m": 10.0}, estimate=["c", "b"])
    data = experiments(model, [9.0, 11.0], {"X": [0.05 - 0.05j, -0.02 - 0.03j], "F": 10.0})
    with pytest.raises(ValueError, match=words):
        identify(model, data, prior={name: (1.0, 1.0)})


def test_a_bound_is_no_fault_of_the_prior_and_its_misfit_is_not_hidden():
    model = ode_model({"x": "-k*x"}, initial={"x": "x0"}, estimate={"k": 1.0, "x0": 1.0})
    x = 2 * np.exp(-0.7 * T) + 0.02 * np.random.default_rng(3).standard_normal(25)
    data = Record(T, {"x": x}, sigma={"x": 0.02})
    model = replace(model, bounds=np.array([[0.5, 0.6], [-np.inf, np.inf]]))
    plain = fit(model, data)
    found = fit(replace(model, prior={"k": (0.75, 0.02)}), data)  # as the data say: 0.7
    assert plain.estimate.chi_square > 3 * 24
    assert found.estimate.chi_square == pytest.approx(plain.estimate.chi_square, rel=1e-6)
    assert found.estimate.dof == plain.estimate.dof == 24
    assert found.warnings == plain.warnings


MODEL = """outputs = { y = "a + b*t" }
estimate = { a = 0.0, b = 0.0 }
[prior]
"""


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("b = 1.0", r"two numbers: .*\[value, standard deviation above 0\]"),
        ("b = [1.0, 0.0]", "a number of 1e-30 or more"),
        ("bb = [1.0, 0.5]", r"bb is none \(did you mean 'b'\?\)"),
    ],
)
@pytest.mark.parametrize("read", [read_ode_model, read_harmonic_model])
def test_a_wrong_prior_in_a_file_is_named(tmp_path, read, text, expected):
    path = tmp_path / "model.toml"
    harmonic = 'equations = ["(a + b*p)*X = F"]\nestimate = ["a", "b"]\n[prior]\n'
    path.write_text((MODEL if read is read_ode_model else harmonic) + text, encoding="utf-8")
    with pytest.raises(ValueError, match=expected) as raised:
        read(path)
    assert "key prior" in str(raised.value)


def test_the_normal_matrix_of_the_last_step_is_the_one_that_q_prints():
    """[Q] (2.35), without the minus signs that the scan has lost, to half a unit of its last digit."""
    folder = sample_data() / "fit" / "quasilinearization"
    options = FitOptions(method="quasilinearization", integrator="sequential-heun")
    found = work(folder / "model.toml", folder / "record.csv", options)
    printed = [[41.75, -78.46, 39.49], [-78.46, 340.4, -75.76], [39.49, -75.76, 70.04]]
    assert found.to_dict()["normal_matrix"]["matrix"] == [
        [pytest.approx(x, abs=0.05 if x == 340.4 else 0.005) for x in row] for row in printed
    ]
    assert "normal matrix of the last step, condition number 32.4" in found.answer.whole()
