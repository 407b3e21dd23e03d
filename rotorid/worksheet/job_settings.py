"""Keys of a job file (.toml), one of them changed: comments and order stay."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

_LISTS = ("available", "stock", "holes_")
"""Settings that are lists, however few values they have."""
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")


def settings_in(data: bytes) -> dict[str, Any]:
    """What a job file holds, in types of JSON; ValueError if it is no TOML."""
    try:
        plain = json.dumps(tomllib.loads(data.decode("utf-8-sig").replace("\r\n", "\n")), default=str)
        return dict(json.loads(plain, parse_constant=str))
    except RecursionError as error:
        raise ValueError(str(error)) from error


def setting(settings: Mapping[str, Any], key: Sequence[str]) -> Any:  # noqa: ANN401  any type of JSON
    """The value of a nested key, None without one."""
    inner: Any = settings
    for part in key:
        inner = inner.get(part) if isinstance(inner, Mapping) else None
    return inner


def text_of(value: object) -> str:
    """A setting as one types it: a list "5; 10", values by name "3000: 20; 4500: 30"."""
    if isinstance(value, Mapping):
        return "; ".join(f"{key}: {text_of(one)}" for key, one in value.items())
    if isinstance(value, list):
        return "; ".join(map(text_of, value))
    return "" if value is None else str(value).removesuffix(".0")


def value_of(key: str, text: str) -> Any:  # noqa: ANN401
    """The setting that was typed; None for nothing."""
    parts = [part.strip() for part in text.split(";") if part.strip()]
    if ":" in text:
        return {name.strip(): _one(value) for name, _, value in (part.partition(":") for part in parts)}
    values = [*map(_one, parts)]
    if len(values) > 1 or (values and key.startswith(_LISTS)):
        return values
    return values[0] if values else None


def _one(word: str) -> float | str:
    number = word.strip().replace(",", ".")
    if not _NUMBER.fullmatch(number):
        return word.strip()
    return int(number) if number.lstrip("+-").isdigit() else float(number)


def with_setting(data: bytes, key: Sequence[str], new: Any) -> bytes:  # noqa: ANN401
    """The job file with a setting changed, added, or (None) removed; ValueError where that is impossible."""
    import tomlkit

    settings = settings_in(data)
    with suppress(ValueError, TypeError, AttributeError, LookupError):  # tomlkit stumbles over odd files
        document = tomlkit.parse(data.decode("utf-8-sig"))
        _change(settings, key, new)
        _change(document, key, new)
        written = tomlkit.dumps(document).encode()
        if settings_in(written) == settings:
            return written
    raise ValueError(f"{'.'.join(key)} cannot be changed here: change it in the job file itself")


def _change(settings: Any, key: Sequence[str], new: Any) -> None:  # noqa: ANN401
    """Change one setting, or (None) remove it and the tables that are empty then."""
    above = [settings]
    for part in key[:-1]:
        above.append(above[-1].setdefault(part, {}))
    above[-1][key[-1]] = {} if new is None else new
    for table, part in zip(reversed(above), reversed(key), strict=True):
        if new is None and not table[part]:
            del table[part]
