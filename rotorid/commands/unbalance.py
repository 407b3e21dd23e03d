"""`unbalance`: where the unbalance is, from a single run and a rotor model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from rotorid.commands.coefficients import computed
from rotorid.commands.quantities import Nodes, nodes
from rotorid.report.options import check_choices, job_source, refuse
from rotorid.report.outcome import USUAL, Found, command, provenance

if TYPE_CHECKING:
    from rotorid.base.registry import Method
    from rotorid.tables import Job


def choices() -> dict[str, Sequence[Method[Any]]]:
    """What `method` chooses from."""
    from balancing import UNBALANCE_METHODS

    return {"method": UNBALANCE_METHODS}


@dataclass(frozen=True)
class UnbalanceOptions:
    """Options of `unbalance`.

    Attributes
    ----------
    stations : LIST
        Nodes or stations where unbalance may be: 6,9,12.
    method : METHOD
        How the unbalance follows from the readings.
    ridge : STRENGTH from 0
        For ridge; default: from the errors.
    """

    stations: Nodes
    method: str = "minimum-norm"
    ridge: float | None = None
    panels: ClassVar[Mapping[str, str]] = {"Method": "method ridge"}
    to: ClassVar[Sequence[str]] = USUAL


@command
def unbalance(job: Job | Path | str, options: UnbalanceOptions) -> Found:
    """Unbalance along a rotor model, from the readings of one run, without trial weights.

    The model counts as exact: ± are those of the readings.

    Example: rotorid unbalance sample_data/model_job/job.toml --stations 6,12,19

    Parameters
    ----------
    job : JOB.toml
        Job with a rotor and the place of every sensor in it.
    options
        The stations, and how.

    Raises
    ------
    ValueError
        For a job without a rotor, and an option that cannot be.
    """
    from balancing import unbalance_of_run

    check_choices(options, choices())
    if options.method != "ridge":
        refuse(options, ("ridge",), "is an option of --method ridge")
    read = job_source(job)
    if read.rotor is None:
        raise ValueError('this needs a rotor model: rotor = "rotor.toml" in the job file')
    asked = nodes(options.stations, "--stations")
    places = {str(node): read.rotor.node(node) for node in asked}
    if len(set(places.values())) < len(asked):
        raise ValueError(f"--stations {options.stations!r}: every station may stand only once")
    influence = computed(read, 0.0, places)
    result = unbalance_of_run(influence, read.trials, method=options.method, ridge=options.ridge)
    return Found(found=result, provenance=provenance(read.files, options))
