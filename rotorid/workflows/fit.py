"""`fit`: parameters of ordinary differential equations from time records."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorid.base.logs import workflows as log
from rotorid.base.suggestions import one_of
from rotorid.base.text import listing
from rotorid.commands.input_checks import check_choices, file_of, refuse
from rotorid.commands.outcome import Parts, command, phase, provenance, text_of
from rotorid.commands.quantities import Times, check_names, number, pairs, times

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from rotorid.base.registry import Method
    from rotorid.regression.d_optimal import Design
    from rotorid.timedomain import OdeModel, Record
    from rotorid.timedomain.result import Fit

WITHOUT_CONTROL = ("expm", "heun", "sequential-heun", "rk4")
"""Integrators that know no tolerance."""
MOST_CANDIDATES = 2000
_NO_RECORD = "give a record after the model file (only --design does without)"
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
    loss : LOSS
        What a residual counts.
    start : LIST
        Starting values instead of the model's: k=2,d=0.1; the others stay.
    starts : N
        Begin from several places, to find other minima.
    seed : N
        Other places to start from; default: 0.
    max_iterations : N
        At most; levenberg-marquardt does not count its undamped Gauss–Newton steps.
    tolerance : X
        Of gauss-newton and quasilinearization: end where a step is below this part of each parameter, or
        changes the sum of squares by less than this part of it, [F]; default: where no step matters.
    max_seconds : S
        Limit of the search; what it has found by then has no intervals. Default: none.
    trajectory : model|data
        Where quasilinearization (default: model) and multiple shooting (default: data) begin: the model's own
        solution, or the measured outputs.
    pieces : N
        Of each record in multiple shooting; default: 12, or fewer for a short one.
    rtol : X
        Relative tolerance of the integration; default: 1e-10.
    allow_missing
        Blank cells, NaN and absent outputs were not measured.
    ridge : LAMBDA
        Regularise: add λ times the diagonal of the normal matrix at the start, which pulls towards it; no
        intervals.
    sigma : LIST
        Standard deviation of a sample: 0.01, or y1=0.01,y2=0.02; auto: estimate the error of each output
        from its residuals, and weigh by it; default: NAME_std of the record, or else all alike.
    design : FIRST:LAST:STEP
        Which of these times to sample, s, such as 0:10:0.5: from the starting values, or with a record from
        what it tells; needs --sigma.
    choose : N
        How many of them; default: as many as the parameters, at least 2.
    """

    method: str = "levenberg-marquardt"
    integrator: str = "auto"
    loss: str = "linear"
    start: Values | None = None
    starts: int = 1
    seed: int | None = None
    max_iterations: int = 100
    tolerance: float | None = None
    max_seconds: float | None = None
    trajectory: str | None = None
    pieces: int | None = None
    rtol: float | None = None
    allow_missing: bool = False
    ridge: float | None = None
    sigma: Values | float | None = None
    design: Times | None = None
    choose: int | None = None


def choices() -> dict[str, tuple[Method[Any], ...]]:
    """What the options of these names choose from."""
    from rotorid.regression.robust import LOSSES
    from rotorid.timedomain.integration.simulate import INTEGRATORS
    from rotorid.timedomain.methods.fit_methods import METHODS

    return {"method": METHODS, "integrator": INTEGRATORS, "loss": LOSSES}


@dataclass(frozen=True, eq=False, kw_only=True)
class RecordFit(Parts):
    """What the fit found, which times to sample, of which one may be missing, and the text of the model."""

    fit: Fit | None
    design: Design | None = None
    model: str = ""

    @property
    def parts(self) -> Mapping[str, Any]:
        """Both of them."""
        return {"": self.fit, "design": self.design}

    def to_frame(self) -> pd.DataFrame:
        """The times, or else one row per parameter."""
        return super().to_frame() if self.design is None else self.design.to_frame()

    def figure(self) -> Figure:
        """Each signal with the model and its residuals, the inputs, the parameters."""
        from rotorid.timedomain.plots import figure_fit

        if self.fit is None:
            raise ValueError(_NO_RECORD)
        return figure_fit(self.fit)

    def sheet(self) -> bytes:
        """To print or to send, one HTML file."""
        from rotorid.report.estimation import fit_report

        if self.fit is None:
            raise ValueError(_NO_RECORD)
        return fit_report(self.to_dict(), self.fit, provenance=self.provenance, model=self.model)


