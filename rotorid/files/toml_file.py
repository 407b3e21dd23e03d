"""Settings (.toml files and settings sheets): every key is checked, none is passed over."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.base.versions import SCHEMA_VERSION
from rotorid.files.cells import read_bytes
from rotorid.files.decimal_numbers import LARGEST
from rotorid.files.problems import Problems
from rotorid.files.units import Unit

MOST_BYTES = 2_000_000
_DEEP = re.compile(r"""(?<![\w"'-])(?:[\w"'-]++[ \t]*+\.[ \t]*+){20}""")
"""A key of so many parts; the time that tomllib takes grows with their square."""
MOST_NAMES = 1_000


def read_toml(path: Path, problems: Problems) -> dict[str, Any] | None:
    """The content of a TOML file without its `schema_version`, or None and a problem."""
    data = read_bytes(path, problems)
    if data is None:
        return None
    if len(data) > MOST_BYTES:
        problems.add(str(path), None, None, None, f"a TOML file of at most {MOST_BYTES // 10**6} MB")
        return None
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        problems.add(str(path), None, None, None, "a text file in UTF-8, as TOML demands")
        return None
    if not text.strip():
        problems.add(str(path), None, None, None, "a TOML file with settings; the file is empty")
        return None
    try:
        if _DEEP.search(text):
            raise ValueError("a key of more than 20 parts")
        # A lone carriage return ends a line for no reader of TOML.
        said = tomllib.loads(text.replace("\r\n", "\n"))
    except (ValueError, RecursionError) as error:
        problems.add(str(path), None, None, None, f"a TOML file: {error}")
        return None
    problems.refuse_newer(str(path), said.pop("schema_version", SCHEMA_VERSION))
    return said


class Section:
    """Some settings, taken one by one; `finish` complains about those that nobody took.

    Parameters
    ----------
    source
        The file, for messages.
    data
        Keys and values.
    problems
        Collects the complaints.
    prefix
        Of the keys, for messages ("errors.").
    where
        Row and column of keys that stand in a sheet.
    """

    def __init__(
        self,
        source: str,
        data: Mapping[str, Any],
        problems: Problems,
        prefix: str = "",
        where: Mapping[str, tuple[str, int, str]] | None = None,
    ) -> None:
        self.source = source
        self._data = data
        self._problems = problems
        self._prefix = prefix
        self._where = where or {}
        self._taken: list[str] = []
        self._known: list[str] = []
        self._written: dict[str, tuple[str, Any]] = {}
        self.refused: set[str] = set()

    def __contains__(self, key: str) -> bool:
        return key in self._data

    @property
    def keys(self) -> tuple[str, ...]:
        """All keys, taken or not."""
        return tuple(self._data)

    def place(self, name: str) -> tuple[str, int | None, str]:
        """File or sheet, row and column of a setting given by its whole dotted name."""
        return self._where.get(name, (self.source, None, name))

    def complain(self, key: str, expected: str, *, value: bool = True) -> None:
        """Note a problem with a key, which is one of the `refused` then."""
        self.refused.add(key)
        key, written = self._written.get(key, (key, self._data.get(key)))
        found = _shown(written) if value and written is not None else None
        name = f"{self._prefix}{key}"
        source, row, column = self.place(name)
        self._problems.add(source, row, column, found, expected)

    def convert(self, key: str, variants: Mapping[str, Unit]) -> None:
        """Put what is written in another unit, one of `variants`, at the key in SI."""
        present = [name for name in self._data if name in variants]
        for name in present[1:]:
            self.complain(name, f"one key of them; {present[0]} says it already")
        for name in present[:1] if present != [key] else ():
            written, unit = self._data[name], variants[name]
            self._written[key] = name, written
            items = written if isinstance(written, list) else [written]
            numbers = [
                unit.to_si(x) if isinstance(x, (int, float)) and type(x) is not bool else x for x in items
            ]
            rest = {k: v for k, v in self._data.items() if k not in present or k in self.refused}
            self._data = {**rest, key: numbers if isinstance(written, list) else numbers[0]}

    def take(self, key: str) -> Any:  # noqa: ANN401  whatever the file holds
        """The value as it is, None if there is none."""
        self._taken.append(key)
        return self._data.get(key)

    def know(self, names: Iterable[str]) -> None:
        """Name these as the known keys; without them it is those that are taken."""
        self._known.extend(names)

    def number(
        self, key: str, default: float | None = None, *, low: float = -math.inf, high: float = math.inf
    ) -> float | None:
        """A finite number within limits."""
        value = self.take(key)
        if value is None:
            return default
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            self.complain(
                key,
                "a number"
                if not isinstance(value, str)
                else "a number, without quotes (in a sheet: not as text)",
            )
        elif not _finite(value) or not low <= value <= high:
            self.complain(key, _range(low, high))
        elif abs(value) > LARGEST:
            self.complain(key, f"a number up to {LARGEST:g} in size")
        else:
            return float(value)
        return default

    def text(self, key: str) -> str | None:
        """A text that is not empty."""
        value = self.take(key)
        if value is None:
            return None
        if not isinstance(value, str) or not value.strip():
            self.complain(key, "a text in quotes")
            return None
        return value.strip()

    def name(self, key: str) -> str:
        """A text exactly as it stands; empty if there is none."""
        value = self.take(key)
        if value is not None and not isinstance(value, str):
            self.complain(key, "a text in quotes")
        return value if isinstance(value, str) else ""

    def section(self, key: str) -> Section | None:
        """A table of settings, None if there is none."""
        value = self.take(key)
        if value is None:
            return None
        if not isinstance(value, dict):
            self.complain(key, f"a table of settings, [{self._prefix}{key}]")
            return None
        return Section(self.source, value, self._problems, f"{self._prefix}{key}.", self._where)

    def sections(self, key: str) -> list[Section]:
        """An array of tables, [[key]]."""
        value = self.take(key)
        if value is None:
            return []
        if not isinstance(value, list) or not all(isinstance(item, dict) for item in value):
            self.complain(key, f"tables that begin with [[{self._prefix}{key}]]")
            return []
        return [
            Section(self.source, item, self._problems, f"{self._prefix}{key}[{i}].")
            for i, item in enumerate(value, start=1)
        ]

    def named(self, key: str) -> dict[str, Section]:
        """Tables with names, [key.NAME]."""
        outer = self.section(key)
        if outer is None:
            return {}
        inner = {name: outer.section(name) for name in outer._data}
        return {name: section for name, section in inner.items() if section is not None}

    def limit_names(self) -> None:
        """Complain about every list and table of a model with more names than can be worked with."""
        for key, value in self._data.items():
            if isinstance(value, (list, dict)) and len(value) > MOST_NAMES:
                self.complain(key, f"at most {MOST_NAMES:,} names; these are {len(value):,}", value=False)

    def missing(self, key: str, expected: str) -> None:
        """Note that a key is missing."""
        self.complain(key, expected, value=False)

    def refuse(self, expected: str) -> None:
        """Note a problem with these settings as a whole."""
        source, row, column = self.place(self._prefix.rstrip("."))
        self._problems.add(source, row, column or None, None, expected)

    def finish(self) -> None:
        """Complain about every key that nobody took."""
        names = self._known or self._taken
        for key in self._data:
            if key not in self._taken and key not in self.refused:
                hint = did_you_mean(key, names)
                known = listing(names, "and") or "none yet"
                # nothing is printed of a file of something else
                shown = bool(self._prefix or hint) or any(name in self._data for name in self._taken)
                self.complain(key, f"a known key{hint}; known are {known}", value=shown)


def _finite(value: float) -> bool:
    try:
        return math.isfinite(float(value))
    except OverflowError:
        return False


def _range(low: float, high: float) -> str:
    if low == -math.inf and high == math.inf:
        return "a finite number"
    if high == math.inf:
        return f"a finite number, {low:g} or more" if low >= 1e-9 or low == 0 else "a number above 0"
    return f"a number from {low:g} to {high:g}"


def _shown(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return "a table" if isinstance(value, dict) else str(value)
