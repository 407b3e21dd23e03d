"""Model files of `identify`, `fit` and `simulate`: equations, matrices or states, in one description.

Matrices serve both worlds. In time they are M y'' + C y' + K y = f; of amplitudes, with p = d/dt, the rows
of (M p² + C p + K) Y = F. An output that is a number times a displacement y, z = s y, takes that amplitude's
place, y = z / s; any other one adds an equation.
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, PlainValidator

from rotorid.base.choices import did_you_mean
from rotorid.base.text import listing
from rotorid.files.bearings_and_seals import whole
from rotorid.files.input_problems import Problems, TableWarning
from rotorid.files.settings import (
    MOST_NAMES,
    NotNegative,
    Number,
    Positive,
    Settings,
    key,
    listed,
    optional,
    read_settings,
    read_toml,
)
from rotorid.files.small_model import FORCE, is_small, small_equations
from rotorid.identify import expressions
from rotorid.identify.amplitudes import AmplitudeErrors
from rotorid.identify.equations import harmonic_model
from rotorid.identify.ode import OdeModel, ode_model, with_nuisance
from rotorid.identify.operator_model import HarmonicModel
from rotorid.identify.second_order import second_order

Pairs = dict[str, tuple[float, float]]
_EXAMPLE = '"(m*p**2 + b*p + c)*X = F"'
_ESTIMATE = (
    'names to estimate, estimate = ["c", "b"], or [estimate] with name = starting value (empty where a model '
    "in time is only to be simulated)"
)
_NOT_BESIDE = {
    "states": ("M", "C", "K", "coordinates", "force"),
    "equations": ("states", "M", "C", "K", "coordinates", "force", "initial", "outputs", "per_record"),
}
# numbers first: the e of 1e5 is no name
_TOKEN = re.compile(
    r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|[A-Za-z\u0370-\u03ff][A-Za-z0-9_\u0370-\u03ff]*"
)
_SCALED = re.compile(r"(?:([0-9.]+(?:[eE][-+]?[0-9]+)?) *\* *)?(\w+)")
"""A number times a name, or a name alone."""


def _expression(value: object) -> object:
    if isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= expressions.LARGEST:
        return float(value)
    if isinstance(value, str) and value.strip():
        return value
    raise ValueError('a number, or an expression in quotes, such as "-a*x"')


def _estimates(value: object) -> object:
    """Names without starting values have None."""
    if not isinstance(value, list):
        return value
    if not value or len({*map(str, value)}) < len(value):
        raise ValueError("a list of different names")
    return dict.fromkeys(map(str, value))


Text = Annotated[float | str, PlainValidator(_expression, json_schema_input_type=float | str)]
Texts = dict[str, Text]
Matrix = list[list[Text]]
Limit = Annotated[float, Field(strict=True, allow_inf_nan=True)]
Std = Annotated[Number, Field(ge=1e-30)]
Estimates = Annotated[
    dict[str, Number | None],
    BeforeValidator(_estimates, json_schema_input_type=list[str] | dict[str, float]),
]


class AmplitudeErrorKeys(Settings):
    """One standard deviation of a reading of an amplitude."""

    amplitude_percent: NotNegative = key("of an amplitude, percent of it", default=0.0, le=1000)
    phase_deg: NotNegative = key("of a phase, degrees", default=0.0, le=360)
    floor: NotNegative = key("at amplitude 0, in the unit of the model", default=0.0)


class Nuisance(Settings):
    """What sensors add to every output."""

    hum: listed(Positive) = key(  # type: ignore[valid-type]
        "a frequency or a list of them (parameters `hum50_cos_NAME`, `hum50_sin_NAME`)", "hum_Hz", ()
    )
    offset: bool = key("a constant (`offset_NAME`)", default=False)
    drift: bool = key("a rate per second (`drift_NAME`)", default=False)


class ModelFile(Settings):
    """A model: equations of amplitudes, matrices of second order, or states."""

    equations: list[str] = key("texts with `=` in p = d/dt, of amplitudes", default=[], example=_EXAMPLE)
    M: Matrix = key("matrix of M y'' + C y' + K y = f: numbers and expressions", default=[])
    C: Matrix = key("likewise; it may be absent", default=[])
    K: Matrix = key("likewise", default=[])
    coordinates: list[str] = key(
        "names of y; `y1`, `y2`, … by default. The velocity of `y1` is `v_y1`", default=[]
    )
    states: Texts = key('name = "its rate of change", with the time as `t`', default={})
    estimate: Estimates = key("names, or name = starting value", expected=_ESTIMATE)
    known: dict[str, Number] = key("names with their numbers", default={})
    inputs: list[str] | None = optional(
        "amplitudes that excite, or measured inputs in time (columns of the record); of equations by default "
        "those that stand only on right sides",
    )
    varying: list[str] = key(
        "known quantities that change from row to row, such as a speed; without it names that stand only as "
        "factors of an amplitude",
        default=[],
    )
    outputs: Texts = key('name = "expression" of states; default: the states', default={})
    initial: Texts = key(
        'name = number, or an expression of parameters, or `"record"`: the first sample of the output that '
        "equals this state, with its error (a parameter `NAME_0` of each record)",
        default={},
    )
    force: Texts = key('with matrices: coordinate = "expression" of time and inputs', default={})
    per_record: list[str] = key("parameters that each of several records has for itself", default=[])
    bounds: dict[str, tuple[Limit, Limit]] = key(
        "name = [lowest, highest], `inf` for none", default={}, expected="two numbers: [lowest, highest]"
    )
    prior: dict[str, tuple[Number, Std]] = key(
        "name = [value, standard deviation]: what is known of it beside the data",
        default={},
        expected="two numbers: [value, standard deviation above 0]",
    )
    start: dict[str, Number] = key("guesses, for output error, and models with several solutions", default={})
    errors: AmplitudeErrorKeys | None = optional("of readings of amplitudes, one standard deviation")
    speed: NotNegative = key("the speed at which matrices of a rotor hold", "speed_rad_s", 0.0)
    nuisance: Nuisance | None = optional("what sensors add to every output, estimated anew for every record")

    def wrong(self) -> Iterator[tuple[str, str]]:
        """Two forms in one, matrices of several sizes."""
        for form, others in _NOT_BESIDE.items():
            for other in self.model_fields_set.intersection(others) if self.has(form) else ():
                yield other, f"equations, matrices or states: nothing of this name beside {form}"
        for table in ("bounds", "prior", "start"):
            for name in getattr(self, table).keys() - self.estimate.keys():
                yield table, f"names of estimate; {name} is none{did_you_mean(name, self.estimate)}"
        for name, (low, high) in self.bounds.items():
            value = self.start.get(name, self.estimate.get(name))
            if not low < high or (value is not None and not low <= value <= high):
                yield (
                    "bounds",
                    f"[lowest, highest] of {name}, [0, inf] or so, with its starting value between",
                )
        n = len(self.names)
        if any([*map(len, matrix)] != n * [n] for matrix in (self.M, self.K, self.damping)):
            example = 'M = [["a", 0], [0, 2.5]]'
            yield "M", f"square matrices M, K and perhaps C of one size, with a name for each row: {example}"

    @property
    def names(self) -> list[str]:
        """Of the displacements of matrices."""
        return self.coordinates or [f"y{i + 1}" for i in range(len(self.M))]

    @property
    def damping(self) -> list[list[float | str]]:
        """C, zero where it is absent."""
        return self.C or [[0.0] * len(self.M) for _ in self.M]


@dataclass(frozen=True)
class HarmonicFile:
    """A model of amplitudes, read from a file.

    Attributes
    ----------
    model
        The equations.
    bounds
        Lowest and highest value of parameters, ±inf for none.
    start
        Guessed values of parameters.
    errors
        Stated errors of the amplitudes, or None.
    unmeasured
        Outputs that a model in time does not show.
    prior
        Value and standard deviation of parameters that are known beside the data.
    """

    model: HarmonicModel
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    start: Mapping[str, float] = field(default_factory=dict)
    errors: AmplitudeErrors | None = None
    unmeasured: tuple[str, ...] = ()
    prior: Mapping[str, tuple[float, float]] = field(default_factory=dict)


def read_harmonic_model(path: str | Path) -> HarmonicFile:
    """Read a model of amplitudes (`harmonic.toml`).

    Its keys are `equations` (texts with p = d/dt), `estimate` (names), `known` (name = number), optional
    `inputs` (names of the exciting amplitudes), `varying` (names of known quantities that change from row to
    row of the measurements, where that does not follow from the equations), `[bounds]` (name = [lowest,
    highest]), `[start]` (name = guess), `[prior]` (name = [value, standard deviation]) and `[errors]`
    (`amplitude_percent`, `phase_deg`, `floor`: one standard deviation of a reading).

    Instead of equations there may be matrices `M`, `C`, `K` as `read_ode_model` reads them and `rotorid
    reduce --output` writes them: (M p² + C p + K) X = F with amplitudes named like the coordinates. Its
    `[estimate]` has starting values, which are the `start` here. `inputs` are the exciting amplitudes, and
    `[force]` says where they act; without both there is a force amplitude f_x7 on every coordinate x7, and
    those not in the table are 0. An output that is a number times a displacement is measured in place of it;
    other linear outputs add equations. `[initial]` plays no part, `speed_rad_s` neither; a
    parameter of initial values alone is left out, with a warning. Explicit time, constant loads and
    nonlinear terms are refused. An amplitude that `[outputs]` do not show, or that is not measured, is
    predicted.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    HarmonicFile

    Raises
    ------
    InputError
        With the problems of the file, each with its key.

    Warns
    -----
    TableWarning
        Where a parameter of a model in time has no influence on amplitudes.
    """

    def read(file: ModelFile) -> HarmonicFile:
        equations, inputs = file.equations, file.inputs
        used = {*file.estimate}
        if file.M:
            equations, inputs = _of_amplitudes(file)
            used &= {*_TOKEN.findall(" ".join(equations))}
            if lost := listing(sorted(file.estimate.keys() - used), "and"):
                words = f"{lost}: in no equation of amplitudes, such as initial values: left out"
                warnings.warn(f"{path}: {words}", TableWarning, stacklevel=5)
        tables: list[Any] = [file.estimate, file.bounds, file.start, file.prior]
        estimate, bounds, start, prior = (
            {name: value for name, value in table.items() if name in used} for table in tables
        )
        if not equations:
            raise ValueError("neither equations nor M and K; [states] are for `fit` and `simulate`")
        model = harmonic_model(
            equations, known=file.known, estimate=[*estimate], inputs=inputs, varying=file.varying
        )
        if file.M:
            strange = {*model.signals, *model.varying} - {*file.names, *file.outputs, *model.inputs}
            for name in sorted(strange | (used & {*file.per_record})):
                raise ValueError(
                    f"{name} has no meaning for amplitudes: M, C and K hold parameters and known numbers; "
                    "what changes with the time t must be a measured input"
                )
            if model.has_constant_terms:
                raise ValueError("a load without any amplitude has no influence on amplitudes: leave it out")
        guesses = {name: value for name, value in estimate.items() if value is not None}
        errors = None
        if given := file.errors:
            errors = AmplitudeErrors(
                given.amplitude_percent / 100, math.radians(given.phase_deg), given.floor
            )
        unmeasured = tuple({*model.outputs} - {*file.outputs} if file.outputs else ())
        return HarmonicFile(model, bounds, guesses | start, errors, unmeasured, prior)

    return whole(_read(Path(path)), "model of amplitudes", read)


def read_ode_model(path: str | Path) -> OdeModel:
    """Read a model in time (`ode.toml`).

    Its tables are `[states]` (name = "rate of change", with the time as t), `[initial]` (name = number,
    an expression of parameters, or "record": as measured at the first time, with its error), `[outputs]`
    (name = "expression"; default: the states), `[estimate]` (name = starting value; empty where a model
    is only to be simulated), optional `[known]` (name = number), `[bounds]` (name = [lowest, highest]) and
    `[prior]` (name = [value, standard deviation]), `inputs`, a list of measured inputs (columns of the
    record), and `per_record`, a list of parameters (such as unknown initial values) that every one of several
    records has for itself. `[nuisance]` adds `offset`, `drift` (true) and `hum_Hz` (a frequency or several)
    of the sensors to every output, with factors to be estimated for every record. Without states the outputs
    are functions of the time.

    Instead of `[states]` there may be `M`, `K` and optional `C`, matrices of numbers and expressions of
    parameters of M y'' + C y' + K y = f, with optional `coordinates` (names; y1, y2, … by default; the
    velocity of y1 is v_y1) and `[force]` (y1 = "expression"). Initial values are 0 then where none is given.
    A coordinate without mass, of which row and column of M are 0, is of first order: its row of C holds it.
    The speed at which the matrices of a rotor hold may stand in `speed_rad_s`.

    Matrices are read by `read_harmonic_model`, too; `[errors]` of amplitudes are for that alone.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    OdeModel

    Raises
    ------
    InputError
        With the problems of the file, each with its key.
    """

    def read(file: ModelFile) -> OdeModel:
        if file.equations or file.varying:
            raise ValueError("[states], or M and K; equations are of amplitudes, for `rotorid identify`")
        start, factors = file.estimate | file.start, list[str]()
        for name in (name for name, value in start.items() if value is None):
            raise ValueError(f"no starting value of {name}: [estimate] has name = starting value in time")
        outputs = {name: str(text) for name, text in file.outputs.items()}
        if extra := file.nuisance:
            outputs = outputs or {name: name for name in (file.names if file.M else file.states)}
            outputs, factors = with_nuisance(outputs, extra.offset, extra.drift, extra.hum)
        given: dict[str, Any] = {
            "initial": file.initial,
            "outputs": outputs or None,
            "estimate": start | dict.fromkeys(factors, 0.0),
            "known": file.known,
            "inputs": file.inputs or (),
            "bounds": file.bounds,
            "per_record": [*file.per_record, *factors],
        }
        if not file.M:
            return ode_model({name: str(text) for name, text in file.states.items()}, **given)
        return second_order(file.M, file.damping, file.K, names=file.names, force=file.force, **given)

    file = _read(Path(path))
    return replace(whole(file, "model", read), prior=file.prior)


def _read(path: Path) -> ModelFile:
    """What stands in a model file, or of a small model its linear equations; raises its problems."""
    problems, data = Problems(), read_toml(path)
    if is_small(data):
        data = small_equations(path)
    for name, value in data.items():
        if isinstance(value, (list, dict)) and len(value) > MOST_NAMES:
            expected = f"at most {MOST_NAMES:,} names; these are {len(value):,}"
            problems.add(expected, path, None, name)
    problems.stop()
    return read_settings(ModelFile, data, str(path))


def _of_amplitudes(file: ModelFile) -> tuple[list[str], list[str]]:
    """Matrices as equations of amplitudes, and what excites."""
    y, inputs, force = file.names, file.inputs or [], file.force
    if not inputs and not force:
        inputs = [f"{FORCE}{x}" for x in y]
        force = dict(zip(y, inputs, strict=True))
    powers, equations, put = {"*p**2": file.M, "*p": file.damping, "": file.K}, list[str](), dict[str, str]()
    for i, x in enumerate(y):
        columns = [(matrix[i][j], power, z) for j, z in enumerate(y) for power, matrix in powers.items()]
        terms = [f"({entry}){power}*{z}" for entry, power, z in columns if entry != 0]
        equations.append(f"{' + '.join(terms) or 0} = {force.get(x, 0)}")
    for name, text in file.outputs.items():
        match = _SCALED.fullmatch(str(text))
        if match and match[2] in y and match[2] not in put:
            put[match[2]] = f"({name}/{match[1]})" if match[1] else name
        else:
            equations.append(f"{name} = {text}")
    names = [*file.estimate, *file.known, "p", *inputs, *file.outputs, *(x for x in y if x not in put)]
    if wrong := sorted(force.keys() - {*y}) + [name for name in names if names.count(name) > 1]:
        raise ValueError(
            f"{wrong[0]}: an amplitude needs a name of its own, a force one of {listing(y, 'or')}"
        )
    put |= {f"v_{x}": f"(p*{put.get(x, x)})" for x in y}
    return [_TOKEN.sub(lambda word: put.get(word[0], word[0]), text) for text in equations], inputs
