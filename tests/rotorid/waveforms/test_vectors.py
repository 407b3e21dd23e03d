"""Vectors of drawn records: exact answers by integration, errors, damage, filters."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from repetitions import FULL
from scipy.integrate import solve_ivp
from scipy.signal import butter, sosfilt

from coverage_vectors import NOISE, RATE, accuracy, machine, main, record
from rotorid.waveforms.record import Channel, SignalPath, TachoSettings, WaveformRecord
from rotorid.waveforms.vectors import find_vectors

FINE = 10240.0
"""Samples a second where derivatives are drawn by differences, which are exact to 1e-6 there."""


def integrated(*given, **options):
    """As the example integrates, but to 1e-9 of the largest vector instead of 1e-11: in half the time."""
    return solve_ivp(*given, **({**options, "rtol": 1e-6}))


def remembered(function):
    """The same function of times, which keeps what it gave: all records have the same instants."""
    known = {}

    def of(times):
        key = np.asarray(times).tobytes()
        if key not in known:
            known[key] = function(times)
        return known[key]

    return of


@pytest.fixture(scope="module", autouse=True)
def _integrated():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("coverage_vectors.solve_ivp", integrated)
        yield


@pytest.fixture(scope="module")
def run(_integrated):
    turning = machine()
    return replace(turning, vector=remembered(turning.vector))


@pytest.fixture(scope="module")
def fine(run):
    """Times of a run-up, its turns then, and the displacement."""
    t = np.arange(int(FINE * 60)) / FINE
    turns = run.turns(t)
    return t, turns, (run.vector(t) * np.exp(2j * np.pi * turns)).real


@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.full) for k in (1, 2))])
def test_a_run_up_through_a_resonance(run, seed):
    found = accuracy(run, seed)
    assert found.rms <= 0.06
    assert found.largest <= 0.25
    assert found.ends <= 0.6
    assert abs(found.offset) <= 0.1
    assert 0.9 <= (found.along + found.across) / 2 <= 0.99  # ± twice too wide would hold all


@pytest.mark.full
def test_a_speed_that_ripples_and_the_table_of_the_page(run, capsys, monkeypatch):
    """Whose numbers are the worst of ten records, this one among them."""
    monkeypatch.setattr("coverage_vectors.machine", lambda r: machine(r) if r else run)
    main(1)
    printed = capsys.readouterr().out.splitlines()
    page = (Path(__file__).parents[3] / "docs" / "sure.md").read_text(encoding="utf-8")
    shown = page.split("```text\n")[1].split("```")[0].splitlines()
    assert printed[0].partition(" ")[2] == shown[0].partition(" ")[2]
    assert printed[1] == shown[1]
    assert [line.split()[:2] for line in printed[2:]] == [line.split()[:2] for line in shown[2:]]
    one, ten = (np.array([line.split()[2:6] for line in lines[2:]], float) for lines in (printed, shown))
    assert (one <= ten + 1e-3).all()
    assert (ten[:, :2] <= [[0.06, 0.25], [0.15, 0.6]]).all()
    assert (ten[:, 2:] <= [0.6, 0.1]).all()


def test_second_order_gap_and_overall(run):
    found = find_vectors(record(run, 5), TachoSettings(), (1, 2))
    middle = slice(10, -10)
    twice = found.vectors[middle, 0, 1]
    assert np.abs(twice.mean()) == pytest.approx(1.5e-6, rel=0.01)
    assert np.degrees(np.angle(twice.mean())) == pytest.approx(np.degrees(0.3), abs=1)
    assert np.max(np.abs(twice - 1.5e-6 * np.exp(0.3j)) / found.radial[middle, 0, 1]) < 5
    assert np.abs(found.gap).max() < 0.5e-6
    size = np.abs(run.vector(found.times))
    assert np.all(found.overall[:, 0, 0] > 0.9 * size)
    assert found.end[[0, -1]].tolist() == [True, True] or not found.end[1:-1].any()


def test_chosen_speeds(run):
    speeds = np.array([900.0, 1500.0, 3000.0]) * np.pi / 30
    found = find_vectors(record(run, 6), TachoSettings(), speeds=speeds)
    assert found.speeds == pytest.approx(speeds, rel=1e-4)
    assert np.abs(found.vectors[:, 0, 0] - run.vector(found.times)).max() < 0.3e-6
    with pytest.raises(ValueError, match=r"no speed of 4000 rpm: the record runs from 60\d\.\d+ to 359\d"):
        find_vectors(record(run, 6), TachoSettings(), speeds=np.array([4000.0]) * np.pi / 30)


def steady(x, turns, path=None, derivative=0, rate=RATE):
    sensor = Channel("A", x, 1.0, derivative, path or SignalPath())
    return WaveformRecord("run", "file", rate, Channel("T", 5.0 * (turns % 1 < 0.05)), (sensor,))


VECTOR = 20e-6 * np.exp(0.5j)


def drawn(seed, kind):
    """A steady record with noise of a kind, and the mean vector during it."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(RATE * 20)) / RATE
    turns = 25.3 * t + 0.003 * np.sin(2 * np.pi * 0.3 * t) + rng.uniform()
    vector = VECTOR * np.ones(len(t), dtype=complex)
    noise = 5e-6 * rng.standard_normal(len(t))
    if kind == "coloured":  # another machine beside it, at about the same speed
        band = butter(1, (24.0, 27.0), "band", fs=RATE, output="sos")
        noise = 10 * sosfilt(band, noise)
    if kind == "wandering":
        vector = VECTOR * (1 + 0.05 * np.sin(2 * np.pi * t / 9 + seed))
    x = (vector * np.exp(2j * np.pi * turns)).real + noise
    return steady(x, turns), vector.mean()


