"""docs/files.md names every column and every key that the readers know."""

import re
from pathlib import Path

from cases import each_of
from keys_in_files import with_tables

from rotorid.files import bearing, influence, modes, rotor, runs, unbalance, weights
from rotorid.files import job_excel as jobbook
from rotorid.files import job_models as jobkeys
from rotorid.identify.expressions import FUNCTIONS

TEXT = (Path(__file__).resolve().parents[2] / "docs" / "files.md").read_text(encoding="utf-8")
WORDS = {
    word for code in re.findall(r"`([^`]+)`", TEXT.replace("```", "")) for word in re.findall(r"\w+", code)
}
TABLES = {
    "rotor": rotor.COLUMNS,
    "bearing": bearing.COLUMNS,
    "bow": unbalance.BOW_COLUMNS,
    "runs": runs.COLUMNS,
    "weights": weights.COLUMNS,
    "influence": influence.COLUMNS,
    "unbalance": unbalance.COLUMNS,
    "modes": modes.MODE_COLUMNS,
    "compliance": modes.COMPLIANCE_COLUMNS,
}


@each_of("table", TABLES)
def test_every_column_of_a_table_is_described(table):
    assert TABLES[table]
    for column in TABLES[table]:
        assert column.names[0] in WORDS, column.names


def test_every_sheet_of_a_workbook_is_described():
    assert {*jobkeys.TABLES, *(*jobbook.NAMED, "settings")} <= WORDS


def test_the_tables_of_keys_of_a_job_are_those_of_the_code():
    """`python tests/helpers/keys_in_files.py` writes them."""
    assert with_tables(TEXT) == TEXT


def test_every_function_of_expressions_is_named():
    assert set(FUNCTIONS) <= WORDS
