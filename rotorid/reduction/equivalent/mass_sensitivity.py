"""Derivatives of the masses of formula (50), and of the frequencies of the small model, by the inputs.

With B m = D (`design`), r = D − B m and Bᵀ r = 0, a change of the inputs moves the least-squares solution by

    dm = B⁺ (dD − dB m) + (Bᵀ B)⁻¹ dBᵀ r                         (differentiate Bᵀ (D − B m) = 0).

The small model is λ x = A M x with A = G α, G = (I + α C)⁻¹, λ = 1/ω². From A⁻¹ = α⁻¹ + C follows
dA = G dα Gᵀ − A dC A, and multiplying the differentiated eigenvalue problem by xᵀ M from the left

    dλ xᵀMx = gᵀ dα g − λ² xᵀ dC x + λ xᵀ dM x,    g = Gᵀ M x,    dω/ω = −dλ / 2λ.

The same α stands in the regression and in the model, so its error acts twice.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import FloatArray
from rotorid.base.suggestions import did_you_mean
from rotorid.reduction.equivalent.equivalent_masses_formula_50 import (
    Normalisation,
    RowWeights,
    design,
    normalised,
    row_factors,
)
from rotorid.reduction.equivalent.small_model_modes import natural_frequencies
from rotorid.regression import gain


@dataclass(frozen=True, eq=False)
class InputErrors:
    """Relative standard deviations of the inputs of formula (50): 0.013 is 1.3 %. All are independent.

    Attributes
    ----------
    compliance
        Scalar or (n, n), symmetric: α_ij and α_ji are one input.
    frequencies
        Scalar or (k,).
    shapes
        Scalar or (n, k). A scalar leaves the ordinates at the first mass exact where shapes are scaled there
        (normalise="first"): they are 1 by definition.
    seal_stiffness
        Scalar or (n,).

    Raises
    ------
    ValueError
        For errors that are negative, not finite, or 1 and more.
    """

    compliance: ArrayLike = 0.0
    frequencies: ArrayLike = 0.0
    shapes: ArrayLike = 0.0
    seal_stiffness: ArrayLike = 0.0

    def __post_init__(self) -> None:
        for name in ("compliance", "frequencies", "shapes", "seal_stiffness"):
            value = np.array(getattr(self, name), dtype=float)
            if not (np.isfinite(value).all() and (value >= 0).all() and (value < 1).all()):
                raise ValueError(
                    f"errors of {name} must be shares from 0 to below 1, such as 0.013 for 1.3 %; got {value}"
                )
            object.__setattr__(self, name, value)


@dataclass(frozen=True, eq=False)
class Inputs:
    """Inputs of formula (50), and the names of all that can be wrong.

    Attributes
    ----------
    alpha, omega, U, springs
        Compliance (n, n), frequencies (k,), shapes (n, k), springs to the ground at the masses (n,).
    normalise, rows
        As in `design`.
    names
        Of the P inputs: "alpha12" (α12 and α21 together), "omega1", "U31" (mass 3 in mode 1), "c2"; with
        more than nine masses "alpha1,10".
    """

    alpha: FloatArray
    omega: FloatArray
    U: FloatArray
    springs: FloatArray
    normalise: Normalisation
    rows: RowWeights
    names: tuple[str, ...]

    def relative(self, e: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Relative changes of inputs, (S, P), as arrays (S, …) of α, ω, U and c."""
        n, k = self.U.shape
        i, j = np.triu_indices(n)
        at = np.cumsum([len(i), k, n * k])
        a, w, u, c = np.split(e, at, axis=1)
        E = np.zeros((len(e), n, n))
        E[:, i, j] = E[:, j, i] = a
        return E, w, u.reshape(-1, n, k), c

    def exact(self, e: FloatArray) -> FloatArray:
        """Masses and frequencies, (S, 2, n), with the inputs changed by relative e, (S, P)."""
        a, w, u, c = self.relative(e)
        alpha, springs = self.alpha * (1 + a), self.springs * (1 + c)
        B, D = design(
            alpha, self.omega * (1 + w), self.U * (1 + u), seal_stiffness=springs,
            normalise=self.normalise, rows=self.rows,
        )  # fmt: skip
        n = len(self.alpha)
        out = np.full((len(e), 2, n), np.nan)
        fine = np.isfinite(B).all(axis=(1, 2)) & np.isfinite(D).all(axis=1)
        B, D = B[fine], D[fine]
        m = (gain(B) @ D[..., None])[..., 0].real
        out[fine, 0] = m
        for s, masses in zip(np.flatnonzero(fine), m, strict=True):
            out[s, 1] = natural_frequencies(alpha[s], masses, seal_stiffness=springs[s])[0]
        return out

    def gradients(self, masses: FloatArray, omega: FloatArray, x: FloatArray) -> FloatArray:
        """Derivatives (P, 2, n) of masses and of the model's frequencies `omega` (shapes `x`)."""
        P = len(self.names)
        Ea, Ew, Eu, Ec = self.relative(np.eye(P))
        a, w, U, c = self.alpha, self.omega, self.U, self.springs
        da, dw, dU, dc = a * Ea, w * Ew, U * Eu, c * Ec
        n, k = U.shape
        N, dN = _scaled(U, dU, self.normalise)
        F = np.broadcast_to(row_factors(self.rows, w, n), (n, k))
        dF = np.zeros((P, n, k))
        if isinstance(self.rows, str) and self.rows == "relative":
            dF = dF + 2 * (w * dw)[:, None, :]
        B = np.einsum("ik,ij,jk->kij", F, a, N).reshape(k * n, n)
        T = N + a @ (c[:, None] * N)
        r = (F * T / w**2).T.ravel() - B @ masses
        dB = np.einsum("ik,pij,jk->pkij", F, da, N) + np.einsum("ik,ij,pjk->pkij", F, a, dN)
        dB = (dB + np.einsum("pik,ij,jk->pkij", dF, a, N)).reshape(P, k * n, n)
        dT = dN + da @ (c[:, None] * N) + a @ (dc[:, :, None] * N + c[:, None] * dN)
        dD = (dF * T + F * dT) / w**2 - 2 * (F * T / w**3) * dw[:, None, :]
        dD = np.swapaxes(dD, 1, 2).reshape(P, k * n)
        scale = np.linalg.norm(B, axis=0)
        Q, R = np.linalg.qr(B / scale)
        inverse = np.linalg.inv(R) / scale[:, None]  # (Bᵀ B)⁻¹ = inverse inverseᵀ, B⁺ = inverse Qᵀ
        dm = (dD - dB @ masses) @ Q @ inverse.T + (np.swapaxes(dB, 1, 2) @ r) @ inverse @ inverse.T
        lam = 1 / omega**2
        g = np.linalg.solve((np.eye(n) + a * c).T, masses[:, None] * x)
        dlam = np.einsum("ik,pij,jk->pk", g, da, g) - lam**2 * (dc @ x**2) + lam * (dm @ x**2)
        domega = -0.5 * omega * dlam / (lam * (masses @ x**2))
        return np.stack((dm, domega), axis=1)


