"""Rotor tables, and rotor files with all that is attached to a shaft and what a calibration found."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import suppress
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
from fem.parameters import expand
from rotorid.base.tables import csv_bytes
from rotorid.base.text import counted
from rotorid.files import units
from rotorid.files.bearings_and_seals import (
    OUTWARDS,
    Attached,
    Place,
    each,
    force_tables,
    in_si,
    places,
    read_attached,
    support_tables,
    whole,
)
from rotorid.files.columns import Column, read_table
from rotorid.files.disk import each_file_once, write_files
from rotorid.files.input_problems import InputError, Problems, TableWarning, refusal
from rotorid.files.settings import (
    NotNegative,
    Number,
    Positive,
    Settings,
    Text,
    key,
    listed,
    optional,
    read_settings,
    read_toml,
    toml_bytes,
    unwritten,
)
from rotorid.files.units import one_of

USUAL = {
    "length": (5e-5, 50.0, units.LENGTH),
    "diameter": (5e-4, 10.0, units.LENGTH),
    "youngs_modulus": (1e9, 1e12, units.MODULUS),
    "density": (100.0, 3e4, units.DENSITY),
}
"""From where to where quantities of machines are, in SI, and units in which they may have been meant."""


class Material(Settings):
    """What a shaft is made of where its table does not say."""

    youngs_modulus: Positive = key("Young's modulus", "youngs_modulus_Pa", STEEL_MODULUS, units=units.MODULUS)
    density: NotNegative = key("density", "density_kg_per_m3", STEEL_DENSITY, units=units.DENSITY)
    poisson_ratio: Annotated[Number, Field(gt=-1, le=0.5)] = key(
        "Poisson's ratio; where it is given, shear is counted unless `[model] shear = false`",
        default=STEEL_POISSON,
    )
    material_damping: NotNegative = key(
        "loss per stress rate: the stress is E (ε + τ dε/dt)", "material_damping_s", 0.0, units=units.TIME
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

    mass: NotNegative | None = optional("mass; with moments of inertia or alone", "mass_kg", units=units.MASS)
    polar_inertia: NotNegative | None = optional(
        "about the shaft's line", "polar_inertia_kg_m2", units=units.INERTIA
    )
    diametral_inertia: NotNegative | None = optional(
        "across it", "diametral_inertia_kg_m2", units=units.INERTIA
    )
    width: Positive | None = optional(
        "of a disc by geometry, with `outer_diameter_m`", "width_m", units=units.LENGTH
    )
    outer_diameter: Positive | None = optional(
        "of a disc by geometry", "outer_diameter_m", units=units.LENGTH
    )
    inner_diameter: NotNegative | None = optional(
        "bore of a disc by geometry; default: none", "inner_diameter_m", units=units.LENGTH
    )
    density: NotNegative | None = optional(
        "of a disc by geometry; default: the material's", "density_kg_per_m3", units=units.DENSITY
    )

    def wrong(self) -> Iterator[tuple[str, str]]:
        """Neither of both, or some of both."""
        both = {"width", "outer_diameter"}
        sizes = self.model_fields_set & {*both, "inner_diameter", "density"}
        if bool(sizes) == self.has("mass"):
            yield "mass", "either the mass of the disc or its geometry: width_m, outer_diameter_m"
        elif sizes and (self.has("polar_inertia") or self.has("diametral_inertia") or not both <= sizes):
            yield "width", "the disc's width and outer diameter, and no moments of inertia beside them"

    def made(self, node: int, density: float) -> Disc:
        """The disc at a node, of the material's density."""
        values = self.model_dump(exclude_none=True) | {"node": node}
        return Disc(**values) if self.has("mass") else Disc.from_geometry(**{"density": density} | values)


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
    material: Material = key("of elements whose row says nothing", default=Material.model_construct())
    model: Effects = key(
        "effects that count, true or false; an inertia that is thereby ignored gives a warning",
        default=Effects.model_construct(),
    )
    disc: list[DiscKeys] = key("a disc, as many as there are", default=[])
    station: list[Station] = key("a name for a node", default=[])
    calibration: CalibrationKeys | None = optional("what a fit to readings found, with its errors")


def _column(stem: str, of: dict[str, units.Unit], *usual: str) -> Column:
    names = tuple(f"{stem}_{unit}" for unit in usual)
    return Column(stem, one_of(of), names, required=len(usual) > 1, blank=stem != "length")