@command
def fit(
    model: OdeModel | Path | str,
    records: Sequence[Record | Path | str] | Path | str = (),
    options: FitOptions | None = None,
) -> RecordFit:
    """Estimate parameters of differential equations from time records, with intervals.

    Parameters
    ----------
    model
        A model, or its file.
    records
        Records, or their files; or one file; only the choice of times does without.
    options
        Those that differ from the defaults.

    Raises
    ------
    ValueError
        For files, options or records that cannot be.
    """
    from rotorid.tables import read_ode_model
    from rotorid.timedomain import OdeModel
    from rotorid.timedomain.fit import fit as estimate
    from rotorid.timedomain.methods.least_squares_problem import RTOL

    options = options or FitOptions()
    _check(options)
    if isinstance(records, Path | str) or not isinstance(records, Collection):
        records = [file_of(records, "records")]
    paths = [Path(given) for given in records if isinstance(given, Path | str)]
    _check_once(paths)
    files = [*([Path(model)] if isinstance(model, Path | str) else []), *paths]
    equations = model if isinstance(model, OdeModel) else read_ode_model(file_of(model, "a model"))
    if not records and options.design is None:
        raise ValueError(_NO_RECORD)
    begin = None if options.start is None else _start(options.start, equations, max(len(records), 1))
    weigh = isinstance(options.sigma, str) and options.sigma.strip() == "auto"
    deviations = None if weigh or options.sigma is None else sigmas(options.sigma, equations.outputs)
    data = _read(records, equations, deviations, allow_missing=options.allow_missing, weigh=weigh)
    if not data:
        alone = ("sigma", "start", "design", "choose")
        refuse(options, {*vars(options)} - {*alone}, "belongs to a record: nothing is fitted without one")
        plan = _plan(equations, options, deviations, begin or {}, None)
        return RecordFit(fit=None, design=plan, provenance=provenance(files, options))
    with phase("fit"):
        found = estimate(
            equations,
            data,
            method=options.method,
            integrator=options.integrator,
            loss=options.loss,
            start=begin,
            starts=options.starts,
            seed=options.seed or 0,
            max_iterations=options.max_iterations,
            tolerance=options.tolerance,
            max_seconds=math.inf if options.max_seconds is None else options.max_seconds,
            trajectory=options.trajectory,
            pieces=options.pieces,
            rtol=RTOL if options.rtol is None else options.rtol,
            weigh=weigh,
            ridge=options.ridge or 0.0,
        )
    log.info("degrees_of_freedom = %s", found.estimate.dof)
    log.info("singular_values = %s", ", ".join(f"{s:.6g}" for s in found.estimate.singular_values))
    plan = _plan(equations, options, deviations or found.errors, begin or {}, found)
    return RecordFit(fit=found, design=plan, model=text_of(model), provenance=provenance(files, options))


def _plan(
    model: OdeModel,
    options: FitOptions,
    sigma: Mapping[str, float] | None,
    begin: Mapping[str, float],
    found: Fit | None,
) -> Design | None:
    """Choose times for a model whose parameters are known roughly, driven as in the record."""
    if options.design is None:
        return None
    from rotorid.regression.d_optimal import WITHOUT_PRIOR
    from rotorid.timedomain.sampling_times import design_times

    candidates = sorted(set(times(options.design, "--design")))
    if len(candidates) > MOST_CANDIDATES:
        raise ValueError(f"--design takes at most {MOST_CANDIDATES} times, not {len(candidates)}")
    if sigma is None:
        raise ValueError("--design needs the errors of the samples: --sigma 0.01, or y1=0.01,y2=0.02")
    if found and (len(found.records) > 1 or not found.described):
        raise ValueError("--design needs one record that the model describes, or none")
    guess = dict(zip(model.parameters, model.start.tolist(), strict=True)) | dict(begin)
    if found:
        values = zip(model.parameters, found.values.tolist(), strict=True)
        guess |= {name: value for name, value in values if math.isfinite(value)}
    if lost := [name for name, value in guess.items() if math.isnan(value)]:
        raise ValueError(f"--design needs a guess of {listing(lost, 'and')}: --start {lost[0]}=1")
    number = options.choose or min(max(2, len(guess)), len(candidates))
    record = found.records[0] if found else None
    theta = [guess[name] for name in model.parameters]
    plan = design_times(model, theta, candidates, number, sigma=sigma, driven_by=record)
    return replace(plan, notes=WITHOUT_PRIOR) if model.prior else plan


