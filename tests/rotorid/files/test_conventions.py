"""How a job says in which direction its angles count, and from which end the rotor is seen."""

from __future__ import annotations

import numpy as np
import pytest

CLOCKWISE = 'rotation = "clockwise"\nview = "drive end"\n'


def test_errors_of_weights_and_drift(job):
    errors = "{ placement_deg = 3, placement_percent = 2, drift_percent = 1, run_percent = 4 }"
    trials = job(f"errors = {errors}\n").trials
    assert trials.placement == pytest.approx((0.02, np.radians(3)))
    assert (trials.drift, trials.run_errors, trials.errors) == (0.01, (0.04, 0.0), None)


def test_another_word_instead_of_that_of_the_job(job):
    read = job('angles = "clockwise"\n' + CLOCKWISE, angles="against rotation")
    assert (read.conventions.labels.angle_sign, read.trials.labels.angle_words) == (-1, "against rotation")
    read = job(CLOCKWISE, angles="counter-clockwise")
    assert (read.conventions.labels.angle_sign, read.trials.labels.angle_words) == (-1, "counter-clockwise")
    read = job('angles = "against"\n')
    assert (read.conventions.labels.angles, read.trials.labels.assumed) == ("against rotation", ("phase",))
    assert job("", angles="with").conventions.labels.angles == "with rotation"
    with pytest.raises(ValueError, match="angles that count clockwise need the direction of rotation"):
        job("", angles="clockwise")
