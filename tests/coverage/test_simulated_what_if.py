"""What is predicted for given weights holds as often as it says; what is said to get worse does."""

import coverage_what_if as example
import numpy as np
from repetitions import FULL, highest_share, lowest_share


def test_predictions_hold_and_nobody_is_warned_in_vain():
    found = [example.simulate(200 if FULL else 40, source) for source in example.balance.SOURCES[:4]]
    readings, rms, below, said, wrongly = (np.concatenate(each) for each in zip(*found, strict=True))
    jobs = len(rms)
    assert lowest_share(jobs, 0.93) <= np.mean(readings) <= highest_share(jobs, 0.97)
    assert lowest_share(jobs, 0.93) <= np.mean(rms) <= highest_share(jobs, 0.97)
    assert np.mean(below) >= lowest_share(jobs, 0.95)
    assert np.mean(wrongly) <= highest_share(len(wrongly), 0.05)
    assert np.mean(said) >= lowest_share(len(said), 0.75)
