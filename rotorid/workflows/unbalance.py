"""`unbalance`: where the unbalance is, from a single run and a rotor model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorid.commands.input_checks import check_choices, job_source, refuse
from rotorid.commands.outcome import command, provenance
from rotorid.commands.quantities import Nodes, nodes
from rotorid.workflows.result_provenance import Found

if TYPE_CHECKING:
    from balancing.unbalance_result import Unbalance
    from rotorid.base.registry import Method
    from rotorid.tables import Job


def choices() -> dict[str, Sequence[Method[Any]]]:
    """What `method` chooses from."""
    from balancing.unbalance import METHODS

    return {"method": METHODS}


@dataclass(frozen=True)
class UnbalanceOptions:
    """Options of `unbalance`; `model_error` in percent.

    Attributes
    ----------
    stations : LIST
        Nodes or stations where unbalance may be: 6,9,12.
    method : METHOD
        How the unbalance follows from the readings.
    modes : K
        Of the rotor, for modal: 1 … K.
    ridge : STRENGTH
        For ridge; default: from the errors.
    model_error : PERCENT
        Standard deviation of the coefficients.
    """

    stations: Nodes
    method: str = "minimum-norm"
    modes: int | None = None
    ridge: float | None = None
    model_error: float | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class UnbalanceAtStations(Found):
    """The unbalance that explains the readings."""

    found: Unbalance


@command
def unbalance(job: Job | Path | str, options: UnbalanceOptions) -> UnbalanceAtStations:
    """Find unbalance at any stations of a rotor model that explains the readings of one run.

    Parameters
    ----------
    job
        A job, or its file, with a rotor and the place of every sensor in it.
    options
        The stations, and how.

    Raises
    ------
    ValueError
        For a job without a rotor, and an option that cannot be.
    """
    from balancing.coefficients.coefficients_from_model import modal_shapes
    from balancing.unbalance import unbalance_of_run
    from rotorid.workflows.coefficients import computed

    check_choices(options, choices())
    method = options.method
    if (options.modes is not None) != (method == "modal"):
        raise ValueError("--method modal and --modes K belong together")
    if method != "ridge":
        refuse(options, ("ridge",), "is an option of --method ridge")
    read = job_source(job)
    if read.rotor is None:
        raise ValueError('this needs a rotor model: rotor = "rotor.toml" in the job file')
    asked = nodes(options.stations, "--stations")
    places = {str(node): read.rotor.node(node) for node in asked}
    if len(set(places.values())) < len(asked):
        raise ValueError(f"--stations {options.stations!r}: every station may stand only once")
    found = unbalance_of_run(
        computed(read, options.model_error or 0.0, places),
        read.trials,
        method=method,
        ridge=options.ridge,
        shapes=None if options.modes is None else modal_shapes(read.rotor, places, options.modes),
    )
    return UnbalanceAtStations(found=found, provenance=provenance(read.files, options))
