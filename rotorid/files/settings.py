"""Settings (.toml files and sheets) as typed models: all problems at once, with place, unit and suggestion.

A table of settings is a subclass of `Settings`; its fields are `key(…)`. The model is the data: what
`read_settings` gives has defaults filled in, numbers in SI, and `problem` for whatever is wrong with a key
in the light of other files. Keys of which the name ends in a unit may end in any unit of the same kind.
"""

from __future__ import annotations

import datetime
import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Annotated, Any, Generic, TypeVar, get_args

from pydantic import (
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
from rotorid.files.units import Unit, UnitError, UnitReader

DRAFT = "https://json-schema.org/draft/2020-12/schema"
T = TypeVar("T")
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
    "too_short": "at least {min_length}",
    "too_long": "at most {max_length:,}, not {actual_length:,}",
}
"""What is expected, by the beginning of the type of pydantic's error."""


@dataclass(frozen=True)
class Quantity(Generic[T]):
    """A number (or several) with the key that holds it and its unit.

    As the type of a field, `Quantity[Positive]`, it keeps the unit; other fields with units are in SI.
    """

    key: str
    value: T
    unit: Unit
    wrong: str = field(default="", repr=False)

    @property
    def si(self) -> float:
        """In SI."""
        return self.unit.to_si(self.value)  # type: ignore[arg-type]

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:  # noqa: ANN401
        def read(raw: Quantity[Any], inner: ValidatorFunctionWrapHandler) -> Quantity[Any]:
            return replace(raw, value=inner(raw.value))

        return core_schema.no_info_wrap_validator_function(read, handler(get_args(source)[0]))


@dataclass(frozen=True)
class Key:
    """What is said about a field: its usual names, units, and words for people."""

    names: tuple[str, ...] = ()
    about: str = ""
    units: Mapping[str, Unit] | UnitReader | None = None
    expected: str = ""
    keeps_unit: bool = False

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
        """A value at a name of this key: with its unit, or what is wrong with that, where it has one."""
        if self.units is None:
            return value
        if not callable(self.units):
            return Quantity(name, value, self.variants[name])
        try:
            return Quantity(name, value, self.units(name[len(self.names[0]) + 1 :]))
        except UnitError as error:
            return Quantity(name, value, Unit("", ""), str(error))


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
        for each name), or a reader of any unit after the name. The field is in SI, unless its type is
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


@dataclass
class _Table:
    """A table of settings as it is written.

    Attributes
    ----------
    source, where
        The file, and sheet, row and column of each setting of a workbook by its dotted name.
    name, model
        Its dotted name; what it is read as.
    data
        Keys as written, and values.
    written
        The key as written, by its usual name.
    """

    source: str = ""
    where: Mapping[str, tuple[str, int, str]] = field(default_factory=dict)
    name: str = ""
    model: type[Settings] | None = None
    data: dict[str, Any] = field(default_factory=dict)
    written: dict[str, str] = field(default_factory=dict)

    def problem(self, name: str, expected: str, value: object = None) -> Problem:
        dotted = f"{self.name}.{name}".strip(".")
        at = dotted
        while at and at not in self.where:
            at = at.rpartition(".")[0]
        source, row, column = self.where.get(at, (self.source, None, dotted or None))
        return Problem(source, row, column, None if value is None else _shown(value), expected)


class _Document:
    """All tables of a file, by the identity of their dictionaries; names are known before, models after."""

    def __init__(
        self, data: dict[str, Any], source: str, where: Mapping[str, tuple[str, int, str]] | None
    ) -> None:
        self.tables: dict[int, _Table] = {}
        self._source, self._where = source, where or {}
        self._note(data, "")

    def _note(self, node: object, name: str) -> None:
        if isinstance(node, dict):
            self.tables[id(node)] = _Table(self._source, self._where, name, None, node)
            for key, value in node.items():
                self._note(value, f"{name}.{key}".strip("."))
        elif isinstance(node, list):
            for number, value in enumerate(node, start=1):
                self._note(value, f"{name}[{number}]")


class _DoNotFit(ValueError):
    """Fields that do not fit together, each with what is expected."""

    def __init__(self, *wrong: tuple[str, str]) -> None:
        self.wrong = wrong


