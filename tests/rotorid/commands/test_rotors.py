"""campbell, influence, response and reduce from Python: the document of the command, in SI or as text."""

import pytest

from rotorid.commands.reduce import ReduceOptions, reduce
from rotorid.samples import sample_data

ROTOR = sample_data() / "rotor23.csv"
BOOK = sample_data() / "book_task_9"


def same(one, other):
    """Whether two documents say the same: numbers to rounding."""
    if isinstance(one, dict):
        assert list(one) == list(other)
        for key, value in one.items():
            same(value, other[key])
    elif isinstance(one, list):
        assert len(one) == len(other)
        for pair in zip(one, other, strict=True):
            same(*pair)
    else:
        assert other == (pytest.approx(one, rel=1e-7, abs=1e-12) if isinstance(one, float) else one)


def test_a_measured_rotor_is_used_beside_its_model():
    found = reduce(ROTOR, ReduceOptions(measured=BOOK / "modes.csv"))
    assert [entry["file"] for entry in found.provenance["inputs"]] == [str(ROTOR), str(BOOK / "modes.csv")]
    assert found.document["source"] == "measured"
