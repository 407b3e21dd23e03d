"""Machines of a type: what their influence coefficients have in common."""

from rotorid.fleet.machine_type import MachineRecord, MachineType, fit_type
from rotorid.fleet.update import update

__all__ = ["MachineRecord", "MachineType", "fit_type", "update"]
