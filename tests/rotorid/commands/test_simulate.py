"""`simulate`: the direct problem, and lesson 5's way back: compute, round, estimate."""

import csv

import numpy as np
import pytest

from rotorid.commands.simulate import SimulateOptions, simulate
from rotorid.files import read_measurements
from rotorid.identify import AmplitudeErrors, harmonic_model
from rotorid.samples import sample_data

IDENTIFY, FIT = sample_data() / "identify", sample_data() / "fit"
TRUTH = {
    "section_1_6": ("alpha1=50,alpha=-15,alpha2=40", "20,30,45", "F1=100"),
    "section_1_7": ("c=1e5,b=200,q=5000", "60,90,110,140", "Ux=0.001,Uy=0.001@-90"),
    "task_1_1": ("a1=20,a12=30,a2=10", "25,45", "F=100"),
    "task_2_1": ("a1=2,a2=10,a3=8", "1,2,4", "F=1"),
    "task_3_3": ("T0=1,T1=0.2,T2=0.8", "0.5,1,2,4,8", "F=1"),
    "task_4_1": ("c=1e5,b=1e4,delta=0.5", "80:120:20", None),
    "task_4_2": ("T1=0.2,zeta=0.3,T2=0.8", "1,2,4", "F=1"),
}


def task(name):
    return IDENTIFY / name / "model.toml"


def printed(path):
    with path.open(encoding="utf-8-sig") as stream:
        return list(csv.reader(stream))


def amplitudes(cli, tmp_path, name, values, frequencies, inputs, *more):
    """The table that the command writes."""
    file = tmp_path / f"{name}.csv"
    excited = ["--inputs", inputs] if inputs else []
    words = [task(name), "--with", values, "--frequencies", frequencies, *excited, *more, "--output", file]
    found = cli("simulate", *words)
    assert (found.code, found.err) == (0, ""), found.err
    return file


@pytest.mark.parametrize("name", TRUTH)
def test_amplitudes_are_those_of_the_equations_typed_apart(cli, tmp_path, name):
    """`make_data.py` solves the equations without the program."""
    values, frequencies, inputs = TRUTH[name]
    parameters = read_harmonic(name).model.parameters
    values = ",".join(part for part in values.split(",") if part.split("=")[0] in parameters)
    own = read_harmonic(name)
    got = read_measurements(amplitudes(cli, tmp_path, name, values, frequencies, inputs), own)
    known = read_measurements(IDENTIFY / name / "data_exact.csv", own)
    assert np.allclose(got.frequencies, known.frequencies, rtol=1e-15)
    for signal in own.model.outputs:
        assert np.allclose(got.signals[signal], known.signals[signal], rtol=1e-12), signal


def read_harmonic(name):
    from rotorid.files import read_harmonic_model

    return read_harmonic_model(task(name))


def test_the_record_of_f_to_its_five_digits(cli, tmp_path):
    file = tmp_path / "f.csv"
    words = "--with", "c1=0.14,m1=12,m2=28", "--times", "0:50:0.2", "--digits", "5"
    cli("simulate", FIT / "three_masses" / "model.toml", *words, "--output", file)
    got, known = printed(file), printed(FIT / "three_masses" / "record.csv")
    assert got[0] == known[0]
    assert np.array_equal(np.array(got[1:], dtype=float), np.array(known[1:], dtype=float))


def test_a_driven_record_takes_times_and_inputs_of_another(cli, tmp_path):
    model, given, file = (tmp_path / name for name in ("m.toml", "u.csv", "y.csv"))
    model.write_text('inputs = ["u"]\n[states]\nx = "u - a*x"\n[initial]\nx = 0\n[estimate]\na = 1\n')
    given.write_text("t_ms,u\n0,1\n500,1\n2000,1\n")
    found = cli("simulate", model, "--with", "a=2", "--times", given, "--output", file)
    assert found.code == 0, found.err
    table = np.array(printed(file)[1:], dtype=float)
    assert np.allclose(table[:, 1], (1 - np.exp(-2 * np.array([0, 0.5, 2]))) / 2, rtol=1e-9)
    assert printed(file)[0] == ["t_s", "x", "u"]
    assert abs(cli("fit", model, file, "--json").json["parameters"]["a"]["value"] - 2) < 1e-6
    assert "give a record of it" in cli("simulate", model, "--with", "a=2", "--times", "0:1:0.5").err


ERRORS = AmplitudeErrors(0.04, np.deg2rad(5), 0.01)


def test_drawn_errors_have_the_covariance_that_identify_takes():
    z = np.repeat([0.5 + 0.5j, -0.1j, 2.0 + 0j], 20000)
    drawn = ERRORS.drawn(z, np.random.default_rng(0))
    for k, stated in enumerate(ERRORS.covariance(z[::20000])):
        gap = (drawn - z)[k * 20000 : (k + 1) * 20000]
        found = np.cov(np.array([gap.real, gap.imag]))
        assert np.allclose(found, stated, atol=0.03 * np.trace(stated))


