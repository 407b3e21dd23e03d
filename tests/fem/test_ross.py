"""Side by side with ROSS on random rotors; how its answers were made: tests/data/README.md.

Without shear both programs have the same cubic elements with rotary inertia and gyroscopic effect, so answers
must agree on the mesh as it is; what is left is rounding, most of it in ROSS (measured against
tests/helpers/dense_rotor.py: 6e-10 of λ). With shear the elements differ: ROSS' converges as h², that of
`fem` as h⁴. There ROSS' extrapolated limit is compared with `fem` on a mesh 24 times finer.
"""

import numpy as np
import pytest
import ross_rotors

import fem
from fem import whirl_modes

FINER = 24


@pytest.mark.parametrize("data", ross_rotors.NO_SHEAR, ids=ross_rotors.label)
def test_whirl_without_shear(data):
    rotor = ross_rotors.build(data)
    for answer in data["answers"]:
        # The fast way promises 1e-7; log decrements are those 1e-9 of λ by the size of Re λ.
        compare_whirl(whirl_modes(rotor, answer["speed"], 6), answer, 1e-8, 1e-7)


@pytest.mark.parametrize("data", ross_rotors.SHEAR, ids=ross_rotors.label)
def test_whirl_with_shear(data):
    rotor = ross_rotors.build(data, FINER)
    for answer in data["answers"]:
        assert max(answer["error_wd"], answer["error_log_dec"]) < 5e-7
        compare_whirl(whirl_modes(rotor, answer["speed"], 6), answer, 1e-6, 1e-6)


@pytest.mark.parametrize("data", ross_rotors.NO_SHEAR, ids=ross_rotors.label)
def test_unbalance_response_without_shear(data):
    response = fem.unbalance_response(ross_rotors.build(data), ross_rotors.unbalance(data), data["speeds"])
    for x, y, answer in zip(response.x, response.y, data["answers"], strict=True):
        compare_response(np.array([x, y]), answer, 1e-9)


@pytest.mark.parametrize("data", ross_rotors.SHEAR, ids=ross_rotors.label)
def test_unbalance_response_with_shear(data):
    response = fem.unbalance_response(
        ross_rotors.build(data, FINER), ross_rotors.unbalance(data, FINER), data["speeds"]
    )
    for x, y, answer in zip(response.x, response.y, data["answers"], strict=True):
        assert answer["error_response"] < 2e-7
        compare_response(np.array([x[::FINER], y[::FINER]]), answer, 1e-6)


def compare_whirl(modes, answer, frequency, decrement):
    expected = ross_rotors.eigenvalues(answer)
    found = [int(np.argmin(abs(modes.eigenvalues - value))) for value in expected]
    assert found == list(range(6))  # the same six lowest modes in the same order
    assert modes.frequencies == pytest.approx(answer["wd"], rel=frequency)
    # A decrement near zero is as sure as the eigenvalue, not as itself.
    assert modes.log_decrements == pytest.approx(answer["log_dec"], rel=decrement, abs=1e-9)
    # ROSS says M where nodes whirl in different directions, however small the orbit.
    told = [(d, word) for d, word in zip(modes.direction, answer["direction"], strict=True) if word != "M"]
    assert all(d == {"F": 1, "B": -1}[word] for d, word in told)


def compare_response(Z, answer, allowed):
    expected = ross_rotors.amplitudes(answer)
    assert abs(Z - expected).max() < allowed * abs(expected).max()
    # Amplitudes and phases one by one, where they are not lost in the largest one's rounding.
    clear = abs(expected) > 1e-2 * abs(expected).max()
    assert abs(Z[clear]) == pytest.approx(abs(expected[clear]), rel=1e-6)
    assert np.angle(Z[clear] / expected[clear]) == pytest.approx(0, abs=1e-6)
