"""`rotorid unbalance`: where the unbalance is, from a single run and a rotor model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.cli.common_options import JsonOption, OutputOption, PlotOption, options_of
from rotorid.cli.output import check_targets, chosen, deliver
from rotorid.workflows.unbalance import UnbalanceOptions, choices
from rotorid.workflows.unbalance import unbalance as work

say = options_of(UnbalanceOptions)


def unbalance(
    job: Annotated[
        Path, typer.Argument(metavar="JOB.toml", help="Job with a rotor and the place of every sensor in it.")
    ],
    stations: Annotated[str, say("stations")],
    method: Annotated[str, say("method", "METHOD"), choices] = UnbalanceOptions.method,
    modes: Annotated[int | None, say("modes", "K", least=1)] = None,
    ridge: Annotated[float | None, say("ridge", "STRENGTH", least=0.0)] = None,
    model_error: Annotated[float | None, say("model_error", "PERCENT", least=0.0)] = None,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
) -> None:
    """Unbalance at any stations of a rotor model that explains the readings of one run, without trial runs.

    Example: rotorid unbalance sample_data/model_job/job.toml --stations 6,12,19
    """
    options = chosen(UnbalanceOptions, locals())
    check_targets(plot, output)
    deliver("unbalance", lambda: work(job, options), as_json=json, plot=plot, output=output)
