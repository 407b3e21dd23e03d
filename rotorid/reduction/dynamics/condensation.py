"""Condensation of a rotor to a few nodes: static shapes, modal damping, supports without mass."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import fem
from fem.assembly import Reduced, assemble, free_motions, ignored_inertia, multiply, rounding_error
from rotorid.base.arrays import FloatArray

_LOST = 1e-3  # relative rounding error of a static shape
_NONE = 1e-12  # share of the largest entry below which damping is none


def static_shapes(rotor: fem.Rotor, kept: tuple[int, ...]) -> FloatArray:
    """Shapes of the shaft for a unit deflection of each kept node, shape (size, k).

    K_oo X_o = −K_od, in the band of the whole shaft with rows and columns of kept nodes emptied.
    """
    from scipy.linalg.lapack import dpbtrf, dpbtrs

    if free_motions(rotor, set(kept)):
        raise ValueError(
            "one node, with or without a mass, does not hold the shaft: it can turn about it; give masses or "
            "supports at two nodes at least, or tilting stiffness"
        )
    A = assemble(rotor)
    at = np.array([A.deflection(node) for node in kept], dtype=np.intp)
    shapes = np.zeros((A.size, len(kept)))
    shapes[at, np.arange(len(kept))] = 1.0
    load = -multiply(A.shaft, shapes)
    load[at] = 0.0
    band, w = A.shaft.copy(), A.width
    for i in at:
        size = band[w, i]
        band[:, i] = 0.0
        for above in range(1, min(w, A.size - 1 - i) + 1):
            band[w - above, i + above] = 0.0
        band[w, i] = size
    factor, info = dpbtrf(band)
    X = dpbtrs(factor, load)[0] if info == 0 else load
    moved = np.abs(X).max(axis=0) > 0
    if info != 0 or (rounding_error(band, X[:, moved]) > _LOST).any():
        raise ValueError(
            f"the static shapes of {rotor.n_elements} elements are lost in float64; join neighbouring "
            "elements (50 to 200 are ample for a rotor)"
        )
    return np.asarray(shapes + X)


def damping_ratios(modal_damping: Sequence[float]) -> tuple[float, ...]:
    """Check damping ratios of the first modes.

    Raises
    ------
    ValueError
        For what is no list of numbers from 0 to below 1.
    """
    try:
        ratios = tuple(float(ratio) for ratio in modal_damping)
    except (TypeError, ValueError):
        raise ValueError(
            "modal_damping must be a list of damping ratios, one for each of the first modes"
        ) from None
    for ratio in ratios:
        if not 0 <= ratio < 1:
            raise ValueError(f"a damping ratio is at least 0 and below 1 (0.02 is 2 %), not {ratio}")
    return ratios


def external_damping(rotor: fem.Rotor, quadratic: Reduced, ratios: tuple[float, ...]) -> FloatArray:
    """Damping matrix of given ratios of the first modes of each plane, in the order of `quadratic`.

    The modes are those of each plane without damping, cross-coupling and gyroscopic effect; supports without
    mass follow statically.

    Raises
    ------
    ValueError
        For more ratios than modes, or planes at rest without natural frequencies.
    """
    C = np.zeros_like(quadratic.M)
    if not ratios:
        return C
    from scipy.linalg import eigh

    lowest = max((support.speeds[0] for support in rotor.supports if support.speeds), default=0.0)
    at_rest = quadratic.at(np.array([lowest]))[1][0] - lowest * quadratic.K1
    d, f = quadratic.basis.shape[1], len(quadratic.P.pedestals)
    for plane, axis in enumerate("xy"):
        own = np.concatenate((plane * d + np.arange(d), 2 * d + plane * f + np.arange(f)))
        K, M = at_rest[np.ix_(own, own)], quadratic.M[np.ix_(own, own)]
        massive = np.flatnonzero(np.diag(M) > 0)
        still = np.flatnonzero(np.diag(M) == 0)
        if len(ratios) > massive.size:
            raise ValueError(
                f"{len(ratios)} damping ratios are given, but each plane has {massive.size} modes; leave out "
                "the others"
            )
        Kmm = K[np.ix_(massive, massive)]
        if still.size:
            Kss, Ksm = K[np.ix_(still, still)], K[np.ix_(still, massive)]
            if np.linalg.cond(Kss) > 1 / _NONE:
                raise ValueError(
                    f"plane {axis} at rest can move without moving mass: no damping ratios exist; give its "
                    "supports stiffness"
                )
            Kmm = Kmm - Ksm.T @ np.linalg.solve(Kss, Ksm)
        inertia = np.diag(M)[massive]
        squares, shapes = eigh((Kmm + Kmm.T) / 2, np.diag(inertia))
        first = slice(len(ratios))
        if squares[0] < -1e-9 * np.abs(squares).max():
            raise ValueError(
                f"plane {axis} at rest is pushed aside by a negative stiffness: no damping ratios exist"
            )
        omega = np.sqrt(np.maximum(squares[first], 0.0))
        momentum = inertia[:, None] * shapes[:, first]  # shapes have φᵀ M φ = 1
        grid = np.ix_(own[massive], own[massive])
        C[grid] = (momentum * (2 * np.array(ratios) * omega)) @ momentum.T
    C.flags.writeable = False
    return C


def condensed(motion: fem.Motion, gyroscopic: FloatArray) -> fem.Motion:
    """Eliminate the coordinates o without mass; the others are m.

    Without forces on them q_o = −K_oo⁻¹ K_om q_m, and K_mm − K_mo K_oo⁻¹ K_om is exact where no damping acts
    on q_o. The gyroscopic part G of C is taken along with the static shapes R = (1; −K_oo⁻¹ K_om) and, for
    the forces, L = (1, −K_mo K_oo⁻¹): L G R.

    Parameters
    ----------
    motion
        Equations of motion.
    gyroscopic
        The part of C that is gyroscopic, shape (n, n).

    Raises
    ------
    ValueError
        Where other damping acts on a coordinate without mass, or no stiffness holds it.
    """
    massive = np.diag(motion.M) > 0
    on, off = np.flatnonzero(massive), np.flatnonzero(~massive)
    if not off.size:
        return motion
    damping = np.abs(motion.C - gyroscopic)
    touched = np.maximum(damping[off].max(axis=1), damping[:, off].max(axis=0))
    present = touched > _NONE * max(float(np.abs(motion.C).max()), float(damping.max()))
    if present.any():
        name = motion.coordinates[int(off[int(np.argmax(present))])]
        raise ValueError(
            f"damping acts on {name!r}, which has no mass: it cannot be condensed into stiffness; keep the "
            "supports, or take the state space"
        )
    Koo = motion.K[np.ix_(off, off)]
    sigma = np.linalg.svd(Koo, compute_uv=False)
    if sigma[-1] <= _NONE * sigma[0]:
        raise ValueError(
            "supports without mass can move without force: they cannot be condensed; give them stiffness"
        )
    follow = -np.linalg.solve(Koo, motion.K[np.ix_(off, on)])
    passed = -np.linalg.solve(Koo.T, motion.K[np.ix_(on, off)].T).T
    K = motion.K[np.ix_(on, on)] + motion.K[np.ix_(on, off)] @ follow
    L = np.zeros((on.size, len(massive)))
    R = np.zeros((len(massive), on.size))
    L[:, on] = R[on] = np.eye(on.size)
    L[:, off], R[off] = passed, follow
    grid = np.ix_(on, on)
    C = (motion.C - gyroscopic)[grid] + L @ gyroscopic @ R
    return fem.Motion(motion.M[grid], C, K, tuple(motion.coordinates[i] for i in on), motion.speed)


def left_out(rotor: fem.Rotor) -> tuple[str, ...]:
    """Say what the small model of this rotor only approximates."""
    out = [*ignored_inertia(rotor)]
    if rotor.model.gyroscopic:
        out.append(
            "gyroscopic moments act on slopes that follow the masses and supports statically: an "
            "approximation that gets worse with speed and for higher modes; compare with the rotor"
        )
    if rotor.model.rotary_inertia:
        out.append(
            "the inertia of tilting sections and discs is in the small model only as far as the masses were "
            "fitted to modes that know it; no moment of inertia is added"
        )
    return tuple(out)
