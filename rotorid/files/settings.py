"""Settings (.toml files and sheets) as typed models: all problems at once, with place, unit and suggestion.

A table of settings is a subclass of `Settings`; its fields are `key(…)`. The model is the data: what
`read_settings` gives has defaults filled in, numbers in SI, and `problem` for whatever is wrong with a key
in the light of other files. Keys of which the name ends in a unit may end in any unit of the same kind.
"""

from __future__ import annotations

import datetime
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Annotated, Any, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    PrivateAttr,
    StringConstraints,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    field_validator,
    model_validator,
)
from pydantic_core import CoreSchema, ErrorDetails, core_schema

from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.base.versions import SCHEMA_VERSION
from rotorid.files.decimal_numbers import LARGEST, NotANumber, decimal_comma, parse_number
from rotorid.files.problems import Problem, Problems
from rotorid.files.units import Quantity, Unit, UnitError, UnitReader

DRAFT = "https://json-schema.org/draft/2020-12/schema"
Where = Mapping[str, tuple[str, int, str]]
"""Sheet, row and column of each setting of a workbook, by its dotted name."""
_Model = TypeVar("_Model", bound="Settings")
_UNMARKED = str.maketrans("", "", "`")
_BOUNDS = {"gt": "exclusiveMinimum", "ge": "minimum", "lt": "exclusiveMaximum", "le": "maximum"}
_WORDS = {
    "bool": "true or false, without quotes (in a sheet: yes or no)",
    "string": "a text in quotes",
    "float": "a number",
    "int": "a whole number",
    "finite": "a finite number",
    "greater_than_equal": "a number of {ge:g} or more",
    "greater_than": "a number above {gt:g}",
    "less_than_equal": "a number up to {le:g}",
    "less_than": "a number below {lt:g}",
    "literal": "{expected}",
    "model": "a table of settings, [{name}]",
    "dict": "a table, [{name}]",
    "list": "a list, or tables that begin with [[{name}]]",
    "tuple": "a list",
    "too_short": "a list with at least {min_length}",
    "too_long": "at most {max_length:,}, not {actual_length:,}",
}
"""What is expected, by the beginning of the type of pydantic's error."""


class of:
    """Of a field that keeps its unit, `Annotated[Quantity, of(Positive)]`; others with units are in SI."""

    def __init__(self, inner: Any) -> None:  # noqa: ANN401  an annotation
        self._inner = inner

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        def read(raw: Quantity, inner: ValidatorFunctionWrapHandler) -> Quantity:
            return replace(raw, value=inner(raw.value))

        return core_schema.no_info_wrap_validator_function(read, handler.generate_schema(self._inner))


@dataclass(frozen=True)
class Key:
    """What is said about a field: its usual names, units, and words for people."""

    names: tuple[str, ...] = ()
    about: str = ""
    units: Mapping[str, Unit] | UnitReader | None = None
    expected: str = ""

    def __call__(self, schema: dict[str, Any]) -> None:
        """Of `json_schema_extra`: adds nothing."""

    @property
    def variants(self) -> dict[str, Unit]:
        """All names that can be listed, in all units."""
        plain, units = Unit("", ""), self.units
        if not isinstance(units, Mapping):
            return dict.fromkeys(self.names, plain)
        out: dict[str, Unit] = {}
        for name in self.names:
            usual = max((unit for unit in units if name.endswith(f"_{unit}")), key=len, default="")
            out[name] = units[usual] if usual else plain
            alike = [unit for unit in units.values() if usual and unit.kind == units[usual].kind]
            out |= {f"{name.removesuffix(usual)}{unit.name}": unit for unit in alike}
        return out

    def read(self, name: str, value: object) -> object:
        """A value at a name of this key, with its unit where it has one; `UnitError` for another."""
        if self.units is None:
            return value
        if not callable(self.units):
            return Quantity(name, value, self.variants[name])
        return Quantity(name, value, self.units(name[len(self.names[0]) + 1 :]))


