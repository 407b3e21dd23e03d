"""Intervals of the exercises of [S] with a known truth: most contain it, as printed and redrawn."""

import tomllib
import warnings

import numpy as np
import pytest

from rotorid.files import read_harmonic_model, read_measurements
from rotorid.identify import identify
from rotorid.samples import sample_data

FOLDER = sample_data() / "identify"
TRUTHS = {
    path.parent.name: tomllib.loads(path.read_text(encoding="utf-8"))["truth"]
    for path in sorted(FOLDER.glob("*/expected.toml"))
}


def held(task, table):
    """Of each parameter that has an interval, whether this contains the truth."""
    file = read_harmonic_model(FOLDER / task / "model.toml")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = identify(file.model, read_measurements(table, file), start=file.start or None)
    if found.ci95 is None:
        return {}
    return {
        name: low <= TRUTHS[task][name] <= high
        for name, (low, high) in zip(found.parameters, found.ci95, strict=True)
        if np.isfinite(low)
    }


@pytest.mark.full
def test_intervals_of_the_printed_tables_hold():
    inside = {
        (task, name): holds
        for task in TRUTHS
        for name, holds in held(task, FOLDER / task / "data.csv").items()
    }
    lost = [key for key, holds in inside.items() if not holds]
    print(f"{len(inside) - len(lost)} of {len(inside)} intervals hold; not {lost}")
    assert len(inside) == 53
    assert len(lost) <= 3, lost
