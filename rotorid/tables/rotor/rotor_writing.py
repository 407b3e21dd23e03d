"""Writing rotors: a rotor table alone where it can say everything, else a rotor file with its tables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fem import KINDS, STEEL_POISSON, Coefficient, Disc, Model, Rotor, Support
from rotorid.base.registry import names
from rotorid.base.tables import Value, csv_bytes
from rotorid.base.text import listing
from rotorid.base.versions import SCHEMA_VERSION
from rotorid.files.decimal_numbers import LARGEST, SMALLEST
from rotorid.files.problems import InputError, Problem
from rotorid.files.table_writing import write_files
from rotorid.tables.rotor.bearing import ENTRIES, PEDESTAL, SCALARS, TILTING
from rotorid.tables.rotor.calibration_keys import calibration_table
from rotorid.tables.rotor.node_forces import force_tables
from rotorid.tables.rotor.rotor_file import INERTIA, MODEL
from rotorid.tables.rotor.rotor_table import ATTACHED, OF_ELEMENTS, Material

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
        If a `.csv` file cannot hold the rotor (it says what needs a `.toml` file), or the name of a station
        would read as a node number, a name is no Unicode text, or a number is no machine's.
    """
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in (".toml", ".csv"):
        raise InputError([Problem(str(path), None, None, None, "a name that ends in .toml or .csv")])
    if kind == ".csv":
        beyond = _beyond_a_table(rotor)
        if beyond:
            raise ValueError(
                f"{path}: a rotor table cannot hold {listing(beyond, 'and')}; "
                f"write a rotor file, {path.with_suffix('.toml').name}"
            )
        columns = [name for name in _OF_ELEMENTS if name != "poisson_ratio" or rotor.model.shear]
        files = {path: _shaft_table(rotor, columns, attached=True)}
    else:
        files = rotor_file_bytes(path, rotor)
    write_files(files)
    return tuple(reversed(files))


def _beyond_a_table(rotor: Rotor) -> list[str]:
    """What a rotor has that only a rotor file can say."""
    discs, supports = rotor.discs, rotor.supports
    reasons = {
        "the names of stations": bool(rotor.stations),
        "the effects of its model": rotor.model not in (Model(), Model(shear=True)),
        "a Poisson's ratio without shear": not rotor.model.shear
        and (rotor.poisson_ratio != STEEL_POISSON).any(),
        "names of discs or supports": any([d.name for d in discs] + [s.name for s in supports]),
        "several discs or supports at a node, or in another order than the nodes'": not all(
            np.all(np.diff([item.node for item in items]) > 0) for items in (discs, supports)
        ),
        "discs and supports without mass, stiffness and damping": any(
            not (disc.mass or disc.polar_inertia or disc.diametral_inertia) for disc in discs
        )
        or any(support == Support(support.node) for support in supports),
        "supports that are not isotropic, depend on speed, stand on a pedestal or hold the slope": not all(
            support.plain and not support.tilting_stiffness for support in supports
        ),
        "seals": any(support.kind != "bearing" for support in supports),
        "forces that are not linear": bool(rotor.forces),
        "a calibration": rotor.calibration is not None,
    }
    return [reason for reason, there in reasons.items() if there]


def rotor_file_bytes(path: Path, rotor: Rotor) -> dict[Path, bytes]:
    """All files of a rotor, the rotor file last: it names the others."""
    import tomli_w

    default = Material()
    shaft = path.with_name(f"{path.stem}_shaft.csv")
    document: dict[str, Any] = {"schema_version": SCHEMA_VERSION, "shaft": shaft.name}
    uniform = [name for name in _OF_ELEMENTS if np.ptp(getattr(rotor, name)) == 0]
    values = {name: float(getattr(rotor, name)[0]) for name in uniform}
    material = {_OF_ELEMENTS[name]: v for name, v in values.items() if v != getattr(default, name)}
    if material:
        document["material"] = material
    model = {key.name: True for key in MODEL if getattr(rotor.model, key.name)}
    if not rotor.model.shear and (rotor.poisson_ratio != STEEL_POISSON).any():
        model["shear"] = False  # without a word it would be counted
    if model:
        document["model"] = model
    files = {shaft: _shaft_table(rotor, [name for name in _OF_ELEMENTS if name not in uniform])}
    if rotor.discs:
        document["disc"] = [_disc(disc) for disc in rotor.discs]
    kinds = [support.kind for support in rotor.supports]
    # They are read kind by kind: where they are mixed, [[bearing]] with `kind` keeps their order.
    mixed = kinds != sorted(kinds, key=names(KINDS).index)
    mixed = mixed or any(s.kind != KINDS[0].name and s.pedestal for s in rotor.supports)
    for number, support in enumerate(rotor.supports, start=1):
        table = path.with_name(f"{path.stem}_{support.kind}_{number}.csv") if support.speeds else None
        if table is not None:
            files[table] = bearing_table_bytes(support)
        section = "bearing" if mixed else support.kind
        document.setdefault(section, []).append(support_table(support, table, mixed=mixed))
    for name in rotor.stations:
        if not name.strip() or name.strip().isdecimal():
            raise ValueError(
                f"{path}: the station {name!r} would read as a node number or as none; rename it"
            )
    forces = force_tables(rotor.forces)
    document |= forces
    if rotor.stations:
        document["station"] = [{"name": name, "node": node} for name, node in rotor.stations.items()]
    found = calibration_table(rotor.calibration) if rotor.calibration else {}
    document |= {"calibration": found} if found else {}
    for section in (
        material,
        *document.get("disc", ()),
        *(section for kind in (*names(KINDS), *forces) for section in document.get(kind, ())),
        *found.get("parameter", ()),
    ):
        _check_sizes(section)
    try:
        files[path] = tomli_w.dumps(document).encode("utf-8")
    except UnicodeEncodeError as error:
        raise ValueError(f"{path}: {error.object!r} holds a name that is no Unicode text") from None
    return files


