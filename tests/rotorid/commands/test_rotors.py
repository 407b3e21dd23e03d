"""campbell, influence, response and reduce from Python: the document of the command, in SI or as text."""

import pandas as pd
import pytest

from rotorid.samples import sample_data

ROTOR = sample_data() / "rotor23.csv"


@pytest.mark.parametrize("ending", ["csv", "xlsx"])
def test_cells_of_the_other_kind_are_blank_in_files(cli, tmp_path, ending):
    path = tmp_path / f"masses.{ending}"
    assert cli("reduce", ROTOR, "--nodes", "7,12,18", "--output", path).code == 0
    table = pd.read_csv(path) if ending == "csv" else pd.read_excel(path)
    assert table["node"].tolist()[:3] == [7, 12, 18]
    assert table["node"].isna().tolist() == table["mode"].notna().tolist() == [False] * 3 + [True] * 3


def test_what_the_warning_of_a_negative_mass_proposes(cli):
    words = ("reduce", ROTOR, "--nodes", "3,4,20", "--modes", "2")
    assert "or --nonnegative" in " ".join(cli(*words).out.split())
    masses = cli(*words, "--nonnegative", "--json").json["masses_kg"]
    assert min(masses) >= 0 < max(masses)
