"""Model files of `identify`, `fit` and `simulate`: equations, matrices or states, in one description.

Matrices serve both worlds. In time they are M y'' + C y' + K y = f; of amplitudes, with p = d/dt, the rows
of (M p² + C p + K) Y = F. An output that is a number times a displacement y or its rate, z = s y or s p y,
takes that amplitude's place, y = z / s or z / (s p); any other one adds an equation.
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import AfterValidator, BeforeValidator, PlainValidator

from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.base.versions import SCHEMA_VERSION
from rotorid.files.decimal_numbers import LARGEST
from rotorid.files.problems import Problems, TableWarning
from rotorid.files.settings import NotNegative, Number, Positive, Settings, key, listed, read_settings
from rotorid.files.toml_file import MOST_NAMES, read_toml
from rotorid.identify import expressions
from rotorid.identify.expressions import is_name

if TYPE_CHECKING:
    from fem import Motion
    from rotorid.identify.amplitudes import AmplitudeErrors
    from rotorid.identify.ode import OdeModel
    from rotorid.identify.operator_model import HarmonicModel

Pairs = dict[str, tuple[float, float]]
FORCE = "f_"
"""Before the name of a coordinate: the amplitude of the force on it, where the file names no forces."""
_EXAMPLE = '"(m*p**2 + b*p + c)*X = F"'
_ESTIMATE = (
    'names to estimate, estimate = ["c", "b"], or [estimate] with name = starting value (empty where a model in '
    "time is only to be simulated)"
)
_FORMS = {"equations": ("start", "varying"), "matrices": ("coordinates", "force", "speed")}
_FORMS |= {"states": (), "time": ("initial", "outputs", "per_record", "nuisance")}
# numbers first: the e of 1e5 is no name
_TOKEN = re.compile(
    r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|[A-Za-z\u0370-\u03ff][A-Za-z0-9_\u0370-\u03ff]*"
)


def _name(value: str) -> str:
    if not is_name(value):
        raise ValueError(f"names: a letter, then letters, digits and _; no function; {value!r} is none")
    return value


def _finite(value: object) -> bool:
    return type(value) in (int, float) and abs(value) <= LARGEST  # type: ignore[arg-type]


def _expression(value: object) -> object:
    if _finite(value) or (isinstance(value, str) and value.strip()):
        return value
    raise ValueError('a number, or an expression in quotes, such as "-a*x"')


def _square(value: object) -> object:
    rows = value if isinstance(value, list) else []
    if not rows or not all(isinstance(row, list) and len(row) == len(rows) for row in rows):
        raise ValueError('a square matrix of numbers and expressions in quotes, such as [["a", 0], [0, 2.5]]')
    return [[_expression(one) for one in row] for row in rows]


def _limits(value: object) -> object:
    if isinstance(value, list) and len(value) == 2 and all(type(one) in (int, float) for one in value):
        low, high = (one if _finite(one) else math.copysign(math.inf, one) for one in value)
        if low < high:
            return float(low), float(high)
    raise ValueError("two numbers, [lowest, highest], such as [0, 2e6] or [0, inf]")


def _estimates(value: object) -> object:
    """Names without starting values are NaN."""
    if not isinstance(value, list):
        return value
    if not value or not all(isinstance(one, str) for one in value) or len({*value}) < len(value):
        raise ValueError("a list of different names")
    return dict.fromkeys(value)


Name = Annotated[str, AfterValidator(_name)]
Text = Annotated[float | str, PlainValidator(_expression, json_schema_input_type=float | str)]
Texts = dict[Name, Text]
Matrix = Annotated[
    list[list[float | str]], PlainValidator(_square, json_schema_input_type=list[list[float | str]])
]
Limits = Annotated[tuple[float, float], PlainValidator(_limits, json_schema_input_type=list[float])]
Estimates = Annotated[
    dict[Name, Number | None],
    BeforeValidator(_estimates, json_schema_input_type=list[str] | dict[str, float]),
]


class AmplitudeErrorKeys(Settings):
    """One standard deviation of a reading of an amplitude."""

    amplitude_percent: NotNegative = key("of an amplitude, percent of it", default=0.0, le=1000)
    phase_deg: NotNegative = key("of a phase, degrees", default=0.0, le=360)
    floor: NotNegative = key("at amplitude 0, in the unit of the model", default=0.0)

    def wrong(self) -> Iterator[tuple[str, str]]:
        """No error at all."""
        if not (self.amplitude_percent or self.phase_deg or self.floor):
            yield "", "at least one of amplitude_percent, phase_deg and floor above 0, or no [errors] at all"


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
    coordinates: list[Name] = key(
        "names of y; `y1`, `y2`, … by default. The velocity of `y1` is `v_y1`", default=[]
    )
    states: Texts = key('name = "its rate of change", with the time as `t`', default={})
    estimate: Estimates = key("names, or name = starting value", expected=_ESTIMATE)
    known: dict[Name, Number] = key("names with their numbers", default={})
    inputs: list[Name] | None = key(
        "amplitudes that excite, or measured inputs in time (columns of the record); of equations by default "
        "those that stand only on right sides",
        default=None,
    )
    varying: list[Name] = key(
        "known quantities that change from row to row, such as a speed; without it names that stand only as "
        "factors of an amplitude",
        default=[],
    )
    outputs: Texts = key('name = "expression" of states; default: the states', default={})
    initial: Texts = key(
        'name = number, or an expression of parameters, or `"record"`: the first sample of the output that '
        "equals this state, with its error (a parameter `NAME_0` of each record); `t0`: the time they belong "
        'to, in s, perhaps before the record, or `"first"`: the first time of each record (the default, '
        "which asks where a record does not begin at 0)",
        default={},
    )
    force: Texts = key('with matrices: coordinate = "expression" of time and inputs', default={})
    per_record: list[Name] = key("parameters that each of several records has for itself", default=[])
    bounds: dict[str, Limits] = key("name = [lowest, highest], `inf` for none", default={})
    prior: dict[str, tuple[Number, Positive]] = key(
        "name = [value, standard deviation]: what is known of it beside the data",
        default={},
        expected="[value, standard deviation above 0], such as [1.0, 0.5]",
    )
    start: dict[str, Number] = key("guesses, for output error, and models with several solutions", default={})
    errors: AmplitudeErrorKeys | None = key("of readings of amplitudes, one standard deviation", default=None)
    speed: NotNegative = key("the speed at which matrices of a rotor hold", "speed_rad_s", 0.0)
    nuisance: Nuisance = key(
        "what sensors add to every output, estimated anew for every record", default=Nuisance()
    )

    def wrong(self) -> Iterator[tuple[str, str]]:
        """Two forms in one, keys of another form."""
        matrices = any(self.has(name) for name in "MCK")
        forms = [name for name in ("equations", "states") if self.has(name)] + ["matrices"] * matrices
        if len(forms) > 1:
            yield forms[0], "one of equations, M, C and K, and [states]"
        if matrices and len({len(self.M), len(self.K), len(self.C or self.K), len(self.names)}) > 1:
            yield "M", "matrices M and K, and C if it is there, of one size, with a name for each row"
        form = (forms or ["states"])[0]
        for name in _FORMS["time"] if form == "equations" else _FORMS["equations"]:
            if self.has(name):
                yield name, "nothing in a model of this form"
        for name in _FORMS["matrices"] if form == "states" else ():
            if self.has(name):
                yield name, "nothing without the matrices M and K"

    @property
    def names(self) -> list[str]:
        """Of the displacements of matrices."""
        return self.coordinates or [f"y{i + 1}" for i in range(len(self.M))]

    @property
    def damping(self) -> list[list[float | str]]:
        """C, zero where it is absent."""
        return self.C or np.zeros((len(self.M),) * 2).tolist()


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
    path
        Where it was read.
    unmeasured
        Outputs that a model in time does not show.
    prior
        Value and standard deviation of parameters that are known beside the data.
    """

    model: HarmonicModel
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    start: Mapping[str, float] = field(default_factory=dict)
    errors: AmplitudeErrors | None = None
    path: Path | None = None
    unmeasured: tuple[str, ...] = ()
    prior: Mapping[str, tuple[float, float]] = field(default_factory=dict)


