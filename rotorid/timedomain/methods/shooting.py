"""Multiple shooting: for long or oscillating records and bad starting values.

The record is cut into pieces. Every piece begins with unknown states of its own, near the measured ones, so
that no error can grow over the whole record; that the pieces join is asked for more and more strongly. What
this finds is where the search over the whole record begins.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.regression.search import Search, drive
from rotorid.timedomain.integration.simulate import SimulationError, simulate
from rotorid.timedomain.methods.least_squares_problem import OutOfTime, Problem
from rotorid.timedomain.methods.trajectory import Curve
from rotorid.timedomain.models.record import Record

PIECES = 12
"""Of a record, at most, by default."""
SAMPLES = 6
"""Of a piece, at least, by default."""
STRICTNESS = (1.0, 10.0, 100.0)
"""Weights of the joints relative to the data, one search after the other."""
TOLERANCE, EVALUATIONS = 1e-6, 100
"""Of each search."""
RTOL = 1e-7
"""Of the integration: this is only the way to a starting point."""


@dataclass(frozen=True, eq=False)
class _Piece:
    """Samples first … last of a record (the last belongs to the next piece, and is the joint)."""

    record: Record
    number: int
    first: int
    last: int
    node: int
    final: bool


def shoot(
    problem: Problem,
    start: FloatArray,
    curves: Sequence[Curve],
    lower: FloatArray,
    upper: FloatArray,
    *,
    pieces: int | None = None,
) -> FloatArray:
    """Parameters (n,) from pieces that join.

    Parameters
    ----------
    problem
        Model, records and weights.
    start
        First parameters (n,).
    curves
        Trajectory of each record that gives the first states of the pieces, usually the measured one.
    lower, upper
        Bounds of the parameters.
    pieces
        Of each record; default: at most 12, each of six samples or more.

    Raises
    ------
    SimulationError
        A piece diverges with the starting values.
    OutOfTime
        The problem's limit of time has come.
    """
    model, n = problem.model, len(start)
    parts = _cut(problem.records, pieces)
    nodes = [curves[p.number](p.record.t[0]) for p in parts if p.first > 0]
    if not nodes or not model.states:
        return start
    search = _Pieces(problem, parts, np.array(nodes))
    z = np.concatenate((start, np.ravel(nodes)))
    low, high = np.full(len(z), -np.inf), np.full(len(z), np.inf)
    low[:n], high[:n] = lower, upper
    search.evaluate(z)
    for weight in STRICTNESS:
        search.weight = weight
        way = Search(search.residual, search.jacobian, "linear", TOLERANCE)
        z, _, _ = drive(way, z, low, high, "linear", stated=True, limit=EVALUATIONS)
    return z[:n]


class _Pieces:
    """Residuals of all pieces and joints, and their derivatives by the parameters and the states at nodes."""

    def __init__(self, problem: Problem, parts: list[_Piece], nodes: FloatArray) -> None:
        self.problem, self.parts = problem, parts
        self.free = [model.with_free_start for model in problem.models]
        self.weight = STRICTNESS[0]
        data = problem.data
        self.unit = (float(np.sqrt(np.mean(data**2))) or 1.0) * np.sqrt(len(data))
        size = np.abs(nodes).max(axis=0)
        self.scale = np.where(size > 0, size, 1.0)
        self.last: tuple[tuple[bytes, float], FloatArray, FloatArray] | None = None

    def residual(self, z: FloatArray) -> FloatArray:
        try:
            return self.evaluate(z)[0]
        except SimulationError:
            joints = sum(not p.final for p in self.parts) * len(self.scale)
            return np.full(self.problem.rows + joints, np.inf)

    def jacobian(self, z: FloatArray) -> FloatArray:
        return self.evaluate(z)[1]

    def evaluate(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        key = z.tobytes(), self.weight
        if self.last is None or self.last[0] != key:
            self.last = (key, *self._rows(z))
        return self.last[1], self.last[2]

    def _rows(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        problem = self.problem
        n, k = len(problem.model.parameters), len(problem.model.states)
        ys = [np.empty_like(data) for data in problem.measured]
        slopes = [np.zeros((*data.shape, len(z))) for data in problem.measured]
        joints, joint_slopes = [], []
        for p in self.parts:
            if problem.late:
                raise OutOfTime
            own = slice(n + p.node * k, n + (p.node + 1) * k)  # of a piece that begins with a node
            begins = p.first > 0
            theta = np.concatenate((z[:n], z[own])) if begins else z[:n]
            run = simulate(
                self.free[p.number] if begins else problem.models[p.number],
                theta,
                p.record,
                method=problem.integrator,
                rtol=RTOL,
            )
            count = p.last - p.first + p.final
            rows = slice(p.first, p.first + count)
            ys[p.number][rows] = run.y[:count]
            slopes[p.number][rows, :, :n] = run.y_theta[:count, :, :n]
            if begins:
                slopes[p.number][rows, :, own] = run.y_theta[:count, :, n:]
            if p.final:
                continue
            after = slice(n + (p.node + 1) * k, n + (p.node + 2) * k)
            joint = np.zeros((k, len(z)))
            joint[:, :n] = run.S[-1][:, :n]
            if begins:
                joint[:, own] = run.S[-1][:, n:]
            joint[:, after] = -np.eye(k)
            joints.append((run.x[-1] - z[after]) / self.scale)
            joint_slopes.append(joint / self.scale[:, None])
        r = problem.vector([y - data for y, data in zip(ys, problem.measured, strict=True)]) / self.unit
        J = problem.vector(slopes) / self.unit
        w = self.weight / np.sqrt(max(len(joints) * k, 1))
        return np.concatenate((r, w * np.ravel(joints))), np.vstack((J, w * np.vstack(joint_slopes)))


def _cut(records: Sequence[Record], pieces: int | None) -> list[_Piece]:
    """All pieces; `node` numbers the states at the beginning of a piece, over all records."""
    parts: list[_Piece] = []
    node = -1
    for number, record in enumerate(records):
        n = len(record)
        count = min(PIECES, n // SAMPLES) if pieces is None else pieces
        count = max(1, min(count, n - 1))
        edges = np.unique(np.linspace(0, n - 1, count + 1).round().astype(int))
        for i, (first, last) in enumerate(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True)):
            node += i > 0
            final = last == n - 1
            parts.append(_Piece(_slice(record, first, last + 1), number, first, last, node, final))
        if n == 1:
            parts.append(_Piece(record, number, 0, 0, node, True))
    return parts


def _slice(record: Record, first: int, last: int) -> Record:
    """Samples first … last − 1, without the outputs, which are not needed."""
    inputs = {name: column[first:last] for name, column in record.inputs.items()}
    return Record(record.t[first:last], {}, inputs, None, record.name)
