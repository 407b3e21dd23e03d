"""`rotorid fleet`: the jobs of many machines of a type, added to tables and told."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.cli.choices import Command
from rotorid.commands.app import Destination, command
from rotorid.commands.verbose import verbosely
from rotorid.workflows.fleet.fleet_add import FleetAddOptions, fleet_add
from rotorid.workflows.fleet.fleet_fit import FleetFitOptions, fleet_fit
from rotorid.workflows.fleet.fleet_show import FleetShowOptions, fleet_show

FleetArgument = Annotated[Path, typer.Argument(metavar="FLEET", help="Folder of the tables of the fleet.")]
_NAMES = {"machine_type": ("--type",)}

fleet = typer.Typer(
    no_args_is_help=True, help="Jobs of many machines as tables, and coefficients of their type."
)


def _add(
    fleet: FleetArgument,
    trees: Annotated[
        list[Path],
        typer.Argument(metavar="TREE…", help="Folders with jobs (.toml, .xlsx) at any depth, or jobs."),
    ],
    options: FleetAddOptions,
    to: Destination,
) -> None:
    """Add the jobs of folder trees to the tables; what is known already stays as it is.

    Example: rotorid fleet add fans sample_data/fleet
    """
    to.deliver("reading jobs", lambda: fleet_add(fleet, trees, options))


def _show(fleet: FleetArgument, options: FleetShowOptions, to: Destination) -> None:
    """Machines, jobs and outcomes of each type.

    Example: rotorid fleet show fans
    """
    to.deliver("fleet", lambda: fleet_show(fleet, options))


def _fit(fleet: FleetArgument, options: FleetFitOptions, to: Destination) -> None:
    """Coefficients of a type: mean, differences between machines, odd machines.

    Example: rotorid fleet fit fans --type fan-132

    With `balance --type FLEET:TYPE` a machine of the type is balanced from its baseline alone.
    """
    to.deliver("coefficients", lambda: fleet_fit(fleet, options))


for _name, _function in {
    "add": command(FleetAddOptions, names=_NAMES, least={"workers": 1}, to=("table", "json"))(_add),
    "show": command(FleetShowOptions, names=_NAMES, to=("output", "table", "json"))(_show),
    "fit": command(FleetFitOptions, names=_NAMES)(_fit),
}.items():
    fleet.command(_name, cls=Command)(verbosely(_function))
