"""Settings (.toml files and sheets) as typed models: all problems at once, with place, unit and suggestion.

A table of settings is a subclass of `Settings`; its fields are `key(…)`. The model is the data: what
`read_settings` gives has defaults filled in, numbers in SI, and `problem` for whatever is wrong with a key
in the light of other files. Keys of which the name ends in a unit may end in any unit of the same kind.
"""

from __future__ import annotations

import datetime
import json
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetJsonSchemaHandler,
    GetPydanticSchema,
    PrivateAttr,
    StringConstraints,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    field_validator,
    model_validator,
)
from pydantic_core import CoreSchema, ErrorDetails

from rotorid.base.choices import did_you_mean, suggest
from rotorid.base.json import SCHEMA_VERSION
from rotorid.base.text import listing
from rotorid.files.cells import LARGEST, NotANumber, decimal_comma, parse_number
from rotorid.files.disk import file_content
from rotorid.files.input_problems import InputError, Problem, Problems, refusal
from rotorid.files.units import Quantity, Unit

MOST_BYTES = 2_000_000
_DEEP = re.compile(r"""(?<![\w"'-])(?:[\w"'-]++[ \t]*+\.[ \t]*+){20}""")
"""A key of so many parts; the time that tomllib takes grows with their square."""
MOST_NAMES = 1_000
Place = tuple[str, int, str]
"""Sheet, row and column of a setting of a workbook."""
_Model = TypeVar("_Model", bound="Settings")
_UNMARKED = str.maketrans("", "", "`")
_BOUNDS = {"gt": "exclusiveMinimum", "ge": "minimum", "le": "maximum"}
_WORDS = {
    "bool": "true or false, without quotes (in a sheet: yes or no)",
    "string": "a text in quotes",
    "float": "a number",
    "int": "a whole number",
    "finite": "a finite number",
    "greater_than_equal": "a number of {ge:g} or more",
    "greater_than": "a number above {gt:g}",
    "less_than_equal": "a number up to {le:g}",
    "literal": "{expected}",
    "value_error": "{error}",
    "model": "a table of settings, [{name}]",
    "dict": "a table, [{name}]",
    "list": "a list, or tables that begin with [[{name}]]",
    "tuple": "a list",
    "too_short": "a list with at least {min_length}",
    "too_long": "at most {max_length:,}, not {actual_length:,}",
}
"""What is expected, by the beginning of the type of pydantic's error."""


def of(inner: Any) -> Any:  # noqa: ANN401  an annotation
    """Of a field that keeps its unit, `Annotated[Quantity, of(Positive)]`; others with units are in SI."""
    return GetPydanticSchema(lambda _, handler: handler.generate_schema(inner))


@dataclass(frozen=True)
class Key:
    """What is said about a field: its usual names, units, and words for people."""

    names: tuple[str, ...] = ()
    about: str = ""
    units: Mapping[str, Unit] = field(default_factory=dict)
    expected: str = ""

    def __call__(self, schema: dict[str, Any]) -> None:
        """Of `json_schema_extra`: adds nothing."""

    @cached_property
    def variants(self) -> dict[str, Unit]:
        """All its names, with their units."""
        out = dict[str, Unit]()
        for name in self.names:
            out[name] = Unit("", "")
            for usual, unit in self.units.items():
                if name.endswith(f"_{usual}"):
                    stem, alike = (
                        name.removesuffix(usual),
                        (u for u in self.units.values() if u.kind == unit.kind),
                    )
                    out |= {f"{stem}{other.name}": other for other in alike}
        return out