def inputs(
    compliance: ArrayLike,
    frequencies: ArrayLike,
    shapes: ArrayLike,
    *,
    seal_stiffness: ArrayLike = 0.0,
    normalise: Normalisation = "first",
    rows: RowWeights = "equal",
) -> Inputs:
    """Gather and check the inputs of formula (50); parameters and errors as in `equivalent_masses`."""
    alpha, U = np.asarray(compliance, dtype=float), np.asarray(shapes, dtype=float)
    omega = np.atleast_1d(np.asarray(frequencies, dtype=float))
    B, _ = design(alpha, omega, U, seal_stiffness=seal_stiffness, normalise=normalise, rows=rows)
    if B.ndim != 2:
        raise ValueError("give one model at a time: compliance (n, n), shapes (n, k)")
    n, k = U.shape
    springs = np.array(np.broadcast_to(np.asarray(seal_stiffness, dtype=float), (n,)))
    mark = "," if n > 9 else ""
    names = (
        *(f"alpha{i + 1}{mark}{j + 1}" for i in range(n) for j in range(i, n)),
        *(f"omega{j + 1}" for j in range(k)),
        *(f"U{i + 1}{mark}{j + 1}" for i in range(n) for j in range(k)),
        *(f"c{i + 1}" for i in range(n)),
    )
    return Inputs(alpha, omega, U, springs, normalise, rows, names)


def standard_deviations(errors: InputErrors, p: Inputs) -> FloatArray:
    """Relative standard deviation of every input, (P,)."""
    n, k = p.U.shape
    out = []
    for name, value, shape in (
        ("compliance", errors.compliance, (n, n)),
        ("frequencies", errors.frequencies, (k,)),
        ("shapes", errors.shapes, (n, k)),
        ("seal_stiffness", errors.seal_stiffness, (n,)),
    ):
        given = np.asarray(value, dtype=float)
        if given.shape not in ((), shape):
            raise ValueError(f"errors of {name} must be one number or have shape {shape}; got {given.shape}")
        full = np.array(np.broadcast_to(given, shape))
        if name == "compliance":
            if not (full == full.T).all():
                raise ValueError("errors of the compliance must be symmetric: α_ij and α_ji are one input")
            full = full[np.triu_indices(n)]
        if name == "shapes" and given.ndim == 0 and p.normalise == "first":
            full[0] = 0.0
        out.append(full.ravel())
    return np.concatenate(out)


def input_index(name: str, names: tuple[str, ...]) -> int:
    """Place of an input; alpha21 is alpha12."""
    found = name
    if name not in names and name.startswith("alpha"):
        rest = name.removeprefix("alpha")
        i, mark, j = rest.partition(",")
        found = f"alpha{j},{i}" if mark else f"alpha{rest[::-1]}"
    if found not in names:
        hint = did_you_mean(name, names) if found == name else ""
        raise ValueError(f"there is no input {name!r}{hint}: choose among {', '.join(names)}")
    return names.index(found)


def _scaled(U: FloatArray, dU: FloatArray, normalise: Normalisation) -> tuple[FloatArray, FloatArray]:
    """Normalised shapes N = U / s and their changes dN = (dU − N ds) / s."""
    N = normalised(U, normalise)
    if normalise == "length":
        ds, s = (N * dU).sum(axis=1), np.linalg.norm(U, axis=0)
    else:
        at = np.zeros(U.shape[1], dtype=int) if normalise == "first" else np.abs(U).argmax(axis=0)
        columns = np.arange(U.shape[1])
        ds, s = dU[:, at, columns], U[at, columns]
    return N, (dU - N * ds[:, None, :]) / s
