"""`rotorid demo`: every sample runs, says what to type, and writes what it promises."""

import json
import shlex

import pytest

from rotorid.commands.demo_samples import SAMPLES
from rotorid.samples import sample_data

NUMBERS = {
    "main": ["1291.45", "134.203"],
    "balancing": ["430.0  171.5°", "explained by the stated errors", "13.59 at 154.7°"],
    "holes": ["2 × 150.0 in hole 6; 150.0 in hole 8", "1 × 20 g in holes 4 (45°), 7 (90°)"],
    "rig": ["disk 1    33.49  250.5°", "its angle is not determined"],
    "rotor": ["4375.19", "10932.4 rpm", "4409.93"],
    "reduction": ["134.203", "IRS", "three_masses.toml"],
    "identification": ["10.0108", "Only c and b*(1 - delta) are determined"],
    "record": ["880.814", "The model leaves 3.4 % of the record"],
    "calibration": ["The model explains the data", "rms 26.2 → 2.29 µm pp"],
    "waveforms": ["1× of 3 sensors in 3 records; phases lag.", "rms 80.1 → "],
}


def test_the_samples_have_numbers_here():
    assert set(NUMBERS) == set(SAMPLES)
    assert next(iter(SAMPLES)) == "main"


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory):
    """Of each sample, run once: what it printed, and its folder."""
    return {}, tmp_path_factory


@pytest.fixture
def demo(outcomes, cli, monkeypatch):
    done, folders = outcomes

    def run(name):
        if name not in done:
            place = folders.mktemp(name)
            monkeypatch.chdir(place)
            done[name] = (cli("demo", "d", "--sample", name), place)
        return done[name]

    return run


EVERY_TIME = ("main", "identification")
"""Samples of which `make test` draws the pictures."""


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in EVERY_TIME else pytest.mark.full) for name in SAMPLES]
)
def test_a_sample_runs_and_writes_its_pictures(demo, name):
    outcome, place = demo(name)
    sample = SAMPLES[name]
    assert outcome.code == 0
    for word in NUMBERS[name]:
        assert word in outcome.out, word
    pictures = ", ".join(f"d/{picture}" for picture in sample.pictures)
    assert f"\nPictures: {pictures}\n" in outcome.out
    files = [path.relative_to(place).as_posix() for path in place.rglob("*") if path.is_file()]
    assert sorted(f for f in files if f.endswith(".png")) == sorted(f"d/{p}" for p in sample.pictures)
    for picture in sample.pictures:
        assert (place / "d" / picture).read_bytes().startswith(b"\x89PNG")
    for source in sample.sources:
        assert any(f"{file}/".startswith(f"d/{source}/") for file in files), source
    assert not any("make_" in file for file in files)


def test_the_license_of_a_sample_goes_with_it(cli, tmp_path):
    assert cli("demo", tmp_path, "--sample", "rig").code == 0
    assert "MIT License" in (tmp_path / "rk4" / "LICENSE.txt").read_text(encoding="utf-8")


def test_json_is_one_document_with_all_results(cli, tmp_path):
    name = "identification"
    outcome = cli("demo", tmp_path / "d", "--sample", name, "--json")
    document = outcome.json
    sample = SAMPLES[name]
    assert document["sample"] == name
    assert document["folder"] == str(tmp_path / "d")
    assert [path.rpartition("/")[2] for path in document["pictures"]] == list(sample.pictures)
    assert len(document["provenance"]["inputs"]) >= 4
    for step, typed in zip(sample.steps, document["commands"], strict=True):
        alone = cli(*shlex.split(typed)[1:], "--json").json
        alone.pop("provenance")
        assert document[step.key] == alone


def test_the_list_writes_nothing(cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    lines = cli("demo", "--list").out.splitlines()
    assert [line.split()[0] for line in lines] == list(SAMPLES)
    for line, sample in zip(lines, SAMPLES.values(), strict=True):
        assert line.endswith("  " + sample.about)
        assert len(line) <= 100
    document = json.loads(cli("demo", "--list", "--json").out)
    assert [row["name"] for row in document["samples"]] == list(SAMPLES)
    assert cli("demo", "--sample", "maine").code == 2
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", [name for name in SAMPLES if name != "main"])
def test_a_sample_keeps_what_people_changed(cli, tmp_path, name):
    source = SAMPLES[name].sources[0]
    place = sample_data() / source
    first = place if place.is_file() else min(place.glob("*.toml"))
    mine = tmp_path / "d" / first.relative_to(sample_data())
    mine.parent.mkdir(parents=True)
    mine.write_text("mine", encoding="utf-8")
    outcome = cli("demo", tmp_path / "d", "--sample", name)
    assert outcome.code == 2
    assert f"{mine}: differs from the sample" in outcome.err
    assert [path for path in (tmp_path / "d").rglob("*") if path.is_file()] == [mine]
