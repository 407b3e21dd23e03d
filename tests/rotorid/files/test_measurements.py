"""Measurement tables and model files for identification: what they mean, and every complaint."""

import math

import numpy as np
import pytest
from cases import each_of

from rotorid import InputError, read_harmonic_model, read_measurements
from rotorid.identify.equations import harmonic_model

MODEL = harmonic_model(["(m*p**2 + b*p + c)*X = F"], known={"m": 10.0}, estimate=["c", "b"])
TWO = harmonic_model(
    ["(m*p**2 + c)*X - k*Y = F", "(m*p**2 + c)*Y - k*X = 0"], known={"m": 1.0}, estimate=["c", "k"]
)


@pytest.fixture
def table(tmp_path):
    def write(text, model=MODEL, name="data.csv"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return read_measurements(path, model)

    return write


@pytest.fixture
def model_file(tmp_path):
    def write(text):
        path = tmp_path / "harmonic.toml"
        path.write_text(text, encoding="utf-8")
        return read_harmonic_model(path)

    return write


def test_real_and_imaginary_parts_and_amplitude_with_phase_are_the_same(table):
    a = table("frequency_rad_s,F_re,X_re,X_im\n10,10,0,-0.1\n20,10,-3,4\n")
    degrees = math.degrees(math.atan2(4, -3))
    b = table(f"frequency_rad_s,F_amplitude,F_phase_deg,X_amplitude,X_phase_deg\n10,10,0,0.1,-90\n20,10,0,5,{degrees!r}\n")  # fmt: skip  # noqa: E501
    np.testing.assert_allclose(a.signals["X"], [-0.1j, -3 + 4j])
    np.testing.assert_allclose(b.signals["X"], a.signals["X"], rtol=1e-14, atol=0)
    np.testing.assert_array_equal(a.signals["F"], [10, 10])
    assert (a.names, a.free.any()) == (("1", "2"), False)


@pytest.mark.parametrize(
    ("column", "value", "omega"),
    [("frequency_rad_s", "5", 5.0), ("frequency_Hz", "5", 10 * math.pi), ("speed_rpm", "60", 2 * math.pi)],
)
def test_units(table, column, value, omega):
    rows = table(f"{column},F_re,X_amplitude_um_pp,X_phase_deg\n{value},1,30,90\n")
    assert rows.frequencies == pytest.approx([omega], rel=1e-15)
    assert rows.signals["X"] == pytest.approx([15e-6j])  # a positive phase leads


def test_blank_amplitudes_were_not_measured(table):
    rows = table("frequency_rad_s,F_re,X_amplitude,X_phase_deg,Y_re,Y_im\n1,1,,,2,3\n2,1,0,,,\n", TWO)
    np.testing.assert_array_equal(np.isnan(rows.signals["X"]), [True, False])
    np.testing.assert_array_equal(np.isnan(rows.signals["Y"]), [False, True])
    assert rows.signals["X"][1] == 0


@pytest.mark.parametrize(
    "text", ["frequency_rad_s,X_re,Y_re\n1,1,2\n", "frequency_rad_s,F_re,X_re,Y_re\n1,0,1,2\n"]
)
def test_without_a_force_it_is_a_free_vibration(table, text):
    rows = table(text, TWO)
    assert rows.free.all()
    np.testing.assert_array_equal(rows.signals["F"], [0])


HEAD = "frequency_rad_s,F_re,X_re,X_im\n"


@pytest.mark.parametrize(
    ("text", "messages"),
    [
        ("frequency_rad_s,F_re,X_re,X_imag\n1,1,2,3\n", ["X_imag", "did you mean 'X_im'"]),
        (HEAD + "1,1,x,3\n", ["row 2", "X_re", "'x'"]),
        (HEAD + "1,1,2,\n", ["row 2", "X_im", "as X_re has"]),
        (HEAD + "1,0,2,3\n", ["row 2", "X_im", "an amplitude of F that excites"]),
        ("frequency_rad_s,F_re,X_amplitude,X_phase_deg\n1,1,2,400\n", ["-360 to 360"]),
        ("frequency_rad_s,F_re,X_re_furlong\n1,1,2\n", ["no unit (the model's own) or one of m, "]),
        ("experiment,frequency_rad_s,F_re,X_re,X_im\na,1,1,2,3\na,2,1,2,3\n", ["row 3", "repeat"]),
    ],
)
def test_complaints_name_file_row_and_column(table, text, messages):
    with pytest.raises(InputError) as caught:
        table(text)
    for message in ("data.csv", *messages):
        assert message in str(caught.value)


def test_repeated_readings_stay_apart(table):
    rows = table("experiment,repeat,frequency_rad_s,F_re,X_re,X_im\na,1,1,1,2,3\na,2,1,1,2.1,3\n")
    assert rows.names == ("a, 1", "a, 2")
    np.testing.assert_array_equal(rows.signals["X"], [2 + 3j, 2.1 + 3j])


SMALL = 'equations = ["(m*p**2 + b*p + c)*X = F"]\nknown = { m = 10.0 }\nestimate = ["c", "b"]\n'


def test_a_model_file(model_file):
    file = model_file(
        SMALL
        + 'inputs = ["F"]\n[bounds]\nc = [0, 2e6]\nb = [0, inf]\n[start]\nc = 900\n'
        + "[errors]\namplitude_percent = 2\nphase_deg = 1\nfloor = 1e-6\n"
    )
    assert file.model.parameters == ("c", "b")
    assert file.model.known == {"m": 10.0}
    assert file.model.inputs == ("F",)
    assert file.bounds == {"c": (0.0, 2e6), "b": (0.0, math.inf)}
    assert file.start == {"c": 900.0}
    assert (file.errors.relative, file.errors.floor) == (0.02, 1e-6)
    assert file.errors.phase == pytest.approx(math.radians(1))


@each_of(
    "old, new, words",
    [
        ("equations", "equation", "key equation: .*did you mean 'equations'"),
        ('["(m', '["n = 1", "(n', "equation 2.* n"),
        ("X = F", "X*X = F", "equation 1.*linear"),
        ('["c", "b"]', '["c", "k"]', "k .*stands in no equation"),
        ('["c", "b"]', '["c", "b", "m"]', "known value m: m is already a parameter"),
        ('b"]\n', 'b"]\n[bounds]\nd = [0, 1]\n', "key bounds.*names of estimate; d is none"),
        ('b"]\n', 'b"]\n[bounds]\nc = [1, 1]\n', r"key bounds.*\[lowest, highest\] of c"),
        ('b"]\n', 'b"]\n[bounds]\nc = [false, 1]\n', "key bounds.c: found 'false'"),
    ],
)
def test_complaints_about_a_model_file_name_the_key(model_file, old, new, words):
    with pytest.raises(InputError, match=rf"(?s)harmonic\.toml.*{words}"):
        model_file(SMALL.replace(old, new, 1))


EVIL = "__import__('pathlib').Path('{}').touch()"


@each_of(
    "text",
    [
        'equations = ["EVIL = F"]\nestimate = ["c"]\n',
        'equations = ["c*X = F"]\nestimate = ["c"]\ninputs = ["EVIL"]\n',
        'equations = ["c*X = F"]\nestimate = ["c"]\n[known]\n"EVIL" = 1\n',
        'equations = ["c*X = F"]\nestimate = ["c"]\n[bounds]\nc = ["EVIL", 1]\n',
        'estimate = ["c"]\nM = [[1]]\nK = [["c"]]\noutputs = { "EVIL" = "y1", z = "EVIL" }\n',
    ],
)
def test_no_text_of_a_model_file_runs_code(model_file, tmp_path, text):
    mark = tmp_path / "mark"
    with pytest.raises(InputError, match=r"harmonic\.toml"):
        model_file(text.replace("EVIL", EVIL.format(mark)))
    assert not mark.exists()