def key(
    about: str,
    name: str = "",
    default: Any = ...,  # noqa: ANN401  of the type of the field
    *,
    units: Mapping[str, Unit] | UnitReader | None = None,
    expected: str = "",
    example: str = "",
    **limits: Any,  # noqa: ANN401
) -> Any:  # noqa: ANN401
    """A field of `Settings`.

    Parameters
    ----------
    about
        For people: what it is, as a clause in Markdown.
    name
        Of the key in files, where the field has another; several names, with blanks between, of which a table
        has one.
    default
        Without the key; none: it is required.
    units
        Where the name ends in a unit: the units that it may end in (those of the same kind of quantity count
        for each name), or a reader of any unit after the name. The field is in SI, unless its type is `of` a
        `Quantity`.
    expected
        For messages: what is expected, with an example; also where a required key is missing.
    example
        How a file writes it.
    **limits
        Of pydantic: gt, ge, lt, le, min_length, max_length.
    """
    names = tuple(name.split())
    return Field(
        default,
        alias=names[0] if names else None,
        description=about.translate(_UNMARKED),
        examples=[example] if example else None,
        json_schema_extra=Key(names, about, units, expected),
        **limits,
    )


@dataclass(frozen=True)
class _File:
    """A file of settings: the dotted name of each table in it, by identity, and the cells of a workbook."""

    source: str = ""
    where: Where = field(default_factory=dict)
    names: Mapping[int, str] = field(default_factory=dict)


def _table_names(node: object, name: str = "") -> dict[int, str]:
    inside: Iterable[tuple[str, object]] = ()
    if isinstance(node, dict):
        inside = ((f"{name}.{key}".strip("."), value) for key, value in node.items())
    elif isinstance(node, list):
        inside = ((f"{name}[{number}]", value) for number, value in enumerate(node, start=1))
    out = {id(node): name} if inside else {}
    for inner, value in inside:
        out |= _table_names(value, inner)
    return out


class _Wrong(ValueError):
    """What is wrong with a table and those in it."""

    def __init__(self, problems: list[Problem]) -> None:
        super().__init__(*problems)
        self.problems = problems


