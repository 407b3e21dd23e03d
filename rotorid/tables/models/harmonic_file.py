"""Model files for identification from harmonic tests: equations, known numbers, what to estimate."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from rotorid.base.text import listing
from rotorid.files.problems import Problems, TableWarning
from rotorid.files.settings_keys import Key, Kind, take
from rotorid.files.toml_file import Section
from rotorid.identify.expressions import ExpressionError, parse_equation
from rotorid.tables.models.ode_file import read_time_form
from rotorid.tables.models.shared_keys import (
    BOUNDS,
    NAMES,
    NUMBERS,
    PRIOR,
    STATED_ERRORS,
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
    from rotorid.identify.operator_model import HarmonicModel

_IN_TIME = ("M", "C", "K", "states")
"""Keys of models in time; such a file is read by `read_ode_model`, too."""
_EXAMPLE = '"(m*p**2 + b*p + c)*X = F"'


@dataclass(frozen=True)
class HarmonicFile:
    """A model file, read completely.

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
    """Read a model file (`harmonic.toml`).

    Its keys are `equations` (texts with p = d/dt), `estimate` (names), `known` (name = number), optional
    `inputs` (names of the exciting amplitudes), `varying` (names of known quantities that change from row to
    row of the measurements, where that does not follow from the equations), `[bounds]` (name = [lowest,
    highest]), `[start]` (name = guess), `[prior]` (name = [value, standard deviation]) and `[errors]`
    (`amplitude_percent`, `phase_deg`, `floor`: one standard deviation of a reading).

    Instead of equations there may be a linear model in time as `read_ode_model` reads it, such as the one
    that `rotorid reduce --model` writes: `M`, `C`, `K` (then (M p² + C p + K) X = F with amplitudes named
    like the coordinates) or `[states]` (then p x = rate of x). Its `[estimate]` has starting values, which
    are the `start` here. `inputs` are the exciting amplitudes, and `[force]` says where they act; matrices
    without both have a force amplitude f_x7 on every coordinate x7, and those not in the table are 0. An
    output that is a number times a displacement or velocity is measured in place of it; other linear outputs
    add equations. `[initial]` plays no part, `speed_rad_s` neither; a parameter of initial values alone is
    left out, with a warning. Explicit time, constant loads and nonlinear terms are refused. An
    amplitude that `[outputs]` do not show, or that is not measured, is predicted.

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
        With all problems of the file, each with its key.

    Warns
    -----
    TableWarning
        Where a parameter of a model in time has no influence on amplitudes.
    """
    path = Path(path)
    problems = Problems()
    section = Section(str(path), problems.need(equation_data(path, problems)), problems)
    section.limit_names()
    problems.stop()
    if "equations" not in section and any(key in section for key in _IN_TIME):
        return _from_time(section, path, problems)
    said = take(section, HARMONIC)
    if is_missing(said, "equations"):
        section.missing("equations", f"a list of equations, equations = [{_EXAMPLE}]")
    if is_missing(said, "estimate"):
        section.missing("estimate", f"a list of names, {_SUCH_AS['estimate']}")
    estimate = said["estimate"]
    known = _numbers(said["known"], None)
    for name in estimate or ():
        if name in known:
            section.complain("estimate", f"{name} either here or under known, not both")
    table = said["bounds"]
    given = {name: limits(table, name) for name in _own_names(table, estimate)}
    bounds = {name: found for name, found in given.items() if found is not None}
    start = _numbers(said["start"], estimate)
    for name, value in start.items():
        low, high = bounds.get(name, (-math.inf, math.inf))
        if not low <= value <= high:
            section.complain("start", f"{name} within its bounds, {low:g} to {high:g}")
    prior = priors(said["prior"], estimate or ())
    problems.stop()
    from rotorid.identify.equations import harmonic_model

    try:
        model = harmonic_model(
            said["equations"],
            known=known,
            estimate=estimate,
            inputs=said["inputs"],
            varying=said["varying"] or (),
        )
    except ValueError as error:
        section.complain("equations", f"a usable model: {error}", value=False)
        problems.stop()
        raise
    return HarmonicFile(model, bounds, start, said["errors"], path, prior=prior)


