"""Keys of settings files, told once: reader, known names, forms, documentation and JSON schema."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

from rotorid.base.versions import SCHEMA_VERSION
from rotorid.files.toml_file import Section
from rotorid.files.units import Quantity as Quantity
from rotorid.files.units import Unit, UnitError, UnitReader

DRAFT = "https://json-schema.org/draft/2020-12/schema"
_MARKED = str.maketrans("", "", "`")


@dataclass(frozen=True)
class Kind:
    """What may stand at a key.

    Attributes
    ----------
    read
        Takes the value of a section's key; None with a problem, which is noted with the section.
    schema
        The same as a JSON schema.
    allowed
        The same in words, for the cells of a form.
    example
        How a file writes it.
    cell
        How a cell of a sheet holds it: text that looks like a number is one, or stays a name; `words` is
        such text as a spreadsheet would take for a date (3:10); a flag is yes or no; a date is one, or its
        text.
    header
        How the key itself is written in a file, such as `[{}]`.
    """

    read: Callable[[Section, str], Any]
    schema: Mapping[str, Any] = field(default_factory=dict)
    allowed: str = ""
    example: str = ""
    cell: Literal["number", "name", "words", "flag", "date"] = "number"
    header: str = "{}"


@dataclass(frozen=True)
class Key:
    """A key of a settings file, and everything that is said about it anywhere.

    Attributes
    ----------
    name
        As files usually have it; several names, with blanks between, of which a section has one.
    kind
        What may stand there.
    about
        For people: what it is, with examples, as a clause in Markdown.
    units
        Where the name ends in a unit: all units that it may end in, by name (those of the same kind of
        quantity count for each name), or a reader of any unit after the name. The value is a `Quantity`,
        with `si` a plain number in SI, the unit of the name.
    default
        The value without the key, and with a problem.
    required
        What is expected where the key is missing; empty: it may be missing.
    """

    name: str
    kind: Kind
    about: str
    units: Mapping[str, Unit] | UnitReader | None = None
    default: Any = None
    required: str = ""
    si: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """The usual names, for messages."""
        return tuple(self.name.split())

    @cached_property
    def variants(self) -> dict[str, Unit | None]:
        """All names that can be listed, in all units."""
        if not isinstance(self.units, Mapping):
            return dict.fromkeys(self.names)
        out: dict[str, Unit | None] = {}
        for name in self.names:
            usual = max((unit for unit in self.units if name.endswith(f"_{unit}")), key=len, default="")
            if not usual:
                out[name] = None
                continue
            kind = self.units[usual].kind
            alike = [unit for unit in self.units.values() if unit.kind == kind and unit.name != usual]
            out[name] = self.units[usual]
            out |= {f"{name.removesuffix(usual)}{unit.name}": unit for unit in alike}
        return out

    def accepts(self, name: str) -> bool:
        """Whether a key of this name is meant."""
        return name in self.variants or (callable(self.units) and name.startswith(f"{self.name}_"))

    def value(self, section: Section) -> Any:  # noqa: ANN401  whatever the kind makes of it
        """What a section says, with units as a `Quantity`; else, and with a problem, the default."""
        present = [name for name in section.keys if self.accepts(name)]
        if not present and self.required:
            section.missing(self.names[0], self.required)
        if self.units is None or self.si:
            return self._read(section, self.names[0]) if present else self.default
        found = {name: self._read(section, name) for name in present}
        for name in present[1:]:
            section.complain(name, f"one key of them; {present[0]} says it already")
        if len(present) != 1 or found[present[0]] is None:
            return self.default
        unit = self._unit(section, present[0])
        return self.default if unit is None else Quantity(present[0], found[present[0]], unit)

    def _read(self, section: Section, name: str) -> Any:  # noqa: ANN401
        value = None if name in section.refused else self.kind.read(section, name)
        return self.default if value is None else value

    def _unit(self, section: Section, name: str) -> Unit | None:
        if not callable(self.units):
            return self.variants[name]
        try:
            return self.units(name[len(self.name) + 1 :])
        except UnitError as error:
            section.complain(name, str(error))
            return None


class Said(dict[str, Any]):
    """What a section says, by the first name of each key, and the section, for complaints."""

    section: Section


def take(section: Section, keys: Sequence[Key]) -> Said:
    """All that a section says; every problem is noted with the section.

    Parameters
    ----------
    section
        Of a settings file or of sheets. A key that has been complained about before is not read.
    keys
        All that it may have, in the order in which they are read and named; every other key is a problem.
    """
    section.know(name for key in keys for name in key.names)
    for key in keys:
        if key.si:
            section.convert(key.name, {name: unit for name, unit in key.variants.items() if unit is not None})
    said = Said((key.names[0], key.value(section)) for key in keys)
    said.section = section
    section.finish()
    return said


def object_schema(keys: Sequence[Key]) -> dict[str, Any]:
    """Keys as a JSON schema of their table, each in all its units; no other key is allowed."""
    properties: dict[str, Any] = {}
    patterns: dict[str, Any] = {}
    for key in keys:
        own = {**key.kind.schema, "description": key.about.translate(_MARKED)}
        if isinstance(key.default, (bool, int, float, str)):
            own["default"] = key.default
        properties |= dict.fromkeys(key.variants, own)
        if callable(key.units):
            patterns[f"^{key.name}_"] = own
    schema: dict[str, Any] = {"type": "object", "properties": properties, "additionalProperties": False}
    if patterns:
        schema["patternProperties"] = patterns
    needed = [key for key in keys if key.required and not patterns.get(f"^{key.name}_")]
    if one := [key.name for key in needed if len(key.variants) == 1]:
        schema["required"] = one
    if several := [list(key.variants) for key in needed if len(key.variants) > 1]:
        schema["allOf"] = [{"anyOf": [{"required": [name]} for name in names]} for names in several]
    return schema


def file_schema(keys: Sequence[Key], title: str) -> dict[str, Any]:
    """Keys of a whole file as a JSON schema (draft 2020-12), for editors."""
    schema = object_schema(keys)
    schema["properties"]["schema_version"] = {
        "const": SCHEMA_VERSION,
        "description": "of the keys of this file; unstated: this one",
    }
    return {"$schema": DRAFT, "title": title, **schema}
