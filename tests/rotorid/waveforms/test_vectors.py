"""Vectors of drawn records: exact answers by integration, errors, damage, filters."""

from dataclasses import replace

import numpy as np
import pytest
from coverage_vectors import NOISE, RATE, accuracy, machine, record
from scipy.signal import butter, sosfilt

from rotorid.waveforms.record import Channel, SignalPath, TachoSettings, WaveformRecord
from rotorid.waveforms.vectors import find_vectors

FINE = 10240.0
"""Samples a second where derivatives are drawn by differences, which are exact to 1e-6 there."""
VECTOR = 20e-6 * np.exp(0.5j)
LARGEST = 95e-6
"""Of the run-up."""


@pytest.fixture(scope="module")
def run():
    """The run-up, which keeps what it integrated: all records have the same instants."""
    turning, kept = machine(), {}

    def vector(times):
        key = np.asarray(times).tobytes()
        return kept[key] if key in kept else kept.setdefault(key, turning.vector(times))

    return replace(turning, vector=vector)


@pytest.fixture(scope="module")
def fine(run):
    """Turns of a run-up, and the displacement."""
    t = times(60, FINE)
    turns = run.turns(t)
    return turns, (run.vector(t) * np.exp(2j * np.pi * turns)).real


def with_sensor(measured, samples, **more):
    return replace(measured, sensors=(Channel("A", samples, **more),))


def errors(run, measured, **options):
    """Of 1× inside the run-up, as shares of the largest vector."""
    found = find_vectors(measured, TachoSettings(), **options)
    inside = (found.times > 2) & (found.times < 58)
    return abs(found.vectors[inside, 0, 0] - run.vector(found.times[inside])) / LARGEST


def steady(turns, x, noise=0.0, seed=0, derivative=0, rate=RATE):
    """A record of a sensor that reads x, or this vector, with noise."""
    x = (x * np.exp(2j * np.pi * turns)).real if np.iscomplexobj(x) else x
    x = x + noise * np.random.default_rng(seed).standard_normal(len(x))
    tacho = Channel("T", 5.0 * (turns % 1 < 0.05))
    return WaveformRecord("run", "file", rate, tacho, (Channel("A", x, 1.0, derivative),))


def times(seconds, rate=RATE):
    return np.arange(int(rate * seconds)) / rate


@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.full) for k in (1, 2))])
def test_a_run_up_through_a_resonance(run, seed):
    found = accuracy(run, seed)
    assert max(found.rms / 0.06, found.largest / 0.25, found.ends / 0.6, abs(found.offset) / 0.1) <= 1
    assert 0.9 <= (found.along + found.across) / 2 <= 0.99  # ± twice too wide would hold all


def test_second_order_gap_and_overall(run):
    found = find_vectors(record(run, 5), TachoSettings(), (1, 2))
    middle = slice(10, -10)
    twice = found.vectors[middle, 0, 1]
    assert twice.mean() == pytest.approx(1.5e-6 * np.exp(0.3j), rel=0.02)
    assert np.max(abs(twice - 1.5e-6 * np.exp(0.3j)) / found.radial[middle, 0, 1]) < 5
    assert abs(found.gap).max() < 0.5e-6
    assert np.all(found.overall[:, 0, 0] > 0.9 * abs(run.vector(found.times)))


def test_chosen_speeds(run):
    speeds = np.array([900.0, 1500.0, 3000.0]) * np.pi / 30
    found = find_vectors(record(run, 6), TachoSettings(), speeds=speeds)
    assert found.speeds == pytest.approx(speeds, rel=1e-4)
    assert abs(found.vectors[:, 0, 0] - run.vector(found.times)).max() < 0.3e-6
    with pytest.raises(ValueError, match=r"no speed of 4000 rpm: the record runs from 60\d\.\d+ to 359\d"):
        find_vectors(record(run, 6), TachoSettings(), speeds=np.array([4000.0]) * np.pi / 30)


def test_the_error_of_white_noise_is_that_of_least_squares():
    stated, t = [], times(20)
    for seed in range(8):
        turns = 25.3 * t + 0.003 * np.sin(2 * np.pi * 0.3 * t) + seed / 8
        found = find_vectors(steady(turns, VECTOR + 0 * t, 5e-6, seed), TachoSettings())
        stated.append(found.radial[0, 0, 0])
        assert abs(found.vectors[0, 0, 0] - VECTOR) < 4 * stated[-1]
    assert np.mean(stated) == pytest.approx(5e-6 * np.sqrt(2 / (20 * RATE)), rel=0.12)


@pytest.mark.parametrize("derivative", [1, 2])
def test_velocities_and_accelerations_are_integrated(run, fine, derivative):
    turns, y = fine
    for _ in range(derivative):  # differences of fourth order
        y = (np.roll(y, 2) - 8 * np.roll(y, 1) + 8 * np.roll(y, -1) - np.roll(y, -2)) * FINE / 12
    y[:8] = y[-8:] = 0
    noise = NOISE * (2 * np.pi * 30) ** derivative
    measured = steady(turns, y, noise, 1, derivative, FINE)
    assert errors(run, measured, derivative=0).max() < 0.0015
    found = find_vectors(measured, TachoSettings(), derivative=0, speeds=2 * np.pi * np.array([30.0]))
    assert abs(found.vectors[:, 0, 0] / run.vector(found.times) - 1).max() < 2e-3
    assert np.isnan(found.gap).all()
    assert np.isnan(found.overall).all()


