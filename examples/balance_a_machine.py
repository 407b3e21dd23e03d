"""From trial runs to weights in holes, a check run, and the trim after it.

Run `python examples/balance_a_machine.py [PICTURE.png]`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import balancing
from rotorid import read_job
from rotorid.plots import plot

FOLDER = Path(__file__).parents[1] / "sample_data" / "turbo_job"


def main(picture: str | None = None) -> dict[str, float]:
    """Print what to mount; return its key numbers."""
    # Trial runs: influence coefficients, and the weights that leave the least vibration.
    job = read_job(FOLDER / "holes.toml")
    influence = balancing.estimate_influence(job.trials)
    correction = balancing.correct(influence)
    print(correction.summary(), end="\n\n")

    # Each plane has twelve holes and five equal pieces: the best choice for all planes together.
    mounted = balancing.mount(correction, influence, None, job.holes)
    print(mounted.summary(), end="\n\n")

    # A check run with weights on a plain rotor: did they do what they promised?
    checked = read_job(FOLDER / "checked.toml")
    assert checked.check is not None
    check = balancing.compare_check(correction, checked.check, influence)
    print(check.summary(), end="\n\n")

    # The check run is one more run to learn from; trim is what to add to what is mounted now.
    refined = balancing.refine(checked.trials, checked.check, correction)
    better = balancing.correct(refined)
    run, planes, _ = better.mounted
    print(f"Trim, to be added to the weights of run {run!r}:")
    for plane, weight in zip(planes, better.to_add, strict=True):
        print(f"  {plane:7} {1e6 * abs(weight):6.2f} g·mm at {np.angle(weight, deg=True) % 360:5.1f}°")

    if picture is not None:
        plot(correction).figure.savefig(picture)
    return {
        "left_g_mm": 1e6 * float(abs(correction.weights[0])),
        "left_deg": float(np.angle(correction.weights[0], deg=True)),
        "largest_before_um_pp": 2e6 * float(np.abs(correction.before).max()),
        "largest_after_um_pp": 2e6 * float(np.abs(correction.after).max()),
        "largest_with_pieces_um_pp": 2e6 * float(np.abs(mounted.after).max()),
        "largest_in_check_um_pp": 2e6 * float(np.abs(check.achieved).max()),
        "trim_left_g_mm": 1e6 * float(abs(better.to_add[0])),
    }


if __name__ == "__main__":
    main(*sys.argv[1:2])