class Settings(BaseModel):
    """A table of settings; every key that it does not know is a problem."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, arbitrary_types_allowed=True, defer_build=True, allow_inf_nan=False
    )
    _file: _File = PrivateAttr(default_factory=_File)
    _name: str = PrivateAttr("")
    _data: dict[str, Any] = PrivateAttr(default_factory=dict)
    _keys: dict[str, str] = PrivateAttr(default_factory=dict)
    """Each key as it is written, by its usual name."""

    def __eq__(self, other: object) -> bool:
        """Where settings stand makes no difference."""
        return type(self) is type(other) and self.__dict__ == getattr(other, "__dict__", None)

    def wrong(self) -> Iterator[tuple[str, str]]:
        """Fields that are right by themselves and do not fit together, each with what is expected.

        Of a field "" it is the table as a whole.
        """
        yield from ()

    def problem(self, field: str, expected: str) -> Problem:
        """A problem with a field: file, row, key as written, its value, what is expected."""
        key = self.written(field)
        value = self._data.get(key)
        value = None if isinstance(value, dict) else value
        return _problem(self._file, f"{self._name}.{key}".strip("."), expected, value)

    def complain(self, problems: Problems, field: str, expected: str) -> None:
        """Note a problem with a field."""
        problems.extend([self.problem(field, expected)])

    def written(self, field: str) -> str:
        """The key of a field as it is written, or would be."""
        alias = (type(self).model_fields[field].alias if field else None) or field
        return self._keys.get(alias, alias)

    def has(self, field: str) -> bool:
        """Whether a field is written."""
        return field in self.model_fields_set

    @classmethod
    @cache
    def known_keys(cls) -> dict[str, Key]:
        """What is said about its fields, by the names of their keys."""
        out = {}
        for name, one in cls.model_fields.items():
            key = one.json_schema_extra if isinstance(one.json_schema_extra, Key) else Key()
            out[one.alias or name] = replace(key, names=key.names or (name,))
        return out

    @classmethod
    @cache
    def usual(cls, written: str) -> str:
        """The usual name of a key; of one that is not known the name itself."""
        keys = cls.known_keys()
        exact = [usual for usual, key in keys.items() if written in key.variants]
        longer = [
            name for name, key in keys.items() if callable(key.units) and written.startswith(f"{name}_")
        ]
        return next(iter([*exact, *longer]), written)

    @model_validator(mode="wrap")
    @classmethod
    def _read(cls, data: Any, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:  # noqa: ANN401
        if not isinstance(data, dict):
            return handler(data)
        file = info.context or _File()
        name, values, keys = file.names.get(id(data), ""), dict[str, Any](), dict[str, str]()
        problems = list[Problem]()
        for key, value in data.items():
            usual, about = cls.usual(key), cls.known_keys().get(cls.usual(key), Key())
            try:
                if usual in keys:
                    raise UnitError(f"one key of them; {keys[usual]} says it already")
                values[usual] = about.read(key, value)
            except UnitError as error:
                problems.append(_problem(file, f"{name}.{key}".strip("."), str(error), value))
            keys.setdefault(usual, key)
        try:
            made = handler(values)
        except ValidationError as error:
            for one in error.errors(include_url=False):
                problems += cls._problems(one, file, name, data, keys)
        if problems:
            raise _Wrong(problems)
        made._file, made._name, made._data, made._keys = file, name, data, keys
        if wrong := [made.problem(*one) for one in made.wrong()]:
            raise _Wrong(wrong)
        return made

    @classmethod
    def _problems(
        cls, error: ErrorDetails, file: _File, table: str, data: dict[str, Any], keys: dict[str, str]
    ) -> list[Problem]:
        """What pydantic found wrong with a field, or with something in it, in our words."""
        inner = error.get("ctx", {}).get("error")
        if isinstance(inner, _Wrong):
            return inner.problems
        usual, *steps = error["loc"]
        about, kind = cls.known_keys().get(str(usual), Key()), error["type"]
        if kind == "missing" and not steps:
            if usual in keys:  # with a unit that is none
                return []
            expected = about.expected or f"a value: {about.about}"
            return [_problem(file, f"{table}.{usual}".strip("."), expected)]
        name, node = f"{table}.{keys[str(usual)]}".strip("."), data[keys[str(usual)]]
        for step in steps:  # of lists, and of texts and unions, there are no names
            if isinstance(node, dict) and step in node:
                name, node = f"{name}.{step}", node[str(step)]
        value = error["input"].value if isinstance(error["input"], Quantity) else error["input"]
        if kind == "extra_forbidden":
            known = [one for key in cls.known_keys().values() for one in key.names]
            near = did_you_mean(str(usual), known)
            expected = f"a known key{near}; known are {listing(known, 'and') or 'none yet'}"
            # nothing is printed of a file of something else
            return [_problem(file, name, expected, value if table or near or len(keys) > 1 else None)]
        if kind == "value_error":
            words = str(inner)
        elif kind == "missing":
            words = "all values that belong there"
        else:
            words = next((words for begin, words in _WORDS.items() if kind.startswith(begin)), error["msg"])
            words = words.format(**error.get("ctx", {}), name=name)
        if kind == "literal_error":
            words += did_you_mean(str(value), re.findall(r"'([^']*)'", words))
        if about.expected not in words:
            words += f": {about.expected}"
        return [_problem(file, name, words, value)]

    @field_validator("*", mode="wrap")
    @classmethod
    def _in_si(cls, value: Any, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:  # noqa: ANN401
        if not isinstance(value, Quantity) or "Quantity" in repr(
            cls.model_fields[str(info.field_name)].annotation
        ):
            return handler(value)
        read = handler(value.value)
        if isinstance(read, tuple):
            return tuple(map(value.unit.to_si, read))
        return value.unit.to_si(read) if isinstance(read, (int, float)) else read

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """As pydantic's, with each key in all its units."""
        schema = handler.resolve_ref_schema(handler(core))
        plain, required = schema.pop("properties", {}), schema.pop("required", [])
        schema["properties"] = properties = dict[str, Any]()
        for usual, key in cls.known_keys().items():
            names = list(key.variants)
            properties |= dict.fromkeys(names, plain[usual])
            if callable(key.units):
                schema.setdefault("patternProperties", {})[f"^{usual}_"] = plain[usual]
            elif usual in required and len(names) == 1:
                schema.setdefault("required", []).append(usual)
            elif usual in required:
                one_of_them = {"anyOf": [{"required": [name]} for name in names]}
                schema.setdefault("allOf", []).append(one_of_them)
        return schema


def read_settings(
    model: type[_Model],
    data: Mapping[str, Any],
    source: str,
    problems: Problems,
    where: Where | None = None,
) -> _Model | None:
    """Settings as a model; all that is wrong with them is noted.

    Parameters
    ----------
    model
        What may stand there.
    data
        As `tomllib` gives it, or from the cells of a sheet.
    source
        The file, for messages.
    problems
        Collects them.
    where
        Sheet, row and column of each setting of a workbook, by its dotted name.

    Returns
    -------
    The model, or None where there are problems.
    """
    tables = dict(data)
    try:
        return model.model_validate(tables, context=_File(source, where or {}, _table_names(tables)))
    except ValidationError as error:
        problems.extend(error.errors(include_url=False)[0]["ctx"]["error"].problems)
    return None


