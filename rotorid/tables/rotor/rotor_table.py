"""Rotor tables: shaft elements, with what is attached to their left nodes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fem import (
    SHORTEST,
    STEEL_DENSITY,
    STEEL_MODULUS,
    STEEL_POISSON,
    Disc,
    Model,
    NodeForce,
    Rotor,
    Support,
    too_short,
)
from rotorid.base.arrays import FloatArray
from rotorid.files import units
from rotorid.files.columns import Column, Table, read_table
from rotorid.files.problems import Problems
from rotorid.files.units import one_of
from rotorid.tables.rotor.rotor_plausibility import warn_of_rotor, warn_of_table

_LENGTH = one_of(units.LENGTH)
ATTACHED = tuple(
    Column(stem, one_of(unit), (name,), required=False, blank=True)
    for stem, unit, name in (
        ("mass", units.MASS, "mass_kg"),
        ("polar_inertia", units.INERTIA, "polar_inertia_kg_m2"),
        ("diametral_inertia", units.INERTIA, "diametral_inertia_kg_m2"),
        ("support_stiffness", units.STIFFNESS, "support_stiffness_N_per_m"),
        ("support_damping", units.DAMPING, "support_damping_N_s_per_m"),
    )
)
OF_ELEMENTS = (
    Column("youngs_modulus", one_of(units.MODULUS), ("youngs_modulus_Pa",), required=False, blank=True),
    Column("density", one_of(units.DENSITY), ("density_kg_per_m3",), required=False, blank=True),
    Column("poisson_ratio", units.ratio, required=False, blank=True),
    Column("material_damping", one_of(units.TIME), ("material_damping_s",), required=False, blank=True),
)
"""In the order of `Material`."""
COLUMNS = (
    Column("length", _LENGTH, ("length_m", "length_mm")),
    Column("diameter", _LENGTH, ("diameter_m", "diameter_mm"), blank=True),
    Column("inner_diameter", _LENGTH, ("inner_diameter_m",), required=False, blank=True),
    Column("element", required=False, blank=True),
    *ATTACHED,
    *OF_ELEMENTS,
)
PLAIN = Model()


@dataclass(frozen=True)
class Material:
    """What a shaft is made of where its table does not say: Pa, kg/m³, 1, s."""

    youngs_modulus: float = STEEL_MODULUS
    density: float = STEEL_DENSITY
    poisson_ratio: float = STEEL_POISSON
    material_damping: float = 0.0


@dataclass(frozen=True, eq=False)
class Shaft:
    """A rotor table: elements, and what stands in it about nodes."""

    length: FloatArray
    outer_diameter: FloatArray
    inner_diameter: FloatArray
    youngs_modulus: FloatArray
    density: FloatArray
    poisson_ratio: FloatArray
    material_damping: FloatArray
    discs: tuple[Disc, ...]
    supports: tuple[Support, ...]
    model: Model = PLAIN
    forces: tuple[NodeForce, ...] = ()


def read_shaft(path: Path, material: Material, problems: Problems) -> Shaft | None:
    """Read a rotor table, or None and problems."""
    table = read_table(path, "rotor", COLUMNS, problems, first=True)
    if table is None:
        return None
    length = table.numbers("length")
    last = len(table) - 1
    end_row = bool(length[last] == 0.0)
    elements = np.arange(len(table)) < len(table) - end_row
    table.must_be(
        "length",
        (length > 0) | ~elements,
        "a length above 0 (0 only in the last row, which then attaches to the right end)",
    )
    short = elements & (length > 0)
    short[short] = too_short(length[short])
    table.complain_where(
        short, "length", f"at least 1/{SHORTEST} of the longer neighbour's length: join this row with it"
    )
    if not elements.any():
        expected = "at least one row with a length above 0"
        table.in_header(table.fields["length"].name, expected)
    diameter, inner = table.numbers("diameter"), _or_none(table, "inner_diameter", 0.0)
    own: dict[str, Any] = {c.stem: _or_none(table, c.stem, getattr(material, c.stem)) for c in OF_ELEMENTS}
    modulus, density, poisson, damping = own.values()
    # blank only in a last row without an element
    table.complain_where(elements & table.is_blank("diameter"), "diameter", "a number")
    for stem, fits, expected in (
        ("diameter", diameter > 0, "a diameter above 0"),
        ("inner_diameter", inner >= 0, "a diameter of 0 or more"),
        ("inner_diameter", ~(inner >= diameter) | ~(diameter > 0), "less than the outer diameter"),
        ("youngs_modulus", modulus > 0, "a number above 0"),
        ("density", density >= 0, "a number of 0 (no mass) or more"),
        ("poisson_ratio", (poisson > -1) & (poisson <= 0.5), "a number above -1, up to 0.5"),
        ("material_damping", damping >= 0, "a time of 0 or more"),
    ):
        table.must_be(stem, fits | ~elements, expected)
    for stem in (column.stem for column in ATTACHED):
        outwards = "; what pushes outwards, or drives, is a [[seal]] of a rotor file" * ("support" in stem)
        table.must_be(stem, table.numbers(stem) >= 0, f"0 (nothing attached) or more{outwards}")
    warn_of_table(table, elements)
    own = {stem: values[elements] for stem, values in own.items()}
    discs, supports = _attached(table)
    model = Model(shear="poisson_ratio" in table)  # nothing else depends on it
    sizes = length[elements], diameter[elements], inner[elements]
    return Shaft(*sizes, discs=discs, supports=supports, model=model, **own)


def build(source: str, shaft: Shaft, stations: dict[str, int], problems: Problems) -> Rotor:
    """Make the rotor; what it refuses becomes a problem of the file."""
    try:
        rotor = Rotor(**vars(shaft), stations=stations)
    except ValueError as error:
        problems.add(source, None, None, None, f"a possible rotor: {error}")
        problems.stop()
        raise
    warn_of_rotor(source, rotor)
    return rotor


def _or_none(table: Table, stem: str, none: float) -> FloatArray:
    """Values of an optional column in SI, shape (rows,); `none` where its cell says nothing."""
    return np.where(table.is_blank(stem), none, table.numbers(stem, none))


def _attached(table: Table) -> tuple[tuple[Disc, ...], tuple[Support, ...]]:
    values = [_or_none(table, column.stem, 0.0) for column in ATTACHED]
    discs, supports = [], []
    for index in range(len(table)):
        mass, polar, diametral, stiffness, damping = (float(column[index]) for column in values)
        if any(math.isnan(value) or value < 0 for value in (mass, polar, diametral, stiffness, damping)):
            continue  # reported
        if mass or polar or diametral:
            discs.append(Disc(index + 1, mass, polar, diametral))
        if stiffness or damping:
            supports.append(Support(index + 1, stiffness, damping))
    return tuple(discs), tuple(supports)
