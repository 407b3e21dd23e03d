"""Names of the old modules until this one is written."""

from fem.solvers.quadratic_eigenvalues import Solutions, all_values, polish, solve
from fem.solvers.reduced_whirl import Whirl, enriched, solve_whirl
from fem.whirl import WhirlModes, whirl_modes

__all__ = [
    "Solutions",
    "Whirl",
    "WhirlModes",
    "all_values",
    "enriched",
    "polish",
    "solve",
    "solve_whirl",
    "whirl_modes",
]
