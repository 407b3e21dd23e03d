"""`rotorid.commands.identify` from Python: what the command prints, and models and data without files."""

import json

import numpy as np
import pytest

from rotorid.commands.identify import IdentifyOptions, identify
from rotorid.samples import sample_data
from rotorid.tables import read_harmonic_model, read_measurements

FOLDER = sample_data() / "identify" / "task_5_1"
FILES = FOLDER / "model.toml", FOLDER / "data.csv"
WORDS = (
    *("--loss", "huber", "--amplitude-error", "2", "--phase-error", "1"),
    *("--design", "5:40:5", "--choose", "2"),
)
OPTIONS = {"loss": "huber", "amplitude_error": 2.0, "phase_error": 1.0, "choose": 2}


def plain(document):
    document["provenance"].pop("date")
    return json.loads(json.dumps(document))


def test_texts_and_numbers_give_what_the_command_prints(cli):
    printed = plain(cli("identify", *FILES, *WORDS, "--json").json)
    assert printed["provenance"]["options"] == {**OPTIONS, "design": "5:40:5"}
    assert plain(identify(*FILES, IdentifyOptions(**OPTIONS, design="5:40:5")).document) == printed
    frequencies = [5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0]
    found = plain(identify(*FILES, IdentifyOptions(**OPTIONS, design=frequencies)).document)
    assert found["provenance"].pop("options") == {**OPTIONS, "design": frequencies}
    printed["provenance"].pop("options")
    assert found == printed


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


HIDDEN = """
M = [[1, 0], [0, 2]]
C = [["c", 0], [0, 0.3]]
K = [[300, -100], [-100, "k"]]
coordinates = ["x1", "x2"]
inputs = ["F"]
[force]
x1 = "F"
[outputs]
x1 = "x1"
[estimate]
c = 0.5
k = 250
"""


def test_a_design_reads_only_what_the_outputs_show(tmp_path):
    """Expected deviations beside those of the closed form of the one amplitude that is read."""
    path, w = tmp_path / "model.toml", np.array([8.0, 10.0, 18.0])
    path.write_text(HIDDEN, encoding="utf-8")
    options = IdentifyOptions(amplitude_error=2.0, phase_error=1.0, design=w.tolist(), choose=3)

    def logarithm(c, k):
        return np.log(1 / (300 - w**2 + 1j * c * w - 100**2 / (k - 2 * w**2 + 0.3j * w)))

    steps = [(logarithm(0.5 + d, 250 + e) - logarithm(0.5 - d, 250 - e)) / 2e-6 for d, e in np.eye(2) * 1e-6]
    rows = np.concatenate((np.real(steps) / 0.02, np.imag(steps) / np.radians(1)), axis=1)
    expected = np.sqrt(np.diag(np.linalg.inv(rows @ rows.T)))
    assert identify(path, None, options).design.std == pytest.approx(expected, rel=1e-5)
