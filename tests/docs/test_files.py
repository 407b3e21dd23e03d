"""docs/files.md names every column and every key that the readers know."""

import re
from pathlib import Path

import pytest
from cases import each_of
from keys_in_files import with_tables

import rotorid
from rotorid.files import influence, runs, weights
from rotorid.files.toml_file import Section
from rotorid.identify.expressions import FUNCTIONS
from rotorid.samples import sample_data
from rotorid.tables.data import modes_table as modes
from rotorid.tables.job import job_from_excel as jobbook
from rotorid.tables.job import job_keys as jobkeys
from rotorid.tables.rotor import bearing
from rotorid.tables.rotor import bow_table as bow
from rotorid.tables.rotor import rotor_table as rotor
from rotorid.tables.rotor import unbalance_table as unbalance

TEXT = (Path(__file__).resolve().parents[2] / "docs" / "files.md").read_text(encoding="utf-8")
WORDS = {
    word for code in re.findall(r"`([^`]+)`", TEXT.replace("```", "")) for word in re.findall(r"\w+", code)
}
NAMED_BY_USERS = {
    "planes",
    "sensors",
    "slow_roll",
    "estimate",
    "known",
    "initial",
    "outputs",
    "states",
    "bounds",
    "start",
    "force",
}
TABLES = {
    "rotor": rotor.COLUMNS,
    "bearing": bearing.COLUMNS,
    "bow": bow.COLUMNS,
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


def asked_for(monkeypatch, read, *files):
    """The keys that a reader asks for or knows, without the names that users choose."""
    keys = set()
    take, know = Section.take, Section.know

    def noted(self, key):
        parts = [part for part in re.sub(r"\[\d+\]", "", self._prefix).split(".") if part]
        if not (parts and parts[-1] in NAMED_BY_USERS):
            keys.add(key)
        return take(self, key)

    def known(self, names):
        names = list(names)
        keys.update(names)
        return know(self, names)

    with monkeypatch.context() as patch:
        patch.setattr(Section, "take", noted)
        patch.setattr(Section, "know", known)
        for file in files:
            read(file)
    return keys


@pytest.mark.parametrize(
    ("read", "folder", "pattern", "least"),
    [
        (rotorid.read_rotor, "compressor", "rotor.toml", 45),
        (rotorid.read_harmonic_model, "identify", "*/model.toml", 6),
        (rotorid.read_ode_model, "fit", "*/model.toml", 15),
        (rotorid.tables.read_small_model, "motion", "small.toml", 15),
    ],
)
def test_every_key_that_a_reader_asks_for_is_described(read, folder, pattern, least, monkeypatch):
    files = sorted((sample_data() / folder).glob(pattern))
    assert files
    keys = asked_for(monkeypatch, read, *files)
    assert len(keys) >= least
    assert keys - WORDS == set()


def test_every_sheet_of_a_workbook_is_described():
    assert {*jobkeys.TABLES, *jobbook.SETTINGS} <= WORDS


def test_the_tables_of_keys_of_a_job_are_those_of_the_code():
    """`python tests/helpers/keys_in_files.py` writes them."""
    assert with_tables(TEXT) == TEXT


def test_every_function_of_expressions_is_named():
    assert set(FUNCTIONS) <= WORDS