def key(
    about: str,
    name: str = "",
    default: Any = ...,  # noqa: ANN401  of the type of the field
    *,
    units: Mapping[str, Unit] | None = None,
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
        Where the name ends in a unit: those that it may end in (of the same kind of quantity for each name).
        The field is in SI, unless its type is `of` a `Quantity`.
    expected
        For messages: what is expected, with an example; also where a required key is missing. Unstated: what
        it is, with the example.
    example
        How a file writes it.
    **limits
        Of pydantic: gt, ge, le, min_length, max_length.
    """
    names = tuple(name.split())
    plain = about.translate(_UNMARKED)
    expected = expected or plain.partition(";")[0] + (f", such as {example}" if example else "")
    return Field(
        default,
        alias=names[0] if names else None,
        description=plain,
        examples=[example] if example else None,
        json_schema_extra=Key(names, about, units or {}, expected),
        **limits,
    )


def optional(about: str, name: str = "", **more: Any) -> Any:  # noqa: ANN401
    """A field of `Settings` that is None without its key; otherwise as of `key`."""
    return key(about, name, None, **more)


@dataclass(frozen=True)
class _Table:
    """A table in a file: its dotted name, what it holds, and its keys as written, by their usual names."""

    source: str = ""
    where: Mapping[str, Place] = field(default_factory=dict)
    name: str = ""
    data: Mapping[str, Any] = field(default_factory=dict)
    keys: dict[str, str] = field(default_factory=dict)

    def problem(self, key: str, expected: str, value: object = None) -> Problem:
        """A problem with a key, in the cell of it or of the table that holds it."""
        name = at = f"{self.name}.{key}".strip(".")
        while at and at not in self.where:
            at = at.rpartition(".")[0]
        source, row, column = self.where.get(at, (self.source, None, name or None))
        shown = "a table" if isinstance(value, dict) else str(value)
        shown = shown.lower() if isinstance(value, bool) else shown
        return Problem(source, row, column, None if value is None else shown, expected)


def _names(node: object, name: str = "") -> Iterator[tuple[int, str]]:
    """The dotted name of each table in a file, by identity."""
    yield id(node), name
    if isinstance(node, dict):
        for key, value in node.items():
            yield from _names(value, f"{name}.{key}".strip("."))
    for number, value in enumerate(node if isinstance(node, list) else (), start=1):
        yield from _names(value, f"{name}[{number}]")


class _Wrong(ValueError):
    """What is wrong with a table and those in it: `Problem`s."""


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
        value = self._table.data.get(key)
        return self._table.problem(key, expected, None if isinstance(value, dict) else value)

    def complain(self, problems: Problems, field: str, expected: str) -> None:
        """Note a problem with a field."""
        problems.append(self.problem(field, expected))

    def written(self, field: str) -> str:
        """The key of a field as it is written, or would be."""
        usual = (type(self).model_fields[field].alias if field else None) or field
        return self._table.keys.get(usual, usual)

    def has(self, field: str) -> bool:
        """Whether a field is written."""
        return field in self.model_fields_set

    @classmethod
    @cache
    def known_keys(cls) -> dict[str, Key]:
        """What is said about its fields, by the names of their keys."""
        keys = {one.alias or name: one.json_schema_extra for name, one in cls.model_fields.items()}
        return {
            name: replace(key, names=key.names or (name,))
            for name, key in keys.items()
            if isinstance(key, Key)
        }

    @classmethod
    @cache
    def _units(cls) -> dict[str, tuple[str, Unit | None]]:
        """The usual name of every key, and its unit where it has one."""
        return {
            written: (usual, unit if key.units else None)
            for usual, key in cls.known_keys().items()
            for written, unit in key.variants.items()
        }

    @model_validator(mode="wrap")
    @classmethod
    def _read(cls, data: Any, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:  # noqa: ANN401
        if not isinstance(data, dict):
            return handler(data)
        context: tuple[str, Mapping[str, Place], dict[int, str]] = info.context or ("", {}, {})
        table = _Table(*context[:2], context[2].get(id(data), ""), data)
        problems, values = list[Problem](), dict[str, Any]()
        for written, value in data.items():
            usual, unit = cls._units().get(written, (written, None))
            if usual in table.keys:
                expected = f"one key of them; {table.keys[usual]} says it already"
                problems.append(table.problem(written, expected, value))
                continue
            table.keys[usual] = written
            values[usual] = value if unit is None else Quantity(written, value, unit)
        try:
            made = handler(values)
        except ValidationError as error:
            for one in error.errors(include_url=False):
                problems += cls._problems(one, table)
        else:
            made._table = table
        if problems or (problems := [made.problem(*one) for one in made.wrong()]):
            raise _Wrong(*problems)
        return made

    @classmethod
    def _problems(cls, error: ErrorDetails, table: _Table) -> Sequence[Problem]:
        """What pydantic found wrong with a field, or with something in it, in our words."""
        ctx, kind, value = error.get("ctx", {}), error["type"], error["input"]
        if isinstance(ctx.get("error"), _Wrong):
            return list(ctx["error"].args)
        keys, usual, steps = cls.known_keys(), str(error["loc"][0]), error["loc"][1:]
        words, key = keys.get(usual, Key()).expected, table.keys.get(usual)
        names = [name for each in keys.values() for name in each.names]
        if key is None:  # one message where it is only misspelt
            meant = {suggest(written, names) for written in table.keys if written not in keys}
            return [] if meant.intersection(keys[usual].names) else [table.problem(usual, words)]
        inside = table.data[key] if isinstance(table.data[key], dict) else {}
        key = ".".join([key, *(str(step) for step in steps if step in inside)])
        if kind == "extra_forbidden":
            near = did_you_mean(usual, names)
            words = f"a known key{near}; known are {listing(names, 'and') or 'none yet'}"
            if not (table.name or near or len(table.keys) > 1):
                value = None  # nothing is printed of a file of something else
        elif kind != "missing":
            about = words
            words = next((words for begin, words in _WORDS.items() if kind.startswith(begin)), error["msg"])
            words = words.format(**ctx, name=f"{table.name}.{key}".strip("."))
            words += did_you_mean(str(value), re.findall(r"'([^']*)'", words) if "literal" in kind else ())
            words += "" if about in words else f": {about}"
        return [table.problem(key, words, value)]

    @field_validator("*", mode="wrap")
    @classmethod
    def _in_si(cls, value: Any, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:  # noqa: ANN401
        if not isinstance(value, Quantity):
            return handler(value)
        read, to_si = handler(value.value), value.unit.to_si
        if "Quantity" in repr(cls.model_fields[str(info.field_name)].annotation):
            return replace(value, value=read)
        return tuple(map(to_si, read)) if isinstance(read, tuple) else to_si(read)

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """As pydantic's, with each key in all its units."""
        schema, keys = handler.resolve_ref_schema(handler(core)), cls.known_keys()
        plain = schema.get("properties", {})
        schema["properties"] = {name: plain[usual] for usual, key in keys.items() for name in key.variants}
        required = [keys[usual] for usual in schema.pop("required", [])]
        if required:
            schema["allOf"] = [{"anyOf": [{"required": [name]} for name in key.variants]} for key in required]
        return schema


def read_settings(
    model: type[_Model],
    data: Mapping[str, Any],
    source: str,
    where: Mapping[str, Place] | None = None,
) -> _Model:
    """Settings as a model.

    Parameters
    ----------
    model
        What may stand there.
    data
        As `tomllib` gives it, or from the cells of a sheet.
    source
        The file, for messages.
    where
        Sheet, row and column of each setting of a workbook, by its dotted name.

    Raises
    ------
    InputError
        With all that is wrong with them.
    """
    tables = dict(data)
    try:
        return model.model_validate(tables, context=(source, where or {}, dict(_names(tables))))
    except ValidationError as error:
        raise InputError(error.errors(include_url=False)[0]["ctx"]["error"].args) from None


def _plain(value: object) -> object:
    """A number, also as its text."""
    if isinstance(value, str):
        try:
            value = parse_number(value.strip(), comma=decimal_comma([value.strip()], ""))
        except NotANumber as error:
            in_a_key = "the unit stands in the name of the key"
            raise ValueError(str(error).replace("write the unit in the header", in_a_key)) from None
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
    values = {name.strip(): text.strip() for name, _, text in parts}
    if len(values) < len(parts):
        raise ValueError("each name once")
    return values


def _day(value: object) -> object:
    try:
        return datetime.datetime.fromisoformat(str(value).strip()).date()
    except ValueError:
        raise ValueError("a date, such as 2026-03-17") from None


Number = Annotated[float, BeforeValidator(_plain)]
Positive = Annotated[Number, Field(gt=0)]
NotNegative = Annotated[Number, Field(ge=0)]
Turn = Annotated[Number, Field(ge=-360, le=360)]
"""An angle in degrees."""
Whole = Annotated[int, BeforeValidator(_plain)]
Count = Annotated[Whole, Field(ge=1)]
Text = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1)]
Label = Annotated[
    Text,
    BeforeValidator(lambda v: str(v) if type(v) is int else v, json_schema_input_type=Text | int),
]
"""A name that may be a number, as serial numbers are."""
Date = Annotated[datetime.date, BeforeValidator(_day)]


