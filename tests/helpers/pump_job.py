"""A pump with two planes and two sensors, its tables written in many ways: files, trials, jobs, refusals."""

from __future__ import annotations

import numpy as np
import pytest

from rotorid.files import InputError, read_job, read_trials

LONG = [
    ("as found", "DE", 5.62, 182),
    ("as found", "NDE", 4.28, 25),
    ("trial P1", "DE", 10.4, 202),
    ("trial P1", "NDE", 3.01, 57),
    ("trial P2", "DE", 3.58, 189),
    ("trial P2", "NDE", 9.91, 45),
]
WIDE = [(one[0], *one[2:], *two[2:]) for one, two in zip(LONG[::2], LONG[1::2], strict=True)]


def rows(header, row, values=WIDE):
    """A table: a header, and a line for each of the values."""
    return header + "\n" + "".join(row.format(*each) + "\n" for each in values)


PUMP = rows("run,speed_rpm,sensor,amplitude_mm_s,phase_deg", "{},1485,{},{},{}", LONG)
WEIGHTS = "run,plane,mass_g,angle_deg\ntrial P1,P1,10,90\ntrial P2,P2,10,270\n"
JOB = 'runs = "runs.csv"\nweights = "weights.csv"\n'
EIGHT_HOLES = f"{JOB}[planes.P1]\nholes = 8\n[planes.P2]\nholes = 8\n"


def write(folder, **texts):
    """Tables as CSV files of their names."""
    for name, text in texts.items():
        (folder / f"{name}.csv").write_text(text, encoding="utf-8")


def trials_of(folder, runs=PUMP, weights=None, phase="lag", **options):
    """The trials of two tables."""
    write(folder, runs=runs, **({} if weights is None else {"weights": weights}))
    return read_trials(
        folder / "runs.csv", None if weights is None else folder / "weights.csv", phase=phase, **options
    )


def job_of(folder, settings=EIGHT_HOLES, phase="lag", **texts):
    """A job of these settings and tables."""
    write(folder, **{"runs": PUMP, "weights": WEIGHTS} | texts)
    stated = "" if phase is None else f'phase = "{phase}"\n'
    (folder / "job.toml").write_text(f'{stated}angles = "with rotation"\n{settings}', encoding="utf-8")
    return read_job(folder / "job.toml")


def refused(read, *args, **options):
    """The message of a refusal."""
    with pytest.raises(InputError) as caught:
        read(*args, **options)
    return str(caught.value)


def assert_same(trials, other):
    """Names, units, numbers and digits are the same."""
    for name in ("runs", "sensors", "planes", "labels"):
        assert getattr(trials, name) == getattr(other, name)
    for name in ("readings", "weights", "speeds", "steps"):
        np.testing.assert_allclose(getattr(trials, name), getattr(other, name), rtol=1e-13, atol=1e-17)
