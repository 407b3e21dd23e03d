"""Lower bounds of the discrete problem: its continuous optimum, and the quadratic form around it.

Every plane's set is replaced by a polygon (and the disc of its largest weight) around it. With D₀ the optimum
of that convex problem, λ ≥ 0 with Σλ = 1 and r = Y + W D, every D of the discrete problem has

    max wᵢ²|rᵢ|² ≥ q(D) = Σ λᵢ wᵢ²|rᵢ|² = q(D₀) + ‖A (D − D₀)‖² + Re gᴴ(D − D₀),    g = 2 Aᴴ(b + A D₀),

with A and b the rows sqrt(λᵢ) wᵢ of W and Y; least squares is the same with λ = 1 and equality. The linear
term of a plane is bounded below by its support function over the set itself, so the bound holds for any D₀;
it is good where D₀ is q's optimum. Min–max takes λ between the dual weights, where the bound is sharp, and
equal ones, where the form has full rank.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from balancing.mounting.mountable_vectors import Attainable
from rotorid.base.arrays import ComplexArray, FloatArray, IntArray
from rotorid.regression import solution, stretch, unstretch

__all__ = ["Form", "best_form", "form", "project_out", "relax"]

SHARES = (1.0, 0.5, 0.2, 0.1, 0.03, 0.01)
_RANK = 1e-10


@dataclass(frozen=True, eq=False)
class Form:
    """q(D) = const + ‖R (D − D₀)‖² + Σ Re ḡ_p (D_p − D₀_p), planes in the order of R's columns.

    Attributes
    ----------
    order
        Plane of each column, shape (P,); the last is fixed first.
    R
        Upper triangular, shape (P, P).
    D0, g
        Centre and gradient, shape (P,).
    m
        Lower bounds of each plane's linear term, ≤ 0 or little above, shape (P,).
    const
        q(D₀).
    """

    order: IntArray
    R: ComplexArray
    D0: ComplexArray
    g: ComplexArray
    m: FloatArray
    const: float

    @property
    def bound(self) -> float:
        """Lower bound of q over the sets."""
        return max(self.const + float(self.m.sum()), 0.0)


def project_out(A: ComplexArray, *others: ComplexArray) -> list[ComplexArray]:
    """Each array of rows without what the columns of A can cancel."""
    if not A.shape[1]:
        return list(others)
    u, s, _ = np.linalg.svd(A, full_matrices=False)
    u = u[:, s > _RANK * s.max(initial=0.0)]
    return [np.asarray(x - u @ (u.conj().T @ x)) for x in others]


def form(A: ComplexArray, b: ComplexArray, D0: ComplexArray, sets: Sequence[Attainable]) -> Form:
    """The form of ‖b + A D‖², planes ordered so that few vectors are left for what is fixed first."""
    P = A.shape[1]
    rest, order = list(range(P)), [0] * P
    for place in range(P - 1, -1, -1):

        def points(p: int) -> float:
            (own,) = project_out(A[:, [q for q in rest if q != p]], A[:, p])
            return 1.0 / max(float(np.linalg.norm(own)) * sets[p].spacing, 1e-300)

        order[place] = min(rest, key=points)
        rest.remove(order[place])
    A, D0 = A[:, order], D0[order]
    r = b + A @ D0
    R = np.zeros((P, P), dtype=complex)
    R[: min(A.shape)] = np.linalg.qr(A, mode="r")[:P]
    g = 2 * A.conj().T @ r
    m = [
        sets[p].lowest(g[k]) - float((np.conj(g[k]) * D0[k]).real) if g[k] != 0 else 0.0
        for k, p in enumerate(order)
    ]
    return Form(np.array(order), R, D0, g, np.array(m), float(np.linalg.norm(r)) ** 2)


def best_form(
    W: ComplexArray,
    Y: ComplexArray,
    prices: FloatArray,
    fixed: IntArray,
    sets: Sequence[Attainable],
    best: float,
    shares: Sequence[float] = SHARES,
) -> Form:
    """Min–max: the form, of several λ, whose region q ≤ best² is smallest; W and Y are weighted rows.

    A share of 0 takes the dual weights alone. Planes that are not among `fixed` (columns, shape (P',)) are
    continuous and cancel what they can.
    """
    found: list[tuple[float, Form]] = []
    free = np.setdiff1d(np.arange(W.shape[1]), fixed)
    for share in shares:
        root = np.sqrt((1 - share) * prices + share / len(Y))[:, None]
        A, b = project_out(root * W[:, free], root * W[:, fixed], root[:, 0] * Y)
        one = form(A, b, relax(A, b, sets, minmax=False)[0], sets)
        diagonal = np.maximum(np.abs(np.diagonal(one.R)), 1e-300)
        room = max(best**2 - one.bound, 1e-12 * best**2) or 1e-300
        found.append((len(fixed) * np.log(room) - 2 * float(np.log(diagonal).sum()), one))
    return min(found, key=lambda pair: pair[0])[1]


def relax(
    W: ComplexArray, Y: ComplexArray, sets: Sequence[Attainable | None], *, minmax: bool
) -> tuple[ComplexArray, FloatArray]:
    """Optimum D₀ (P,) over polygons around the sets (None: all), and λ (N,) of min–max; weighted rows.

    Raises
    ------
    RuntimeError
        Where the solver finds nothing.
    """
    equal = np.full(len(Y), 1.0 / len(Y))
    free = solution(W, -Y)
    rows = [_polygon(s) for s in sets]
    inside = all(_within(n, s, d) for d, (n, s) in zip(free, rows, strict=True))
    if inside and not minmax:
        return np.asarray(free, dtype=complex), equal
    return _program(W, Y, rows, minmax)


def _within(normals: ComplexArray, support: FloatArray, d: complex) -> bool:
    return bool(((normals.conj() * d).real <= support).all())


def _polygon(one: Attainable | None) -> tuple[ComplexArray, FloatArray]:
    """Normals n and s with Re(n̄ d) ≤ s."""
    if one is None:
        return np.zeros(1, dtype=complex), np.zeros(1)
    normals = one.normals()
    return normals, np.array([-one.lowest(-n) for n in normals])


def _program(
    W: ComplexArray, Y: ComplexArray, rows: Sequence[tuple[ComplexArray, FloatArray]], minmax: bool
) -> tuple[ComplexArray, FloatArray]:
    """Minimise t over polygons with |(W D + Y)ᵢ| ≤ t (or all together ≤ t), D scaled by columns."""
    import clarabel
    from scipy import sparse

    N, P = W.shape
    norms = np.linalg.norm(W, axis=0)
    scale = np.where(norms > 0, norms, 1.0)
    unit = float(np.linalg.norm(Y)) or 1.0
    parts, right, cones = [], [], []
    for p, (n, s) in enumerate(rows):
        use = (n != 0) & np.isfinite(s)
        if use.any():
            block = np.zeros((int(use.sum()), 2 * P + 1))
            block[:, 2 * p], block[:, 2 * p + 1] = n[use].real, n[use].imag
            size = float(np.abs(s[use]).max()) * scale[p] / unit or 1.0
            parts.append(block / size)
            right.append(s[use] * scale[p] / unit / size)
            cones.append(clarabel.NonnegativeConeT(int(use.sum())))
    count = N if minmax else 1  # cones of one reading each, or of all
    rows_of = np.zeros((count, 2 * N // count + 1, 2 * P + 1))
    rows_of[:, 0, -1] = -1.0
    rows_of[:, 1:, :-1] = -stretch(W / scale).reshape(count, -1, 2 * P)
    parts.append(rows_of.reshape(-1, 2 * P + 1))
    known = np.column_stack((np.zeros(count), stretch(Y / unit).reshape(count, -1)))
    right.append(known.ravel())
    cones += [clarabel.SecondOrderConeT(2 * N // count + 1)] * count
    q = np.zeros(2 * P + 1)
    q[-1] = 1.0
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    A, b = sparse.csc_matrix(np.vstack(parts)), np.concatenate(right)
    found = clarabel.DefaultSolver(sparse.csc_matrix((len(q), len(q))), q, A, b, cones, settings).solve()
    x, z = np.array(found.x), np.array(found.z)
    if not np.isfinite(x).all():
        raise RuntimeError("the solver found no continuous optimum: state largest weights of the planes")
    D = unstretch(x[:-1]) * unit / scale
    prices: FloatArray = np.full(N, 1.0 / N)
    if minmax:
        dual = np.maximum(z[-3 * N :: 3], 0.0)
        prices = dual / dual.sum() if dual.sum() > 0 else prices
    return np.asarray(D), np.asarray(prices, dtype=np.float64)
