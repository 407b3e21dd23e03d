"""Frequency responses of UFF files for `modes`: two masses whose modes are known."""

from __future__ import annotations

import numpy as np
import pytest

from rotorid.files import InputError
from rotorid.files.measurements import read_amplitudes

pyuff = pytest.importorskip("pyuff")
HERTZ = np.linspace(0.0, 40.0, 401)
M, K, C = np.diag([2.0, 1.0]), np.array([[9e3, -4e3], [-4e3, 4e3]]), np.array([[6.0, -2.0], [-2.0, 2.0]])


def receptances(force=1):
    omega = 2 * np.pi * HERTZ[:, None, None]
    return np.linalg.inv(K + 1j * omega * C - omega**2 * M)[:, :, force]


def write(path, responses, **changed):
    for node, values in enumerate(responses.T, start=1):
        fields = {
            "func_type": 4,
            "rsp_node": node,
            "rsp_dir": 1,
            "ref_node": 2,
            "ref_dir": 1,
            "data": values,
            "x": HERTZ,
            "num_pts": len(HERTZ),
            "abscissa_spacing": 1,
            "abscissa_min": 0.0,
            "abscissa_inc": HERTZ[1],
            "abscissa_spec_data_type": 18,
            "ordinate_spec_data_type": 8,
            "orddenom_spec_data_type": 13,
            "z_axis_spec_data_type": 0,
            "binary": 0,
        }
        one = pyuff.prepare_58(**{**fields, **changed}, id1=f"point {node}")
        pyuff.UFF(str(path)).write_sets(one, "add")
    return path


@pytest.mark.parametrize(
    ("order", "scale", "changed"),
    [
        (0, 1, {}),
        (2, 1, {"ordinate_spec_data_type": 12, "ordinate_axis_units_lab": "m/s^2"}),
        (2, 4.4482216152605 / 9.80665, {"ordinate_axis_units_lab": "g", "orddenom_axis_units_lab": "lbf"}),
    ],
)
def test_responses_become_displacements_by_one_newton(tmp_path, order, scale, changed):
    omega = 2 * np.pi * HERTZ
    path = write(tmp_path / "f.uff", receptances() * (1j * omega[:, None]) ** order * scale, **changed)
    data = read_amplitudes(path)
    np.testing.assert_allclose(data.frequencies, omega[1:], rtol=1e-6)
    assert set(data.signals) == {"point 1", "point 2", "F"}
    found = np.stack([data.signals["point 1"], data.signals["point 2"]], axis=1)
    np.testing.assert_allclose(found, receptances()[1:], rtol=1e-4)
    assert (data.signals["F"] == 1).all()


def test_modes_of_a_file_are_those_of_the_masses(tmp_path, cli):
    path = write(tmp_path / "f.uff", receptances())
    answer = cli("modes", path, "--json").json
    poles = np.linalg.eigvals(
        np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, np.hstack((K, C)))]])
    )
    true = np.sort(np.abs(poles[poles.imag > 0]))
    found = sorted({mode["frequency_rad_s"] for mode in answer["modes"]})
    np.testing.assert_allclose(found, true, rtol=1e-3)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"func_type": 1, "data": np.ones(401)}, "frequency responses (function type 4) in datasets 58"),
        ({"ordinate_spec_data_type": 0}, "displacements, velocities or accelerations by a force"),
    ],
)
def test_what_is_no_response_is_refused(tmp_path, changed, words):
    path = write(tmp_path / "f.uff", receptances(), **changed)
    with pytest.raises(InputError) as caught:
        read_amplitudes(path)
    assert words in str(caught.value)


def test_responses_to_two_forces_and_a_file_without_its_end_are_refused(tmp_path):
    path = write(tmp_path / "f.uff", receptances())
    whole = path.read_bytes()
    write(path, receptances(0), ref_node=1)
    for data, words in ((path.read_bytes(), "of each point, to one force"), (whole[:-100], "a whole file")):
        path.write_bytes(data)
        with pytest.raises(InputError, match=words):
            read_amplitudes(path)
