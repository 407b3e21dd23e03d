"""Known quantities that change from row to row, [S] (4), and names that differ by case only."""

import numpy as np
import pytest

from rotorid.files import InputError, read_harmonic_model, read_measurements
from rotorid.identify import harmonic_model, identify
from rotorid.identify.amplitudes import experiments

GYRO = [
    "(I*p**2 + b*p + k)*A + G*Omega*p*B = M",
    "(I*p**2 + b*p + k)*B - G*Omega*p*A = 0",
]


def gyroscopic():
    model = harmonic_model(GYRO, known={"I": 0.8}, estimate=["b", "k", "G"])
    truth, w, speed = np.array([3.0, 500.0, 1.3]), np.linspace(8, 60, 7), np.linspace(10, 90, 7)
    rows = []
    for f, n in zip(w, speed, strict=True):  # written out by hand
        p, (b, k, g) = 1j * f, truth
        d = 0.8 * p**2 + b * p + k
        rows.append(np.linalg.solve([[d, g * n * p], [-g * n * p, d]], [1, 0]))
    A, B = np.array(rows).T
    return model, truth, experiments(model, w, {"M": 1.0, "A": A, "B": B, "Omega": speed}, free=False)


def test_a_speed_that_changes_from_row_to_row():
    model, truth, data = gyroscopic()
    assert (model.varying, model.signals, model.inputs) == (("Omega",), ("A", "B", "M"), ("M",))
    found = identify(model, data)
    np.testing.assert_allclose(found.values, truth, rtol=1e-9)
    assert found.warnings == ()
    for name, z in found.predicted.items():
        np.testing.assert_allclose(z, data.signals[name], rtol=1e-9)


def test_free_vibrations_at_several_temperatures():
    model = harmonic_model(["(m*p**2 + k0 + k1*T)*X = F"], known={"m": 2.0}, estimate=["k0", "k1"])
    T = np.array([20.0, 40.0, 70.0])
    data = experiments(model, np.sqrt((5e3 - 12.0 * T) / 2.0), {"X": 1.0, "T": T})
    assert data.free.all()
    np.testing.assert_allclose(identify(model, data).values, [5e3, -12.0], rtol=1e-9)


def test_a_force_that_grows_with_the_speed_and_a_quotient():
    model = harmonic_model(
        ["(m*p**2 + b*p + c/Omega)*X = u*Omega**2"],
        known={"m": 2.0},
        estimate=["b", "c", "u"],
        varying=["Omega"],
    )
    w = np.array([3.0, 5.0, 9.0, 14.0])
    x = 0.3 * w**2 / (-2 * w**2 + 4j * w + 800 / w)
    data = experiments(model, w, {"X": x, "Omega": w})
    np.testing.assert_allclose(identify(model, data).values, [4, 800, 0.3], rtol=1e-9)
    with pytest.raises(ValueError, match="divides by Omega, which is 0"):
        identify(model, experiments(model, w, {"X": x, "Omega": np.array([0.0, 1, 2, 3])}))


def read(tmp_path, table, equations=GYRO, more=""):
    model, data = tmp_path / "model.toml", tmp_path / "data.csv"
    model.write_text(f'equations = {equations}\nestimate = ["b", "k", "G"]\nknown = {{ I = 0.8 }}\n{more}')
    data.write_text(table)
    return read_measurements(data, read_harmonic_model(model))


def test_columns_of_a_table(tmp_path):
    head = "frequency_rad_s,M_re,A_re,A_im,B_re,B_im"
    rows = [f"{w},1,0.1,0.01,0.02,{w}" for w in (10, 20)]
    for name, cells, values in (
        ("Omega", "10 20", [10, 20]),
        ("Omega_re", "10 20", [10, 20]),
        ("Omega_rpm", "30 60", [np.pi, 2 * np.pi]),
        ("Omega", "10 ", [10, np.nan]),
    ):
        whole = [f"{head},{name}", *(f"{r},{c}" for r, c in zip(rows, cells.split(" "), strict=True))]
        found = read(tmp_path, "\n".join(whole) + "\n")
        np.testing.assert_allclose(found.varying["Omega"], values)
    result = identify(read_harmonic_model(tmp_path / "model.toml").model, found)
    assert result.left_out[0] == "experiment 2: left out, for not every input or varying quantity is known"
    for name, words in (
        ("Omega_im", "Omega_im"),
        ("note", "a column Omega: the equations multiply amplitudes"),
    ):
        with pytest.raises(InputError, match=words):
            read(tmp_path, f"{head},{name}\n{rows[0]},3\n")
    with pytest.raises(InputError, match=r"a column kk.*did you mean k\?|a column kk.*did you mean 'k'"):
        read(tmp_path, f"{head},Omega\n{rows[0]},3\n", [GYRO[0].replace("+ k)", "+ kk)"), GYRO[1]])


def test_what_is_not_clear_is_refused():
    with pytest.raises(ValueError, match=r"T\*X|X\*T.*under varying"):
        harmonic_model(["(m*p**2*T + k*T)*X = F"], known={"m": 1}, estimate=["k"])
    clear = harmonic_model(["(m*p**2*T + k*T)*X = F"], known={"m": 1}, estimate=["k"], varying=["T"])
    assert clear.signals == ("X", "F")
    with pytest.raises(ValueError, match="not linear in the signals: it contains X\\*Y"):
        harmonic_model(["(m*p**2 + k)*X + k*X*Y = F", "k*Y = X"], known={"m": 1}, estimate=["k"])


def test_a_name_that_differs_by_case_only_is_asked_about():
    right = ["(m*p**2 + k1 + k2)*X1 = k2*X2 + F", "(m*p**2 + k2)*X2 = k2*X1"]
    wrong = [right[0].replace("*X2", "*x2"), right[1]]
    w = np.array([3.0, 5.0, 8.0])
    truth = harmonic_model(right, known={"m": 2.0}, estimate=["k1", "k2"])
    z = truth.predict(np.array([300.0, 200.0]), w, {"F": np.ones(3, dtype=complex)})
    model = harmonic_model(wrong, known={"m": 2.0}, estimate=["k1", "k2"])
    for more in ({}, {"x2": 0.0}):  # a table without the column reads an input as 0
        with pytest.raises(ValueError, match=r"is x2 meant to be X2\?"):
            identify(model, experiments(model, w, {"F": 1.0, **z, **more}, free=False))
    data = experiments(model, w, {"F": 1.0, **z, "x2": z["X2"]}, free=False)
    np.testing.assert_allclose(identify(model, data).values, [300, 200], rtol=1e-9)
