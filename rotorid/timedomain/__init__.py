"""Identification from time records: models in time, their simulation and sensitivities."""

from __future__ import annotations

from rotorid.timedomain.errors import SimulationError
from rotorid.timedomain.model import OdeModel, ode_model
from rotorid.timedomain.record import Record
from rotorid.timedomain.second_order import second_order
from rotorid.timedomain.simulate import Trajectory, simulate

__all__ = ["OdeModel", "Record", "SimulationError", "Trajectory", "ode_model", "second_order", "simulate"]
