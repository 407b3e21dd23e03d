"""Two structures on the same readings: the F test raises its false alarms as often as it says."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import f

from rotorid.harmonic import AmplitudeErrors, harmonic_model
from rotorid.harmonic.output_identification import identify_outputs
from rotorid.harmonic.simulated_measurements import as_read, forced_vibration, free_vibration
from rotorid.harmonic.structure_comparison import Structure, compare_structures
from rotorid.samples import sample_data

ERRORS = AmplitudeErrors(0.05, np.deg2rad(3))
W = [7.0, 8.0, 9.0, 9.5, 10.0, 10.5, 11.0, 12.0, 13.0]
DAMPED = "(m*p**2 + b*p + c)*X = F"


def model(equation, estimate, **known):
    return harmonic_model([equation], known=known, estimate=[*estimate])


MASS = model(DAMPED, ["c", "b", "m"])
FIXED = model(DAMPED, ["c", "b"], m=10.0)
TASK = sample_data() / "identify" / "task_5_1"


def readings(mass=10.0, seed=0, stated=True):
    exact = forced_vibration(MASS, np.array([1000.0, 10.0, mass]), W, {"F": 10.0})
    data = as_read(exact, ["X"], ERRORS, seed=seed)
    return data if stated else replace(data, errors=None)


def compared(small, large, data):
    pair = Structure("small", small, data, {}, {}), Structure("large", large, data, {}, {})
    return compare_structures(pair)


def test_f_is_that_of_the_misfits_and_of_linear_regression():
    """With errors that are the same for all readings, and a response linear in the parameters."""
    flat = AmplitudeErrors(floor=0.02)
    line, slope = model("X = k*F", ["k"]), model("X = (k + d*p)*F", ["k", "d"])
    exact = forced_vibration(slope, np.array([1.0, 0.002]), W, {"F": 1.0})
    data = as_read(exact, ["X"], flat, seed=4)
    found = compared(line, slope, data)
    z = data.signals["X"]
    one = z - z.real.mean()
    two = one - 1j * np.array(W) * (np.array(W) @ z.imag) / np.sum(np.square(W))
    misfits = [np.sum(np.abs(r) ** 2) / 0.02**2 for r in (one, two)]
    assert np.allclose(found.misfits, misfits, rtol=1e-9)
    assert found.dof == (17, 16)
    assert np.isclose(found.f_test[0], (misfits[0] - misfits[1]) / (misfits[1] / 16), rtol=1e-9)
    assert np.isclose(found.f_test[1], f.sf(found.f_test[0], 1, 16), rtol=1e-9)


def test_the_order_of_the_models_changes_nothing():
    data = readings(10.2)
    there, back = compared(FIXED, MASS, data), compared(MASS, FIXED, data)
    assert (there.special, back.special) == (0, 1)
    assert np.isclose(there.f_test[1], back.f_test[1], rtol=1e-6)


def test_models_that_are_no_special_case_have_no_f_test():
    """Another mass and no mass to estimate, or hysteresis in place of a damper: neither holds the other."""
    heavy = model(DAMPED, ["c", "b"], m=11.0)
    hysteretic = model("(m*p**2 + c + h*p**3)*X = F", ["c", "h", "m"])
    for small, large in ((heavy, FIXED), (FIXED, hysteretic)):
        found = compared(small, large, readings())
        assert (found.special, found.f_test) == (None, None)
        assert "the F test does not apply" in found.summary()


def test_the_same_model_in_other_parameters_is_told():
    other = model("(p**2 + d*p + k)*X = g*F", ["k", "d", "g"])
    found = compared(other, MASS, readings())
    assert np.isclose(*found.misfits, rtol=1e-9)
    assert "no such readings tell them apart" in found.summary()


def within(bounds, equation=DAMPED, estimate=("c", "b", "m"), data=None):
    one = model(equation, estimate)
    pair = Structure("plain", MASS, data, {}, {}), Structure("bounded", one, data, bounds, {})
    return compare_structures(pair)


THIRD = {"equation": "(T*p**3 + m*p**2 + b*p + c)*X = F", "estimate": ("T", "m", "b", "c")}


def test_bounds_that_leave_the_special_case_out():
    """Without the term T = 0, so that a model with T from 0.01 does not hold the plain one."""
    found = within({"T": (0.01, 1.0)}, **THIRD, data=readings())
    assert (found.special, found.f_test) == (None, None)
    assert "the F test does not apply" in found.summary()


def test_a_special_case_at_a_bound_is_told_and_not_tested():
    exact = forced_vibration(model(**THIRD), np.array([-0.3, 10.0, 10.0, 1000.0]), W, {"F": 10.0})
    data = as_read(exact, ["X"], ERRORS)
    found = within({"T": (0.0, 1.0)}, **THIRD, data=data)
    assert (found.special, found.f_test) == (0, None)
    said = found.summary()
    assert "no F test: a parameter stands at its bound" in said
    assert "no such readings tell them apart" not in said


def test_the_same_model_within_bounds_is_the_special_case():
    found = within({"m": (10.5, 11.0)}, data=readings())
    assert (found.special, found.f_test) == (1, None)
    assert found.misfits[1] > found.misfits[0] + 1
    assert "no such readings tell them apart" not in found.summary()


def test_bounds_of_both_around_the_estimate_change_nothing():
    data = readings()
    near = {"b": (0.0, 1.01 * identify_outputs(FIXED, data).value("b"))}
    small, large = (
        Structure(one, one_model, data, near, {}) for one, one_model in (("s", FIXED), ("l", MASS))
    )
    assert compare_structures((small, large)).special == 0


def test_a_phase_without_an_error_is_not_tested():
    """It counts with a hundredth of the amplitude's error: 14 of 100 such F were above the level of 5 %."""
    data = replace(readings(), errors=AmplitudeErrors(0.05))
    found = compared(FIXED, MASS, data)
    assert (found.special, found.f_test) == (0, None)
    assert "no F test: an amplitude or a phase counts as exact" in found.summary()