def read_harmonic_model(path: str | Path) -> HarmonicFile:
    """Read a model of amplitudes (`harmonic.toml`).

    Its keys are `equations` (texts with p = d/dt), `estimate` (names), `known` (name = number), optional
    `inputs` (names of the exciting amplitudes), `varying` (names of known quantities that change from row to
    row of the measurements, where that does not follow from the equations), `[bounds]` (name = [lowest,
    highest]), `[start]` (name = guess), `[prior]` (name = [value, standard deviation]) and `[errors]`
    (`amplitude_percent`, `phase_deg`, `floor`: one standard deviation of a reading).

    Instead of equations there may be matrices `M`, `C`, `K` as `read_ode_model` reads them and `rotorid reduce
    --model` writes them: (M p² + C p + K) X = F with amplitudes named like the coordinates. Its `[estimate]`
    has starting values, which are the `start` here. `inputs` are the exciting amplitudes, and `[force]` says
    where they act; without both there is a force amplitude f_x7 on every coordinate x7, and those not in the
    table are 0. An output that is a number times a displacement or velocity is measured in place of it;
    other linear outputs add equations. `[initial]` plays no part, `speed_rad_s` neither; a parameter of
    initial values alone is left out, with a warning. Explicit time, constant loads and nonlinear terms are
    refused. An amplitude that `[outputs]` do not show, or that is not measured, is predicted.

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
    path, problems = Path(path), Problems()
    file = _read(path, problems)
    from rotorid.identify.amplitudes import AmplitudeErrors
    from rotorid.identify.equations import harmonic_model

    estimate, unmeasured, inputs = [*file.estimate], (), file.inputs
    equations: Sequence[str] = file.equations
    start = file.start | {name: value for name, value in file.estimate.items() if value is not None}
    try:
        if not equations:
            equations, inputs, unmeasured = _of_amplitudes(file)
            used = {name for text in equations for name in _words(text)}
            at_start = {name for text in file.initial.values() for name in _words(str(text))}
            lost = [name for name in estimate if name not in used and name in at_start]
            estimate = [name for name in estimate if name not in lost]
            inputs = [name for name in inputs or () if name in used]
            if lost:
                words = (
                    f"{listing(lost, 'and')}: of initial values only, which amplitudes do not show: left out"
                )
                warnings.warn(f"{path}: {words}", TableWarning, stacklevel=2)
        model = harmonic_model(
            equations, known=file.known, estimate=estimate, inputs=inputs, varying=file.varying
        )
        if unmeasured is not None and not file.equations and model.has_constant_terms:
            raise ValueError(
                "a load or output without any amplitude stands in it: a constant one has no influence on "
                "amplitudes, leave it out; one that excites must be a measured input"
            )
    except ValueError as error:
        problems.add(
            str(path), None, "equations" if file.equations else None, None, f"a usable model: {error}"
        )
        problems.stop()
        raise
    bounds, start, prior = (
        {k: v for k, v in each.items() if k in estimate} for each in (file.bounds, start, file.prior)
    )
    errors = file.errors and AmplitudeErrors(
        file.errors.amplitude_percent / 100.0, math.radians(file.errors.phase_deg), file.errors.floor
    )
    return HarmonicFile(model, bounds, start, errors, path, tuple({*unmeasured} & {*model.outputs}), prior)


def read_ode_model(path: str | Path) -> OdeModel:
    """Read a model in time (`ode.toml`).

    Its tables are `[states]` (name = "rate of change", with the time as t), `[initial]` (name = number,
    an expression of parameters, or "record": as measured at the first time, with its error), `[outputs]`
    (name = "expression"; default: the states), `[estimate]` (name = starting value; empty where a model
    is only to be simulated), optional `[known]` (name = number), `[bounds]` (name = [lowest, highest]) and
    `[prior]` (name = [value, standard deviation]), `inputs`, a list of measured inputs (columns of the
    record), and `per_record`, a list of parameters (such as unknown initial values) that every one of several
    records has for itself. `t0` of `[initial]` is the time to which the initial values belong (or "first");
    `[nuisance]` adds `offset`, `drift` (true) and `hum_Hz` (a frequency or several) of the sensors to every
    output, with factors to be estimated for every record. Without states the outputs are functions of the
    time.

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
    path, problems = Path(path), Problems()
    file = _read(path, problems)
    if file.equations:
        expected = "[states], or M, C and K: equations are of amplitudes, for `rotorid identify`"
        problems.extend([file.problem("equations", expected, value=False)])
    if lost := [name for name, value in file.estimate.items() if value is None]:
        expected = f"[estimate] with name = starting value, {lost[0]} = 1.0"
        problems.extend([file.problem("estimate", expected, value=False)])
    problems.stop()
    from rotorid.identify.ode import ode_model, with_nuisance
    from rotorid.identify.second_order import second_order

    names, extra = file.names if file.M else file.states, file.nuisance
    outputs = {name: str(text) for name, text in file.outputs.items()}
    shown, factors = with_nuisance(outputs or {x: x for x in names}, extra.offset, extra.drift, extra.hum)
    given: dict[str, Any] = {
        "initial": file.initial,
        "outputs": shown if factors else outputs or None,
        "estimate": file.estimate | dict.fromkeys(factors, 0.0),
        "known": file.known,
        "inputs": file.inputs or (),
        "bounds": file.bounds,
        "per_record": [*file.per_record, *factors],
    }
    try:
        if file.M:
            model = second_order(file.M, file.damping, file.K, names=file.names, force=file.force, **given)
        else:
            model = ode_model({name: str(text) for name, text in file.states.items()}, **given)
    except ValueError as error:
        problems.add(str(path), None, None, None, f"a usable model: {error}")
        problems.stop()
        raise
    return replace(model, prior=file.prior)


