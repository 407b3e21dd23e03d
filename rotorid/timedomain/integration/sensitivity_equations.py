"""States and sensitivities as one system of differential equations: dS/dt = f_x S + f_θ."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.timedomain.models.ode_model import OdeModel


class Augmented:
    """Right-hand side of the states x and, if wanted, of S = ∂x/∂θ behind them (row by row).

    Parameters
    ----------
    model, theta
        The model and its parameters (n_p,).
    t, u
        Times (n,) and inputs (n, n_u), straight lines between samples.
    sensitivities
        Whether S is part of the system.
    """

    def __init__(
        self, model: OdeModel, theta: FloatArray, t: FloatArray, u: FloatArray, sensitivities: bool
    ) -> None:
        self.model, self.theta, self.t, self.u = model, theta, t, u
        self.nx = len(model.states)
        self.np = len(theta) if sensitivities else 0
        self.size = self.nx * (1 + self.np)
        self._none = np.zeros(0)

    def inputs(self, time: float) -> FloatArray:
        """Inputs at a time, (n_u,)."""
        if not self.model.inputs:
            return self._none
        i = min(max(int(np.searchsorted(self.t, time, side="right")) - 1, 0), len(self.t) - 2)
        part = (time - self.t[i]) / (self.t[i + 1] - self.t[i])
        return np.asarray((1 - part) * self.u[i] + part * self.u[i + 1])

    def __call__(self, time: float, z: FloatArray) -> FloatArray:
        """Rates, (size,)."""
        u = self.inputs(time)
        if not self.np:
            return self.model.rate(time, z, self.theta, u)
        return self.model.augmented(time, z, self.theta, u)

    def jacobian(self, time: float, z: FloatArray) -> FloatArray:
        """Derivatives of the rates without those of f_x and f_θ themselves (good enough for Newton steps)."""
        n = self.nx
        f_x = self.model.point(time, z[:n], self.theta, self.inputs(time))[:, 1 : 1 + n]
        out = np.zeros((self.size, self.size))
        out[:n, :n] = f_x
        if self.np:
            out[n:, n:] = np.kron(f_x, np.eye(self.np))
        return out

    def rows(self, states: Sequence[int]) -> list[int]:
        """Where these states and their rows of S stand."""
        n = self.nx
        return [*states, *(n + i * self.np + k for i in states for k in range(self.np))]

    def pack(self, x: FloatArray, s: FloatArray) -> FloatArray:
        """States (n_x,) and sensitivities (n_x, n_p) as one vector."""
        return np.concatenate([x, s.reshape(-1)])

    def unpack(self, table: FloatArray) -> tuple[FloatArray, FloatArray]:
        """States (n, n_x) and sensitivities (n, n_x, n_p) of a table (n, size)."""
        return table[:, : self.nx], table[:, self.nx :].reshape(len(table), self.nx, self.np)
