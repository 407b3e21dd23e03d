"""Names of the old modules until this one is written."""

from fem.orbits import DIRECTION_NAMES, Orbits, orbits, probe, whirl_direction
from fem.response import influence, response_from_rest, response_peaks, unbalance_response
from fem.response_result import BearingForces, InfluenceCoefficients, Response, polar, speed_range
from fem.solvers.receptance import unit_loads

__all__ = [
    "DIRECTION_NAMES",
    "BearingForces",
    "InfluenceCoefficients",
    "Orbits",
    "Response",
    "influence",
    "orbits",
    "polar",
    "probe",
    "response_from_rest",
    "response_peaks",
    "speed_range",
    "unbalance_response",
    "unit_loads",
    "whirl_direction",
]