def _read(path: Path, problems: Problems) -> ModelFile:
    """What stands in a model file, or of a small model its linear equations; raises its problems."""
    from rotorid.files.small_model import small_equations

    data = problems.need(read_toml(path, problems))
    if {"masses_kg", "shaft_stiffness_N_per_m"} & data.keys():
        data = problems.need(small_equations(path, problems))
    for name, value in data.items():
        if isinstance(value, (list, dict)) and len(value) > MOST_NAMES:
            expected = f"at most {MOST_NAMES:,} names; these are {len(value):,}"
            problems.add(str(path), None, name, None, expected)
    problems.stop()
    file = read_settings(ModelFile, data, str(path), problems)
    problems.stop()
    file = problems.need(file)
    for table in ("bounds", "prior", "start"):
        for name, value in getattr(file, table).items():
            low, high = file.bounds.get(name, (-math.inf, math.inf))
            guess = file.estimate.get(name)
            if name not in file.estimate:
                problems.add(
                    str(path),
                    None,
                    f"{table}.{name}",
                    None,
                    f"a name of estimate{did_you_mean(name, file.estimate)}",
                )
            elif table == "start" and not low <= value <= high:
                problems.add(
                    str(path),
                    None,
                    f"start.{name}",
                    str(value),
                    f"a guess within its bounds, {low:g} to {high:g}",
                )
            elif table == "bounds" and guess is not None and not low <= guess <= high:
                problems.add(
                    str(path),
                    None,
                    f"bounds.{name}",
                    str([low, high]),
                    f"limits that hold the starting value {guess:g}",
                )
    problems.stop()
    return file


