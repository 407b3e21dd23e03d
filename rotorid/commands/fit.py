"""`fit`: parameters of ordinary differential equations from time records."""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from rotorid.commands.option_values import check_names, number, pairs
from rotorid.report.options import check_choices, file_of, refuse
from rotorid.report.outcome import EQUATIONS, WITH_REPORT, Outcome, command, outcome_of

if TYPE_CHECKING:
    from rotorid.base.choices import Method
    from rotorid.identify.ode import OdeModel
    from rotorid.identify.records import Record

Values = str | Mapping[str, float]
"""As "k=2,d=0.1", or by name."""


@dataclass(frozen=True)
class FitOptions:
    """Options of `fit`.

    Attributes
    ----------
    method : METHOD
        How the parameters are searched.
    integrator : NAME
        How the equations are solved.
    start : LIST
        Starting values instead of the model's: k=2,d=0.1; the others stay.
    tolerance : X
        ε of gauss-newton and quasilinearization, [F]: end where no parameter moves by more, or where I(β),
        the sum of squares times Δt, is below it; default: where no step matters.
    allow_missing
        Blank cells, NaN and absent outputs were not measured.
    ridge : LAMBDA
        Regularise: add λ times the diagonal of the normal matrix at the start, which pulls towards it; no
        intervals.
    sigma : LIST
        Standard deviation of a sample: 0.01, or y1=0.01,y2=0.02; default: NAME_std of the record, or else all
        alike.
    """

    method: str = "levenberg-marquardt"
    integrator: str = "auto"
    start: Values | None = None
    tolerance: float | None = None
    allow_missing: bool = False
    ridge: float | None = None
    sigma: Values | float | None = None
    panels: ClassVar[Mapping[str, str]] = {
        "Input": "sigma start allow_missing",
        "Method": "method ridge integrator tolerance",
    }
    to = (*WITH_REPORT, *EQUATIONS)


def choices() -> dict[str, tuple[Method[Any], ...]]:
    """What the options of these names choose from."""
    from rotorid.identify.fit_records import METHODS
    from rotorid.identify.simulation import INTEGRATORS

    return {"method": METHODS, "integrator": INTEGRATORS}


@command
def fit(
    model: OdeModel | Path | str,
    records: Sequence[Record | Path | str] | Path | str,
    options: FitOptions | None = None,
) -> Outcome:
    """Coefficients of differential equations from time records, with ±.

    Inputs are taken as exact, and as straight lines between their samples; only outputs have errors.

    Example: rotorid fit sample_data/fit/three_masses/model.toml sample_data/fit/three_masses/record.csv
    --plot fit.png

    Every step of [Q], its regression M θ = Y, and the tables of its iterations:

    Example: rotorid fit sample_data/fit/quasilinearization/model.toml
    sample_data/fit/quasilinearization/record.csv --method quasilinearization --integrator sequential-heun
    --show equations

    Parameters
    ----------
    model : MODEL.toml
        Differential equations, outputs, what to estimate.
    records : RECORD…
        Time records, .csv or .xlsx: t_s, outputs and inputs; NAME_std beside an output NAME: standard
        deviation of each sample.
    options
        Those that differ from the defaults.

    Raises
    ------
    ValueError
        For files, options or records that cannot be.
    """
    from rotorid.base.tables import csv, excel
    from rotorid.files import read_ode_model
    from rotorid.identify.fit_records import fit as estimate
    from rotorid.identify.ode import OdeModel
    from rotorid.identify.plots_records import figure_fit

    options = options or FitOptions()
    check_choices(options, choices())
    if options.method not in ("gauss-newton", "quasilinearization"):
        refuse(options, ("tolerance",), "belongs to --method gauss-newton or quasilinearization")
    if isinstance(records, Path | str) or not isinstance(records, Collection):
        records = [file_of(records, "records")]
    if not records:
        raise ValueError("give a record after the model file")
    files = [os.path.realpath(given) for given in records if isinstance(given, Path | str)]
    if twice := [file for file in files if files.count(file) > 1]:
        raise ValueError(f"{twice[0]}: this record is given twice; its samples would count double")
    equations = model if isinstance(model, OdeModel) else read_ode_model(file_of(model, "a model"))
    begin = None if options.start is None else _start(options.start, equations, len(records))
    deviations = None if options.sigma is None else sigmas(options.sigma, equations.outputs)
    data = _read(records, equations, deviations, allow_missing=options.allow_missing)
    result = estimate(
        equations,
        data,
        method=options.method,
        integrator=options.integrator,
        start=begin,
        tolerance=options.tolerance,
        ridge=options.ridge or 0.0,
    )
    iterations: dict[str, Callable[[Path], bytes]] = {
        ".csv": lambda _: csv(result.tables()[0]),
        ".xlsx": lambda _: excel(*result.tables()),
    }

    return outcome_of(
        result,
        files=iterations if result.integrals else {},
        pictures={"Signals and residuals over time; parameters with 95 %.": lambda: figure_fit(result)},
        title="Parameters from time records",
        solved=result,
    )