@pytest.mark.full
@pytest.mark.parametrize("kind", ["white", "coloured", "wandering"])
def test_stated_errors_of_a_steady_record_hold(kind):
    pulls = []
    for seed in range(60 if FULL else 30):
        measured, vector = drawn(seed, kind)
        found = find_vectors(measured, TachoSettings())
        assert found.steady
        assert len(found.times) == 1
        turned = (found.vectors[0, 0, 0] - vector) * np.exp(-0.5j)
        pulls += [turned.real / found.radial[0, 0, 0], turned.imag / found.tangential[0, 0, 0]]
    assert np.mean(np.abs(pulls) < 1.96) > 0.9
    if kind != "wandering":  # whose mean during the record is known better than that of another
        assert np.std(pulls) == pytest.approx(1, abs=0.2)


def test_the_error_of_white_noise_is_that_of_least_squares():
    found = [find_vectors(drawn(seed, "white")[0], TachoSettings()).radial[0, 0, 0] for seed in range(8)]
    assert np.mean(found) == pytest.approx(5e-6 * np.sqrt(2 / (20 * RATE)), rel=0.12)


@pytest.mark.parametrize("derivative", [1, 2])
def test_velocities_and_accelerations_are_integrated(run, fine, derivative):
    (t, turns, x), h = fine, 1 / FINE
    if derivative == 1:
        y = (-np.roll(x, -2) + 8 * np.roll(x, -1) - 8 * np.roll(x, 1) + np.roll(x, 2)) / (12 * h)
    else:
        y = (-np.roll(x, -2) + 16 * np.roll(x, -1) - 30 * x + 16 * np.roll(x, 1) - np.roll(x, 2)) / (
            12 * h**2
        )
    y[:4] = y[-4:] = 0
    noise = NOISE * (2 * np.pi * 30) ** derivative * np.random.default_rng(1).standard_normal(len(t))
    found = find_vectors(steady(y + noise, turns, None, derivative, FINE), TachoSettings(), derivative=0)
    exact = run.vector(found.times)
    inside = (found.times > 2) & (found.times < 58)
    assert np.abs(found.vectors[inside, 0, 0] - exact[inside]).max() < 0.0015 * np.abs(exact).max()
    assert np.isnan(found.gap).all()
    assert np.isnan(found.overall).all()


@pytest.mark.parametrize(("order", "corner"), [(1, 1.0), (2, 3.0)])
def test_an_ac_coupling_is_taken_off(run, order, corner):
    measured = record(run, 7)
    sensor = measured.sensors[0]
    coupled = sosfilt(butter(order, corner, "high", fs=RATE, output="sos"), sensor.samples)
    known = Channel("A", coupled, path=SignalPath(2 * np.pi * corner, order))

    def worst(channel):
        found = find_vectors(replace(measured, sensors=(channel,)), TachoSettings())
        inside = (found.times > 2) & (found.times < 58)
        return np.abs(found.vectors[inside, 0, 0] - run.vector(found.times[inside])).max() / 95e-6

    assert worst(known) < 0.0025
    assert worst(replace(known, path=SignalPath())) > 0.02


