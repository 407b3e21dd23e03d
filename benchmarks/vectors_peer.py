"""What runs in the environment of rota-order (GPL-3.0, so nowhere else): vectors of the records of a file.

Twice: with the defaults of rota-order, its angle counted from the first pulse; and with the settings whose
root mean square was the smallest of those tried (`smooth`, `bandwidth`, `tracked_harmonics` instead of the
Vold–Kalman filter): no smoothing of the speed, a bandwidth of 1.25 Hz, and the angle counted from the mean
over all pulses, which is not rota-order's own. It integrates its speed to the angle and does not tie that to
the pulses again: errors of a smoothed speed add up to degrees.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
import rota

SETTINGS = {"defaults": (1.0, 1.0), "best": (0.0, 1.25)}  # turns, Hz
ORDERS = (1, 2)
REPEAT = 5


def vectors(tacho: np.ndarray, samples: np.ndarray, rate: float, way: str) -> np.ndarray:
    """Of 1×, at every sample; phase from the tacho's edge."""
    smooth, bandwidth = SETTINGS[way]
    rpm, pulses = rota.speed.tacho_to_rpm(tacho, rate, smooth=smooth, return_info=True)
    found = rota.extract.order_waveform(samples, rate, rpm, ORDERS, bandwidth=bandwidth)
    turns = np.interp(pulses["pulse_times"], np.arange(len(tacho)) / rate, found.rev)
    ahead = turns - pulses["pulse_revs"]
    return found.envelopes[:, 0] * np.exp(2j * np.pi * (ahead[0] if way == "defaults" else ahead.mean()))


def main(file: Path) -> None:
    """Add to a file with the records its vectors at the instants asked for, and s of the best way."""
    data = dict(np.load(file))
    rate, answers, times = float(data["rate"]), {}, []
    for record in range(int(data["records"])):
        tacho, samples = data[f"tacho{record}"], data[f"samples{record}"]
        for way in SETTINGS:
            found = vectors(tacho, samples, rate, way)
            at = np.arange(len(found)) / rate
            answers[f"{way}{record}"] = np.interp(data[f"times{record}"], at, found)
    for _ in range(REPEAT):
        start = time.process_time()
        vectors(data["tacho0"], data["samples0"], rate, "best")
        times.append(time.process_time() - start)
    np.savez(file, seconds=min(times), **answers)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