class Settings(BaseModel):
    """A table of settings; every key that it does not know is a problem."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, arbitrary_types_allowed=True, defer_build=True, allow_inf_nan=False
    )
    _table: _Table = PrivateAttr(default_factory=_Table)

    def wrong(self) -> Iterator[tuple[str, str]]:
        """Fields that are right by themselves and do not fit together, each with what is expected.

        Of a field "" it is the table as a whole.
        """
        yield from ()

    def problem(self, name: str, expected: str, *, value: bool = True) -> Problem:
        """A problem with a field: file, row, key as written, its value, what is expected."""
        written = self.written(name)
        return self._table.problem(written, expected, self._table.data.get(written) if value else None)

    def written(self, name: str) -> str:
        """The key of a field as it is written, or would be."""
        alias = getattr(type(self).model_fields.get(name), "alias", None) or name
        return self._table.written.get(alias, alias)

    def has(self, name: str) -> bool:
        """Whether a field is written."""
        return self.written(name) in self._table.data

    @classmethod
    @cache
    def keys(cls) -> dict[str, Key]:
        """What is said about its fields, by the names of their keys."""
        out = {}
        for name, one in cls.model_fields.items():
            key = one.json_schema_extra if isinstance(one.json_schema_extra, Key) else Key()
            keeps = "Quantity[" in repr(one.annotation)
            out[one.alias or name] = replace(key, names=key.names or (name,), keeps_unit=keeps)
        return out

    @classmethod
    @cache
    def _variants(cls) -> dict[str, str]:
        """The usual name of a key, by each of its names."""
        return {name: usual for usual, key in cls.keys().items() for name in key.variants}

    @classmethod
    def usual(cls, written: str) -> str | None:
        """The usual name of a key."""
        usual = cls._variants().get(written)
        longer = [name for name, key in cls.keys().items() if callable(key.units)]
        return usual or next((name for name in longer if written.startswith(f"{name}_")), None)

    @model_validator(mode="wrap")
    @classmethod
    def _read(cls, data: Any, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:  # noqa: ANN401
        if not isinstance(data, dict):
            return handler(data)
        table = _Table() if info.context is None else info.context.tables[id(data)]
        table.model, table.data, values = cls, data, {}
        for name, value in data.items():
            usual = cls.usual(name)
            if usual is None:
                values[name] = value
                continue
            read = cls.keys()[usual].read(name, value)
            if usual in values and isinstance(read, Quantity):
                wrong = f"one key of them; {table.written[usual]} says it already"
                read = replace(read, wrong=wrong)
            values[usual], table.written[usual] = read, name
        made = handler(values)
        made._table = table
        if wrong := tuple(made.wrong()):
            raise _DoNotFit(*wrong)
        return made

    @field_validator("*", mode="wrap")
    @classmethod
    def _in_si(cls, value: Any, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:  # noqa: ANN401
        if not isinstance(value, Quantity):
            return handler(value)
        if value.wrong:
            raise ValueError(value.wrong)
        usual = cls.usual(value.key)
        if usual is not None and cls.keys()[usual].keeps_unit:
            return handler(value)
        read, unit = handler(value.value), value.unit
        if isinstance(read, tuple):
            return tuple(map(unit.to_si, read))
        return unit.to_si(read) if isinstance(read, (int, float)) else read

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """As pydantic's, with each key in all its units."""
        schema = handler.resolve_ref_schema(handler(core))
        plain = schema.pop("properties", {})
        required, properties = schema.pop("required", []), {}
        for usual, key in cls.keys().items():
            properties |= dict.fromkeys(key.variants, plain[usual])
            if callable(key.units):
                schema.setdefault("patternProperties", {})[f"^{usual}_"] = plain[usual]
        schema["properties"] = properties
        needed = [list(cls.keys()[name].variants) for name in required if not callable(cls.keys()[name].units)]
        if one := [names[0] for names in needed if len(names) == 1]:
            schema["required"] = one
        if several := [names for names in needed if len(names) > 1]:
            schema["allOf"] = [{"anyOf": [{"required": [name]} for name in names]} for names in several]
        return schema


