"""Time records: what is read, and what is said about everything that cannot be used."""

import re

import numpy as np
import pytest

from rotorid.files import InputError, read_ode_model, read_record

MODEL = """
inputs = ["u"]
estimate = {}
[states]
x = "u"
[initial]
x = 0
[outputs]
y = "x"
z = "2*x"
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