def _of_amplitudes(file: ModelFile) -> tuple[list[str], list[str], list[str]]:
    """Equations, exciting amplitudes, and amplitudes that the outputs do not show.

    Raises
    ------
    ValueError
        What has no meaning for amplitudes; whether the equations are linear is seen by `harmonic_model`.
    """
    if not file.M:
        raise ValueError("equations, or M, C and K: [states] are for models in time (`fit`, `simulate`)")
    constants, y = {*file.estimate, *file.known}, file.names
    matrices = {"M": file.M, "C": file.damping, "K": file.K}
    entries = [str(one) for matrix in matrices.values() for row in matrix for one in row]
    texts = [*map(str, file.force.values()), *map(str, file.outputs.values())]
    if any("t" in _words(text) for text in texts):
        raise ValueError(
            "force and outputs depend on the time t, which amplitudes do not know: make what excites a "
            'measured input, such as inputs = ["u"]'
        )
    if lost := sorted({word for text in entries for word in _words(text)} - constants):
        raise ValueError(f"{lost[0]} in M, C or K is no parameter and not known: amplitudes need constants")
    if own := {word for text in (*entries, *texts) for word in _words(text)} & {*file.per_record}:
        raise ValueError(
            f"per_record: {min(own)} stands in the equations, which have one value of it for all tests"
        )
    if strange := file.force.keys() - {*y}:
        raise ValueError(f"force: {min(strange)} is no name of coordinates; they are {listing(y, 'and')}")
    inputs = list(file.inputs or ())
    force = file.force
    if not inputs and not force:
        inputs = [f"{FORCE}{x}" for x in y]
        force = dict(zip(y, inputs, strict=True))
    states = {x: (x, "") for x in y} | {f"v_{x}": (x, "/p") for x in y}
    put, more = {}, {}
    for output, text in file.outputs.items():
        state, scale = _scaled(str(text), file)
        base, rate = states.get(state, ("", ""))
        if base and base not in put:
            put[base] = output if (output, scale, rate) == (base, "1", "") else f"({output}{rate}/({scale}))"
        else:
            more[output] = str(text)
    unseen = [x for x in y if file.outputs and x not in put]
    taken = [*constants, *inputs, *file.outputs, *([x for x in y if x not in put] if file.outputs else y)]
    if twice := [name for name in taken if taken.count(name) > 1 or name == "p"]:
        raise ValueError(
            f"{twice[0]}: an amplitude needs a name of its own, and p is d/dt; this means two things"
        )
    put = {x: put.get(x, x) for x in y} | {f"v_{x}": f"(p*{put.get(x, x)})" for x in y}
    equations = []
    for i, name in enumerate(y):
        terms = []
        for j, other in enumerate(y):
            parts = [
                f"({matrices[key][i][j]}){power}"
                for key, power in (("M", "*p**2"), ("C", "*p"), ("K", ""))
                if matrices[key][i][j] != 0
            ]
            terms += [f"({' + '.join(parts)})*{other}"] if parts else []
        if not terms:
            raise ValueError(f"the row of {name} in M, C and K is empty: leave this coordinate out")
        equations.append(f"{' + '.join(terms)} = {force.get(name, 0)}")
    equations += [f"{output} = {text}" for output, text in more.items()]
    return [_TOKEN.sub(lambda found: put.get(found[0], found[0]), text) for text in equations], inputs, unseen


