"""Settings of a job file (.toml), one of them changed: comments, order and line ends stay."""

from __future__ import annotations

import copy
import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from typing import Any

_MARK = "\ue000"


def settings_in(data: bytes) -> dict[str, Any]:
    """What a job file says, in types of JSON.

    Raises
    ------
    ValueError
        If it is no TOML.
    """
    return {key: _plain(value) for key, value in _loads(data.decode("utf-8-sig")).items()}


def setting(settings: Mapping[str, Any], key: Sequence[str]) -> Any:  # noqa: ANN401
    """The value of a nested key, None without one."""
    inner: Any = settings
    for part in key:
        inner = inner.get(part) if isinstance(inner, Mapping) else None
    return inner


def with_setting(settings: dict[str, Any], key: Sequence[str], new: Any) -> dict[str, Any]:  # noqa: ANN401
    """Settings with one changed, or without it and the tables that are empty then."""
    found = copy.deepcopy(settings)
    above = [inner := found]
    for part in key[:-1]:
        inner = inner.setdefault(part, {})
        if not isinstance(inner, dict):
            raise ValueError(f"{part} is no table of settings")
        above.append(inner)
    inner[key[-1]] = new
    if new is None:
        for table, part in zip(reversed(above), reversed(key), strict=True):
            if not table[part]:
                del table[part]
    return found


def changed(data: bytes, key: Sequence[str], new: Any) -> bytes:  # noqa: ANN401  any value of JSON
    """A job file with one setting changed, added, or (None) removed.

    Raises
    ------
    ValueError
        If that cannot be done without changing anything else.
    """
    text = data.decode("utf-8-sig")
    returns = "\r\n" in text and text.count("\n") == text.count("\r\n")
    plain = text.replace("\r\n", "\n") if returns else text
    expected = with_setting(_loads(text), key, new)
    for way in (_removed,) if new is None else (_added, _replaced):
        try:
            found = way(plain, key, new)
            good = _loads(found) == expected
        except (ValueError, TypeError, AttributeError, KeyError):  # tomlkit stumbles over unusual files
            continue
        if good:
            mark = "\ufeff" if data.startswith(b"\xef\xbb\xbf") else ""
            return (mark + (found.replace("\n", "\r\n") if returns else found)).encode()
    raise ValueError(f"{'.'.join(key)} cannot be changed here: change it in the job file itself")


def _loads(text: str) -> dict[str, Any]:
    return tomllib.loads(text.replace("\r\n", "\n"))


def _plain(value: Any) -> Any:  # noqa: ANN401
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_plain(entry) for entry in value]
    good = isinstance(value, (str, bool, int)) or (isinstance(value, float) and math.isfinite(value))
    return value if good else str(value)


def _item(value: Any) -> Any:  # noqa: ANN401
    import tomlkit

    if not isinstance(value, dict):
        return tomlkit.item(value)
    table = tomlkit.inline_table()
    table.update(value)
    return table


def _replaced(text: str, key: Sequence[str], new: Any) -> str:  # noqa: ANN401
    import tomlkit

    document = inner = tomlkit.parse(text)
    for part in key[:-1]:
        inner = inner.setdefault(part, {})
    inner[key[-1]] = _item(new)
    return tomlkit.dumps(document)


def _added(text: str, key: Sequence[str], new: Any) -> str:  # noqa: ANN401
    """A line for a new key below the others of its table, or a new table below those beside it."""
    import tomlkit
    from tomlkit.items import InlineTable, SingleKey, Table

    document: Any = tomlkit.parse(text)
    above, depth = [document], 0
    while depth < len(key) - 1 and key[depth] in above[-1]:
        above.append(above[-1][key[depth]])
        depth += 1
    if key[-1] in above[-1] or isinstance(above[-1], InlineTable):
        raise ValueError("there is a place for it")
    names = [SingleKey(part).as_string() for part in key]
    line = f"{names[-1]} = {_item(new).as_string()}"
    explicit = depth == len(key) - 1 and not (depth and above[-1].is_super_table())
    if not explicit:
        line = f"\n[{'.'.join(names[:-1])}]\n{line}"
    inner, last = above[-1], above[-1] if explicit and depth else None
    while inner is document or isinstance(inner, Table):  # else one that is written in several places
        body = (inner if inner is document else inner.value).body
        items = [(k, v) for k, v in body if k is not None]
        if explicit:
            items = [(k, v) for k, v in items if not isinstance(v, Table) or k.is_dotted()]
        if not items or (inner is document and not explicit):
            break
        inner = last = items[-1][1]
    if last is None:
        whole = f"{text.rstrip()}\n{line}\n" if not explicit else f"{line}\n{text}"
        return whole.lstrip("\n")
    last.trivia.trail = _MARK + last.trivia.trail
    head, tail = tomlkit.dumps(document).split(_MARK)
    return f"{head}\n{line}{tail}"


def _removed(text: str, key: Sequence[str], _: object = None) -> str:
    """Without a key, its line's comment, and tables that are empty then; other comments stay."""
    import tomlkit
    from tomlkit.items import Table

    document = inner = tomlkit.parse(text)
    for part in key[:-1]:
        inner = inner[part]
    value = inner[key[-1]]
    if isinstance(value, Table) and value:
        for name in list(value):
            text = _removed(text, [*key, name])
        return text
    if isinstance(value, Table):
        value.trivia.indent, value.trivia.trail = _MARK, _MARK
        text = re.sub(f"{_MARK}.*?{_MARK}", "", tomlkit.dumps(document), flags=re.DOTALL)
    else:
        del inner[key[-1]]
        text = tomlkit.dumps(document)
    left: Any = _loads(text)
    above = list(key[:-1])
    for part in above:
        left = left.get(part) if left is not None else None
    return _removed(text, above) if above and left == {} else text
