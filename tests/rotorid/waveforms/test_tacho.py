"""The tacho: turns counted over damaged pulses, edges, polarity, marks of several pulses."""

import numpy as np
import pytest

from rotorid.waveforms.record import Channel, TachoSettings
from rotorid.waveforms.tacho import read_tacho

RATE = 5120.0
T = np.arange(int(20 * RATE)) / RATE
START = 0.3
TURNS = START + 12 * T + T**2
"""12 to 52 turns a second."""


def pulses(at=(0.0,), wide=0.05):
    return 5.0 * np.any([(TURNS - place) % 1 < wide for place in at], axis=0)


def read(samples, **settings):
    return read_tacho(Channel("KEY", samples), RATE, TachoSettings(**settings))


def offsets(tacho, zero=0.0):
    """Turns found less exact ones, of the angle throughout, but for whole turns."""
    t = T[(tacho.span[0] < T) & (tacho.span[1] > T)]
    off = tacho.turn_at(t) - (TURNS[(tacho.span[0] < T) & (tacho.span[1] > T)] - zero)
    return off - np.round(off.mean())


def test_the_angle_is_far_more_exact_than_an_edge():
    tacho = read(pulses())
    # an edge is off by half a sample at most, uniformly: 0.6° at 30 turns a second
    assert tacho.jitter_deg == pytest.approx(
        360 * np.median(12 + 2 * tacho.times) / RATE / np.sqrt(12), rel=0.06
    )
    assert abs(offsets(tacho)).max() * 360 < 0.25
    assert np.all(np.diff(tacho.turns) == 1)
    assert tacho.warnings == ()


@pytest.mark.parametrize(
    ("edge", "zero", "low"),
    [
        ("leading", 0.0, 1),
        ("rising", 0.0, 0),
        ("trailing", 0.05, 0),
        ("falling", 0.05, 0),
        ("centre", 0.025, 1),
    ],
)
def test_edges_of_a_mark_and_of_a_notch(edge, zero, low):
    for samples in (pulses(), *[5.0 - pulses()] * low):
        tacho = read(samples, edge=edge)
        assert abs(offsets(tacho, zero)).max() * 360 < 0.25
        assert tacho.warnings == ()


def test_a_mark_of_half_a_turn_is_said():
    (words,) = read(pulses(wide=0.5)).warnings
    assert "either level may be the mark" in words


def damaged(missing=0, double=0, seed=1):
    rng = np.random.default_rng(seed)
    samples, last = pulses(), int(TURNS[-1])
    for turn in rng.choice(np.arange(4, last - 4), missing, replace=False):
        samples[(turn - 0.01 <= TURNS) & (turn + 0.06 > TURNS)] = 0
    for turn in rng.choice(np.arange(4, last - 4), double, replace=False):
        where = turn + rng.uniform(0.15, 0.9)
        samples[(where <= TURNS) & (where + 0.04 > TURNS)] = 5
    return samples


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("missing", "double"), [(12, 0), (0, 12), (12, 12)])
def test_missing_and_double_pulses_are_bridged_and_counted(missing, double, seed):
    tacho = read(damaged(missing, double, seed))
    assert abs(offsets(tacho)).max() * 360 < 0.5
    (words,) = tacho.warnings
    assert "missing" in words if missing else "too many" in words
    # a pulse too many in the turn of a missing one may stand for it, off by a part of a turn
    assert abs(len(tacho.missing) - missing) <= min(missing, double)
    assert abs(len(tacho.double) - double) <= min(missing, double)


def test_even_pulses_leave_the_turn_open_and_uneven_ones_do_not():
    even = read(pulses((0, 0.5)), pulses=2)
    assert not even.indexed
    assert "multiples of 180°" in even.warnings[0]
    assert min(abs(offsets(even, zero)).max() for zero in (0, 0.5)) * 360 < 0.3
    uneven = read(pulses((0, 0.4)), pulses=2)
    assert uneven.indexed
    assert abs(offsets(uneven)).max() * 360 < 0.3  # the gap from 0.4 to 1 is the longest


def test_a_wheel_that_lacks_a_tooth():
    teeth = 5.0 * ((TURNS * 12 % 1 < 0.5) & (TURNS % 1 < 11 / 12))
    tacho = read(teeth, pulses=12, edge="rising")
    assert tacho.indexed
    assert len(tacho.missing) == 0
    assert abs(offsets(tacho)).max() * 360 < 0.3


def test_pulses_between_samples_are_an_offset_that_no_mean_takes_away():
    turns = START + (RATE / 160) * T  # 160 samples a turn: every edge is between the same two
    tacho = read(5.0 * (turns % 1 < 0.05))
    assert tacho.offset_s == pytest.approx(1 / RATE / np.sqrt(12))
    assert read(pulses()).offset_s < 0.05 / RATE  # all places between two samples occur
    turns = START + (RATE / 160.3) * T  # ten of them
    assert read(5.0 * (turns % 1 < 0.05)).offset_s == pytest.approx(0.1 / RATE / np.sqrt(12), rel=0.2)


TURN = TURNS % 1
BOUNCES = 5.0 * ((TURN < 0.02) | ((TURN > 0.025) & (TURN < 0.03)) | ((TURN > 0.034) & (TURN < 0.05)))


@pytest.mark.parametrize(
    ("samples", "settings", "words"),
    [
        (np.zeros(10000), {}, "has no pulses: it reads 0 throughout"),
        (5.0 * (0.3 * T % 1 < 0.05), {}, "at least 8 are needed"),
        (np.where((T > 8) & (T < 8.6), 0.0, pulses()), {}, "is silent from 7.989 to 8.618 s, about 18"),
        (BOUNCES, {}, r"only \d+ of 1\d\d\d pulses of the tacho 'KEY' follow each other"),
    ],
)
def test_what_does_not_tell_turns_is_refused(samples, settings, words):
    with pytest.raises(ValueError, match=words):
        read(samples, **settings)


def test_a_wrong_number_of_uneven_pulses_is_said():
    (words,) = read(pulses((0, 0.4)), pulses=1).warnings
    assert words.startswith(
        "the tacho's pulses scatter by 36° around even turns: are there other marks than 1"
    )


def test_a_machine_that_stands_at_first_and_at_last_is_silent_without_a_word():
    turns = np.where(T < 3, 0.2, 0.2 + np.clip(T - 3, 0, 8) ** 2)
    turns = np.where(T > 11, turns + 16 * np.clip(T - 11, 0, 6) - 16 / 12 * np.clip(T - 11, 0, 6) ** 2, turns)
    assert read(5.0 * (turns % 1 < 0.05)).warnings == ()


@pytest.mark.parametrize(("polarity", "edge"), [(-1.0, "falling"), (1.0, "rising")])
def test_a_magnetic_pickup_is_read_where_it_is_steep(polarity, edge):
    place = ((TURNS + 0.5) % 1 - 0.5) / 0.02
    signal = polarity * place * np.exp(-(place**2) / 2) * (12 + 2 * T)
    signal += 0.02 * np.random.default_rng(0).standard_normal(len(T))
    with pytest.raises(
        ValueError, match=r"rests near .* and its pulses go both ways, as of a magnetic pickup"
    ):
        read(signal)
    tacho = read(signal, edge=edge)
    assert abs(offsets(tacho)).max() * 360 < 0.1
    assert tacho.warnings == ()
