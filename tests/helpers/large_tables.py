"""Runs and weights of many rows: `python tests/helpers/large_tables.py FOLDER CHANNELS AGAIN REPEATS`.

CHANNELS readings (ten sensors at each speed) of a bare run, of two trial runs and of the bare run AGAIN
times, each read REPEATS times.
"""

import sys
from pathlib import Path

import numpy as np

SENSORS = 10


def write(folder, channels, again=0, repeats=1):
    """Write runs.csv and weights.csv."""
    rng = np.random.default_rng(1)
    runs = {"bare": (0, 0), "trial A": (10, 0), "trial B": (0, 10j)}
    runs |= {f"bare {k + 2}": (0, 0) for k in range(again)}
    drawn = rng.standard_normal((2, channels, 3))
    W, Y0 = (drawn[0] + 1j * drawn[1])[:, :2], 20 * (drawn[0] + 1j * drawn[1])[:, 2]
    lines = ["run,speed_rpm,sensor,repeat,amplitude_um,phase_deg"]
    for run, mounted in runs.items():
        for k in range(channels):
            for repeat in range(repeats):
                error = 0.01 * complex(*rng.standard_normal(2))
                y = (Y0[k] + W[k] @ np.array(mounted)) * (1 + error)
                place = f"{run},{1000 * 1.01 ** (k // SENSORS):.3f},s{k % SENSORS},{repeat + 1}"
                lines.append(f"{place},{abs(y):.4f},{np.degrees(np.angle(y)) % 360:.2f}")
    (folder / "runs.csv").write_text("\n".join([*lines, ""]), encoding="utf-8")
    weights = "run,plane,mass_g,angle_deg\ntrial A,A,10,0\ntrial B,B,10,90\n"
    (folder / "weights.csv").write_text(weights, encoding="utf-8")


if __name__ == "__main__":
    write(Path(sys.argv[1]), *map(int, sys.argv[2:]))
