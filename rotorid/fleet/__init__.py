"""Machines of a type: the table of their jobs, and what their influence coefficients have in common."""

from rotorid.base.lazy_names import lazy_names

TYPE_CHECKING = False
if TYPE_CHECKING:
    from rotorid.fleet.fit import FleetFitOptions as FleetFitOptions
    from rotorid.fleet.fit import fleet_fit as fleet_fit
    from rotorid.fleet.machine_type import MachineRecord as MachineRecord
    from rotorid.fleet.machine_type import MachineType as MachineType
    from rotorid.fleet.machine_type import fit_type as fit_type
    from rotorid.fleet.posterior import update as update

_HOME = {
    **dict.fromkeys(("MachineRecord", "MachineType", "fit_type"), "machine_type"),
    **dict.fromkeys(("FleetFitOptions", "fleet_fit"), "fit"),
    "update": "posterior",
}

__all__ = [*_HOME]

__getattr__, __dir__ = lazy_names(__name__, _HOME)
