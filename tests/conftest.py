"""Shared by all tests: the command line run in this process."""

import functools
import json
import os
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest
import typer.main

# Small matrices gain nothing from threads, and lose a hundredfold where cores are busy; before NumPy loads.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import hypothesis

import balancing.solvers.correction_methods
import balancing.solvers.monte_carlo
import rotorid.cli

# typer makes the commands anew for every command line; once is enough for all those of a worker.
typer.main.get_command = functools.cache(typer.main.get_command)

FEWER_DRAWS = functools.partial(balancing.solvers.monte_carlo.sampled_covariance, draws=100)

# The suite is the same on every machine; HYPOTHESIS_PROFILE=search looks at new examples every time.
hypothesis.settings.register_profile("suite", derandomize=True, deadline=None)
hypothesis.settings.register_profile("search", deadline=None)
hypothesis.settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "suite"))


@dataclass
class Outcome:
    code: int
    out: str
    err: str

    @property
    def json(self):
        return json.loads(self.out, parse_constant=lambda name: pytest.fail(f"{name} in JSON"))


@pytest.fixture
def cli(capsys, monkeypatch):
    """Run `rotorid ARGS`; returns exit status, standard output and standard error.

    Errors of weights that are drawn come from 100 draws instead of 400.
    """
    monkeypatch.setattr(balancing.solvers.correction_methods, "sampled_covariance", FEWER_DRAWS)

    def run(*args):
        monkeypatch.setattr(sys, "argv", ["rotorid", *map(str, args)])
        capsys.readouterr()
        with pytest.raises(SystemExit) as stop:
            rotorid.cli.main()
        captured = capsys.readouterr()
        code = stop.value.code
        return Outcome(0 if code is None else code, captured.out, captured.err)

    return run


# The files that take longest begin, so that no worker ends with them: stored outputs, the pages, simulations.
SLOW_FIRST = (
    "golden/test_balance.py",
    "golden/test_models.py",
    "golden/test_rotor.py",
    "rotorid/report/test_browser.py",
    "rotorid/report/test_balance.py",
    "rotorid/harmonic/test_coverage.py",
    "balancing/correction/test_coverage.py",
    "rotorid/calibration/test_calibration_study.py",
    "rotorid/worksheet/test_worksheet_page.py",
    "rotorid/worksheet/test_worksheet_server.py",
    "rotorid/report/test_rotor.py",
    "fem/matrices/test_lateral_planes.py",
    "fuzz/test_mutants.py",
    "fem/test_campbell.py",
)
TESTS = Path(__file__).parent


def pytest_collection_modifyitems(items):
    """Slow files first, otherwise in the order of the files."""

    def rank(item):
        name = item.path.relative_to(TESTS).as_posix()
        return SLOW_FIRST.index(name) if name in SLOW_FIRST else len(SLOW_FIRST)

    items.sort(key=rank)