def listed(inner: Any, check: Callable[[Any], Any] = tuple) -> Any:  # noqa: ANN401  an annotation
    """The type of a list, checked, that may also be one value, or a text of values with semicolons."""
    several = Field(min_length=1)
    written = inner | Annotated[list[inner], several] | Text
    parts = BeforeValidator(_parts, json_schema_input_type=written)
    return Annotated[tuple[inner, ...], parts, several, AfterValidator(check)]


def by_name(inner: Any) -> Any:  # noqa: ANN401
    """The type of a table of values by name that may also be a text, such as `3: 10; 5: 20`."""
    table = Annotated[dict[str, inner], Field(min_length=1)]
    return Annotated[table, BeforeValidator(entries, json_schema_input_type=table | str)]


def settings_schema(model: type[Settings], title: str) -> dict[str, Any]:
    """Settings of a whole file as a JSON schema (draft 2020-12), for editors."""
    for each in Settings.__subclasses__():  # defaults of models that are not built yet fail in pydantic 2.13
        each.model_rebuild()
    text = json.dumps(model.model_json_schema())
    for name, bound in _BOUNDS.items():  # of numbers that may be texts pydantic writes its own names
        text = text.replace(f'"{name}": ', f'"{bound}": ')
    schema = json.loads(text)
    schema["properties"]["schema_version"] = {
        "const": SCHEMA_VERSION,
        "description": "of the keys of this file; unstated: this one",
    }
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": title}


