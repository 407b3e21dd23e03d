"""Unbalance at any stations from the readings of a single run: Y = W U, so that corrections are −U.

Source: [S] 1.9.1, (28)–(33), extended to more stations than readings. With the singular values
W = Σ u_i s_i v_iᴴ (rows divided by the errors of the readings where these are known) the estimate is
U = Σ f_i v_i (u_iᴴ Y) / s_i:

- f_i = 1 for s_i > 0: least squares where the readings determine every station, else the smallest unbalance
  (|U| least) that causes these readings;
- f_i = s_i² / (s_i² + λ²) ("ridge"): least |Y − W U|² + λ² |U|². λ is given, or such that the readings are
  met as well as their errors allow (discrepancy principle: Σ |r_i|²/σ_i² = 2 N), or, without known errors,
  by generalised cross-validation: least |r|² / (N − Σ f_i)².

"modal": the vibration is Σ_j g_j(ω) ψ_j (φ_jᵀ U) over the modes: mode j sees of an unbalance only
b_j = φ_jᵀ U. Of all distributions with the same b = (b_1 … b_k) the one with the least Σ |U_q|²/m_q is
U = M Φ a with Φᵀ M Φ a = b (Lagrange: 2 M⁻¹ U = Φ μ), hence U = B b with B = M Φ (Φᵀ M Φ)⁻¹ and ΦᵀB = 1.
The k numbers b follow from Y = (W B) b by least squares; −U then takes away what excites modes 1…k. Of the
modes above k the readings must hold little: take them near the critical speeds 1…k.

U = G Y is linear in the readings: the covariance of U is that of the readings through G, and U = R U_true
without errors, with the resolution matrix R = G W. Row q of R tells of which stations' unbalance the estimate
of station q is made: where it is that of the unit matrix, the station is determined.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from balancing.coefficients.baseline import starting_point
from balancing.coefficients.identifiability import HOPELESS, UndeterminedError, separation
from balancing.coefficients.influence import Influence
from balancing.coefficients.repeatability import tail
from balancing.coefficients.run_errors import marginal, passes_zero
from balancing.data.conventions import Labels
from balancing.data.reading_errors import mean_variance, symmetric
from balancing.data.trials import Trials, check_names
from balancing.solvers.conditioning import check_stack
from balancing.solvers.error_propagation import (
    common_covariance,
    prediction_covariance,
    real_columns,
    whitening,
)
from balancing.unbalance_result import Unbalance
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.registry import Method, find
from rotorid.base.text import counted
from rotorid.regression import RCOND, gain, solution, stretch

_Gain = tuple[ComplexArray, int, float, float | None]
"""G (n, N), rank, condition number of what is determined, and λ relative to the largest s."""
LEVEL = 0.99
_REASONS = "unbalance elsewhere, wrong coefficients or a nonlinear rotor are likely reasons"
_PASSES = 4
_DEPENDENT = 1e6
_SMALLEST, _LARGEST = 1e-10, 1e6
"""Range of λ, relative to the largest singular value."""


def estimate_unbalance(  # noqa: PLR0913
    W: ArrayLike,
    Y: ArrayLike,
    *,
    method: str = "minimum-norm",
    names: Sequence[str] | None = None,
    covariance: ArrayLike | None = None,
    common: ComplexArray | None = None,
    parameters: ComplexArray | None = None,
    ridge: float | None = None,
    shapes: ArrayLike | None = None,
    masses: ArrayLike | None = None,
    labels: Labels | None = None,
) -> Unbalance:
    """Estimate the unbalance at Q stations from N readings (sensors × speeds) of one run.

    Parameters
    ----------
    W
        Influence coefficients, shape (N, Q), such as `model_influence(…).W.reshape(-1, Q)`.
    Y
        Complex readings, shape (N,).
    method
        One of `METHODS`.
    names
        Of the stations; default 1 … Q.
    covariance
        Of (Re Y, Im Y) of each reading, (N, 2, 2), or of (Re Y, Im Y, Re W₁, Im W₁, …), (N, 2Q + 2, 2Q + 2);
        rows then count by their variance. Default: unknown.
    common
        What of it the readings have in common, as `balancing.Influence.common`, (2, M, S, C, Q + 1) with
        S C = N; default: nothing.
    parameters
        What of it errors of a model's parameters do, as `balancing.Influence.parameters`, (M, S, C, Q + 1).
    ridge
        λ relative to the largest singular value, for "ridge"; default: chosen as described above.
    shapes
        Φ for "modal", shape (Q, k), such as `modal_shapes(…)`; its scale does not matter.
    masses
        Diagonal of M for "modal", shape (Q,), > 0; default all alike.
    labels
        Units and conventions to print in; default SI.

    Raises
    ------
    ValueError
        For shapes that do not fit, NaN, and options of another method.
    UndeterminedError
        Where no station has an effect, or the readings or stations do not tell the modes apart.
    """
    A, y, _ = check_stack(W, Y)
    N, Q = A.shape
    stations = check_names(names or [str(q) for q in range(1, Q + 1)], "stations")
    if len(stations) != Q:
        raise ValueError(f"{Q} names of stations are needed; got {len(stations)}")
    fit = find(METHODS, method, "method").function
    _check_options(method, ridge, shapes, masses)
    if not A.any():
        raise UndeterminedError("no station has an effect on any reading: check the coefficients")
    channels = _channels(covariance, N, Q)
    basis = np.eye(Q) if shapes is None else _basis(shapes, masses, Q)
    variance: FloatArray | None = None
    sigma: FloatArray | None = None
    U, G, rank, condition, used = np.zeros(Q, dtype=complex), np.zeros((Q, N), dtype=complex), 0, 1.0, ridge
    for _ in range(_PASSES if channels is not None and channels.shape[1] > 2 else 1):
        if channels is not None:
            variance = prediction_covariance(-U[: (channels.shape[1] - 2) // 2], channels)
            sigma = _sigma(variance)
        G, rank, condition, used = fit((A @ basis).astype(complex), y, sigma, ridge)
        G = basis @ G
        U = G @ y
    residual = y - A @ U
    out = chi_square = None
    if channels is not None:
        variance = prediction_covariance(-U[: (channels.shape[1] - 2) // 2], channels)
        rows = np.moveaxis(stretch(G).reshape(2 * Q, N, 2), 1, 0)
        shared, known = _shared(common, U, N, (2,)), _shared(parameters, U, N, ())
        known = known.reshape(-1, *shared.shape[2:])
        own = variance - marginal(shared[..., None], known[..., None]).reshape(N, 2, 2)
        parts = common_covariance(rows, shared[..., None], known[..., None])
        out = symmetric(sum(parts, np.einsum("nai,nij,nbj->ab", rows, own, rows)))
        white = _whitening(own, shared, known)
        left = white(residual[:, None])[:, :1]
        if used is None:  # the least that unbalance at the stations leaves
            fitted = white((A @ basis).astype(complex))
            left -= fitted @ solution(fitted, left)
        chi_square = float(np.sum(left**2))
    result = Unbalance(
        stations=stations,
        unbalance=U,
        residual=residual,
        method="least-squares" if method == "minimum-norm" and rank == Q else method,
        rank=rank,
        resolution=G @ A,
        covariance=out,
        chi_square=chi_square,
        condition_number=condition,
        ridge=used,
        modal=None if shapes is None else np.asarray(np.array(shapes, dtype=complex).T @ U),
        labels=labels or Labels(weight_unit="kg_m"),
    )
    return result.with_warnings(_warnings(result, N))


def unbalance_of_run(
    influence: Influence,
    baseline: Trials | ArrayLike | None = None,
    *,
    method: str = "minimum-norm",
    ridge: float | None = None,
    shapes: ArrayLike | None = None,
    masses: ArrayLike | None = None,
) -> Unbalance:
    """Estimate the unbalance at the planes of the coefficients from a baseline run, with its errors.

    Parameters
    ----------
    influence
        Coefficients of any stations, such as `model_influence(…)`.
    baseline
        As in `correct`: runs (what is mounted in them is taken into account), complex amplitudes (S, C) of
        the bare rotor, or nothing where the coefficients have a baseline.
    method, ridge, shapes, masses
        As in `estimate_unbalance`.

    Raises
    ------
    ValueError
        As `correct` and `estimate_unbalance`.
    """
    start = starting_point(influence, baseline)
    n = 2 * len(influence.planes) + 2
    unit = influence.labels.weight_unit, influence.labels.weight_scale
    result = estimate_unbalance(
        influence.W.reshape(-1, len(influence.planes)),
        start.readings.ravel(),
        method=method,
        names=influence.planes,
        covariance=None if start.covariance is None else start.covariance.reshape(-1, n, n),
        common=start.common,
        parameters=start.parameters,
        ridge=ridge,
        shapes=shapes,
        masses=masses,
        labels=replace(start.labels, weight_unit=unit[0], weight_scale=unit[1]),
    )
    return result.with_warnings(influence.warnings + start.warnings + result.warnings)


def _check_options(
    method: str, ridge: float | None, shapes: ArrayLike | None, masses: ArrayLike | None
) -> None:
    if method != "ridge" and ridge is not None:
        raise ValueError(f'ridge is an option of the method "ridge", not of {method!r}')
    if ridge is not None and not (np.isfinite(ridge) and ridge > 0):
        raise ValueError(f"ridge must be a finite number > 0, not {ridge}")
    if method == "modal" and shapes is None:
        raise ValueError('the method "modal" needs the mode shapes at the stations')
    if method != "modal" and (shapes is not None or masses is not None):
        raise ValueError(f'shapes and masses are options of the method "modal", not of {method!r}')


def _channels(covariance: ArrayLike | None, N: int, Q: int) -> FloatArray | None:
    if covariance is None:
        return None
    channels = np.array(covariance, dtype=np.float64)
    if channels.shape not in ((N, 2, 2), (N, 2 * Q + 2, 2 * Q + 2)):
        raise ValueError(
            f"the covariance must have shape ({N}, 2, 2), or with that of the coefficients "
            f"({N}, {2 * Q + 2}, {2 * Q + 2}); got {channels.shape}"
        )
    if not np.isfinite(channels).all() or not channels.any():
        raise ValueError("the covariance of the readings must be finite and not all zero")
    return channels


def _shared(columns: ComplexArray | None, U: ComplexArray, N: int, kinds: tuple[int, ...]) -> ComplexArray:
    """What Y − W U has in common, or of parameters, (*kinds, M, S, C)."""
    if columns is None:
        return np.zeros((*kinds, 0, 1, N), dtype=complex)
    if columns.shape[-3] * columns.shape[-2] != N or columns.shape[-1] != len(U) + 1:
        raise ValueError(f"what {N} readings have in common has not the shape {columns.shape}")
    return np.asarray(columns @ np.concatenate(([1.0], -U)))


def _whitening(
    own: FloatArray, shared: ComplexArray, known: ComplexArray
) -> Callable[[ComplexArray], FloatArray]:
    """How to divide readings (N, j) by the root of their covariance, into real ones (2N, 2j)."""
    S, C = shared.shape[2:]
    diagonal = np.repeat(_sigma(own) ** 2, 2).reshape(S, 2 * C)
    run = np.concatenate((real_columns(shared[0]), real_columns(known)[..., ::2]), axis=-1)
    white, _ = whitening(diagonal[..., None] * np.eye(2 * C), real_columns(shared[1]), run)
    return lambda z: white(stretch(z).reshape(S, 2 * C, -1)).reshape(2 * len(z), -1)


def _sigma(variance: FloatArray) -> FloatArray:
    """Standard deviation of each reading in one direction (N,); none counts infinitely much.

    All alike where there is none: errors of coefficients alone, before an unbalance is known.
    """
    mean = mean_variance(variance)
    return np.asarray(np.sqrt(np.maximum(mean, 1e-8 * mean.max()))) if mean.any() else np.ones(len(mean))


def _basis(shapes: ArrayLike | None, masses: ArrayLike | None, Q: int) -> FloatArray:
    """B = M Φ (Φᵀ M Φ)⁻¹, shape (Q, k)."""
    Phi = np.array(shapes, dtype=np.float64)
    if Phi.ndim != 2 or len(Phi) != Q or not Phi.shape[1] or not np.isfinite(Phi).all():
        raise ValueError(f"the mode shapes must be finite and have shape ({Q}, k); got {Phi.shape}")
    m = np.ones(Q) if masses is None else np.array(masses, dtype=np.float64)
    if m.shape != (Q,) or not (np.isfinite(m) & (m > 0)).all():
        raise ValueError(f"the masses must be finite, > 0, and have shape ({Q},); got {m.shape}")
    root = np.sqrt(m)[:, None] * Phi
    if separation(root).condition_number >= _DEPENDENT:
        raise UndeterminedError(
            f"{counted(Q, 'station')} cannot tell {Phi.shape[1]} modes apart: "
            "choose fewer modes, or more stations where the shapes differ"
        )
    return np.asarray(np.sqrt(m)[:, None] * gain(root).real.T)


def _minimum_norm(A: ComplexArray, y: ComplexArray, sigma: FloatArray | None, ridge: float | None) -> _Gain:
    return (*_ridge(A, y, sigma, 0.0)[:3], None)


def _ridge(A: ComplexArray, y: ComplexArray, sigma: FloatArray | None, ridge: float | None) -> _Gain:
    weight = _row_weights(sigma, len(A))
    # the columns are not scaled: the norm of stations has a meaning
    left, s, right = np.linalg.svd(weight[:, None] * A, full_matrices=False)
    rank = int(np.count_nonzero(s > RCOND * s[0]))
    left, s, right = left[:, :rank], s[:rank], right[:rank]
    if ridge is None:
        b = weight * y
        beta = np.abs(left.conj().T @ b) ** 2
        rest = max(float(np.sum(np.abs(b) ** 2) - beta.sum()), 0.0)
        choose = _by_gcv if sigma is None else _by_discrepancy
        ridge = choose(s, beta, rest, len(y))
    filtered = s / (s**2 + (ridge * s[0]) ** 2)
    G = (right.conj().T * filtered) @ left.conj().T
    return np.asarray(G * weight), rank, float(s[0] / s[-1]), ridge


def _modal(A: ComplexArray, y: ComplexArray, sigma: FloatArray | None, ridge: float | None) -> _Gain:
    weight = _row_weights(sigma, len(A))
    rows = weight[:, None] * A
    told = separation(rows)
    if told.rank < A.shape[1]:
        raise UndeterminedError(
            f"{counted(len(A), 'reading')} cannot tell {A.shape[1]} modes apart: "
            "choose fewer modes, or add sensors or speeds"
        )
    return gain(rows) * weight, told.rank, told.condition_number, None


METHODS: tuple[
    Method[Callable[[ComplexArray, ComplexArray, FloatArray | None, float | None], _Gain]], ...
] = (
    Method(
        "minimum-norm",
        "least squares where the readings suffice, else the smallest unbalance that explains them",
        _minimum_norm,
    ),
    Method("ridge", "small unbalances where the readings tell little", _ridge),
    Method("modal", "what excites the first modes, as the smallest unbalance that does", _modal),
)
"""Gain from the columns A (N, n), readings, their deviations and λ."""


def _row_weights(sigma: FloatArray | None, n: int) -> FloatArray:
    return np.ones(n) if sigma is None else np.asarray(1.0 / sigma)


def _remains(
    s: FloatArray, beta: FloatArray, rest: float, ridge: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Squared residual and Σ (1 − f_i) for each relative λ."""
    lost = 1 / (1 + (s / (ridge[..., None] * s[0])) ** 2)
    return rest + np.sum(lost**2 * beta, axis=-1), lost.sum(axis=-1)


