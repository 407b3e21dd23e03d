"""Model files of matrices, back as equations of motion."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rotorid import expressions
from rotorid.base.arrays import FloatArray
from rotorid.base.suggestions import did_you_mean
from rotorid.tables.models.ode_file import TimeForm, read_time_form
from rotorid.tables.reader.problems import Problems
from rotorid.tables.reader.toml_file import Section, read_toml

if TYPE_CHECKING:
    from fem.matrices.equations_of_motion import Motion


def read_motion(path: str | Path, values: Mapping[str, float] | None = None) -> Motion:
    """Read M, C and K of a model file, such as `rotorid reduce --model` writes.

    Parameters
    ----------
    path
        A file of the matrix form of `read_ode_model`. Forces of time and inputs, initial values and outputs
        play no part here.
    values
        Parameters by name, instead of their starting values.

    Returns
    -------
    Motion
        At the file's `speed_rad_s`, or 0.

    Raises
    ------
    InputError
        With all problems of the file: among them states instead of matrices, entries that depend on time or
        displacements, and forces that depend on displacements.
    ValueError
        Values of names that are no parameters, or are not finite.
    """
    path = Path(path)
    problems = Problems()
    section = Section(str(path), problems.need(read_toml(path, problems)), problems)
    form = read_time_form(section, problems)
    problems.stop()
    constants = form.known | form.estimate | _values(form, values or {})
    found: dict[str, FloatArray] = {}
    if form.matrices is None:
        section.missing(
            "M",
            "M, C and K: states have no mass matrix; read_ode_model and "
            "rotorid.timedomain.models.linear_system read such a file",
        )
    else:
        for key in ("M", "C", "K"):
            found[key] = _matrix(getattr(form.matrices, key), key, constants, section)
        for name, text in form.force.items():
            if used := sorted(expressions.names(expressions.parse(text)) & set(form.states)):
                section.complain(
                    f"force.{name}", f"no {used[0]} in it: what depends on motion into C or K", value=False
                )
    problems.stop()
    matrices = problems.need(form.matrices)
    from fem.matrices.equations_of_motion import Motion

    return Motion(**found, coordinates=matrices.coordinates, speed=form.speed)


def _values(form: TimeForm, values: Mapping[str, float]) -> dict[str, float]:
    for name, value in values.items():
        if name not in form.estimate:
            hint = did_you_mean(name, form.estimate)
            there = ", ".join(form.estimate) or "none"
            raise ValueError(f"values: {name} is no parameter of the model{hint}; they are: {there}")
        if not np.isfinite(value):
            raise ValueError(f"values: {name} must be a finite number, not {value!r}")
    return {name: float(value) for name, value in values.items()}


def _matrix(
    rows: list[list[float | str]], key: str, constants: Mapping[str, float], section: Section
) -> FloatArray:
    out = np.zeros((len(rows), len(rows)))
    for i, row in enumerate(rows):
        for j, entry in enumerate(row):
            try:
                out[i, j] = _entry(entry, constants) if isinstance(entry, str) else entry
            except ValueError as error:
                section.complain(
                    key, f"a number or an expression of parameters in row {i + 1}: {error}", value=False
                )
    return out


def _entry(text: str, constants: Mapping[str, float]) -> float:
    """Value of an expression of parameters; numbers are exact until the end."""
    import sympy

    expression = expressions.parse(text)
    if lost := sorted(expressions.names(expression) - set(constants)):
        raise ValueError(f"{lost[0]} is neither a parameter nor known")
    exact = {sympy.Symbol(k): _rational(v) for k, v in constants.items()}
    value = complex(expression.subs(exact).evalf(30))
    if not np.isfinite(value) or value.imag:
        raise ValueError(f"{text!r} has no finite real value")
    return value.real


def _rational(value: float) -> object:
    import sympy

    exact = Fraction(repr(float(value)))
    return sympy.Rational(exact.numerator, exact.denominator)
