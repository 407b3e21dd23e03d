"""Every sheet in a real browser: silent, self-contained, fit for a telephone, true, printable.

Without Chromium the tests are skipped, and say which packages bring it; where CI=true it must be there.
"""

import re

import pytest
from sheets import COMMANDS, disagreements, make

TELEPHONE, SCREEN = 390, 1280
A4 = (595, 842)  # points
MOST_PAGES = 12


EVERY_TIME = ("balance holes", "identify several")
"""Sheets that `make test` opens."""


@pytest.fixture
def browser(chromium):
    return chromium()


@pytest.fixture(scope="session")
def address(tmp_path_factory):
    """Where the sheet with this name lies, made when it is first asked for."""
    folder = tmp_path_factory.mktemp("sheets")

    def find(name):
        path = folder / f"{name}.html"
        if not path.exists():
            path.write_bytes(make(name).html)
        return path

    return find


def foreign(visit, path):
    """What a page asked for beyond its own file."""
    return [url for url in visit.requests if url != path.resolve().as_uri() and not url.startswith("data:")]


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[] if n in EVERY_TIME else pytest.mark.full) for n in COMMANDS]
)
def test_a_sheet_on_a_telephone_a_screen_and_paper(browser, address, name):
    path = address(name)
    document = make(name).document
    for width in (TELEPHONE, SCREEN):
        browser.resize(width)
        visit = browser.open(path)
        assert visit.console == []
        assert foreign(visit, path) == []
        assert browser.too_wide() == []
        assert browser.widths() == (width, width)
        assert browser.title().strip()

        shown = browser.shown()
        assert len(shown) >= (10 if name.startswith(("balance", "critical")) else 0)
        assert [element.key for element in shown if not element.visible] == []
        inside = browser.document()  # what the command printed, and what the sheet adds for itself
        assert {key: inside.get(key) for key in document} == document
        assert disagreements(shown, inside) == []

        (top,) = browser.tops("#warnings")
        if not name.startswith("balance"):  # there the weights come first
            assert top < min(browser.tops("table, svg, h2"))
        read = " ".join(browser.text("#warnings").split())
        for warning in document["warnings"]:
            assert " ".join(warning.split())[1:] in read  # as a sentence

    pdf = browser.print()
    boxes = re.findall(rb"/MediaBox\s*\[0 0 ([\d.]+) ([\d.]+)\]", pdf)
    assert 1 <= len(re.findall(rb"/Type\s*/Page\b", pdf)) <= MOST_PAGES
    assert {(round(float(w)), round(float(h))) for w, h in boxes} == {A4}