def test_a_delay_is_taken_off(run):
    measured = record(run, 8)
    late = np.concatenate((np.zeros(10), measured.sensors[0].samples[:-10]))
    sensor = Channel("A", late, path=SignalPath(delay_s=10 / RATE))
    found = find_vectors(replace(measured, sensors=(sensor,)), TachoSettings())
    inside = (found.times > 2) & (found.times < 58)
    assert np.abs(found.vectors[inside, 0, 0] - run.vector(found.times[inside])).max() < 0.0025 * 95e-6


def test_damaged_channels_are_said_or_refused(run):
    measured = record(run, 9)
    x = measured.sensors[0].samples

    def with_samples(samples):
        return find_vectors(replace(measured, sensors=(Channel("A", samples),)), TachoSettings())

    assert with_samples(x).warnings == ()
    assert any("'A' is clipped at 6e-05" in word for word in with_samples(np.clip(x, -9, 60e-6)).warnings)
    rounded = with_samples(np.round(x / 2e-6) * 2e-6)  # some hundred steps
    assert rounded.warnings == ()
    with pytest.raises(ValueError, match="reads 0 throughout: it is dead or not connected"):
        with_samples(0 * x)
    noise = 1e-6 * np.random.default_rng(1).standard_normal(len(x))
    assert "cannot be told from noise" in with_samples(noise).warnings[0]
    with pytest.raises(ValueError, match="a tacho channel is needed"):
        find_vectors(replace(measured, tacho=None), TachoSettings())
    with pytest.raises(ValueError, match="50× is 2999 Hz at the highest speed"):
        find_vectors(measured, TachoSettings(), (1, 50))


def test_a_vector_that_moves_at_a_steady_speed_is_said():
    t = np.arange(int(RATE * 20)) / RATE
    turns = 25.3 * t
    x = (VECTOR * (1 + 0.02 * t) * np.exp(2j * np.pi * turns)).real
    x += 1e-7 * np.random.default_rng(1).standard_normal(len(t))
    (words,) = find_vectors(steady(x, turns), TachoSettings()).warnings
    assert words.startswith("1× of 'A' moves by up to 1")


def noisy(turns, vector, noise, seed, rate=RATE):
    x = (vector * np.exp(2j * np.pi * turns)).real
    return steady(x + noise * np.random.default_rng(seed).standard_normal(len(x)), turns, rate=rate)


@pytest.mark.parametrize("turns", [9.5, 12.5, 21.5, 45.5])
def test_a_short_record(turns):
    t = np.arange(int(RATE * turns / 25.3)) / RATE
    found = find_vectors(noisy(25.3 * t + 0.4, VECTOR, 1e-6, 0), TachoSettings())
    error = abs(found.vectors[0, 0, 0] - VECTOR)
    assert error < 4 * np.hypot(found.radial[0, 0, 0], found.tangential[0, 0, 0])
    assert error < 0.01 * abs(VECTOR)


@pytest.mark.full
@pytest.mark.parametrize(("seconds", "noise"), [(1.0, 1e-6), (20.0, 1e-7)])
def test_stated_errors_of_a_steady_phase_hold_where_the_tacho_is_the_bottleneck(seconds, noise):
    pulls = []
    for seed in range(40 if FULL else 20):
        rng = np.random.default_rng(seed)
        turns = rng.uniform(15, 60) * np.arange(int(RATE * seconds)) / RATE + rng.uniform()
        found = find_vectors(noisy(turns, VECTOR, noise, seed), TachoSettings())
        pulls.append((found.vectors[0, 0, 0] * np.exp(-0.5j)).imag / found.tangential[0, 0, 0])
    assert np.mean(np.abs(pulls) < 1.96) >= 0.93


def test_stiff_filters_do_not_round():
    for seed in range(4):
        turns = 57.40985 * np.arange(int(RATE * 20)) / RATE + 0.2
        measured = noisy(turns, VECTOR, 1e-6, seed)
        found = find_vectors(measured, TachoSettings())
        begin, end = (round(at * RATE) for at in found.tacho.span)
        part = slice(begin, end)
        plain = 2 * np.mean(measured.sensors[0].samples[part] * np.exp(-2j * np.pi * turns[part]))
        assert abs(abs(found.vectors[0, 0, 0]) - abs(plain)) < 0.1 * found.radial[0, 0, 0]


