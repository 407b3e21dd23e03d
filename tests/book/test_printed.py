"""Every printed number beside what is computed now, a test a printed table; the rule, and the page."""

import math
import tomllib
from collections import Counter
from pathlib import Path

import pytest

from book.page import generated, judged, sentence
from book.printed import NUMBER, WHY, Row, half_unit
from book.tables import TABLES, computed, rows
from rotorid.samples import sample_data

COURSE = Path(__file__).parents[2] / "examples" / "book"
SOURCES = {row.source: name for name in TABLES for row in rows(name).values()}
EVERY = [row for name in TABLES for row in rows(name).values()]


@pytest.mark.parametrize("source", SOURCES)
def test_printed_numbers(source):
    numbers = computed(SOURCES[source])
    differ = [
        (row.quantity, row.printed, numbers.get(key), row.note)
        for key, row in rows(SOURCES[source]).items()
        if row.source == source and row.status(numbers.get(key, math.nan)) == "differs"
    ]
    assert differ == []


@pytest.mark.parametrize("name", TABLES)
def test_what_is_computed_is_what_the_table_has(name):
    compared = {key for key, row in rows(name).items() if row.kind != "not compared"}
    assert set(computed(name)) == compared


# the tables


def test_the_columns_are_filled_as_the_rules_say():
    errata = {f"{row.source}: {row.quantity}" for row in EVERY if row.erratum and not row.follows}
    for row in EVERY:
        assert row.why in WHY, row
        assert row.kind in ("", "bound", "given", "not compared"), row
        assert not row.erratum or len(row.erratum.split()) >= 4, row
        assert not row.reason or len(row.reason.split()) >= 4, row
        if row.kind == "not compared":
            assert row.reason, row
            continue
        assert NUMBER.fullmatch(row.printed), row
        assert bool(row.tolerance) == bool(row.reason), row
        assert not row.corrected or row.erratum, row
        assert not row.follows or row.follows in errata, row


def test_no_tolerance_is_wider_than_its_numbers_need():
    """Wider than half a unit only where a number of its source and reason needs it, by a tenth at least."""
    wide = {}
    for name in TABLES:
        for key, row in rows(name).items():
            if row.kind != "not compared" and row.allowed > half_unit(row.printed):
                assert row.allowed < 0.1 * abs(float(row.printed)), row
                off = abs(computed(name)[key] - float(row.printed))
                wide.setdefault((row.source, row.reason), []).append((row, off))
    assert len(wide) >= 20
    for part in wide.values():
        assert any(off > half_unit(row.printed) for row, off in part), part[0]
        rounding = all(row.allowed < 1e-9 * abs(float(row.printed)) for row, _ in part)
        assert rounding or any(off > 0.1 * row.allowed for row, off in part), part[0]


def test_the_estimates_that_the_samples_quote_are_those_of_the_table():
    book = {(row.source, row.quantity.split(",")[0]): row.printed for row in rows("s_lessons").values()}
    quoted = 0
    for path in sorted((sample_data() / "identify").glob("*/expected.toml")):
        expected = tomllib.loads(path.read_text(encoding="utf-8"))
        kind, *numbers = path.parent.name.split("_")
        for name, text in (expected.get("printed", {}) | expected.get("printed_combinations", {})).items():
            assert book[f"[S] {kind} {'.'.join(numbers)}", f"estimate of {name}"] == text
            quoted += 1
    assert quoted == 26


# the rule


@pytest.mark.parametrize(
    ("text", "half"),
    [
        ("135.2394", 5e-5),
        ("1.003e4", 5.0),
        ("8.92e-8", 5e-11),
        ("-1.119810467E-1", 5e-11),
    ],
)
def test_half_a_unit_of_the_last_printed_digit(text, half):
    assert half_unit(text) == half
    for part, status in ((0.999, "agrees"), (-1, "agrees"), (1.001, "differs"), (math.nan, "differs")):
        assert Row("", "", text, "printed").status(float(text) + part * half) == status


@pytest.mark.parametrize(
    ("columns", "computed", "status"),
    [
        ({"erratum": "wrong"}, 2.0, "misprint"),
        ({"erratum": "wrong"}, 1.04, "differs"),  # agrees with the print: no erratum
        ({"erratum": "wrong", "corrected": "2.0"}, 2.04, "misprint"),
        ({"erratum": "wrong", "corrected": "2.0"}, 2.06, "differs"),
        ({"erratum": "wrong", "corrected": "2.0", "follows": "another"}, 2.04, "consequence"),
        ({"tolerance": "0.5"}, 1.4, "agrees"),
        ({"kind": "bound"}, 0.2, "agrees"),
        ({"kind": "bound"}, 1.01, "differs"),
        ({"kind": "bound", "erratum": "rounded down", "corrected": "1.01"}, 1.01, "misprint"),
        ({"kind": "given"}, 1.1, "differs"),
        ({"kind": "not compared"}, math.nan, "not compared"),
    ],
)
def test_the_status_of_a_number(columns, computed, status):
    assert Row("", "", "1.0", "printed", **columns).status(computed) == status


# the page


def test_the_page_has_every_number_once():
    lines = [line for line in generated().splitlines() if line.count(" | ") == 3]
    assert sum(line.endswith("status |") for line in lines) == len(SOURCES)
    assert len(lines) == len(EVERY) + 2 * len(SOURCES)  # a heading and a rule each


def test_the_course_says_what_the_page_says():
    every = judged()
    assert sentence(every) in (COURSE / "README.md").read_text(encoding="utf-8")
    assert Counter(status for *_, status in every)["differs"] == 0
