"""Rotor files (.toml): a shaft table with material, model, discs, bearings, seals and stations."""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable
from pathlib import Path

from fem.model.rotor import Disc, Model, Rotor
from fem.model.supports import KINDS
from rotorid.base.suggestions import did_you_mean
from rotorid.tables.reader.problems import Problems
from rotorid.tables.reader.toml_file import Section, read_toml
from rotorid.tables.rotor.bearing import bearing_tables, read_support
from rotorid.tables.rotor.rotor_plausibility import warn_of_value
from rotorid.tables.rotor.rotor_table import Material, build, read_shaft

_TINY = sys.float_info.min
_GEOMETRY = ("width_m", "outer_diameter_m", "inner_diameter_m", "density_kg_per_m3")
_INERTIA = ("mass_kg", "polar_inertia_kg_m2", "diametral_inertia_kg_m2")


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
    assert shaft is not None
    return build(str(path), shaft, {}, problems)


def read_rotor_file(path: Path, problems: Problems) -> Rotor:
    """Read a rotor file; raises `InputError` with the problems of the file and of the tables it names."""
    data = read_toml(path, problems)
    problems.stop()
    top = Section(str(path), data or {}, problems)
    shaft_name = top.text("shaft")
    if "shaft" not in top:
        top.missing("shaft", 'the file of the shaft, shaft = "shaft.csv"')
    material = _material(top.section("material"), str(path))
    model = _model(top.section("model"))
    discs, stations = top.sections("disc"), top.sections("station")
    supports = [(kind.name, section) for kind in KINDS for section in top.sections(kind.name)]
    top.finish()
    shaft = read_shaft(path.parent / shaft_name, material, problems) if shaft_name else None
    n_nodes = len(shaft.length) + 1 if shaft else sys.maxsize
    names = _stations(stations, n_nodes)

    def node(section: Section) -> int | None:
        return _node(section, names, n_nodes)

    more_discs = [_disc(section, node, material) for section in discs]
    more_supports = [read_support(section, node, path.parent, kind, problems) for kind, section in supports]
    problems.stop()
    assert shaft is not None
    whole = dataclasses.replace(
        shaft,
        discs=(*shaft.discs, *(disc for disc in more_discs if disc)),
        supports=(*shaft.supports, *(support for support in more_supports if support)),
        model=model,
    )
    return build(str(path), whole, names, problems)


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


def _material(section: Section | None, source: str) -> Material:
    default = Material()
    if section is None:
        return default
    modulus = section.number("youngs_modulus_Pa", default.youngs_modulus, low=_TINY)
    density = section.number("density_kg_per_m3", default.density, low=0.0)
    poisson = section.number("poisson_ratio", default.poisson_ratio, low=-1.0 + 1e-9, high=0.5)
    damping = section.number("material_damping_s", default.material_damping, low=0.0)
    section.finish()
    for stem, key, value in (
        ("youngs_modulus", "youngs_modulus_Pa", modulus),
        ("density", "density_kg_per_m3", density),
    ):
        if value is not None:
            warn_of_value(source, f"[material] {key}", stem, value)
    return Material(
        *(
            getattr(default, field.name) if value is None else value
            for field, value in zip(
                dataclasses.fields(Material), (modulus, density, poisson, damping), strict=True
            )
        )
    )


def _model(section: Section | None) -> Model:
    if section is None:
        return Model()
    flags = [section.flag(effect) for effect in ("shear", "rotary_inertia", "gyroscopic")]
    section.finish()
    return Model(*flags)


def _stations(sections: list[Section], n_nodes: int) -> dict[str, int]:
    names: dict[str, int] = {}
    for section in sections:
        name, node = section.name("name"), _node(section, {}, n_nodes)
        if not name.strip():
            section.complain("name", "a name for the node", value="name" in section)
        section.finish()
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
    node, name = read_node(section), section.name("name")
    mass, polar, diametral = (section.number(key, low=0.0) for key in _INERTIA)
    width, outer = (section.number(key, low=_TINY) for key in _GEOMETRY[:2])
    inner, density = (section.number(key, low=0.0) for key in _GEOMETRY[2:])
    section.finish()
    by_geometry = [key for key in _GEOMETRY if key in section]
    by_inertia = [key for key in _INERTIA if key in section]
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
        return Disc(node, mass, polar or 0.0, diametral or 0.0, name)
    for key in _GEOMETRY[:2]:
        if key not in section:
            section.missing(key, "the disc's width and outer diameter")
    if node is None or width is None or outer is None:
        return None
    density = material.density if density is None else density
    try:
        return Disc.from_geometry(node, width, outer, inner or 0.0, density, name=name)
    except ValueError as error:
        section.refuse(f"a possible disc: {error}")
        return None