def _by_discrepancy(s: FloatArray, beta: FloatArray, rest: float, N: int) -> float:
    """λ at which Σ |r|²/σ² = 2 N (the residual grows with λ)."""

    def excess(exponent: float) -> float:
        return float(_remains(s, beta, rest, np.exp(np.array(exponent)))[0]) - 2 * N

    return float(np.exp(passes_zero(excess, np.log(_SMALLEST), np.log(_LARGEST))))


def _by_gcv(s: FloatArray, beta: FloatArray, rest: float, N: int) -> float:
    """λ of the least generalised cross-validation, on a grid that is refined around the best."""
    low, high = np.log(_SMALLEST), np.log(_LARGEST)
    best = low
    for _ in range(3):
        grid = np.linspace(low, high, 200)
        squares, free = _remains(s, beta, rest, np.exp(grid))
        place = int(np.argmin(squares / (N - len(s) + free) ** 2))
        best, step = grid[place], grid[1] - grid[0]
        low, high = best - step, best + step
    return float(np.exp(best))


def _warnings(result: Unbalance, N: int) -> tuple[str, ...]:
    out = []
    if result.method in ("least-squares", "minimum-norm") and result.condition_number > HOPELESS:
        out.append(
            f"small errors of the readings become large unbalances (condition number "
            f'{result.condition_number:.2g}): use the method "ridge" or "modal", or fewer stations'
        )
    free = N - (len(result.modal) if result.modal is not None else result.rank)
    tested = result.chi_square if result.method != "ridge" and free > 0 else None
    # half of it with half the degrees of freedom: right even if errors have one direction only
    if tested is not None and tail(tested / 2, free, None) < 1 - LEVEL:
        ratio = np.sqrt(tested / (2 * free))
        out.append(
            f"the readings differ from what unbalance {_where(result)} causes by {ratio:.2g} times their "
            f"errors: {_REASONS}"
        )
    if result.ridge is not None and result.ridge >= 0.99 * _LARGEST:
        out.append("the readings lie within their errors: they show no unbalance at all")
    if result.ridge is not None and result.chi_square is not None and result.ridge <= 1.01 * _SMALLEST:
        out.append(f"no unbalance at these stations meets the readings within their errors: {_REASONS}")
    return tuple(out)


def _where(result: Unbalance) -> str:
    return "at these stations" if result.modal is None else f"in {counted(len(result.modal), 'mode')}"