def read_toml(path: Path) -> dict[str, Any]:
    """The content of a TOML file without its `schema_version`; InputError where it is none."""
    data, problems = file_content(path), Problems()
    try:
        if len(data) > MOST_BYTES:
            raise ValueError(f"at most {MOST_BYTES // 10**6} MB")
        text = data.decode("utf-8-sig")
        if not text.strip():
            raise ValueError("settings; the file is empty")
        if _DEEP.search(text):
            raise ValueError("a key of more than 20 parts")
        # A lone carriage return ends a line for no reader of TOML.
        settings = tomllib.loads(text.replace("\r\n", "\n"))
    except UnicodeDecodeError:
        raise refusal(path, "a text file in UTF-8, as TOML demands") from None
    except (ValueError, RecursionError) as error:
        raise refusal(path, f"a TOML file: {error}") from None
    problems.refuse_newer(str(path), settings.pop("schema_version", SCHEMA_VERSION))
    problems.stop()
    return settings


def toml_bytes(data: Mapping[str, Any], comments: Iterable[str] = ()) -> bytes:
    """A file of settings, with comment lines at the top; numbers keep all their digits, empty parts go.

    Raises
    ------
    ValueError
        For a name that is no Unicode text.
    """
    import tomli_w

    lines = [f"# {part}" for line in comments for part in line.splitlines() or [""]]
    text = tomli_w.dumps({"schema_version": SCHEMA_VERSION, **data})
    # a list of numbers on one line
    text = re.sub(r'\[\n\s+([^\[\]{}"]+?),\n\s*\]', lambda row: f"[{' '.join(row[1].split())}]", text)
    return "\n".join([*lines, text]).encode()
