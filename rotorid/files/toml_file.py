"""Settings (.toml files and settings sheets): every key is checked, none is passed over."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from rotorid.base.json import SCHEMA_VERSION
from rotorid.files.cells import read_bytes
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
