"""What stands in residuals beside noise: hum by name, the rest as no noise."""

import numpy as np
import pytest
from repetitions import FULL

from rotorid.base.choices import names
from rotorid.files import read_ode_model, read_record
from rotorid.identify.fit_records import METHODS, fit
from rotorid.identify.ode import ode_model, with_nuisance
from rotorid.identify.records import Record
from rotorid.identify.simulation import simulate

T = np.linspace(0.0, 4.0, 501)
TRUTH = [100.0, 0.4]


def oscillator(position="1", speed="0", nuisance=None, estimate=None, **options):
    outputs, factors = with_nuisance({"x": "x"}, *(nuisance or (False, False, [])))
    return ode_model(
        {"x": "v", "v": "-k*x - c*v"},
        initial={"x": position, "v": speed},
        outputs=outputs,
        estimate={"k": 90.0, "c": 0.5} | (estimate or {}) | dict.fromkeys(factors, 0.0),
        **options,
    )


def record(seed, position="1", speed="0", extra=0.0, t=T, error=0.01):
    x = simulate(oscillator(position, speed), TRUTH, t - t[0], sensitivities=False).y[:, 0]
    return Record(t, {"x": x + error * np.random.default_rng(seed).standard_normal(len(t)) + extra})


def within(found, n=2):
    return found.std is not None and bool((np.abs(found.values[:n] - TRUTH) < 5 * found.std[:n]).all())


HUM = np.sqrt(2 * 0.002 * 0.2) * np.sin(2 * np.pi * 50 * T + 1.0)
"""0.2 % of the variance."""


def test_hum_is_proposed_and_then_estimated():
    for seed in range(4):
        data = record(seed, extra=HUM)
        found = fit(oscillator(), data)
        assert any("[nuisance] hum_Hz = 50)" in text for text in found.warnings)
        assert found.std is None or within(found)
        with_it = fit(oscillator(nuisance=(False, False, [50])), data)
        assert within(with_it)
        assert with_it.warnings == ()


@pytest.mark.parametrize(
    ("changes", "free"),
    [
        ({"extra": 0.03}, {"nuisance": (True, False, [])}),
        ({"extra": 0.03 * T}, {"nuisance": (False, True, [])}),
        ({"extra": 0.02 + 0.03 * T + HUM}, {"nuisance": (True, True, [50.0])}),
        ({"speed": "0.5"}, {"speed": "v_0", "estimate": {"v_0": 1.0}}),
        ({"position": "1.05"}, {"position": "x_0", "estimate": {"x_0": 1.0}}),
    ],
)
def test_what_the_model_leaves_out_is_no_noise_until_it_is_estimated(changes, free):
    for seed in range(4):
        data = record(seed, **changes)
        found = fit(oscillator(), data)
        assert not found.reliable
        assert any("residuals are not random" in w or "No intervals" in w for w in found.warnings)
        with_it = fit(oscillator(**free), data)
        assert within(with_it)
        assert with_it.warnings == ()


def test_noise_is_blamed_on_nothing():
    """White noise, and noise that follows itself: nothing is proposed; white noise keeps its intervals."""
    for seed in range(60 if FULL else 12):
        plain = fit(oscillator(), record(seed))
        assert within(plain)
        assert not any("residuals" in text for text in plain.warnings)
        e, noise = 0.01 * np.random.default_rng(seed).standard_normal(len(T)), np.zeros(len(T))
        for i in range(1, len(T)):
            noise[i] = 0.9 * noise[i - 1] + e[i]
        coloured = fit(oscillator(), record(seed, extra=noise, error=1e-9))
        assert not any("hum" in text for text in coloured.warnings)


@pytest.mark.parametrize("method", names(METHODS))
def test_what_known_initial_values_fix_is_no_degree_of_freedom(method, tmp_path):
    """n parameters, n samples and the first one: as many equations as unknowns, whatever rounding leaves."""
    (tmp_path / "one.toml").write_text('[states]\nx = "-a*x"\n[initial]\nx = 1.0\n[estimate]\na = 0.5\n')
    (tmp_path / "one.csv").write_text("t_s,x\n0,1.0\n1,0.37\n")
    model = read_ode_model(tmp_path / "one.toml")
    found = fit(model, read_record(tmp_path / "one.csv", model), method=method)
    assert (found.std, found.estimate.dof) == (None, 0)
    assert found.values == pytest.approx([-np.log(0.37)], rel=1e-8)
    rng = np.random.default_rng(5)
    for n in (1, 2):
        t = np.concatenate([[0.0], np.sort(rng.uniform(0.2, 1.0, n))])
        given = {"a": 0.6, "b": 0.1}
        estimate = {name: given.pop(name) for name in ("a", "b")[:n]}
        rate, outputs = {"x": "-a*x + b"}, {"x": "3*x"}
        one = ode_model(rate, initial={"x": 1.0}, outputs=outputs, estimate=estimate, known=given)
        y = simulate(one, [0.8, 0.2][:n], t, sensitivities=False).y[:, 0]
        tight = fit(one, Record(t, {"x": y}), method=method)
        assert (tight.std, tight.estimate.dof) == (None, 0)
        assert tight.converged


@pytest.mark.parametrize("method", names(METHODS))
def test_what_did_not_converge_has_no_intervals_and_says_nothing_of_what_is_determined(method):
    """From 3 and −4 the states grow beyond all bounds, which takes the integration its 90,000 steps."""
    start = {"a": 3.0, "b": -4.0} if FULL else {"a": 2.0, "b": -0.5}
    found = fit(
        ode_model({"x": "-a*x**2 + sin(b*x)"}, initial={"x": 1.0}, estimate=start),
        Record(T[::10], {"x": np.exp(-T[::10])}, sigma={"x": 0.01}),
        method=method,
        max_iterations=1,
    )
    assert found.std is None
    assert all(
        part["ci95"] is None and part["std"] is None for part in found.to_dict()["parameters"].values()
    )
    assert "determined" not in found.summary()


def test_a_file_asks_for_nuisance_terms(tmp_path):
    text = (
        'per_record = []\n[states]\nx = "v"\nv = "-k*x - c*v"\n[initial]\nx = 1\nv = 0\n'
        '[outputs]\nx = "x"\n[estimate]\nk = 90\nc = 0.5\n[nuisance]\noffset = true\nhum_Hz = {hum}\n'
    )
    path = tmp_path / "model.toml"
    path.write_text(text.format(hum="[50, 16.7]"))
    model = read_ode_model(path)
    hums = [f"hum{f}_{wave}_x" for f in ("50", "16_7") for wave in ("cos", "sin")]
    assert model.parameters == ("k", "c", "offset_x", *hums)
    data = record(0, extra=HUM + 0.1)
    assert within(fit(model, [data, data]))
    path.write_text(text.format(hum="-50"))
    with pytest.raises(ValueError, match=r"nuisance\.hum_Hz"):
        read_ode_model(path)
