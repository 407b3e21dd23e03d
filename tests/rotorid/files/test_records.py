"""Model files and time records: what is read, and what is said about everything that cannot be used."""

import re

import numpy as np
import pytest
from cases import each_of

from rotorid.files import InputError, read_ode_model, read_record

MODEL = """
inputs = ["u"]
[states]
x = "v"
v = "-k*x - c*v + u"
[initial]
x = "x0"
v = 0
[outputs]
y = "x"
z = "2*v"
[estimate]
k = 2
c = 0.1
x0 = 1.0
[known]
g = 9.81
[bounds]
c = [0, inf]
"""
GOOD = "t_s,y,z,u\n0,1,2,3\n0.1,1.5,2.5,3.5\n0.2,2,3,4\n"


@pytest.fixture
def model(tmp_path):
    return read_ode_model(saved(tmp_path, "model.toml", MODEL))


def saved(folder, name, text):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def refusal(read):
    with pytest.raises(InputError) as caught:
        read()
    return str(caught.value)


def test_a_model_file_with_everything(model):
    assert model.states == ("x", "v")
    assert model.parameters == ("k", "c", "x0")
    assert model.outputs == ("y", "z")
    assert model.inputs == ("u",)
    np.testing.assert_array_equal(model.start, [2.0, 0.1, 1.0])
    np.testing.assert_array_equal(model.bounds[1], [0.0, np.inf])
    np.testing.assert_allclose(model.f(0.0, [1.0, 2.0], [2.0, 0.1, 1.0], [3.0])[:, 0], [2.0, 0.8])
    np.testing.assert_allclose(model.x0([2.0, 0.1, 7.0])[:, 0], [7.0, 0.0])


@each_of(
    ("old", "new", "said"),
    [
        ("-k*x - c*v + u", "-k*x - c*v + w", "state v: .*w is not defined here"),
        ('x = "x0"\n', "", "the value of the state x is missing"),
        ('x = "x0"\n', 'x = "u"\n', "initial x: .*u is not defined here"),
        ("c = [0, inf]", "c = [1, 2]", "key bounds: .*of c, .*starting value"),
        ('inputs = ["u"]', 'inputs = ["u", "x"]', "input x: x is already a state"),
    ],
)
def test_complaints_about_a_model_file_name_the_key(tmp_path, old, new, said):
    assert old in MODEL
    path = saved(tmp_path, "m.toml", MODEL.replace(old, new, 1))
    message = refusal(lambda: read_ode_model(path))
    assert re.search(said, message), message
    assert str(path) in message


def test_milliseconds_and_european_excel(tmp_path, model):
    text = "t_ms;u;z;y\n0;1,5;2;3\n100;1,25;2;3\n"
    record = read_record(saved(tmp_path, "r.csv", text), model)
    np.testing.assert_array_equal(record.t, [0, 0.1])
    np.testing.assert_array_equal(record.inputs["u"], [1.5, 1.25])
    np.testing.assert_array_equal(record.outputs["z"], [2, 2])
    assert record.name == str(tmp_path / "r.csv")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "0.2,2,3,4",
            "0.1,2,3,4",
            r"row 4, column t_s: found '0.1', expected a time above 0.1 of row 3: sort",
        ),
        ("0.2,2,3,4", "0.2,,3,4", r"row 4, column y: found nothing .*--allow-missing"),
        ("t_s,y,z,u", "t_s,y,zz,u", r"column zz: .*did you mean 'z'"),
        ("t_s,y,z,u", "t_s,y_mm,z,u", r"column y_mm: .*without a unit"),
    ],
)
def test_complaints_about_a_record_name_row_and_column(tmp_path, model, old, new, said):
    message = refusal(lambda: read_record(saved(tmp_path, "r.csv", GOOD.replace(old, new)), model))
    assert re.search(said, message), message


def test_a_missing_column_is_named(tmp_path, model):
    path = saved(tmp_path, "r.csv", "t_s,y,u\n0,1,2\n1,2,3\n")
    assert "column z" in refusal(lambda: read_record(path, model))
    record = read_record(path, model, allow_missing=True)
    assert set(record.outputs) == {"y"}
    path = saved(tmp_path, "s.csv", "t_s,u\n0,1\n1,2\n")
    assert "at least one output" in refusal(lambda: read_record(path, model, allow_missing=True))


def test_missing_samples_are_honoured_where_the_user_says_so(tmp_path, model):
    text = GOOD.replace("0.2,2,3,4", "0.2,,NaN,4")
    record = read_record(saved(tmp_path, "r.csv", text), model, allow_missing=True)
    np.testing.assert_array_equal(np.isnan(record.outputs["y"]), [False, False, True])
    np.testing.assert_array_equal(np.isnan(record.outputs["z"]), [False, False, True])
    broken = saved(tmp_path, "s.csv", GOOD.replace("0.2,2,3,4", "0.2,2,3,nan"))
    assert "column u" in refusal(lambda: read_record(broken, model, allow_missing=True))


MATRICES = """
M = [["m1", 0], [0, 2.0]]
K = [["k + 1", -1], [-1, 3]]
coordinates = ["a", "b"]
[force]
b = "cos(t)"
[initial]
a = 0.5
[estimate]
m1 = 4.0
k = 1.0
"""


def test_a_model_of_matrices(tmp_path):
    model = read_ode_model(saved(tmp_path, "m.toml", MATRICES))
    assert model.states == ("a", "v_a", "b", "v_b")
    assert model.outputs == ("a", "b")
    rates = model.f(0.0, [1.0, 0.3, 2.0, 0.4], model.start)[:, 0]
    np.testing.assert_allclose(rates, [0.3, (-2 + 2) / 4, 0.4, (1 + 1 - 6) / 2], atol=1e-15)
    np.testing.assert_array_equal(model.x0(model.start)[:, 0], [0.5, 0, 0, 0])


@each_of(
    ("old", "new", "said"),
    [
        ("a = 0.5", "c = 0.5", "initial: c is no state"),
    ],
)
def test_complaints_about_matrices(tmp_path, old, new, said):
    assert old in MATRICES
    message = refusal(lambda: read_ode_model(saved(tmp_path, "m.toml", MATRICES.replace(old, new, 1))))
    assert re.search(said, message), message
