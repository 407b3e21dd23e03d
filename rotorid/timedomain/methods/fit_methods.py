"""Methods of `fit` (registry), and one search for the parameters by one of them, within a limit of time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import FloatArray
from rotorid.base.registry import Method
from rotorid.regression.nonlinear import nonlinear_least_squares
from rotorid.timedomain.methods.gauss_newton import gauss_newton
from rotorid.timedomain.methods.iteration_history import Path, Stop, at, half_square
from rotorid.timedomain.methods.least_squares_problem import OutOfTime, Problem
from rotorid.timedomain.methods.quasilinearization import quasilinearization
from rotorid.timedomain.methods.shooting import shoot
from rotorid.timedomain.methods.trajectory import Curve, given_trajectory, measured_trajectory, own_trajectory

Trajectories = str | Mapping[str, str | float | ArrayLike]


@dataclass(frozen=True, eq=False)
class Search:
    """What a search needs beside the problem and its start; see `fit`."""

    way: Callable[[Search, Problem, FloatArray], Path]
    limits: FloatArray
    loss: str
    trajectory: Trajectories
    pieces: int | None
    max_iterations: int
    stop: Stop

    def __call__(self, problem: Problem, theta: FloatArray) -> Path:
        """Search from these parameters (n,); the best so far where the time runs out."""
        problem.best = None
        try:
            return self.way(self, problem, theta)
        except OutOfTime:
            return _so_far(problem, theta)


def _levenberg_marquardt(search: Search, problem: Problem, start: FloatArray) -> Path:
    problem.evaluate(start)  # says why, where the states diverge
    names = problem.model.parameters
    found = nonlinear_least_squares(
        problem.residual,
        problem.jacobian,
        start,
        names=names,
        sigma_stated=problem.scaled,
        bounds={name: (low, high) for name, (low, high) in zip(names, search.limits.tolist(), strict=True)},
        loss=search.loss,
        max_iterations=search.max_iterations,
        near=search.loss == "linear",
        prior=problem.prior,
    )
    return Path(**vars(found))


def _gauss_newton(search: Search, problem: Problem, start: FloatArray) -> Path:
    return gauss_newton(problem, start, max_iterations=search.max_iterations, stop=search.stop)


def _quasilinearization(search: Search, problem: Problem, start: FloatArray) -> Path:
    return quasilinearization(
        problem,
        start,
        _curves(problem, start, search.trajectory),
        max_iterations=search.max_iterations,
        stop=search.stop,
    )


def _multiple_shooting(search: Search, problem: Problem, start: FloatArray) -> Path:
    curves = _curves(problem, start, search.trajectory)
    first = shoot(problem, start, curves, *search.limits.T, pieces=search.pieces)
    path = _levenberg_marquardt(search, problem, first)
    return path if first is start else path.after(start[None])


METHODS = (
    Method("levenberg-marquardt", "safeguarded, with bounds and robust losses", _levenberg_marquardt),
    Method("gauss-newton", "whole steps without safeguards, as [F]", _gauss_newton),
    Method("quasilinearization", "linear fits about the last trajectory, as [Q]", _quasilinearization),
    Method(
        "multiple-shooting",
        "for long or oscillating records and bad starts; then levenberg-marquardt",
        _multiple_shooting,
    ),
)


def _curves(problem: Problem, theta: FloatArray, kind: Trajectories) -> list[Curve]:
    if isinstance(kind, Mapping):
        return [given_trajectory(problem.model, kind, record) for record in problem.records]
    if kind == "data":
        both = zip(problem.models, problem.records, strict=True)
        return [measured_trajectory(model, theta, record) for model, record in both]
    if kind != "model":
        raise ValueError(f"no starting trajectory {kind!r}: it is 'model', 'data', or given by state")
    return [own_trajectory(problem, theta, number) for number in range(len(problem.records))]


def _so_far(problem: Problem, start: FloatArray) -> Path:
    """The best point of a search that ran out of time."""
    seconds, problem.limit = problem.seconds, np.inf
    theta = start if problem.best is None else problem.best[1]
    r, J = problem.evaluate(theta)
    problem.limit = 0.0
    words = (
        f"not converged: the search was stopped after {seconds:.3g} s; allow more (--max-seconds), start "
        "nearer or take another method"
    )
    costs = np.array([np.nan, half_square(r, problem.prior.residual(theta))])
    return Path(at(problem.linear_fit(J, -r, theta), theta, r), np.stack([start, theta]), costs, False, words)