def _words(text: str) -> set[str]:
    return {word for word in _TOKEN.findall(text) if word[0].isalpha()}


def _scaled(text: str, file: ModelFile) -> tuple[str, str]:
    """The name and the number of an output that is number · name; "" for any other."""
    import sympy

    known = {sympy.Symbol(name): sympy.Rational(repr(value)) for name, value in file.known.items()}
    expression = sympy.expand(expressions.parse(text).subs(known))
    scale, symbol = expression.as_coeff_Mul()
    if symbol.is_Symbol and scale.is_Rational:
        return symbol.name, f"{scale.p}/{scale.q}" if scale.q != 1 else str(scale.p)
    return "", ""


def equations_of(
    motion: Motion,
    dampers: Mapping[str, float],
    inputs: Sequence[str] = (),
    outputs: Sequence[str] | None = None,
) -> dict[str, Any]:
    """M y'' + C y' + K y = f as a model file has it, with dampers to the ground that are to be estimated.

    Coordinates with neither mass nor damping are eliminated: with them behind the others, K becomes
    K₁₁ − K₁₂ K₂₂⁻¹ K₂₁.

    Parameters
    ----------
    motion
        Matrices and names of the displacements, of one plane or both.
    dampers
        {displacement: starting value of its damper, N·s/m}; the parameter of `x7` is called `d_x7`. Empty:
        nothing is estimated.
    inputs
        Forces that are measured: `f_x7` on the displacement `x7`. Records then need a column of each. Without
        inputs `read_harmonic_model` takes a force on every coordinate.
    outputs
        What is measured: displacements `x7` or velocities `v_x7`. Default: all displacements.

    Raises
    ------
    ValueError
        Matrices that are not finite, coordinates that nothing holds, names that do not exist or stand twice.
    """
    M, C, K = matrices = np.array([motion.M, motion.C, motion.K], dtype=float)
    if not np.isfinite(matrices).all():
        raise ValueError("M, C or K holds numbers that are not finite: such a model cannot be written")
    resting = ~np.any([M, M.T, C, C.T], axis=(0, 1)) & [x not in dampers for x in motion.coordinates]
    on, off = np.flatnonzero(~resting), np.flatnonzero(resting)
    if np.linalg.matrix_rank(K[np.ix_(off, off)]) < off.size:
        raise ValueError(
            "coordinates with neither mass nor damping can move without force: give them stiffness"
        )
    K = K[np.ix_(on, on)] - K[np.ix_(on, off)] @ np.linalg.solve(K[np.ix_(off, off)], K[np.ix_(off, on)])
    names = [motion.coordinates[i] for i in on]
    damping: list[list[Any]] = C[np.ix_(on, on)].tolist()
    for name in dampers:
        i = _one_of(names, name, "damper")
        damping[i][i] = f"{damping[i][i]!r} + d_{name}" if damping[i][i] else f"d_{name}"
    for kind, chosen, allowed in (
        ("input", inputs, [f"{FORCE}{name}" for name in names]),
        ("output", outputs or (), [*names, *(f"v_{name}" for name in names)]),
    ):
        for name in chosen:
            _one_of(allowed, name, kind)
        if len({*chosen}) < len(chosen):
            raise ValueError(f"an {kind} is named twice: {', '.join(chosen)}")
    data = {
        "speed_rad_s": float(motion.speed),
        "inputs": [*inputs],
        "coordinates": names,
        "M": M[np.ix_(on, on)].tolist(),
        "C": damping,
        "K": K.tolist(),
        "force": {name.removeprefix(FORCE): name for name in inputs},
        "outputs": {name: name for name in outputs or ()},
    }
    return {name: part for name, part in data.items() if part} | {
        "estimate": {f"d_{name}": float(value) for name, value in dampers.items()},
        "bounds": {f"d_{name}": [0.0, math.inf] for name in dampers},
    }


