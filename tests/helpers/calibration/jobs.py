"""Readings of runs by the dense rotor, and rotors for the tests of calibration."""

from dataclasses import dataclass, field

import dense_rotor
import numpy as np

import fem
from balancing import Trials
from rotorid.calibration import RunReadings


def machine():
    """Two masses between bearings that differ in x and y, one on a pedestal; all in ten elements."""
    stand = fem.Pedestal(15.0, (2e8, 1.5e8), 4e3)
    return fem.Rotor(
        np.full(10, 0.12),
        0.07,
        discs=[fem.Disc(4, 25.0, 0.3, 0.2), fem.Disc(8, 15.0, 0.2, 0.15)],
        supports=[
            fem.Support(1, ((4e7, 3e6), (-2e6, 6e7)), ((2e4, 0.0), (0.0, 3e4)), "DE"),
            fem.Support(11, ((5e7, -1e6), (2e6, 3e7)), ((1.5e4, 0.0), (0.0, 2e4)), "NDE", pedestal=stand),
        ],
        model=fem.Model(rotary_inertia=True, gyroscopic=True),
    )


@dataclass
class Runs:
    """Runs that a dense model is asked for: sensors (node, angle), planes (node, radius), weights (R, P)."""

    speeds: tuple = (150.0, 260.0, 380.0)
    sensors: dict = field(
        default_factory=lambda: {"a": (2, 0.0), "b": (2, 90.0), "c": (10, 30.0), "d": (10, 120.0)}
    )
    planes: dict = field(default_factory=lambda: {"P": (4, 1.0), "Q": (8, 1.0)})
    weights: tuple = ((0, 0), (2e-3, 0), (0, 1e-3 - 2e-3j))
    derivative: int = 0
    key_phasor: float = 0.0
    unbalance: dict = field(default_factory=lambda: {4: 3e-3 + 1e-3j, 8: -2e-3j})
    turned: dict = field(default_factory=dict)  # degrees by which a probe stands elsewhere than the job says
    gains: dict = field(default_factory=dict)
    free: bool = True  # the bare rotor's readings

    def readings(self, rotor, bow=None):
        """(R, S, C), phase lead from the key phasor; `bow` (nodes, 2): w and slope of a bent shaft."""
        out = np.zeros((len(self.weights), len(self.speeds), len(self.sensors)), complex)
        for r, mounted in enumerate(self.weights):
            u = dict(self.unbalance)
            for (node, radius), m in zip(self.planes.values(), mounted, strict=True):
                u[node] = u.get(node, 0.0) + m * radius
            for s, speed in enumerate(self.speeds):
                X, Y = dense_rotor.response(rotor, u, speed)
                if bow is not None:
                    X, Y = np.add((X, Y), bent(rotor, bow, speed))
                for c, (name, (node, angle)) in enumerate(self.sensors.items()):
                    beta = np.radians(angle + self.turned.get(name, 0.0))
                    seen = X[node - 1] * np.cos(beta) + Y[node - 1] * np.sin(beta)
                    out[r, s, c] = self.gains.get(name, 1.0) * seen * (1j * speed) ** self.derivative
        return out * np.exp(1j * np.radians(self.key_phasor))

    def data(self, readings, *, key_phasor=None, bow=0, **trials):
        """What a calibration is given of these readings: it knows nothing of `turned` and `gains`."""
        given = Trials(
            tuple(f"run {r}" for r in range(len(self.weights))),
            np.array(self.speeds),
            tuple(self.sensors),
            tuple(self.planes),
            readings,
            np.array(self.weights, dtype=complex),
            **trials,
        )
        return RunReadings(
            given,
            tuple(node for node, _ in self.planes.values()),
            np.array([radius for _, radius in self.planes.values()]),
            tuple(fem.Sensor(node, angle) for node, angle in self.sensors.values()),
            self.derivative,
            self.key_phasor if key_phasor is None else key_phasor,
            () if self.free else tuple(self.unbalance),
            bow,
        )


def bent(rotor, bow, speed):
    """X and Y of a shaft that is bent like this at angle 0: its stiffness pulls it there."""
    free = fem.Rotor(
        rotor.length, rotor.outer_diameter, rotor.inner_diameter, rotor.youngs_modulus, rotor.density
    )
    shaft, D = dense_rotor.assemble(free, 0.0), dense_rotor.assemble(rotor, speed)
    force = np.zeros(len(D.M), complex)
    n = len(shaft.K)
    w = np.zeros((2, n))
    for i, plane in enumerate((shaft.x, shaft.y)):
        w[i, plane], w[i, plane + 1] = np.transpose(bow)
    force[:n] = shaft.K @ w[0] - 1j * (shaft.K @ w[1])
    q = np.linalg.solve(D.dynamic(1j * speed), force)
    return q[D.x], q[D.y]
