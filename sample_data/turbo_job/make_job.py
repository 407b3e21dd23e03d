"""Makes the sheet of this job: a simulated rotor with an unbalance that the sheet does not show.

    python sample_data/turbo_job/make_job.py

writes runs.csv and weights.csv beside this file, and the check run (check.csv, check_weights.csv).
Everything is fixed by SEED; see README.md.
"""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem import Rotor, influence
from rotorid.files import read_rotor

ComplexArray = NDArray[np.complex128]

HERE = Path(__file__).resolve().parent
SEED = 23
DAMPING = 2e4  # N·s/m, at both bearings
STATIONS = (6, 9, 12, 15, 18)  # nodes with unbalance, unknown to the sheet
PLANES = {"left": 6, "middle": 12, "right": 19}
SENSORS = {"probe 1": 4, "probe 2": 10, "probe 3": 14, "probe 4": 20}
SPEEDS_RPM = (1220, 1360, 3600, 4950, 5400)  # critical speeds at 1291 and 5164 rpm
TRIAL_G_MM = 800.0  # at 0°, in one plane after the other, removed again
MOUNTED = {"left": (417, 172), "middle": (282, 278), "right": (448, 10)}  # the check run: g·mm, degrees
G_MM = 1e-6  # kg·m
UM_PP = 0.5e-6  # m of amplitude


def true_rotor() -> Rotor:
    """The rotor of rotor23.csv on damped bearings."""
    rotor = read_rotor(HERE.parent / "rotor23.csv")
    return replace(rotor, supports=tuple(replace(s, damping=DAMPING) for s in rotor.supports))


def true_unbalance() -> ComplexArray:
    """What the sheet does not show, kg·m at the STATIONS: 100 to 600 g·mm at any angle."""
    rng = np.random.default_rng(SEED)
    size = rng.uniform(100, 600, len(STATIONS)) * G_MM
    return np.asarray(size * np.exp(1j * rng.uniform(0, 2 * np.pi, len(STATIONS))))


def simulate(weights: ArrayLike) -> ComplexArray:
    """Vibration in m (speeds, sensors) with weights in kg·m in the planes, exact, not rounded."""
    speeds = np.array(SPEEDS_RPM) * np.pi / 30
    rotor = true_rotor()
    own = influence(rotor, STATIONS, list(SENSORS.values()), speeds).W
    mounted = influence(rotor, list(PLANES.values()), list(SENSORS.values()), speeds).W
    return np.asarray(own @ true_unbalance() + mounted @ np.asarray(weights, dtype=complex))


def as_read(vibration: complex) -> tuple[str, str]:
    """What an instrument shows: micrometres peak to peak with 3 digits, phase to 1°."""
    amplitude = float(f"{abs(vibration) / UM_PP:.2e}")
    digits = max(2 - int(np.floor(np.log10(amplitude))), 0)
    return f"{amplitude:.{digits}f}", str(round(np.degrees(np.angle(vibration))) % 360)


def main(folder: Path = HERE) -> None:
    """Write the tables."""
    runs, weights = [], []
    for number in range(len(PLANES) + 1):
        run = "baseline" if number == 0 else f"trial {number}"
        mounted = np.zeros(len(PLANES))
        if number:
            mounted[number - 1] = TRIAL_G_MM * G_MM
            weights.append((run, list(PLANES)[number - 1], f"{TRIAL_G_MM:g}", "0"))
        for speed, row in zip(SPEEDS_RPM, simulate(mounted), strict=True):
            runs += [(run, speed, sensor, *as_read(z)) for sensor, z in zip(SENSORS, row, strict=True)]
    check, check_weights = [], [("check", plane, *map(str, MOUNTED[plane])) for plane in PLANES]
    corrections = [g * G_MM * np.exp(1j * np.deg2rad(angle)) for g, angle in MOUNTED.values()]
    for speed, row in zip(SPEEDS_RPM, simulate(corrections), strict=True):
        check += [("check", speed, sensor, *as_read(z)) for sensor, z in zip(SENSORS, row, strict=True)]
    _write(folder / "check.csv", ("run", "speed_rpm", "sensor", "amplitude_um_pp", "phase_deg"), check)
    _write(folder / "check_weights.csv", ("run", "plane", "unbalance_g_mm", "angle_deg"), check_weights)
    _write(folder / "runs.csv", ("run", "speed_rpm", "sensor", "amplitude_um_pp", "phase_deg"), runs)
    _write(folder / "weights.csv", ("run", "plane", "unbalance_g_mm", "angle_deg"), weights)


def _write(path: Path, header: tuple[str, ...], rows: list[tuple[object, ...]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)


if __name__ == "__main__":
    main()
