"""The one kernel: every estimation problem of this project is `K θ = Y`, solved here and nowhere else."""

from rotorid.regression.estimate import WORD_TOLERANCE, Combination, Estimate, echelon
from rotorid.regression.linear import (
    RCOND,
    covariance_root,
    gain,
    least_squares,
    solution,
    solution_and_rank,
    stack,
    stretch,
    unstretch,
)

__all__ = [
    "RCOND",
    "WORD_TOLERANCE",
    "Combination",
    "Estimate",
    "covariance_root",
    "echelon",
    "gain",
    "least_squares",
    "solution",
    "solution_and_rank",
    "stack",
    "stretch",
    "unstretch",
]
