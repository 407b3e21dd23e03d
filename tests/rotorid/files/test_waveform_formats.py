"""Each format as its library writes it: the same samples and the same rate come back."""

import struct

import numpy as np
import pytest
from cases import each_of
from scipy.io import savemat, wavfile
from waveform_files import RATE, SUFFIXES, drawn, write

from rotorid.files import InputError
from rotorid.files.instrument_formats import read_samples


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_channels_and_rate_come_back(suffix, tmp_path):
    channels = drawn()
    found = read_samples(write(tmp_path / f"a{suffix}", channels))
    names = ["1", "2", "3"] if suffix == ".wav" else list(channels)
    assert list(found.channels) == names
    assert found.scale == 1.0
    assert found.rate == pytest.approx(RATE, rel=1e-9)
    digits = {".csv": 1e-8, ".wav": 1e-6}.get(suffix, 0.0)
    for name, samples in zip(names, channels.values(), strict=True):
        np.testing.assert_allclose(found.channels[name], samples, atol=digits, rtol=digits)


def refused(path, *words):
    """The complaint, one line, which has these words."""
    with pytest.raises(InputError) as raised:
        read_samples(path)
    message = str(raised.value)
    assert message.count("\n") == 0, message
    for word in words:
        assert word in message, message
    return message


def csv(tmp_path, text, encoding="utf-8"):
    path = tmp_path / "r.csv"
    path.write_bytes(text.encode(encoding))
    return path


TABLES = {
    "tabs": "t_s\tKEY\tB\n0.0\t5.5\t1\n0.1\t0\t-2.5\n0.2\t0\t0.3\n",
    "a preamble": "Recorder 3\nDate,2024-05-01\nGain;4;1,5\n\nt_s,KEY,B\n0,5.5,1\n0.1,0,-2.5\n0.2,0,0.3\n",
    "units below": "Time,KEY,B\n(ms),(V),\n\n0,5.5,1\n100,0,-2.5\n200,0,0.3\n",
    "quotes": '"t_s";"KEY";"B"\n"0,0";"5,5";"1"\n"0,1";"0,0";"-2,5"\n"0,2";"0";"0,3"\n',
}


@each_of("kind", TABLES)
def test_text_as_loggers_write_it(kind, tmp_path):
    found = read_samples(csv(tmp_path, TABLES[kind], "utf-16" if kind == "tabs" else "utf-8"))
    key, other = found.channels
    assert (key, other) == (("KEY_V", "B") if kind == "units below" else ("KEY", "B"))
    np.testing.assert_allclose(found.channels[key], [5.5, 0.0, 0.0])
    np.testing.assert_allclose(found.channels["B"], [1.0, -2.5, 0.3])
    assert found.rate == pytest.approx(10.0)


ROWS = [f"{i / 100:.2f},{i % 5},{i}.5" for i in range(600)]


BAD_CELLS = {
    "a word": (400, "4.00,x1,3", ["row 402, column KEY: found 'x1', expected a number"]),
    "many cells": (400, "4.00,1,3,4,5", ["counted below row 1: ", "Expected 3 fields in line 401, saw 5"]),
    "a jump": (300, "3.05,1,1", ["row 302, column t_s: found '3.05', expected times in even steps, 0.01 s"]),
}


@each_of("kind", BAD_CELLS)
def test_a_bad_cell_is_named_with_its_row(kind, tmp_path):
    from rotorid.files.waveform_jobs import read_waveforms

    at, row, words = BAD_CELLS[kind]
    path = csv(tmp_path, "\n".join(["t_s,KEY,B", *ROWS[:at], row, *ROWS[at + 1 :]]))
    with pytest.raises(InputError) as raised:
        read_waveforms([path], {"tacho": "KEY"})
    for word in words:
        assert word in str(raised.value)


def test_even_times_may_be_rounded_but_no_sample_is_missing(tmp_path):
    t = np.arange(2000) / 5120.0
    rows = [f"{time:.4f},{i % 7}" for i, time in enumerate(t)]  # half a step of rounding is 0.26 of a step
    assert read_samples(csv(tmp_path, "\n".join(["t_s,KEY", *rows]))).rate == pytest.approx(5120.0, rel=3e-4)
    for at in (1, 700, 1998):
        refused(csv(tmp_path, "\n".join(["t_s,KEY", *rows[:at], *rows[at + 1 :]])), "times in even steps")
    slower = np.arange(400) + 4e-5 * np.arange(400) ** 2  # off by 0.3 of the median step from the 22nd on
    refused(csv(tmp_path, "\n".join(["t_s,KEY", *(f"{time},1" for time in slower)])), "row 23, column t_s")


