"""Rotor tables, and rotor files with all that is attached to a shaft and what a calibration found."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from fem import (
    STEEL_DENSITY,
    STEEL_MODULUS,
    STEEL_POISSON,
    Calibration,
    Disc,
    Model,
    Rotor,
    Support,
)
from fem.forces import kind_of
from fem.parameters import expand
from rotorid.base.text import counted
from rotorid.files import units
from rotorid.files.bearing import Attached, read_attached
from rotorid.files.columns import Column, read_table
from rotorid.files.forces import Place, Places, each, whole
from rotorid.files.problems import InputError, Problems, TableWarning
from rotorid.files.settings import NotNegative, Number, Positive, Settings, Text, key, listed, read_settings
from rotorid.files.toml_file import read_toml
from rotorid.files.units import one_of


def _column(stem: str, of: dict[str, units.Unit], *usual: str, required: bool = False) -> Column:
    names = tuple(f"{stem}_{unit}" for unit in usual)
    return Column(stem, one_of(of), names, required=required, blank=stem != "length")


ATTACHED = (
    _column("mass", units.MASS, "kg"),
    _column("polar_inertia", units.INERTIA, "kg_m2"),
    _column("diametral_inertia", units.INERTIA, "kg_m2"),
    _column("support_stiffness", units.STIFFNESS, "N_per_m"),
    _column("support_damping", units.DAMPING, "N_s_per_m"),
)
OF_ELEMENTS = (
    _column("youngs_modulus", units.MODULUS, "Pa"),
    _column("density", units.DENSITY, "kg_per_m3"),
    Column("poisson_ratio", units.ratio, required=False, blank=True),
    _column("material_damping", units.TIME, "s"),
)
COLUMNS = (
    _column("length", units.LENGTH, "m", "mm", required=True),
    _column("diameter", units.LENGTH, "m", "mm", required=True),
    _column("inner_diameter", units.LENGTH, "m"),
    Column("element", required=False, blank=True),
    *ATTACHED,
    *OF_ELEMENTS,
)
USUAL = {
    "length": (5e-5, 50.0, "m", {"mm": 1e-3, "m": 1e3, "in": 0.0254}),
    "outer_diameter": (5e-4, 10.0, "m", {"mm": 1e-3, "m": 1e3, "in": 0.0254}),
    "youngs_modulus": (1e9, 1e12, "Pa", {"MPa": 1e6, "GPa": 1e9, "psi": 6894.757, "kPa": 1e3}),
    "density": (100.0, 3e4, "kg/m³", {"g/cm³": 1e3, "kg/mm³": 1e9, "t/mm³": 1e12}),
    "clearance": (2e-6, 5e-3, "m", {}),
    "gap": (1e-7, 2e-2, "m", {}),
    "viscosity": (1e-5, 2.0, "Pa·s", {}),
}
"""What quantities are in machines: from, to, in which unit; other units by their size in that one."""


class Material(Settings):
    """What a shaft is made of where its table does not say."""

    youngs_modulus: Positive = key("Young's modulus", "youngs_modulus_Pa", STEEL_MODULUS, units=units.MODULUS)
    density: NotNegative = key("density", "density_kg_per_m3", STEEL_DENSITY, units=units.DENSITY)
    poisson_ratio: Annotated[Number, Field(gt=-1, le=0.5)] = key(
        "Poisson's ratio; where it is given, shear is counted unless `[model] shear = false`",
        default=STEEL_POISSON,
    )
    material_damping: NotNegative = key(
        "loss per stress rate: the stress is E (ε + τ dε/dt)", "material_damping_s", 0.0
    )


class Effects(Settings):
    """What the elements take into account."""

    shear: bool = key("shear deformation (Timoshenko)", default=False)
    rotary_inertia: bool = key("inertia of tilting sections and discs", default=False)
    gyroscopic: bool = key("gyroscopic moments of shaft and discs", default=False)


class Station(Place):
    """A name for a node."""

    name: Text = key("the name, which stands wherever a node may", expected="a name for the node")

    def wrong(self) -> Iterator[tuple[str, str]]:
        """A name that means something else."""
        if self.name.isdecimal() or {":", ","} & {*self.name}:
            yield (
                "name",
                "a name, not a number, without ':' and ',', which separate names on the command line",
            )


class DiscKeys(Place):
    """A disc by its mass, or by its geometry."""

    mass: NotNegative | None = key(
        "mass; with moments of inertia or alone", "mass_kg", None, units=units.MASS
    )
    polar_inertia: NotNegative | None = key(
        "about the shaft's line", "polar_inertia_kg_m2", None, units=units.INERTIA
    )
    diametral_inertia: NotNegative | None = key(
        "across it", "diametral_inertia_kg_m2", None, units=units.INERTIA
    )
    width: Positive | None = key(
        "of a disc by geometry, with `outer_diameter_m`", "width_m", None, units=units.LENGTH
    )
    outer_diameter: Positive | None = key(
        "of a disc by geometry", "outer_diameter_m", None, units=units.LENGTH
    )
    inner_diameter: NotNegative | None = key(
        "bore of a disc by geometry; default: none", "inner_diameter_m", None, units=units.LENGTH
    )
    density: NotNegative | None = key(
        "of a disc by geometry; default: the material's", "density_kg_per_m3", None, units=units.DENSITY
    )

    def wrong(self) -> Iterator[tuple[str, str]]:
        """Neither of both, or some of both."""
        geometry = [
            name for name in ("width", "outer_diameter", "inner_diameter", "density") if self.has(name)
        ]
        if bool(geometry) == self.has("mass"):
            yield "mass", "either the mass of the disc or its geometry: width_m, outer_diameter_m"
        elif geometry and (self.polar_inertia or self.diametral_inertia):
            yield "polar_inertia", "nothing beside the geometry, which gives it"
        elif geometry and (self.width is None or self.outer_diameter is None):
            yield "width", "the disc's width and outer diameter"


class Parameter(Settings):
    """A number of a rotor that was fitted."""

    name: Text = key("which of the rotor's numbers, such as `bearing[1].kxx.scale`", expected="its name")
    value: Number = key("what was found, in SI; a scale of the file calibrated", expected="its value")
    std: NotNegative = key(
        "standard deviation; of a scale relative to this file", expected="its std, 0 or more"
    )
    correlation: listed(Number) = key(  # type: ignore[valid-type]
        "with all parameters in their order; default: with none", default=()
    )


class DataFile(Settings):
    """A file of readings."""

    file: Text = key("name of a file that it was made from", expected="its name")
    sha256: Text = key("hash of its content", expected="its hash")


class CalibrationKeys(Settings):
    """What a fit to readings found."""

    needs_trial_run: bool = key("whether the data contradict the model", default=False)
    lack_of_fit: NotNegative = key(
        "what the model leaves of a coefficient, one relative standard deviation", default=0.0
    )
    parameter: list[Parameter] = key("what was fitted", default=[])
    data: list[DataFile] = key("a file that it was made from, which must not count twice", default=[])


class RotorFile(Attached):  # type: ignore[misc, valid-type]
    """A rotor file."""

    shaft: Text = key(
        "the rotor table, relative to this file; required",
        expected='the file of the shaft, shaft = "shaft.csv"',
    )
    material: Material = key("of elements whose row says nothing", default=Material())
    model: Effects = key(
        "effects that count, true or false; an inertia that is thereby ignored gives a warning",
        default=Effects(),
    )
    disc: list[DiscKeys] = key("a disc, as many as there are", default=[])
    station: list[Station] = key("a name for a node", default=[])
    calibration: CalibrationKeys | None = key("what a fit to readings found, with its errors", default=None)


def read_rotor(path: str | Path) -> Rotor:
    """Read a rotor from a rotor table (`.csv`, `.xlsx`) or a rotor file (`.toml`).

    Parameters
    ----------
    path
        The file; in a workbook the sheet `rotor`, or else the first one.

    Returns
    -------
    fem.Rotor
        In SI; nodes are numbered from 1, row *i* is the element between nodes *i* and *i* + 1.

    Raises
    ------
    InputError
        With all problems of the file, and of the tables that it names.

    Warns
    -----
    TableWarning
        About a guessed encoding, and sizes, materials and bearings that seem to be in another unit.
    """
    path, problems = Path(path), Problems()
    data: Mapping[str, Any] = {"shaft": "this table"}
    if is_file := path.suffix.lower() == ".toml":
        data = problems.need(read_toml(path, problems))
        if "shaft" not in data and "masses_kg" in data:
            expected = "a rotor file; this is a small model, for `rotorid motion`, `response`, `fit` and such"
            problems.add(str(path), None, "shaft", None, expected)
            problems.stop()
    file = problems.need(read_settings(RotorFile, data, str(path), problems))
    problems.stop()
    parts, stations = _shaft(path.parent / file.shaft if is_file else path, file.material), dict[str, int]()
    at = Places(range(1, len(parts["length"]) + 2), stations)

    def name(item: Station) -> None:
        if item.name in stations:
            raise InputError([item.problem("name", "a name that no other station has")])
        stations[item.name] = at(item)

    each(problems, file.station, "station", name)
    parts["discs"] += each(problems, file.disc, "disc", lambda item: _disc(item, at(item), file.material))
    supports, forces = read_attached(file, at, path.parent, problems)
    parts["supports"] += supports
    problems.stop()
    effects, has_ratio = file.model.model_dump(), parts.pop("has_ratio") or file.material.has("poisson_ratio")
    if not file.model.has("shear"):  # nothing else depends on the ratio
        effects["shear"] = has_ratio
    more: dict[str, Any] = {"forces": forces, "stations": stations, "model": Model(**effects)}
    rotor = whole(file, "rotor", lambda _: Rotor(**parts, **more))
    _warn_of_units(str(path), rotor)
    if file.calibration:
        found = whole(file.calibration, "calibration", lambda keys: _calibration(keys, rotor))
        return replace(rotor, calibration=found)
    return rotor


def rotor_files(path: str | Path) -> tuple[Path, ...]:
    """The files that `read_rotor` reads, for provenance: a rotor file has tables too.

    Parameters
    ----------
    path
        A rotor table, a rotor file or a small model.

    Returns
    -------
    The file itself first, then the tables that it names.
    """
    path = Path(path)
    data = read_toml(path, Problems()) or {} if path.suffix.lower() == ".toml" else {}
    rows = [item for part in data.values() if isinstance(part, list) for item in part]
    tables = [data, *(row for row in rows if isinstance(row, dict))]
    named = [table[key].strip() for table in tables for key in ("shaft", "table") if key in table]
    return (path, *(path.parent / name for name in dict.fromkeys(named)))


def _shaft(path: Path, material: Material) -> dict[str, Any]:
    """What a rotor table says, by the attributes of a rotor."""
    problems = Problems()
    table = problems.need(read_table(path, "rotor", COLUMNS, problems))

    def values(stem: str, none: float = 0.0) -> Any:  # noqa: ANN401
        return np.where(table.is_blank(stem), none, table.numbers(stem, none))

    length, diameter, inner = table.numbers("length"), table.numbers("diameter"), values("inner_diameter")
    elements = length != 0
    last = np.arange(len(length)) == len(length) - 1
    expected = "a length above 0 (0 only in the last row, which attaches to the right end)"
    table.must_be("length", (length > 0) | (last & ~elements), expected)
    if not elements.any():
        table.in_header(table.fields["length"].name, "at least one row with a length above 0")
    # blank only in a last row without an element
    table.complain_where(elements & table.is_blank("diameter"), "diameter", "a number")
    of_elements = {column.stem: values(column.stem, getattr(material, column.stem)) for column in OF_ELEMENTS}
    ratio = of_elements["poisson_ratio"]
    table.must_be("poisson_ratio", (ratio > -1) & (ratio <= 0.5) | ~elements, "a number above -1, up to 0.5")
    for stem in ("diameter", "youngs_modulus"):
        table.must_be(stem, (table.numbers(stem) > 0) | ~elements, "a number above 0")
    table.must_be("inner_diameter", ~(inner >= diameter) | ~elements, "less than the outer diameter")
    for stem in ("inner_diameter", "density", "material_damping", *(column.stem for column in ATTACHED)):
        outwards = "; what pushes outwards, or drives, is a [[seal]] of a rotor file" * ("support" in stem)
        table.must_be(stem, ~(values(stem) < 0), f"a number of 0 or more{outwards}")
    problems.stop()
    rows = np.array([values(column.stem) for column in ATTACHED]).T.tolist()
    return {
        "length": length[elements],
        "outer_diameter": diameter[elements],
        "inner_diameter": inner[elements],
        **{stem: value[elements] for stem, value in of_elements.items()},
        "discs": [Disc(node, *row[:3]) for node, row in enumerate(rows, 1) if any(row[:3])],
        "supports": [Support(node, *row[3:]) for node, row in enumerate(rows, 1) if any(row[3:])],
        "has_ratio": "poisson_ratio" in table,
    }


def _disc(item: DiscKeys, node: int, material: Material) -> Disc:
    values = item.model_dump(exclude_none=True) | {"node": node}
    if "mass" in values:
        return Disc(**values)
    return Disc.from_geometry(**{"density": material.density} | values)


def _calibration(file: CalibrationKeys, rotor: Rotor) -> Calibration:
    """ValueError for what is none of this rotor."""
    n = len(file.parameter)
    for one in file.parameter:
        if expand(rotor, one.name) != (one.name,):
            raise ValueError(f"{one.name} is not a single parameter: name one, without [*]")
        if len(one.correlation) not in (0, n):
            raise ValueError(f"{one.name}: correlation needs {counted(n, 'number')}, one for each parameter")
    std = np.array([one.std for one in file.parameter])
    R = [one.correlation or row for one, row in zip(file.parameter, np.eye(n), strict=True)]
    return Calibration(
        tuple(one.name for one in file.parameter),
        np.array([one.value for one in file.parameter]),
        np.reshape(R, (n, n)) * np.outer(std, std),
        file.lack_of_fit,
        file.needs_trial_run,
        {one.file: one.sha256 for one in file.data},
    )


def _warn_of_units(source: str, rotor: Rotor) -> None:
    """Sizes in a wrong unit give a rotor that can be computed all the same."""
    items = [(f"{kind_of(one).replace('_', ' ')} at node {one.node}", one) for one in rotor.forces]
    for what, item in [("", rotor), *items]:
        for name, (low, high, unit, others) in USUAL.items():
            values = np.atleast_1d(getattr(item, name, 0.0))
            for i in np.flatnonzero((values > 0) & ((values < low) | (values > high)))[:1].tolist():
                meant = [other for other, size in others.items() if low <= values[i] * size <= high]
                words = f"{source}, {what or f'element {i + 1}'}: {name} {values[i]:.6g} {unit}"
                question = f"is this in {[*meant, 'another unit'][0]}?"
                warnings.warn(f"{words}; {question}", TableWarning, stacklevel=3)
