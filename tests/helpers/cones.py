"""Cone programs of correction weights in one call."""

from balancing.solvers.cone import problem, solve_cone


def least_squares_cone(W, Y, **given):
    return solve_cone(problem(W, Y, **given))


def minmax_cone(W, Y, **given):
    return solve_cone(problem(W, Y, minmax=True, **given))


def weight_budget_cone(W, Y, budget, **given):
    return solve_cone(problem(W, Y, budget=budget, **given))
