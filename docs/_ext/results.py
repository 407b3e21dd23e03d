"""`{benchmarks}`: a table of what the program computes, made with the pages."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from docutils import nodes
from pieces import paragraph, table
from sphinx.util.docutils import SphinxDirective

if TYPE_CHECKING:
    from sphinx.application import Sphinx

STORED = Path(__file__).parents[1] / "benchmarks.json"


class BenchmarkTable(SphinxDirective):
    """What the last `make bench-all` measured, from docs/benchmarks.json."""

    def run(self) -> list[nodes.Node]:
        """The machine and the table, or a sentence that nothing is stored."""
        self.env.note_dependency(str(STORED))
        if not STORED.exists():
            return [paragraph("No measurement is stored here; `make bench-all` makes one on your machine.")]
        return benchmark_nodes(json.loads(STORED.read_text(encoding="utf-8")))


def benchmark_nodes(document: Mapping[str, Any]) -> list[nodes.Node]:
    """Where it was measured, and one line per comparison; refused if answers differed."""
    differing = [row["task"] for row in document["rows"] if row["difference"] > row["allowed"]]
    if differing:
        raise ValueError(f"benchmarks: the answers differ in {', '.join(differing)}")
    lines = [
        (
            f"{row['task']}, {row['ours']}" + (f" ({row['note']})" if row.get("note") else ""),
            number(1e3 * row["our_seconds"], 3),
            row["peer"],
            number(1e3 * row["peer_seconds"], 3),
            number(row["peer_seconds"] / row["our_seconds"], 3),
            number(row["difference"], 2),
        )
        for row in document["rows"]
    ]
    head = ("task", "ms", "compared with", "its ms", "ratio", "difference of the answers")
    return [paragraph(f"Measured with {document['machine']}."), table(head, lines)]


def number(value: float | None, digits: int) -> str:
    """A number with so many digits and a real minus; a dash where there is none."""
    if value is None:
        return "\N{EN DASH}"
    return f"{value:.{digits}g}".replace("-", "\N{MINUS SIGN}")


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directives."""
    app.add_directive("benchmarks", BenchmarkTable)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
