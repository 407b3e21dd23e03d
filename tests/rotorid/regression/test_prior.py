"""Priors and ridges: against Bayesian linear regression in numpy, and parameters drawn from their prior."""

from dataclasses import replace

import numpy as np
import pytest

from rotorid.commands.fit import FitOptions
from rotorid.commands.fit import fit as work
from rotorid.files import read_harmonic_model, read_ode_model
from rotorid.identify import AmplitudeErrors, harmonic_model, identify
from rotorid.identify.amplitudes import experiments
from rotorid.identify.fit_records import fit
from rotorid.identify.ode import ode_model
from rotorid.identify.records import Record
from rotorid.regression.linear import normal_matrix
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


def bayes(y, known=KNOWN, sigma=SIGMA):
    """Mean and covariance of Bayesian linear regression, from the normal matrix."""
    names = ("a", "b", "c")
    P, v = np.zeros((3, 3)), np.zeros(3)
    for name, (value, std) in known.items():
        i = names.index(name)
        P[i, i], v[i] = std**-2, value
    C = np.linalg.inv(K.T @ K / sigma**2 + P)
    return C @ (K.T @ y / sigma**2 + P @ v), C


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
    assert found.estimate.chi_square == pytest.approx(np.linalg.lstsq(K, y)[1][0] / SIGMA**2, rel=1e-8)
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


def test_the_normal_matrix_is_that_of_the_data():
    y = readings()
    document = fit(line(KNOWN), record(y)).to_dict()["normal_matrix"]
    assert document["names"] == ["a", "b", "c"]
    assert np.array(document["matrix"]) == pytest.approx(K.T @ K / SIGMA**2, rel=1e-9)
    assert document["condition_number"] == pytest.approx(np.linalg.cond(K.T @ K), rel=1e-3)
    assert normal_matrix(("a", "b"), np.ones((3, 2))).condition_number == np.inf


@pytest.mark.parametrize("sigma", [None, 0.3])
@pytest.mark.parametrize("method", ["levenberg-marquardt", "gauss-newton"])
def test_a_ridge_multiplies_the_diagonal_of_the_normal_matrix(method, sigma):
    y, start = readings(), np.array([0.5, -1.0, 2.0])
    found = fit(
        line({}), record(y, sigma), ridge=0.3, method=method, start=dict(zip("abc", start, strict=True))
    )
    M = K.T @ K
    D = 0.3 * np.diag(np.diag(M))
    assert found.values == pytest.approx(np.linalg.solve(M + D, K.T @ y + D @ start), rel=1e-8)
    assert found.estimate.covariance is None
    assert not found.reliable
    (words,) = (w for w in found.warnings if "ridge" in w)
    assert "biases the estimate" in words
    told = found.to_dict()["ridge"]
    assert told["lambda"] == 0.3
    weight = 1.0 if sigma is None else sigma
    left = np.linalg.lstsq(K, y)[1][0]
    assert told["residual_rms"]["without"] == pytest.approx(np.sqrt(left / 25) / weight, rel=1e-8)
    assert told["residual_rms"]["with"] == pytest.approx(found.residual_rms / weight, rel=1e-8)
    assert told["condition_number"]["with"] < told["condition_number"]["without"]


def test_a_ridge_is_a_number_above_0_without_a_prior():
    for prior, ridge in (({}, -1.0), (KNOWN, 0.1)):
        with pytest.raises(ValueError, match="--ridge takes a number above 0"):
            fit(line(prior), record(readings()), ridge=ridge)


def test_a_prior_that_the_data_contradict_is_named():
    found = fit(line({"b": (2.0, 0.1), "c": (1.2, 0.5)}), record(readings()))
    (words,) = (w for w in found.warnings if "contradict the prior" in w)
    assert words.startswith(
        "the data and the other priors contradict the prior b"
    )  # not c, that b pulls away
    assert np.abs(found.prior.away).min() > 3
    assert f"b = 2 ± 0.1 by {abs(found.prior.away[0]):.2g} standard" in words
    assert found.prior.away[0] < -5
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
    assert lines["c"].endswith("by its prior only")
    assert lines["x0"].split()[-1][-1].isdigit()
    assert "Without it only x0 and a·b are determined" in found.summary()
    assert found.values[[1, 3]] == pytest.approx([0.35, 1.0], rel=1e-6)
    assert found.std[[1, 3]] == pytest.approx([0.05, 0.5], rel=1e-6)
    assert np.isnan(found.prior.away).all()
    document = found.to_dict()
    assert document["prior"]["data_alone"].startswith("only x0 and a·b")
    assert document["prior"]["parameters"]["b"]["data_share"] == pytest.approx(0.0, abs=1e-6)
    assert document["normal_matrix"]["condition_number"] is None


def test_the_best_of_several_minima_counts_the_prior():
    model = ode_model({}, outputs={"y": "a**2 + 0*t"}, estimate={"a": 1.0}, bounds={"a": (-10.0, 10.0)})
    data = record(np.full(25, 4.0) + 0.01 * np.sin(7 * T), 0.1)
    found = fit(replace(model, prior={"a": (-1.0, 1.0)}), data, starts=9)
    assert found.values[0] == pytest.approx(-2.0, abs=0.01)
    assert not any("another start" in w for w in found.warnings)  # the prior tells them apart


