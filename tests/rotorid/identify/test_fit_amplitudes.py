"""Output error: exact derivatives, exact data, missing readings, free vibration, hidden amplitudes."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from harmonic_cases import STATED, chain, simulate, task51, two_masses

from rotorid.files import read_harmonic_model, read_measurements
from rotorid.identify import AmplitudeErrors, harmonic_model, identify
from rotorid.identify.amplitudes import compare, experiments
from rotorid.identify.fit_amplitudes import output_error

EVERYTHING = ("c1", "c", "c2", "a1", "a", "a2")
CASES = Path(__file__).parents[2] / "data/identify_cases"


def fitted(model, data, start, bounds=None, loss="linear"):
    """The fit from one start."""
    fit, comparison, *_ = output_error(compare(model, data), np.array(start), bounds=bounds, loss=loss)
    return SimpleNamespace(fit=fit, comparison=comparison)


def springs(estimate=("c1", "c2", "c3")):
    """[S] task 7.1: three masses 20, 20, 10 kg on springs 1e4, 2e4, 5e3 N/m, and their modes."""
    numbers = {"m1": 20.0, "m2": 20.0, "m3": 10.0, "c1": 1e4, "c2": 2e4, "c3": 5e3}
    equations = [
        "(m1*p**2 + c1 + c2)*A1 - c2*A2 = 0",
        "-c2*A1 + (m2*p**2 + c2 + c3)*A2 - c3*A3 = 0",
        "-c3*A2 + (m3*p**2 + c3)*A3 = 0",
    ]
    known = {name: value for name, value in numbers.items() if name not in estimate}
    model = harmonic_model(equations, known=known, estimate=estimate, inputs=[])
    K = np.array([[3e4, -2e4, 0], [-2e4, 2.5e4, -5e3], [0, -5e3, 5e3]])
    z, v = np.linalg.eig(K / np.array([[20.0], [20.0], [10.0]]))
    order = np.argsort(z)
    return model, np.array([numbers[e] for e in estimate]), np.sqrt(z[order]), (v / v[0])[:, order].T


def vibrations(model, frequencies, shapes, **options):
    return experiments(
        model, frequencies, {f"A{j + 1}": shapes[:, j] for j in range(3)}, free=True, **options
    )


def comparisons():
    model, truth, w, inputs = two_masses(EVERYTHING)
    data = simulate(model, truth, w, inputs, STATED, np.random.default_rng(1), stated=STATED)
    yield compare(model, data), truth * (1 + 0.05 * np.sin(np.arange(6)))
    model, w = feedback(("K", "T1", "T2"))[0], np.array([1.0, 2.0, 3.0])
    yield compare(model, simulate(model, np.array([10, 0.5, 0.8]), w, {"f": 1.0})), np.array([9.0, 0.6, 0.7])
    for estimate in (("c1", "c2", "c3"), ("c1", "c2", "c3", "m2", "m3")):
        model, truth, w, shapes = springs(estimate)
        x = truth * (1 + 0.02 * np.sin(np.arange(len(truth))))
        yield compare(model, vibrations(model, w, shapes)), x


def feedback(estimate):
    """[S] 1.8: a feedback system with products of unknowns."""
    numbers = {"T0": 1.0, "T1": 0.5, "T2": 0.8, "K": 10.0}
    known = {k: v for k, v in numbers.items() if k not in estimate}
    equation = "(T0*T1*T2*p**3 + T2*(T0 + T1)*p**2 + T2*p + K)*S = (T1*T2*p**2 + T2*p)*f"
    model = harmonic_model([equation], known=known, estimate=estimate)
    return model, np.array([numbers[e] for e in estimate]), np.array([1.0, 2.0, 3.0]), {"f": 1.0}


def test_jacobians_are_those_of_differences():
    """Of forced amplitudes, of products of parameters, and of natural modes."""
    for comparison, x in comparisons():
        J = comparison.residuals(x)[1] * x
        for j, step in enumerate(1e-6 * np.diag(x)):
            up, down = (comparison.residuals(x + s)[0] for s in (step, -step))
            np.testing.assert_allclose(J[:, j], (up - down) / 2e-6, atol=1e-6 * np.abs(J).max())


@pytest.mark.parametrize(
    "case", [task51(), two_masses(), two_masses(EVERYTHING), feedback(("T1", "T2"))],
    ids=["task 5.1", "dampers", "everything", "products"],
)  # fmt: skip
@pytest.mark.parametrize("stated", [None, STATED])
def test_exact_readings_give_the_truth_without_a_start(case, stated):
    model, truth, w, inputs = case
    result = identify(model, simulate(model, truth, w, inputs, stated=stated))
    np.testing.assert_allclose(result.values, truth, rtol=1e-8)
    assert result.identifiable
    assert result.unidentifiable == result.warnings == ()
    assert result.method == "output-error"
    assert result.residual_rms < 1e-9
    assert result.errors_stated == (stated is not None)
    assert result.estimate.rank == len(truth)
    assert len(result.estimate.residuals) == 2 * len(w) * len(model.outputs)


def test_missing_amplitudes_are_left_out_and_named():
    model, truth, w, inputs = two_masses()
    data = simulate(model, truth, w, inputs)
    data.signals["X2"][1] = data.signals["F1"][4] = np.nan
    result = fitted(model, data, 0.9 * truth)
    np.testing.assert_allclose(result.fit.values, truth, rtol=1e-9)
    assert result.comparison.left_out == (
        "experiment 2: X2 not measured",
        "experiment 5: left out, for not every input is known",
    )
    assert len(result.fit.estimate.residuals) == 2 * 7
    assert np.isfinite(identify(model, data).predicted["X2"]).tolist() == [True] * 4 + [False]
    one_sensor = replace(data, signals={name: z for name, z in data.signals.items() if name != "X2"})
    np.testing.assert_allclose(fitted(model, one_sensor, 0.9 * truth).fit.values, truth, rtol=1e-8)
    no_load = replace(data, signals={"X1": data.signals["X1"], "X2": data.signals["X2"]})
    with pytest.raises(ValueError, match="not every input is known"):
        fitted(model, no_load, truth)
    square = harmonic_model(["(m*p**2 + c)*X1 + b*p*X2 = F1"], known={"m": 1.0}, estimate=["c", "b"])
    with pytest.raises(ValueError, match="as many equations as outputs"):
        fitted(square, data, truth[:2])


def test_free_vibration_tells_the_springs():
    model, truth, w, shapes = springs()
    result = fitted(model, vibrations(model, w, shapes), 1.3 * truth)
    np.testing.assert_allclose(result.fit.values, truth, rtol=1e-9)
    predicted, frequencies = result.comparison.predict(result.fit.values)
    np.testing.assert_allclose(frequencies, w, rtol=1e-10)
    np.testing.assert_allclose(predicted[:, 2].real, shapes[:, 2], rtol=1e-8)
    assert len(result.fit.estimate.residuals) == 9
    model, truth, w, shapes = springs(("c1", "c2", "c3", "m2"))
    shapes[1, 2] = np.nan
    result = fitted(model, vibrations(model, w[:2], shapes[:2], errors=STATED), 1.1 * truth)
    np.testing.assert_allclose(result.fit.values, truth, rtol=1e-8)
    assert result.comparison.left_out == ("experiment 2: A3 not measured",)
    model, _, w, shapes = springs(("c1", "c2", "c3", "m2", "m3"))
    one = identify(model, vibrations(model, w[:1], shapes[:1]))
    assert (one.identifiable, one.estimate.rank) == (False, 3)


def test_forced_and_free_together():
    model, truth, w, inputs = two_masses(("c1", "c2", "a1"))
    data = simulate(model, truth, w[:2], inputs)
    lam, v = np.linalg.eig(np.array([[1500.0, -500.0], [-1000.0, 1000.0]]))
    signals = {"F1": [100, 100, 0]}
    signals |= {f"X{i + 1}": [*data.signals[f"X{i + 1}"], v[i, 0]] for i in range(2)}
    both = experiments(model, [*w[:2], np.sqrt(lam[0])], signals, free=[False, False, True])
    result = fitted(model, both, 1.1 * truth)
    np.testing.assert_allclose(result.fit.values, truth, rtol=1e-8)
    assert np.isnan(result.comparison.predict(truth)[1]).tolist() == [True, True, False]


def test_bounds_and_robust_loss_reach_the_kernel():
    model, truth, w, inputs = two_masses()
    data = simulate(model, truth, w, inputs, STATED, np.random.default_rng(5), stated=STATED)
    held = fitted(model, data, truth, bounds={"a1": (0.0, 30.0)}).fit
    assert (held.at_bounds, held.values[0]) == (("a1",), 30.0)
    assert "a1 stands at its bound" in held.bound_warning
    clean = fitted(model, data, truth).fit.values
    data.signals["X1"][2] *= 3
    plain, robust = (fitted(model, data, truth, loss=loss).fit.values for loss in ("linear", "huber"))
    assert np.abs(robust / clean - 1).max() < 0.1 * np.abs(plain / clean - 1).max()


def test_errors_weight_each_reading():
    model, truth, w, inputs = task51()
    data = simulate(model, truth, w, inputs)
    data.signals["X"][0] *= 1.5
    sigma = np.abs(data.signals["X"]) * [10.0, 1e-3, 1e-3]
    data = replace(data, covariances={"X": sigma[:, None, None] ** 2 * np.eye(2)})
    fit = fitted(model, data, truth).fit
    np.testing.assert_allclose(fit.values, truth, rtol=1e-5)
    assert fit.estimate.errors_stated
    no_phase = fitted(model, simulate(model, truth, w, inputs, stated=AmplitudeErrors(0.02)), truth)
    smallest = 1 / np.linalg.svd(no_phase.comparison.whiten)[1][:, 0, 0]
    assert smallest == pytest.approx(
        0.01 * 0.02 * np.abs(no_phase.comparison.experiments.signals["X"]), rel=1e-3
    )


def test_only_the_difference_is_determined():
    equation = "(m*p**2 + b*p + c)*Z - delta*b*p*Z = F"
    model = harmonic_model([equation], known={"m": 10.0}, estimate=["c", "b", "delta"])
    w = np.array([80.0, 100.0, 120.0])
    signals = {"Z": 5.0 / (-10 * w**2 + 1j * w * 400 + 1e5), "F": 5.0}
    data = experiments(model, w, signals, errors=STATED, free=False)
    result = identify(model, data)
    assert result.values[0] == pytest.approx(1e5, rel=1e-8)
    assert np.isnan(result.values[1:]).all()
    (combination,) = result.combinations
    assert combination.words == "b*(1 - delta)"
    assert combination.value == pytest.approx(400, rel=1e-8)
    one = harmonic_model(["(m*p**2 + d*p + c)*Z = F"], known={"m": 10.0}, estimate=["c", "d"])
    assert combination.std == pytest.approx(identify(one, data).std[1], rel=1e-6)
    assert any("c and b*(1 - delta)" in text for text in result.unidentifiable)


@pytest.mark.parametrize(
    ("equations", "known", "truth"),
    [
        (["(m*p**2 + b1*p + c1 + c2)*X1 - c2*X2 = F", "(5*p**2 + b2*p + c2)*X2 - c2*X1 = 0"], {"m": 10.0},
         {"c1": 1e4, "c2": 2e4, "b1": 0.0, "b2": 0.0}),
        (["(m*p**2 + b*p + m*c)*X = F"], {}, {"m": 3.0, "b": 0.0, "c": 500.0}),
        (["(m*p**2 + z*sqrt(k*m)*p + k)*X = F"], {}, {"m": 3.0, "k": 9.0, "z": 0.2}),
        (["(p**2 + a**1.5*p + a*b)*X = F"], {}, {"a": 4.0, "b": 30.0}),
    ],
    ids=["dampers that are zero", "a zero beside a product", "a root of a product", "a root"],
)  # fmt: skip
def test_zeros_and_roots_are_told_exactly(equations, known, truth):
    model, values = harmonic_model(equations, known=known, estimate=[*truth]), np.array([*truth.values()])
    result = identify(model, simulate(model, values, np.linspace(5, 40, 8), {"F": 1.0}))
    np.testing.assert_allclose(result.linear.recovery.values, values, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(result.values, values, rtol=1e-8, atol=1e-9)
    assert result.warnings == ()


def table(tmp_path, digits, truth, seed):
    """A table of amplitudes of one mass in so many digits, read."""
    (tmp_path / "m.toml").write_text('equations = ["(10*p**2 + b*p + c)*X = F"]\nestimate = ["c", "b"]\n')
    file = read_harmonic_model(tmp_path / "m.toml")
    w = np.random.default_rng(seed).uniform(4, 25, 8).round(1)
    X = file.model.predict(truth, w, {"F": np.full(8, 10.0 + 0j)})["X"]
    rows = [f"{f},10,{z.real:.{digits}g},{z.imag:.{digits}g}" for f, z in zip(w, X, strict=True)]
    (tmp_path / "d.csv").write_text("\n".join(["frequency_rad_s,F_re,X_re,X_im", *rows]))
    return file.model, read_measurements(tmp_path / "d.csv", file)


def test_digits_of_readings_are_their_errors(tmp_path):
    """Of many tables in two digits the intervals hold in about 95 %; in four digits they are narrower."""
    inside, widths = [], []
    for seed in range(40):
        truth = np.array([1000.0, 10.0]) * np.random.default_rng(100 + seed).uniform(0.9, 1.1, 2)
        two, four = (identify(*table(tmp_path, digits, truth, seed)) for digits in (2, 4))
        inside += [*(two.ci95[:, 0] <= truth) & (truth <= two.ci95[:, 1])]
        widths.append(four.std / two.std)
    assert 0.88 <= np.mean(inside) <= 1.0
    assert np.median(widths) < 0.05
    assert any("digits in which readings are written" in note for note in two.notes)
    model, data = table(tmp_path, 6, np.array([1000.0, 10.0]), 3)
    data.signals["X"][:] *= 1 + 0.02 * np.random.default_rng(1).standard_normal((8, 2)) @ [1, 1j]
    more = identify(model, data)  # what is more than digits make is not blamed on them
    assert not more.errors_stated
    assert (more.std / more.values > 1e-3).all()


# Amplitudes that are measured nowhere


def drawn_chain(seed, masses, errors=None, lost=1):
    """A chain with known masses and drawn springs and dampers; some amplitudes are not measured."""
    rng, (equations, names) = np.random.default_rng(seed), chain(masses)
    known = {name: rng.uniform(2, 10) for name in names[:masses]}
    truth = np.concatenate((rng.uniform(5, 50, masses), 10 ** rng.uniform(3.7, 4.7, masses)))
    model = harmonic_model(equations, known=known, estimate=names[masses:])
    data = simulate(model, truth, np.linspace(8, 130, 14), {"F": 1.0}, errors, rng, stated=errors)
    hidden = rng.permutation([*model.outputs])[:lost]
    return model, truth, replace(data, signals={n: z for n, z in data.signals.items() if n not in hidden})


@pytest.mark.parametrize(("seed", "masses", "lost"), [(0, 2, 1), (1, 3, 1), (2, 4, 1), (5, 4, 2)])
def test_chains_with_unmeasured_masses_are_identified(seed, masses, lost):
    model, truth, data = drawn_chain(seed, masses, lost=lost)
    result = identify(model, data)
    np.testing.assert_allclose(result.values, truth, rtol=1e-5)
    assert result.identifiable
    assert not result.unidentifiable


@pytest.mark.parametrize(("ka", "kb"), [(2e4, 3e4), (1e3, 9e5)])
def test_springs_in_series_show_the_one_stiffness_whatever_they_are(ka, kb):
    equations = ["(m*p**2 + b*p)*X + ka*(X - W) = F", "kb*W + ka*(W - X) = 0"]
    model = harmonic_model(equations, known={"m": 5.0}, estimate=["b", "ka", "kb"])
    data = simulate(model, np.array([30.0, ka, kb]), np.linspace(5, 200, 9), {"F": 1.0})
    del data.signals["W"]
    result = identify(model, data)
    assert result.value("b") == pytest.approx(30.0, rel=1e-6)
    assert np.isnan(result.values[1:]).all()
    _, a, b = result.theta
    assert a * b / (a + b) == pytest.approx(ka * kb / (ka + kb), rel=1e-6)
    (near,) = result.combinations
    assert near.words.startswith("(near these values) ka + ")
    assert near.std is None
    assert result.linear is None


def test_a_search_that_does_not_converge_says_nothing_else():
    model, truth, data = drawn_chain(1, 4)
    result = identify(model, data, start=dict(zip(model.parameters, 1e6 / truth, strict=True)))
    assert (result.converged, result.identifiable, result.ci95, result.std) == (False, False, None, None)
    document = result.to_dict()
    assert all(p["std"] is None and p["ci95"] is None for p in document["parameters"].values())
    assert (document["combinations"], document["unidentifiable"]) == ({}, [])
    text = result.summary()
    assert "NOT converged: the values are where the search stopped" in text
    assert "determined" not in text


def test_several_solutions_beside_a_hidden_amplitude_are_said_as_such():
    """Time constants in series can be exchanged; the amplitude between them is not measured."""
    model = harmonic_model(["(T1*p + 1)*Y = F", "(T2*p + 1)*X = Y"], estimate=["T1", "T2"])
    data = simulate(model, np.array([0.5, 0.2]), np.array([1.0, 3.0, 6.0]), {"F": 1.0})
    del data.signals["Y"]
    result = identify(model, data)
    assert np.isnan(result.values).all()
    assert not any("are determined" in text for text in result.unidentifiable)
    assert sorted(round(s["T1"], 6) for s in result.solutions) == [0.2, 0.5]
    assert "can be exchanged" in result.unidentifiable[0]


def test_cases_from_the_command_line(cli):
    ratios, speeds = (
        cli("identify", CASES / name / "model.toml", CASES / name / "data.csv", "--json").json
        for name in ("ratios_only", "speed_column")
    )
    values = {words: c["value"] for words, c in ratios["combinations"].items()}
    assert values == {"b/m": pytest.approx(20 / 3, rel=1e-6), "c/m": pytest.approx(1e4 / 3, rel=1e-6)}
    words = " ".join(ratios["unidentifiable"])
    assert "no experiment of this kind tells more" in words
    assert "nothing is determined" not in words
    assert speeds["identifiable"]
