"""Start-up in a fresh process: what a person waits for before anything happens, beside NumPy's own import."""

import subprocess
import sys

from benchmarks.timing import Row, best_of

PEER = ("-c", "import numpy, scipy.linalg")
TASKS = {
    "import rotorid": (("-c", "import rotorid"), 2.0),
    "rotorid --help": (("-m", "rotorid", "--help"), 0.5),
}
"""Words of each command line, and the ratio that it must reach."""


def seconds(words: tuple[str, ...]) -> float:
    command = [sys.executable, *words]
    return best_of(lambda: None, lambda _: subprocess.run(command, check=True, capture_output=True), 9)


def run() -> list[Row]:
    peer = seconds(PEER)
    return [
        Row(f"{name}, whole process", "rotorid", seconds(words), PEER[1], peer, 0.0, 0.0, required)
        for name, (words, required) in TASKS.items()
    ]
