"""`vectors` and jobs that read waveforms: one answer, whichever way they go."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile

from rotorid.commands.balance import BalanceOptions, balance
from rotorid.commands.vectors import VectorsOptions, vectors
from rotorid.files.input_problems import InputError
from rotorid.samples import sample_data

SAMPLE = sample_data() / "waveforms"
RATE = 2048


def write(path: Path, *, turns=None, phase=0.6, size=0.2, offset=0.0, pulses=1):
    """A WAV file of 6 s: a tacho, and a sensor that reads size·cos(θ + phase)."""
    t = np.arange(6 * RATE) / RATE
    turns = 17.3 * t if turns is None else turns(t)
    x = size * np.cos(2 * np.pi * turns + phase) + offset
    x += 1e-3 * np.random.default_rng(1).standard_normal(len(t))
    tacho = np.where(turns * pulses % 1 < 0.05 * pulses, 0.5, 0.0)
    wavfile.write(path, RATE, np.stack((tacho, x), axis=1).astype(np.float32))
    return path


def test_the_table_is_what_balance_reads(tmp_path):
    found = vectors([SAMPLE / "waveforms.toml"], VectorsOptions())
    table = tmp_path / "runs.csv"
    found.to_frame().to_csv(table, index=False)
    job = tmp_path / "job.toml"
    slow = vectors([SAMPLE / "slow_roll.toml"], VectorsOptions())
    slow.to_frame().to_csv(tmp_path / "slow.csv", index=False)
    text = (SAMPLE / "job.toml").read_text(encoding="utf-8")
    text = text.replace("waveforms.toml", "runs.csv").replace("slow_roll.toml", "slow.csv")
    job.write_text(text, encoding="utf-8")
    (tmp_path / "weights.csv").write_bytes((SAMPLE / "weights.csv").read_bytes())
    direct = balance(SAMPLE / "job.toml", BalanceOptions()).to_dict()
    typed = balance(job, BalanceOptions()).to_dict()
    assert direct["corrections"] == typed["corrections"]
    assert direct["warnings"] == typed["warnings"]


def test_the_sample_is_balanced_by_its_records():
    """The unbalances of make_data.py are 9 g at 75° and 6 g at 200°; the slow roll holds some of them."""
    found = balance(SAMPLE / "job.toml", BalanceOptions()).to_dict()
    weights = [row["mass"] * np.exp(1j * np.radians(row["angle_deg"])) for row in found["corrections"]]
    exact = -9 * np.exp(1j * np.radians(75)), -6 * np.exp(1j * np.radians(200))
    assert np.abs(np.array(weights) - exact) == pytest.approx([0, 0], abs=0.6)
    assert found["conventions"]["phase"] == "lag"
    assert {Path(entry["file"]).suffix for entry in balance(SAMPLE / "job.toml").provenance["inputs"]} == {
        ".toml",
        ".csv",
        ".wav",
    }


@pytest.mark.parametrize("word", ["lead", "lag"])
def test_phase_is_written_as_asked(tmp_path, word):
    """Lag: the angle that the rotor turns from the mark to the positive peak."""
    file = write(tmp_path / "a.wav", phase=0.6)
    (row,) = vectors([file], VectorsOptions(tacho="1", unit="um", phase=word)).to_dict()["rows"]
    expected = np.degrees(0.6) if word == "lead" else 360 - np.degrees(0.6)
    assert row["phase_deg"] == pytest.approx(expected, abs=0.5)
    assert row["amplitude_um"] == pytest.approx(0.2, rel=1e-3)
    assert row["speed_rpm"] == pytest.approx(17.3 * 60, rel=1e-4)


def test_pulses_that_are_alike_do_not_compare_records(tmp_path):
    for name in "ab":
        write(tmp_path / f"{name}.wav", pulses=2)
    (tmp_path / "w.toml").write_text('tacho = "1"\nunit = "um"\npulses = 2\nrecords = { a = "a.wav" }\n')
    (one,) = vectors([tmp_path / "w.toml"]).result
    assert "multiples of 180°" in one.warnings[0]
    (tmp_path / "w.toml").write_text(
        'tacho = "1"\nunit = "um"\npulses = 2\nrecords = { a = "a.wav", b = "b.wav" }\n'
    )
    with pytest.raises((ValueError, InputError), match="vectors of different records cannot be compared"):
        vectors([tmp_path / "w.toml"])