def _from_time(section: Section, path: Path, problems: Problems) -> HarmonicFile:
    """The operator equations of a model in time."""
    from rotorid.tables.models.operator_form import operator_form

    form = read_time_form(section, problems, initial=False)
    problems.stop()
    from rotorid.identify.equations import harmonic_model

    try:
        operators = operator_form(form)
        start = dict(operators.estimate)
        model = harmonic_model(
            operators.equations, known=form.known, estimate=list(start), inputs=operators.inputs
        )
        if model.has_constant_terms:
            raise ValueError(
                "a load or output without any amplitude stands in it: a constant one has no influence on "
                "amplitudes, leave it out; one that excites must be a measured input"
            )
    except ValueError as error:
        problems.add(str(path), None, None, None, f"a linear model of amplitudes: {error}")
        problems.stop()
        raise
    if operators.left_out:
        lost = listing(operators.left_out, "and")
        stand = "stands" if len(operators.left_out) == 1 else "stand"
        message = f"{path}: {lost} {stand} in initial values only, which amplitudes do not show: left out"
        warnings.warn(message, TableWarning, stacklevel=3)
    bounds, prior = ({n: two for n, two in each.items() if n in start} for each in (form.bounds, form.prior))
    unmeasured = tuple({*operators.unseen} & {*model.outputs})
    return HarmonicFile(model, bounds, start, form.errors, path, unmeasured, prior)


def _equations(section: Section, key: str) -> list[str] | None:
    value = section.take(key)
    if not isinstance(value, list) or not value:
        section.complain(key, f"a list of texts, equations = [{_EXAMPLE}]")
        return None
    for number, text in enumerate(value, start=1):
        if not isinstance(text, str):
            section.complain(key, f"a text in quotes as equation {number}, not {text!r}", value=False)
            continue
        try:
            parse_equation(text, where=f"equation {number}")
        except ExpressionError as error:
            section.complain(key, f"an equation that can be read: {error}", value=False)
    return None if key in section.refused else value


def _names(section: Section, key: str) -> list[str] | None:
    value = section.take(key)
    if not isinstance(value, list) or (key == "estimate" and not value):
        more = "; starting values go into [start]" if isinstance(value, dict) and key == "estimate" else ""
        section.complain(key, f"a list of names, {_SUCH_AS[key]}{more}")
        return None
    for item in value:
        if wrong := unlike_a_name(item, "p"):
            section.complain(key, f"{wrong}; {item!r} is none", value=False)
    repeated = next((item for i, item in enumerate(value) if item in value[:i]), None)
    if key not in section.refused and repeated is not None:
        section.complain(key, f"every name once, not {repeated} twice", value=False)
    return None if key in section.refused else value


def _numbers(section: Section | None, allowed: list[str] | None) -> dict[str, float]:
    """A table of numbers; of allowed names only, where they are given."""
    values = {name: section.number(name) for name in _own_names(section, allowed)} if section else {}
    return {name: value for name, value in values.items() if value is not None}


def _own_names(section: Section | None, allowed: list[str] | None) -> Iterator[str]:
    if allowed is None:
        return names_in(section, lambda name: unlike_a_name(name, "p"))
    return names_in(section, lambda name: unlike(name, allowed, "estimate"))


_LIST = Kind(_names, NAMES)
_SUCH_AS = {
    "estimate": 'such as estimate = ["c", "b"]',
    "inputs": 'such as inputs = ["F"]',
    "varying": 'such as varying = ["Omega"]',
}
HARMONIC = (
    Key("equations", Kind(_equations, NAMES, example=_EXAMPLE), "texts with `=`"),
    Key("estimate", _LIST, "names"),
    Key("inputs", _LIST, "amplitudes that excite; without it those that stand only on right sides"),
    Key(
        "varying",
        _LIST,
        "known quantities that change from row to row, such as a speed; without it names that stand only as "
        "factors of an amplitude",
    ),
    Key("known", NUMBERS, "names with their numbers"),
    BOUNDS,
    PRIOR,
    Key("start", NUMBERS, "guesses, for output error, and models with several solutions"),
    STATED_ERRORS,
)