def read_settings(
    model: type[_Model],
    data: Mapping[str, Any],
    source: str,
    problems: Problems,
    where: Mapping[str, tuple[str, int, str]] | None = None,
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
    The model; keys with a problem are left out of it, so that reading can go on and find more. None where
    that leaves nothing. A caller that needs it right stops at `problems`.
    """
    kept, told = _copy(data), False
    while True:
        document = _Document(kept, source, where)
        try:
            return model.model_validate(kept, context=document)
        except ValidationError as error:
            left = False
            for one in error.errors(include_url=False):
                table, names, more = _problems(one, document, kept)
                if not told:
                    problems.extend(more)
                for name in names:
                    left |= table.data.pop(name, None) is not None
            told = True
            if not left:
                return None


def _problems(
    error: ErrorDetails, document: _Document, data: dict[str, Any]
) -> tuple[_Table, list[str], list[Problem]]:
    """The table with an error of pydantic, its keys that are wrong, and their problems in our words."""
    table, name, key, node = document.tables[id(data)], "", Key(), data
    for step in error["loc"]:
        inner = document.tables.get(id(node))
        if inner is not None and inner.model is not None:
            table, key = inner, inner.model.keys().get(str(step), Key())
            name = inner.written.get(str(step), str(step))
        try:
            node = node[table.written.get(str(step), step) if node is table.data else step]
        except (LookupError, TypeError):
            break
    wrong = error.get("ctx", {}).get("error")
    if isinstance(wrong, _DoNotFit):
        inner = document.tables[id(node)]
        model = inner.model or Settings
        made = [(field and _written(model, field, inner), expected) for field, expected in wrong.wrong]
        shown = [inner.problem(field, expected, inner.data.get(field)) for field, expected in made]
        gone = [field for field, _ in made if field in inner.data]
        return (inner, gone, shown) if gone else (table, [name], shown)
    dotted = f"{table.name}.{name}".strip(".")
    expected, value = _expected(error, table, name, key, dotted), error["input"]
    if error["type"] == "missing":
        return table, [], [table.problem(name, expected)]
    if isinstance(value, Quantity):
        value = value.value
    if isinstance(value, (dict, list, tuple)):
        value = None if isinstance(node, (dict, list)) else node
    if error["type"] == "extra_forbidden" and not (table.name or table.written or "(did" in expected):
        value = None  # nothing is printed of a file of something else
    return table, [name], [table.problem(name, expected, value)]


def _written(model: type[Settings], name: str, table: _Table) -> str:
    alias = model.model_fields[name].alias or name
    return table.written.get(alias, alias)


def _expected(error: ErrorDetails, table: _Table, name: str, key: Key, dotted: str) -> str:
    kind = error["type"]
    if kind == "extra_forbidden":
        known = [one for key in table.model.keys().values() for one in key.names] if table.model else []
        return f"a known key{did_you_mean(name, known)}; known are {listing(known, 'and') or 'none yet'}"
    if kind == "missing":
        return key.expected or f"a value: {key.about}"
    if kind == "value_error":
        words = str(error["ctx"]["error"])
    else:
        found = next((words for begin, words in _WORDS.items() if kind.startswith(begin)), error["msg"])
        words = found.format(**error.get("ctx", {}), name=dotted)
        if kind == "literal_error":
            words += did_you_mean(str(error["input"]), re.findall(r"'([^']*)'", words))
    return f"{words}: {key.expected}" if key.expected and key.expected not in words else words


def _copy(node: Any) -> Any:  # noqa: ANN401
    if isinstance(node, Mapping):
        return {name: _copy(value) for name, value in node.items()}
    return [_copy(value) for value in node] if isinstance(node, list) else node


def _shown(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


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


def listed(inner: Any, **limits: Any) -> Any:  # noqa: ANN401  an annotation
    """The type of a list that may also be one value, or a text of values with semicolons."""
    several = tuple[inner, ...]  # type: ignore[valid-type]
    return Annotated[
        several,
        BeforeValidator(_parts, json_schema_input_type=inner | list[inner] | str),
        Field(**{"min_length": 1} | limits),
    ]


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
    named = "properties" in node
    out = {
        _BOUNDS.get(name, name): _tidy(value)
        for name, value in node.items()
        if not (name == "title" and isinstance(value, str)) and not (name == "default" and value is None)
    }
    alone = out.get("anyOf", ())
    return {**alone[0], **{k: v for k, v in out.items() if k != "anyOf"}} if len(alone) == 1 and not named else out
