"""Initial states from the record: `[initial] x = "record"`, with the error of that sample."""

import numpy as np
import pytest
from timedomain_cases import CHAIN_STATES, chain, chain_record

from rotorid.files import read_ode_model, read_record
from rotorid.identify.fit_records import fit
from rotorid.identify.ode import ode_model
from rotorid.identify.records import Record
from rotorid.identify.simulation import simulate
from rotorid.samples import sample_data

FOLDER = sample_data() / "fit" / "three_masses"
FROM_RECORD = {"x": "record", "v": "record"}
TRUTH = {"k": 4.0, "d": 0.4, "x_0": 1.0, "v_0": 0.5}
TIMES = np.linspace(0.0, 3.0, 16)
NOISE = 0.05


def oscillator(initial, **options):
    given = {"outputs": {"x": "x", "v": "v"}, "estimate": {"k": 3.5, "d": 0.3}} | options
    return ode_model({"x": "v", "v": "-k*x - d*v"}, initial=initial, **given)


def drawn(seed, sigma=None, noise=NOISE):
    exact = simulate(oscillator({"x": 1.0, "v": 0.5}), [4.0, 0.4], TIMES, sensitivities=False).y
    y = exact + noise * np.random.default_rng(seed).standard_normal(exact.shape)
    sigma = None if sigma is None else {"x": sigma, "v": sigma}
    return Record(TIMES, {"x": y[:, 0], "v": y[:, 1]}, sigma=sigma)


def test_the_record_of_f_gives_what_known_initial_values_give():
    model = read_ode_model(FOLDER / "from_record.toml")
    found = fit(model, read_record(FOLDER / "record.csv", model), method="gauss-newton", integrator="rk4")
    states = [f"{name}_0" for name in CHAIN_STATES]
    assert found.parameters == ("c1", "m1", "m2", *states)
    truth = [0.14, 12.0, 28.0, 0.5, 0.1, -0.2, -0.1, 0.3, 0.1]
    assert (np.abs(found.values - truth) < 4 * found.std).all()
    assert (found.std < 2e-5 * np.abs(truth)).all()
    np.testing.assert_array_equal(found.history[0, 3:], [0.5, 0.1, -0.2, -0.1, 0.3, 0.1])
    known = fit(chain(), chain_record())
    assert (found.std[:3] > known.std).all()


def test_the_sample_counts_once():
    """The same as a parameter by hand: one row of the first sample, no prior beside it."""
    record = drawn(1, NOISE)
    own = oscillator({"x": "x_0", "v": "v_0"}, estimate={"k": 3.5, "d": 0.3, "x_0": 1.1, "v_0": 0.6})
    by_hand, found = fit(own, record), fit(oscillator(FROM_RECORD), record)
    assert found.parameters == by_hand.parameters
    assert found.values == pytest.approx(by_hand.values, rel=1e-7)
    assert found.std == pytest.approx(by_hand.std, rel=1e-7)
    assert found.estimate.dof == by_hand.estimate.dof == 2 * 16 - 4


def test_without_its_first_sample_a_start_is_less_sure():
    """Of a start that is only an unknown parameter the sample tells the rest: it is in the fit."""
    record = drawn(2, NOISE)
    found = fit(oscillator(FROM_RECORD), record)
    lost = {name: np.where(TIMES == 0, np.nan, y) for name, y in record.outputs.items()}
    own = oscillator({"x": "x_0", "v": "v_0"}, estimate=TRUTH)
    without = fit(own, Record(TIMES, lost, sigma=record.sigma))
    assert (found.std < without.std).all()
    assert found.std[2] < NOISE


def test_every_record_has_its_own_start():
    records = [drawn(3), Record(TIMES + 7.0, drawn(4).outputs, name="b")]
    found = fit(oscillator(FROM_RECORD), records, method="gauss-newton")
    assert found.parameters == ("k", "d", "x_0_1", "x_0_2", "v_0_1", "v_0_2")
    firsts = [records[k].outputs[name][0] for name in ("x", "v") for k in range(2)]
    np.testing.assert_array_equal(found.history[0], [3.5, 0.3, *firsts])


def test_a_start_may_still_be_given():
    found = fit(oscillator(FROM_RECORD), drawn(5), start={"x_0": 2.0}, method="gauss-newton")
    assert found.history[0, 2] == 2.0
    assert found.history[0, 3] != 2.0


def test_one_state_from_the_record_beside_a_known_one():
    found = fit(oscillator({"x": "record", "v": 0.5}), drawn(6))
    assert found.parameters == ("k", "d", "x_0")
    assert found.estimate.dof == 2 * 16 - 1 - 3  # the first sample of v tells nothing


def test_a_name_that_is_taken_is_refused():
    with pytest.raises(ValueError, match="known value x_0: x_0 is already a parameter"):
        oscillator(FROM_RECORD, estimate={"k": 3.5, "d": 0.3}, known={"x_0": 2.0})


@pytest.mark.parametrize(
    ("outputs", "state"),
    [({"x": "x"}, "v"), ({"x": "1000*x", "v": "v"}, "x"), ({"x": "x + 0.1", "v": "v"}, "x")],
)
def test_a_state_that_no_output_measures_by_itself_is_refused(outputs, state):
    words = f'initial {state}: "record" needs an output that is {state} alone'
    with pytest.raises(ValueError, match=words):
        oscillator(FROM_RECORD, outputs=outputs)


def test_a_file_says_it_once(tmp_path):
    text = (FOLDER / "from_record.toml").read_text()
    path = tmp_path / "model.toml"
    path.write_text(text + "\n[nuisance]\noffset = true\n")
    with pytest.raises(ValueError, match='initial y1: "record" needs an output that is y1 alone') as said:
        read_ode_model(path)
    assert len(str(said.value).splitlines()) <= 2
    path.write_text(text.replace('y1 = "record"', 'y1 = "measured"'))
    with pytest.raises(ValueError, match="measured is not defined here"):
        read_ode_model(path)


def test_a_first_sample_that_is_missing_is_said():
    record = drawn(7)
    x = record.outputs["x"].copy()
    x[0] = np.nan
    with pytest.raises(ValueError, match="x has no sample at the first time"):
        fit(oscillator(FROM_RECORD), Record(TIMES, {"x": x, "v": record.outputs["v"]}))
    with pytest.raises(ValueError, match="v has no sample at the first time"):
        fit(oscillator(FROM_RECORD), Record(TIMES, {"x": record.outputs["x"]}))


def test_a_simulation_needs_its_start():
    model = oscillator(FROM_RECORD)
    with pytest.raises(ValueError, match="finite numbers"):
        simulate(model, model.start, TIMES)
