"""The pages of what is stable and of security say what the code does."""

import re
import zipfile
from pathlib import Path

import pytest
from golden.comparing import RELATIVE
from golden.tolerances import TOLERANCES

import rotorid
from rotorid.files import cells, disk, excel_workbook, input_problems, instrument_formats, settings
from rotorid.files.job_keys import MOST_HOLES
from rotorid.identify import equations, expressions
from rotorid.worksheet import app, server

DOCS = Path(__file__).resolve().parents[2] / "docs"
STABILITY = (DOCS / "stability.md").read_text(encoding="utf-8")
MB = 10**6


@pytest.mark.parametrize(
    ("limit", "value"),
    [
        ("a file, and a workbook unpacked", f"{disk.MOST_BYTES // MB} MB"),
        ("a file, and a workbook unpacked", f"{excel_workbook.MOST_UNPACKED // MB} MB"),
        ("cells of a table", f"{cells.MOST_CELLS:,}"),
        ("a TOML file", f"{settings.MOST_BYTES // MB} MB"),
        ("names in a list or table of a model", f"{settings.MOST_NAMES:,}"),
        (
            "characters of an expression, and how deep it nests",
            f"{expressions.MAX_LENGTH:,}, {expressions.MAX_DEPTH}",
        ),
        (
            "exponents and terms of an expression",
            f"{expressions.MAX_EXPONENT}, {equations.MAX_TERMS:,}",
        ),
        ("holes of a plane", f"{MOST_HOLES:,}"),
        (
            "numbers in files, in size",
            f"from {cells.SMALLEST:g} to {cells.LARGEST:g}, or 0".replace("+", ""),
        ),
        ("arrays of waveforms (`.npz`, `.mat`)", f"{instrument_formats.LARGEST // 10**9} GB"),
        ("a request to the worksheet", f"{app._LARGEST // MB} MB"),
    ],
)
def test_a_limit_on_the_page_is_that_of_the_code(limit, value):
    assert f"| {limit} | {value} |" in STABILITY


def test_the_page_of_security_knows_the_guard_and_the_words():
    assert f"serves {server.HOST} alone" in STABILITY
    assert f"up to {input_problems.LONGEST_VALUE} characters" in STABILITY
    assert len(expressions.FUNCTIONS) == 14
    assert "fourteen functions" in STABILITY


ENTITIES = "".join(f'<!ENTITY e{i} "{f"&e{i - 1};" * 10}">' for i in range(1, 11))


@pytest.mark.parametrize(
    ("kind", "cell", "reason"),
    [
        (f'[<!ENTITY e0 "lol">{ENTITIES}]', "&e10;", "amplification"),
        ('[<!ENTITY out SYSTEM "file:///etc/passwd">]', "&out;", "undefined entity"),
    ],
)
def test_entities_of_a_workbook_are_neither_multiplied_nor_fetched(cli, tmp_path, kind, cell, reason):
    form, path = tmp_path / "form.xlsx", tmp_path / "bomb.xlsx"
    assert cli("balance", "--template", form).code == 0
    with zipfile.ZipFile(form) as old, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            text = old.read(name)
            if name == "xl/worksheets/sheet1.xml":
                row = f'<c r="A1" t="inlineStr"><is><t>{cell}</t></is></c>'
                whole = re.sub(r"<c r=\"A1\".*?</c>", row, text.decode(), count=1)
                assert row in whole
                text = f"<!DOCTYPE worksheet {kind}>{whole}".encode()
            new.writestr(name, text)
    with pytest.raises(rotorid.InputError, match=reason):
        rotorid.read_job(path)


def test_the_stated_tolerance_is_that_of_the_tests():
    assert f"agree to {RELATIVE:g} of the largest of their array".replace("e-0", "e-") in " ".join(
        STABILITY.split()
    )
    stated = {float(number) for number in re.findall(r"\b\de-\d+\b", STABILITY)}
    relative = {each.relative for each in TOLERANCES if each.relative}
    assert max(relative) <= max(stated) == 2e-3
    assert max(each.absolute for each in TOLERANCES) <= 1e-7