def test_the_same_seed_is_the_same_table_and_another_is_not():
    def table(**more):
        options = {"parameters": "c=1000,alpha=10", "frequencies": [10.0], "inputs": {"F": 10.0}, **more}
        return simulate(task("task_5_1"), SimulateOptions(**options)).to_frame()["X_im"][0]

    one = table(errors=(2.0, 0.0))
    assert one == table(errors=(2.0, 0.0), seed=0) != table(errors=(2.0, 0.0), seed=1)
    assert abs(one + 0.1) > 1e-6
    assert table() == -0.1


def test_what_changes_from_row_to_row_is_a_column(tmp_path):
    model = harmonic_model(
        ["(m*p**2 + b*p + c)*X + g*Omega*X = F"], known={"m": 1.0}, estimate=["c", "b", "g"]
    )
    assert model.varying == ("Omega",)
    values = {"c": 100.0, "b": 1.0, "g": 0.5}
    options = {"parameters": values, "frequencies": "5,10", "inputs": "F=1,Omega=20"}
    table, w = simulate(model, SimulateOptions(**options)).to_frame(), np.array([5.0, 10.0])
    assert table["Omega"].tolist() == [20.0, 20.0]
    assert np.allclose(table["X_re"] + 1j * table["X_im"], 1 / (110 - w**2 + 1j * w))
    with pytest.raises(ValueError, match="--inputs: the value of Omega is missing"):
        simulate(model, SimulateOptions(**{**options, "inputs": "F=1"}))


@pytest.mark.filterwarnings("default:.*blow. in no equation of amplitudes")
def test_amplitudes_without_a_sensor_are_not_written(cli, tmp_path):
    """The run-down file shows readings in µm in place of the coordinates."""
    words = "--modes", "--with", "d_x7=900,d_x12=1600,d_x18=1300,m_x12=196.6167587206449"
    found = cli("simulate", FIT / "run_down" / "model.toml", *words, "--json").json
    assert found["signals"] == ["frequency_rad_s", "drive_end_re", "middle_re", "free_end_re"]
    assert abs(found["values"][0][0] - 135.2358) < 1e-3
    model = tmp_path / "m.toml"
    model.write_text(
        'coordinates = ["x", "y"]\nM = [[1, 0], [0, "m"]]\nK = [["100 + k", "-k"], ["-k", "k"]]\n'
        'inputs = ["F"]\n[force]\nx = "F"\n[outputs]\nx = "x"\n[estimate]\nm = 1\nk = 1\n'
    )
    words = "--with", "m=2,k=50", "--frequencies", "3", "--inputs", "F=1"
    found = cli("simulate", model, *words, "--json").json
    assert found["signals"] == ["frequency_rad_s", "F_re", "F_im", "x_re", "x_im"]
    assert np.isclose(found["values"][0][3], np.linalg.solve([[150 - 9, -50], [-50, 50 - 18]], [1, 0])[0])


UNDAMPED = 'equations = ["(m*p**2 + c)*X = F"]\nknown = { m = 10.0 }\nestimate = ["c"]\n'


@pytest.mark.parametrize(
    ("equation", "value", "frequency", "why"),
    [
        ("(m*p**2 + c)*X = F", 1000.0, "10", "a resonance without damping"),
        ("(m*p**2 + c)*X = F", 1000.0 * 1.1**2, "11", "a resonance without damping"),
        ("(m*p**2 + c*p)*X = F", 1.0, "0", "nothing holds it at rest"),
        ("(m + c/p**2)*X = F", 1000.0, "0", "the frequency 0 cannot be used"),
    ],
)
def test_a_frequency_without_an_amplitude_is_named(cli, tmp_path, equation, value, frequency, why):
    model, out = tmp_path / "u.toml", tmp_path / "out.csv"
    model.write_text(UNDAMPED.replace("(m*p**2 + c)*X = F", equation))
    words = "--with", f"c={value!r}", "--frequencies", frequency, "--inputs", "F=1", "--output", out
    found = cli("simulate", model, *words)
    assert found.code == 2
    assert why in found.err
    assert not out.exists()


def test_a_sharp_resonance_is_none_without_damping(cli, tmp_path):
    """One part in a million: Q = 1e6 is computed, to the digits of the closed form."""
    words = "--with", "c=1000,alpha=1e-4", "--frequencies", "10", "--inputs", "F=1"
    found = cli("simulate", task("task_5_1"), *words, "--json").json
    assert np.isclose(found["values"][0][found["signals"].index("X_im")], -1000.0, rtol=1e-12)


def test_lesson_7_rounds_z_first(cli, tmp_path):
    """Task 7.1: z = 150, 690, 2400, shapes by the last two equations; z³ − 3250 z² + … by hand."""
    file = tmp_path / "modes.csv"
    words = [task("task_7_1"), "--with", "c1=1e4,c2=2e4,c3=5e3", "--modes", "--round", "z:2"]
    found = cli("simulate", *words, "--output", file)
    book = np.array(printed(IDENTIFY / "task_7_1" / "data.csv")[1:], float)
    np.testing.assert_allclose(np.array(printed(file)[1:], float), book, rtol=1e-12)
    # det(K - z M) over -m1 m2 m3 of the chain c1, c2, c3 with masses 20, 20, 10
    assert "z**3 - 3250*z**2 + 2.125e+06*z - 2.5e+08 = 0" in found.out.replace("\n  ", " ")
