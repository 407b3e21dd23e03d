"""Rotors that the tests of the commands share."""

from dataclasses import replace

import numpy as np
import pytest
from tables_data import write_csv

import fem
from rotorid import read_rotor
from rotorid.files import write_rotor
from rotorid.samples import sample_data

MOUNTED = [["plane", "unbalance_g_mm", "angle_deg"], ["wheel", 500, 0], ["3", 100, 90]]
NAMES = ("bearing[1].stiffness", "bearing.stiffness.scale", "material.density")


@pytest.fixture
def model():
    """A small anisotropic rotor whose rear bearing is known from 50 to 2000 rad/s."""
    return fem.Rotor(
        [0.15] * 6,
        0.05,
        discs=[fem.Disc(4, 15.0, 0.15, 0.08, "wheel")],
        supports=[
            fem.Support(1, ((2e7, 0.0), (0.0, 4e7)), 2e3, "front"),
            fem.Support(
                7, (((2e7, 1e5), (-1e5, 4e7)), ((3e7, 1e5), (-1e5, 5e7))), 2e3, "rear", speeds=(50.0, 2000.0)
            ),
        ],
        stations={"wheel": 4, "probe": 2},
        model=fem.Model(rotary_inertia=True, gyroscopic=True),
    )


@pytest.fixture
def files(tmp_path, model):
    write_rotor(tmp_path / "rotor.toml", model)
    write_csv(tmp_path / "u.csv", MOUNTED)
    return tmp_path / "rotor.toml", tmp_path / "u.csv"


@pytest.fixture(scope="session")
def calibrated(tmp_path_factory):
    plain = read_rotor(sample_data() / "rotor23.csv")
    supports = [replace(support, damping=2e4) for support in plain.supports]
    cov = np.diag(np.square([2e7, 0.03, 60.0]))
    path = tmp_path_factory.mktemp("calibrated") / "rotor.toml"
    write_rotor(path, replace(plain, supports=supports, calibration=fem.Calibration(NAMES, np.ones(3), cov)))
    return path
