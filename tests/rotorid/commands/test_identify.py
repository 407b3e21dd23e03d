"""`rotorid.commands.identify` from Python: what the command prints, and models and data without files."""

import json

import pytest

from rotorid.commands.identify import IdentifyOptions, identify
from rotorid.files import read_harmonic_model, read_measurements
from rotorid.samples import sample_data

FOLDER = sample_data() / "identify" / "task_5_1"
FILES = FOLDER / "model.toml", FOLDER / "data.csv"
WORDS = ("--errors", "2,1")
OPTIONS = {"errors": "2,1"}


def plain(document):
    document["provenance"].pop("date")
    return json.loads(json.dumps(document))


def test_texts_and_numbers_give_what_the_command_prints(cli):
    printed = plain(cli("identify", *FILES, *WORDS, "--json").json)
    assert printed["provenance"]["options"] == OPTIONS
    assert plain(identify(*FILES, IdentifyOptions(**OPTIONS)).document) == printed


def test_models_and_experiments_need_no_files():
    file = read_harmonic_model(FILES[0])
    found = identify(file.model, read_measurements(FILES[1], file))
    assert found.document["provenance"]["inputs"] == []
    assert found.document["provenance"]["options"] == {}
    assert found.to_dict() == identify(*FILES).to_dict()
    assert found.to_frame()["parameter"].tolist() == list(file.model.parameters)
    assert found.figure().axes


def test_without_data_there_are_the_equations_alone(cli):
    """[S] 1.1: which K and Y has the model, and what can data determine?"""
    found = identify(sample_data() / "identify" / "task_4_1" / "model.toml")
    assert found.to_dict() == {"combinations": ["c", "b*(1 - delta)"]}
    assert found.summary().startswith("Data can determine at best c and b*(1 - delta).")
    with pytest.raises(ValueError, match="give a table of measured amplitudes"):
        found.figure()
    with pytest.raises(ValueError, match="give a table of measured amplitudes"):
        found.to_frame()
    shown = cli("identify", FILES[0], "--show", "equations").out
    assert "Re eq. 1  Re X·c - ω·Im X·alpha = F + m·ω²·Re X" in shown.replace("\u00a0", " "), shown
    assert "θ: c, alpha\n" in shown
    assert "Im eq. 1  Im X·c + ω·Re X·alpha = m·ω²·Im X" in shown.replace("\u00a0", " "), shown
