"""The picture of a tacho: what is drawn lies where closed forms say."""

from types import SimpleNamespace

import numpy as np
import pytest

from rotorid.waveforms.plots import figure_tacho
from rotorid.waveforms.record import Channel

RATE, SECONDS = 2560.0, 20.0


class OnDisk(np.ndarray):
    """Samples of which only short stretches may be read."""

    def __getitem__(self, where):
        part = np.asarray(self)[where]
        assert len(part) <= 1200
        return part


def drawn(c=0.0, **damage):
    """Axes of a shaft of 10 + c t turns a second with one pulse a turn, and what is known of it."""
    turns = np.setdiff1d(np.arange(np.floor(10 * SECONDS + c * SECONDS**2 / 2)), damage["missing"])
    pulses = SimpleNamespace(
        turns=turns,
        times=turns / 10 if not c else (np.sqrt(100 + 2 * c * turns) - 10) / c,
        turn_at=lambda t: 10 * t + c * t**2 / 2,
        level=2.0,
        hysteresis=0.5,
        jitter_deg=0.25,
        **damage,
    )
    t = np.arange(int(SECONDS * RATE)) / RATE
    samples = np.where(pulses.turn_at(t) % 1 < 0.05, 5.0, 0.0).view(OnDisk)
    return figure_tacho(Channel("tacho", samples), RATE, pulses).axes, pulses


def curve(ax, label):
    (line,) = (line for line in ax.lines if line.get_label() == label)
    return line.get_xdata()


def test_a_tacho_with_damage():
    (signal, speed), pulses = drawn(0.8, missing=np.array([200.0, 250.0]), double=np.array([18.0]))
    gap = np.interp(200, pulses.turns, pulses.times)
    assert np.mean(signal.get_xlim()) == pytest.approx(gap, abs=0.01)
    assert np.diff(pulses.turn_at(np.array(signal.get_xlim()))) == pytest.approx(4.0, rel=1e-3)
    np.testing.assert_array_equal(curve(signal, "pulses"), pulses.times)
    np.testing.assert_allclose(curve(signal, "missing, bridged: 2")[0], gap)
    np.testing.assert_array_equal(curve(signal, "double, left out: 1"), [18.0])
    rpm = speed.lines[0]
    np.testing.assert_allclose(rpm.get_ydata(), 60 * (10 + 0.8 * rpm.get_xdata()), rtol=1e-3)
    assert signal.get_title() == "jitter 0.25° (standard deviation of a pulse)"
