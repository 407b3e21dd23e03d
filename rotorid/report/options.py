"""Options of commands: checked as they enter, and as JSON has them; files, rotors and jobs that are named."""

from __future__ import annotations

import cmath
import dataclasses
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from rotorid.base.choices import Method, find

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    from fem import Rotor
    from rotorid.files import Job

_T = TypeVar("_T", bound="DataclassInstance")


def option_name(field: str) -> str:
    """As the command line writes it: "--first-hole", and "--type" of `machine_type`."""
    return f"--{field.removeprefix('machine_').replace('_', '-')}"


def checked(given: object, kind: type[_T]) -> _T:
    """The same options with the numbers and lists of Python in place of those of NumPy.

    Raises
    ------
    ValueError
        For options of another command, what is no bool where one is needed, and a number that is not finite.
    """
    if not isinstance(given, kind):
        raise ValueError(f"options are {kind.__name__}(...), not {given!r}")
    values: dict[str, Any] = {}
    for field in dataclasses.fields(given):
        value = values[field.name] = _of_python(getattr(given, field.name), option_name(field.name))
        if (str(field.type) == "bool") != isinstance(value, bool):
            needed = "True or False is needed" if str(field.type) == "bool" else "this is no switch"
            raise ValueError(f"{kind.__name__}({field.name}={value!r}): {needed}")
    return dataclasses.replace(given, **values)


def changed(options: DataclassInstance) -> dict[str, object]:
    """Options that differ from their defaults."""
    return {
        field.name: value
        for field in dataclasses.fields(options)
        if plain(value := getattr(options, field.name)) != plain(field.default)
    }


def refuse(options: DataclassInstance, needless: Collection[str], why: str) -> None:
    """Refuse the first of these options that is given: with the others it means nothing.

    Raises
    ------
    ValueError
        Its name and `why`.
    """
    for name in changed(options):
        if name in needless:
            raise ValueError(f"{option_name(name)} {why}")


def check_choices(options: DataclassInstance, choices: Mapping[str, Sequence[Method[Any]]]) -> None:
    """Refuse names that no registry has, with the nearest one; None is the default."""
    for option, allowed in choices.items():
        if (name := getattr(options, option)) is not None:
            find(allowed, name, option_name(option))


def plain(value: object) -> object:
    """An option as JSON has it."""
    value = _of_python(value)
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, str | int | float) or value is None:
        return value
    return [plain(item) for item in value] if isinstance(value, Collection) else str(value)


def _of_python(value: object, what: str = "") -> object:
    """Numbers and lists of NumPy and pandas as those of Python, also inside; finite with a name, `what`."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if what and isinstance(value, int | float | complex) and not cmath.isfinite(value):
        raise ValueError(f"{what}: {value} is no finite number; leave out what has no bound")
    if isinstance(value, Mapping):
        return {_of_python(key): _of_python(item, what) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(_of_python(item, what) for item in value)
    return value


def rotor_of(given: Rotor | Path | str) -> Rotor:
    """A rotor, or that of a file."""
    from fem import Rotor
    from rotorid.files import read_rotor

    return given if isinstance(given, Rotor) else read_rotor(file_of(given, "a rotor"))


def job_source(given: Job | Path | str, phase: str | None = None, angles: str | None = None) -> Job:
    """A job; `phase` and `angles` in place of what its file says.

    Raises
    ------
    ValueError
        For these with a job that is read already; for readings without phases.
    """
    from rotorid.files import Job, read_job

    if not isinstance(given, Job):
        given = read_job(file_of(given, "a job"), phase=phase, angles=angles)
    elif phase is not None or angles is not None:
        raise ValueError("the conventions of a job are stated where it is read")
    given.trials.with_phases()
    return given


def file_of(given: object, what: str) -> Path:
    """The file that is named.

    Raises
    ------
    ValueError
        For what is no name of a file; says what is needed.
    """
    if not isinstance(given, Path | str):
        raise ValueError(f"{what} or its path is needed, not {given!r}")
    return Path(given)
