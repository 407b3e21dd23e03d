"""Start-up in a fresh process: what a person waits for before anything happens, beside NumPy's import."""

import subprocess
import sys

from benchmarks.timing import Row, best_of

PEER = ("-c", "import numpy, scipy.linalg")
TASKS = {("-c", "import rotorid"): 2.0, ("-m", "rotorid", "--help"): 0.5}  # and the ratio needed


def seconds(words: tuple[str, ...]) -> float:
    command = [sys.executable, *words]
    return best_of(lambda: None, lambda _: subprocess.run(command, check=True, capture_output=True), 9)


def run() -> list[Row]:
    peer = seconds(PEER)
    return [Row(" ".join(w), seconds(w), PEER[1], peer, 0.0, 0.0, r) for w, r in TASKS.items()]
