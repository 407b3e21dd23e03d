"""`simulate`: what a model with given parameters would show, as the tables that `identify` and `fit` read."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, cast

from rotorid.base.tables import Column, Table
from rotorid.base.text import capital, counted, listing
from rotorid.commands.fit import Values, sigmas
from rotorid.commands.option_units import Errors, amplitude_errors
from rotorid.commands.option_values import (
    Speeds,
    Times,
    check_names,
    degrees,
    number,
    numbers,
    option_name,
    pairs,
    speeds,
    times,
)
from rotorid.report.options import file_of, refuse
from rotorid.report.outcome import Outcome, command

if TYPE_CHECKING:
    from rotorid.base.arrays import FloatArray
    from rotorid.files import HarmonicFile
    from rotorid.identify import HarmonicModel
    from rotorid.identify.ode import OdeModel

TABLES = (".csv", ".xlsx")
BESIDE = 7
"""Columns of the text beside the first; more stand below."""
_NOISE = {"errors", "sigma"}
_WAYS = {
    "frequencies": {"inputs", "errors"},
    "modes": {"inputs", "round"},
    "times": {"sigma"},
}
"""What can be simulated, and which other options that has."""


@dataclass(frozen=True)
class SimulateOptions:
    """Options of `simulate`.

    Attributes
    ----------
    parameters : -- --with LIST
        The value of every parameter to be estimated: c=1000,alpha=10.
    frequencies : FREQUENCIES
        Amplitudes at FIRST:LAST:STEP or a list, rad/s; or with Hz or rpm at the end.
    inputs : LIST
        At every frequency: amplitudes that excite, F=10 or with a phase lead in degrees Fy=10@-90, otherwise
        0; and what the equations multiply by, Omega=100.
    modes
        All natural frequencies and shapes, without damping.
    round : z:N
        Round z = ω² to so many significant digits first, as lessons 7 and 8 do: z:2; shapes follow from it by
        all equations but the first.
    times : TIMES|RECORD
        A record at FIRST:LAST:STEP or a list, seconds; or at the times of another, with its inputs: u.csv.
    digits : N from 1
        Round real and imaginary parts, natural frequencies or samples to so many significant digits (not
        decimals), after errors.
    errors : PERCENT,DEGREES
        Draw errors of amplitudes of these standard deviations: 2,1.
    sigma : LIST
        Draw errors of samples of this standard deviation: 0.01, or y1=0.01,y2=0.02.
    seed : N from 0
        Of the errors; default: 0.
    """

    parameters: Values | None = None
    frequencies: Speeds | None = None
    inputs: str | Mapping[str, complex] | None = None
    modes: bool = False
    round: str | None = None
    times: Times | Path | None = None
    digits: int | None = None
    errors: Errors | None = None
    sigma: Values | float | None = None
    seed: int | None = None
    panels: ClassVar[Mapping[str, str]] = {"As if read": "digits errors sigma seed"}
    to = ("output", "table", "json")


_Simulated = tuple[dict[str, float], "Mapping[str, FloatArray]", str, tuple[str, ...]]
"""Parameters, columns, what they are, notes."""


@command
def simulate(
    model: HarmonicModel | HarmonicFile | OdeModel | Path | str, options: SimulateOptions | None = None
) -> Outcome:
    """The direct problem: amplitudes, modes or a record, as identify and fit read them.

    Example: rotorid simulate sample_data/identify/task_5_1/model.toml --with c=1000,alpha=10
    --frequencies 10,20,30 --inputs F=10 --digits 2

    A record with errors:

    Example: rotorid simulate sample_data/fit/three_masses/model.toml --with c1=0.14,m1=12,m2=28
    --times 0:50:0.2 --sigma 0.01 --seed 1

    Parameters
    ----------
    model : MODEL.toml
        A model, or its file: one that `identify` reads, or for a record one that `fit` reads.
    options
        What to simulate, and how it is read.

    Raises
    ------
    ValueError
        For files or options that cannot be, and where the model has no answer.
    """
    options = options or SimulateOptions()
    way, *more = [name for name in _WAYS if getattr(options, name)] or [""]
    if more or not way:
        raise ValueError(f"one of {listing(map(option_name, _WAYS))} is needed: what to simulate")
    refuse(options, {"inputs", "round", *_NOISE} - _WAYS[way], f"does not go with {option_name(way)}")
    noisy = any(getattr(options, name) is not None for name in _NOISE)
    if options.digits is not None and options.digits < 1:
        raise ValueError(f"--digits takes a number from 1, not {options.digits}")
    solve = _amplitudes if way in ("frequencies", "modes") else _record
    values, simulated, about, notes = solve(model, options, noisy)
    about += f", with errors (seed {options.seed or 0})" if noisy else ""
    about += "" if options.digits is None else f", {counted(options.digits, 'significant digit')}"
    columns = tuple(Column(name, cells, "{:.6g}".format) for name, cells in simulated.items())
    first, *others = columns
    blocks = [(first, *others[k : k + BESIDE]) for k in range(0, len(others), BESIDE)]
    listed = listing((f"{name} = {value:g}" for name, value in values.items()), "and")
    table = Table("simulated", columns)
    return Outcome(
        result=table,
        sentences=(f"{capital(about)}; {listed}.",),
        tables=tuple(Table("simulated", block) for block in blocks),
        file=table,
        keys={
            "parameters": values,
            "notes": list(notes),
            "signals": table.headings,
            "values": [list(row) for row in table.rows],
        },
        notes=notes,
    )


def _amplitudes(model: object, options: SimulateOptions, noisy: bool) -> _Simulated:
    """A table of amplitudes, or of natural frequencies and shapes."""
    from rotorid.files import HarmonicFile, read_harmonic_model
    from rotorid.files.measurements import measurement_columns
    from rotorid.identify import HarmonicModel
    from rotorid.identify.direct_problem import as_read, forced_vibration, free_vibration

    if isinstance(model, HarmonicModel):
        model = HarmonicFile(model)
    file = model if isinstance(model, HarmonicFile) else read_harmonic_model(file_of(model, "a model"))
    equations = file.model
    values, theta = _values(options.parameters, equations.parameters)
    given = pairs(options.inputs or {}, "--inputs", _amplitude, "F=10,Fy=10@-90")
    excited = [] if options.modes else list(equations.inputs)
    check_names(given, "--inputs", [*excited, *equations.varying], "input", needed=equations.varying)
    errors = amplitude_errors(file.errors, options.errors) if noisy else None
    if options.modes:
        exact, polynomial = free_vibration(equations, theta, given, _digits_of_z(options.round))
    else:
        frequencies = speeds(options.frequencies or "", what="--frequencies")
        exact = forced_vibration(equations, theta, frequencies, given)
    read = [name for name in equations.outputs if name not in file.unmeasured]
    table = as_read(exact, read, errors, options.digits, options.seed or 0)
    where = counted(len(exact), "frequency", "frequencies")
    about = f"natural modes, {where}" if options.modes else f"amplitudes {listing(read, 'and')} at {where}"
    notes: tuple[str, ...] = ()
    if options.modes:
        powers = [f"z**{k}" if k > 1 else "z" * k for k in reversed(range(len(polynomial)))]
        terms = (f"{x:+.6g}*{z}".removesuffix("*") for x, z in zip(polynomial, powers, strict=True))
        written = " ".join(terms).removeprefix("+1*").replace(" -", " - ").replace(" +", " + ")
        notes = (f"frequency polynomial of z = ω²: {written} = 0",)
    return values, measurement_columns(table, [*filter(given.get, excited), *read]), about, notes


def _digits_of_z(given: str | None) -> int | None:
    """Read "z:2"."""
    if given is None:
        return None
    what, _, digits = given.partition(":")
    if what != "z" or not digits.isdecimal() or not 1 <= int(digits) <= 15:
        raise ValueError(f"--round takes z and a number of digits from 1 to 15, z:2, not {given!r}")
    return int(digits)


def _record(model: object, options: SimulateOptions, noisy: bool) -> _Simulated:
    """A time record."""
    import numpy as np

    from rotorid.files import read_ode_model, read_record
    from rotorid.files.measurements import record_columns
    from rotorid.identify.ode import OdeModel
    from rotorid.identify.records import Record
    from rotorid.identify.simulation import simulated_record

    equations = model if isinstance(model, OdeModel) else read_ode_model(file_of(model, "a model"))
    values, theta = _values(options.parameters, equations.parameters)
    if isinstance(options.times, Path | str) and Path(options.times).suffix.lower() in TABLES:
        plan = read_record(Path(options.times), equations, measured=False)
    elif equations.inputs:
        raise ValueError(f"the model has the input {equations.inputs[0]}: give a record of it, --times FILE")
    else:
        plan = Record(np.array(times(cast("Times", options.times))), name="--times")
    sigma = sigmas(options.sigma, equations.outputs) if noisy and options.sigma is not None else None
    record = simulated_record(equations, theta, plan, sigma, options.digits, options.seed or 0)
    begun = f"the initial values hold at t = {plan.t[0]:g} s, where the record begins"
    about = f"record of {listing(equations.outputs, 'and')} at {counted(len(plan), 'time')}"
    late = equations.states and plan.t[0] != 0
    return values, record_columns(record), about, (begun,) if late else ()


def _values(given: Values | None, names: Sequence[str]) -> tuple[dict[str, float], FloatArray]:
    """Every parameter, by name and in the order of the model."""
    import numpy as np

    numbers_by_name = numbers(given or {}, "--with", "c=1000,alpha=10")
    check_names(numbers_by_name, "--with", names, "parameter", needed=names)
    values = {name: float(numbers_by_name[name]) for name in names}
    return values, np.array(list(values.values()))


def _amplitude(name: str, shown: str) -> complex:
    """Read "10" or "10@-90"."""
    from rotorid.base.arrays import polar

    size, at, angle = shown.partition("@")
    value = number(size)
    if math.isnan(value):
        raise ValueError(f"--inputs: {name} = {shown!r} is no amplitude, such as 10 or 10@-90")
    return complex(polar(value, math.radians(degrees(angle, "--inputs")) if at else 0.0))
