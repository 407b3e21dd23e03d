"""Model files for identification from time records: states, outputs, what to estimate."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorid import expressions
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.expressions import LARGEST, ExpressionError, is_name
from rotorid.tables.models.matrix_form import Matrices, read_matrices
from rotorid.tables.models.shared_keys import pair, read_errors
from rotorid.tables.reader.problems import Problems
from rotorid.tables.reader.toml_file import Section, read_toml

if TYPE_CHECKING:
    from rotorid.harmonic.experiments import AmplitudeErrors
    from rotorid.timedomain.models.model import OdeModel

_KEYS = (
    "M",
    "C",
    "K",
    "coordinates",
    "force",
    "inputs",
    "per_record",
    "states",
    "initial",
    "outputs",
    "estimate",
    "known",
    "bounds",
    "errors",
    "nuisance",
    "speed_rad_s",
)
_A_NAME = "names: a letter, then letters, digits and _; not t and no function"


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
    bounds
        Lowest and highest value of parameters.
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
    errors: AmplitudeErrors | None
    speed: float
    nuisance: tuple[bool, bool, list[float]]


def read_ode_model(path: str | Path) -> OdeModel:
    """Read a model file (`ode.toml`).

    Its tables are `[states]` (name = "rate of change", with the time as t), `[initial]` (name = number, or an
    expression of parameters), `[outputs]` (name = "expression"; default: the states), `[estimate]` (name =
    starting value; empty where a model is only to be simulated), optional `[known]` (name = number) and
    `[bounds]` (name = [lowest, highest]), `inputs`, a list of measured inputs (columns of the record), and
    `per_record`, a list of parameters (such as unknown initial values) that every one of several records has
    for itself. `t0` of `[initial]` is the time to which the initial values belong (or "first"); `[nuisance]`
    adds `offset`, `drift` (true) and `hum_Hz` (a frequency or several) of the sensors to every output, with
    factors to be estimated for every record. Without states the outputs are functions of the time.

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
    data = read_toml(path, problems)
    if data is None:
        problems.stop()
        raise AssertionError("no file and no problem")
    section = Section(str(path), data, problems)
    section.limit_names()
    problems.stop()
    form = read_time_form(section, problems)
    model = None
    if not len(problems):
        from rotorid.timedomain.models.model import ode_model
        from rotorid.timedomain.models.nuisance import with_nuisance
        from rotorid.timedomain.models.second_order import second_order

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
                model = ode_model(form.states, **given)
            else:
                m = form.matrices
                model = second_order(m.M, m.C, m.K, names=m.coordinates, force=form.force, **given)
        except ValueError as error:
            problems.add(str(path), None, None, None, f"a usable model: {error}")
    problems.stop()
    if model is None:
        raise AssertionError("no model and no problem")
    return model


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
    inputs = _names(
        section,
        "inputs",
        'a list of names, such as inputs = ["u"], at the top of the file',
        lambda item: "" if _usable(item) else _A_NAME,
    )
    known = _numbers(section, "known")
    estimate = _numbers(section, "estimate")
    others = [key for key in section.keys if key not in _KEYS]
    if "estimate" not in section and not any(did_you_mean(key, ["estimate"]) for key in others):
        section.missing(
            "estimate",
            "[estimate] with name = starting value for at least one parameter (an empty [estimate] where the "
            "model is only to be simulated)",
        )
    own = _names(
        section,
        "per_record",
        'a list of names of [estimate], such as per_record = ["x0"]',
        lambda item: "" if item in estimate else f"names of [estimate]{did_you_mean(item, estimate)}",
    )
    matrices = read_matrices(section)
    states = _texts(section, "states") if matrices is None else matrices.rates
    outputs = _texts(section, "outputs")
    if not states and not outputs and not len(problems):
        section.missing("states", '[states] with name = "rate of change", such as x = "-a*x", or [outputs]')
    _once(section, {"states": states, "estimate": estimate, "known": known, "inputs": inputs})
    constants = [*estimate, *known]
    everything = ["t", *states, *constants, *inputs]
    _readable(section, "states", states, everything, problems)
    _readable(section, "outputs", outputs, everything, problems)
    begin = _initial(section, states, constants, problems, complete=initial and matrices is None)
    force = {} if matrices is None else _texts(section, "force")
    _readable(section, "force", force, everything, problems)
    for name in force:
        if matrices is not None and name not in matrices.coordinates:
            hint = did_you_mean(name, matrices.coordinates)
            expected = f"a name of coordinates{hint}; they are {listing(matrices.coordinates, 'and')}"
            section.complain(f"force.{name}", expected, value=False)
    bounds = _bounds(section, estimate)
    errors = read_errors(section)
    speed = section.number("speed_rad_s", 0.0, low=0.0) or 0.0
    nuisance = _nuisance(section)
    section.finish()
    return TimeForm(
        states=states,
        matrices=matrices,
        initial=begin,
        outputs=outputs,
        force=force,
        estimate=estimate,
        known=known,
        inputs=inputs,
        per_record=own,
        bounds=bounds,
        errors=errors,
        speed=speed,
        nuisance=nuisance,
    )


