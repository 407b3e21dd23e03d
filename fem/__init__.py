"""The direct problem: a rotor in, critical speeds, mode shapes, amplitudes and compliance out.

Everything is in SI units, nodes are numbered from 1, a positive phase is a lead.

>>> import fem
>>> supports = [fem.Support(1, 1e8), fem.Support(11, 1e8)]
>>> shaft = fem.Rotor(length=[0.1] * 10, outer_diameter=0.05, supports=supports)
>>> fem.critical_speeds(shaft, n=1).frequencies.round(2)
array([632.11])
"""

from fem.api684_peaks import (
    Peak,
    Peaks,
    api617_limit,
    api_unbalance,
    critical_peaks,
    open_question,
    peak_columns,
    required_margin,
)
from fem.api684_separation import Separation, unsearched
from fem.campbell import Campbell, campbell
from fem.critical import critical_speeds
from fem.matrices.equations_of_motion import Motion, equations_of_motion
from fem.mesh import MeshCheck, mesh_check, refined
from fem.model.calibration import Calibration
from fem.model.node_forces import (
    CubicSpring,
    InternalDamping,
    JournalBearing,
    MuszynskaSeal,
    NodeForce,
    SqueezeFilm,
    Stop,
)
from fem.model.rotor import STEEL_DENSITY, STEEL_MODULUS, STEEL_POISSON, Disc, Model, Pedestal, Rotor, Support
from fem.model.sensors import Sensor
from fem.modes_result import Modes
from fem.orbits import Orbits, orbits, probe, whirl_direction
from fem.peak_refinement import resolve_peaks
from fem.plots import draw_rotor
from fem.response import influence, response_peaks, unbalance_response
from fem.response_result import BearingForces, InfluenceCoefficients, Response
from fem.speed_map import Intersection, SpeedMap, speed_map
from fem.stability import Stability, stability_threshold
from fem.state_space import StateSpace, state_space
from fem.static import StaticDeflection, compliance, static_deflection
from fem.whirl import WhirlModes, whirl_modes
from fem.windows import Window

__all__ = [
    "STEEL_DENSITY",
    "STEEL_MODULUS",
    "STEEL_POISSON",
    "BearingForces",
    "Calibration",
    "Campbell",
    "CubicSpring",
    "Disc",
    "InfluenceCoefficients",
    "InternalDamping",
    "Intersection",
    "JournalBearing",
    "MeshCheck",
    "Model",
    "Modes",
    "Motion",
    "MuszynskaSeal",
    "NodeForce",
    "Orbits",
    "Peak",
    "Peaks",
    "Pedestal",
    "Response",
    "Rotor",
    "Sensor",
    "Separation",
    "SpeedMap",
    "SqueezeFilm",
    "Stability",
    "StateSpace",
    "StaticDeflection",
    "Stop",
    "Support",
    "WhirlModes",
    "Window",
    "api617_limit",
    "api_unbalance",
    "campbell",
    "compliance",
    "critical_peaks",
    "critical_speeds",
    "draw_rotor",
    "equations_of_motion",
    "influence",
    "mesh_check",
    "open_question",
    "orbits",
    "peak_columns",
    "probe",
    "refined",
    "required_margin",
    "resolve_peaks",
    "response_peaks",
    "speed_map",
    "stability_threshold",
    "state_space",
    "static_deflection",
    "unbalance_response",
    "unsearched",
    "whirl_direction",
    "whirl_modes",
]
