"""campbell, influence, response and reduce from Python: the document of the command, in SI or as text."""

import pandas as pd
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


@pytest.mark.parametrize("ending", ["csv", "xlsx"])
def test_cells_of_the_other_kind_are_blank_in_files(cli, tmp_path, ending):
    path = tmp_path / f"masses.{ending}"
    assert cli("reduce", ROTOR, "--nodes", "7,12,18", "--output", path).code == 0
    table = pd.read_csv(path) if ending == "csv" else pd.read_excel(path)
    assert table["node"].tolist()[:3] == [7, 12, 18]
    assert table["node"].isna().tolist() == table["mode"].notna().tolist() == [False] * 3 + [True] * 3


def test_masses_from_tables_alone_make_no_model(cli, tmp_path):
    tables = ("--compliance", BOOK / "compliance.csv", "--measured", BOOK / "modes.csv")
    path = tmp_path / "m.toml"
    refused = cli("reduce", *tables, "--output", path)
    assert (refused.code, "say nothing of bearings" in refused.err, path.exists()) == (2, True, False)


def test_forces_stand_at_masses(cli, tmp_path):
    path = tmp_path / "m.toml"
    words = ("reduce", ROTOR, "--nodes", "7,12,18", "--output", path, "--force")
    assert cli(*words, "12").code == 0
    assert '"f_x12"' in path.read_text()
    path.unlink()
    told = cli(*words, "8")
    assert "--force: no mass of the model stands at 8; masses stand at 7, 12, 18" in " ".join(
        told.err.split()
    )
    assert not path.exists()


def test_what_the_warning_of_a_negative_mass_proposes(cli):
    words = ("reduce", ROTOR, "--nodes", "3,4,20", "--modes", "2")
    assert "or --nonnegative" in " ".join(cli(*words).out.split())
    masses = cli(*words, "--nonnegative", "--json").json["masses_kg"]
    assert min(masses) >= 0 < max(masses)


def test_a_measured_rotor_is_used_beside_its_model():
    found = reduce(ROTOR, ReduceOptions(measured=BOOK / "modes.csv"))
    assert [entry["file"] for entry in found.provenance["inputs"]] == [str(ROTOR), str(BOOK / "modes.csv")]
    assert found.document["source"] == "measured"
