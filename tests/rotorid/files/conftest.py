"""One small job in a folder of its own, and what a job file beside it says."""

import pytest
from tables_data import RUNS, WEIGHTS, write_csv

from rotorid.files import read_job

TABLES = 'runs = "runs.csv"\nweights = "weights.csv"\n'


@pytest.fixture
def folder(tmp_path):
    """Two trial runs of two planes and two sensors."""
    write_csv(tmp_path / "runs.csv", RUNS)
    write_csv(tmp_path / "weights.csv", WEIGHTS)
    return tmp_path


@pytest.fixture
def job(folder):
    """Reads a job file of these lines, which follow those that name runs and weights."""

    def read(lines="", head=TABLES, **options):
        (folder / "job.toml").write_text(f"{head}{lines}\n", encoding="utf-8")
        return read_job(folder / "job.toml", **options)

    return read
