"""Run benchmarks and print the table; exit status 1 if answers differ or a required ratio is missed."""

from __future__ import annotations

import importlib
import json
import os
import platform
import sys
from dataclasses import asdict
from pathlib import Path

BENCHMARKS = (
    "startup",
    "critical_speeds",
    "unbalance_response",
    "campbell",
    "identification",
    "time_fit",
    "balancing_solvers",
    "balancing_discrete",
    "reduction",
    "motion",
    "calibrate",
    "vectors",
)


def main(names: list[str]) -> int:
    store = None
    if "--json" in names:
        at = names.index("--json")
        if at + 1 == len(names):
            print("--json takes the name of a file", file=sys.stderr)
            return 2
        store, names = Path(names[at + 1]), names[:at] + names[at + 2 :]
    unknown = [name for name in names if name not in BENCHMARKS]
    if unknown:
        print(f"no benchmark is called {unknown[0]!r}; there are: {', '.join(BENCHMARKS)}", file=sys.stderr)
        return 2
    import numpy
    import scipy

    print(__import__("benchmarks").__doc__)
    machine = (
        f"Python {platform.python_version()}, NumPy {numpy.__version__}, SciPy {scipy.__version__}, "
        f"{os.cpu_count()} processors"
    )
    print(f"{machine}\n")
    rows = []
    head = f"{'task':56}{'':16}{'ms':>9}  {'peer':29}{'ms':>10}{'ratio':>9}{'needed':>8}{'difference':>12}"
    print(head)
    failed = False
    for name in names or BENCHMARKS:
        for row in importlib.import_module(f"benchmarks.{name}").run():
            rows.append(row)
            verdict = ""
            if not row.agrees:
                verdict = f"  ANSWERS DIFFER by more than {row.allowed:.0e}"
            elif not row.fast_enough:
                verdict = "  TOO SLOW"
            failed |= bool(verdict)
            print(
                f"{row.task:56}{row.ours:16}{1e3 * row.our_seconds:9.3f}  {row.peer:29}"
                f"{1e3 * row.peer_seconds:10.2f}{row.ratio:9.3g}{row.required_ratio:8.0f}"
                f"{row.difference:12.1e}{verdict}{'  ' if row.note else ''}{row.note}",
                flush=True,
            )
    if store is not None:
        document = {"machine": machine, "rows": [asdict(row) for row in rows]}
        store.write_text(json.dumps(document, indent=1) + "\n")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
