"""A waveforms file or options: runs, channels with units and scales, conventions, refusals."""

import math
import shutil

import numpy as np
import pytest
from cases import each_of
from tables_data import complaints
from waveform_files import RATE, drawn, write

from balancing import Labels
from rotorid.files import InputError, read_job
from rotorid.files.waveform_jobs import read_waveforms
from rotorid.samples import sample_data
from rotorid.waveforms.record import SignalPath, TachoSettings

FILE = """
tacho = "KEY"
pulses = 2
edge = "falling"
tacho_level = 2.5
phase = "lag"
amplitude = "um_pp"
orders = [1, 2]
speeds_rpm = [900, 1200]
[records]
BASE = "base.npz"
T1 = "t1.csv"
[channels.probe]
channel = "B1X"
unit = "mil"
scale = 5.0
high_pass_Hz = 2
high_pass_order = 2
delay_ms = 0.5
[channels.B1Y]
unit = "mm/s"
"""


@pytest.fixture
def folder(tmp_path):
    write(tmp_path / "base.npz", drawn(seed=1))
    write(tmp_path / "t1.csv", drawn(seed=2))
    return tmp_path


def settings(folder, text=FILE):
    (folder / "w.toml").write_text(text, encoding="utf-8")
    return folder / "w.toml"


def test_a_waveforms_file_says_everything(folder):
    found = read_waveforms([settings(folder)])
    assert [record.run for record in found.records] == ["BASE", "T1"]
    assert found.tacho == TachoSettings(2, "falling", 2.5)
    assert found.labels == Labels("um_pp", 2e6, phase="lag")
    assert found.orders == (1.0, 2.0)
    assert found.speeds == pytest.approx((30 * math.pi, 40 * math.pi))
    assert found.files == (folder / "w.toml", folder / "base.npz", folder / "t1.csv")
    for record, seed in zip(found.records, (1, 2), strict=True):
        probe, velocity = record.sensors
        assert record.rate == pytest.approx(RATE)
        assert (probe.name, probe.derivative, probe.factor) == ("probe", 0, pytest.approx(5 * 25.4e-6))
        assert probe.path == SignalPath(pytest.approx(4 * math.pi), 2, pytest.approx(0.5e-3))
        assert (velocity.name, velocity.derivative, velocity.factor) == ("B1Y", 1, 1e-3)
        np.testing.assert_allclose(probe.samples, drawn(seed=seed)["B1X"], rtol=1e-8)
        np.testing.assert_array_equal(record.tacho.samples, drawn()["KEY"])


def test_without_a_list_all_other_channels_are_sensors_with_the_units_of_their_names(tmp_path):
    channels = drawn()
    x, y = channels["B1X"], channels["B1Y"]
    write(tmp_path / "base.csv", {"KEY": channels["KEY"], "B1X_um": x, "B1Y [mm/s]": y, "T_degC": x})
    text = 'tacho = "KEY"\nrecords = { base = "base.csv" }\n[channels.B1X]\n[channels.B1Y]\n'
    found = read_waveforms([settings(tmp_path, text)])
    (record,) = found.records
    assert [(s.name, s.derivative, s.factor) for s in record.sensors] == [("B1X", 0, 1e-6), ("B1Y", 1, 1e-3)]
    assert (found.labels, found.unstated) == (Labels("um", 1e6), True)
    y[7] = np.nan  # in a channel that nobody wants a gap is no problem
    path = write(tmp_path / "a.npz", {"KEY": channels["KEY"] > 1, "A": x, "B1Y_um": y})
    found = read_waveforms([path], {"tacho": "KEY", "unit": "V", "rate_Hz": 5120.5, "channels": {"A": {}}})
    assert [(s.name, s.factor, s.derivative) for s in found.records[0].sensors] == [("A", 1.0, None)]
    assert "row 8, column B1Y_um: found nothing (a blank)" in complaint([path], {"tacho": "KEY"})


def test_the_command_line_replaces_what_the_file_says(folder):
    wishes = {"tacho": "B1Y", "unit": "um", "amplitude": "mm_s_rms", "pulses": 3, "edge": "centre"}
    wishes |= {"phase": "lead", "orders": [1], "rate_Hz": 5120.5, "speeds_rad_s": [100.0]}
    wishes["channels"] = {"probe": {"channel": "B1X", "unit": "mil", "scale": 5.0}, "KEY": {}}
    found = read_waveforms([settings(folder)], wishes)
    record = found.records[0]
    assert (record.rate, record.tacho.name) == (5120.5, "B1Y")
    assert [(s.name, s.factor) for s in record.sensors] == [("probe", pytest.approx(1.27e-4)), ("KEY", 1e-6)]
    assert found.tacho == TachoSettings(3, "centre", 2.5)
    assert (found.labels.vibration_unit, found.labels.phase) == ("mm_s_rms", "lead")
    assert (found.orders, found.speeds) == ((1.0,), (100.0,))


def complaint(files, wishes=None):
    with pytest.raises(InputError) as raised:
        read_waveforms(files, wishes)
    return str(raised.value)


OPTIONS = {
    "no tacho": (
        {},
        "expected a tacho channel, without which there is no phase: --tacho NAME "
        "(tacho in a file); the channels are KEY, B1X and B1Y",
    ),
    "another sensor": (
        {"tacho": "KEY", "channels": {"B1YY": {}}},
        "B1YY: expected a channel of this name (did you mean 'B1Y'?); the channels are KEY, B1X and B1Y",
    ),
    "another rate": (
        {"tacho": "KEY", "rate_Hz": 5200.0},
        "the rate that the file has, 5120 Hz, not 5200 Hz",
    ),
    "kinds": (
        {"tacho": "KEY", "unit": "V", "amplitude": "um"},
        "column B1X: found 'V', expected a unit that can become that of the amplitudes, um",
    ),
}


@each_of("kind", OPTIONS)
def test_options_that_cannot_be_are_explained(kind, folder):
    wishes, words = OPTIONS[kind]
    message = complaint([folder / "base.npz"], wishes)
    assert words in message, message


FILES = {
    'tacho = "KEY"\n': "key records: expected a file for each run",
    FILE + 'uni = "um"\n': "key channels.B1Y.uni: found 'um', expected a known key (did you mean 'unit'?)",
    FILE.replace("falling", "fallling"): "key edge: found 'fallling', expected 'leading', 'trailing'",
}


@each_of("text", FILES)
def test_settings_that_cannot_be_are_explained(text, folder):
    message = complaint([settings(folder, text)])
    assert FILES[text] in message, message


def test_several_files(folder):
    wishes = {"tacho": "KEY"}
    found = read_waveforms([folder / "base.npz", folder / "t1.csv"], wishes)
    assert [record.run for record in found.records] == ["base", "t1"]
    assert "one waveforms file alone" in complaint([settings(folder), folder / "base.npz"], wishes)
    write(folder / "base.csv")
    assert "records of different names" in complaint([folder / "base.npz", folder / "base.csv"], wishes)


def test_a_run_up_in_a_job_wants_speeds(tmp_path):
    shutil.copytree(sample_data() / "waveforms", tmp_path, dirs_exist_ok=True)
    slow = tmp_path / "slow_roll.toml"
    slow.write_text(slow.read_text().replace("speeds_rpm = [620]\n", ""))
    [problem] = complaints(read_job, tmp_path / "job.toml")
    assert problem.column == "speeds_rpm"
    assert "speeds at which 'slow' are read, whose speed is not steady" in problem.expected
