"""Writing rotors: what is written is read back before it counts."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from fem import STEEL_POISSON, Calibration, Rotor
from rotorid.base.tables import csv_bytes
from rotorid.files.bearing import support_tables
from rotorid.files.forces import force_tables, in_si
from rotorid.files.input_file import each_file_once
from rotorid.files.problems import InputError, Problem
from rotorid.files.rotor import (
    OF_ELEMENTS,
    CalibrationKeys,
    DiscKeys,
    Effects,
    Material,
    Parameter,
    read_rotor,
)
from rotorid.files.table_writing import write_files
from rotorid.files.toml_file import toml_bytes

_OF_ELEMENTS = {column.stem: column.names[0] for column in OF_ELEMENTS}
"""Full names by attribute of a rotor."""


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
        raise InputError([Problem(str(path), None, None, None, "a name that ends in .toml")])
    files = rotor_file_bytes(path, rotor)
    write_files(files)
    return tuple(reversed(files))


def rotor_file_bytes(path: Path, rotor: Rotor) -> dict[Path, bytes]:
    """All files of a rotor, the rotor file last: it names the others; ValueError as `write_rotor`."""
    beside = path.parent / ".written"
    try:
        files = _files(path, rotor)
        copies = {beside / file.name: data for file, data in files.items()}
        with each_file_once(copies), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            back = read_rotor(beside / path.name)
    except ValueError as error:
        why = str(error).replace(".written/", "")
        raise ValueError(f"{path}: this rotor would not come back from its file: {why}") from None
    if back != rotor:
        raise ValueError(f"{path}: this rotor would not come back from its file")
    return files


def _files(path: Path, rotor: Rotor) -> dict[Path, bytes]:
    shaft = path.with_name(f"{path.stem}_shaft.csv")
    values = {name: getattr(rotor, name) for name in _OF_ELEMENTS}
    uniform = {name: float(array[0]) for name, array in values.items() if np.ptp(array) == 0}
    columns = {
        "element": [str(number) for number in range(1, rotor.n_elements + 1)],
        "length_m": rotor.length.tolist(),
        "diameter_m": rotor.outer_diameter.tolist(),
        "inner_diameter_m": rotor.inner_diameter.tolist() if rotor.inner_diameter.any() else [],
        **{_OF_ELEMENTS[name]: array.tolist() for name, array in values.items() if name not in uniform},
    }
    columns = {name: column for name, column in columns.items() if column}
    effects = in_si(Effects, vars(rotor.model))
    if not rotor.model.shear and (rotor.poisson_ratio != STEEL_POISSON).any():
        effects["shear"] = False  # without a word it would be counted
    supports, tables = support_tables(rotor.supports, path)
    document = {
        "shaft": shaft.name,
        "material": in_si(Material, uniform),
        "model": effects,
        "disc": [in_si(DiscKeys, vars(disc)) for disc in rotor.discs],
        **supports,
        **force_tables(rotor.forces),
        "station": [{"name": name, "node": node} for name, node in rotor.stations.items()],
        "calibration": _calibration(rotor.calibration) if rotor.calibration else {},
    }
    return {
        shaft: csv_bytes((), [*columns], [*zip(*columns.values(), strict=True)]),
        **tables,
        path: toml_bytes({name: part for name, part in document.items() if part}),
    }


def _calibration(calibration: Calibration) -> dict[str, Any]:
    R = np.where(np.abs(calibration.correlation) < 1e-20, 0.0, calibration.correlation)
    np.fill_diagonal(R, 1.0)
    columns = calibration.names, calibration.values.tolist(), calibration.std.tolist(), R.tolist()
    table = {
        "lack_of_fit": calibration.lack_of_fit,
        "parameter": [
            dict(zip(Parameter.model_fields, row, strict=True)) for row in zip(*columns, strict=True)
        ],
        "data": [{"file": name, "sha256": value} for name, value in calibration.data.items()],
    }
    return {"needs_trial_run": calibration.needs_trial_run, **in_si(CalibrationKeys, table)}
