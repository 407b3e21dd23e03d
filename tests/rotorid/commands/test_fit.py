"""`rotorid.commands.fit` from Python: what the command prints, with options as numbers instead of texts."""

import json

import pytest

from rotorid.commands.fit import FitOptions, choices, fit
from rotorid.files import read_ode_model, read_record
from rotorid.samples import sample_data

FOLDER = sample_data() / "fit" / "quasilinearization"
FILES = FOLDER / "model.toml", FOLDER / "record_noisy.csv"
WORDS = ("--start", "theta1=0.8,theta2=-0.8", "--sigma", "0.02", "--method", "gauss-newton")


def plain(document):
    document["provenance"].pop("date")
    return json.loads(json.dumps(document))


def without_options(document):
    document["provenance"].pop("options")
    return document


def test_texts_and_numbers_give_what_the_command_prints(cli):
    printed = plain(cli("fit", *FILES, *WORDS, "--json").json)
    texts = FitOptions(start="theta1=0.8,theta2=-0.8", sigma="0.02", method="gauss-newton")
    assert plain(fit(FILES[0], FILES[1:], texts).document) == printed
    start = {"theta1": 0.8, "theta2": -0.8}
    numbers = FitOptions(start=start, sigma=0.02, method="gauss-newton")
    found = plain(fit(FILES[0], FILES[1:], numbers).document)
    assert found["provenance"]["options"] == {
        "method": "gauss-newton",
        "start": start,
        "sigma": 0.02,
    }
    assert without_options(found) == without_options(printed)


def test_models_and_records_need_no_files():
    model = read_ode_model(FILES[0])
    found = fit(model, [read_record(FILES[1], model)], FitOptions(sigma={"y1": 0.02, "y2": 0.03}))
    document = found.document
    assert document["provenance"]["inputs"] == []
    assert document["provenance"]["options"] == {"sigma": {"y1": 0.02, "y2": 0.03}}
    same = fit(*FILES[:1], FILES[1:], FitOptions(sigma="y1=0.02,y2=0.03"))
    assert same.to_dict() == found.to_dict()
    assert found.figure().axes
    assert found.to_frame()["parameter"].tolist() == ["theta1", "theta2", "theta3"]


@pytest.mark.parametrize("option", choices())
def test_names_of_methods_are_checked(option):
    with pytest.raises(ValueError, match=f"--{option} 'none such' is not known: one of "):
        fit(FILES[0], FILES[1:], FitOptions(**{option: "none such"}))
