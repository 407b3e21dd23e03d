"""`rotorid runup`: what it prints and writes, what reads it, pictures, and options that cannot be."""

from dataclasses import replace

import numpy as np
import pytest
from run_ups import drawn, table

from rotorid.base.text import RPM
from rotorid.files import read_modes, read_rotor
from rotorid.samples import sample_data


@pytest.fixture(scope="module")
def rotor_and_sweep():
    return drawn()


@pytest.fixture
def vectors(rotor_and_sweep, tmp_path):
    return table(tmp_path / "vectors.csv", [rotor_and_sweep[1]])


@pytest.mark.full
def test_lag_is_the_same_and_the_wrong_way_is_told(cli, rotor_and_sweep, vectors, tmp_path):
    lag = table(tmp_path / "lag.csv", [rotor_and_sweep[1]], lag=True)
    known, same = (
        cli("runup", file, "--phase", phase, "--json").json
        for file, phase in ((vectors, "lead"), (lag, "lag"))
    )
    for one, other in zip(known["modes"], same["modes"], strict=True):
        assert one["frequency_rad_s"] == pytest.approx(other["frequency_rad_s"], rel=1e-7)
    assert same["slow_roll"][0]["phase_deg"] == pytest.approx(
        360 - known["slow_roll"][0]["phase_deg"], rel=1e-5
    )
    wrong = cli("runup", lag, "--phase", "lead", "--json").json
    assert wrong["modes"] == []
    assert "modes explain them as lags (--phase lag)" in wrong["warnings"][0]
    assert cli("runup", lag, "--output", tmp_path / "m.csv").code == 2


def test_acceleration_may_be_an_option(cli, rotor_and_sweep, tmp_path):
    rotor, sweep = rotor_and_sweep
    once = np.unique(sweep.speeds, return_index=True)[1]  # two may be written alike
    bare = table(tmp_path / "bare.csv", [sweep.take(once)], time=False)
    held = cli("runup", bare, "--json").json
    assert held["acceleration_rad_s2"] is None
    assert held["modes"][0]["steady"] is None
    assert "nobody says how fast the speed changes" in " ".join(cli("runup", bare, "--table").out.split())
    told = cli("runup", bare, "--acceleration", "100rpm/s", "--json").json
    mode = told["modes"][0]
    assert abs(mode["frequency_rad_s"] - rotor.omega[0]) < 4 * mode["std"]["frequency_rad_s"]
    down = cli("runup", bare, "--acceleration=-100rpm/s", "--json").json
    assert down["acceleration_rad_s2"] == pytest.approx(-100 / RPM, rel=1e-3)
    assert down["warnings"]  # the rotor ran up


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--acceleration", "50rpm/s"), "--acceleration: the table has times"),
        (("--acceleration", "50"), "a speed a second is needed"),
    ],
)
def test_options_that_cannot_be(cli, vectors, monkeypatch, tmp_path, words, message):
    monkeypatch.chdir(tmp_path)
    found = cli("runup", vectors, *words)
    assert found.code == 2
    assert message in found.err


def test_several_runs_are_refused(cli, rotor_and_sweep, tmp_path):
    _, sweep = rotor_and_sweep
    path = table(tmp_path / "both.csv", [replace(sweep, run="A"), replace(sweep, run="B")])
    found = cli("runup", path)
    assert found.code == 2
    assert "one run is needed, not 2: A or B" in found.err


def test_the_table_of_modes_is_read(rotor_and_sweep, tmp_path, cli):
    """By `reduce`, as critical speeds and not as frequencies at rest."""
    _, sweep = rotor_and_sweep
    path, output = table(tmp_path / "v.csv", [replace(sweep, sensors=("7", "18"))]), tmp_path / "modes.csv"
    assert cli("runup", path, "--output", output).code == 0
    rotor = read_rotor(sample_data() / "rotor23.csv")
    modes = read_modes(output, rotor)
    assert modes.critical
    assert modes.nodes == (7, 18)
    reduced = cli("reduce", sample_data() / "rotor23.csv", "--measured", output, "--modes", "2", "--json")
    assert reduced.code == 0


def test_a_mode_that_is_passed_within_few_turns_is_said(tmp_path, cli):
    """ζω²/(πα): of this rotor 5 turns at 300 rpm a second, 16 at 100."""
    for rate, many in ((300.0, True), (100.0, False)):
        rotor, sweep = drawn(rate=rate)
        warnings = cli("runup", table(tmp_path / "v.csv", [sweep]), "--json").json["warnings"]
        turns = rotor.zeta * rotor.omega**2 / (np.pi * rate / RPM)
        assert any("is passed within" in words for words in warnings) == many == (turns.min() < 6)
