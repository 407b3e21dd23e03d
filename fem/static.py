"""Static compliance: deflections under unit forces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fem.matrices import assemble, rounding_error
from fem.rotor import FloatArray, Rotor


def compliance(rotor: Rotor, nodes: Sequence[str | int]) -> FloatArray:
    """Compute the deflections of some nodes under unit forces at these nodes, [S] (47).

    Parameters
    ----------
    rotor
        The rotor, held by stiffness at two nodes at least.
    nodes
        Node numbers, from 1, or names of stations; n of them.

    Returns
    -------
    numpy.ndarray
        α, m/N, symmetric, shape (n, n); entry (i, j) is the deflection of node i under a force at node j.

    Raises
    ------
    ValueError
        If the supports leave the rotor free, or a node does not exist, or the mesh is so fine that float64
        carries fewer than about three digits.
    """
    from scipy.linalg.lapack import dpbtrf, dpbtrs

    unknowns = np.array([2 * (rotor.node(node) - 1) for node in nodes], dtype=np.intp)
    A = assemble(rotor)
    if A.rigid:
        raise ValueError(
            "a rotor that is not held has no static compliance: give stiffness to supports at two nodes"
        )
    U, info = dpbtrf(A.stiffness)
    forces = np.zeros((A.size, unknowns.size))
    forces[unknowns, np.arange(unknowns.size)] = 1.0
    X = dpbtrs(U, forces)[0] if info == 0 else forces
    error = rounding_error(A.stiffness, X).max(initial=0.0)
    if info != 0 or error > 1e-3:
        raise ValueError(
            f"the compliance of {rotor.n_elements} elements on these supports is lost in float64; "
            "join neighbouring elements (50 to 200 are ample for a rotor) or check the support stiffness"
        )
    alpha = X[unknowns]
    return np.asarray((alpha + alpha.T) / 2)
