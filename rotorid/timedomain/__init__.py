"""Identification from time records: models in time, their simulation and sensitivities."""

from __future__ import annotations

from rotorid.timedomain.integration.simulate import Trajectory, simulate
from rotorid.timedomain.models.linear_system import state_space
from rotorid.timedomain.models.ode_model import OdeModel, ode_model
from rotorid.timedomain.models.record import Record
from rotorid.timedomain.models.second_order import second_order
from rotorid.timedomain.models.simulation_errors import SimulationError

__all__ = [
    "OdeModel",
    "Record",
    "SimulationError",
    "Trajectory",
    "ode_model",
    "second_order",
    "simulate",
    "state_space",
]
