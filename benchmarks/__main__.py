"""Run benchmarks and print the table; exit status 1 if answers differ or a required ratio is missed.

Without names: one row of each task that people choose a program by. `--all`: every row of every benchmark.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import platform
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

from benchmarks.timing import Row

TASKS = ("critical_speeds", "unbalance_response", "campbell", "balancing_solvers", "time_fit")
EVERYTHING = (
    "startup",
    *TASKS,
    "identification",
    "balancing_discrete",
    "reduction",
    "motion",
    "calibrate",
    "vectors",
)


def measured(names: list[str], every: bool) -> Iterator[Row]:
    """The first row of each task, or all rows of the benchmarks named, one by one."""
    for name in names or (EVERYTHING if every else TASKS):
        module = importlib.import_module(f"benchmarks.{name}")
        if names or every:
            yield from module.run()
        else:
            yield module.task()


def verdict(row: Row) -> str:
    if not row.agrees:
        return f"  ANSWERS DIFFER by more than {row.allowed:.0e}"
    if not row.fast_enough:
        return "  TOO SLOW"
    return f"  below the goal of {row.goal:g}" if row.ratio < row.goal else ""


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(EVERYTHING))
    parser.add_argument("--all", action="store_true", help="every row")
    parser.add_argument("--json", type=Path, metavar="FILE", help="where the rows are stored")
    options = parser.parse_args()
    if unknown := set(options.names) - set(EVERYTHING):
        parser.error(f"no benchmark is called {min(unknown)!r}; there are: {', '.join(EVERYTHING)}")
    import numpy
    import scipy

    print(__import__("benchmarks").__doc__)
    machine = (
        f"Python {platform.python_version()}, NumPy {numpy.__version__}, SciPy {scipy.__version__}, "
        f"{os.cpu_count()} processors"
    )
    print(f"{machine}\n")
    print(f"{'task':56}{'':16}{'ms':>9}  {'peer':29}{'ms':>10}{'ratio':>9}{'needed':>8}{'difference':>12}")
    rows = []
    for row in measured(options.names, options.all):
        rows.append(row)
        print(
            f"{row.task:56}{row.ours:16}{1e3 * row.our_seconds:9.3f}  {row.peer:29}"
            f"{1e3 * row.peer_seconds:10.2f}{row.ratio:9.3g}{row.required_ratio:8.3g}"
            f"{row.difference:12.1e}{verdict(row)}{'  ' if row.note else ''}{row.note}",
            flush=True,
        )
    if options.json is not None:
        document = {"machine": machine, "rows": [asdict(row) for row in rows]}
        options.json.write_text(json.dumps(document, indent=1) + "\n")
    return int(not all(row.agrees and row.fast_enough for row in rows))


if __name__ == "__main__":
    raise SystemExit(main())
