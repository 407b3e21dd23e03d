"""Write the records: `python make_data.py` (needs NumPy and SciPy only, not rotorid).

A drawn machine on two bearings with two modes (1,560 and 2,640 rpm, damping 3 and 2.5 %), two planes and a
probe at each end (horizontal at the drive end, A, with its vertical neighbour V; horizontal at the free end,
B). Three runs at a steady 1,950 rpm: as found, and a trial weight of 10 g at 0° in each plane; and a run-up
from 600 to 3,300 rpm in 24 s. Each record has a tacho (a notch of 18°, so that the pulse is low) and three
probes: 1× of the machine, a run-out of 4 µm, some 2×, and noise of 1 µm, around a gap of 1 mm. 16 bit; 100 mV
are 25.4 µm peak to peak, as 4 mV/µm.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.io import wavfile

RATE, RADIUS = 2048, 0.15
MODES = np.array([1560.0, 2640.0]) * np.pi / 30
DAMPING = np.array([0.03, 0.025])
SHAPES = {"A": (0.9, 0.7), "V": (-0.9j, -0.7j), "B": (0.8, -0.75)}
PLANES = {"left": (0.8, 0.6), "right": (0.75, -0.7)}
MASS, GAP = 60.0, 1e-3
FOUND = {"left": 9e-3 * np.exp(1j * np.radians(75)), "right": 6e-3 * np.exp(1j * np.radians(200))}
RUN_OUT = {"A": 4e-6 * np.exp(0.4j), "V": 3.5e-6 * np.exp(2.2j), "B": 4e-6 * np.exp(-1.1j)}
VOLTS_PER_M, FULL_SCALE = 4e3, 10.0
Array = np.ndarray


def motion(
    weights: Mapping[str, complex], time: Array, speed: Callable[[float], float], rate: float
) -> Array:
    """Complex amplitudes of the modes along a run, (2, N): speed(t) in rad/s, rate its constant change."""
    forces = [sum(RADIUS * w * PLANES[p][r] / MASS for p, w in weights.items()) for r in range(2)]
    force = np.array(forces)

    def change(t: float, y: Array) -> Array:
        q, v = np.split(y, 2)
        w = speed(t)
        stiff = MODES**2 - w**2 + 1j * rate + 2j * DAMPING * MODES * w
        return np.concatenate(
            (v, force * (w**2 - 1j * rate) - 2 * (DAMPING * MODES + 1j * w) * v - stiff * q)
        )

    w = speed(0.0)
    start = force * w**2 / (MODES**2 - w**2 + 2j * DAMPING * MODES * w)
    first = np.concatenate((start, 0 * start))
    coarse = np.linspace(0, time[-1], 4000)
    found = solve_ivp(change, (0, time[-1]), first, "DOP853", coarse, rtol=1e-9, atol=1e-14).y[:2]
    return np.array([np.interp(time, coarse, q.real) + 1j * np.interp(time, coarse, q.imag) for q in found])


def write(
    name: str, weights: Mapping[str, complex], seconds: float, first: float, last: float, seed: int
) -> None:
    """One record."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(RATE * seconds)) / RATE
    rate = (last - first) / seconds * np.pi / 30
    start = first * np.pi / 30
    angle = start * t + rate * t**2 / 2 + rng.uniform(0, 2 * np.pi)
    q = motion({p: FOUND[p] + weights.get(p, 0) for p in FOUND}, t, lambda s: start + rate * s, rate)
    # the recorder's converter takes means over its sampling interval
    inside = np.mean(
        [(angle + k / 64 * np.gradient(angle)) % (2 * np.pi) < np.radians(18) for k in range(-32, 32)], 0
    )
    volts = [-1.0 - 7.0 * inside]
    for sensor, shape in SHAPES.items():
        z = (np.array(shape) @ q + RUN_OUT[sensor]) * np.exp(1j * angle)
        x = GAP + z.real + 1.2e-6 * np.cos(2 * angle + 1.0) + 1e-6 * rng.standard_normal(len(t))
        volts.append(VOLTS_PER_M * x)
    counts = np.round(np.transpose(volts) / FULL_SCALE * 2**15).astype(np.int16)
    wavfile.write(Path(__file__).with_name(f"{name}.wav"), RATE, counts)


if __name__ == "__main__":
    write("as_found", {}, 4, 1950, 1950, 1)
    write("trial_left", {"left": 0.010}, 4, 1950.6, 1950.6, 2)
    write("trial_right", {"right": 0.010}, 4, 1949.7, 1949.7, 3)
    write("run_up", {}, 24, 600, 3300, 4)