def test_copies_for_each_record_have_the_prior_of_their_parameter():
    model = ode_model({"x": "-k*x"}, initial={"x": "x0"}, estimate={"k": 1.0, "x0": 1.0}, per_record=["x0"])
    model = replace(model, prior={"x0": (2.0, 0.01)})
    data = [Record(T, {"x": x * np.exp(-T)}, sigma={"x": 0.1}) for x in (2, 2.005)]
    found = fit(model, data)
    assert found.parameters == ("k", "x0_1", "x0_2")
    assert list(found.to_dict()["prior"]["parameters"]) == ["x0_1", "x0_2"]
    assert found.values[1:] == pytest.approx([2.0, 2.0], abs=0.02)


def test_a_prior_needs_errors_to_be_weighed_by():
    y = readings()
    with pytest.raises(ValueError, match="weighed against the errors of the records: state them"):
        fit(line(KNOWN), record(y, None))
    with pytest.raises(ValueError, match="a robust loss would discount it"):
        fit(line(KNOWN), record(y), loss="huber")


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
    assert "biases" in some.warnings[-1]
    assert some.to_dict()["ridge"]["parameters"]["c"]["value"] == 1200.0


def test_identify_says_what_it_needs():
    model = harmonic_model(["(m*p**2 + b*p + c)*X = F"], known={"m": 10.0}, estimate=["c", "b"])
    data = experiments(model, [9.0, 11.0], {"X": [0.05 - 0.05j, -0.02 - 0.03j], "F": 10.0})
    with pytest.raises(ValueError, match="weighed against the errors of the amplitudes"):
        identify(model, data, prior={"c": (1.0, 1.0)})
    with pytest.raises(ValueError, match="prior: d is no parameter"):
        identify(model, data, prior={"d": (1.0, 1.0)})


def test_a_prior_chooses_among_values_that_can_be_exchanged():
    """Two time constants in a row: only their sum and product are determined; a prior of one tells which."""
    model = harmonic_model(["(T1*p + 1)*(T2*p + 1)*X = F"], estimate=["T1", "T2"])
    w = np.array([0.5, 1.0, 2.0])
    X = 1 / ((0.5j * w + 1) * (0.8j * w + 1))
    data = experiments(model, w, {"X": X, "F": 1.0}, errors=AmplitudeErrors(0.01, 0.01))
    assert np.isnan(identify(model, data).values).all()
    found = identify(model, data, prior={"T1": (0.6, 0.1)})
    assert found.values == pytest.approx([0.5, 0.8], rel=0.05)
    assert found.identifiable


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
    assert np.isnan(found.prior.away).all()
    assert found.to_dict()["prior"]["parameters"]["k"]["data_share"] is None


def test_the_other_outputs_tell_of_a_prior(tmp_path):
    folder, path = sample_data() / "fit" / "quasilinearization", tmp_path / "prior.toml"
    text = (folder / "model.toml").read_text(encoding="utf-8")
    path.write_text(f"{text}\n[prior]\ntheta1 = [1.0, 0.004]\n", encoding="utf-8")
    start = {"theta1": 1.0, "theta2": -1.0, "theta3": -1.0}
    found = work(path, folder / "record_noisy.csv", FitOptions(sigma=0.02, start=start))
    sheet = found.sheet().decode()
    assert "% from the data" in sheet.partition("<script")[0]
    assert any("rows of [prior]" in note for note in found.equations.notes)
    assert not work(folder / "model.toml", folder / "record_noisy.csv").equations.notes


MODEL = """outputs = { y = "a + b*t" }
estimate = { a = 0.0, b = 0.0 }
[prior]
"""


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("b = 1.0", r"two numbers: .*\[value, standard deviation above 0\]"),
        ("b = [1.0, 0.0]", "a number of 1e-30 or more"),
        ("b = [1.0, 1e-320]", "a number of 1e-30 or more"),
        ("b = [1.0, inf]", "a finite number"),
        ('b = [1.0, "two"]', "standard deviation above 0"),
        ("b = [true, 2]", "standard deviation above 0"),
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


def test_a_prior_in_a_file_is_that_of_the_model(tmp_path):
    path, data = tmp_path / "model.toml", tmp_path / "record.csv"
    path.write_text(MODEL + "b = [1, 0.5]\n", encoding="utf-8")
    assert dict(read_ode_model(path).prior) == {"b": (1.0, 0.5)}
    data.write_text("t_s,y\n0,1\n1,2.1\n2,2.9\n3,4.2\n", encoding="utf-8")
    document = work(path, data, FitOptions(sigma=0.1)).to_dict()
    assert document["prior"]["parameters"]["b"]["std"] == 0.5
    time = 'M = [["m"]]\nC = [["b"]]\nK = [["c"]]\n[force]\ny1 = "u"\n[estimate]\nb = 1\nc = 2\nx0 = 1\n'
    more = '[known]\nm = 1\n[initial]\ny1 = "x0"\n[prior]\nc = [2, 0.1]\nx0 = [1, 1]\n'
    path.write_text('inputs = ["u"]\n' + time + more, encoding="utf-8")
    with pytest.warns(UserWarning, match="x0: in no equation of amplitudes"):
        assert read_harmonic_model(path).prior == {"c": (2.0, 0.1)}


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
