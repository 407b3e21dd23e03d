"""A balancing job from its file to its sheet: correct, choose pieces in the holes, judge, write.

`rotorid.commands.balance` does what `rotorid balance` does. Run `python examples/balance_workflow.py
[sheet.html]`.
"""

from __future__ import annotations

import sys
from pathlib import Path

from rotorid.commands.balance import BalanceOptions, balance

JOB = Path(__file__).parents[1] / "sample_data" / "turbo_job" / "holes.toml"
LIMIT = "3"  # µm peak-to-peak, of every probe at every speed


def main(sheet: str | None = None) -> dict[str, float]:
    """Print the corrections and what to mount; write the sheet if a file is given; return numbers."""
    found = balance(JOB, BalanceOptions(split=True, limit=[LIMIT]))
    print(found.summary())
    if sheet is not None:
        Path(sheet).write_bytes(found.sheet())
    mounting, rows = found.document["mounting"], found.document["verdict"]["rows"]
    return {
        "holes": len(mounting["holes"]),
        "largest_after_um_pp": mounting["max_after"],
        "readings_that_pass": sum(row["verdict"] == "pass" for row in rows),
    }


if __name__ == "__main__":
    main(*sys.argv[1:2])
