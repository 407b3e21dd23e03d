"""`{validation}`, `{benchmarks}`, `{answers}`: tables of what the program computes, made with the pages."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from docutils import nodes
from pieces import paragraph, section, table
from sphinx.util.docutils import SphinxDirective

if TYPE_CHECKING:
    from sphinx.application import Sphinx

STORED = Path(__file__).parents[1] / "benchmarks.json"
OUTPUTS = Path(__file__).parents[2] / "tests" / "golden" / "stored"
ANSWERS = (
    *(
        "turbo",
        "holes-plot",
        "checked",
        "turbo-limit",
        "model-job",
        "rk4",
        "unbalance-model-job",
        "split-holes",
    ),
    *("fleet-add", "fleet-show", "fleet-fit"),
    *("split-drill", "trial-weight", "tolerance", "critical-rotor23", "campbell-compressor"),
    *(
        "response-compressor",
        "influence-compressor",
        "study",
        "bearings",
        "motion",
        "periodic-jumps",
        "reduce-report",
        "reduce-rank",
        "identify-task_5_1",
    ),
    *(
        "identify-task_4_1",
        "identify-two-models",
        "fit-run_down",
        "simulate-lesson-5",
        "modes-chain",
        "vectors",
        "runup-record",
        "calibrate",
        "validate",
        "demo-main",
    ),
)
"""Stored outputs that `{answers}` counts: those of every command on its sample."""


class ValidationTable(SphinxDirective):
    """Every printed number of the references beside what is computed now, as `rotorid validate` has them."""

    def run(self) -> list[nodes.Node]:
        """One table per source."""
        from rotorid.validation import validate

        return validation_nodes(validate().to_dict()["rows"])


def validation_nodes(rows: Sequence[Mapping[str, Any]]) -> list[nodes.Node]:
    """Counts, and a section with a table for every source, in the order of the rows."""
    sources: dict[str, list[Mapping[str, Any]]] = {}
    for row in rows:
        sources.setdefault(row["source"], []).append(row)
    count = Counter(row["status"] for row in rows)
    wrong = [row for row in rows if row["status"] == "differs"]
    if wrong:
        raise ValueError(f"validation: {wrong[0]['source']}, {wrong[0]['quantity']}: {wrong[0]['status']}")
    head = paragraph(
        f"{len(rows) - count['given']} numbers can fail: {count['agrees']} agree, {count['erratum']} are "
        f"misprints, {count['consequence']} follow from these; {count['given']} more are given values."
    )
    return [head, *(_source(source, group) for source, group in sources.items())]


def _status(row: Mapping[str, Any]) -> str:
    """With the kind where the status does not tell it."""
    kind = row.get("kind", "number")
    return f"{row['status']}, {kind}" if kind in ("bound", "selected") else row["status"]


def _source(source: str, rows: Sequence[Mapping[str, Any]]) -> nodes.section:
    notes = list(dict.fromkeys(row["note"] for row in rows if row["note"]))
    lines = [
        (
            str(row["quantity"]),
            str(row.get("printed_text", row["printed"])).replace("-", "\N{MINUS SIGN}"),
            number(row["computed"], 8),
            number(row["difference"], 2),
            number(row["tolerance"], 2),
            _status(row) + (f" ({notes.index(row['note']) + 1})" if row["note"] else ""),
        )
        for row in rows
    ]
    head = ("quantity", "printed", "computed", "difference", "tolerance", "status")
    out = section(source, f"validation {source}", table(head, lines))
    if notes:
        items = (nodes.list_item("", paragraph(note)) for note in notes)
        out += nodes.enumerated_list("", *items, enumtype="arabic", prefix="(", suffix=")")
    return out


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


class AnswerTable(SphinxDirective):
    """How long the answers of the commands are, from the stored outputs with which the tests compare."""

    def run(self) -> list[nodes.Node]:
        """The table."""
        for name in ANSWERS:
            self.env.note_dependency(str(OUTPUTS / f"{name}.txt"))
        return [table(("command", "lines", "width"), [answer_row(name) for name in ANSWERS])]


def answer_row(name: str) -> tuple[str, str, str]:
    """The command of a stored output, how many lines it prints, and the columns of the widest."""
    stored = (OUTPUTS / f"{name}.txt").read_text(encoding="utf-8")
    status, _, rest = stored.removeprefix("=== status\n$ ").partition("\n=== output\n")
    lines = rest.partition("\n=== ")[0].rstrip("\n").splitlines()
    return f"`{status.splitlines()[0]}`", str(len(lines)), str(max(map(len, lines)))


def number(value: float | None, digits: int) -> str:
    """A number with so many digits and a real minus; a dash where there is none."""
    if value is None:
        return "\N{EN DASH}"
    return f"{value:.{digits}g}".replace("-", "\N{MINUS SIGN}")


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directives."""
    app.add_directive("validation", ValidationTable)
    app.add_directive("benchmarks", BenchmarkTable)
    app.add_directive("answers", AnswerTable)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
