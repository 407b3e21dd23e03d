"""Start-up in a fresh process: what a person waits for before anything happens."""

import subprocess
import sys

from benchmarks.timing import Row, best_of

LIMITS = {
    "import rotorid": (("-c", "import rotorid"), 0.3),
    "rotorid --help": (("-m", "rotorid", "--help"), 0.5),
}


def run() -> list[Row]:
    rows = []
    for name, (words, limit) in LIMITS.items():
        command = [sys.executable, *words]
        seconds = best_of(
            lambda: None, lambda _, c=command: subprocess.run(c, check=True, capture_output=True), 5
        )
        rows.append(Row(f"{name}, whole process", "rotorid", seconds, "limit", limit, 0.0, 0.0, 1.0))
    return rows