def _check(options: FitOptions) -> None:
    """Refuse names that are not known, and options that the method or the integrator would not look at."""
    check_choices(options, choices())
    if options.trajectory is not None:
        one_of(options.trajectory, "--trajectory", ("model", "data"))
        if options.method not in ("quasilinearization", "multiple-shooting"):
            raise ValueError("--trajectory belongs to --method quasilinearization or multiple-shooting")
    if options.method not in ("gauss-newton", "quasilinearization"):
        refuse(options, ("tolerance",), "belongs to --method gauss-newton or quasilinearization")
    if options.method != "multiple-shooting":
        refuse(options, ("pieces",), "belongs to --method multiple-shooting")
    if options.starts == 1:
        refuse(options, ("seed",), "belongs to --starts N: it chooses the other places to begin from")
    if options.design is None:
        refuse(options, ("choose",), "belongs to --design FIRST:LAST:STEP")
    if options.rtol is None:
        return
    if not 1e-13 <= options.rtol <= 0.01:
        raise ValueError(f"--rtol takes a number from 1e-13 to 0.01, not {options.rtol:g}")
    if options.integrator in WITHOUT_CONTROL:
        raise ValueError(
            f"--rtol belongs to --integrator dop853, lsoda or auto: {options.integrator} has none"
        )


def _check_once(records: Sequence[Path]) -> None:
    """Refuse a file that is given twice, perhaps by another name: its samples would count double."""
    for i, path in enumerate(records):
        for other in records[:i]:
            same = path.samefile(other) if path.exists() and other.exists() else path == other
            if same:
                also = "" if path == other else f" (it is {other}, too)"
                raise ValueError(f"{path}: this record is given twice{also}; its samples would count double")


def _read(
    given: Sequence[Record | Path | str],
    model: OdeModel,
    sigma: dict[str, float] | None,
    *,
    allow_missing: bool,
    weigh: bool,
) -> list[Record]:
    """All records, with standard deviations for all of them or for none."""
    from rotorid.tables import read_record
    from rotorid.tables.data.records import STD
    from rotorid.timedomain import Record

    records = [
        replace(one, sigma=one.sigma if sigma is None else sigma)
        if isinstance(one, Record)
        else read_record(file_of(one, "a record"), model, allow_missing=allow_missing, sigma=sigma)
        for one in given
    ]
    stated = [record for record in records if record.sigma is not None]
    if stated and weigh:
        raise ValueError(f"{stated[0].name}: leave out either the columns NAME{STD} or --sigma auto")
    if 0 < len(stated) < len(records):
        bare = next(record for record in records if record.sigma is None)
        raise ValueError(
            f"{bare.name} has no columns NAME{STD}, but {stated[0].name} has: all records or none"
        )
    return records


def _start(given: Values, model: OdeModel, count: int) -> dict[str, float]:
    """Starting values inside their bounds; x0_2 is that of the second record, where each has its own."""
    from rotorid.timedomain.models.several_records import models_of

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

    found = pairs(_texts(given), "--start", inside, "k=2,d=0.1")
    # what holds for all records first: a value for one of them replaces it
    return dict(sorted(found.items(), key=lambda item: item[0] not in model.parameters))


def sigmas(given: Values | float, outputs: Sequence[str]) -> dict[str, float]:
    """Standard deviations of outputs: "0.01" of every one, or "y1=0.01,y2=0.02"."""
    from rotorid.tables.reader.decimal_numbers import NotANumber, check_size

    def positive(name: str, text: str) -> float:
        check_names((name,), "--sigma", outputs, "output")
        value = number(text)
        with contextlib.suppress(NotANumber):
            check_size(value)
            if value > 0:
                return value
        raise ValueError(f"--sigma: {name} = {text} is no number above 0; use y1=0.01,y2=0.02")

    if isinstance(given, float | int) or (isinstance(given, str) and not {"=", ","} & set(given)):
        given = ",".join(f"{name}={given}" for name in outputs)
    found = pairs(_texts(given), "--sigma", positive, "y1=0.01,y2=0.02")
    if lost := [name for name in outputs if name not in found]:
        raise ValueError(f"--sigma: the standard deviation of {listing(lost, 'and')} is missing")
    return found


def _texts(given: Values) -> str | dict[str, str]:
    """Values by name as texts, so that they are read and checked as those of the command line."""
    return {key: str(value) for key, value in given.items()} if isinstance(given, Mapping) else given
