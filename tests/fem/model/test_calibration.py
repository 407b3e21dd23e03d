"""What a calibration holds: principal columns of its covariance, lack of fit elsewhere, what is refused."""

import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest

import fem

A = np.array([[2e6, 0.0], [-1e6, 5e5], [0.01, 0.02]])
FOUND = fem.Calibration(
    ("bearing[1].kxx", "bearing[2].kxx", "probe[DE].angle"),
    [1.2e7, 1.1e7, 1.02],
    A @ A.T,
    [100.0, 200.0],
    ("DE", "NDE"),
    [[0.01, 0.02], [0.04, 0.03]],
)


def test_principal_columns_give_the_covariance_in_as_many_directions_as_it_has():
    L = FOUND.columns()
    assert L.shape == (3, 2)
    scale = np.outer(FOUND.std, FOUND.std)
    np.testing.assert_allclose(L @ L.T / scale, FOUND.covariance / scale, atol=1e-14)
    known = replace(FOUND, covariance=np.diag([0.0, 4e10, 1e-4]))
    assert known.columns().shape == (3, 2)
    assert not known.columns()[0].any()
    assert fem.Calibration((), [], np.zeros((0, 0))).columns().shape == (0, 0)
    assert replace(FOUND, covariance=np.zeros((3, 3))).columns().shape == (3, 0)


def test_lack_of_fit_elsewhere_is_that_of_the_nearest_speed_and_the_worst_sensor():
    np.testing.assert_array_equal(
        FOUND.lack_at([0.0, 149.0, 151.0, 1e4], ("NDE", "top")),
        [[0.02, 0.02], [0.02, 0.02], [0.03, 0.04], [0.03, 0.04]],
    )
    nothing = replace(FOUND, speeds=[], sensors=(), lack_of_fit=np.zeros((0, 0)))
    np.testing.assert_array_equal(nothing.lack_at([5.0], ("DE", "NDE")), np.zeros((1, 2)))
    assert FOUND.lack_at([5.0, 6.0], ()).shape == (2, 0)


def test_a_rotor_keeps_its_calibration_and_stays_equal():
    rotor = fem.Rotor([0.1], 0.05, supports=[fem.Support(1, 1e7)], stations={"DE": 1})
    calibrated = replace(rotor, calibration=FOUND)
    assert calibrated == rotor
    assert replace(calibrated, supports=()).calibration is FOUND
    for copied in (pickle.loads(pickle.dumps(calibrated)), copy.deepcopy(calibrated)):
        assert copied == rotor
        np.testing.assert_array_equal(copied.calibration.covariance, FOUND.covariance)
        assert copied.calibration.readings == {"probe[DE].angle": 1.02}
    with pytest.raises(ValueError, match="calibration must be a Calibration"):
        replace(rotor, calibration=3)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"values": [1.0]}, r"values must have the shape \(3,\), not \(1,\)"),
        ({"covariance": np.eye(2)}, r"covariance must have the shape \(3, 3\)"),
        ({"lack_of_fit": [[0.1, 0.1]]}, r"lack_of_fit must have the shape \(2, 2\)"),
        ({"lack_of_fit": [[0.1, -0.1], [0, 0]]}, "not negative"),
        ({"values": [1.0, np.nan, 1.0]}, "values must be finite"),
        ({"covariance": [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]}, "must be symmetric"),
        ({"covariance": np.diag([1.0, -1.0, 1.0])}, "negative in any direction"),
        ({"covariance": [[1, 2, 0], [2, 1, 0], [0, 0, 1]]}, "negative in any direction"),
        ({"names": ("disc.scale",) * 3}, "one of its names comes twice"),
        ({"sensors": ("DE", "DE")}, "one of its sensors comes twice"),
    ],
)
def test_what_is_no_calibration_is_refused(wrong, words):
    with pytest.raises(ValueError, match=words):
        replace(FOUND, **wrong)
