"""A rotor as a few masses: equivalent masses by regression, and how well the small model behaves."""

from rotorid.reduction.masses import equivalent_masses
from rotorid.reduction.reducing import reduce
from rotorid.reduction.result import Reduction
from rotorid.reduction.sensitivity import mass_sensitivity
from rotorid.reduction.vibration import mac, natural_frequencies

__all__ = [
    "Reduction",
    "equivalent_masses",
    "mac",
    "mass_sensitivity",
    "natural_frequencies",
    "reduce",
]
