"""Amplitudes that are measured nowhere: found without a start, or said; invariants in place of tangents."""

from pathlib import Path

import numpy as np
import pytest

from rotorid.identify import AmplitudeErrors, harmonic_model, identify
from rotorid.identify.amplitudes import experiments

CASES = Path(__file__).parents[2] / "data/identify_cases"


def drawn_chain(seed, masses, noise=0.0, stated=None, lost=1):
    """A chain with known masses and drawn springs and dampers; some amplitudes are not measured."""
    rng = np.random.default_rng(seed)
    equations = []
    for i in range(1, masses + 1):
        left = f"(m{i}*p**2 + b{i}*p)*X{i} + k{i}*(X{i}{f' - X{i - 1}' if i > 1 else ''})"
        left += f" + k{i + 1}*(X{i} - X{i + 1})" if i < masses else ""
        equations.append(f"{left} = {'F' if i == 1 else '0'}")
    known = {f"m{i}": rng.uniform(2, 10) for i in range(1, masses + 1)}
    truth = {f"b{i}": rng.uniform(5, 50) for i in range(1, masses + 1)}
    truth |= {f"k{i}": 10 ** rng.uniform(3.7, 4.7) for i in range(1, masses + 1)}
    model = harmonic_model(equations, known=known, estimate=list(truth))
    values, w = np.array(list(truth.values())), np.linspace(8, 130, 14)
    z = model.predict(values, w, {"F": np.ones(14, dtype=complex)})
    for name in rng.permutation(list(z))[:lost]:
        del z[name]
    z = {n: x * (1 + noise * (rng.standard_normal(14) + 1j * rng.standard_normal(14))) for n, x in z.items()}
    return model, values, experiments(model, w, {"F": 1.0, **z}, free=False, errors=stated)


@pytest.mark.parametrize("seed", range(4))
def test_drawn_chains_with_an_unmeasured_mass_are_found(seed):
    model, truth, data = drawn_chain(seed, 2 + seed % 3)
    found = identify(model, data)
    np.testing.assert_allclose(found.values, truth, rtol=1e-5)
    assert found.identifiable
    assert not found.unidentifiable


@pytest.mark.parametrize("seed", [0, 1, 20])  # 20: noise drives a damper to 0
def test_noisy_ones_within_their_intervals(seed):
    errors = AmplitudeErrors(0.01, 0.01)
    model, truth, data = drawn_chain(seed, 3, 0.01, errors)
    found = identify(model, data)
    assert found.converged
    assert found.warnings == ()
    assert (np.abs(found.values - truth) < 4.5 * found.std).all()
    assert found.left_out == (f"{(set(model.outputs) - set(data.signals)).pop()} is measured nowhere",)


def test_two_unmeasured_masses():
    model, truth, data = drawn_chain(5, 4, lost=2)
    np.testing.assert_allclose(identify(model, data).values, truth, rtol=1e-6)


SPRINGS = ["(m*p**2 + b*p)*X + ka*(X - W) = F", "kb*W + ka*(W - X) = 0"]


@pytest.mark.parametrize(("ka", "kb"), [(2e4, 3e4), (1e3, 9e5), (5e5, 5e5)])
def test_springs_in_series_show_the_one_stiffness_whatever_they_are(ka, kb):
    model = harmonic_model(SPRINGS, known={"m": 5.0}, estimate=["b", "ka", "kb"])
    w = np.linspace(5, 200, 9)
    x = model.predict(np.array([30.0, ka, kb]), w, {"F": np.ones(9, dtype=complex)})["X"]
    data = experiments(model, w, {"F": 1.0, "X": x}, free=False)
    found = identify(model, data)
    assert found.value("b") == pytest.approx(30.0, rel=1e-6)
    assert np.isnan(found.values[1:]).all()
    _, a, b = found.theta
    assert a * b / (a + b) == pytest.approx(ka * kb / (ka + kb), rel=1e-6)
    (near,) = found.combinations
    assert near.words.startswith("(near these values) ka + ")
    assert near.std is None
    assert found.linear is None


def test_a_search_that_does_not_converge_says_nothing_else():
    model, truth, data = drawn_chain(1, 4)
    start = dict(zip(model.parameters, 1e4 / truth, strict=True))
    found = identify(model, data, start=start)
    assert not found.converged
    assert not found.identifiable
    assert found.ci95 is None
    assert found.std is None
    document = found.to_dict()
    assert document["converged"] is False
    assert document["identifiable"] is False
    assert all(p["std"] is None and p["ci95"] is None for p in document["parameters"].values())
    assert document["combinations"] == {}
    assert document["unidentifiable"] == []
    text = found.summary()
    assert "NOT converged: the values are where the search stopped" in text
    assert "determined" not in text


def test_several_solutions_beside_a_hidden_amplitude_are_said_as_such():
    """Time constants in series can be exchanged; the amplitude between them is not measured."""
    model = harmonic_model(["(T1*p + 1)*Y = F", "(T2*p + 1)*X = Y"], estimate=["T1", "T2"])
    w = np.array([1.0, 3.0, 6.0])
    x = model.predict(np.array([0.5, 0.2]), w, {"F": np.ones(3, dtype=complex)})["X"]
    data = experiments(model, w, {"F": 1.0, "X": x}, free=False)
    found = identify(model, data)
    assert np.isnan(found.values).all()
    assert not any("are determined" in text for text in found.unidentifiable)
    assert sorted(round(s["T1"], 6) for s in found.solutions) == [0.2, 0.5]
    assert "can be exchanged" in found.unidentifiable[0]


def run(cli, name, *options):
    return cli("identify", CASES / name / "model.toml", CASES / name / "data.csv", "--json", *options)


@pytest.mark.filterwarnings("ignore:.*the table has no")
def test_the_cases_say_what_they_should(cli):
    truth = {"b1": 20, "k1": 2e4, "k2": 3e4, "k3": 2.5e4, "k4": 1.2e4, "b4": 9}
    found = run(cli, "hidden_amplitude").json
    assert found["identifiable"]
    for name, value in truth.items():
        assert found["parameters"][name]["value"] == pytest.approx(value, rel=1e-6)
    found = run(cli, "series_springs").json
    assert found["parameters"]["ka"]["value"] is None
    found = run(cli, "ratios_only").json
    ratios = {words: c["value"] for words, c in found["combinations"].items()}
    assert ratios == {"b/m": pytest.approx(20 / 3, rel=1e-6), "c/m": pytest.approx(1e4 / 3, rel=1e-6)}
    words = " ".join(found["unidentifiable"])
    assert "no experiment of this kind tells more" in words
    assert "nothing is determined" not in words
    found = run(cli, "speed_column").json
    assert found["identifiable"]