VALUES = np.array([[0.5, -1.0], [0.25, 0.0], [-0.5, 0.125], [2.0**-6, -(2.0**-6)]])


@pytest.mark.parametrize("bits", [8, 16, 24, 32])
def test_full_scale_of_integers_is_one(bits, tmp_path):
    path, stored = tmp_path / "a.wav", VALUES * 2 ** (bits - 1) + (128 if bits == 8 else 0)
    if bits == 24:  # as the format is described: no library here writes it
        data = b"".join(int(v).to_bytes(3, "little", signed=True) for v in stored.ravel())
        form = struct.pack("<HHIIHH", 1, 2, 48000, 48000 * 6, 6, 24)
        body = b"WAVEfmt " + struct.pack("<I", 16) + form + b"data" + struct.pack("<I", len(data)) + data
        path.write_bytes(b"RIFF" + struct.pack("<I", len(body)) + body)
    else:
        wavfile.write(path, 48000, stored.astype({8: np.uint8, 16: np.int16, 32: np.int32}[bits]))
    found = read_samples(path)
    assert found.rate == 48000.0
    for channel, values in zip(found.channels.values(), VALUES.T, strict=True):
        np.testing.assert_array_equal(channel * found.scale, values)
    path.write_bytes(path.read_bytes()[:-2])
    refused(path, "a whole .wav file")


MATRIX = np.arange(12.0).reshape(6, 2)
ARRAYS = {
    "names and dt": {"data": MATRIX, "channels": ["a", "b"], "dt": 0.01},
    "vectors in rows": {"a": MATRIX[:, :1].T, "b": MATRIX[:, 1:].T, "Fs": 100},
}


def saved(path, arrays):
    (np.savez if path.suffix == ".npz" else lambda file, **more: savemat(file, more))(path, **arrays)
    return path


@each_of("kind", ARRAYS)
@pytest.mark.parametrize("suffix", [".mat", ".npz"])
def test_arrays_as_people_save_them(kind, suffix, tmp_path):
    found = read_samples(saved(tmp_path / f"a{suffix}", ARRAYS[kind]))
    assert list(found.channels) == ["a", "b"]
    np.testing.assert_array_equal(found.channels["b"], MATRIX[:, 1])
    assert found.rate == pytest.approx(100.0)


WRONG_ARRAYS = {
    "two rates": ({"a": MATRIX[:, 0], "fs": 100.0, "dt": 0.02}, "one rate, not 100 Hz and 50 Hz"),
    "lengths": ({"a": np.arange(5), "b": np.arange(6), "fs": 1}, "the numbers of samples: a 5 and b 6"),
    "a jump": (
        {"a": np.arange(5), "t": np.array([0, 1, 2, 4, 5])},
        "row 4, column t: found '4', expected times",
    ),
}


@each_of("kind", WRONG_ARRAYS)
def test_arrays_that_are_no_record_are_explained(kind, tmp_path):
    arrays, words = WRONG_ARRAYS[kind]
    refused(saved(tmp_path / "a.npz", arrays), words)


def test_files_that_are_none(tmp_path):
    np.savez(tmp_path / "a.npz", a=np.array([{}], dtype=object), allow_pickle=True)
    header = b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM"
    (tmp_path / "a.mat").write_bytes(header.ljust(512, b"\x00"))
    (tmp_path / "a.xlsx").write_bytes(b"PK")
    (tmp_path / "a.csv").write_text("0,1\n1,2\n")
    for name, words in (
        ("a.csv", "row 1: found nothing (a blank), expected a column a channel"),
        ("a.npz", "a whole .npz file"),  # pickles are not read
        ("a.mat", "a MAT file before version 7.3"),
        ("a.xlsx", "waveforms in a file .csv, .txt, .wav"),
    ):
        refused(tmp_path / name, words)


def test_a_small_archive_of_huge_arrays_is_not_unpacked(tmp_path, monkeypatch):
    monkeypatch.setattr("rotorid.files.instrument_formats.LARGEST", 10_000_000)
    arrays = {"a": np.zeros(2_000_000), "fs": 1.0}
    np.savez_compressed(tmp_path / "a.npz", **arrays)
    savemat(tmp_path / "a.mat", arrays, do_compression=True)
    for name in ("a.npz", "a.mat"):
        assert (tmp_path / name).stat().st_size < 100_000
        refused(tmp_path / name, "at most 0 GB, not 0.016 GB")