def ode_model_bytes(
    motion: Motion,
    dampers: Mapping[str, float],
    *,
    comments: Sequence[str] = (),
    inputs: Sequence[str] = (),
    outputs: Sequence[str] | None = None,
) -> bytes:
    """The file of `equations_of`, with comment lines at the top; all digits of the matrices are kept.

    Raises
    ------
    ValueError
        As `equations_of`.
    """
    import tomli_w

    data = {"schema_version": SCHEMA_VERSION, **equations_of(motion, dampers, inputs, outputs)}
    lines = [f"# {part}" for line in comments for part in line.splitlines() or [""]]
    parts = {name: part for name, part in data.items() if not isinstance(part, dict)}
    for name, part in parts.items():
        if name in "MCK":
            lines += [f"{name} = [", *(f"  {str(row).replace(chr(39), chr(34))}," for row in part), "]"]
        else:
            lines.append(f"{name} = {str(part).replace(chr(39), chr(34))}")
    tables = tomli_w.dumps({name: part for name, part in data.items() if name not in parts})
    return ("\n".join(lines) + f"\n\n{tables}").encode()


def _one_of(names: Sequence[str], name: str, kind: str) -> int:
    if name not in names:
        raise ValueError(f"no {kind} {name!r} in this model: they are named like {names[0]}")
    return names.index(name)
