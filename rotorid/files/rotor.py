"""Rotor tables, and rotor files with all that is attached to a shaft and what a calibration found."""

from __future__ import annotations

import warnings
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fem import Disc, Model, Rotor, Support
from rotorid.base.tables import csv_bytes
from rotorid.files import units
from rotorid.files.columns import OUTWARDS, Column, read_table
from rotorid.files.disk import each_file_once, write_files
from rotorid.files.input_problems import InputError, Problems, TableWarning, refusal
from rotorid.files.units import one_of

USUAL = {
    "length": (5e-5, 50.0, units.LENGTH),
    "diameter": (5e-4, 10.0, units.LENGTH),
    "youngs_modulus": (1e9, 1e12, units.MODULUS),
    "density": (100.0, 3e4, units.DENSITY),
}
"""From where to where quantities of machines are, in SI, and units in which they may have been meant."""


def _column(stem: str, of: dict[str, units.Unit], *usual: str) -> Column:
    return Column(
        stem,
        one_of(of),
        tuple(f"{stem}_{unit}" for unit in usual),
        required=len(usual) > 1,
        blank=stem != "length",
    )


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
    path = Path(path)
    if path.suffix.lower() == ".toml":
        from rotorid.files.rotor_keys import completed, read_keys

        file = read_keys(path)
        return completed(*_shaft(path.parent / file.shaft, file.material), file, path.parent)
    parts, has_ratio = _shaft(path, Rotor)
    try:
        return Rotor(**parts, model=Model(has_ratio))
    except ValueError as error:
        raise refusal(path, f"a possible rotor: {error}") from None


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


def _shaft(path: Path, material: Any) -> tuple[dict[str, Any], bool]:  # noqa: ANN401 - any with these names
    """What a rotor table says, by the attributes of a rotor, and whether it has Poisson's ratios.

    What it does not say is as in the `material`, a `Material` or `Rotor` with its defaults.
    """
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
    }, "poisson_ratio" in table


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
        with (
            each_file_once({beside / file.name: data for file, data in files.items()}),
            warnings.catch_warnings(),
        ):
            warnings.simplefilter("ignore")
            if read_rotor(beside / path.name) == rotor:
                return files
    except ValueError as error:
        why = f": {error}".replace(".written/", "")
    raise ValueError(f"{path}: this rotor would not come back from its file{why}")


def _files(path: Path, rotor: Rotor) -> dict[Path, bytes]:
    from rotorid.files.bearings_and_seals import force_tables, in_si, support_tables
    from rotorid.files.rotor_keys import DiscKeys, Material, calibration_tables
    from rotorid.files.settings import toml_bytes

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
        "calibration": calibration_tables(rotor.calibration) if rotor.calibration else {},
    }
    return {
        shaft: csv_bytes([*columns], [*zip(*columns.values(), strict=True)]),
        **tables,
        path: toml_bytes({name: part for name, part in document.items() if part}),
    }
