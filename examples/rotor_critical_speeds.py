"""A rotor from a table: critical speeds, Campbell diagram, response to unbalance, separation margins.

Run `python examples/rotor_critical_speeds.py [PICTURE.png]`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import fem
from rotorid import read_rotor, read_unbalance
from rotorid.plots import plot

FOLDER = Path(__file__).parents[1] / "sample_data" / "compressor"
RPM = np.pi / 30
OPERATING = (5300 * RPM, 6500 * RPM)


def main(picture: str | None = None) -> dict[str, float]:
    """Print the tables; return their key numbers."""
    rotor = read_rotor(FOLDER / "rotor.toml")
    modes = fem.critical_speeds(rotor, 3)
    print(modes.summary(), end="\n\n")

    # Frequencies and damping over speed: bearings and seal change with it, wheels turn as gyros.
    campbell = fem.campbell(rotor, np.arange(1000, 15001, 250) * RPM)
    print(campbell.summary(), end="\n\n")

    # The response to a given unbalance at a probe, and its peaks as API 684 judges them.
    unbalance = read_unbalance(FOLDER / "unbalance.csv", rotor)
    speeds = np.arange(1000, 15001, 20) * RPM
    response = fem.unbalance_response(rotor, unbalance, speeds)
    peaks = fem.response_peaks(response, ("probe DE", 45), operating=OPERATING)
    print(peaks.summary(), end="\n\n")

    # Where it would become unstable.
    stability = fem.stability_threshold(rotor, 14000 * RPM, lowest=1000 * RPM)
    print(stability.summary())

    if picture is not None:
        plot(campbell).figure.savefig(picture)
    first = peaks.peaks[0]
    assert first.amplification is not None
    return {
        "first_critical_rpm": float(modes.rpm[0]),
        "second_critical_rpm": float(modes.rpm[1]),
        "first_of_campbell_rpm": float(campbell.critical_speeds[0] / RPM),
        "peak_rpm": first.speed / RPM,
        "peak_um": 1e6 * first.amplitude,
        "amplification": first.amplification,
        "stability_threshold_rpm": float("nan") if stability.threshold is None else stability.threshold / RPM,
    }


if __name__ == "__main__":
    main(*sys.argv[1:2])
