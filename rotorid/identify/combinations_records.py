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

from rotorid.base.arrays import FloatArray
from rotorid.identify.expression_functions import Compiled, jacobian, usual
from rotorid.identify.expressions import names
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
    theta, model = estimate.solution, problem.model
    scale = np.where(theta == 0, 1.0, np.abs(theta))
    other = theta + REACH * scale * np.linspace(1.0, -0.7, len(theta))
    null = [_null_space(estimate.row_space * scale)]
    beside = bool(np.isfinite(problem.residual(other)).all())
    if beside:
        J = problem.jacobian(other)
        null.append(_null_space(least_squares(J, np.zeros(len(J)), rcond=RCOND).row_space * scale))
    problem.residual(theta)  # the problem keeps the runs of the last point
    which = ", ".join(estimate.undetermined)
    words = (
        f"the record's sensitivity to {which} (or to a combination) vanishes at the values found, but not "
        "beside them: it may be determined after all; start elsewhere"
    )
    if beside and len(null[1]) < len(null[0]):
        return replace(estimate, curved=_near(estimate)), words
    rows = [scale * (np.array(estimate.names) == n) for n in estimate.names if n not in estimate.undetermined]
    chosen: list[Combination] = []
    by = [_symbol(name) for name in estimate.names]
    for expression in _candidates(model):
        if len(rows) == estimate.rank:
            break
        made = Compiled(by, jacobian([expression], by), (1 + len(by),))
        tables = [made.one(point.tolist()) for point in (theta, other)[: len(null)]]
        gradients = [table[1:] * scale for table in tables]
        sizes = [float(np.linalg.norm(g)) for g in gradients]
        inside = all(
            size > 0 and np.isfinite(size) and np.linalg.norm(N @ g) <= SAME * size
            for N, g, size in zip(null, gradients, sizes, strict=True)
        )
        if not inside or np.linalg.matrix_rank(np.array([*rows, gradients[0]]), tol=1e-6 * sizes[0]) == len(
            rows
        ):
            continue
        rows.append(gradients[0])
        cov, slope = estimate.solution_covariance, tables[0][1:]
        std = None if cov is None else float(np.sqrt(max(float(slope @ cov @ slope), 0.0)))
        chosen.append(Combination(_written(expression), float(tables[0][0]), std, slope))
    if len(rows) < estimate.rank:
        return replace(estimate, curved=_near(estimate)), ""
    return replace(estimate, curved=tuple(chosen)), ""


def _near(estimate: Estimate) -> tuple[Combination, ...]:
    """Tangents, without standard deviations."""
    return tuple(replace(c, words=f"(near these values) {c.words}", std=None) for c in estimate.combinations)


def _null_space(rows: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.svd(rows)[2][len(rows) :])


def _symbol(name: str) -> Any:  # noqa: ANN401  sympy has no types
    import sympy

    return sympy.Symbol(name)


def _candidates(model: OdeModel) -> Iterator[Any]:
    """Coefficients of the equations, the simple ones first, then products and quotients of two."""
    import sympy

    parameters = {*model.parameters}
    varying = [_symbol(name) for name in ("t", *model.states, *model.inputs)]
    parts: dict[Any, None] = {}
    for expression in (*model.rates, *model.observed, *model.initial, *model.inertia):
        for term, coefficient in _terms(expression, varying):
            for part in (coefficient, *(a for a in sympy.preorder_traversal(term) if a.args)):
                if parameters & names(part) and not {*part.free_symbols} & {*varying}:
                    parts[_without_number(part)] = None
    single = sorted(parts, key=lambda e: (sympy.count_ops(e), str(e)))
    yield from single
    for a, b in combinations(single[:MOST], 2):
        yield from (a * b, a / b)


def _terms(expression: Any, varying: list[Any]) -> Iterator[tuple[Any, Any]]:  # noqa: ANN401
    """What varies in each term of a sum, and its coefficient."""
    import sympy

    collected: dict[Any, Any] = {}
    for term in sympy.Add.make_args(sympy.expand(expression)):
        coefficient, rest = term.as_independent(*varying, as_Add=False)
        collected[rest] = collected.get(rest, 0) + coefficient
    yield from ((rest, sympy.factor_terms(sympy.together(c))) for rest, c in collected.items())


def _without_number(expression: Any) -> Any:  # noqa: ANN401
    """Without a factor that is a number."""
    import sympy

    return sympy.Mul(*(f for f in sympy.Mul.make_args(expression) if not f.is_number))


def _written(expression: Any) -> str:  # noqa: ANN401
    """Such as a·b^2/c."""
    return str(usual(expression)).replace("**", "^").replace("*", "·")
