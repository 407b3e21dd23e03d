"""Settings as TOML, with matrices row by row."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any

from rotorid.base.json import SCHEMA_VERSION


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
