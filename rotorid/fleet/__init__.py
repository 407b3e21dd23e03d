"""Machines of a type: what their influence coefficients have in common; their jobs as tables."""

from rotorid.base.lazy_names import lazy_names

TYPE_CHECKING = False
if TYPE_CHECKING:
    from rotorid.fleet.adding import FleetAddOptions as FleetAddOptions
    from rotorid.fleet.adding import fleet_add as fleet_add
    from rotorid.fleet.fitting import FleetFitOptions as FleetFitOptions
    from rotorid.fleet.fitting import fleet_fit as fleet_fit
    from rotorid.fleet.machine_type import MachineRecord as MachineRecord
    from rotorid.fleet.machine_type import MachineType as MachineType
    from rotorid.fleet.machine_type import fit_type as fit_type
    from rotorid.fleet.posterior import update as update
    from rotorid.fleet.showing import FleetShowOptions as FleetShowOptions
    from rotorid.fleet.showing import fleet_show as fleet_show

_HOME = {
    **dict.fromkeys(("MachineRecord", "MachineType", "fit_type"), "machine_type"),
    **dict.fromkeys(("FleetAddOptions", "fleet_add"), "adding"),
    **dict.fromkeys(("FleetFitOptions", "fleet_fit"), "fitting"),
    **dict.fromkeys(("FleetShowOptions", "fleet_show"), "showing"),
    "update": "posterior",
}

__all__ = [*_HOME]

__getattr__, __dir__ = lazy_names(__name__, _HOME)
