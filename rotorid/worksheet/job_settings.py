"""Keys of a job file (.toml), one of them changed: comments and order stay."""

from __future__ import annotations

import copy
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
    if len(parts) > 1 or (parts and key.startswith(_LISTS)):
        return [_one(part) for part in parts]
    return _one(parts[0]) if parts else None


def _one(word: str) -> float | str:
    word, number = word.strip(), word.strip().replace(",", ".")
    if not _NUMBER.fullmatch(number):
        return word
    return int(number) if number.lstrip("+-").isdigit() else float(number)


def with_setting(data: bytes, key: Sequence[str], new: Any) -> bytes:  # noqa: ANN401
    """The job file with a setting changed, added, or (None) removed; ValueError where that is impossible."""
    text = data.decode("utf-8-sig")
    for way in (_at_its_place, _at_an_end):
        with suppress(ValueError, TypeError, AttributeError, LookupError):  # tomlkit stumbles over odd files
            written = way(text, key, new)
            if settings_in(written.encode()) == _changed(settings_in(data), key, new):
                return written.encode("utf-8-sig" if data.startswith(b"\xef\xbb\xbf") else "utf-8")
    raise ValueError(f"{'.'.join(key)} cannot be changed here: change it in the job file itself")


def _at_its_place(text: str, key: Sequence[str], new: Any) -> str:  # noqa: ANN401
    import tomlkit

    settings = tomlkit.parse(text)
    if len(key) == 1 and key[0] not in settings:
        return _at_an_end(text, key, new)
    return tomlkit.dumps(_changed(settings, key, _item(new)))


def _at_an_end(text: str, key: Sequence[str], new: Any) -> str:  # noqa: ANN401
    """A new table below all, another setting above the first: a comment above a table stays there."""
    import tomlkit

    added = tomlkit.dumps(_changed({}, key, _item(new)))
    if len(key) > 1:
        return f"{text.rstrip()}\n\n{added}"
    first = re.search(r"^[^#\s]", text, re.MULTILINE)
    at = first.start() if first else len(text)
    return text[:at] + added + text[at:]


def _item(value: Any) -> Any:  # noqa: ANN401
    import tomlkit

    if not isinstance(value, dict):
        return None if value is None else tomlkit.item(value)
    table = tomlkit.inline_table()
    table.update(value)
    return table


def _changed(settings: Any, key: Sequence[str], new: Any) -> Any:  # noqa: ANN401
    """Settings with one changed, or (None) without it and the tables that are empty then."""
    top = copy.deepcopy(settings)
    above = [top]
    for part in key[:-1]:
        above.append(above[-1].setdefault(part, {}))
    above[-1][key[-1]] = {} if new is None else new
    for table, part in zip(reversed(above), reversed(key), strict=True):
        if new is None and not table[part]:
            del table[part]
    return top