def _read(
    given: Sequence[Record | Path | str],
    model: OdeModel,
    sigma: dict[str, float] | None,
    *,
    allow_missing: bool,
) -> list[Record]:
    """All records, with standard deviations for all of them or for none."""
    from rotorid.files import read_record
    from rotorid.files.measurements import STD
    from rotorid.identify.records import Record

    records = [
        replace(one, sigma=one.sigma if sigma is None else sigma)
        if isinstance(one, Record)
        else read_record(file_of(one, "a record"), model, allow_missing=allow_missing, sigma=sigma)
        for one in given
    ]
    stated = [record for record in records if record.sigma is not None]
    if 0 < len(stated) < len(records):
        bare = next(record for record in records if record.sigma is None)
        raise ValueError(
            f"{bare.name} has no columns NAME{STD}, but {stated[0].name} has: all records or none"
        )
    return records


def _start(given: Values, model: OdeModel, count: int) -> dict[str, float]:
    """Starting values inside their bounds; x0_2 is that of the second record, where each has its own."""
    from rotorid.identify.records import models_of

    copy = models_of(model, count)[0]
    limits = {
        name: (float(low), float(high))
        for one in (copy, model)
        for name, (low, high) in zip(one.parameters, one.bounds, strict=True)
    }

    def inside(name: str, text: str) -> float:
        check_names((name,), "--start", limits, "parameter")
        value, (low, high) = number(text), limits[name]
        if math.isnan(value):
            raise ValueError(f"--start: {name} = {text!r} is no number, such as 2 or 1e-3")
        if not low <= value <= high:
            raise ValueError(f"--start: {name} = {value:g} is outside its bounds {low:g} to {high:g}")
        return value

    values = pairs(_texts(given), "--start", inside, "k=2,d=0.1")
    # what holds for all records first: a value for one of them replaces it
    return dict(sorted(values.items(), key=lambda item: item[0] not in model.parameters))


def sigmas(given: Values | float, outputs: Sequence[str]) -> dict[str, float]:
    """Standard deviations of outputs: "0.01" of every one, or "y1=0.01,y2=0.02"."""
    from rotorid.files.cells import NotANumber, check_size

    def positive(name: str, text: str) -> float:
        value = number(text)
        with contextlib.suppress(NotANumber):
            check_size(value)
            if value > 0:
                return value
        raise ValueError(f"--sigma: {name} = {text} is no number above 0; use y1=0.01,y2=0.02")

    if isinstance(given, float | int) or (isinstance(given, str) and not {"=", ","} & set(given)):
        given = ",".join(f"{name}={given}" for name in outputs)
    deviations = pairs(_texts(given), "--sigma", positive, "y1=0.01,y2=0.02")
    check_names(deviations, "--sigma", outputs, "output", needed=outputs)
    return deviations


def _texts(given: Values) -> str | dict[str, str]:
    """Values by name as texts, so that they are read and checked as those of the command line."""
    return {key: str(value) for key, value in given.items()} if isinstance(given, Mapping) else given
