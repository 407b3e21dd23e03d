"""Shared by all tests: the command line run in this process."""

import json
import os
import sys
from dataclasses import dataclass

import pytest

# Small matrices gain nothing from threads, and lose a hundredfold where cores are busy; before NumPy loads.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import hypothesis

import rotorid.cli

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
    """Run `rotorid ARGS`; returns exit status, standard output and standard error."""

    def run(*args):
        monkeypatch.setattr(sys, "argv", ["rotorid", *map(str, args)])
        capsys.readouterr()
        with pytest.raises(SystemExit) as stop:
            rotorid.cli.main()
        captured = capsys.readouterr()
        code = stop.value.code
        return Outcome(0 if code is None else code, captured.out, captured.err)

    return run


# Files that take longest for a single test begin, so that no worker ends with them: the pages, built once,
# and the simulations.
SLOW_FIRST = ("docs", "harmonic_coverage", "balancing_coverage", "balancing_discrete", "fem_campbell")


def pytest_collection_modifyitems(items):
    """Slow files first, otherwise in the order of the files."""

    def rank(item):
        stem = item.path.stem.removeprefix("test_")
        return SLOW_FIRST.index(stem) if stem in SLOW_FIRST else len(SLOW_FIRST)

    items.sort(key=rank)
