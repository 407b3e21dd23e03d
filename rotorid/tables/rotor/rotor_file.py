"""Rotor files (.toml): a shaft table with all that is attached to it, and what a calibration found."""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fem import KINDS, STEEL_DENSITY, STEEL_MODULUS, STEEL_POISSON, Disc, Model, Rotor
from fem.forces import FORCES
from rotorid.base.suggestions import did_you_mean
from rotorid.files import units
from rotorid.files.problems import Problems
from rotorid.files.settings_keys import Key, take
from rotorid.files.toml_file import Section, read_toml
from rotorid.files.value_kinds import ABOVE_ZERO, FLAG, TEXT, each, number, table
from rotorid.tables.rotor.bearing import KEYS_OF, NAME, NODE, bearing_tables, read_support
from rotorid.tables.rotor.calibration_keys import CALIBRATION, read_calibration
from rotorid.tables.rotor.node_forces import KEYS_OF_FORCE, read_force
from rotorid.tables.rotor.rotor_plausibility import warn_of_value
from rotorid.tables.rotor.rotor_table import Material, Shaft, build, read_shaft


def _material(section: Section) -> Material:
    said = take(section, MATERIAL)
    for stem, key in (("youngs_modulus", "youngs_modulus_Pa"), ("density", "density_kg_per_m3")):
        warn_of_value(section.source, f"[material] {key}", stem, said[key])
    return Material(*said.values())


_SIZE = number(0.0)
RATIO = "Poisson's ratio; where it is given, shear is counted unless `[model] shear = false`"
MATERIAL = (
    Key("youngs_modulus_Pa", ABOVE_ZERO, "Young's modulus", units.MODULUS, STEEL_MODULUS, si=True),
    Key("density_kg_per_m3", _SIZE, "density", units.DENSITY, STEEL_DENSITY, si=True),
    Key("poisson_ratio", number(-1.0 + 1e-9, 0.5), RATIO, default=STEEL_POISSON),
    Key("material_damping_s", _SIZE, "loss per stress rate: the stress is E (ε + τ dε/dt)", default=0.0),
)
"""In the order of `Material`."""
MODEL = (
    Key("shear", FLAG, "shear deformation (Timoshenko)", default=False),
    Key("rotary_inertia", FLAG, "inertia of tilting sections and discs", default=False),
    Key("gyroscopic", FLAG, "gyroscopic moments of shaft and discs", default=False),
)
STATION = (
    Key("name", NAME, "the name, which stands wherever a node may", default=""),
    Key("node", NODE, "the node, a number from 1"),
)
DISC = (
    Key("node", NODE, "the node, a number from 1, or a station"),
    Key("name", NAME, "a name", default=""),
    Key("mass_kg", _SIZE, "mass; with moments of inertia or alone", units.MASS, si=True),
    Key("polar_inertia_kg_m2", _SIZE, "about the shaft's line", units.INERTIA, si=True),
    Key("diametral_inertia_kg_m2", _SIZE, "across it", units.INERTIA, si=True),
    Key("width_m", ABOVE_ZERO, "of a disc by geometry, with `outer_diameter_m`", units.LENGTH, si=True),
    Key("outer_diameter_m", ABOVE_ZERO, "of a disc by geometry", units.LENGTH, si=True),
    Key("inner_diameter_m", _SIZE, "bore of a disc by geometry; default: none", units.LENGTH, si=True),
    Key("density_kg_per_m3", _SIZE, "of a disc by geometry; default: the material's", units.DENSITY, si=True),
)
INERTIA, _GEOMETRY = ([key.name for key in part] for part in (DISC[2:5], DISC[5:]))
ROTOR = (
    Key(
        "shaft",
        TEXT,
        "the rotor table, relative to this file; required",
        required='the file of the shaft, shaft = "shaft.csv"',
    ),
    Key("material", table(MATERIAL, _material), "of elements whose row says nothing", default=Material()),
    Key(
        "model",
        table(MODEL),
        "effects that count, true or false; an inertia that is thereby ignored gives a warning",
        default={},
    ),
    Key("disc", each(DISC, lambda section: section), "a disc, as many as there are", default=()),
    Key("station", each(STATION, lambda section: section), "a name for a node", default=()),
    *(
        Key(kind.name, each(KEYS_OF[kind.name], lambda section: section), kind.about, default=())
        for kind in KINDS
    ),
    *(
        Key(kind.name, each(KEYS_OF_FORCE[kind.name], lambda section: section), kind.about, default=())
        for kind in FORCES
    ),
    Key("calibration", table(CALIBRATION), "what a fit to readings found, with its errors"),
)
"""Of a rotor file; sections that name nodes are read when the shaft and the stations are known."""


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
        With all problems of the file.

    Warns
    -----
    TableWarning
        About a guessed encoding, and what no rotor is: sizes, materials, bearings in a wrong unit.
    """
    path = Path(path)
    problems = Problems()
    if path.suffix.lower() == ".toml":
        return read_rotor_file(path, problems)
    shaft = read_shaft(path, Material(), problems)
    problems.stop()
    return build(str(path), problems.need(shaft), {}, problems)


def read_rotor_file(path: Path, problems: Problems) -> Rotor:
    """Read a rotor file; raises `InputError` with the problems of the file and of the tables it names."""
    data = problems.need(read_toml(path, problems))
    if "shaft" not in data and "masses_kg" in data:
        expected = "a rotor file; this is a small model, for `rotorid motion`, `response`, `fit` and such"
        problems.add(str(path), None, "shaft", None, expected)
        problems.stop()
    said = take(Section(str(path), data, problems), ROTOR)
    shaft = read_shaft(path.parent / said["shaft"], said["material"], problems) if said["shaft"] else None
    n_nodes = len(shaft.length) + 1 if shaft else sys.maxsize
    names = _stations(said["station"], n_nodes)

    def node(section: Section) -> int | None:
        return _node(section, names, n_nodes)

    discs = [_disc(section, node, said["material"]) for section in said["disc"]]
    supports = [
        read_support(section, node, path.parent, kind.name, problems)
        for kind in KINDS
        for section in said[kind.name]
    ]
    forces = [read_force(section, node, kind.name) for kind in FORCES for section in said[kind.name]]
    problems.stop()
    shaft = problems.need(shaft)
    whole = dataclasses.replace(
        shaft,
        discs=(*shaft.discs, *filter(None, discs)),
        supports=(*shaft.supports, *filter(None, supports)),
        forces=tuple(filter(None, forces)),
        model=Model(**_model(data, shaft, said["model"])),
    )
    rotor = build(str(path), whole, names, problems)
    if said["calibration"] is None:
        return rotor
    return dataclasses.replace(rotor, calibration=read_calibration(said["calibration"], rotor, problems))


def _model(data: dict[str, Any], shaft: Shaft, model: dict[str, bool]) -> dict[str, bool]:
    """What the elements take into account: shear, too, where Poisson's ratio is given and `shear` is not."""
    ratio = shaft.model.shear or "poisson_ratio" in data.get("material", {})
    return model if "shear" in data.get("model", {}) else model | {"shear": ratio}


