"""A rotor as a few masses: equivalent masses by regression, and how well the small model behaves."""

from rotorid.reduction.comparison import (
    ResponseCost,
    StabilityCost,
    compare_response,
    compare_stability,
)
from rotorid.reduction.condensation import Method, Methods, compare_methods, guyan
from rotorid.reduction.masses import (
    Separated,
    design,
    equivalent_masses,
    mac,
    natural_frequencies,
    separate,
)
from rotorid.reduction.placement import Placement, book_nodes, rank_nodes
from rotorid.reduction.reduce import InputErrors, MassErrors, Reduction, reduce, reduce_measured
from rotorid.reduction.small_model import (
    SmallModel,
    check_free,
    held_nodes,
    held_rigidly,
    keep_supports,
    small_model,
)

__all__ = [
    "InputErrors",
    "MassErrors",
    "Method",
    "Methods",
    "Placement",
    "Reduction",
    "ResponseCost",
    "Separated",
    "SmallModel",
    "StabilityCost",
    "book_nodes",
    "check_free",
    "compare_methods",
    "compare_response",
    "compare_stability",
    "design",
    "equivalent_masses",
    "guyan",
    "held_nodes",
    "held_rigidly",
    "keep_supports",
    "mac",
    "natural_frequencies",
    "rank_nodes",
    "reduce",
    "reduce_measured",
    "separate",
    "small_model",
]
