"""Intervals of the exercises of [S] with a known truth: most contain it, as printed and redrawn."""

import tomllib
import warnings

import numpy as np
import pytest
from repetitions import FULL

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


def redrawn(task, path, rng):
    """The exact table of an exercise at other frequencies, near its own, in two digits as the book has it."""
    file = read_harmonic_model(FOLDER / task / "model.toml")
    data = read_measurements(FOLDER / task / "data.csv", file)
    model, n = file.model, len(data)
    w = np.array([float(f"{x:.3g}") for x in data.frequencies * rng.uniform(0.9, 1.1, n)])
    theta = np.array([TRUTHS[task][name] for name in model.parameters])
    inputs = {name: data.signals[name] for name in model.inputs}
    columns = {"frequency_rad_s": [f"{x:g}" for x in w]}
    for name, z in {**inputs, **model.predict(theta, w, inputs)}.items():
        digits = 12 if name in inputs else 2
        columns[f"{name}_re"] = [f"{x:.{digits}g}" for x in z.real]
        columns[f"{name}_im"] = [f"{x:.{digits}g}" for x in z.imag]
    rows = [",".join(columns), *map(",".join, zip(*columns.values(), strict=True))]
    path.write_text("\n".join(rows), encoding="utf-8")
    return path


FORCED = ("task_1_1", "task_2_1", "task_3_1", "task_4_3", "task_5_1", "section_1_6")


@pytest.mark.full
@pytest.mark.parametrize("task", FORCED)
def test_intervals_of_redrawn_tables_of_two_digits_hold(task, tmp_path):
    rng, inside = np.random.default_rng(7), []
    for _ in range(500 if FULL else 30):
        inside += held(task, redrawn(task, tmp_path / "data.csv", rng)).values()
    print(f"{task}: {np.mean(inside):.3f} of {len(inside)}")
    assert np.mean(inside) > (0.9 if FULL else 0.8)
