"""Weights by the weighted fit, and regions from redrawn coefficients, for simulations of coverage.

The truth is D + K e with the errors e = dY + dW D of the residual and K = A⁻¹ Ŵᵀ Σ⁻¹: Ŵ are the
coefficients less what residuals say of their errors, Σ(D) the covariance of a residual, M = Ŵᵀ Σ⁻¹ Ŵ, and A
= M less what the errors that are left in Ŵ add to it on average (at least `LEAST` of M in every direction).
"""

import numpy as np
from scipy.optimize import least_squares

from rotorid.regression import stretch, unstretch

LEAST = 0.2


class Fit:
    """Of coefficients with a baseline."""

    def __init__(self, influence):
        self.P = len(influence.planes)
        W = influence.W.reshape(-1, self.P)
        theta = np.ascontiguousarray(np.column_stack((influence.baseline.ravel(), W)))
        self.z = theta.view(float).reshape(len(W), -1)
        self.C = influence.channels().reshape(len(W), 2 * self.P + 2, -1)
        # derivatives of the residual's operator by Re D₁, Im D₁, …
        each = np.eye(self.P)
        turned = [stretch([[0.0, *unit]]) for p in range(self.P) for unit in (each[p], 1j * each[p])]
        self.E = np.array(turned)
        start = stretch(-np.linalg.lstsq(W, influence.baseline.ravel(), rcond=None)[0])
        solved = least_squares(self.residual, start, jac=self.jacobian, x_scale="jac", max_nfev=100)
        self.D = unstretch(solved.x)
        self.influence = influence

    def at(self, d):
        B = stretch([[1.0, *unstretch(d)]])
        S = B @ self.C @ B.T
        S = S + 1e-8 * np.trace(S, axis1=1, axis2=2).mean() / 2 * np.eye(2)
        root = np.linalg.inv(np.linalg.cholesky(S))
        moved = self.C @ B.T @ np.linalg.inv(S)
        left = self.z @ B.T
        adjusted = self.z - np.einsum("nij,nj->ni", moved, left)
        return B, root, left, np.einsum("kij,nj->nik", self.E, adjusted), self.C - moved @ B @ self.C

    def residual(self, d):
        _, root, left, _, _ = self.at(d)
        return np.einsum("nij,nj->ni", root, left).ravel()

    def jacobian(self, d):
        _, root, _, W, _ = self.at(d)
        return (root @ W).reshape(-1, 2 * self.P)

    def draws(self, count=400, seed=0):
        """What the truth may be, (count, P)."""
        _, root, _, W, C = self.at(stretch(self.D))
        inverse = np.swapaxes(root, 1, 2) @ root
        M = np.einsum("nik,nij,njl->kl", W, inverse, W)
        V = np.einsum("nij,kja,nab,lib->kl", inverse, self.E, C, self.E, optimize=True)
        L = np.linalg.inv(np.linalg.cholesky(M))
        shares, axes = np.linalg.eigh(L @ (M - V) @ L.T)
        A = L.T @ axes / np.maximum(shares, LEAST) @ axes.T @ L
        K = A @ np.einsum("nik,nij->knj", W, inverse).reshape(2 * self.P, -1)
        out = []
        for Y, drawn in self.influence.draws(count, seed):
            error = (Y - self.influence.baseline) + (drawn - self.influence.W) @ self.D
            out.append(self.D + unstretch(np.ascontiguousarray(error.reshape(len(Y), -1)).view(float) @ K.T))
        return np.concatenate(out)

    def holds(self, truth):
        """Whether the joint 95 % region of the draws holds the truth."""
        x = np.ascontiguousarray(self.draws() - self.D).view(float)
        S = x.T @ x / len(x)
        each = np.einsum("bi,bi->b", x, np.linalg.solve(S, x.T).T)
        each = each / (1 - each / len(x))  # as if a draw had no part in S
        e = stretch(truth - self.D)
        return bool(e @ np.linalg.solve(S, e) <= np.quantile(each, 0.95))
