"""One machine, written down in all combinations of conventions: always the same weight at the same place.

The instrument here works as instruments do: it takes the pulse of the key phasor, samples one turn of what
the probe sees, and reports the angle that the rotor turns from the pulse to the positive peak.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from exact_solutions import exactly
from tables_data import write_csv
from whirl_rotors import machine

import fem
from balancing import correct, estimate_influence, model_influence
from rotorid.files import read_job, write_rotor

SPEEDS_RPM = (1500, 4200)
NODES = {"A": 4, "B": 20, "C": 12}
PLANES = {"left": (7, 0.2), "right": (18, 0.25)}
UNBALANCE = {"left": 3e-3 * np.exp(0.7j), "right": 2e-3 * np.exp(-2.1j)}
PLACES = {"trial 1": ("left", 30.0, 40.0), "trial 2": ("right", 25.0, 250.0)}
"""Of the trial weights: plane, grams, and degrees from the mark with the rotation, wherever one stands."""
"""Of the probe's track, m, and where its hump stands, from the mark with the rotation."""
EXPECTED = np.array([-UNBALANCE[name] / radius for name, (_, radius) in PLANES.items()])

PHASES = ("lead", "lag")
UNITS = {"um": 1e6, "um_pp": 2e6, "mil_rms": 1e6 / 25.4 / np.sqrt(2)}
# The machine turns clockwise seen from the drive end, so counter-clockwise seen from the free end.
DRIVE = 'rotation = "clockwise"\nview = "drive end"\n'
FREE = 'rotation = "counter-clockwise"\nview = "free end"\n'
STYLES = {
    "with": ('angles = "with rotation"\n', 1),
    "against": ('angles = "against rotation"\n' + DRIVE, -1),
    "clockwise, drive end": ('angles = "clockwise"\n' + DRIVE, 1),
    "counter-clockwise, drive end": ('angles = "counter-clockwise"\n' + DRIVE, -1),
    "clockwise, free end": ('angles = "clockwise"\n' + FREE, -1),
    "counter-clockwise, free end": ('angles = "counter-clockwise"\n' + FREE, 1),
}
SENSOR_ANGLES = ({"A": 0.0, "B": 0.0, "C": 0.0}, {"A": 45.0, "B": 315.0, "C": 110.0})
KEY_PHASORS = (0.0, 65.0)


@pytest.fixture(scope="module")
def rotor():
    """With damped bearings that differ in x and y: the direction of a probe matters."""
    return machine()


@pytest.fixture(scope="module")
def folder(tmp_path_factory, rotor):
    folder = tmp_path_factory.mktemp("conventions")
    write_rotor(folder / "rotor.toml", rotor)
    return folder


@pytest.fixture(scope="module")
def motion(rotor):
    """Complex deflection along x and y of each probe's node: run → (speeds, sensors, 2)."""
    trial = {run: {plane: g / 1e3 * np.exp(1j * np.radians(a))} for run, (plane, g, a) in PLACES.items()}
    mounted = {"initial": {}, **trial}
    out = {}
    for run, weights in mounted.items():
        total = {
            node: UNBALANCE[name] + radius * weights.get(name, 0) for name, (node, radius) in PLANES.items()
        }
        response = exactly(fem.unbalance_response, rotor, total, np.array(SPEEDS_RPM) * np.pi / 30)
        along = [[response.at((node, angle)) for angle in (0.0, 90.0)] for node in NODES.values()]
        out[run] = np.moveaxis(np.array(along), 2, 0)
    return out


def instrument(signal, omega, kappa):
    """Peak amplitude and degrees turned from the pulse to the positive peak; the pulse comes at κ."""
    pulse = np.radians(kappa) / omega
    after = np.arange(64) / 64 * 2 * np.pi / omega
    read = 2 * np.mean(signal(pulse + after) * np.exp(-1j * omega * after))
    return abs(read), float(-np.degrees(np.angle(read)) % 360)


class Shop:
    """People who write down one machine in their own way."""

    def __init__(self, folder, motion, phase, unit, style, betas, kappa):
        self.folder, self.motion, self.phase, self.unit = folder, motion, phase, unit
        self.words, self.turn = STYLES[style]
        self.betas, self.kappa = betas, kappa

    def angle(self, with_rotation):
        """An angle as these people write it."""
        return float(self.turn * with_rotation % 360)

    def reading(self, run, s, sensor):
        """Amplitude and phase as they write them."""
        omega, beta = SPEEDS_RPM[s] * np.pi / 30, np.radians(self.betas[sensor])

        def signal(t):
            at = self.motion[run][s][list(NODES).index(sensor)]
            x, y = (np.real(z * np.exp(1j * omega * t)) for z in at)
            return x * np.cos(beta) + y * np.sin(beta)

        size, lag = instrument(signal, omega, self.kappa)
        return size * UNITS[self.unit], lag if self.phase == "lag" else (360 - lag) % 360

    def table(self, runs):
        head = ["run", "speed_rpm", "sensor", f"amplitude_{self.unit}", "phase_deg"]
        places = itertools.product(runs, enumerate(SPEEDS_RPM), NODES)
        return [head, *([run, rpm, c, *map(float, self.reading(run, s, c))] for run, (s, rpm), c in places)]

    def job(self):
        """Write all files and read the job."""
        write_csv(self.folder / "runs.csv", self.table(["initial", "trial 1", "trial 2"]))
        rows = [[run, plane, g, self.angle(a)] for run, (plane, g, a) in PLACES.items()]
        write_csv(self.folder / "weights.csv", [["run", "plane", "mass_g", "angle_deg"], *rows])
        text = f'runs = "runs.csv"\nweights = "weights.csv"\nrotor = "rotor.toml"\nphase = "{self.phase}"\n'
        text += self.words
        for name, (node, radius) in PLANES.items():
            text += f"[planes.{name}]\nnode = {node}\nradius_mm = {1e3 * radius}\n"
        for name, node in NODES.items():
            text += f"[sensors.{name}]\nnode = {node}\nangle_deg = {self.angle(self.betas[name])}\n"
        if self.kappa:
            text += f"[key_phasor]\nangle_deg = {self.angle(self.kappa)}\n"
        (self.folder / "job.toml").write_text(text, encoding="utf-8")
        return read_job(self.folder / "job.toml")

    def place(self, found):
        """The weights as they read them off the sheet, kg and with the rotation from the mark."""
        grams, angle = found.labels.weight(found.weights)
        return grams / 1e3 * np.exp(1j * np.radians(self.turn * angle))


def computed(job):
    """What `rotorid balance --coefficients computed` uses."""
    return model_influence(
        job.rotor,
        job.plane_nodes,
        {name: job.sensor_places[name] for name in job.trials.sensors},
        job.trials.speeds,
        radii=job.radii,
        key_phasor=job.key_phasor,
        labels=job.trials.labels,
    )


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("phase", PHASES)
def test_the_same_weight_at_the_same_place(folder, motion, phase, unit, style):
    """36 ways to write numbers, each on 4 machines: probes and key phasor."""
    for betas, kappa in itertools.product(SENSOR_ANGLES, KEY_PHASORS):
        shop = Shop(folder, motion, phase, unit, style, betas, kappa)
        job = shop.job()
        by_trials = correct(estimate_influence(job.trials))
        by_model = correct(computed(job), job.trials)
        for found in (by_trials, by_model):
            np.testing.assert_allclose(found.weights, EXPECTED, rtol=1e-6)
            np.testing.assert_allclose(shop.place(found), EXPECTED, rtol=1e-6)
            assert np.abs(found.after).max() < 1e-6 * np.abs(found.before).max()