def _problem(file: _File, name: str, expected: str, value: object = None) -> Problem:
    """A problem with the key of this dotted name, in the cell of it or of the table that holds it."""
    at = name
    while at and at not in file.where:
        at = at.rpartition(".")[0]
    source, row, column = file.where.get(at, (file.source, None, name or None))
    shown = "a table" if isinstance(value, dict) else str(value)
    shown = shown.lower() if isinstance(value, bool) else shown
    return Problem(source, row, column, None if value is None else shown, expected)


def _plain(value: object) -> object:
    """A number, also as its text."""
    if isinstance(value, str):
        try:
            return parse_number(value.strip(), comma=decimal_comma([value.strip()], ""))
        except NotANumber as error:
            raise ValueError(str(error)) from None
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError("a number")
    if not abs(value) <= LARGEST:
        raise ValueError(f"a finite number, up to {LARGEST:g} in size")
    return value


def _parts(value: object) -> object:
    """A list, a single value, or a text of values with semicolons."""
    if isinstance(value, str):
        return tuple(part.strip() for part in value.split(";") if part.strip())
    return tuple(value) if isinstance(value, list) else (value,)


def entries(value: object) -> object:
    """A table, or a text such as `3: 10; 5: 20`."""
    if not isinstance(value, str):
        return value
    parts = [part.partition(":") for part in value.split(";") if part.strip()]
    if not all(colon and name.strip() for name, colon, _ in parts):
        raise ValueError('a table, in a sheet "3: 10; 5: 20"')
    found = {name.strip(): text.strip() for name, _, text in parts}
    if len(found) < len(parts):
        raise ValueError("each name once")
    return found


def _day(value: object) -> object:
    if isinstance(value, datetime.datetime):
        return value.date()
    if isinstance(value, datetime.date):
        return value
    try:
        return datetime.date.fromisoformat(str(value).strip())
    except ValueError:
        raise ValueError("a date, such as 2026-03-17") from None


Number = Annotated[float, BeforeValidator(_plain, json_schema_input_type=float)]
Positive = Annotated[Number, Field(gt=0)]
NotNegative = Annotated[Number, Field(ge=0)]
Turn = Annotated[Number, Field(ge=-360, le=360)]
"""An angle in degrees."""
Whole = Annotated[int, BeforeValidator(_plain, json_schema_input_type=int)]
Text = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1)]
Label = Annotated[
    Text,
    BeforeValidator(lambda v: str(v) if type(v) is int else v, json_schema_input_type=str | int),
]
"""A name that may be a number, as serial numbers are."""
Date = Annotated[datetime.date, BeforeValidator(_day, json_schema_input_type=datetime.date)]


def listed(inner: Any, check: Callable[[Any], Any] = tuple) -> Any:  # noqa: ANN401  an annotation
    """The type of a list, checked, that may also be one value, or a text of values with semicolons."""
    several = Field(min_length=1)
    written = inner | Annotated[list[inner], several] | str
    parts = BeforeValidator(_parts, json_schema_input_type=written)
    return Annotated[tuple[inner, ...], parts, several, AfterValidator(check)]


def by_name(inner: Any) -> Any:  # noqa: ANN401
    """The type of a table of values by name that may also be a text, such as `3: 10; 5: 20`."""
    table = Annotated[dict[str, inner], Field(min_length=1)]
    return Annotated[table, BeforeValidator(entries, json_schema_input_type=table | str)]


def settings_schema(model: type[Settings], title: str) -> dict[str, Any]:
    """Settings of a whole file as a JSON schema (draft 2020-12), for editors."""
    schema = _tidy(model.model_json_schema())
    schema["properties"]["schema_version"] = {
        "const": SCHEMA_VERSION,
        "description": "of the keys of this file; unstated: this one",
    }
    return {"$schema": DRAFT, **schema, "title": title}


def _tidy(node: Any) -> Any:  # noqa: ANN401
    """Without titles and nulls, which TOML has not; bounds by their names in schemas."""
    if isinstance(node, list):
        return [_tidy(one) for one in node if one != {"type": "null"}]
    if not isinstance(node, dict):
        return node
    out = {_BOUNDS.get(name, name): _tidy(value) for name, value in node.items()}
    return {k: v for k, v in out.items() if v is not None and not (k == "title" and isinstance(v, str))}
