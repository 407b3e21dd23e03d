"""`rotorid fit`: parameters of ordinary differential equations from time records."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.cli.common import (
    JsonOption,
    OutputOption,
    PlotOption,
    emit,
)
from rotorid.cli.output import check_targets
from rotorid.cli.progress import busy
from rotorid.cli.verbose import note

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rotorid.timedomain import OdeModel, Record

METHODS = ("levenberg-marquardt", "gauss-newton", "quasilinearization", "multiple-shooting")
INTEGRATORS = ("auto", "expm", "dop853", "lsoda", "heun", "rk4")
LOSSES = ("linear", "soft_l1", "huber", "cauchy")
TRAJECTORIES = ("model", "data")
WITHOUT_CONTROL = ("expm", "heun", "rk4")
"""Integrators that know no tolerance."""

ModelArgument = Annotated[
    Path, typer.Argument(metavar="MODEL.toml", help="Differential equations, outputs, what to estimate.")
]
RecordsArgument = Annotated[
    list[Path],
    typer.Argument(
        metavar="RECORD…",
        help="Time records, .csv or .xlsx: t_s, outputs and inputs; NAME_std beside an output NAME: standard "
        "deviation of each sample.",
    ),
]
MethodOption = Annotated[str, typer.Option(metavar="METHOD", help=f"{', '.join(METHODS)}.")]
IntegratorOption = Annotated[str, typer.Option(metavar="NAME", help=f"{', '.join(INTEGRATORS)}.")]
LossOption = Annotated[
    str, typer.Option(metavar="LOSS", help=f"{', '.join(LOSSES)} (robust against outliers).")
]
StartOption = Annotated[
    str | None,
    typer.Option(
        metavar="LIST",
        help="Starting values instead of the model's: k=2,d=0.1; the others stay.",
        show_default=False,
    ),
]
StartsOption = Annotated[
    int, typer.Option(metavar="N", min=1, help="Begin from several places, to find other minima.")
]
SeedOption = Annotated[
    int | None,
    typer.Option(metavar="N", min=0, help="Other places for --starts; default: 0.", show_default=False),
]
IterationsOption = Annotated[
    int,
    typer.Option(
        metavar="N",
        min=1,
        help="At most; levenberg-marquardt does not count its undamped Gauss–Newton steps.",
    ),
]
TrajectoryOption = Annotated[
    str | None,
    typer.Option(
        metavar="model|data",
        help="Where quasilinearization (default: model) and multiple shooting (default: data) begin: the "
        "model's own solution, or the measured outputs.",
        show_default=False,
    ),
]
PiecesOption = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        min=1,
        help="Of each record in multiple shooting; default: 12, or fewer for a short one.",
        show_default=False,
    ),
]
RtolOption = Annotated[
    float | None,
    typer.Option(
        metavar="X", help="Relative tolerance of the integration; default: 1e-10.", show_default=False
    ),
]
SecondsOption = Annotated[
    float,
    typer.Option(
        metavar="S", min=0.01, help="Limit of the search; what it has found by then has no intervals."
    ),
]
MissingOption = Annotated[
    bool, typer.Option("--allow-missing", help="Blank cells, NaN and absent outputs were not measured.")
]
SigmaOption = Annotated[
    str | None,
    typer.Option(
        metavar="LIST",
        help="Standard deviation of a sample: 0.01, or y1=0.01,y2=0.02; auto: estimate the error of each "
        "output from its residuals, and weigh by it; default: NAME_std of the record, or else all alike.",
        show_default=False,
    ),
]


def fit(
    model: ModelArgument,
    records: RecordsArgument,
    method: MethodOption = METHODS[0],
    integrator: IntegratorOption = INTEGRATORS[0],
    loss: LossOption = LOSSES[0],
    start: StartOption = None,
    starts: StartsOption = 1,
    seed: SeedOption = None,
    max_iterations: IterationsOption = 100,
    max_seconds: SecondsOption = 60.0,
    trajectory: TrajectoryOption = None,
    pieces: PiecesOption = None,
    rtol: RtolOption = None,
    allow_missing: MissingOption = False,
    sigma: SigmaOption = None,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
) -> None:
    """Parameters of differential equations from time records, with intervals, and how they were found.

    Inputs are taken as exact, and as straight lines between their samples; only outputs have errors.

    Example: rotorid fit sample_data/fit/three_masses/model.toml sample_data/fit/three_masses/record.csv
    --sigma auto --plot fit.png
    """
    _known("--method", method, METHODS)
    _known("--integrator", integrator, INTEGRATORS)
    _known("--loss", loss, LOSSES)
    _check_search(method, integrator, trajectory, pieces, rtol)
    if seed is not None and starts == 1:
        raise ValueError("--seed belongs to --starts N: it chooses the other places to begin from")
    check_targets(plot, output)
    _check_once(records)
    from rotorid.tables import read_ode_model
    from rotorid.timedomain.fit import fit as estimate
    from rotorid.timedomain.methods.problem import RTOL
    from rotorid.timedomain.plots import figure_fit

    equations = read_ode_model(model)
    begin = None if start is None else _start(start, equations, len(records))
    weigh = sigma is not None and sigma.strip() == "auto"
    data = _read(records, equations, None if weigh else sigma, allow_missing=allow_missing, weigh=weigh)
    with busy("fit"):
        result = estimate(
            equations,
            data,
            method=method,
            integrator=integrator,
            loss=loss,
            start=begin,
            starts=starts,
            seed=seed or 0,
            max_iterations=max_iterations,
            max_seconds=max_seconds,
            trajectory=trajectory,
            pieces=pieces,
            rtol=RTOL if rtol is None else rtol,
            weigh=weigh,
        )
    note({"degrees_of_freedom": result.estimate.dof})
    note({"singular_values": result.estimate.singular_values.tolist()})

    def draw() -> Figure:
        return figure_fit(result)

    emit(
        result.to_dict(),
        result.summary,
        as_json=json,
        files=[model, *records],
        options={
            "method": method,
            "integrator": integrator,
            "loss": loss,
            "start": start,
            "starts": starts,
            "seed": seed,
            "max_iterations": max_iterations,
            "max_seconds": max_seconds,
            "trajectory": trajectory,
            "pieces": pieces,
            "rtol": rtol,
            "allow_missing": allow_missing,
            "sigma": sigma,
        },
        figure=(plot, draw),
        table=(output, result.to_frame),
    )


def _known(option: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        raise ValueError(
            f"{option} {value!r} is not known{did_you_mean(value, known)}: one of {', '.join(known)}"
        )


def _check_search(
    method: str, integrator: str, trajectory: str | None, pieces: int | None, rtol: float | None
) -> None:
    """Refuse options that the method or the integrator would not look at."""
    if trajectory is not None:
        _known("--trajectory", trajectory, TRAJECTORIES)
        if method not in ("quasilinearization", "multiple-shooting"):
            raise ValueError("--trajectory belongs to --method quasilinearization or multiple-shooting")
    if pieces is not None and method != "multiple-shooting":
        raise ValueError("--pieces belongs to --method multiple-shooting")
    if rtol is None:
        return
    if not 1e-13 <= rtol <= 0.01:
        raise ValueError(f"--rtol takes a number from 1e-13 to 0.01, not {rtol:g}")
    if integrator in WITHOUT_CONTROL:
        raise ValueError(f"--rtol belongs to --integrator dop853, lsoda or auto: {integrator} has none")


def _check_once(records: Sequence[Path]) -> None:
    """Refuse a file that is given twice, perhaps by another name: its samples would count double."""
    for i, path in enumerate(records):
        for other in records[:i]:
            same = path.samefile(other) if path.exists() and other.exists() else path == other
            if same:
                also = "" if path == other else f" (it is {other}, too)"
                raise ValueError(f"{path}: this record is given twice{also}; its samples would count double")


def _read(
    paths: Sequence[Path], model: OdeModel, sigma: str | None, *, allow_missing: bool, weigh: bool
) -> list[Record]:
    """All records, with standard deviations for all of them or for none."""
    from rotorid.tables import read_record
    from rotorid.tables.data.records import STD, read_sigma

    deviations = read_sigma(sigma, model)
    records = [read_record(path, model, allow_missing=allow_missing, sigma=deviations) for path in paths]
    stated = [record for record in records if record.sigma is not None]
    if stated and weigh:
        raise ValueError(f"{stated[0].name}: leave out either the columns NAME{STD} or --sigma auto")
    if 0 < len(stated) < len(records):
        bare = next(record for record in records if record.sigma is None)
        raise ValueError(
            f"{bare.name} has no columns NAME{STD}, but {stated[0].name} has: all records or none"
        )
    return records


def _start(text: str, model: OdeModel, count: int) -> dict[str, float]:
    """Read "k=2,d=0.1" as starting values; x0_2 is that of the second record, where each has its own."""
    from rotorid.timedomain.models.several import models_of

    copy = models_of(model, count)[0]
    limits = {
        name: (float(low), float(high))
        for one in (copy, model)
        for name, (low, high) in zip(one.parameters, one.bounds, strict=True)
    }
    found: dict[str, float] = {}
    for part in text.split(","):
        name, equals, number = (piece.strip() for piece in part.partition("="))
        if not equals:
            raise ValueError(f"--start {text!r}: {part.strip()!r} is no NAME=NUMBER; use k=2,d=0.1")
        if name not in limits:
            hint = did_you_mean(name, limits) or f"; parameters are {listing(limits, 'and')}"
            raise ValueError(f"--start: {name!r} is no parameter of the model{hint}")
        if name in found:
            raise ValueError(f"--start: {name} is given twice")
        found[name] = _within(name, number, *limits[name])
    # what holds for all records first: a value for one of them replaces it
    return dict(sorted(found.items(), key=lambda item: item[0] not in model.parameters))


def _within(name: str, number: str, low: float, high: float) -> float:
    """A starting value inside the bounds of the model file."""
    try:
        value = float(number)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"--start: {name} = {number!r} is no number, such as 2 or 1e-3")
    if not low <= value <= high:
        raise ValueError(f"--start: {name} = {value:g} is outside its bounds {low:g} to {high:g}")
    return value
