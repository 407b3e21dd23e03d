"""Whirl of the small rotor at many speeds, in the form in which `fem` holds the full rotor's."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from fem import Whirl, reference, solve
from fem.assembly import Reduced, both_planes, project
from rotorid.base.arrays import FloatArray

if TYPE_CHECKING:
    from rotorid.reduction.dynamics.small_rotor import SmallRotor


def equations(small: SmallRotor) -> Reduced:
    """λ² M + λ D(Ω) + K(Ω) of a small rotor: of z = x + i y if the rotor is symmetric, else of both planes.

    In this form `fem` takes it for the full rotor's equations in a basis of the shaft, and both models are
    solved in the same way. Modal damping
    is the same in both planes and does not couple them, so that its block of one plane damps z, too.
    """
    Q = small.quadratic
    if not small.rotor.symmetric:
        return replace(Q, D0=Q.D0 + small.external)
    d, pedestals = Q.basis.shape[1], len(Q.P.pedestals)
    in_x = np.concatenate((np.arange(d), 2 * d + np.arange(pedestals)))
    pick = np.ix_(in_x, in_x)
    one = project(both_planes(small.rotor), Q.basis)
    return replace(one, M=Q.M[pick], D0=one.D0 + small.external[pick])


def whirl_of(small: SmallRotor, speeds: FloatArray) -> Whirl:
    """All modes of a small rotor that oscillate, at each speed.

    Raises
    ------
    ValueError
        For a speed outside the table of a support.
    """
    Q = equations(small)
    # All: gyroscopic moments make also coordinates without mass oscillate, at high frequency.
    n = Q.size if Q.P.planes == 2 else 2 * Q.size
    _, scale = reference(Q.P, speeds, 1)
    return solve(Q, speeds, n, scale)