def _entries(section: Section, table: str, *, named: bool = True) -> Iterator[tuple[Section, str]]:
    """A table with each of its keys; with `named` those that are names, and a complaint of the others."""
    inner = section.section(table)
    if inner is None:
        return
    for key in inner.keys:
        if not named or _usable(key):
            yield inner, key
        else:
            inner.take(key)
            inner.complain(key, _A_NAME, value=False)


def _usable(name: str) -> bool:
    return is_name(name) and name != "t"


def _numbers(section: Section, table: str) -> dict[str, float]:
    # zero stands for a value that has been complained about: its name stays known
    return {name: inner.number(name, 0.0) or 0.0 for inner, name in _entries(section, table)}


def _texts(section: Section, table: str) -> dict[str, str]:
    """Expressions by name; a plain number is one, too."""
    found: dict[str, str] = {}
    for inner, name in _entries(section, table):
        value = inner.take(name)
        if isinstance(value, str) and value.strip():
            found[name] = value
        elif _is_number(value):
            found[name] = repr(float(value))
        else:
            inner.complain(name, 'an expression in quotes, such as "-a*x"')
            found[name] = "0"
    return found


def _names(section: Section, key: str, expected: str, wrong: Callable[[str], str]) -> list[str]:
    """A list of names; `wrong` says what is expected instead of one, or nothing."""
    value = section.take(key)
    if value is None:
        return []
    if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
        section.complain(key, expected)
        return []
    for item in value:
        if words := wrong(item):
            section.complain(key, f"{words}; {item!r} is none", value=False)
    return [item for item in value if not wrong(item)]


def _once(section: Section, groups: dict[str, dict[str, str] | dict[str, float] | list[str]]) -> None:
    """Complain about a name that means two things."""
    seen: dict[str, str] = {}
    for table, names in groups.items():
        for name in names:
            if name in seen:
                place = table if table == "inputs" else f"{table}.{name}"
                section.complain(place, f"another name: {name} stands in {seen[name]} already", value=False)
            seen.setdefault(name, table)


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
    section: Section, states: dict[str, str], constants: list[str], problems: Problems, *, complete: bool
) -> dict[str, float | str]:
    """Initial values, `complete` if those of all states must be given, and the time they belong to."""
    found: dict[str, float | str] = {}
    given: list[str] = []
    for inner, name in _entries(section, "initial", named=False):
        given.append(name)
        value = inner.take(name)
        if name == "t0" and name not in states:
            found[name] = value
            if value != "first" and not _is_number(value):
                inner.complain(name, 'the time of the initial values in s, such as 0, or "first"')
        elif name not in states:
            inner.complain(name, f"a name of [states]{did_you_mean(name, states)}", value=False)
        elif isinstance(value, str) and value.strip():
            found[name] = value
        elif isinstance(value, (int, float)) and not isinstance(value, bool):
            found[name] = inner.number(name, 0.0) or 0.0
        else:
            inner.complain(name, "a number, or an expression of parameters in quotes")
    texts = {name: value for name, value in found.items() if isinstance(value, str) and name in states}
    _readable(section, "initial", texts, constants, problems)
    for name in states if complete else ():
        if name not in given and not any(did_you_mean(key, [name]) for key in given if key not in states):
            section.missing(f"initial.{name}", f"the value of {name} at the first time of the record")
    return found


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= LARGEST


def _nuisance(section: Section) -> tuple[bool, bool, list[float]]:
    inner = section.section("nuisance")
    if inner is None:
        return False, False, []
    value = inner.take("hum_Hz")
    hum = value if isinstance(value, list) else [] if value is None else [value]
    if not all(_is_number(one) and one > 0 for one in hum) or len(set(hum)) < len(hum):
        inner.complain("hum_Hz", "a frequency above 0, or a list of different ones, such as hum_Hz = 50")
        hum = []
    offset, drift = inner.flag("offset"), inner.flag("drift")
    inner.finish()
    return offset, drift, [float(one) for one in hum]


def _bounds(section: Section, estimate: dict[str, float]) -> dict[str, tuple[float, float]]:
    found: dict[str, tuple[float, float]] = {}
    for inner, name in _entries(section, "bounds", named=False):
        limits = pair(inner.take(name))
        if name not in estimate:
            inner.complain(name, f"a name of [estimate]{did_you_mean(name, estimate)}", value=False)
        elif limits is None:
            inner.complain(name, "two numbers, [lowest, highest], such as [0, 2e6] or [0, inf]")
        elif not limits[0] <= estimate[name] <= limits[1]:
            inner.complain(name, f"limits that hold the starting value {estimate[name]:g}")
        else:
            found[name] = limits
    return found
