"""The random rotors of tests/data/ross_reference.json, as `fem` builds them, and what ROSS answered."""

import json
from pathlib import Path

import numpy as np

import fem

FILE = Path(__file__).resolve().parents[1] / "data" / "ross_reference.json"
CONTENT = json.loads(FILE.read_text(encoding="utf-8"))
SHEAR = [data for data in CONTENT["rotors"] if data["shear"]]
NO_SHEAR = [data for data in CONTENT["rotors"] if not data["shear"]]


def label(data):
    return f"{data['seed']}-{data['bearings'].replace(' ', '-')}-{len(data['length'])}-elements"


def build(data, times=1):
    """The rotor, with each element cut into `times` equal ones; node n becomes times · (n − 1) + 1."""

    def node(n):
        return times * (n - 1) + 1

    return fem.Rotor(
        np.repeat(data["length"], times) / times,
        np.repeat(data["outer_diameter"], times),
        np.repeat(data["inner_diameter"], times),
        youngs_modulus=data["youngs_modulus"],
        density=data["density"],
        poisson_ratio=data["poisson_ratio"],
        discs=[fem.Disc(node(n), m, polar, diametral) for n, m, polar, diametral in data["discs"]],
        supports=[_support(support, node(support["node"])) for support in data["supports"]],
        model=fem.Model(shear=data["shear"], rotary_inertia=True, gyroscopic=True),
    )


def _support(data, node):
    stiffness, damping = data["stiffness"], data["damping"]
    if not data["speeds"]:
        stiffness, damping = stiffness[0], damping[0]
    return fem.Support(
        node,
        stiffness,
        damping,
        speeds=data["speeds"],
        kind=data["kind"],
        pedestal=fem.Pedestal(**data["pedestal"]) if data["pedestal"] else None,
    )


def unbalance(data, times=1):
    return {times * (node - 1) + 1: size * np.exp(1j * phase) for node, size, phase in data["unbalance"]}


def eigenvalues(answer):
    """ROSS' λ from frequency and log decrement, rad/s, shape (6,)."""
    return np.array(answer["wd"]) * (1j - np.array(answer["log_dec"]) / (2 * np.pi))


def amplitudes(answer):
    """Complex amplitudes in x and y of all nodes, m, shape (2, N)."""
    return np.array(
        [np.array(answer[f"{p}_amplitude"]) * np.exp(1j * np.array(answer[f"{p}_phase"])) for p in "xy"]
    )
