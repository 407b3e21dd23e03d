"""Responses and whirl of the full model at one speed after another: slow, the check of the fast ways."""

from functools import partial

import numpy as np
import pytest
from full_whirl import exact_modes

from fem import WhirlModes, response
from fem.assembly import both_planes
from fem.whirl import in_both_planes, missing_modes


def exactly(function, *arguments, **named):
    """`fem.influence` or `fem.unbalance_response` with the banded equations solved at every speed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(response, "Receptance", partial(response.Receptance, exact=True))
        return function(*arguments, **named)


def fast(function, *arguments, **named):
    """As it is."""
    return function(*arguments, **named)


SOLVERS = {"fast": fast, "exact": exactly}


def whirl_exactly(rotor, speed, n=6):
    """`fem.whirl_modes` without a reduced basis."""
    P = both_planes(rotor)
    values, vectors, real, still = exact_modes(P, float(speed), n)
    lam, x, y = in_both_planes(values, vectors[:, :, :: P.A.stride])
    size = np.sqrt((np.abs(x) ** 2 + np.abs(y) ** 2).max(axis=1))
    said = missing_modes(real, still, lam.size, n)
    return WhirlModes(float(speed), lam, x.T / size, y.T / size, real, 0.0, rotor, said)


def frequency_response(model, omega):
    """C (iω − A)⁻¹ B + D at frequencies in rad/s, shape (S, outputs, inputs)."""
    A, B, C, D = model
    iw = 1j * np.atleast_1d(omega)[:, None, None] * np.eye(len(A))
    return C @ np.linalg.solve(iw - A, np.broadcast_to(B, (len(iw), *B.shape))) + D
