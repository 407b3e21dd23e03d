"""Writing rotors, and files with tables at nodes: what is written is read back before it counts."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fem import STEEL_POISSON, Calibration, Disc, Rotor, Support
from rotorid.base.tables import Value, csv_bytes
from rotorid.base.versions import SCHEMA_VERSION
from rotorid.files.bearing import support_tables
from rotorid.files.forces import force_tables, in_si
from rotorid.files.input_file import each_file_once
from rotorid.files.problems import InputError, Problem
from rotorid.files.rotor import ATTACHED, OF_ELEMENTS, DiscKeys, Effects, Material, read_rotor
from rotorid.files.table_writing import write_files

_OF_ELEMENTS = {column.stem: column.names[0] for column in OF_ELEMENTS}
"""Full names by attribute of a rotor."""


def write_rotor(path: str | Path, rotor: Rotor) -> tuple[Path, ...]:
    """Write a rotor so that `read_rotor` gives an equal one, whole or not at all.

    Parameters
    ----------
    path
        `.toml` for any rotor: the tables `NAME_shaft.csv` and `NAME_bearing_1.csv`, `NAME_seal_2.csv`, …
        (of supports whose coefficients depend on speed) go beside it. `.csv` for one whose shaft table
        can say everything: the default model or shear besides, isotropic constant supports, no names.
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
        If the file cannot be written, or its name ends in neither.
    ValueError
        If the file cannot hold the rotor: a table more than it can say; names that would read as node
        numbers, that are no Unicode text; numbers that are no machine's.
    """
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in (".toml", ".csv"):
        raise InputError([Problem(str(path), None, None, None, "a name that ends in .toml or .csv")])
    files = rotor_file_bytes(path, rotor)
    write_files(files)
    return tuple(reversed(files))


def rotor_file_bytes(path: Path, rotor: Rotor) -> dict[Path, bytes]:
    """All files of a rotor, the rotor file last: it names the others; ValueError as `write_rotor`."""
    alone = path.suffix.lower() == ".csv"
    try:
        files = {path: _shaft_table(rotor, [*_OF_ELEMENTS], attached=True)} if alone else _files(path, rotor)
        beside = path.parent / ".written"
        copies = {beside / file.name: data for file, data in files.items()}
        with each_file_once(copies), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            back = read_rotor(beside / path.name)
    except (InputError, UnicodeEncodeError) as error:
        why = str(error).replace(".written/", "")
        raise ValueError(f"{path}: this rotor cannot be written, it would not come back: {why}") from None
    if back != rotor or (alone and rotor.calibration):
        beyond = (
            "a rotor table holds elements, and at a node one disc and one isotropic bearing, without names, "
            f"stations and effects but shear; write a rotor file, {path.with_suffix('.toml').name}"
        )
        raise ValueError(f"{path}: {beyond if alone else 'this rotor would not come back from its file'}")
    return files


def _files(path: Path, rotor: Rotor) -> dict[Path, bytes]:
    import tomli_w

    shaft = path.with_name(f"{path.stem}_shaft.csv")
    values = {name: getattr(rotor, name) for name in _OF_ELEMENTS}
    uniform = {name: float(array[0]) for name, array in values.items() if np.ptp(array) == 0}
    effects = in_si(Effects, dataclasses.asdict(rotor.model))
    if not rotor.model.shear and (rotor.poisson_ratio != STEEL_POISSON).any():
        effects["shear"] = False  # without a word it would be counted
    supports, tables = support_tables(rotor.supports, path)
    document = {
        "material": in_si(Material, uniform),
        "model": effects,
        "disc": [in_si(DiscKeys, dataclasses.asdict(disc)) for disc in rotor.discs],
        **supports,
        **force_tables(rotor.forces),
        "station": [{"name": name, "node": node} for name, node in rotor.stations.items()],
        "calibration": _calibration(rotor.calibration) if rotor.calibration else {},
    }
    head = {"schema_version": SCHEMA_VERSION, "shaft": shaft.name}
    text = tomli_w.dumps(head | {name: part for name, part in document.items() if part})
    rows = _shaft_table(rotor, [name for name in _OF_ELEMENTS if name not in uniform])
    return {shaft: rows, **tables, path: text.encode("utf-8")}


def _shaft_table(rotor: Rotor, properties: Sequence[str], *, attached: bool = False) -> bytes:
    """The elements, and with `attached` what stands at their left nodes."""
    n, default = rotor.n_elements, Material()
    columns: dict[str, list[Value]] = {
        "element": [str(number) for number in range(1, n + 1)],
        "length_m": rotor.length.tolist(),
        "diameter_m": rotor.outer_diameter.tolist(),
    }
    if rotor.inner_diameter.any():
        columns["inner_diameter_m"] = rotor.inner_diameter.tolist()
    for name in properties:
        shear = attached and rotor.model.shear and name == "poisson_ratio"
        if shear or (getattr(rotor, name) != getattr(default, name)).any():
            columns[_OF_ELEMENTS[name]] = getattr(rotor, name).tolist()
    at_nodes = np.zeros((n + 1, len(ATTACHED)))
    for disc in rotor.discs if attached else ():
        at_nodes[disc.node - 1, :3] = disc.mass, disc.polar_inertia, disc.diametral_inertia
    for support in rotor.supports if attached else ():
        if support.plain and not support.speeds:
            at_nodes[support.node - 1, 3:] = support.stiffness, support.damping
    if at_nodes[n].any():  # the last row is no element
        last = dict.fromkeys(columns, "") | {"element": "end", "length_m": 0.0}
        columns = {name: [*column, last[name]] for name, column in columns.items()}
    for column, values in zip(ATTACHED, at_nodes.T, strict=True):
        if values.any():
            columns[column.names[0]] = values.tolist()[: len(columns["element"])]
    return csv_bytes((), [*columns], [*zip(*columns.values(), strict=True)])


def _calibration(found: Calibration) -> dict[str, Any]:
    R = np.where(np.abs(found.correlation) < 1e-20, 0.0, found.correlation)
    np.fill_diagonal(R, 1.0)
    columns = found.names, found.values.tolist(), found.std.tolist(), R.tolist()
    keys = "name", "value", "std", "correlation"
    table: dict[str, Any] = {"needs_trial_run": found.needs_trial_run}
    if found.lack_of_fit:
        table["lack_of_fit"] = found.lack_of_fit
    table["parameter"] = [dict(zip(keys, row, strict=True)) for row in zip(*columns, strict=True)]
    table["data"] = [{"file": name, "sha256": value} for name, value in found.data.items()]
    return {name: part for name, part in table.items() if part != []}