def test_exact_readings_are_not_tested():
    exact = forced_vibration(FIXED, np.array([1000.0, 10.0]), W, {"F": 10.0})
    found = compared(FIXED, MASS, exact)
    assert found.f_test is None
    assert "no F test" in found.summary()


def test_natural_modes_are_compared_too():
    chain = ["(m1*p**2 + c1 + c2)*X1 - c2*X2 = 0", "-c2*X1 + (m2*p**2 + c2)*X2 = 0"]
    known = harmonic_model(chain, known={"m1": 2.0, "m2": 1.0}, estimate=["c1", "c2"])
    free = harmonic_model(chain, known={"m1": 2.0}, estimate=["c1", "c2", "m2"])
    exact = free_vibration(free, np.array([100.0, 50.0, 1.0]), {})
    data = replace(exact, signals={**exact.signals, "X2": exact.signals["X2"] * np.array([1.02, 0.99])})
    found = compared(known, free, data)
    assert found.special == 0
    assert found.dof == (2, 1)
    assert 0 < found.f_test[1] < 1


UNDAMPED = 'equations = ["(m*p**2 + c)*X = F"]\nknown = { m = 10.0 }\nestimate = ["c"]\n'


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--design", "1:2:1"], "--design belongs to one model"),
        (["--loss", "huber"], "--loss belongs to one model"),
        (["--plot", "x.png"], "have no picture"),
        (["--report", "x.html"], "have no sheet"),
    ],
)
def test_options_of_one_model_are_refused(cli, tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "u.toml").write_text(UNDAMPED)
    found = cli("identify", "u.toml", TASK / "model.toml", TASK / "data.csv", *words)
    assert (found.code, found.out) == (2, "")
    assert said in found.err
    assert not (tmp_path / "x.png").exists()


def test_models_must_read_the_same(cli, tmp_path):
    (tmp_path / "e.toml").write_text(UNDAMPED + "[errors]\namplitude_percent = 1\n")
    model, data = TASK / "model.toml", TASK / "data.csv"
    assert "state different errors" in cli("identify", tmp_path / "e.toml", model, data).err
    assert "two models are compared, not 3" in cli("identify", model, model, model, data).err
    (tmp_path / "u.toml").write_text(UNDAMPED)
    found = cli("identify", tmp_path / "u.toml", model, data, "--amplitude-error", "2", "--phase-error", "1")
    assert "u.toml: the residuals at the starting values are not finite" in found.err
    pair = [Structure(name, FIXED, readings(), {}, {}) for name in ("a", "b")]
    pair[1] = replace(pair[1], data=pair[1].data.take([0, 1, 2]))
    with pytest.raises(ValueError, match="the models predict different readings"):
        compare_structures(pair)
