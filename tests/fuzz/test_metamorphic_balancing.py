"""Relations between answers of `balance`: the same machine told otherwise needs the same weights."""

import cmath
import csv
import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

from fuzz.judging import answer

SPEEDS = (1480.0, 2960.0)


@dataclass(frozen=True)
class Told:
    """Readings by (run, speed, sensor), weights by (run, plane), and the way in which they are written."""

    readings: dict
    weights: dict
    amplitude: tuple = ("um", 1.0)
    mass: tuple = ("g", 1.0)
    phase: str = "lead"
    angles: str = "with rotation"
    speed: tuple = ("rpm", 1.0)
    order: int = 1


def drawn(seed, planes=2, sensors=3):
    """A linear machine with trial runs; all numbers have so many digits that their steps do not matter."""
    rng = np.random.default_rng(seed)

    def vector(size):
        return complex(size * rng.uniform(0.5, 1.5) * np.exp(2j * np.pi * rng.random()))

    influence = {(v, s, p): vector(3) for v in SPEEDS for s in range(sensors) for p in range(planes)}
    start = {(v, s): vector(20) for v in SPEEDS for s in range(sensors)}
    mounted = {(f"trial {p}", p): vector(4) for p in range(planes)}
    readings = {}
    for run in ["initial", *(f"trial {p}" for p in range(planes))]:
        for v, s in start:
            moved = sum(w * influence[v, s, p] for (r, p), w in mounted.items() if r == run)
            readings[run, v, s] = start[v, s] + moved + 0.2 * vector(1)
    return Told(readings, mounted)


def corrections(told, folder, method):
    """Weights by plane as the machine has them: g, with rotation."""
    folder.mkdir(exist_ok=True)
    lag, against = told.phase == "lag", told.angles == "against rotation"
    unit, scale = told.amplitude
    runs = [
        [
            run,
            v * told.speed[1],
            f"S{s}",
            abs(z) * scale,
            math.degrees(cmath.phase(z.conjugate() if lag else z)),
        ]
        for (run, v, s), z in told.readings.items()
    ]
    weights = [
        [run, f"P{p}", abs(w) * told.mass[1], math.degrees(cmath.phase(w.conjugate() if against else w))]
        for (run, p), w in told.weights.items()
    ]
    tables = {
        "runs": [
            ["run", f"speed_{told.speed[0]}", "sensor", f"amplitude_{unit}", "phase_deg"],
            *runs[:: told.order],
        ],
        "weights": [["run", "plane", f"mass_{told.mass[0]}", "angle_deg"], *weights],
    }
    for name, rows in tables.items():
        with (folder / f"{name}.csv").open("w", newline="", encoding="utf-8") as stream:
            csv.writer(stream).writerows(rows)
    job = f'runs = "runs.csv"\nweights = "weights.csv"\nphase = "{told.phase}"\nangles = "{told.angles}"\n'
    (folder / "job.toml").write_text(job, encoding="utf-8")
    found = answer(["balance", str(folder / "job.toml"), "--method", method])
    assert found.document is not None, found
    rows = found.document["corrections"]
    vectors = {r["plane"]: cmath.rect(r["mass"] / told.mass[1], math.radians(r["angle_deg"])) for r in rows}
    found_weights = np.array([vectors[name] for name in sorted(vectors)])
    return found_weights.conj() if against else found_weights


TURN = cmath.exp(0.7j)


def turned_phases(told):
    return replace(told, readings={key: z * TURN for key, z in told.readings.items()})


def turned_angles(told):
    """Angles counted from another mark: the weights go to other numbers, by the same turn."""
    return replace(told, weights={key: w * TURN for key, w in told.weights.items()})


def larger(told):
    return replace(told, readings={key: 7.0 * z for key, z in told.readings.items()})


def heavier(told):
    """Weights counted in another size."""
    return replace(told, weights={key: 3.0 * w for key, w in told.weights.items()})


RELATIONS = {
    "another unit of vibration": (lambda t: replace(t, amplitude=("mil", 1 / 25.4)), 1.0),
    "vibrations in any unit": (lambda t: replace(t, amplitude=("divisions", 0.01)), 1.0),
    "another unit of mass": (lambda t: replace(t, mass=("kg", 1e-3)), 1.0),
    "another unit of speed": (lambda t: replace(t, speed=("Hz", 1 / 60)), 1.0),
    "phases lag": (lambda t: replace(t, phase="lag"), 1.0),
    "angles against rotation": (lambda t: replace(t, angles="against rotation"), 1.0),
    "rows the other way round": (lambda t: replace(t, order=-1), 1.0),
    "another mark of the phase": (turned_phases, 1.0),
    "another mark of the angles": (turned_angles, TURN),
    "everything vibrates more": (larger, 1.0),
    "all weights are heavier": (heavier, 3.0),
}


@pytest.mark.parametrize("method", ["weighted", "least-squares"])
@pytest.mark.parametrize("seed", range(2))
def test_the_same_machine_told_otherwise_needs_the_same_weights(tmp_path, method, seed):
    told = drawn(seed, planes=2 + seed)
    plain = corrections(told, tmp_path / "plain", method)
    wrong = {}
    for name, (change, factor) in RELATIONS.items():
        found = corrections(change(told), tmp_path / "told", method) / factor
        worst = float(np.max(np.abs(found - plain)) / np.max(np.abs(plain)))
        if worst > 1e-5:
            wrong[name] = worst
    assert wrong == {}
