"""The direct problem: a rotor in, critical speeds, mode shapes, amplitudes and compliance out.

Everything is in SI units, nodes are numbered from 1, a positive phase is a lead.

>>> import fem
>>> supports = [fem.Support(1, 1e8), fem.Support(11, 1e8)]
>>> shaft = fem.Rotor(length=[0.1] * 10, outer_diameter=0.05, supports=supports)
>>> fem.critical_speeds(shaft, n=1).frequencies.round(2)
array([632.11])
"""

from fem.modes import Modes, critical_speeds
from fem.plots import draw_rotor
from fem.response import InfluenceCoefficients, Response, influence, unbalance_response
from fem.rotor import STEEL_DENSITY, STEEL_MODULUS, Disc, Rotor, Support
from fem.static import compliance

__all__ = [
    "STEEL_DENSITY",
    "STEEL_MODULUS",
    "Disc",
    "InfluenceCoefficients",
    "Modes",
    "Response",
    "Rotor",
    "Support",
    "compliance",
    "critical_speeds",
    "draw_rotor",
    "influence",
    "unbalance_response",
]
