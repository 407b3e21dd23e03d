"""What records determine of a model in time where they do not determine every parameter, in words.

The outputs depend on the parameters by the coefficients of the equations alone: in dx/dt = −(a + b) x + g h u
these are a + b and g h. A coefficient, or a product or quotient of two, is determined where its gradient
stands in the row space of the sensitivities, here and at other values, so that it is no chance of the place.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np

from rotorid.identify.expression_functions import Compiled, jacobian, usual
from rotorid.identify.ode import OdeModel
from rotorid.identify.record_residuals import Problem
from rotorid.regression import least_squares
from rotorid.regression.estimate import Estimate
from rotorid.regression.search import RCOND
from rotorid.regression.undetermined_combinations import Combination

REACH = 0.2
"""How far the other values are, relative to the parameters."""
SAME = 1e-5
"""Share of a gradient outside the row space that is none."""
MOST = 24
"""Coefficients of which pairs are formed."""


def combined(problem: Problem, estimate: Estimate) -> tuple[Estimate, str]:
    """The estimate with combinations that hold for the nonlinear model, and a warning or nothing."""
    if estimate.full_rank:
        return estimate, ""
    theta, names = estimate.solution, np.array(estimate.names)
    scale = np.where(theta == 0, 1.0, np.abs(theta))
    other = theta + REACH * scale * np.linspace(1.0, -0.7, len(theta))
    points, spaces = [theta], [estimate.row_space]
    if np.isfinite(problem.residual(other)).all():
        J = problem.jacobian(other)
        points.append(other)
        spaces.append(least_squares(J, np.zeros(len(J)), rcond=RCOND).row_space)
    problem.residual(theta)  # the problem keeps the runs of the last point
    # tangents, without standard deviations
    near = [replace(c, words=f"(near these values) {c.words}", std=None) for c in estimate.combinations]
    tangents = replace(estimate, curved=tuple(near))
    if len(spaces[-1]) > len(spaces[0]):
        return tangents, (
            f"the record's sensitivity to {', '.join(estimate.undetermined)} (or to a combination) vanishes "
            "at the values found, but not beside them: it may be determined after all; start elsewhere"
        )
    null = [np.linalg.svd(rows * scale)[2][len(rows) :] for rows in spaces]
    rows = [scale * (names == name) for name in names if name not in estimate.undetermined]
    chosen: list[Combination] = []
    by = problem.model.symbols[1 + len(problem.model.states) :][: len(theta)]
    for expression in _candidates(problem.model, by):
        if len(rows) == estimate.rank:
            break
        compiled = Compiled(by, jacobian([expression], by), (1 + len(by),))
        tables = [compiled.one(point.tolist()) for point in points]
        gradients = [table[1:] * scale for table in tables]
        sizes = [float(np.linalg.norm(g)) for g in gradients]
        if not all(
            0 < size < np.inf and np.linalg.norm(N @ g) <= SAME * size
            for N, g, size in zip(null, gradients, sizes, strict=True)
        ):
            continue
        if np.linalg.matrix_rank(np.array([*rows, gradients[0]]), tol=1e-6 * sizes[0]) > len(rows):
            rows.append(gradients[0])
            cov, value, slope = estimate.solution_covariance, tables[0][0], tables[0][1:]
            std = None if cov is None else float(np.sqrt(max(float(slope @ cov @ slope), 0.0)))
            words = str(usual(expression)).replace("**", "^").replace("*", "·")  # such as a·b^2/c
            chosen.append(Combination(words, float(value), std, slope))
    return (replace(estimate, curved=tuple(chosen)) if len(rows) == estimate.rank else tangents), ""


def _candidates(model: OdeModel, parameters: list[Any]) -> Iterator[Any]:
    """Coefficients of the equations, the simple ones first, then products and quotients of two."""
    import sympy

    varying = {*model.symbols} - {*parameters}
    parts: dict[Any, None] = {}
    for expression in (*model.rates, *model.observed, *model.initial, *model.inertia):
        terms: dict[Any, Any] = {}
        """Coefficient of what varies."""
        for term in sympy.Add.make_args(sympy.expand(expression)):
            coefficient, rest = term.as_independent(*varying, as_Add=False)
            terms[rest] = terms.get(rest, 0) + coefficient
        for rest, coefficient in terms.items():
            inside = (part for part in sympy.preorder_traversal(rest) if part.args)
            for part in (sympy.factor_terms(sympy.together(coefficient)), *inside):
                if part.free_symbols and not part.free_symbols & varying:
                    parts[sympy.Mul(*(f for f in sympy.Mul.make_args(part) if not f.is_number))] = None
    single = sorted(parts, key=lambda e: (sympy.count_ops(e), str(e)))
    yield from single
    for a, b in combinations(single[:MOST], 2):
        yield from (a * b, a / b)
