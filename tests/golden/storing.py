"""Outcomes as files: `NAME.json`, one line a key, of a document; `refused.json` of the refusals."""

from __future__ import annotations

import json
import re
import shutil
from functools import cache
from pathlib import Path
from typing import Any

from golden.cases import REFUSED, STORED
from golden.document import Arrays, arrays, rounded, thinned
from golden.running import run

FOLDER = Path(__file__).parent / "stored"
REFUSALS = "refused"
PLACE = re.compile(
    r"^rotorid: (?P<place>[^\s:]+\.\w+( \(sheet '[^']*'\))?(, (row|column|key) [^,:]+)*):", re.MULTILINE
)


def place(error: str) -> str:
    """File, sheet, row, column or key that a complaint names; empty where it is about none."""
    words = PLACE.search(error)
    return words["place"] if words else ""


def document(outcome: dict[str, Any]) -> Arrays:
    """Status and document of an outcome as arrays; of one without a document, the place of its complaint."""
    output = outcome["output"]
    if output.startswith("{"):
        return {"exit status": outcome["status"]} | arrays(json.loads(output))
    return {"exit status": outcome["status"], "place": place(outcome["error"])}


def storable(name: str, outcome: dict[str, Any]) -> Arrays:
    """What is stored of an outcome."""
    return {key: thinned(values) for key, values in document(outcome).items()}


@cache
def _refusals() -> dict[str, Arrays]:
    return json.loads((FOLDER / f"{REFUSALS}.json").read_text(encoding="utf-8"))


def read(name: str) -> Arrays:
    """What is stored of a case."""
    if name in REFUSED:
        return _refusals()[name]
    return json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))


def written(table: dict[str, Any]) -> str:
    """JSON with one line a key."""
    lines = [
        f"{json.dumps(k, ensure_ascii=False)}: {json.dumps(v, ensure_ascii=False)}" for k, v in table.items()
    ]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def store() -> None:
    """Run the cases that are stored, and write their outcomes; what no case stores is deleted."""
    outcomes = run([*STORED, *REFUSED])
    tables = {name: rounded(storable(name, outcomes[name])) for name in STORED}
    tables[REFUSALS] = {name: storable(name, outcomes[name]) for name in REFUSED}
    shutil.rmtree(FOLDER, ignore_errors=True)
    FOLDER.mkdir()
    for name, table in tables.items():
        (FOLDER / f"{name}.json").write_text(written(table), encoding="utf-8")
    size = sum(file.stat().st_size for file in FOLDER.iterdir())
    seconds = sum(outcome.get("seconds", 0) for outcome in outcomes.values())
    count = f"{len(STORED)} documents, {len(REFUSED)} refusals"
    print(f"{count}, {size / 1000:.0f} kB, {seconds:.0f} s of processor")
