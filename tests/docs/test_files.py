"""docs/files.md names every column and every key that the readers know."""

import os
import re
import sys
from importlib import import_module
from pathlib import Path

from cases import each_of

from rotorid.files import bearings_and_seals, influence, node_tables, rotor, runs, weights
from rotorid.files import job_excel as jobbook
from rotorid.files import job_keys as jobkeys
from rotorid.files.settings import Settings
from rotorid.identify.expressions import FUNCTIONS

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "docs" / "_ext"))

from tables import key_lines, settings_of  # noqa: E402 - of docs/_ext

TEXT = (ROOT / "docs" / "files.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```\{keys\} (.+)\n(.+)$", TEXT, re.MULTILINE)
SHOWN = [settings_of(name.split()) for name, _ in BLOCKS]
"""Settings whose keys the page lists, made with the pages."""
KEYS = [cells for settings in SHOWN for cells in key_lines(settings)]
CODE = re.findall(r"`([^`]+)`", TEXT.replace("```", "")) + [cells[0] for cells in KEYS]
WORDS = {word for code in CODE for word in re.findall(r"\w+", code)}
TABLES = {
    "rotor": rotor.COLUMNS,
    "bearing": bearings_and_seals.COLUMNS,
    "bow": node_tables.BOW_COLUMNS,
    "runs": runs.COLUMNS,
    "weights": weights.COLUMNS,
    "influence": influence.COLUMNS,
    "unbalance": node_tables.UNBALANCE_COLUMNS,
    "modes": node_tables.MODE_COLUMNS,
    "compliance": node_tables.COMPLIANCE_COLUMNS,
}


@each_of("table", TABLES)
def test_every_column_of_a_table_is_described(table):
    for column in TABLES[table]:
        assert column.names[0] in WORDS, column.names


def test_every_sheet_of_a_workbook_is_described():
    assert {*jobkeys.TABLES, *(*jobbook.NAMED, "settings")} <= WORDS


def test_the_settings_of_every_file_are_on_the_page():
    """All that are defined where one of them is, but those from which others are made."""
    modules = {settings.__module__ for settings in SHOWN}
    defined = {
        value
        for module in modules
        for value in vars(import_module(module)).values()
        if isinstance(value, type) and issubclass(value, Settings) and value.__module__ == module
    }
    made_from = {base for settings in defined | set(SHOWN) for base in settings.__mro__[1:]}
    assert {one.__name__ for one in defined - made_from - set(SHOWN)} == {"SealKeys"}  # as those of a bearing
    assert all(about and names for names, about, _ in KEYS)


def test_every_key_stands_in_the_plain_text():
    """Written anew with ROTORID_RENEW_PAGES, as the pages."""
    text, path = "", ROOT / "docs" / "keys.txt"
    for (_, head), settings in zip(BLOCKS, SHOWN, strict=True):
        lines = ["  {}: {}; {}".format(*cells).removesuffix("; ") for cells in key_lines(settings)]
        text += "\n".join(("", head, *lines, "")).replace("`", "")
    if os.environ.get("ROTORID_RENEW_PAGES"):
        path.write_text(text, encoding="utf-8")
    assert path.read_text(encoding="utf-8") == text


def test_every_function_of_expressions_is_named():
    assert set(FUNCTIONS) <= WORDS
