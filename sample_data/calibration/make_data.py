"""Write the data of this folder: `python make_data.py`. The machine is the compressor with other numbers.

The seeds are fixed: the same numbers on every run. What the machine really is stands in MACHINE and TURNED.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import fem
from fem.parameters import with_parameters
from rotorid import read_rotor

HERE = Path(__file__).resolve().parent
MACHINE = {
    "bearing[1].kxx.scale": 1.21,
    "bearing[1].kxy.scale": 0.8,
    "bearing[1].kyx.scale": 1.2,
    "bearing[1].kyy.scale": 0.82,
    "bearing[1].cxx.scale": 0.79,
    "bearing[1].cyy.scale": 1.18,
    "bearing[2].kxx.scale": 0.83,
    "bearing[2].kxy.scale": 1.2,
    "bearing[2].kyx.scale": 0.8,
    "bearing[2].kyy.scale": 1.2,
    "bearing[2].cxx.scale": 1.17,
    "bearing[2].cyy.scale": 0.8,
    "bearing[2].pedestal_stiffness.scale": 1.09,
    "material.youngs_modulus.scale": 0.993,
    **{f"disc[{k}].scale": 1 + 0.01 * s for k, s in enumerate((1, -1, 0.5, -0.5, 1, 0, 1, -1), start=1)},
}
SENSORS = {"DE x": ("probe DE", 45.0), "DE y": ("probe DE", 135.0)}
SENSORS |= {"NDE x": ("probe NDE", 45.0), "NDE y": ("probe NDE", 135.0)}
TURNED = dict(zip(SENSORS, (1.6, -1.2, 2.3, -0.7), strict=True))
PLANES = ("impeller 1", "impeller 5")
IMPELLERS = tuple(f"impeller {k}" for k in range(1, 6))
SPEEDS = np.array([3000.0, 4000.0, 5000.0, 6500.0])
TRIAL = {"impeller 1": (2000.0, 0.0), "impeller 5": (2000.0, 90.0)}  # g·mm, degrees
AMPLITUDE, PHASE, RUN = 0.01, np.radians(1.0), 0.02


def main() -> None:
    """Runs of the trial and of a later day, each with new unbalances of the five impellers."""
    random = np.random.default_rng(7)
    rotor = with_parameters(read_rotor(HERE.parent / "compressor" / "rotor.toml"), MACHINE)
    places = [fem.Sensor(node, angle + TURNED[name]) for name, (node, angle) in SENSORS.items()]
    W, trial = (fem.influence(rotor, planes, places, SPEEDS * np.pi / 30).W for planes in (IMPELLERS, PLANES))
    weights = np.array([1e-6 * m * np.exp(1j * np.radians(a)) for m, a in TRIAL.values()])

    def noise(shape: tuple[int, ...]) -> np.ndarray:
        return random.standard_normal(shape) + 1j * random.standard_normal(shape)

    def read(vibration: np.ndarray) -> np.ndarray:
        kinds = [noise((1, 1)), noise((len(SPEEDS), 1)), noise((len(SPEEDS), len(SENSORS)))]
        run = vibration * (1 + RUN / np.sqrt(3) * sum(kinds))
        amplitude = 1 + AMPLITUDE * random.standard_normal(run.shape)
        return np.asarray(run * amplitude * np.exp(1j * PHASE * random.standard_normal(run.shape)))

    first, later = (W @ (1000e-6 * noise((5,))) for _ in range(2))
    write("trial.csv", {"base": read(first), "trial": read(first + trial @ weights)})
    write("later.csv", {"later": read(later)})
    rows = [f"trial,{plane},{mass:g},{angle:g}" for plane, (mass, angle) in TRIAL.items()]
    text = "\n".join(["run,plane,unbalance_g_mm,angle_deg", *rows])
    (HERE / "weights.csv").write_text(text + "\n", encoding="utf-8")


def write(file: str, runs: dict[str, np.ndarray]) -> None:
    """Amplitudes in µm peak to peak with three digits, phases as lag in tenths of a degree."""
    lines = ["run,speed_rpm,sensor,amplitude_um_pp,phase_deg"]
    for run, readings in runs.items():
        for speed, row in zip(SPEEDS, 2e6 * readings, strict=True):
            for sensor, z in zip(SENSORS, row, strict=True):
                lag = -np.degrees(np.angle(z)) % 360
                lines.append(f"{run},{speed:.0f},{sensor},{abs(z):.3g},{lag:.1f}")
    (HERE / file).write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
