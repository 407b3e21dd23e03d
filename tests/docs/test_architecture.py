"""docs/architecture.md: its stations are where it says, and its diffs still fit the code."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest
from docs_blocks import blocks

from rotorid.samples import sample_data
from rotorid.tables import read_job
from rotorid.workflows import balance

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "architecture.md"
TEXT = PAGE.read_text(encoding="utf-8")
STATIONS = re.findall(r"^\|[^|]*\| `(\w+)` \| `([\w/.]+)` \|$", TEXT, re.MULTILINE)
DIFFS = [block.text for block in blocks(PAGE) if block.kind == "diff"]
PACKAGES = ("fem.", "balancing.", "rotorid.")
RAW = "3.36"
"""The first amplitude of the job, as its file has it."""
SAID = r"Eight containers hold it on the way: ([^;]*);.*?Two take it aside for its errors: (.*?)\n\n"


def lines(path):
    return (ROOT / path).read_text(encoding="utf-8").splitlines()


@pytest.mark.parametrize(("name", "path"), STATIONS, ids=[name for name, _ in STATIONS])
def test_a_station_is_in_its_file(name, path):
    assert any(re.match(rf"(?:class|def) {name}\b", line) for line in lines(path))


def test_both_ways_are_there():
    assert len(STATIONS) > 20


def holds(value, size):
    """Whether the reading of this size, in the file or in SI, is among the values."""
    if isinstance(value, np.ndarray):
        return value.dtype.kind in "cf" and bool(np.isclose(np.abs(value), size, rtol=1e-9, atol=0).any())
    if type(value) in (tuple, list):  # a container inside another one counts for itself
        return any(holds(item, size) for item in value)
    return value == RAW


def test_at_most_eight_containers_hold_a_reading_on_its_way():
    job = sample_data() / "turbo_job" / "job.toml"
    size = abs(read_job(job).trials.readings[0, 0, 0, 0])
    found = set()

    def watch(frame, event, made):
        made = frame.f_locals.get("self") if frame.f_code.co_name in ("__init__", "__post_init__") else made
        kind = type(made)
        if event != "return" or kind in found or not kind.__module__.startswith(PACKAGES):
            return
        fields = getattr(kind, "_fields", None) or getattr(kind, "__dataclass_fields__", ())
        if any(
            holds(vars(made).get(name) if hasattr(made, "__dict__") else getattr(made, name), size)
            for name in fields
        ):
            found.add(kind)

    sys.setprofile(watch)
    try:
        balance(job)
    finally:
        sys.setprofile(None)
    way, aside = (re.findall(r"`(\w+)`", part) for part in re.findall(SAID, TEXT, re.DOTALL)[0])
    assert len(way) == 8
    assert {kind.__name__.replace("Field", "Table") for kind in found} == {*way, *aside} - {"Job"}


@pytest.mark.parametrize("diff", DIFFS, ids=["support", "method", "key", "command", "column"])
def test_what_a_diff_takes_away_or_stands_beside_is_still_there(diff):
    source = []
    for line in diff.splitlines():
        if line.startswith("--- a/"):
            source = lines(line.removeprefix("--- a/"))
        elif line.startswith("+++ b/"):
            assert not (ROOT / line.removeprefix("+++ b/")).exists(), "the example has come to stay"
        elif line.startswith(("-", " ")):
            assert line[1:] in source, line


def test_folders_of_the_layers_exist():
    rows = re.findall(r"^\| ((?:`[\w/]+`(?:, )?)+) \|", TEXT, re.MULTILINE)
    named = [folder for row in rows for folder in re.findall(r"`([\w/]+)`", row)]
    assert len(named) > 10
    assert [folder for folder in named if not (ROOT / folder / "__init__.py").exists()] == []
