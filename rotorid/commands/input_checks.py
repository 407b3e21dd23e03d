"""Checks of what a workflow is given: options, as JSON has them, too; rotors and jobs read from files."""

from __future__ import annotations

import cmath
import dataclasses
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, Any, TypeVar

from rotorid.base.registry import Method, find
from rotorid.commands.quantities import option_name

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    from fem import Rotor
    from rotorid.tables import Job

_T = TypeVar("_T", bound="DataclassInstance")
_NUMBER = (int, float)
_KINDS: dict[str, tuple[type, ...]] = {
    "None": (NoneType,),
    "str": (str,),
    "Path": (Path,),
    "int": (int,),
    "float": _NUMBER,
    "bool": (bool,),
    "Amount": (str, *_NUMBER),
    "Vector": (str, *_NUMBER, complex),
    "Weights": (str, *_NUMBER, Mapping),
}
"""What a part of an annotation allows; any other part: a text, or several in a list or a mapping."""
_MANY = (str, Collection)
_WORDS = {
    str: "a text",
    Path: "a path",
    int: "a whole number",
    float: "a number",
    bool: "True or False",
    complex: "a complex number",
    Mapping: "a mapping",
    Collection: "a list or a mapping",
}


def checked(given: object, kind: type[_T]) -> _T:
    """The same options with the numbers and lists of Python in place of those of NumPy.

    Raises
    ------
    ValueError
        For options of another workflow, a value of another type, and a number that is not finite.
    """
    if not isinstance(given, kind):
        raise ValueError(f"options are {kind.__name__}(...), not {given!r}")
    found: dict[str, Any] = {}
    for field in dataclasses.fields(given):
        value = found[field.name] = _of_python(getattr(given, field.name))
        types = dict.fromkeys(one for part in str(field.type).split(" | ") for one in _KINDS.get(part, _MANY))
        same = bool in types if isinstance(value, bool) else isinstance(value, tuple(types))
        if not same or isinstance(value, bytes):
            shown = ([] if float in types else [_WORDS[int]] if int in types else []) + [
                word for one, word in _WORDS.items() if one in types and one is not int
            ]
            raise ValueError(f"{kind.__name__}({field.name}={value!r}): {' or '.join(shown)} is needed")
        _check_finite(value, option_name(field.name))
    return dataclasses.replace(given, **found)


def changed(options: DataclassInstance) -> dict[str, object]:
    """Options that differ from their defaults, without the files that a terminal's command writes."""
    writes = getattr(options, "writes", ())
    fields = [field for field in dataclasses.fields(options) if field.name not in writes]
    given = {field: getattr(options, field.name) for field in fields}
    return {field.name: value for field, value in given.items() if plain(value) != plain(field.default)}


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
    for option, known in choices.items():
        if (name := getattr(options, option)) is not None:
            find(known, name, option_name(option))


def plain(value: object) -> object:
    """An option as JSON has it."""
    value = _of_python(value)
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, str | int | float) or value is None:
        return value
    return [plain(item) for item in value] if isinstance(value, Collection) else str(value)


def _of_python(value: object) -> object:
    """Numbers and lists of NumPy and pandas as those of Python, also inside."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, Mapping):
        return {_of_python(key): _of_python(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [*map(_of_python, value)] if isinstance(value, list) else (*map(_of_python, value),)
    return value


def _check_finite(value: object, what: str) -> None:
    if isinstance(value, Mapping):
        value = [*value.values()]
    if isinstance(value, int | float | complex) and not cmath.isfinite(value):
        raise ValueError(f"{what}: {value} is no finite number; leave out what has no bound")
    for item in value if isinstance(value, Collection) and not isinstance(value, str) else ():
        _check_finite(item, what)


def rotor_source(given: Rotor | Path | str) -> tuple[Rotor, tuple[Path, ...]]:
    """A rotor, and the files that it was read from."""
    from fem import Rotor
    from rotorid.tables import read_rotor, rotor_files

    if isinstance(given, Rotor):
        return given, ()
    file = file_of(given, "a rotor")
    return read_rotor(file), rotor_files(file)


def job_source(given: Job | Path | str, phase: str | None = None, angles: str | None = None) -> Job:
    """A job; `phase` and `angles` in place of what its file says.

    Raises
    ------
    ValueError
        For these with a job that is read already.
    """
    from rotorid.tables import Job, read_job

    if not isinstance(given, Job):
        return read_job(file_of(given, "a job"), phase=phase, angles=angles)
    if phase is not None or angles is not None:
        raise ValueError("the conventions of a job are stated where it is read")
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
