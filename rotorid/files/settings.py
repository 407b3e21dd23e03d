"""Settings (.toml files and sheets) as typed models: all problems at once, with place, unit and suggestion.

A table of settings is a subclass of `Settings`; its fields are `key(…)`. The model is the data: what
`read_settings` gives has defaults filled in, numbers in SI, and `problem` for whatever is wrong with a key
in the light of other files. Keys of which the name ends in a unit may end in any unit of the same kind.
"""

from __future__ import annotations

import datetime
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
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


@dataclass(eq=False)
class _Table:
    """A table as it is written: its dotted name, keys and values, and each key by its usual name.

    `where` is sheet, row and column of each setting of a workbook by its dotted name.
    """

    source: str = ""
    where: Where = field(default_factory=dict)
    name: str = ""
    data: dict[str, Any] = field(default_factory=dict)
    model: type[Settings] | None = None
    written: dict[str, str] = field(default_factory=dict)

    def __eq__(self, other: object) -> bool:
        """Where settings stand makes no difference."""
        return isinstance(other, _Table)

    def problem(self, key: str, expected: str, value: object = None) -> Problem:
        dotted = at = f"{self.name}.{key}".strip(".")
        while at and at not in self.where:
            at = at.rpartition(".")[0]
        source, row, column = self.where.get(at, (self.source, None, dotted or None))
        shown = str(value).lower() if isinstance(value, bool) else str(value)
        shown = "a table" if isinstance(value, dict) else shown
        return Problem(source, row, column, None if value is None else shown, expected)

    def key(self, field: str) -> str:
        """The key of a field as it is written, or would be."""
        alias = (self.model.model_fields[field].alias if self.model and field else None) or field
        return self.written.get(alias, alias)


def _tables(node: object, table: _Table) -> dict[int, _Table]:
    """All tables in one, by their identity; its fields are those of the first."""
    out = {}
    if isinstance(node, dict):
        out[id(node)] = replace(table, data=node, written={})
        for name, value in node.items():
            out |= _tables(value, replace(table, name=f"{table.name}.{name}".strip(".")))
    elif isinstance(node, list):
        for number, value in enumerate(node, start=1):
            out |= _tables(value, replace(table, name=f"{table.name}[{number}]"))
    return out


class _DoNotFit(ValueError):
    """Fields that do not fit together, each with what is expected."""

    def __init__(self, table: _Table, wrong: tuple[tuple[str, str], ...]) -> None:
        self.table, self.wrong = table, wrong


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

    def problem(self, field: str, expected: str) -> Problem:
        """A problem with a field: file, row, key as written, its value, what is expected."""
        key = self.written(field)
        return self._table.problem(key, expected, self._table.data.get(key))

    def complain(self, problems: Problems, field: str, expected: str) -> None:
        """Note a problem with a field."""
        problems.extend([self.problem(field, expected)])

    def written(self, field: str) -> str:
        """The key of a field as it is written, or would be."""
        return self._table.key(field) or field

    def has(self, field: str) -> bool:
        """Whether a field is written."""
        return self.written(field) in self._table.data

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
        table = (info.context or {}).get(id(data)) or _Table(data=data)
        table.model, values = cls, dict[str, Any]()
        for name, value in data.items():
            usual = cls.usual(name)
            key = cls.known_keys().get(usual)
            read = value if key is None else key.read(name, value)
            if usual in values and isinstance(read, Quantity):
                read = replace(read, wrong=f"one key of them; {table.written[usual]} says it already")
            values[usual], table.written[usual] = read, name
        made = handler(values)
        made._table = table
        if wrong := tuple(made.wrong()):
            raise _DoNotFit(table, wrong)
        return made

    @field_validator("*", mode="wrap")
    @classmethod
    def _in_si(cls, value: Any, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:  # noqa: ANN401
        if not isinstance(value, Quantity):
            return handler(value)
        if value.wrong:
            raise ValueError(value.wrong)
        if "Quantity" in repr(cls.model_fields[str(info.field_name)].annotation):
            return handler(value)
        read, unit = handler(value.value), value.unit
        if isinstance(read, tuple):
            return tuple(map(unit.to_si, read))
        return unit.to_si(read) if isinstance(read, (int, float)) else read

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
    The model; keys with a problem are left out of it, so that reading can go on and find more. None where
    that leaves nothing. A caller that needs it right stops at `problems`.
    """
    kept, first = _copy(data), True
    while True:
        tables = _tables(kept, _Table(source, where or {}))
        try:
            return model.model_validate(kept, context=tables)
        except ValidationError as error:
            errors = [_problems(one, tables, kept) for one in error.errors(include_url=False)]
        if first:
            problems.extend(problem for _, more in errors for problem in more)
        first = False
        if [table.pop(key) for wrong, _ in errors for table, key in wrong if key in table] == []:
            return None


def _problems(
    error: ErrorDetails,
    tables: dict[int, _Table],
    node: Any,  # noqa: ANN401
) -> tuple[list[tuple[dict[str, Any], str]], list[Problem]]:
    """The keys that are wrong, each with the table that holds it, and the problems in our words."""
    trail: list[tuple[_Table, str, Key]] = []
    for step in error["loc"]:
        table = tables.get(id(node), _Table())
        name = table.written.get(str(step), step)
        if name in table.data or (error["type"] == "missing" and table.model):
            known = {str(step): trail[-1][2]} if table.model is None else table.model.known_keys()
            trail.append((table, str(name), known.get(str(step), Key())))
        with suppress(LookupError, TypeError):  # a text that stands for a list, the name of a union's member
            node = node[name]
    wrong = error.get("ctx", {}).get("error")
    if isinstance(wrong, _DoNotFit):
        table = wrong.table
        fields = [(table.key(field), expected) for field, expected in wrong.wrong]
        more = [table.problem(key, expected, table.data.get(key)) for key, expected in fields]
        gone = [(table.data, key) for key, _ in fields if key in table.data]
        return gone or [(outer.data, key) for outer, key, _ in trail[-1:]], more
    table, name, key = trail[-1]
    if error["type"] == "missing":
        problem = table.problem(name, key.expected or f"a value: {key.about}")
        return [(outer.data, inner) for outer, inner, _ in trail[-2:-1]], [problem]
    expected, value = _expected(error, table, name, key), error["input"]
    value = value.value if isinstance(value, Quantity) else value
    if error["type"] == "extra_forbidden" and not (table.name or len(table.written) > 1 or "(" in expected):
        value = None  # nothing is printed of a file of something else
    return [(table.data, name)], [table.problem(name, expected, value)]


def _expected(error: ErrorDetails, table: _Table, name: str, key: Key) -> str:
    kind = error["type"]
    if kind == "extra_forbidden" and table.model is not None:
        known = [one for key in table.model.known_keys().values() for one in key.names]
        return f"a known key{did_you_mean(name, known)}; known are {listing(known, 'and') or 'none yet'}"
    if kind == "value_error":
        words = str(error["ctx"]["error"])
    else:
        words = next((words for begin, words in _WORDS.items() if kind.startswith(begin)), error["msg"])
        words = words.format(**error.get("ctx", {}), name=f"{table.name}.{name}".strip("."))
    if kind == "literal_error":
        words += did_you_mean(str(error["input"]), re.findall(r"'([^']*)'", words))
    return f"{words}: {key.expected}" if key.expected and key.expected not in words else words


def _copy(node: Any) -> Any:  # noqa: ANN401
    if isinstance(node, Mapping):
        return {name: _copy(value) for name, value in node.items()}
    return [_copy(value) for value in node] if isinstance(node, list) else node


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
