"""`unbalance`: where the unbalance is, from a single run and a rotor model."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rotorid.commands.choice_of_coefficients import computed
from rotorid.commands.option_values import Nodes, nodes
from rotorid.report.options import job_source
from rotorid.report.outcome import WITHOUT_FILE, Outcome, command, outcome_of, provenance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from balancing import Unbalance
    from fem import Rotor
    from rotorid.files import Job


@dataclass(frozen=True)
class UnbalanceOptions:
    """Options of `unbalance`.

    Attributes
    ----------
    stations : LIST
        Nodes or stations where unbalance may be: 6,9,12.
    """

    stations: Nodes
    to = WITHOUT_FILE


def unbalance_figure(unbalance: Unbalance, rotor: Rotor) -> Figure:
    """The vectors of all stations with their regions, and below them the rotor with the stations.

    Parameters
    ----------
    unbalance
        At stations that are named as nodes or stations of the rotor.
    rotor
        The rotor.
    """
    from balancing.plots import draw_unbalance
    from fem import draw_rotor
    from rotorid.base.plot_style import DARK, legend_below, new_figure, note

    tall = 1.0 + min(7.0 / len(unbalance.stations), 3.0) + 1.4 * (len(unbalance.stations) > 8)
    figure = new_figure(tall + 3.0)
    above, below = figure.subplots(2, height_ratios=(tall, 2.6))
    draw_unbalance(unbalance, above)
    draw_rotor(rotor, below)
    if legend := below.get_legend():
        legend.remove()
        legend_below(figure, (below,), 3)
    for k, name in enumerate(unbalance.stations):
        at, top = rotor.positions[rotor.node(name) - 1], below.get_ylim()[1]
        below.axvline(at, color=DARK, linewidth=0.9, linestyle=(0, (3, 2)))
        note(below, name, (at, top), (2.0, -10.0 - 10.0 * (k % 2)))
    return figure


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

    read = job_source(job)
    rotor = read.rotor
    if read.trials.special:
        raise ValueError(read.trials.special)
    if rotor is None:
        raise ValueError('this needs a rotor model: rotor = "rotor.toml" in the job file')
    asked = nodes(options.stations, "--stations")
    places = {str(node): rotor.node(node) for node in asked}
    if len(set(places.values())) < len(asked):
        raise ValueError(f"--stations {options.stations!r}: every station may stand only once")
    result = unbalance_of_run(computed(read, 0.0, places), read.trials)
    return outcome_of(
        result,
        provenance(read.files, options),
        pictures={"Unbalance along the rotor.": lambda: unbalance_figure(result, rotor)},
        title="Unbalance",
    )