def rotor_files(path: str | Path) -> tuple[Path, ...]:
    """The files that `read_rotor` reads, for provenance: a rotor file has tables too.

    Parameters
    ----------
    path
        A rotor table or a rotor file.

    Returns
    -------
    The file itself first, then the tables that it names.
    """
    path = Path(path)
    if path.suffix.lower() != ".toml":
        return (path,)
    data = read_toml(path, Problems()) or {}
    shaft = data.get("shaft")
    tables = [shaft.strip()] if isinstance(shaft, str) else []
    return (path, *(path.parent / table for table in [*tables, *bearing_tables(data)]))


def _stations(sections: list[Section], n_nodes: int) -> dict[str, int]:
    names: dict[str, int] = {}
    for section in sections:
        name = take(section, STATION)["name"]
        node = _node(section, {}, n_nodes)
        if not name.strip():
            section.complain("name", "a name for the node", value="name" in section)
        if name in names:
            section.complain("name", "a name that no other station has")
        elif name.strip().isdecimal():
            section.complain("name", "a name, not a number, which would read as a node")
        elif ":" in name or "," in name:
            section.complain("name", "a name without ':' and ',', which separate names on the command line")
        elif name.strip() and node is not None:
            names[name] = node
    return names


def _node(section: Section, names: dict[str, int], n_nodes: int) -> int | None:
    value = section.take("node")
    last = f" to {n_nodes}" if n_nodes < sys.maxsize else ""
    if value is None:
        section.missing("node", f"a node, a number from 1{last}")
    elif isinstance(value, str) and value in names:
        return names[value]
    elif isinstance(value, str) and names:
        section.complain("node", f"a node from 1{last} or the name of a station{did_you_mean(value, names)}")
    elif isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= n_nodes:
        section.complain("node", f"a node, a whole number from 1{last}")
    else:
        return value
    return None


def _disc(section: Section, read_node: Callable[[Section], int | None], material: Material) -> Disc | None:
    """Mass and inertias, or a geometry; its density is the material's unless it says another."""
    said = take(section, DISC)
    node = read_node(section)
    mass, polar, diametral, width, outer, inner, density = (said[key] for key in (*INERTIA, *_GEOMETRY))
    by_geometry = [key for key in _GEOMETRY if key in section]
    by_inertia = [key for key in INERTIA if key in section]
    if by_geometry and by_inertia:
        section.complain(
            by_inertia[0], f"either mass and moments of inertia or a geometry, which {by_geometry[0]} gives"
        )
        return None
    if not by_geometry:
        if "mass_kg" not in section:
            section.missing("mass_kg", "the mass of the disc (or its geometry: width_m, outer_diameter_m)")
        if node is None or mass is None:
            return None
        return Disc(node, mass, polar or 0.0, diametral or 0.0, said["name"])
    for key in _GEOMETRY[:2]:
        if key not in section:
            section.missing(key, "the disc's width and outer diameter")
    if node is None or width is None or outer is None:
        return None
    density = material.density if density is None else density
    try:
        return Disc.from_geometry(node, width, outer, inner or 0.0, density, name=said["name"])
    except ValueError as error:
        section.refuse(f"a possible disc: {error}")
        return None