@pytest.mark.parametrize("derivative", [1, 2])
def test_a_steady_speed_integrates_with_its_mean(derivative):
    turns = 30.3 * np.arange(int(RATE * 10)) / RATE + 0.3
    vector = VECTOR * (2j * np.pi * 30.3) ** derivative
    x = (vector * np.exp(2j * np.pi * turns)).real
    found = find_vectors(steady(x, turns, derivative=derivative), TachoSettings(), derivative=0)
    assert abs(found.vectors[0, 0, 0]) == pytest.approx(abs(VECTOR), rel=5e-5)


@pytest.mark.full
def test_one_speed_that_is_asked_for_is_integrated_as_all_are(run, fine):
    t, turns, x = fine
    measured = steady(np.gradient(x, t), turns, None, 1, FINE)
    for speeds in ([30.0], [30.0, 30.0], [40.0, 30.0]):
        found = find_vectors(measured, TachoSettings(), derivative=0, speeds=2 * np.pi * np.array(speeds))
        assert np.abs(found.vectors[:, 0, 0] / run.vector(found.times) - 1).max() < 1e-3


def test_the_overall_level_is_over_whole_turns():
    t = np.arange(int(RATE * 20)) / RATE
    turns = 10 * t + t**2
    found = find_vectors(steady((VECTOR * np.exp(2j * np.pi * turns)).real, turns), TachoSettings())
    assert found.overall[:, 0, 0] == pytest.approx(abs(VECTOR), rel=0.01)
    assert found.overall[:, 0, 1] == pytest.approx(abs(VECTOR), rel=0.2)


@pytest.mark.parametrize("seconds", [2.0, 2.6, 4.0])
def test_a_resonance_that_is_passed_within_few_turns(seconds):
    fast = machine(seconds=seconds)  # 2.1 to 4.3 turns within the half-power points
    found = find_vectors(record(fast, 1, seconds), TachoSettings())
    exact = fast.vector(found.times)
    turned = (found.vectors[:, 0, 0] - exact) * np.exp(-1j * np.angle(exact))
    assert np.abs(turned).max() < 0.02 * np.abs(exact).max()
    assert np.mean(np.abs(turned.real) < 1.96 * found.radial[:, 0, 0]) > 0.9
    assert np.mean(np.abs(turned.imag) < 1.96 * found.tangential[:, 0, 0]) > 0.9
    assert found.warnings == ()


def test_one_that_is_passed_within_a_turn_is_said():
    fast = machine(seconds=1.0)
    (words,) = find_vectors(record(fast, 1, 1.0), TachoSettings()).warnings
    assert words.startswith("1× of 'A' is hardly told along the run-up")


def test_a_half_order_beside_1x_is_no_reason_for_finer_knots(run):
    measured = record(run, 3)
    t = np.arange(len(measured.sensors[0].samples)) / RATE
    half = 10e-6 * np.cos(np.pi * run.turns(t))
    sensor = Channel("A", measured.sensors[0].samples + half)
    found = find_vectors(replace(measured, sensors=(sensor,)), TachoSettings())
    inside = (found.times > 2) & (found.times < 58)
    error = np.abs(found.vectors[:, 0, 0] - run.vector(found.times))[inside]
    assert np.sqrt(np.mean(error**2)) < 0.003 * 95e-6


@pytest.mark.parametrize("rate", [1024.0, 2048.0, 2560.0, 25600.0])
def test_a_short_record_of_a_steady_speed_is_one_vector(rate):
    """2,924 to 2,940 rpm in a second: edges between coarse samples scatter by more than the speed changes."""
    t = np.arange(int(rate)) / rate
    for seed in range(3):
        rng = np.random.default_rng(seed)
        turns = 2924 / 60 * t + 16 / 60 * t**2 / 2 + rng.uniform()
        found = find_vectors(noisy(turns, VECTOR, 1e-6, seed, rate), TachoSettings())
        assert found.steady
        assert len(found.times) == 1
        error = abs(found.vectors[0, 0, 0] - VECTOR)
        assert error < 4 * np.hypot(found.radial[0, 0, 0], found.tangential[0, 0, 0])
        assert found.warnings == ()


def test_a_short_run_up_is_none(run):
    t = np.arange(int(RATE)) / RATE
    turns = 49 * t + 1.0 * t**2  # 2940 to 3060 rpm
    assert not find_vectors(noisy(turns, VECTOR, 1e-6, 0), TachoSettings()).steady
