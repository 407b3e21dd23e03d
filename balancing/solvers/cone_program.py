"""The cone program of correction weights, scaled, as clarabel takes it, and its answer scaled back.

Amplitudes |Yᵢ + Wᵢ D| and weights |D_p| are lengths of vectors in the plane, so every limit is a cone of
three rows. Least squares is one cone more, of 2P + 2 rows whatever the number of readings, by the QR
factorisation of the row-weighted W. The program starts from the least-squares weights, amplitudes are scaled
by what these leave (or their own limit) and weights by what they do, so that the solver's tolerances mean the
same for micrometres and grams as for metres and kilograms.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.data.limits import Arc
from balancing.solvers.certificate import Problem, project
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.regression import gain, solution, stretch, unstretch

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix


_DEPENDENT = 1e-10
_NOTHING = 1e-9
_LEAST_REACH = 1e-6
TIGHTER = (3e-9, 3e-8, 3e-7, 3e-6)
"""By how much limits are tightened where amplitudes are limited, one after the other until all are kept."""


class SolverError(ValueError):
    """The solver did not come near the optimum."""


class InfeasibleError(ValueError):
    """Limits that no weights meet."""


class Program:
    """The scaled cone program min qᵀx, b − A x in cones; x = (Re, Im of y, t, sizes).

    The weights are D = D₀ + T y: D₀ the least-squares weights, shortened to their limits, where that is
    better than none, and T what makes the scaled rows orthogonal, so that neither small residuals of large
    readings nor planes that act nearly alike cost digits. t is the objective over `unit`, and sizes
    |D_p| ≤ k_p τ_p are there only for a budget. The solver minimises over s = b − A x in the cones and
    returns ζ in their duals, with qᵀx ≥ −ζᵀb: the rows (t, G y + h) of a reading give a = −ζ of its last two
    rows, scaled back, as the bound of `balancing.solvers.certificate` needs it.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        W, w = problem.W, problem.row_weights
        self.on = np.flatnonzero(w > 0)
        self.limited = np.flatnonzero(np.isfinite(problem.residual))
        self.amplitudes_limited = bool(len(self.limited))
        rows = w[self.on, None] * W[self.on]
        self.base = _start(problem, rows)
        self.residual = problem.Y + W @ self.base
        known = w[self.on] * self.residual[self.on]
        own = np.maximum(problem.residual[self.limited], np.abs(self.residual[self.limited]))
        self.own = np.where(own > 0, own, float(own.max(initial=0.0)) or 1.0)
        limit_rows = W[self.limited] / self.own[:, None]
        self.unit = float(np.abs(known).max())
        kept = bool((np.abs(self.residual) <= problem.residual).all())
        if not kept and self.unit <= _NOTHING * float(np.abs(w * problem.Y).max()):  # what do limits cost?
            needed = solution(limit_rows, -self.residual[self.limited] / self.own)
            self.unit = float(np.abs(rows @ needed).max())
        self.unit = self.unit or float(np.abs(rows).max()) or 1.0
        self.transform = self._orthogonal(np.concatenate((rows / self.unit, limit_rows)))
        self.objective_rows, self.objective_known = rows @ self.transform / self.unit, known / self.unit
        self.limit_rows = limit_rows @ self.transform
        # sizes of weights: what one unit of y does, or what stands there already
        self.sizes = np.maximum(np.linalg.norm(self.transform, axis=1), np.abs(self.base))

    def _orthogonal(self, amplitudes: ComplexArray) -> ComplexArray:
        """T that makes scaled rows of amplitudes and limited weights orthogonal, of root mean square one.

        Only their columns' sizes count where planes are dependent.
        """
        most = np.minimum(self.problem.max_weight, self.problem.budget)
        rows = np.concatenate((amplitudes, np.sqrt(len(amplitudes)) * np.diag(1.0 / most)[np.isfinite(most)]))
        scale = np.linalg.norm(rows, axis=0) / np.sqrt(len(amplitudes))
        scale = np.where(scale > 0, scale, 1.0)
        R = np.linalg.qr(rows / scale, mode="r")
        diagonal = np.abs(np.diagonal(R))
        if len(diagonal) < len(scale) or diagonal.min() < _DEPENDENT * diagonal.max():
            return np.asarray(np.diag(1.0 / scale), dtype=complex)
        inverse = np.linalg.inv(R) * np.sqrt(len(amplitudes))
        return np.asarray(inverse / scale[:, None], dtype=complex)

    @cached_property
    def reduced(self) -> tuple[ComplexArray, ComplexArray, ComplexArray, float, ComplexArray]:
        """Least squares: Q and R of the scaled W, Qᴴ r, and size and direction of r's part beyond W."""
        Q, R = np.linalg.qr(self.objective_rows)
        inside = Q.conj().T @ self.objective_known
        beyond = self.objective_known - Q @ inside
        size = float(np.linalg.norm(beyond))
        return Q, R, inside, size, np.asarray(beyond / (size or 1.0), dtype=complex)

    def run(
        self, tighter: float, tolerance: float, careful: bool
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Solve with limits tighter by a share; weights (P,) and dual vectors a, u (N,)."""
        A, b, cones, marks = self._rows(tighter)
        q = np.zeros(A.shape[1])
        q[2 * len(self.base)] = 1.0
        x, z = _solved(_zero(len(q)), q, _csc(A), b, cones, tolerance, careful)
        weights = np.asarray(self.base + self.transform @ unstretch(x[: 2 * len(self.base)]))
        a, u = self._dual(z, marks)
        return weights, a, u

    def _rows(self, tighter: float) -> tuple[FloatArray, FloatArray, list[Any], dict[str, slice]]:
        """Matrix, right side and cones, and where the rows of objective and limited readings stand."""
        import clarabel

        P, budget, M = len(self.base), self.problem.budget, self.problem.max_weight
        n = 2 * P + 1 + (P if np.isfinite(budget) else 0)
        parts, cones, marks = [self._linear_rows(n, tighter)], [], {}
        if len(parts[0][1]):
            cones.append(clarabel.NonnegativeConeT(len(parts[0][1])))
        if self.problem.minmax:
            none = np.zeros(len(self.on))
            parts.append(_discs(self.objective_rows, self.objective_known, none, n, t=2 * P))
            cones += [clarabel.SecondOrderConeT(3)] * len(self.on)
        else:
            _, R, inside, size, _ = self.reduced
            block = np.zeros((2 * P + 2, n))
            block[0, 2 * P] = -1.0
            block[1:-1, : 2 * P] = -stretch(R)
            parts.append((block, np.concatenate(([0.0], stretch(inside), [size]))))
            cones.append(clarabel.SecondOrderConeT(2 * P + 2))
        start = len(parts[0][1])
        marks["objective"] = slice(start, start + len(parts[1][1]))
        if self.amplitudes_limited:
            known = self.residual[self.limited] / self.own
            head = self.problem.residual[self.limited] * (1 - tighter) / self.own
            parts.append(_discs(self.limit_rows, known, head, n))
            cones += [clarabel.SecondOrderConeT(3)] * len(self.limited)
            marks["limited"] = slice(marks["objective"].stop, marks["objective"].stop + 3 * len(self.limited))
        parts.append(_weights(M * (1 - tighter), self.base, self.transform, np.maximum(M, self.sizes), n))
        cones += [clarabel.SecondOrderConeT(3)] * int(np.isfinite(M).sum())
        if np.isfinite(budget):
            rows = self.transform / self.sizes[:, None]
            block, b = _discs(rows, self.base / self.sizes, np.zeros(P), n)
            block[3 * np.arange(P), 2 * P + 1 + np.arange(P)] = -1.0
            parts.append((block, b))
            cones += [clarabel.SecondOrderConeT(3)] * P
        A = np.concatenate([block for block, _ in parts])
        return A, np.concatenate([b for _, b in parts]), cones, marks

    def _linear_rows(self, n: int, tighter: float) -> tuple[FloatArray, FloatArray]:
        """Rows b − A x ≥ 0 of sectors, and Σ k τ ≤ budget."""
        P = len(self.base)
        margin = tighter if tighter > TIGHTER[0] else 0.0  # else weights that should be zero could not be
        A, b = _sides(self.problem.sectors, self.base, self.transform, self.sizes, n)
        if not np.isfinite(self.problem.budget):
            return A, b - margin
        size = max(float(self.sizes.max()), self.problem.budget)
        row = np.zeros((1, n))
        row[0, 2 * P + 1 :] = self.sizes / size
        return np.concatenate((A, row)), np.append(b - margin, self.problem.budget * (1 - tighter) / size)

    def _dual(self, z: FloatArray, marks: dict[str, slice]) -> tuple[ComplexArray, ComplexArray]:
        """Dual vectors a and u of `balancing.solvers.certificate.lower_bound` (N,) from those of the rows."""
        a, u = np.zeros((2, len(self.problem.Y)), dtype=complex)
        w = self.problem.row_weights[self.on]
        own = z[marks["objective"]]
        if self.problem.minmax:
            a[self.on] = -w * _pairs(own)
        else:
            Q, _, _, size, direction = self.reduced
            inner = unstretch(own[1:-1])
            a[self.on] = -w * (Q @ inner + (own[-1] * direction if size else 0.0))
        if self.amplitudes_limited:
            u[self.limited] = -self.unit / self.own * _pairs(z[marks["limited"]])
        return a, u


def quadratic_minimum(
    problem: Problem, start: ComplexArray, gradient: FloatArray, hessian: FloatArray
) -> ComplexArray:
    """Weights within limits where 2 gᵀx + xᵀH x is smallest, x the stretched way to them from `start`.

    Parameters
    ----------
    problem
        Its limits and sectors; what it minimises does not matter.
    start
        Shape (P,), not necessarily within the limits.
    gradient, hessian
        g (2P,) and H (2P, 2P), positive definite.

    Raises
    ------
    InfeasibleError
        Where no weights are within the limits.
    """
    import clarabel

    free = problem.max_weight > 0
    if not free.all():
        found, both = np.zeros_like(start), np.repeat(free, 2)
        if free.any():
            inner = hessian[np.ix_(both, both)]
            found[free] = quadratic_minimum(problem.of_planes(free), start[free], gradient[both], inner)
        return found
    n, M, newton = len(gradient), problem.max_weight, unstretch(np.linalg.solve(hessian, -gradient))
    size = np.abs(start)  # a start may be beyond the limits, even where the gradient is 0
    reach = max(np.abs(newton).max(), _LEAST_REACH * size.max(), (size - M).max())
    reach = reach or np.abs(gain(problem.W) @ problem.Y).max()
    if not reach:
        return start
    sizes = np.minimum(float(reach), M + size)
    transform = np.diag(sizes).astype(complex)
    x_size = np.repeat(sizes, 2)
    H, g = hessian * np.outer(x_size, x_size), gradient * x_size
    unit = max(float(np.abs(g).max()), float(np.abs(H).max()))
    limited = np.isfinite(problem.residual)
    residual, L = (problem.Y + problem.W @ start)[limited], problem.residual[limited]
    own = np.maximum(np.maximum(L, np.abs(residual)), np.finfo(float).tiny)
    rows = problem.W[limited] * sizes / own[:, None]
    sides = _sides(problem.sectors, start, transform, np.maximum(sizes, np.abs(start)), n)
    cones = [clarabel.NonnegativeConeT(len(sides[1]))] if len(sides[1]) else []
    cones += [clarabel.SecondOrderConeT(3)] * int(limited.sum() + np.isfinite(M).sum())
    for tighter in TIGHTER if limited.any() else (0.0,):
        parts = [
            sides,
            _discs(rows, residual / own, L * (1 - tighter) / own, n),
            _weights(M * (1 - tighter), start, transform, np.maximum(M, sizes), n),
        ]
        A, b = np.concatenate([part for part, _ in parts]), np.concatenate([right for _, right in parts])
        x, _ = _solved(_csc(np.triu(2 * H / unit)), 2 * g / unit, _csc(A), b, cones, 1e-10, careful=False)
        found = within_limits(problem, start + transform @ unstretch(x))
        if (np.abs(problem.Y + problem.W @ found) <= problem.residual).all():
            return found
    raise InfeasibleError("the limits can be met only to within rounding")


def within_limits(problem: Problem, weights: ComplexArray) -> ComplexArray:
    """Weights put back where they are outside their sector, above their limit or the budget."""
    if any(s is not None for s in problem.sectors):
        pairs = zip(weights.tolist(), problem.sectors, strict=True)
        weights = np.array([project(v, s) for v, s in pairs], dtype=complex)
    size = np.abs(weights)
    over = size > problem.max_weight
    if over.any():
        shorter = problem.max_weight[over] * (1 - 1e-15)
        weights = weights.copy()
        weights[over] *= shorter / size[over]
    total = float(np.abs(weights).sum())
    return weights * (problem.budget / total * (1 - 1e-15)) if total > problem.budget else weights


def _start(problem: Problem, rows: ComplexArray) -> ComplexArray:
    """Least-squares weights within the limits of weights, or none where that is better; rows are w W."""
    on = problem.row_weights > 0
    known = problem.row_weights[on] * problem.Y[on]
    none = np.zeros(rows.shape[1], dtype=complex)
    start = within_limits(problem, solution(rows, -known))
    return start if problem.objective(start) < problem.objective(none) else none


def _discs(
    rows: ComplexArray, known: ComplexArray, head: FloatArray, n: int, t: int | None = None
) -> tuple[FloatArray, FloatArray]:
    """Cones |known + rows x| ≤ head (+ xₜ): three rows each, of n columns."""
    m, P = rows.shape
    A, b = np.zeros((m, 3, n)), np.empty((m, 3))
    A[:, 1:, : 2 * P] = -stretch(rows).reshape(m, 2, 2 * P)
    if t is not None:
        A[:, 0, t] = -1.0
    b[:, 0], b[:, 1], b[:, 2] = head, known.real, known.imag
    return A.reshape(3 * m, n), b.reshape(3 * m)


def _weights(
    largest: FloatArray, base: ComplexArray, transform: ComplexArray, sizes: FloatArray, n: int
) -> tuple[FloatArray, FloatArray]:
    """Cones |base + transform x| ≤ largest, scaled, of the planes that are limited."""
    heavy = np.isfinite(largest)
    size = sizes[heavy]
    return _discs(transform[heavy] / size[:, None], base[heavy] / size, largest[heavy] / size, n)


def _sides(
    sectors: Sequence[Arc | None], base: ComplexArray, transform: ComplexArray, sizes: FloatArray, n: int
) -> tuple[FloatArray, FloatArray]:
    """Rows b − A x ≥ 0: Re(c̄ D) ≥ 0 left of a sector's start and right of its end, D = base + T y."""
    P, rows, right = len(base), [], []
    for p, sector in enumerate(sectors):
        if sector is None:
            continue
        start, end = sector[0], sector[0] + sector[1]
        sides = [1j * np.exp(1j * start), -1j * np.exp(1j * end)]
        for inward in sides if sector[1] < np.pi - 1e-12 else sides[:1]:
            row = np.zeros(n)
            row[: 2 * P] = -stretch(inward.conjugate() * transform[p, None])[0] / sizes[p]
            rows.append(row)
            right.append(float((inward.conjugate() * base[p]).real) / sizes[p])
    return np.array(rows).reshape(len(rows), n), np.array(right)


def _solved(
    P: csc_matrix,
    q: FloatArray,
    A: csc_matrix,
    b: FloatArray,
    cones: list[Any],
    tolerance: float,
    careful: bool,
) -> tuple[FloatArray, FloatArray]:
    """The x that minimises ½ xᵀPx + qᵀx with b − A x in cones, and its dual."""
    import clarabel

    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = tolerance
    settings.presolve_enable = False
    settings.equilibrate_enable = careful
    settings.max_threads = 1
    found = clarabel.DefaultSolver(P, q, A, b, cones, settings).solve()
    if "PrimalInfeasible" in str(found.status):
        raise InfeasibleError("no weights are within the limits")
    return np.array(found.x), np.array(found.z)


def _pairs(z: FloatArray) -> ComplexArray:
    """The last two of every three rows as complex numbers."""
    triples = z.reshape(-1, 3)
    return np.asarray(triples[:, 1] + 1j * triples[:, 2])


def _csc(dense: FloatArray) -> csc_matrix:
    """Sparse matrix of a dense one, without SciPy's detours."""
    from scipy.sparse import csc_matrix as csc

    columns = np.ascontiguousarray(dense.T)
    filled = columns != 0
    ends = np.concatenate(([0], np.cumsum(filled.sum(axis=1)))).astype(np.int32)
    return csc((columns[filled], np.nonzero(filled)[1].astype(np.int32), ends), shape=dense.shape)


def _zero(n: int) -> csc_matrix:
    from scipy.sparse import csc_matrix as csc

    return csc((np.zeros(0), np.zeros(0, dtype=np.int32), np.zeros(n + 1, dtype=np.int32)), shape=(n, n))
