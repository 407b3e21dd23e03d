"""campbell, influence, response and reduce from Python: the document of the command, in SI or as text."""

from pathlib import Path

import pytest

from rotorid import read_rotor
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


def test_the_small_model_is_made_when_it_is_asked_for():
    found = reduce(read_rotor(ROTOR), ReduceOptions(nodes=(7, 12, 18), damping=(), force=[12]))
    assert found.small is None
    assert not found.with_small().small.damping.any()
    (content,) = found.with_small().model_files(Path("m.toml"), "rotor").values()
    assert "f_x12" in content.decode()
    assert found.state_space_bytes().startswith(b"{")
    assert found.with_small().with_small().to_dict()["small_model"]


def test_forces_act_on_masses_from_tables_too(cli, tmp_path):
    tables = ("--compliance", BOOK / "compliance.csv", "--measured", BOOK / "modes.csv")
    path = tmp_path / "m.toml"
    assert cli("reduce", *tables, "--force", "12", "--model", path).code == 0
    assert '"f_x12"' in path.read_text()


def test_a_measured_rotor_is_used_beside_its_model():
    found = reduce(ROTOR, ReduceOptions(measured=BOOK / "modes.csv"))
    assert [entry["file"] for entry in found.provenance["inputs"]] == [str(ROTOR), str(BOOK / "modes.csv")]
    assert found.document["source"] == "measured"
