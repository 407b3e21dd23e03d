"""The reference rotor as a model of rotorid and of ROSS, with the same physics.

Euler–Bernoulli beam with consistent mass, no shear; with `gyroscopic` also rotary inertia and gyroscopic
effect of shaft and discs, without it discs are point masses. ROSS has six unknowns per node (axial and
torsional motion, too, uncoupled here) and both lateral planes; on isotropic supports its x-plane is the real
part of rotorid's complex coordinate.
"""

from __future__ import annotations

import csv
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import fem

SIZES = {23: 1, 92: 4, 460: 20}  # elements, and how many each row of the table is cut into
INERTIA = np.array((0.2**2 / 2, 0.2**2 / 4))
"""Polar and diametral, of a thin disc of 1 kg, 0.4 m in diameter, kg·m²."""
TABLE = Path(__file__).resolve().parents[1] / "sample_data" / "rotor23.csv"


# A compiled dependency of ROSS complains at length that REFPROP is not installed.
kept = os.dup(1), os.dup(2)
for stream in (1, 2):
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
import ross  # noqa: E402

for stream in (1, 2):
    os.dup2(kept[stream - 1], stream)

ROSS = f"ROSS {ross.__version__}"


def table(times: int = 1) -> list[dict[str, float]]:
    """Rows of the reference rotor, each cut into `times` equal elements."""
    with TABLE.open(encoding="utf-8", newline="") as file:
        rows = [{key: float(value or 0) for key, value in row.items()} for row in csv.DictReader(file)]
    cut = []
    for row in rows:
        row["length_m"] /= times
        bare = row | {"mass_kg": 0.0, "support_stiffness_N_per_m": 0.0}
        cut += [row, *[bare] * (times - 1)]
    return cut


@dataclass(frozen=True)
class Bearing:
    """What stands at both supports, besides the table's stiffness k in x: factors of k, and N·s/m."""

    damping: float = 0.0
    vertical: float = 1.0  # kyy / k
    cross: float = 0.0  # kxy / k = −kyx / k
    vertical_damping: float | None = None  # cyy, cxx by default


ANISOTROPIC = Bearing(damping=2e4, vertical=0.6, cross=0.05, vertical_damping=3e4)


def rotorid_rotor(rows: list[dict[str, float]], bearing: Bearing, gyroscopic: bool = False) -> fem.Rotor:
    supports = []
    for n, row in enumerate(rows, 1):
        k, c = row["support_stiffness_N_per_m"], bearing.damping
        if k and bearing.vertical == 1 and not bearing.cross:
            supports.append(fem.Support(n, k, c))
        elif k:
            turn = bearing.cross * k
            other = c if bearing.vertical_damping is None else bearing.vertical_damping
            supports.append(fem.Support(n, ((k, turn), (-turn, bearing.vertical * k)), ((c, 0), (0, other))))
    return fem.Rotor(
        length=[row["length_m"] for row in rows],
        outer_diameter=[row["diameter_m"] for row in rows],
        discs=[
            fem.Disc(n, row["mass_kg"], *(row["mass_kg"] * INERTIA if gyroscopic else ()))
            for n, row in enumerate(rows, 1)
            if row["mass_kg"]
        ],
        supports=supports,
        model=fem.Model(rotary_inertia=gyroscopic, gyroscopic=gyroscopic),
    )


def ross_rotor(rows: list[dict[str, float]], bearing: Bearing, gyroscopic: bool = False) -> Any:
    steel = ross.Material("steel", rho=fem.STEEL_DENSITY, E=fem.STEEL_MODULUS, Poisson=0.3)
    beam = {"material": steel, "idl": 0.0, "shear_effects": False}
    beam |= {"rotary_inertia": gyroscopic, "gyroscopic": gyroscopic}
    shaft = [
        ross.ShaftElement(L=row["length_m"], odl=row["diameter_m"], n=n, **beam) for n, row in enumerate(rows)
    ]
    discs, bearings = [], []
    for n, row in enumerate(rows):
        if row["mass_kg"]:
            polar, diametral = row["mass_kg"] * gyroscopic * INERTIA
            discs.append(ross.DiskElement(n=n, m=row["mass_kg"], Id=diametral, Ip=polar))
        if k := row["support_stiffness_N_per_m"]:
            turn = bearing.cross * k
            stiffness = {"kxx": k, "kyy": bearing.vertical * k, "kxy": turn, "kyx": -turn}
            damping = {"cxx": bearing.damping, "cyy": bearing.vertical_damping}
            bearings.append(ross.BearingElement(n=n, **stiffness, **damping))
    return ross.Rotor(shaft, discs, bearings)