def _shaft_table(rotor: Rotor, properties: Iterable[str], *, attached: bool = False) -> bytes:
    """The elements, and with `attached` what stands at their left nodes, which must fit."""
    default = Material()
    n = rotor.n_elements
    columns: dict[str, Sequence[Value]] = {
        "element": [str(number) for number in range(1, n + 1)],
        "length_m": rotor.length.tolist(),
        "diameter_m": rotor.outer_diameter.tolist(),
    }
    if rotor.inner_diameter.any():
        columns["inner_diameter_m"] = rotor.inner_diameter.tolist()
    for name in properties:
        values = getattr(rotor, name)
        if (values != getattr(default, name)).any():
            columns[_OF_ELEMENTS[name]] = values.tolist()
    rows = [list(row) for row in zip(*columns.values(), strict=True)]
    if not attached:
        return _table(list(columns), rows)
    at_nodes = np.zeros((n + 1, len(ATTACHED)))
    for disc in rotor.discs:
        at_nodes[disc.node - 1, :3] = disc.mass, disc.polar_inertia, disc.diametral_inertia
    for support in rotor.supports:
        at_nodes[support.node - 1, 3:] = support.stiffness, support.damping
    used = np.flatnonzero(at_nodes.any(axis=0))
    if at_nodes[n].any():
        # The last row is no element: its length is 0, and so is whatever else must be a number.
        rows.append(["end", 0.0, *[""] * (len(columns) - 2)])
    names = [*columns, *(ATTACHED[place].names[0] for place in used)]
    return _table(names, [[*row, *extra[used].tolist()] for row, extra in zip(rows, at_nodes)])  # noqa: B905


def _table(names: Sequence[str], rows: Sequence[Sequence[Value]]) -> bytes:
    """A table that its reader takes: it refuses numbers that no machine has."""
    for row in rows:
        _check_sizes(dict(zip(names, row, strict=True)))
    return csv_bytes((), names, rows)


def _check_sizes(values: Mapping[str, Any]) -> None:
    """Refuse numbers that readers of files take for mistakes."""
    for name, value in values.items():
        for number in value if isinstance(value, list) else [value]:
            if isinstance(number, float) and number and not SMALLEST <= abs(number) <= LARGEST:
                raise ValueError(
                    f"{name} = {number!r} cannot be written to a file, which holds 0 and sizes from "
                    f"{SMALLEST:g} to {LARGEST:g}"
                )


def _disc(disc: Disc) -> dict[str, Any]:
    section: dict[str, Any] = {"name": disc.name} if disc.name else {}
    section["node"] = disc.node
    mass, *inertias = zip(INERTIA, (disc.mass, disc.polar_inertia, disc.diametral_inertia), strict=True)
    return section | dict([mass, *((key, value) for key, value in inertias if value)])


def support_table(support: Support, table: Path | None, *, mixed: bool) -> dict[str, Any]:
    """A support as a table of a rotor file; `mixed` says its kind, too; its table over speed is a file."""
    section: dict[str, Any] = {"name": support.name} if support.name else {}
    section["node"] = support.node
    if mixed and support.kind != "bearing":
        section["kind"] = support.kind
    if table is not None:
        section["table"] = table.name
    else:
        for quantity in SCALARS:
            section |= _entries(quantity, getattr(support, quantity))
    if support.tilting_stiffness:
        section[TILTING] = support.tilting_stiffness
    if support.pedestal is not None:
        stand = (support.pedestal.mass, support.pedestal.stiffness, support.pedestal.damping)
        for key, value in zip(PEDESTAL, stand, strict=True):
            section[key] = list(value) if isinstance(value, tuple) else value
    return section


def bearing_table_bytes(support: Support) -> bytes:
    """The table of a support whose coefficients depend on speed."""
    # An isotropic entry among others is a matrix too.
    full = {q for q in SCALARS if any(isinstance(value, tuple) for value in getattr(support, q))}
    rows = []
    for k, speed in enumerate(support.speeds):
        row = {"speed_rad_s": speed}
        for quantity in SCALARS:
            row |= _entries(quantity, getattr(support, quantity)[k], full=quantity in full)
        rows.append(row)
    return _table(list(rows[0]), [list(row.values()) for row in rows])


def _entries(quantity: str, value: Coefficient, *, full: bool = False) -> dict[str, float]:
    if isinstance(value, tuple):
        return dict(zip(ENTRIES[quantity].values(), (*value[0], *value[1]), strict=True))
    if full:
        return _entries(quantity, ((value, 0.0), (0.0, value)))
    return {SCALARS[quantity]: value}
