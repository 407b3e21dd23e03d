"""Model files for identification from time records: states, outputs, what to estimate."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.files.problems import Problems
from rotorid.files.settings_keys import Key, Kind, Said, take
from rotorid.files.toml_file import Section
from rotorid.files.value_kinds import FLAG, number, table
from rotorid.identify import expressions
from rotorid.identify.expressions import LARGEST, ExpressionError
from rotorid.tables.models.matrix_form import MATRICES, Matrices, has_matrices, matrices_of
from rotorid.tables.models.shared_keys import (
    BOUNDS,
    NAMES,
    NUMBERS,
    PRIOR,
    STATED_ERRORS,
    TEXTS,
    is_missing,
    limits,
    names_in,
    priors,
    unlike,
    unlike_a_name,
)
from rotorid.tables.models.small_model_file import equation_data

if TYPE_CHECKING:
    from rotorid.identify.amplitudes import AmplitudeErrors
    from rotorid.identify.ode import OdeModel


@dataclass(frozen=True)
class TimeForm:
    """What stands in a model file in time, before a model is made of it.

    Attributes
    ----------
    states
        Rate of each state; of matrices only the names count.
    matrices
        M, C, K, where the file has them.
    initial, outputs, force
        Numbers and expressions by name.
    estimate, known
        Numbers by name.
    inputs, per_record
        Names.
    bounds, prior
        Lowest and highest value of parameters; value and standard deviation.
    errors
        Stated errors of amplitudes, for harmonic tests only.
    speed
        At which the matrices hold, rad/s.
    nuisance
        Whether there is an offset and a drift of the outputs, and the frequencies of hum, Hz.
    """

    states: dict[str, str]
    matrices: Matrices | None
    initial: dict[str, float | str]
    outputs: dict[str, str]
    force: dict[str, str]
    estimate: dict[str, float]
    known: dict[str, float]
    inputs: list[str]
    per_record: list[str]
    bounds: dict[str, tuple[float, float]]
    prior: dict[str, tuple[float, float]]
    errors: AmplitudeErrors | None
    speed: float
    nuisance: tuple[bool, bool, list[float]]


def read_ode_model(path: str | Path) -> OdeModel:
    """Read a model file (`ode.toml`).

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
    The speed at which the matrices of a rotor hold may stand in `speed_rad_s`.

    A linear model is read by `read_harmonic_model`, too; `[errors]` of amplitudes are for that alone.

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
        With all problems of the file, each with its key.
    """
    path = Path(path)
    problems = Problems()
    section = Section(str(path), problems.need(equation_data(path, problems)), problems)
    section.limit_names()
    problems.stop()
    form = read_time_form(section, problems)
    problems.stop()
    from rotorid.identify.ode import ode_model, with_nuisance
    from rotorid.identify.second_order import second_order

    names = form.states if form.matrices is None else form.matrices.coordinates
    outputs, factors = with_nuisance(form.outputs or {name: name for name in names}, *form.nuisance)
    given: dict[str, Any] = {
        "initial": form.initial,
        "outputs": outputs if factors else form.outputs or None,
        "estimate": form.estimate | dict.fromkeys(factors, 0.0),
        "known": form.known,
        "inputs": form.inputs,
        "bounds": form.bounds,
        "per_record": [*form.per_record, *factors],
    }
    try:
        if form.matrices is None:
            return replace(ode_model(form.states, **given), prior=form.prior)
        m = form.matrices
        model = second_order(m.M, m.C, m.K, names=m.coordinates, force=form.force, **given)
        return replace(model, prior=form.prior)
    except ValueError as error:
        problems.add(str(path), None, None, None, f"a usable model: {error}")
        problems.stop()
        raise


def read_time_form(section: Section, problems: Problems, *, initial: bool = True) -> TimeForm:
    """All keys of a model file in time; what is wrong with them goes to the problems.

    Parameters
    ----------
    section
        The whole file.
    problems
        Collects the complaints.
    initial
        Whether every state of `[states]` needs its initial value.
    """
    in_matrices = has_matrices(section)
    if in_matrices and "states" in section:
        section.complain("states", "either [states] or M, C and K, not both", value=False)
    said = take(section, TIME_MATRICES if in_matrices else TIME_STATES)
    inputs, own = said["inputs"], said["per_record"]
    known, estimate = _numbers(said["known"]), _numbers(said["estimate"])
    if is_missing(said, "estimate"):
        section.missing(
            "estimate",
            "[estimate] with name = starting value for at least one parameter (an empty [estimate] where the "
            "model is only to be simulated)",
        )
    for item in own:
        if item not in estimate:
            hint = did_you_mean(item, estimate)
            section.complain("per_record", f"names of [estimate]{hint}; {item!r} is none", value=False)
    matrices = matrices_of(said) if in_matrices else None
    states = _texts(said["states"]) if matrices is None else matrices.rates
    outputs = _texts(said["outputs"])
    if not states and not outputs and not len(problems):
        section.missing("states", '[states] with name = "rate of change", such as x = "-a*x", or [outputs]')
    _once(section, {"states": states, "estimate": estimate, "known": known, "inputs": inputs})
    constants = [*estimate, *known]
    everything = ["t", *states, *constants, *inputs]
    _readable(section, "states", states, everything, problems)
    _readable(section, "outputs", outputs, everything, problems)
    begin = _initial(said, states, constants, problems, complete=initial and matrices is None)
    force = {} if matrices is None else _texts(said["force"])
    _readable(section, "force", force, everything, problems)
    for name in force:
        if matrices is not None and name not in matrices.coordinates:
            hint = did_you_mean(name, matrices.coordinates)
            expected = f"a name of coordinates{hint}; they are {listing(matrices.coordinates, 'and')}"
            section.complain(f"force.{name}", expected, value=False)
    return TimeForm(
        states=states,
        matrices=matrices,
        initial=begin,
        outputs=outputs,
        force=force,
        estimate=estimate,
        known=known,
        inputs=inputs,
        per_record=[item for item in own if item in estimate],
        bounds=_bounds(said["bounds"], estimate),
        prior=priors(said["prior"], estimate),
        errors=said["errors"],
        speed=said["speed_rad_s"],
        nuisance=said["nuisance"],
    )


def _numbers(section: Section | None) -> dict[str, float]:
    # zero stands for a value that has been complained about: its name stays known
    return (
        {
            name: section.number(name, 0.0) or 0.0
            for name in names_in(section, lambda name: unlike_a_name(name, "t"))
        }
        if section
        else {}
    )


def _texts(section: Section | None) -> dict[str, str]:
    """Expressions by name; a plain number is one, too."""
    found: dict[str, str] = {}
    if section is None:
        return found
    for name in names_in(section, lambda name: unlike_a_name(name, "t")):
        value = section.take(name)
        if isinstance(value, str) and value.strip():
            found[name] = value
        elif _is_number(value):
            found[name] = repr(float(value))
        else:
            section.complain(name, 'an expression in quotes, such as "-a*x"')
            found[name] = "0"
    return found


def _list(section: Section, key: str) -> list[str] | None:
    value = section.take(key)
    if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
        section.complain(key, f"a list of names{_SUCH_AS[key]}")
        return None
    return value


def _inputs(section: Section, key: str) -> list[str]:
    good = []
    for item in _list(section, key) or ():
        if wrong := unlike_a_name(item, "t"):
            section.complain(key, f"{wrong}; {item!r} is none", value=False)
        else:
            good.append(item)
    return good


def _once(section: Section, groups: dict[str, dict[str, str] | dict[str, float] | list[str]]) -> None:
    """Complain about a name that means two things."""
    seen: dict[str, str] = {}
    for group, names in groups.items():
        for name in names:
            if name in seen:
                place = group if group == "inputs" else f"{group}.{name}"
                section.complain(place, f"another name: {name} stands in {seen[name]} already", value=False)
            seen.setdefault(name, group)


def _readable(
    section: Section, table: str, texts: dict[str, str], allowed: list[str], problems: Problems
) -> None:
    """Complain about expressions that cannot be read or use unknown names."""
    for name, text in texts.items():
        key = f"{table}.{name}"
        try:
            used = expressions.names(expressions.parse(text, where=key))
        except ExpressionError as error:
            problems.add(section.source, None, key, None, f"an expression that can be read: {error}")
            continue
        for other in sorted(used - set(allowed)):
            hint = did_you_mean(other, allowed)
            expected = (
                f"names of the model only, and {other} is none{hint}; they are {listing(allowed, 'and')}"
            )
            problems.add(section.source, None, key, text, expected)


def _initial(
    said: Said, states: dict[str, str], constants: list[str], problems: Problems, *, complete: bool
) -> dict[str, float | str]:
    """Initial values, `complete` if those of all states must be given."""
    found: dict[str, float | str] = {}
    section, inner = said.section, said["initial"]
    given = () if inner is None else inner.keys
    for name in given:
        value = inner.take(name)
        if name not in states:
            inner.complain(name, f"a name of [states]{did_you_mean(name, states)}", value=False)
        elif isinstance(value, str) and value.strip():
            found[name] = value
        elif isinstance(value, (int, float)) and not isinstance(value, bool):
            found[name] = inner.number(name, 0.0) or 0.0
        else:
            inner.complain(name, 'a number, an expression of parameters in quotes, or "record"')
    texts = {name: value for name, value in found.items() if isinstance(value, str)}
    if "record" not in constants:
        texts = {name: text for name, text in texts.items() if text != "record"}
    _readable(section, "initial", texts, constants, problems)
    for name in states if complete else ():
        if name not in given and not any(did_you_mean(key, [name]) for key in given if key not in states):
            section.missing(f"initial.{name}", f"the value of {name} at the first time of the record")
    return found


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= LARGEST


def _hum(section: Section, key: str) -> list[float] | None:
    value = section.take(key)
    hum = value if isinstance(value, list) else [value]
    if not all(_is_number(one) and one > 0 for one in hum) or len(set(hum)) < len(hum):
        section.complain(key, "a frequency above 0, or a list of different ones, such as hum_Hz = 50")
        return None
    return [float(one) for one in hum]


def _bounds(section: Section | None, estimate: dict[str, float]) -> dict[str, tuple[float, float]]:
    found: dict[str, tuple[float, float]] = {}
    if section is None:
        return found
    for name in names_in(section, lambda name: unlike(name, estimate, "[estimate]")):
        own = limits(section, name)
        if own is not None and not own[0] <= estimate[name] <= own[1]:
            section.complain(name, f"limits that hold the starting value {estimate[name]:g}")
        elif own is not None:
            found[name] = own
    return found


_SUCH_AS = {
    "inputs": ', such as inputs = ["u"], at the top of the file',
    "per_record": ' of [estimate], such as per_record = ["x0"]',
}
_FREQUENCY = {"type": "number", "exclusiveMinimum": 0}
NUISANCE = (
    Key(
        "hum_Hz",
        Kind(_hum, {"anyOf": [_FREQUENCY, {"type": "array", "items": _FREQUENCY}]}),
        "a frequency or a list of them (parameters `hum50_cos_NAME`, `hum50_sin_NAME`)",
        default=[],
    ),
    Key("offset", FLAG, "a constant (`offset_NAME`)", default=False),
    Key("drift", FLAG, "a rate per second (`drift_NAME`)", default=False),
)


def _nuisance(section: Section) -> tuple[bool, bool, list[float]]:
    hum, offset, drift = take(section, NUISANCE).values()
    return offset, drift, hum


_FIRST = (
    Key("inputs", Kind(_inputs, NAMES), "names of measured inputs, columns of the record", default=[]),
    Key("known", NUMBERS, "name = number"),
    Key("estimate", NUMBERS, "name = starting value"),
    Key(
        "per_record", Kind(_list, NAMES), "parameters that each of several records has for itself", default=[]
    ),
)
_STATES = (Key("states", TEXTS, 'name = "its rate of change", with the time as `t`'),)
_OUTPUTS = (
    Key("outputs", TEXTS, 'name = "expression" of states; default: the states'),
    Key(
        "initial",
        TEXTS,
        'name = number, or an expression of parameters, or `"record"`: the first sample of the output that '
        "equals this state, with its error (a parameter `NAME_0` of each record)",
    ),
)
FORCE = (Key("force", TEXTS, 'with matrices: coordinate = "expression" of time and inputs'),)
_LAST = (
    BOUNDS,
    PRIOR,
    STATED_ERRORS,
    Key("speed_rad_s", number(0.0), "the speed at which matrices of a rotor hold", default=0.0),
    Key(
        "nuisance",
        table(NUISANCE, _nuisance),
        "what sensors add to every output, estimated anew for every record",
        default=(False, False, []),
    ),
)
TIME_STATES = (*_FIRST, *_STATES, *_OUTPUTS, *_LAST)
TIME_MATRICES = (*_FIRST, *MATRICES, *_OUTPUTS, *FORCE, *_LAST)
"""Keys of both forms of a model in time."""
