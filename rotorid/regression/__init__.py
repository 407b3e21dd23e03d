"""The one kernel: every estimation problem of this project is `K θ = Y`, solved here and nowhere else."""

from rotorid.regression.estimate import Estimate, coverage_factor
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
from rotorid.regression.undetermined_combinations import WORD_TOLERANCE, Combination, echelon

__all__ = [
    "RCOND",
    "WORD_TOLERANCE",
    "Combination",
    "Estimate",
    "covariance_root",
    "coverage_factor",
    "echelon",
    "gain",
    "least_squares",
    "solution",
    "solution_and_rank",
    "stack",
    "stretch",
    "unstretch",
]