@pytest.mark.parametrize(
    "path", [SignalPath(2 * np.pi, 1), SignalPath(6 * np.pi, 2), SignalPath(delay_s=10 / RATE)]
)
def test_what_stands_before_the_samples_is_taken_off(run, path):
    """An AC coupling, and a delay."""
    measured = record(run, 7)
    samples = measured.sensors[0].samples
    if path.high_pass_rad_s:
        corner = path.high_pass_rad_s / (2 * np.pi)
        samples = sosfilt(butter(path.high_pass_order, corner, "high", fs=RATE, output="sos"), samples)
    late = np.concatenate((np.zeros(round(path.delay_s * RATE)), samples))[: len(samples)]
    assert errors(run, with_sensor(measured, late, path=path)).max() < 0.0025
    assert errors(run, with_sensor(measured, late)).max() > 0.02


def test_damaged_channels_are_said_or_refused(run):
    measured = record(run, 9)
    x = measured.sensors[0].samples
    noise = 1e-6 * np.random.default_rng(1).standard_normal(len(x))
    for samples, words in (
        (x, ""),
        (np.round(x / 2e-6) * 2e-6, ""),  # some hundred steps
        (np.clip(x, -9, 60e-6), "'A' is clipped at 6e-05"),
        (noise, "cannot be told from noise"),
    ):
        warnings = find_vectors(with_sensor(measured, samples), TachoSettings()).warnings
        assert any(words in word for word in warnings) if words else warnings == ()
    with pytest.raises(ValueError, match="reads 0 throughout: it is dead or not connected"):
        find_vectors(with_sensor(measured, 0 * x), TachoSettings())
    with pytest.raises(ValueError, match="a tacho channel is needed"):
        find_vectors(replace(measured, tacho=None), TachoSettings())
    with pytest.raises(ValueError, match="50× is 2999 Hz at the highest speed"):
        find_vectors(measured, TachoSettings(), (1, 50))


def test_a_vector_that_moves_at_a_steady_speed_is_said():
    t = times(20)
    (words,) = find_vectors(steady(25.3 * t, VECTOR * (1 + 0.02 * t), 1e-7), TachoSettings()).warnings
    assert words.startswith("1× of 'A' moves by up to 1")


def test_stiff_filters_do_not_round():
    turns = 57.40985 * times(20) + 0.2
    measured = steady(turns, VECTOR + 0 * turns, 1e-6)
    found = find_vectors(measured, TachoSettings())
    part = slice(*(round(at * RATE) for at in found.tacho.span))
    plain = 2 * np.mean(measured.sensors[0].samples[part] * np.exp(-2j * np.pi * turns[part]))
    assert abs(abs(found.vectors[0, 0, 0]) - abs(plain)) < 0.1 * found.radial[0, 0, 0]


@pytest.mark.parametrize("seconds", [2.0, 4.0])
def test_a_resonance_that_is_passed_within_few_turns(seconds):
    fast = machine(seconds=seconds)  # 2.1 and 4.3 turns within the half-power points
    found = find_vectors(record(fast, 1, seconds), TachoSettings())
    exact = fast.vector(found.times)
    turned = (found.vectors[:, 0, 0] - exact) * np.exp(-1j * np.angle(exact))
    assert abs(turned).max() < 0.02 * abs(exact).max()
    assert np.mean(abs(turned.real) < 1.96 * found.radial[:, 0, 0]) > 0.9
    assert np.mean(abs(turned.imag) < 1.96 * found.tangential[:, 0, 0]) > 0.9
    assert found.warnings == ()


def test_one_that_is_passed_within_a_turn_is_said():
    (words,) = find_vectors(record(machine(seconds=1.0), 1, 1.0), TachoSettings()).warnings
    assert words.startswith("1× of 'A' is hardly told along the run-up")


@pytest.mark.parametrize("rate", [1024.0, 2048.0, 25600.0])
@pytest.mark.parametrize("turns", [9.5, 48.7])
def test_a_short_record_of_a_steady_speed_is_one_vector(rate, turns):
    """2,924 to 2,940 rpm in a second: edges between coarse samples scatter by more than the speed changes."""
    t = times(turns / 48.7, rate)
    for seed in range(3):
        at = 2924 / 60 * t + 16 / 60 * t**2 / 2 + np.random.default_rng(seed).uniform()
        found = find_vectors(steady(at, VECTOR + 0 * t, 1e-6, seed, rate=rate), TachoSettings())
        assert found.steady
        assert len(found.times) == 1
        error = abs(found.vectors[0, 0, 0] - VECTOR)
        assert error < 4 * np.hypot(found.radial[0, 0, 0], found.tangential[0, 0, 0])
        assert found.warnings == ()


def test_a_short_run_up_is_none():
    t = times(1)  # 2940 to 3060 rpm
    assert not find_vectors(steady(49 * t + t**2, VECTOR + 0 * t, 1e-6), TachoSettings()).steady
