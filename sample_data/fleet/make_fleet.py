"""Draws nine fans of one type, balanced in two planes: python sample_data/fleet/make_fleet.py

writes fan-132/MACHINE/ with job.toml, runs.csv, weights.csv, and where there was a check run check.csv and,
mostly, check_weights.csv. The last has nothing but its baseline. Everything is fixed by SEED; README.md says
how.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from balancing import correct, estimate_influence
from rotorid.files import read_job

HERE = Path(__file__).resolve().parent
SEED = 132
PLANES, SENSORS, SPEEDS_RPM = ("DE", "NDE"), ("A", "B"), (1480, 2960)
# Of the type: peak amplitude, µm, per gram, and lead, degrees; a row a speed and sensor, a column a plane.
SIZE = [[[0.42, 0.18], [0.16, 0.47]], [[0.95, 0.61], [0.55, 1.08]]]
LEAD = [[[-35, -50], [-48, -38]], [[-118, -140], [-137, -121]]]
OF_ALL, OF_EACH, READING = (0.10, 12.0), (0.05, 6.0), 0.005
"""Standard deviations, relative and in degrees: of all coefficients of a machine alike, of each by itself; of
a reading, relative."""


class Fan(NamedTuple):
    """How one machine was measured and written down."""

    name: str
    date: str
    unit: str = "um_pp"
    per_um: float = 2.0  # numbers of that unit per µm peak
    decimals: int = 1
    phase: str = "lag"
    angles: str = "with rotation"
    weight: str = "g"
    grams: float = 1.0  # of one such unit
    check: str = "weights"  # "weights": said; "proposed": mounted as proposed; "": no check run
    speeds: int = 2
    comma: bool = False
    said: str = ""  # the phase that the job says, where that is wrong
    trials: bool = True


FANS = (
    Fan("132-01", "2026-01-14"),
    Fan("132-02", "2026-01-28", check="proposed"),
    Fan("132-03", "2026-02-05", unit="um", per_um=1.0, decimals=2, phase="lead", angles="against rotation"),
    Fan(
        "132-04", "2026-02-19", unit="mil_pp", per_um=2.0 / 25.4, decimals=3, weight="oz", grams=28.349523125
    ),
    Fan("132-05", "2026-03-17", comma=True),
    Fan("132-06", "2026-04-02", speeds=1),
    Fan("132-07", "2026-04-23", said="lead"),
    Fan("132-08", "2026-05-11", angles="against rotation", check=""),
    Fan("132-09", "2026-06-02", check="", trials=False),
)


def main() -> None:
    """Write all machines."""
    rng = np.random.default_rng(SEED)
    common = np.array(SIZE) * np.exp(1j * np.radians(LEAD))
    for fan in FANS:
        W = common * differing(rng, *OF_ALL) * differing(rng, *OF_EACH, *common.shape)
        unbalance = rng.uniform(25, 60, 2) * np.exp(2j * np.pi * rng.uniform(size=2))  # g in the planes
        bare = W @ unbalance * (1 + 0.02 * noise(rng, *W.shape[:2]))
        write(fan, W[: fan.speeds], bare[: fan.speeds], rng)


def differing(rng: np.random.Generator, along: float, degrees: float, *shape: int) -> np.ndarray:
    """Factors of machines."""
    turn = np.exp(1j * np.radians(degrees * rng.normal(size=shape)))
    return np.asarray((1 + along * rng.normal(size=shape)) * turn)


def noise(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Complex, of standard deviation 1 in size."""
    return (rng.normal(size=shape) + 1j * rng.normal(size=shape)) / np.sqrt(2)


def write(fan: Fan, W: np.ndarray, bare: np.ndarray, rng: np.random.Generator) -> None:
    """The files of one machine."""
    folder = HERE / "fan-132" / fan.name
    folder.mkdir(parents=True, exist_ok=True)
    trial = round(20 / fan.grams, 1) * fan.grams
    runs = {"as found": (0, 0), "trial DE": (trial, 0), "trial NDE": (0, trial)}
    if not fan.trials:
        del runs["trial DE"], runs["trial NDE"]

    def read(mounted: object) -> np.ndarray:
        return (bare + W @ np.asarray(mounted)) * (1 + READING * noise(rng, *bare.shape))

    lines = {
        "runs.csv": readings(fan, {run: read(mounted) for run, mounted in runs.items()}),
        "weights.csv": weights(fan, {run: mounted for run, mounted in runs.items() if any(mounted)}),
        "job.toml": job(fan),
    }
    if not fan.trials:
        del lines["weights.csv"]
    put(fan, folder, lines)
    if fan.check == "proposed":
        mounted = 1e3 * correct(estimate_influence(read_job(folder / "job.toml").trials)).weights
        put(fan, folder, {"check.csv": readings(fan, {"balanced": read(mounted)})})
    elif fan.check:
        best = -np.linalg.lstsq(W.reshape(-1, 2), bare.ravel(), rcond=None)[0]
        turned = np.exp(1j * np.radians(np.round(np.degrees(np.angle(best)))))
        mounted = np.round(np.abs(best) / fan.grams, 1) * fan.grams * turned
        put(fan, folder, {"check.csv": readings(fan, {"balanced": read(mounted)})})
        put(fan, folder, {"check_weights.csv": weights(fan, {"balanced": mounted})})
    if fan.check:
        own = 'check_weights = "check_weights.csv"\n' if fan.check == "weights" else ""
        lines["job.toml"] = lines["job.toml"].replace("phase", f'check = "check.csv"\n{own}phase', 1)
        put(fan, folder, lines)


def put(fan: Fan, folder: Path, files: dict[str, str]) -> None:
    """Write files, tables as a spreadsheet with decimal commas exports them where the machine has these."""
    for name, text in files.items():
        if fan.comma and name.endswith(".csv"):
            text = text.replace(",", ";").replace(".", ",")
        (folder / name).write_text(text, encoding="utf-8")


def job(fan: Fan) -> str:
    """The job file."""
    said = f'phase = "{fan.said or fan.phase}"\nangles = "{fan.angles}"\n'
    mounted = 'weights = "weights.csv"\n' if fan.trials else 'machine_type = "fan-132"\n'
    errors = "[errors]\namplitude_percent = 0.4\nphase_deg = 0.4\n"
    return f'date = "{fan.date}"\nruns = "runs.csv"\n{mounted}{said}{errors}'


def readings(fan: Fan, runs: dict[str, np.ndarray]) -> str:
    """A runs table."""
    lines = [f"run,speed_rpm,sensor,amplitude_{fan.unit},phase_deg"]
    for run, values in runs.items():
        for (s, c), value in np.ndenumerate(values):
            phase = np.degrees(np.angle(value)) * (1 if fan.phase == "lead" else -1) % 360
            size = f"{abs(value) * fan.per_um:.{fan.decimals}f}"
            lines.append(f"{run},{SPEEDS_RPM[s]},{SENSORS[c]},{size},{phase % 360:.0f}".replace(",360", ",0"))
    return "\n".join(lines) + "\n"


def weights(fan: Fan, runs: dict[str, object]) -> str:
    """A weights table."""
    lines = [f"run,plane,mass_{fan.weight},angle_deg"]
    for run, mounted in runs.items():
        for plane, weight in zip(PLANES, np.asarray(mounted, dtype=complex), strict=True):
            if weight:
                angle = np.degrees(np.angle(weight)) * (1 if fan.angles == "with rotation" else -1)
                lines.append(f"{run},{plane},{abs(weight) / fan.grams:.1f},{round(angle) % 360}")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
