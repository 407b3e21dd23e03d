"""Run benchmarks and print the table; exit status 1 if answers differ or a required ratio is missed.

Without names: one row of each task that people choose a program by. `--all`: every row of every benchmark.
"""

from __future__ import annotations

import argparse
import importlib
import os
import platform
from importlib.metadata import version
from pathlib import Path

TASKS = ("critical_speeds", "unbalance_response", "campbell", "balancing_solvers", "time_fit")
EVERYTHING = ("startup", *TASKS, "small_models", "calibrate", "growth")

PAGE = """# Benchmarks

`make bench` runs rotorid and its peers side by side on five tasks; `make bench-all` makes this page. Answers
are compared before anything is timed; times are the shortest of several calls in one thread, each on a fresh
model. The exponent is p of cost ∝ size^p.

Measured with {machine}.

|task|ms|compared with|its ms|ratio|difference|
|---|--:|---|--:|--:|--:|
"""


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(EVERYTHING))
    parser.add_argument("--all", action="store_true", help="every row")
    parser.add_argument("--page", type=Path, metavar="FILE", help="where the table goes as Markdown")
    options = parser.parse_args()
    if unknown := set(options.names) - set(EVERYTHING):
        parser.error(f"no benchmark is called {min(unknown)!r}; there are: {', '.join(EVERYTHING)}")
    print(__import__("benchmarks").__doc__)
    versions = f"NumPy {version('numpy')}, SciPy {version('scipy')}"
    machine = f"Python {platform.python_version()}, {versions}, {os.cpu_count()} processors"
    print(f"{machine}\n")
    print(f"{'task':58}{'ms':>9}  {'peer':29}{'ms':>10}{'ratio':>9}{'needed':>8}{'difference':>12}")
    rows = []
    for name in options.names or (EVERYTHING if options.all else TASKS):
        module = importlib.import_module(f"benchmarks.{name}")
        every = (options.names or options.all) and hasattr(module, "run")
        for row in module.run() if every else [module.task()]:
            rows.append(row)
            verdict = row.failure or (f"below the goal of {row.goal:g}" if row.ratio < row.goal else "")
            print(
                f"{row.task:58}{1e3 * row.our_seconds:9.3f}  {row.peer:29}"
                f"{1e3 * row.peer_seconds:10.2f}{row.ratio:9.3g}{row.required_ratio:8.3g}"
                f"{row.difference:12.1e}  {verdict}  {row.note}".rstrip(),
                flush=True,
            )
    if options.page is not None:
        lines = [
            f"|{row.task}|{1e3 * row.our_seconds:.3g}|{row.peer}|{1e3 * row.peer_seconds:.3g}|"
            f"{row.ratio:.3g}|{row.difference:.1e}|\n"
            for row in rows
        ]
        options.page.write_text(PAGE.format(machine=machine) + "".join(lines))
    return int(any(row.failure for row in rows))


if __name__ == "__main__":
    raise SystemExit(main())
