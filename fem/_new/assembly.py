"""Names of the old modules until this one is written."""

from fem.matrices.banded_matrices import (
    Matrices,
    assemble,
    dense,
    free_motions,
    general,
    held,
    ignored_inertia,
    multiply,
    rounding_error,
    shaft_energy,
)
from fem.matrices.equations_of_motion import Motion, equations_of_motion
from fem.matrices.lateral_planes import Planes, both_planes, project
from fem.matrices.lateral_planes import Quadratic as Reduced
from fem.matrices.support_dynamic_stiffness import Supported, on_whirl, supported, whirl_change
from fem.matrices.undamped_matrices import FROM_XY, TO_XY, static_stiffness
from fem.solvers.full_band import Factored, WholeBand

__all__ = [
    "FROM_XY",
    "TO_XY",
    "Factored",
    "Matrices",
    "Motion",
    "Planes",
    "Reduced",
    "Supported",
    "WholeBand",
    "assemble",
    "both_planes",
    "dense",
    "equations_of_motion",
    "free_motions",
    "general",
    "held",
    "ignored_inertia",
    "multiply",
    "on_whirl",
    "project",
    "rounding_error",
    "shaft_energy",
    "static_stiffness",
    "supported",
    "whirl_change",
]
