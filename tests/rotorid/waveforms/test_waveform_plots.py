"""Pictures of waveforms: what is drawn lies where closed forms say."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest

from rotorid.waveforms.plots import (
    BLANK,
    figure_of,
    figure_orbit,
    figure_tacho,
)
from rotorid.waveforms.record import Channel, WaveformRecord

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


def record(tacho, sensors, most=None, factor=1e-6, derivative=0):
    """Sensors by name: complex amplitudes by order, in 1/factor."""
    t = np.arange(int(tacho.seconds * RATE)) / RATE
    angle = 2 * np.pi * tacho.turn_at(t)
    channels = []
    for name, orders in sensors.items():
        values = sum(np.real(A * np.exp(1j * order * angle)) for order, A in orders.items())
        samples = values if most is None else OnDisk(values, most)
        channels.append(Channel(name, samples, factor, derivative))
    return WaveformRecord("run", "file.wav", RATE, None, tuple(channels))


@pytest.fixture(scope="module")
def steady():
    return Pulses(25.0, 0.0, 20.0)


@pytest.fixture(scope="module")
def run_up():
    return Pulses(10.0, 0.8, 60.0)


def curves(ax, label):
    return [line for line in ax.lines if line.get_label() == label]


def circle(radius, orders=(1,)):
    return {"X": dict.fromkeys(orders, radius), "Y": dict.fromkeys(orders, -1j * radius)}


def test_the_mark_on_an_orbit_is_blank_and_then_bright(steady):
    figure = figure_orbit(record(steady, circle(30.0), most=1000), steady, 4.01)
    (orbit,) = figure.axes
    assert orbit.get_aspect() == 1.0
    assert (orbit.get_xlabel(), orbit.get_ylabel()) == ("X, µm", "Y, µm")
    for label in ("as measured", "1×"):
        (line,) = curves(orbit, label)
        z = line.get_xdata() + 1j * line.get_ydata()
        turn = steady.turn_at((int(4.04 * RATE) + np.arange(z.size)) / RATE)
        blank = np.isnan(z)
        assert not blank[(turn % 1 < 1 - BLANK - 0.006) & (turn % 1 > 0.001)].any()
        assert blank[(turn % 1 > 1 - BLANK + 0.001)].all()
        np.testing.assert_allclose(z[~blank], 30 * np.exp(2j * np.pi * turn[~blank]), atol=0.2)
    for dots in (line for line in orbit.lines if line.get_marker() == "o"):
        np.testing.assert_allclose([dots.get_xdata(), dots.get_ydata()], [[30.0] * 4, [0.0] * 4], atol=0.1)
    assert orbit.get_title().startswith("1500 rpm, at 4.04 s")


def test_only_1x_is_filtered(steady):
    made = record(steady, circle(30.0, orders=(1, 2)))
    orbit = figure_orbit(made, steady, 4.0).axes[0]
    (measured,), (first,) = curves(orbit, "as measured"), curves(orbit, "1×")
    assert np.nanmax(measured.get_xdata()) == pytest.approx(60, rel=1e-2)
    assert np.nanmax(first.get_xdata()) == pytest.approx(30, rel=1e-2)


@pytest.mark.parametrize(
    ("x", "y", "words"),
    [
        (30.0, -20j, "forward whirl, with the rotation"),
        (30.0, 20j, "backward whirl, against the rotation"),
        (30.0, 0.1j, "nearly along a line"),
    ],
)
def test_which_way_it_whirls(steady, x, y, words):
    figure = figure_orbit(record(steady, {"X": {1: x}, "Y": {1: y}}), steady, 1.0)
    assert figure.axes[0].get_title().endswith(f"1×: {words}, if Y stands 90° after X")


def test_orbits_that_cannot_be_drawn(steady):
    made = record(steady, circle(1.0))
    other = replace(made, sensors=(made.sensors[0], replace(made.sensors[1], derivative=1)))
    with pytest.raises(ValueError, match="'X' and 'Y' measure different quantities"):
        figure_orbit(other, steady, 1.0)


def test_the_last_turns_are_drawn_where_none_are_after_them(steady):
    """Pulses end at 19.96 s."""
    made = record(steady, circle(1.0))
    assert figure_orbit(made, steady, 19.95).axes[0].get_title().startswith("1500 rpm, at 19.8 s")


def test_the_picture_that_is_asked_for(run_up):
    """The orbit is drawn where 1× is largest, and never beyond the last turn."""
    signal = tacho_signal(run_up, 10**6)
    made = replace(record(run_up, circle(5.0)), tacho=signal)
    times = np.array([10.0, 30.0, 59.99])
    for sizes, at in (((1, 3, 2), 30.0), ((1, 2, 3), 59.93)):
        found = SimpleNamespace(
            tacho=run_up,
            sensors=("X", "Y"),
            orders=(1, 3),
            times=times,
            vectors=np.array(sizes)[:, None, None] * np.ones((3, 2, 2)),
        )
        title = figure_of("orbit", made, found).axes[0].get_title()
        assert float(title.split("at ")[1].split()[0]) == pytest.approx(at, abs=0.15)
    assert figure_of("tacho", made, found).axes[0].get_ylabel() == "tacho, as recorded"
    found.sensors = ("X",)
    with pytest.raises(ValueError, match=r"file.wav: an orbit needs two sensors; there is only 'X'"):
        figure_of("orbit", made, found)


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
