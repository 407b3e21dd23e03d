"""Regions of the correction weights contain the truth as often as they say, or the program warns.

The tables of the example with fewer jobs. Bounds: a share that is at its requirement passes, by the binomial
distribution of so many jobs.
"""

from importlib import import_module

import coverage_balance as example
import coverage_special as special
import numpy as np
import pytest
import sure
from repetitions import FULL, highest_share, lowest_share


@pytest.fixture(scope="module")
def good():
    """Jobs whose errors are stated correctly or estimated, of every source and kind."""
    each = 100 if FULL else 10
    return [one for s in example.SOURCES[:4] for k in example.KINDS for one in example.simulate(each, s, k)]


def silent(found):
    return [one.inside for one in found if one.inside is not None and not one.words]


def warned(found):
    return [bool(one.words) for one in found if one.inside is not None]


def test_regions_of_jobs_without_a_warning(good):
    inside = silent(good)
    assert len(inside) > 0.8 * len(good)
    assert lowest_share(len(inside), 0.93) <= np.mean(inside) <= highest_share(len(inside), 0.97)


def test_good_jobs_are_seldom_warned(good):
    said = warned(good)
    assert np.mean(said) <= highest_share(len(said), 0.10)


def test_errors_twice_as_large_as_stated():
    """Spare runs tell of them, in most jobs by a warning, and widen the regions; else these are too small."""
    n = 500 if FULL else 200
    found = example.simulate(n // 3, "stated, spare runs", "independent", told=2.0)
    said = [bool(one.words) for one in found if one.inside is not None and one.redundant >= 8]
    assert np.mean(said) >= lowest_share(len(said), 0.80)
    inside = [one.inside for one in found if one.inside is not None]
    assert np.mean(inside) >= lowest_share(len(inside), 0.93)
    inside = silent(example.simulate(n // 2, "stated", "common to a run", told=2.0))
    assert np.mean(inside) < lowest_share(len(inside), 0.93)


def test_assumed_errors_that_are_not_too_small():
    inside = silent(example.every_kind(500 if FULL else 150, "assumed", errors=example.assumed(1.0)))
    assert np.mean(inside) >= lowest_share(len(inside), 0.93)


@pytest.mark.parametrize("name", ["balance", "special", "what_if", "without_phase"])
def test_the_tables_are_those_of_the_page(name, capsys):
    import_module(f"coverage_{name}").main(3)
    assert sure.titles(capsys.readouterr().out) == sure.titles("".join(sure.blocks(name)))


@pytest.mark.parametrize(("count", "before"), special.ROWS.values(), ids=special.ROWS)
def test_regions_of_unknown_trial_weights_and_of_rotors_on_arbors(count, before):
    rng = np.random.default_rng(5)
    inside = silent([special.outcome(rng, count, before=before) for _ in range(300 if FULL else 60)])
    assert lowest_share(len(inside), 0.93) <= np.mean(inside) <= highest_share(len(inside), 0.97)
