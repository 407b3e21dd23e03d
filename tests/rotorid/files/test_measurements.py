"""Measurement tables for identification: what they mean, and every complaint."""

import math

import numpy as np
import pytest

from rotorid import InputError, read_measurements
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
