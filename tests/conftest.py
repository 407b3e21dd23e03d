"""Shared by all tests: the command line run in this process, and browsers."""

import contextlib
import functools
import json
import os
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
import typer.main

# Small matrices gain nothing from threads, and lose a hundredfold where cores are busy; before NumPy loads.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import browser
import hypothesis

import rotorid.cli
from rotorid.samples import sample_data

# typer makes the commands anew for every command line; once is enough for all those of a worker.
typer.main.get_command = functools.cache(typer.main.get_command)

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


SAMPLES = sample_data().resolve()
PATCHED = "_setattr", "_setitem"
"""Where a MonkeyPatch keeps what it has changed."""
REPEATED: dict[tuple[str, ...], Outcome] = {}
"""What command lines gave that read samples only and write nothing: each runs once a session."""


def repeatable(words):
    """Whether a command line gives the same again, and nothing else."""
    if not words or words[0] in ("demo", "fleet", "study", "worksheet"):
        return False
    paths = [Path(word) for word in words if "/" in word or Path(word).suffix[1:].isalpha()]
    return bool(paths) and all(path.exists() and SAMPLES in path.resolve().parents for path in paths)


@pytest.fixture
def cli(capsys, monkeypatch):
    """Run `rotorid ARGS`; returns exit status, standard output and standard error."""

    def run(*args):
        words = tuple(map(str, args))
        patched = [one for name in PATCHED for one in getattr(monkeypatch, name) if one[:2] != (sys, "argv")]
        key = () if patched or not repeatable(words) else (os.getcwd(), *words)  # paths may be relative
        if key not in REPEATED:
            monkeypatch.setattr(sys, "argv", ["rotorid", *words])
            capsys.readouterr()
            with pytest.raises(SystemExit) as stop:
                rotorid.cli.main()
            captured = capsys.readouterr()
            code = stop.value.code
            outcome = Outcome(0 if code is None else code, captured.out, captured.err)
            if not key:
                return outcome
            REPEATED[key] = outcome
        return replace(REPEATED[key])

    return run


@pytest.fixture(scope="session")
def chromium(tmp_path_factory):
    """Browsers by number, each started when it is first asked for."""
    with contextlib.ExitStack() as stack:

        @functools.cache
        def started(number=0):
            opened = browser.session(tmp_path_factory.mktemp("profile"))
            stack.callback(opened.close)
            return opened

        yield started


# The files that take longest begin, so that no worker ends with them; the first compiles what moves, for all.
SLOW_FIRST = (
    "golden/test_rotor.py",
    "rotorid/worksheet/test_worksheet_page.py",
    "rotorid/worksheet/test_worksheet_server.py",
    "rotorid/waveforms/test_vectors.py",
    "rotorid/identify/test_record_residuals.py",
    "rotorid/motion/test_periodic.py",
    "rotorid/report/test_browser.py",
)
TESTS = Path(__file__).parent


def pytest_collection_modifyitems(items):
    """Slow files first, otherwise in the order of the files."""

    def rank(item):
        name = item.path.relative_to(TESTS).as_posix()
        return SLOW_FIRST.index(name) if name in SLOW_FIRST else len(SLOW_FIRST)

    items.sort(key=rank)