OF_ELEMENTS = {
    "length": _column("length", units.LENGTH, "m", "mm"),
    "outer_diameter": _column("diameter", units.LENGTH, "m", "mm"),
    "inner_diameter": _column("inner_diameter", units.LENGTH, "m"),
    "youngs_modulus": _column("youngs_modulus", units.MODULUS, "Pa"),
    "density": _column("density", units.DENSITY, "kg_per_m3"),
    "poisson_ratio": Column("poisson_ratio", units.ratio, required=False, blank=True),
    "material_damping": _column("material_damping", units.TIME, "s"),
}
"""Columns by attribute of a rotor, for reading and writing."""
OF_NODES = (
    _column("mass", units.MASS, "kg"),
    _column("polar_inertia", units.INERTIA, "kg_m2"),
    _column("diametral_inertia", units.INERTIA, "kg_m2"),
    _column("support_stiffness", units.STIFFNESS, "N_per_m"),
    _column("support_damping", units.DAMPING, "N_s_per_m"),
)
COLUMNS = (*OF_ELEMENTS.values(), Column("element", required=False, blank=True), *OF_NODES)


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
        About a guessed encoding, and sizes and materials that seem to be in another unit.
    """
    path, problems = Path(path), Problems()
    file, shaft, stations = unwritten(RotorFile, str(path)), path, dict[str, int]()
    if path.suffix.lower() == ".toml":
        from rotorid.files.small_model import is_small

        data = read_toml(path)
        if is_small(data):
            expected = "a rotor file; this is a small model, for `rotorid motion`, `response`, `fit` and such"
            raise refusal(path, expected, column="shaft")
        file = read_settings(RotorFile, data, str(path))
        shaft = path.parent / file.shaft
    parts = _shaft(shaft, file.material)
    at = places(range(1, len(parts["length"]) + 2), stations)

    def name(item: Station) -> None:
        if item.name in stations:
            raise InputError([item.problem("name", "a name that no other station has")])
        stations[item.name] = at(item)

    each(problems, file.station, "station", name)
    density = file.material.density
    parts["discs"] += each(problems, file.disc, "disc", lambda item: item.made(at(item), density))
    attached = read_attached(file, at, path.parent, problems)
    problems.stop()
    parts |= {"forces": attached["forces"], "supports": parts["supports"] + attached["supports"]}
    effects, has_ratio = file.model.model_dump(), parts.pop("has_ratio") or file.material.has("poisson_ratio")
    if not file.model.has("shear"):  # nothing else depends on the ratio
        effects["shear"] = has_ratio
    rotor = whole(file, "rotor", lambda _: Rotor(**parts, stations=stations, model=Model(**effects)))
    if file.calibration:
        calibration = whole(file.calibration, "calibration", lambda keys: _calibration(keys, rotor))
        return replace(rotor, calibration=calibration)
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
    from rotorid.files.small_model import is_small_model, read_small_model

    path = Path(path)
    with each_file_once() as asked, suppress(InputError), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        read_small_model(path) if is_small_model(path) else read_rotor(path)
    return tuple(asked)


def _shaft(path: Path, material: Material) -> dict[str, Any]:
    """What a rotor table says, by the attributes of a rotor."""
    problems, doubts = Problems(), Problems()
    table = read_table(path, "rotor", COLUMNS, problems)
    values = {}
    for stem in (column.stem for column in COLUMNS if column.unit):
        default = getattr(material, stem, 0.0)
        values[stem] = np.where(table.is_blank(stem), default, table.numbers(stem, default))
    elements, last = values["length"] != 0, np.arange(len(table)) == len(table) - 1
    expected = "a length above 0 (0 only in the last row, which attaches to the right end)"
    table.complain_where((values["length"] < 0) | ~(elements | last), "length", expected)
    if not elements.any():
        table.in_header("length", "at least one row with a length above 0")
    # blank only in a last row without an element
    table.complain_where(elements & table.is_blank("diameter"), "diameter", "a number")
    for stem in ("diameter", "youngs_modulus"):
        table.complain_where(elements & (table.numbers(stem) <= 0), stem, "a number above 0")
    ratio, thick = values["poisson_ratio"], table.numbers("inner_diameter") >= table.numbers("diameter")
    outside = elements & ((ratio <= -1) | (ratio > 0.5))
    table.complain_where(outside, "poisson_ratio", "a number above -1, up to 0.5")
    table.complain_where(elements & thick, "inner_diameter", "less than the outer diameter")
    for stem in ("inner_diameter", "density", "material_damping", *(column.stem for column in OF_NODES)):
        expected = OUTWARDS if "support" in stem else "a number of 0 or more"
        table.complain_where(values[stem] < 0, stem, expected)
    problems.stop()
    for stem, (low, high, of) in USUAL.items():
        odd = elements & (values[stem] > 0) & (np.clip(values[stem], low, high) != values[stem])
        written = ~np.isnan(table.numbers(stem))
        for value in values[stem][odd][:1].tolist():
            shown = value * (table.unit(stem).scale if stem in table else 1.0)
            meant = [name for name, unit in of.items() if low <= unit.to_si(shown) <= high]
            expected = f"{low:g} to {high:g} {next(iter(of))}; is this in {[*meant, 'another unit'][0]}?"
            replace(table, problems=doubts).complain_where(odd & written, stem, expected)
            if (odd & ~written).any():
                material.complain(doubts, stem, expected)
    if len(doubts):
        warnings.warn(str(InputError(doubts)), TableWarning, stacklevel=3)
    rows = np.array([values[column.stem] for column in OF_NODES]).T.tolist()
    return {
        **{name: values[column.stem][elements] for name, column in OF_ELEMENTS.items()},
        "discs": [Disc(node, *row[:3]) for node, row in enumerate(rows, 1) if any(row[:3])],
        "supports": [Support(node, *row[3:]) for node, row in enumerate(rows, 1) if any(row[3:])],
        "has_ratio": "poisson_ratio" in table,
    }


def _calibration(file: CalibrationKeys, rotor: Rotor) -> Calibration:
    """ValueError for what is none of this rotor."""
    parameters, n = file.parameter, len(file.parameter)
    for one in parameters:
        if expand(rotor, one.name) != (one.name,):
            raise ValueError(f"{one.name} is not a single parameter: name one, without [*]")
        if len(one.correlation) not in (0, n):
            raise ValueError(f"{one.name}: correlation needs {counted(n, 'number')}, one for each parameter")
    std = np.array([one.std for one in parameters])
    R = [one.correlation or row for one, row in zip(parameters, np.eye(n), strict=True)]
    return Calibration(
        tuple(one.name for one in parameters),
        np.array([one.value for one in parameters]),
        np.reshape(R, (n, n)) * np.outer(std, std),
        file.lack_of_fit,
        file.needs_trial_run,
        {one.file: one.sha256 for one in file.data},
    )


def write_rotor(path: str | Path, rotor: Rotor) -> tuple[Path, ...]:
    """Write a rotor so that `read_rotor` gives an equal one, whole or not at all.

    Parameters
    ----------
    path
        Ends in `.toml`; the tables `NAME_shaft.csv` and `NAME_bearing_1.csv`, `NAME_seal_2.csv`, …
        (of supports whose coefficients depend on speed) go beside it.
    rotor
        What to write. A disc is written by its mass and moments of inertia, however it was made.

    Returns
    -------
    tuple of Path
        All files written, the rotor file first. Existing files are replaced, after all new ones are
        complete on disk.

    Raises
    ------
    InputError
        If the file cannot be written, or its name has another ending.
    ValueError
        If the file would not give the rotor back: names of stations that read as node numbers, names that
        are no Unicode text, numbers that are no machine's.
    """
    path = Path(path)
    if path.suffix.lower() != ".toml":
        raise refusal(path, "a name that ends in .toml")
    files = rotor_file_bytes(path, rotor)
    write_files(files)
    return tuple(reversed(files))


def rotor_file_bytes(path: Path, rotor: Rotor) -> dict[Path, bytes]:
    """All files of a rotor, the rotor file last: it names the others; ValueError as `write_rotor`."""
    beside, why = path.parent / ".written", ""
    try:
        files = _files(path, rotor)
        copies = {beside / file.name: data for file, data in files.items()}
        with each_file_once(copies), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            if read_rotor(beside / path.name) == rotor:
                return files
    except ValueError as error:
        why = f": {error}".replace(".written/", "")
    raise ValueError(f"{path}: this rotor would not come back from its file{why}")


def _files(path: Path, rotor: Rotor) -> dict[Path, bytes]:
    shaft, material = path.with_name(f"{path.stem}_shaft.csv"), dict[str, float]()
    columns = {"element": [str(i + 1) for i in range(rotor.n_elements)]}
    for name, column in OF_ELEMENTS.items():
        values = getattr(rotor, name)
        if name in Material.model_fields and np.ptp(values) == 0:
            material[name] = float(values[0])
        elif values.any():
            columns[column.names[0]] = values.tolist()
    supports, tables = support_tables(rotor.supports, path)
    document = {
        "shaft": shaft.name,
        "material": in_si(Material, material),
        "model": vars(rotor.model),  # in full: a ratio would make shear count
        "disc": [in_si(DiscKeys, vars(disc)) for disc in rotor.discs],
        **supports,
        **force_tables(rotor.forces),
        "station": [{"name": name, "node": node} for name, node in rotor.stations.items()],
        "calibration": _calibration_tables(rotor.calibration) if rotor.calibration else {},
    }
    return {
        shaft: csv_bytes([*columns], [*zip(*columns.values(), strict=True)]),
        **tables,
        path: toml_bytes({name: part for name, part in document.items() if part}),
    }


def _calibration_tables(calibration: Calibration) -> dict[str, Any]:
    arrays = calibration.values, calibration.std, calibration.correlation
    rows = zip(calibration.names, *(array.tolist() for array in arrays), strict=True)
    return {
        "needs_trial_run": calibration.needs_trial_run,
        "lack_of_fit": calibration.lack_of_fit,
        "parameter": [dict(zip(Parameter.model_fields, row, strict=True)) for row in rows],
        "data": [{"file": name, "sha256": value} for name, value in calibration.data.items()],
    }
