"""Pictures of waveforms: what is drawn lies where closed forms say."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from rotorid.waveforms.plots import figure_tacho
from rotorid.waveforms.record import Channel

RATE = 2560.0


@dataclass(frozen=True, eq=False)
class Pulses:
    """What is known of a shaft: frequency f0 + c t, turns exact, one pulse a turn."""

    f0: float
    c: float
    seconds: float
    missing: np.ndarray = field(default_factory=lambda: np.zeros(0))
    double: np.ndarray = field(default_factory=lambda: np.zeros(0))
    level: float = 2.0
    hysteresis: float = 0.5
    jitter_deg: float = 0.25
    late: float = 0.0

    def turn_at(self, t):
        return self.f0 * t + self.c * t**2 / 2

    @property
    def turns(self):
        whole = np.arange(np.floor(self.turn_at(self.seconds)))
        return whole[~np.isin(whole, self.missing)]

    @property
    def times(self):
        n = self.turns + self.late / 360
        if not self.c:
            return n / self.f0
        return (np.sqrt(self.f0**2 + 2 * self.c * n) - self.f0) / self.c


class OnDisk:
    """Samples of which only short stretches may be read."""

    def __init__(self, values, most):
        self.values, self.most, self.read = values, most, 0

    def __len__(self):
        return len(self.values)

    def __getitem__(self, where):
        part = self.values[where]
        assert len(part) <= self.most
        self.read += len(part)
        return part


@pytest.fixture(scope="module")
def steady():
    return Pulses(25.0, 0.0, 20.0)


def curves(ax, label):
    return [line for line in ax.lines if line.get_label() == label]


def tacho_signal(pulses, most):
    t = np.arange(int(pulses.seconds * RATE)) / RATE
    return Channel("tacho", OnDisk(np.where(pulses.turn_at(t) % 1 < 0.05, 5.0, 0.0), most))


def test_a_tacho_with_damage():
    pulses = Pulses(10.0, 0.8, 20.0, np.array([200.0, 250.0]), np.array([18.0]), late=0.5)
    figure = figure_tacho(tacho_signal(pulses, 1200), RATE, pulses)
    signal, speed = figure.axes
    gap = np.interp(200, pulses.turns, pulses.times)
    first, last = signal.get_xlim()
    assert (first + last) / 2 == pytest.approx(gap, abs=0.01)
    assert pulses.turn_at(last) - pulses.turn_at(first) == pytest.approx(4.0, rel=1e-3)
    (found,) = curves(signal, "pulses")
    np.testing.assert_array_equal(found.get_xdata(), pulses.times)
    assert set(found.get_ydata()) == {2.0}
    (missing,) = curves(signal, "missing, bridged: 2")
    np.testing.assert_allclose(missing.get_xdata()[0], gap)
    np.testing.assert_array_equal(curves(signal, "double, left out: 1")[0].get_xdata(), [18.0])
    rpm = speed.lines[0]
    np.testing.assert_allclose(rpm.get_ydata(), 60 * (10 + 0.8 * rpm.get_xdata()), rtol=1e-3)
    assert signal.get_title() == "jitter 0.25° (standard deviation of a pulse)"
    labels = [ax.get_ylabel() for ax in figure.axes]
    assert labels == ["tacho, as recorded", "speed, rpm"]


def test_a_sound_tacho_is_shown_in_the_middle(steady):
    signal = figure_tacho(tacho_signal(steady, 700), RATE, steady).axes[0]
    assert np.mean(signal.get_xlim()) == pytest.approx(10.0, abs=0.05)
    assert curves(signal, "missing, bridged: 0")
