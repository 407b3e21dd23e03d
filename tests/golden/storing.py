"""Outcomes as files: `NAME.txt` (command, status, output, error and files as text) and `NAME.json`.

Numbers with a decimal point are stored with 12 digits: more than `golden.comparing` compares, and few enough
that another machine stores nearly the same.
"""

from __future__ import annotations

import json
import re
import shutil
import textwrap
from pathlib import Path
from typing import Any

from golden.cases import CASES, JSON, TEXT
from golden.running import run

STORED = Path(__file__).parent / "stored"
MARK = "=== "
WIDTH = 120
_LONG = re.compile(r"(?<![\w.])-?\d+\.\d{6,}(?:e[+-]?\d+)?(?![\w.])")


def shortened(text: str) -> str:
    """Decimals with 12 significant digits; a whole number keeps its point."""

    def short(found: re.Match[str]) -> str:
        number = f"{float(found[0]):.12g}"
        return number if re.search(r"[.e]", number) else number + ".0"

    return _LONG.sub(short, text)


def parts(found: dict[str, Any]) -> tuple[dict[str, str], str | None]:
    """The outcome of a case as named texts, and its JSON document."""
    first = found.get(TEXT) or found[JSON]
    texts = {"status": f"$ rotorid {found['command']}\nstatus {first['status']}"}
    if TEXT in found:
        texts["output"] = found[TEXT]["output"]
    texts["error"] = first["error"]
    if JSON in found and TEXT in found:
        other = found[JSON]
        if other["status"] != first["status"]:
            texts["status"] += f", with --json {other['status']}"
        if other["error"] != first["error"]:
            texts["error with --json"] = other["error"]
    texts["copied"] = found["copied"]
    texts |= {f"file {name}": file["content"] for name, file in found["files"].items()}
    document = found[JSON]["output"] if JSON in found else ""
    if document and not document.startswith("{"):
        texts["output with --json"], document = document, ""
    return {name: text for name, text in texts.items() if text}, document or None


def write(name: str, found: dict[str, Any], folder: Path = STORED) -> None:
    """Store the outcome of one case."""
    texts, document = parts(found)
    for text in texts.values():
        if any(line.startswith(MARK) for line in text.split("\n")):
            raise ValueError(f"{name}: a line begins with {MARK!r}")
    whole = "".join(f"{MARK}{part}\n{shortened(text)}\n" for part, text in texts.items())
    (folder / f"{name}.txt").write_text(whole, encoding="utf-8")
    if document is not None:
        (folder / f"{name}.json").write_text(_dense(shortened(document)), encoding="utf-8")


def read(name: str, folder: Path = STORED) -> tuple[dict[str, str], str | None]:
    """What `write` stored, as `parts` gives it."""
    whole = (folder / f"{name}.txt").read_text(encoding="utf-8")
    texts = {}
    for block in ("\n" + whole).split("\n" + MARK)[1:]:
        part, _, text = block.partition("\n")
        texts[part] = text
    last = list(texts)[-1]
    texts[last] = texts[last].removesuffix("\n")
    document = folder / f"{name}.json"
    return texts, document.read_text(encoding="utf-8") if document.exists() else None


def store() -> None:
    """Run all cases that are stored, and write their outcomes; what no case stores is deleted."""
    names = [name for name, case in CASES.items() if case.stored]
    outcomes = run(names)
    shutil.rmtree(STORED, ignore_errors=True)
    STORED.mkdir()
    for name in names:
        write(name, outcomes[name])
    size = sum(file.stat().st_size for file in STORED.iterdir())
    print(f"{len(names)} cases, {size / 1000:.0f} kB, {STORED}")


def _dense(document: str) -> str:
    """JSON with whatever fits on one line on one line."""
    return _lines(json.loads(document), "", 0) + "\n"


def _lines(value: Any, indent: str, taken: int) -> str:
    short = json.dumps(value, ensure_ascii=False)
    if not isinstance(value, dict | list) or len(indent) + taken + len(short) <= WIDTH:
        return short
    inner = indent + " "
    if isinstance(value, list) and not any(isinstance(item, dict | list) for item in value):
        words = [json.dumps(item, ensure_ascii=False) for item in value]
        lines = textwrap.wrap(
            ", ".join(words), WIDTH - len(inner), break_long_words=False, break_on_hyphens=False
        )
        if len(words) == sum(isinstance(item, int | float | None) for item in value):
            return "[\n" + "\n".join(inner + line for line in lines) + f"\n{indent}]"
    if isinstance(value, list):
        parts = [inner + _lines(item, inner, 1) for item in value]
    else:
        keys = [json.dumps(key, ensure_ascii=False) + ": " for key in value]
        parts = [
            inner + key + _lines(item, inner, len(key) + 1)
            for key, item in zip(keys, value.values(), strict=True)
        ]
    left, right = "[]" if isinstance(value, list) else "{}"
    return left + "\n" + ",\n".join(parts) + f"\n{indent}{right}"
