"""How a correction is shown: JSON types, tables, text and pictures."""

import re
from dataclasses import replace

import numpy as np
import pytest
from balancing_data import GRAM, bruel_kjaer, complex_normal, job, synthetic

from balancing import Labels, ReadingErrors, correct, estimate_influence
from balancing.printed_readings import largest_readings

ERRORS = ReadingErrors(0.02, np.deg2rad(1))


def test_speeds_in_the_unit_of_the_readings():
    trials, _, _ = synthetic(np.random.default_rng(3), speeds=2)
    labels = replace(trials.labels, speed_unit="Hz")
    answer = correct(
        estimate_influence(replace(trials, speeds=np.array([40, 51]) * np.pi, labels=labels))
    ).answer
    assert " at 20 Hz " in answer.whole()
    assert " rpm" not in answer.whole()
    [table] = [one for one in answer.tables if one.startswith("Vibration")]
    assert [row.split()[0] for row in table.splitlines()[1::4]] == ["Hz", "20", "25.5"]


def two_planes(ratio, seed=0):
    """Planes of which the second does `ratio` times what the first does, but for 4 %; the right weights."""
    rng = np.random.default_rng(seed)
    w, U = complex_normal(rng, 8), complex_normal(rng, 2) * GRAM
    W = np.column_stack((w, ratio * w + 0.04 * complex_normal(rng, 8))) / GRAM
    T = np.vstack((np.zeros(2), np.eye(2), [0.5, -0.5j])) * GRAM
    read = (T + U) @ W.T
    read = read * (1 + 0.01 * complex_normal(rng, read.shape))
    return job(read[:, None], T, errors=ReadingErrors(0.01, 0.01)), -U


@pytest.mark.parametrize("ratio", [1.0, 0.6 + 0.5j])
def test_what_two_planes_do_together_is_determined_and_told_first(ratio):
    told, inside = 0, 0
    for seed in range(50):
        trials, D = two_planes(ratio, seed)
        c = correct(estimate_influence(trials), refuse=False)
        if not c.combination:
            continue
        told += 1
        first = c.sentence().replace("Static", "static").replace("Planes", "planes")
        assert c.combination in first
        assert ("static part" in c.combination) == (ratio == 1)
        assert not any("act alike" in words for words in c.warnings)
        # the statement by its printed numbers, against the truth
        size, within, angle = re.search(r"([\d.e-]+) ± ([\d.e-]+) \S+ at ([\d.]+)°", c.combination).groups()
        stated = float(size) * np.exp(1j * np.radians(float(angle)))
        true = c.labels.weight_scale * (D[0] + (1 if ratio == 1 else ratio) * D[1])
        inside += abs(stated - true) <= float(within) * 1.1 + 0.02 * abs(true)
        assert float(c.combination.rsplit("± ", 1)[1].split()[0]) > 3 * float(within)
    assert told >= 10
    assert inside >= 0.85 * told


def test_planes_that_are_told_apart_have_their_own_weights():
    c = correct(estimate_influence(bruel_kjaer(errors=ERRORS)))
    assert c.combination == ""
    assert c.sentence().startswith("Mount these weights: rms ")


def test_the_largest_readings_come_first():
    before, after = np.array([[3e-6, 2e-6]]), np.array([[2e-7, 1e-6]])
    words = largest_readings(Labels("um", 1e6), np.array([100 * np.pi]), ("DE", "NDE"), before, after)
    assert words == ", µm peak: NDE at 3000 rpm 2.00 → 1.00; DE at 3000 rpm 3.00 → 0.200."
