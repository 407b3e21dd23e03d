"""The reference rotor as a model of rotorid and of ROSS, with the same physics.

Euler–Bernoulli beam with consistent mass, no shear, no rotary inertia, no gyroscopic effect; discs are
point masses. ROSS has six unknowns per node (axial and torsional motion, too, uncoupled here) and both
lateral planes; on isotropic supports its x-plane is the real part of rotorid's complex coordinate.
"""

from __future__ import annotations

import contextlib
import csv
import os
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import fem

TABLE = Path(__file__).resolve().parents[1] / "sample_data" / "rotor23.csv"


@contextlib.contextmanager
def _silence() -> Iterator[None]:
    """Send standard output and error nowhere, compiled libraries included."""
    sys.stdout.flush()
    kept = os.dup(1), os.dup(2)
    with open(os.devnull, "w") as nowhere, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        os.dup2(nowhere.fileno(), 1)
        os.dup2(nowhere.fileno(), 2)
        try:
            yield
        finally:
            sys.stdout.flush()
            os.dup2(kept[0], 1)
            os.dup2(kept[1], 2)
            os.close(kept[0])
            os.close(kept[1])


with _silence():  # a dependency of ROSS complains at length that REFPROP is not installed
    import ross

ROSS = f"ROSS {ross.__version__}"


def table() -> list[dict[str, float]]:
    with TABLE.open(encoding="utf-8", newline="") as file:
        return [{key: float(value or 0) for key, value in row.items()} for row in csv.DictReader(file)]


def rotorid_rotor(rows: list[dict[str, float]], damping: float) -> fem.Rotor:
    return fem.Rotor(
        length=[row["length_m"] for row in rows],
        outer_diameter=[row["diameter_m"] for row in rows],
        discs=[fem.Disc(n, row["mass_kg"]) for n, row in enumerate(rows, 1) if row["mass_kg"]],
        supports=[
            fem.Support(n, row["support_stiffness_N_per_m"], damping)
            for n, row in enumerate(rows, 1)
            if row["support_stiffness_N_per_m"]
        ],
    )


def ross_rotor(rows: list[dict[str, float]], damping: float) -> Any:
    steel = ross.Material("steel", rho=fem.STEEL_DENSITY, E=fem.STEEL_MODULUS, Poisson=0.3)
    shaft = [
        ross.ShaftElement(
            L=row["length_m"],
            idl=0.0,
            odl=row["diameter_m"],
            material=steel,
            n=n,
            shear_effects=False,
            rotary_inertia=False,
            gyroscopic=False,
        )
        for n, row in enumerate(rows)
    ]
    discs = [
        ross.DiskElement(n=n, m=row["mass_kg"], Id=0.0, Ip=0.0)
        for n, row in enumerate(rows)
        if row["mass_kg"]
    ]
    bearings = [
        ross.BearingElement(n=n, kxx=row["support_stiffness_N_per_m"], cxx=damping)
        for n, row in enumerate(rows)
        if row["support_stiffness_N_per_m"]
    ]
    return ross.Rotor(shaft, discs, bearings)
