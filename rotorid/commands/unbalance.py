"""`unbalance`: where the unbalance is, from a single run and a rotor model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from rotorid.commands.coefficients import computed
from rotorid.commands.quantities import Nodes, nodes
from rotorid.report.options import job_source
from rotorid.report.outcome import USUAL, Outcome, command, outcome_of, provenance

if TYPE_CHECKING:
    from rotorid.tables import Job


@dataclass(frozen=True)
class UnbalanceOptions:
    """Options of `unbalance`.

    Attributes
    ----------
    stations : LIST
        Nodes or stations where unbalance may be: 6,9,12.
    """

    stations: Nodes
    to: ClassVar[Sequence[str]] = USUAL


@command
def unbalance(job: Job | Path | str, options: UnbalanceOptions) -> Outcome:
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
    from rotorid.base.plot_style import on_figure
    from rotorid.plots import plot

    read = job_source(job)
    if read.rotor is None:
        raise ValueError('this needs a rotor model: rotor = "rotor.toml" in the job file')
    asked = nodes(options.stations, "--stations")
    places = {str(node): read.rotor.node(node) for node in asked}
    if len(set(places.values())) < len(asked):
        raise ValueError(f"--stations {options.stations!r}: every station may stand only once")
    influence = computed(read, 0.0, places)
    result = unbalance_of_run(influence, read.trials)
    pictures = {"Unbalance along the rotor.": lambda: on_figure(lambda ax: plot(result, ax))}
    return outcome_of(result, provenance(read.files, options), pictures=pictures, title="Unbalance")
