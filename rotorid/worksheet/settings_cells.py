"""Settings of a job file (.toml), one of them changed: comments, order and line ends stay."""

from __future__ import annotations

import copy
import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

_MARK = "\ue000"


def settings_in(data: bytes) -> dict[str, Any]:
    """What a job file says, in types of JSON; ValueError if it is no TOML."""
    try:
        plain = json.dumps(_loads(data.decode("utf-8-sig")), default=str)
        return dict(json.loads(plain, parse_constant=str))
    except RecursionError as error:
        raise ValueError(str(error)) from error


def setting(settings: Mapping[str, Any], key: Sequence[str]) -> Any:  # noqa: ANN401  any type of JSON
    """The value of a nested key, None without one."""
    inner: Any = settings
    for part in key:
        inner = inner.get(part) if isinstance(inner, Mapping) else None
    return inner


def with_setting(settings: dict[str, Any], key: Sequence[str], new: Any) -> dict[str, Any]:  # noqa: ANN401
    """Settings with one changed, or (None) without it and the tables that are empty then."""
    found = copy.deepcopy(settings)
    above = [found]
    for part in key[:-1]:
        above.append(above[-1].setdefault(part, {}))
    above[-1][key[-1]] = new
    for table, part in zip(reversed(above), reversed(key), strict=True):
        if new is None and not table[part]:
            del table[part]
    return found


def changed(data: bytes, key: Sequence[str], new: Any) -> bytes:  # noqa: ANN401
    """A job file with a setting changed, added, or (None) removed; ValueError where that is impossible."""
    text = data.decode("utf-8-sig")
    returns = "\r\n" in text and text.count("\n") == text.count("\r\n")
    plain = text.replace("\r\n", "\n") if returns else text
    for way in (_removed,) if new is None else (_put, _append):
        with suppress(ValueError, TypeError, AttributeError, LookupError):  # tomlkit stumbles over odd files
            found = way(plain, key, new)
            if _loads(found) == with_setting(_loads(text), key, new):
                found = found.replace("\n", "\r\n") if returns else found
                return found.encode("utf-8-sig" if data.startswith(b"\xef\xbb\xbf") else "utf-8")
    raise ValueError(f"{'.'.join(key)} cannot be changed here: change it in the job file itself")


def _loads(text: str) -> dict[str, Any]:
    return tomllib.loads(text.replace("\r\n", "\n"))


def _item(value: Any) -> Any:  # noqa: ANN401
    import tomlkit

    if not isinstance(value, dict):
        return tomlkit.item(value)
    table = tomlkit.inline_table()
    table.update(value)
    return table


def _put(text: str, key: Sequence[str], new: Any) -> str:  # noqa: ANN401
    """With a value; comments above what follows a new line or table stay there."""
    import tomlkit

    found = tomlkit.dumps(with_setting(tomlkit.parse(text), key, _item(new)))
    old, lines = text.split("\n"), found.split("\n")
    at = next((i for i, pair in enumerate(zip(old, lines, strict=False)) if pair[0] != pair[1]), len(old))
    end = at + len(lines) - len(old)
    block = [line for line in lines[at:end] if line]
    if not block or lines[end:] != old[at:]:
        return found
    while at and re.match(r"\s*(#|$)", old[at - 1]):
        at -= 1
    return "\n".join([*old[:at], *([""] if at and block[0][0] == "[" else []), *block, *old[at:]])


def _append(text: str, key: Sequence[str], new: Any) -> str:  # noqa: ANN401
    import tomlkit

    return f"{text.rstrip()}\n\n{tomlkit.dumps(with_setting({}, key, _item(new)))}"


def _removed(text: str, key: Sequence[str], _: object = None) -> str:
    """Without a key, its line's comment, and tables that are empty then; other comments stay."""
    import tomlkit
    from tomlkit.items import Table

    document = tomlkit.parse(text)
    inner: Any = setting(document, key[:-1])
    value = inner[key[-1]]
    if isinstance(value, Table) and value:
        for name in list(value):
            text = _removed(text, [*key, name])
        return text
    if isinstance(value, Table):
        value.trivia.indent = value.trivia.trail = _MARK
    else:
        del inner[key[-1]]
    text = re.sub(f"{_MARK}.*?{_MARK}", "", tomlkit.dumps(document), flags=re.DOTALL)
    above = key[:-1]
    return _removed(text, above) if above and setting(_loads(text), above) == {} else text
