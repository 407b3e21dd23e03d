"""Settings as TOML: read, and written with matrices row by row."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from rotorid.base.json import SCHEMA_VERSION
from rotorid.files.disk import read_bytes
from rotorid.files.problems import Problems

MOST_BYTES = 2_000_000
_DEEP = re.compile(r"""(?<![\w"'-])(?:[\w"'-]++[ \t]*+\.[ \t]*+){20}""")
"""A key of so many parts; the time that tomllib takes grows with their square."""
MOST_NAMES = 1_000


def read_toml(path: Path, problems: Problems) -> dict[str, Any] | None:
    """The content of a TOML file without its `schema_version`, or None and a problem."""
    data = read_bytes(path, problems)
    if data is None:
        return None
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
        problems.add(str(path), None, None, None, "a text file in UTF-8, as TOML demands")
    except (ValueError, RecursionError) as error:
        problems.add(str(path), None, None, None, f"a TOML file: {error}")
    else:
        problems.refuse_newer(str(path), settings.pop("schema_version", SCHEMA_VERSION))
        return settings
    return None


def toml_bytes(data: Mapping[str, Any], comments: Iterable[str] = ()) -> bytes:
    """A file of settings, with comment lines at the top; numbers keep all their digits, empty parts go.

    Raises
    ------
    ValueError
        For a name that is no Unicode text.
    """
    import tomli_w

    lines = [f"# {part}" for line in comments for part in line.splitlines() or [""]]
    lines.append(f"schema_version = {SCHEMA_VERSION}")
    tables = {}
    for name, part in data.items():
        rows = part if isinstance(part, list) else []
        if isinstance(part, dict) or (rows and isinstance(rows[0], dict)):
            tables[name] = part
        elif rows and isinstance(rows[0], list):
            lines += [f"{name} = [", *(f"  {json.dumps(row)}," for row in rows), "]"]
        else:
            lines.append(f"{name} = {json.dumps(part)}")
    return "\n".join([*lines, "", tomli_w.dumps(tables)]).encode()
