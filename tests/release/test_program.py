"""A typed program of a stranger runs; `.ci/run` checks its types against the installed wheel."""

import subprocess
import sys
from pathlib import Path

PROGRAM = Path(__file__).with_name("program.py")


def test_it_runs_and_finds_what_the_samples_are_known_for(tmp_path):
    done = subprocess.run(
        [sys.executable, str(PROGRAM)], capture_output=True, text=True, cwd=tmp_path, check=True
    )
    speed, weights, judgement, problems = done.stdout.splitlines()
    assert speed == "1291.5 rpm"  # of the reference rotor, which ROSS gives too
    assert weights == "{'left': 423, 'middle': 304, 'right': 448}"  # g·mm, as `rotorid balance` prints
    assert judgement.startswith("Mount these weights")
    assert "nowhere.toml: expected a file that exists" in problems
