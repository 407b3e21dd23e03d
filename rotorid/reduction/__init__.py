"""A rotor as a few masses: equivalent masses by regression, and how well the small model behaves."""

from rotorid.reduction.dynamics.instability_threshold import stability_threshold
from rotorid.reduction.dynamics.response_comparison import ResponseCost, compare_response
from rotorid.reduction.dynamics.small_rotor import SmallRotor, small_rotor
from rotorid.reduction.dynamics.stability_comparison import StabilityCost, compare_stability
from rotorid.reduction.equivalent.changed_inputs import Shift
from rotorid.reduction.equivalent.equivalent_masses_formula_50 import design, equivalent_masses
from rotorid.reduction.equivalent.frequency_matching import matching_masses
from rotorid.reduction.equivalent.frequency_shape_trade_off import TradeOff, trade_off
from rotorid.reduction.equivalent.mass_sensitivity import InputErrors
from rotorid.reduction.equivalent.mass_uncertainty import MassUncertainty, mass_uncertainty
from rotorid.reduction.equivalent.small_model_modes import mac, natural_frequencies
from rotorid.reduction.equivalent.support_flexibility_formula_47 import (
    Separated,
    separate,
    separated_compliance,
)
from rotorid.reduction.guyan_irs_serep import compare_methods, reduce_by
from rotorid.reduction.guyan_irs_serep_result import Method, Methods
from rotorid.reduction.placement import book_nodes, rank_nodes
from rotorid.reduction.placement_result import Placement
from rotorid.reduction.reduce_rotor import reduce, reduce_measured
from rotorid.reduction.result import Choices, Reduction

__all__ = [
    "Choices",
    "InputErrors",
    "MassUncertainty",
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
    "mac",
    "mass_uncertainty",
    "matching_masses",
    "natural_frequencies",
    "rank_nodes",
    "reduce",
    "reduce_by",
    "reduce_measured",
    "separate",
    "separated_compliance",
    "small_rotor",
    "stability_threshold",
    "trade_off",
]
