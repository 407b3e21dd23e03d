"""Rotor files (.toml): a shaft table with material, discs, bearings and stations."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path

from fem.rotor import Disc, Rotor, Support
from rotorid.tables.problems import Problems, did_you_mean
from rotorid.tables.rotor import Material, build, read_shaft
from rotorid.tables.tomlfile import Section, read_toml

_TINY = sys.float_info.min
_BEARING_LATER = (
    *(f"{kind}{a}{b}" for kind in "kc" for a in "xy" for b in "xy"),
    *(f"k{a}{b}_N_per_m" for a in "xy" for b in "xy"),
    *(f"c{a}{b}_N_s_per_m" for a in "xy" for b in "xy"),
    "table",
)


def read_rotor_file(path: Path, problems: Problems) -> Rotor:
    """Read a rotor file; raises `InputError` with the problems of the file and of its shaft table."""
    data = read_toml(path, problems)
    problems.stop()
    top = Section(str(path), data or {}, problems)
    shaft_name = top.text("shaft")
    if "shaft" not in top:
        top.missing("shaft", 'the file of the shaft, shaft = "shaft.csv"')
    material = _material(top.section("material"))
    _model(top.section("model"))
    discs, bearings, stations = top.sections("disc"), top.sections("bearing"), top.sections("station")
    top.later("seal")
    top.finish()
    shaft = read_shaft(path.parent / shaft_name, material, problems) if shaft_name else None
    n_nodes = len(shaft.length) + 1 if shaft else sys.maxsize
    names = _stations(stations, n_nodes)
    more_discs = [_disc(section, names, n_nodes) for section in discs]
    more_supports = [_bearing(section, names, n_nodes) for section in bearings]
    problems.stop()
    assert shaft is not None
    whole = dataclasses.replace(
        shaft,
        discs=(*shaft.discs, *(disc for disc in more_discs if disc)),
        supports=(*shaft.supports, *(support for support in more_supports if support)),
    )
    return build(str(path), whole, names, problems)


def rotor_files(path: str | Path) -> tuple[Path, ...]:
    """The files that `read_rotor` reads, for provenance: a rotor file has a shaft table too."""
    path = Path(path)
    if path.suffix.lower() != ".toml":
        return (path,)
    shaft = (read_toml(path, Problems()) or {}).get("shaft")
    return (path, path.parent / shaft) if isinstance(shaft, str) else (path,)


def _material(section: Section | None) -> Material:
    if section is None:
        return Material()
    default = Material()
    modulus = section.number("youngs_modulus_Pa", low=_TINY)
    density = section.number("density_kg_per_m3", low=_TINY)
    section.number("poisson_ratio", low=-1.0, high=0.5)  # matters to the shear effect only
    section.finish()
    return Material(modulus or default.youngs_modulus, density or default.density)


def _model(section: Section | None) -> None:
    if section is None:
        return
    for effect in ("shear", "rotary_inertia", "gyroscopic"):
        if section.flag(effect):
            section.complain(effect, "false: the effect is not supported by this version of rotorid")
    section.finish()


def _stations(sections: list[Section], n_nodes: int) -> dict[str, int]:
    names: dict[str, int] = {}
    for section in sections:
        name, node = section.text("name"), _node(section, {}, n_nodes)
        if "name" not in section:
            section.missing("name", "a name for the node")
        section.finish()
        if name is not None and name in names:
            section.complain("name", "a name that no other station has")
        elif name is not None and name.isdecimal():
            section.complain("name", "a name, not a number, which would read as a node")
        elif name is not None and node is not None:
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


def _disc(section: Section, names: dict[str, int], n_nodes: int) -> Disc | None:
    node = _node(section, names, n_nodes)
    mass = section.number("mass_kg", low=0.0)
    polar = section.number("polar_inertia_kg_m2", 0.0, low=0.0)
    diametral = section.number("diametral_inertia_kg_m2", 0.0, low=0.0)
    name = section.text("name")
    if "mass_kg" not in section:
        section.missing("mass_kg", "the mass of the disc")
    section.finish()
    if node is None or mass is None:
        return None
    return Disc(node, mass, polar or 0.0, diametral or 0.0, name or "")


def _bearing(section: Section, names: dict[str, int], n_nodes: int) -> Support | None:
    node = _node(section, names, n_nodes)
    stiffness = section.number("stiffness_N_per_m", low=0.0)
    damping = section.number("damping_N_s_per_m", 0.0, low=0.0)
    name = section.text("name")
    section.later(*_BEARING_LATER)
    if "stiffness_N_per_m" not in section and not any(key in section for key in _BEARING_LATER):
        section.missing("stiffness_N_per_m", "the stiffness of the bearing")
    section.finish()
    if node is None or stiffness is None:
        return None
    return Support(node, stiffness, damping or 0.0, name or "")
