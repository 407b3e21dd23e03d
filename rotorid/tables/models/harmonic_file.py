"""Model files for identification from harmonic tests: equations, known numbers, what to estimate."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.expressions import ExpressionError, is_name, parse_equation
from rotorid.tables.models.ode_file import read_time_form
from rotorid.tables.models.shared_keys import pair, read_errors
from rotorid.tables.reader.problems import Problems, TableWarning
from rotorid.tables.reader.toml_file import Section, read_toml

if TYPE_CHECKING:
    from rotorid.harmonic.experiments import AmplitudeErrors
    from rotorid.harmonic.model import HarmonicModel

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
    """

    model: HarmonicModel
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    start: Mapping[str, float] = field(default_factory=dict)
    errors: AmplitudeErrors | None = None
    path: Path | None = None


def read_harmonic_model(path: str | Path) -> HarmonicFile:
    """Read a model file (`harmonic.toml`).

    Its keys are `equations` (texts with p = d/dt), `estimate` (names), `known` (name = number), optional
    `inputs` (names of the exciting amplitudes), `varying` (names of known quantities that change from row to
    row of the measurements, where that does not follow from the equations), `[bounds]` (name = [lowest,
    highest]), `[start]` (name = guess) and `[errors]` (`amplitude_percent`, `phase_deg`, `floor`: one
    standard deviation of a reading).

    Instead of equations there may be a linear model in time as `read_ode_model` reads it, such as the one
    that `rotorid reduce --model` writes: `M`, `C`, `K` (then (M p² + C p + K) X = F with amplitudes named
    like the coordinates) or `[states]` (then p x = rate of x). Its `[estimate]` has starting values, which
    are the `start` here. `inputs` are the exciting amplitudes, and `[force]` says where they act; matrices
    without both have a force amplitude f_x7 on every coordinate x7, and those not in the table are 0. An
    output that is a number times a displacement or velocity is measured in place of it; other linear outputs
    add equations. `[initial]` plays no part, `speed_rad_s` neither; a parameter of initial values alone is
    left out, with a warning. Explicit time, constant loads and nonlinear terms are refused. What
    `[outputs]` do not show is eliminated if no parameter stands at it; another amplitude that is not measured
    is predicted by output error, while equation error needs it.

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
    data = read_toml(path, problems)
    if data is None:
        problems.stop()
        raise AssertionError("no file and no problem")
    section = Section(str(path), data, problems)
    section.limit_names()
    problems.stop()
    if "equations" not in section and any(key in section for key in _IN_TIME):
        return _from_time(section, path, problems)
    equations = _equations(section)
    estimate = _names(section, "estimate", 'such as estimate = ["c", "b"]', required=True)
    inputs = _names(section, "inputs", 'such as inputs = ["F"]', required=False)
    varying = _names(section, "varying", 'such as varying = ["Omega"]', required=False)
    known = _numbers(section, "known")
    for name in estimate or ():
        if name in known:
            section.complain("estimate", f"{name} either here or under known, not both")
    bounds = _bounds(section, estimate)
    start = _numbers(section, "start", estimate)
    for name, value in start.items():
        low, high = bounds.get(name, (-math.inf, math.inf))
        if not low <= value <= high:
            section.complain("start", f"{name} within its bounds, {low:g} to {high:g}")
    errors = read_errors(section)
    section.finish()
    model = None
    if not len(problems) and equations is not None and estimate is not None:
        from rotorid.harmonic.operator_equations import harmonic_model

        try:
            model = harmonic_model(
                equations, known=known, estimate=estimate, inputs=inputs, varying=varying or ()
            )
        except ValueError as error:
            section.complain("equations", f"a usable model: {error}", value=False)
    problems.stop()
    if model is None:
        raise AssertionError("no model and no problem")
    return HarmonicFile(model, bounds, start, errors, path)


def _from_time(section: Section, path: Path, problems: Problems) -> HarmonicFile:
    """The operator equations of a model in time."""
    from rotorid.tables.models.operator_form import operator_form

    form = read_time_form(section, problems, initial=False)
    problems.stop()
    from rotorid.harmonic.hidden import without
    from rotorid.harmonic.operator_equations import harmonic_model

    model = None
    try:
        operators = operator_form(form)
        start = dict(operators.estimate)
        model = harmonic_model(
            operators.equations, known=form.known, estimate=list(start), inputs=operators.inputs
        )
        own = operators.unseen
        parametric = {f.equation for f in model.features if f.signal in own and set(f.exact) != {()}}
        plain = {name: i for name, i in own.items() if i not in parametric}
        model = (without(model, plain, plain) if plain else None) or model
        if model.has_constant_terms:
            raise ValueError(
                "a load or output without any amplitude stands in it: a constant one has no influence on "
                "amplitudes, leave it out; one that excites must be a measured input"
            )
    except ValueError as error:
        problems.add(str(path), None, None, None, f"a linear model of amplitudes: {error}")
    problems.stop()
    if model is None:
        raise AssertionError("no model and no problem")
    if operators.left_out:
        lost = listing(operators.left_out, "and")
        stand = "stands" if len(operators.left_out) == 1 else "stand"
        message = f"{path}: {lost} {stand} in initial values only, which amplitudes do not show: left out"
        warnings.warn(message, TableWarning, stacklevel=3)
    bounds = {name: limits for name, limits in form.bounds.items() if name in start}
    return HarmonicFile(model, bounds, start, form.errors, path)


def _equations(section: Section) -> list[str] | None:
    value = section.take("equations")
    if value is None:
        if not any(did_you_mean(key, ["equations"]) for key in section.keys):
            section.missing("equations", f"a list of equations, equations = [{_EXAMPLE}]")
        return None
    if not isinstance(value, list) or not value:
        section.complain("equations", f"a list of texts, equations = [{_EXAMPLE}]")
        return None
    good = True
    for number, text in enumerate(value, start=1):
        if not isinstance(text, str):
            section.complain("equations", f"a text in quotes as equation {number}, not {text!r}", value=False)
            good = False
            continue
        try:
            parse_equation(text, where=f"equation {number}")
        except ExpressionError as error:
            section.complain("equations", f"an equation that can be read: {error}", value=False)
            good = False
    return list(value) if good else None


def _names(section: Section, key: str, example: str, *, required: bool) -> list[str] | None:
    value = section.take(key)
    if value is None:
        if required and not any(did_you_mean(other, [key]) for other in section.keys):
            section.missing(key, f"a list of names, {example}")
        return None
    if not isinstance(value, list) or (required and not value):
        more = "; starting values go into [start]" if isinstance(value, dict) and key == "estimate" else ""
        section.complain(key, f"a list of names, {example}{more}")
        return None
    good = True
    for item in value:
        if not isinstance(item, str) or not is_name(item) or item == "p":
            section.complain(key, f"{_what_a_name_is()}; {item!r} is none", value=False)
            good = False
    repeated = next((item for i, item in enumerate(value) if item in value[:i]), None)
    if good and repeated is not None:
        section.complain(key, f"every name once, not {repeated} twice", value=False)
        good = False
    return list(value) if good else None


def _what_a_name_is() -> str:
    return "names: a letter, then letters, digits and _; not p and no function"


def _numbers(section: Section, key: str, allowed: list[str] | None = None) -> dict[str, float]:
    """A table of numbers; of allowed names only, where they are given."""
    inner = section.section(key)
    found: dict[str, float] = {}
    if inner is None:
        return found
    for name in inner.keys:
        if _refused(inner, name, allowed):
            continue
        value = inner.number(name)
        if value is not None:
            found[name] = value
    return found


def _bounds(section: Section, allowed: list[str] | None) -> dict[str, tuple[float, float]]:
    inner = section.section("bounds")
    found: dict[str, tuple[float, float]] = {}
    if inner is None:
        return found
    for name in inner.keys:
        if _refused(inner, name, allowed):
            continue
        limits = pair(inner.take(name))
        if limits is None:
            inner.complain(name, "two numbers, [lowest, highest], such as [0, 2e6] or [0, inf]")
        else:
            found[name] = limits
    return found


def _refused(inner: Section, name: str, allowed: list[str] | None) -> bool:
    """Complain about a key that is no name, or none of those allowed."""
    if allowed is not None and name not in allowed:
        inner.take(name)
        inner.complain(name, f"a name of estimate{did_you_mean(name, allowed)}", value=False)
        return True
    if not is_name(name) or name == "p":
        inner.take(name)
        inner.complain(name, _what_a_name_is(), value=False)
        return True
    return False
