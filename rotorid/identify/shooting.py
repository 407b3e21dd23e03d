"""Multiple shooting: for long or oscillating records and bad starting values.

The record is cut into pieces. Every piece begins with unknown states of its own, near the measured ones, so
that no error can grow over the whole record; that the pieces join is asked for more and more strongly: rows
w (x(end of a piece) − x(start of the next)) with w = 1, 10, 100. What this finds is where the search over the
whole record begins. Source: Bock, in "Modelling of Chemical Reaction Systems" (1981) 102.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.identify.ode import SimulationError
from rotorid.identify.record_residuals import Problem
from rotorid.identify.records import Record
from rotorid.identify.simulation import simulate
from rotorid.regression import gain
from rotorid.regression.search import Search, drive

PIECES, SAMPLES = 12, 6
"""Of a record, at most; of a piece, at least."""
STRICTNESS = (1.0, 10.0, 100.0)
"""Weights of the joints relative to the data, one search after the other."""


class _Piece(NamedTuple):
    """A part of a record: which, from where, its node of unknown first states, and that of what follows."""

    record: Record
    number: int
    first: int
    node: int | None
    after: int | None


def shoot(
    problem: Problem, start: FloatArray, trajectories: Sequence[FloatArray], limits: FloatArray
) -> FloatArray:
    """Parameters (n,) from pieces that join.

    Parameters
    ----------
    problem
        Model, records and weights.
    start
        First parameters (n,).
    trajectories
        States of each record (n_t, n_x) that begin the pieces, usually the measured ones.
    limits
        Bounds of the parameters (n, 2).

    Raises
    ------
    SimulationError
        A piece diverges with the starting values.
    """
    pieces, nodes = _cut(problem.records, trajectories)
    if not nodes.size:
        return start
    joined = _Joined(problem, pieces, nodes)
    z, n = np.concatenate((start, nodes.ravel())), len(start)
    low, high = np.full(len(z), -np.inf), np.full(len(z), np.inf)
    low[:n], high[:n] = limits.T
    for weight in STRICTNESS:
        joined.weight, joined.last = weight, None
        joined.rows(z)
        search = Search(joined.residual, lambda z: joined.rows(z)[1], "linear", 1e-6)
        z, _, _ = drive(search, z, low, high, "linear", stated=True, limit=100)
    return z[:n]


def _cut(records: Sequence[Record], trajectories: Sequence[FloatArray]) -> tuple[list[_Piece], FloatArray]:
    """Pieces, and the states at their nodes (m, n_x)."""
    pieces: list[_Piece] = []
    nodes: list[FloatArray] = []
    for number, (record, x) in enumerate(zip(records, trajectories, strict=True)):
        count = max(1, min(PIECES, len(record) // SAMPLES))
        edges = np.linspace(0, len(record) - 1, count + 1).round().astype(int).tolist()
        for first, end in pairwise(edges):
            node, after = len(nodes) - 1 if first else None, len(nodes) if end < edges[-1] else None
            nodes += [] if after is None else [x[end]]
            inputs = {name: column[first : end + 1] for name, column in record.inputs.items()}
            part = Record(record.t[first : end + 1], {}, inputs, None, record.name)
            pieces.append(_Piece(part, number, first, node, after))
    return pieces, np.array(nodes)


class _Joined:
    """Residuals of all samples and joints, and their derivatives by the parameters and the nodes (m, n_x)."""

    def __init__(self, problem: Problem, pieces: Sequence[_Piece], nodes: FloatArray) -> None:
        self.problem, self.pieces, self.shape = problem, pieces, nodes.shape
        self.free = [model.with_free_start for model in problem.models]
        self.unit = float(np.linalg.norm(problem.data)) or 1.0
        size = np.abs(nodes).max(axis=0)
        self.scale = np.where(size > 0, size, 1.0) * np.sqrt(nodes.size)
        self.weight = 1.0
        self.last: tuple[bytes, FloatArray, FloatArray] | None = None

    def residual(self, z: FloatArray) -> FloatArray:
        try:
            return self.rows(z)[0]
        except SimulationError:
            return np.full(len(self.problem.data) + math.prod(self.shape), np.inf)

    def rows(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Both at the parameters and nodes."""
        if self.last is None or self.last[0] != z.tobytes():
            self.last = (z.tobytes(), *self._rows(z))
        return self.last[1:]

    def _rows(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        problem, (m, k) = self.problem, self.shape
        n = len(z) - m * k
        ys = [np.empty_like(data) for data in problem.measured]
        slopes = [np.zeros((*data.shape, len(z))) for data in problem.measured]
        joints, joint_slopes = np.zeros((m, k)), np.zeros((m, k, len(z)))
        for piece in self.pieces:
            columns, model = np.arange(n), problem.models[piece.number]
            if piece.node is not None:
                columns = np.append(columns, n + piece.node * k + np.arange(k))
                model = self.free[piece.number]
            run = simulate(model, z[columns], piece.record, integrator=problem.integrator, rtol=1e-7)
            count = len(run.t) - (piece.after is not None)
            part = slice(piece.first, piece.first + count)
            ys[piece.number][part] = run.y[:count]
            slopes[piece.number][part, :, columns] = run.y_theta[:count]
            if piece.after is not None:
                other = n + piece.after * k + np.arange(k)
                joints[piece.after] = run.x[-1] - z[other]
                joint_slopes[piece.after][:, columns] = run.S[-1]
                joint_slopes[piece.after][:, other] = -np.eye(k)
        w = self.weight / self.scale
        r = problem.vector([y - data for y, data in zip(ys, problem.measured, strict=True)])
        return (
            np.concatenate((r / self.unit, (w * joints).ravel())),
            np.vstack((problem.vector(slopes) / self.unit, (w[:, None] * joint_slopes).reshape(-1, len(z)))),
        )


def measured_states(problem: Problem, theta: FloatArray, number: int) -> FloatArray:
    """States (n, n_x) of a record that explain its measured outputs at each time, gaps filled straight.

    Solves h(t, x, θ) = y at each time by Gauss–Newton steps of smallest change, beginning at the initial
    values; what the outputs do not tell stays there.
    """
    model, record = problem.models[number], problem.records[number]
    t, n = record.t, len(model.states)
    x = np.tile(model.x0(theta)[:, 0], (len(t), 1))
    y = problem.measured[number].copy()
    for column in y.T:
        known = ~np.isnan(column)
        if known.any():
            column[:] = np.interp(t, t[known], column[known])
    seen = ~np.isnan(y)
    for _ in range(20 if n else 0):
        outputs = model.h(t, x, theta, problem.inputs[number])
        miss = np.where(seen, y - outputs[..., 0], 0.0)
        slopes = np.where(seen[..., None], outputs[..., 1 : 1 + n], 0.0)
        if not (np.isfinite(slopes).all() and np.isfinite(miss).all()):
            raise SimulationError(f"{record.name}: no states explain the measured outputs")
        step = np.einsum("tij,tj->ti", gain(slopes, rcond=1e-8), miss)
        x = x + step
        if np.abs(step).max() <= 1e-9 * (1 + np.abs(x).max()):
            break
    return x
