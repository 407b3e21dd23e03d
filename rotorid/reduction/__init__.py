"""A rotor as a few masses: equivalent masses by regression, and how well the small model behaves."""

from rotorid.reduction.masses import design, equivalent_masses
from rotorid.reduction.matching import Matching, match, matching_masses
from rotorid.reduction.methods import compare_methods, guyan, irs, serep
from rotorid.reduction.methods_result import Method, Methods
from rotorid.reduction.placement import book_nodes, rank_nodes
from rotorid.reduction.placement_result import Placement
from rotorid.reduction.reducing import reduce, reduce_measured
from rotorid.reduction.result import Choices, Reduction
from rotorid.reduction.running import ResponseCost, compare_response
from rotorid.reduction.sensitivity import InputErrors, mass_sensitivity
from rotorid.reduction.separated import Separated, separate, separated_compliance
from rotorid.reduction.shift import Shift
from rotorid.reduction.small import SmallRotor, small_rotor
from rotorid.reduction.stability import StabilityCost, compare_stability
from rotorid.reduction.threshold import stability_threshold
from rotorid.reduction.trading import TradeOff, trade_off
from rotorid.reduction.uncertainty import MassUncertainty, mass_uncertainty
from rotorid.reduction.vibration import mac, natural_frequencies

__all__ = [
    "Choices",
    "InputErrors",
    "MassUncertainty",
    "Matching",
    "Method",
    "Methods",
    "Placement",
    "Reduction",
    "ResponseCost",
    "Separated",
    "Shift",
    "SmallRotor",
    "StabilityCost",
    "TradeOff",
    "book_nodes",
    "compare_methods",
    "compare_response",
    "compare_stability",
    "design",
    "equivalent_masses",
    "guyan",
    "irs",
    "mac",
    "mass_sensitivity",
    "mass_uncertainty",
    "match",
    "matching_masses",
    "natural_frequencies",
    "rank_nodes",
    "reduce",
    "reduce_measured",
    "separate",
    "separated_compliance",
    "serep",
    "small_rotor",
    "stability_threshold",
    "trade_off",
]
