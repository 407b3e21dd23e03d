"""Allocation of the permissible unbalance of a rigid rotor to two planes (ISO 21940-11).

**Tolerance planes** (the clauses on allocation to tolerance planes) are the bearing planes, at a and b, with
the centre of mass at c. An unbalance U_per at c loads them like the static weight, by the levers

    s_A = |b − c| / |b − a|,     s_B = |c − a| / |b − a|,

and U_A = s_A U_per, U_B = s_B U_per within limits: between the bearings 0.3 … 0.7 (public descriptions of the
standard state the lever rule and these), with the centre of mass outside (overhung) 0.3 … 1.3 (the standard's
clause on outboard rotors; no public text was at hand to compare, so look into your copy). A disc that needs
one plane only has the whole U_per there.

**Correction planes** (the clauses on allocation to correction planes). An unbalance u_k at z_k is equivalent
for a rigid rotor to T_Ak u_k and T_Bk u_k at the bearings,

    T_Ak = (b − z_k)/(b − a),    T_Bk = (z_k − a)/(b − a),

with signs: one of them is negative for a plane outside the bearings. The angles of the residuals are not
known beforehand, so amounts are safe if they keep the tolerances even in the worst case,

    |T_A1| u_1 + |T_A2| u_2 ≤ U_A,    |T_B1| u_1 + |T_B2| u_2 ≤ U_B.

The standard leaves open which of these pairs to take. Here it is the one with the largest product u_1 u_2:
it uses both tolerances fully where that leaves something for both planes, gives U_A and U_B to planes at the
bearings, and gives neither plane nothing. Residuals that exceed it may still be good: what counts is what
they are together at the bearings (`Tolerance.transfer`).
"""

from __future__ import annotations

import numpy as np

from rotorid.base.arrays import FloatArray

INBOARD = (0.3, 0.7)
"""Least and largest share of U_per at a bearing, centre of mass between the bearings."""
OUTBOARD = (0.3, 1.3)
"""The same, centre of mass outside the bearings."""


def bearing_limits(
    total: float, ends: tuple[float, float], centre: float
) -> tuple[FloatArray, str, tuple[str, ...]]:
    """U_A and U_B by the levers of the centre of mass.

    Parameters
    ----------
    total
        U_per, kg·m.
    ends
        Positions a ≠ b of the tolerance planes, m.
    centre
        Position of the centre of mass, m.

    Returns
    -------
    The limits (2,), kg·m, the rule in words, and warnings.
    """
    a, b = ends
    share = np.abs(np.array([b - centre, centre - a]) / (b - a))
    inboard = min(a, b) <= centre <= max(a, b)
    low, high = INBOARD if inboard else OUTBOARD
    kept = np.clip(share, low, high)
    rule = (
        f"Tolerance planes by the levers of the centre of mass ({'between' if inboard else 'outside'} them): "
        f"shares {kept[0]:.3g} and {kept[1]:.3g}. "
    )
    changed = np.abs(kept - share) > 1e-12
    warnings: tuple[str, ...] = ()
    if changed.any():
        warnings = (
            f"by the levers the tolerance planes had {share[0]:.3g} and {share[1]:.3g} of the permissible "
            f"unbalance; the limits {low:g} … {high:g} make it {kept[0]:.3g} and {kept[1]:.3g}",
        )
    return kept * total, rule, warnings


def transfer(positions: FloatArray, ends: tuple[float, float]) -> FloatArray:
    """T (2, P): unbalance at the tolerance planes per unbalance at these positions (P,), m."""
    a, b = ends
    return np.array([b - positions, positions - a]) / (b - a)


def safe_pair(T: FloatArray, limits: FloatArray) -> FloatArray:
    """The pair u ≥ 0 of largest product with T u ≤ limits, T (2, 2) ≥ 0 without a zero column.

    log u₁ + log u₂ is concave: at the optimum either one constraint holds alone, where each plane uses half
    of it, u_k = limit / (2 T_k), or both hold, at their intersection.
    """
    for row, limit, other, most in ((T[0], limits[0], T[1], limits[1]), (T[1], limits[1], T[0], limits[0])):
        if (row > 0).all():
            u = limit / (2 * row)
            if other @ u <= most * (1 + 1e-12):
                return np.asarray(u)
    return np.asarray(np.linalg.solve(T, limits))
