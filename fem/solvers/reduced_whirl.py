"""Whirl at many speeds: a coarse basis finds all modes, a fine one gives the digits, the full model judges.

1. In the coarse basis of `fem.solvers.whirl_basis` all eigenvalues are found at every speed.
2. Inverse iteration in the fine basis improves each pair. At a few speeds all eigenvalues of the fine basis
   are found as well: none may be missing. Where iteration wandered, they replace it.
3. For each mode the pair that the fine basis changed most is solved on the banded equations of the full
   model. Adding these vectors to the basis (right and left ones, so that the error that remains is of second
   order) tells the error of the pair; where it is too large they join the basis, and step 2 is repeated.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fem.matrices.lateral_planes import Planes, Quadratic, project
from fem.solvers.full_band import WholeBand
from fem.solvers.quadratic_eigenvalues import Solutions, polish, solve
from fem.solvers.whirl_basis import Reference, enlarge, reference, starting_vectors, vectors
from rotorid.base.arrays import AnyArray, BoolArray, ComplexArray, FloatArray, IndexArray

TOLERANCE = 3e-8  # of eigenvalues, relative to their size
_FEW = 4  # speeds for which the coarse basis is not worth while
_COMPLETE = 40  # unknowns per plane up to which the basis is the whole space
_ROUNDS = 6
_STEP = 5e-5  # relative change of an eigenvalue after which inverse iteration goes on


@dataclass(frozen=True, eq=False)
class Whirl:
    """Eigenpairs at each speed in a basis that holds them.

    Attributes
    ----------
    Q
        The equations in this basis.
    speeds
        rad/s, shape (S,).
    found
        The pairs, shape (S, m).
    scale
        A frequency of the order of the lowest, rad/s.
    error
        Estimated largest relative error of an eigenvalue.
    ref, Y
        The reference rotor and the basis in its terms.
    """

    Q: Quadratic
    speeds: FloatArray
    found: Solutions
    scale: float
    error: float
    ref: Reference
    Y: FloatArray


def solve_whirl(P: Planes, speeds: FloatArray, m: int) -> Whirl:
    """The m oscillating modes of lowest frequency at each speed, to about eight digits.

    Raises
    ------
    ValueError
        If a support has no table at a speed, or the basis cannot be made good enough.
    """
    room = m
    while True:
        whirl = _solve(P, speeds, m, room)
        # Rigid-body motions and overdamped ones take room, too: only a complete basis knows of no more.
        if np.isfinite(whirl.found.values).all() or whirl.Y.shape[1] == P.A.size:
            return whirl
        room *= 2


def _solve(P: Planes, speeds: FloatArray, m: int, room: int) -> Whirl:
    """The same with a basis that has room for a given number of modes."""
    first = max(2, (room + 1) // 2)
    ref = reference(P, speeds, max(room, first))
    Y, more = starting_vectors(P, ref, first)
    n = P.A.size
    if n <= max(_COMPLETE, Y.shape[1] + more.shape[1]):
        Q = project(P, vectors(ref, np.eye(n)))
        return Whirl(Q, speeds, solve(Q, speeds, m, ref.scale), ref.scale, 0.0, ref, np.eye(n))
    coarse = None
    if speeds.size > _FEW:
        Q = project(P, vectors(ref, Y))
        coarse = solve(Q, speeds, m, ref.scale, left=True)
    Y = np.hstack((Y, more))
    band = WholeBand(P)
    for _ in range(_ROUNDS):
        Q = project(P, vectors(ref, Y))
        if coarse is None:
            found = solve(Q, speeds, m, ref.scale)
            where = np.zeros(m, dtype=np.intp)
        else:
            found = _refined(Q, speeds, coarse, ref.scale)
            change = np.abs(found.values - coarse.values) / np.abs(found.values)
            where = np.argmax(np.nan_to_num(change, nan=-1.0), axis=0)
        error, new = _judge(band, ref, Q, Y, speeds, found, where)
        if error <= TOLERANCE:
            return Whirl(Q, speeds, found, ref.scale, error, ref, Y)
        Y = np.hstack((Y, new))
        if coarse is not None:
            coarse = found
    raise ValueError(
        f"whirl frequencies of this rotor are known to {error:.0e} of their size only: the mesh is too fine "
        "for float64, or a support is stiffer than float64 carries beside the shaft; join neighbouring "
        "elements or give plausible stiffness"
    )


def with_speeds(whirl: Whirl, more: FloatArray) -> Whirl:
    """The same at more speeds, rad/s, in the same basis, without left vectors."""
    one, two = whirl.found, solve(whirl.Q, more, whirl.found.values.shape[1], whirl.scale)
    speeds = np.concatenate((whirl.speeds, more))
    order = np.argsort(speeds, kind="stable")
    values, vectors, still = (
        np.concatenate((getattr(one, name), getattr(two, name)))[order]
        for name in ("values", "vectors", "still")
    )
    real = one.real + two.real
    found = Solutions(values, vectors, None, tuple(real[k] for k in order), still)
    return replace(whirl, speeds=speeds[order], found=found)


def enriched(
    whirl: Whirl, speeds: FloatArray, values: ComplexArray, X: ComplexArray
) -> tuple[Quadratic, ComplexArray]:
    """A basis that holds the full model's vectors of some pairs, and the pairs' vectors in it.

    Parameters
    ----------
    whirl
        Where the pairs come from.
    speeds, values, X
        Shapes (B,), (B,) and (B, R).
    """
    Q = whirl.Q
    if whirl.Y.shape[1] == len(whirl.Y):
        return Q, X
    true = _true_vectors(WholeBand(Q.P), Q, speeds, values, X)
    new = enlarge(whirl.ref, whirl.Y, np.concatenate(true, axis=1))
    if not new.shape[1]:
        return Q, X
    larger = project(Q.P, np.hstack((Q.basis, vectors(whirl.ref, new))))
    return larger, _padded(larger, X)


def _refined(Q: Quadratic, speeds: FloatArray, coarse: Solutions, scale: float) -> Solutions:
    """Coarse pairs improved in a larger basis, and checked for being all."""
    S, m = coarse.values.shape
    values, X = coarse.values.copy(), _padded(Q, coarse.vectors)
    left = None if coarse.left is None else _padded(Q, coarse.left)
    there = np.isfinite(values)
    bad = np.zeros(S, dtype=bool)
    for part in range(0, S, 8):  # to stay in the processor's cache
        k, j = np.nonzero(there[part : part + 8])
        k += part
        for _ in range(4):
            others = None if left is None else left[k, j]
            values[k, j], X[k, j], step = polish(Q, speeds, k, values[k, j], X[k, j], 1, others)
            # The error that a step leaves is about the square of the step.
            rough = step > _STEP
            if not rough.any():
                break
            k, j = k[rough], j[rough]
    gap = np.abs(coarse.values[:, :, None] - coarse.values[:, None, :])
    gap[:, np.arange(m), np.arange(m)] = np.inf
    gap = np.nanmin(np.where(np.isnan(gap), np.inf, gap), axis=2)
    bad |= (np.abs(values - coarse.values) > 0.2 * gap).any(axis=1)
    bad[[0, S // 2, S - 1]] = True
    again = solve(Q, speeds[bad], m, scale, left=left is not None)
    missing = _differ(again.values, values[bad])
    if missing[[0, -1]].any() or missing.sum() > 2 + S // 10:
        return solve(Q, speeds, m, scale, left=left is not None)
    values[bad], X[bad] = again.values, again.vectors
    if left is not None and again.left is not None:
        left[bad] = again.left
    order = np.argsort(np.where(np.isfinite(values), np.abs(values.imag), np.inf), axis=1, kind="stable")
    values = np.take_along_axis(values, order, axis=1)
    X = np.take_along_axis(X, order[:, :, None], axis=1)
    if left is not None:
        left = np.take_along_axis(left, order[:, :, None], axis=1)
    return replace(coarse, values=values, vectors=X, left=left)


def _differ(all_found: ComplexArray, improved: ComplexArray) -> BoolArray:
    """At which speeds the lowest modes are not those that were improved."""
    all_found, improved = (np.nan_to_num(v, nan=0.0) for v in (all_found, improved))
    distance = np.abs(all_found[:, :, None] - improved[:, None, :]).min(axis=2)
    return np.asarray((distance > 1e-6 * np.abs(all_found)).any(axis=1))


def _padded(Q: Quadratic, X: ComplexArray) -> ComplexArray:
    """Vectors of a basis in a larger one that begins with it."""
    p, d, f = Q.P.planes, Q.basis.shape[1], len(Q.P.pedestals)
    old = X.shape[-1] // p - f
    if old == d:
        return X.copy()
    out = np.zeros((*X.shape[:-1], Q.size), dtype=complex)
    for plane in range(p):
        out[..., plane * d : plane * d + old] = X[..., plane * old : (plane + 1) * old]
    out[..., p * d :] = X[..., p * old :]
    return out


def _judge(
    band: WholeBand,
    ref: Reference,
    Q: Quadratic,
    Y: FloatArray,
    speeds: FloatArray,
    found: Solutions,
    where: IndexArray,
) -> tuple[float, FloatArray]:
    """Error of one pair of each mode, and vectors to append where it is too large."""
    modes = [j for j in range(len(where)) if np.isfinite(found.values[where[j], j])]
    k = where[modes]
    if not modes:
        return 0.0, np.empty((len(Y), 0))
    values, X = found.values[k, modes], found.vectors[k, modes]
    true = _true_vectors(band, Q, speeds[k], values, X)
    new = enlarge(ref, Y, np.concatenate(true, axis=1))
    if not new.shape[1]:
        return 0.0, new
    larger = project(Q.P, np.hstack((Q.basis, vectors(ref, new))))
    improved, _, _ = polish(larger, speeds, k, values, _padded(larger, X), 3)
    error = np.abs(improved - values) / np.abs(improved)
    failing = error > TOLERANCE / 3
    if error.max() > TOLERANCE:
        new = enlarge(
            ref, Y, np.concatenate([x for x, fails in zip(true, failing, strict=True) if fails], axis=1)
        )
    return float(error.max()), new


def _true_vectors(
    band: WholeBand, Q: Quadratic, speeds: FloatArray, values: ComplexArray, X: ComplexArray
) -> list[AnyArray]:
    """Right (and, where they span something else, left) eigenvectors of the full model, (size, planes …)."""
    mirrored = Q.P.mirrored(speeds)
    D, stiffness = Q.at(speeds)
    out = []
    for i, (value, speed) in enumerate(zip(values, speeds, strict=True)):
        factored = band.factor(complex(value), float(speed))
        left = Q.mirror(X[i])
        if not mirrored:
            reduced = value * value * Q.M + value * D[i] + stiffness[i]
            left = np.linalg.svd(reduced.T)[2][-1].conj()
        # One step is enough: the value is known to more digits than the vector needs. Loads that do work on
        # the left vector y, yᵀ M y*, excite the mode however damped it is; M x may not.
        columns = [band.planes(factored.solve(band.inertia(Q.expand(left.conj())))).T]
        if not mirrored:
            loads = band.inertia(Q.expand(X[i].conj()))
            columns.append(band.planes(factored.solve(loads, transposed=True)).T)
        out.append(np.hstack(columns))
    return out
