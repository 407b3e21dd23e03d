"""Responses and whirl of the full model at one speed after another: slow, the check of the fast ways."""

from functools import partial

import numpy as np
import pytest

from fem import WhirlModes, reference, response, solve_modes
from fem.assembly import both_planes, project
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
    P, speeds = both_planes(rotor), np.array([float(speed)])
    Q = project(P, np.eye(P.A.size))
    whirl = solve_modes(Q, speeds, n, reference(P, speeds, 1)[1])
    there, real = np.isfinite(whirl.values[0]), whirl.real[0]
    vectors = Q.expand(whirl.vectors[0, there])
    lam, x, y = in_both_planes(whirl.values[0, there], vectors[:, :, :: P.A.stride])
    size = np.sqrt((np.abs(x) ** 2 + np.abs(y) ** 2).max(axis=1))
    missing = missing_modes(real, int(whirl.still[0]), lam.size, n)
    return WhirlModes(float(speed), lam, x.T / size, y.T / size, real, 0.0, rotor, missing)


def frequency_response(model, omega):
    """C (iω − A)⁻¹ B + D at frequencies in rad/s, shape (S, outputs, inputs)."""
    A, B, C, D = model
    iw = 1j * np.atleast_1d(omega)[:, None, None] * np.eye(len(A))
    return C @ np.linalg.solve(iw - A, np.broadcast_to(B, (len(iw), *B.shape))) + D
