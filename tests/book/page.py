"""Every printed number beside what is computed now; examples/book/numbers.md says how they compare."""

import math
from collections import Counter
from pathlib import Path

from book.printed import STATUSES, WHY, half_unit
from book.tables import TABLES, computed, rows

PAGE = Path(__file__).parents[2] / "build" / "book" / "numbers.md"
TITLES = {
    "s_rotor": "[S] task 9.1: the rotor of 23 elements",
    "s_masses": "[S] tasks 9.1 and 9.2: its equivalent masses, formula (50)",
    "s_lessons": "[S] section 1.8 and lessons 2 to 8",
    "s_equations": "[S]: misprinted equations, at the true solution",
    "q_tables": "[Q]: quasilinearization",
    "f_record": "[F]: the record of three masses",
    "balancing": "Published balancing examples",
}
WORDS = {
    "printed": "printed in a book",
    "chosen": "chosen because it agrees",
    "elsewhere": "from elsewhere",
}


def judged():
    """(table, row, computed number or None, status) of every row."""
    found = []
    for name in TABLES:
        numbers = computed(name)
        for key, row in rows(name).items():
            found.append((name, row, numbers.get(key), row.status(numbers.get(key, math.nan))))
    return found


def sentence(every):
    """How many rows have each status."""
    n = Counter(status for *_, status in every)
    return (
        f"{len(every)} numbers: {n['agrees']} agree, {n['misprint']} are misprinted or damaged, "
        f"{n['consequence']} follow from a misprint, {n['differs']} differ; {n['given']} are given, "
        f"{n['not compared']} not compared"
    )


def _cells(*cells):
    return f"| {' | '.join(map(str, cells))} |"


def _table(head, body):
    return [_cells(*head), _cells(*["---"] * len(head)), *(_cells(*line) for line in body), ""]


def _shown(row, value):
    """A computed number with two digits more than its tolerance tells apart."""
    if value is None:
        return "–"
    fine = min(row.allowed, *(half_unit(text) for text in (row.corrected,) if text), row.allowed)
    decimals = 1 - math.floor(math.log10(fine))
    value = round(value, decimals)
    digits = math.floor(math.log10(abs(value))) + decimals + 1 if value else 1
    return f"{value:.{max(digits, 1)}g}"


def _plain(text):
    for mark in "*_[]<|":
        text = text.replace(mark, f"\\{mark}")
    return text


def _source(source, part):
    notes = list(dict.fromkeys(row.note for row, *_ in part if row.note))
    body = []
    for row, value, status in part:
        words = status if row.why == "printed" else f"{status}, {row.why}"
        words += ", bound" if row.kind == "bound" else ""
        words += f" ({notes.index(row.note) + 1})" if row.note else ""
        body.append((_plain(row.quantity), row.printed, _shown(row, value), words))
    listed = [f"({i}) {_plain(note)}\n" for i, note in enumerate(notes, 1)]
    return [f"### {source}\n", *_table(("quantity", "printed", "computed", "status"), body), *listed]


def generated():
    """The page."""
    every = judged()
    shown = Counter((row.why, status) for _, row, _, status in every)
    head = ("", *STATUSES, "all")
    counts = [
        (WORDS[why], *(shown[why, s] for s in STATUSES), sum(shown[why, s] for s in STATUSES)) for why in WHY
    ]
    counts.append(("all", *(sum(shown[w, s] for w in WHY) for s in STATUSES), len(every)))
    lines = [
        "# Every printed number beside what is computed now\n",
        f"{sentence(every)}.\n",
        *_table(head, counts),
    ]
    for name in TABLES:
        lines.append(f"## {TITLES[name]}\n")
        sources = {}
        for table, row, value, status in every:
            if table == name:
                sources.setdefault(row.source, []).append((row, value, status))
        for source, part in sources.items():
            lines += _source(source, part)
    return "\n".join(lines).rstrip("\n") + "\n"


def write():
    """Write the page, and say where it is."""
    PAGE.parent.mkdir(parents=True, exist_ok=True)
    PAGE.write_text(generated(), encoding="utf-8")
    print(f"{sentence(judged())}:\n{PAGE}")
