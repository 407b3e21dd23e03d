"""Small models for motion (.toml): masses, the shaft between them as a matrix, supports and forces."""

from __future__ import annotations

import tomllib
import warnings
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from fem import GRAVITY, KINDS, Motion
from fem.forces import FORCES
from rotorid.base.arrays import FloatArray
from rotorid.base.complex_numbers import polar
from rotorid.base.text import listing
from rotorid.base.versions import SCHEMA_VERSION
from rotorid.files import units
from rotorid.files.problems import Problems, TableWarning
from rotorid.files.settings_keys import Key, Kind, take
from rotorid.files.toml_file import Section, read_toml
from rotorid.files.value_kinds import TURN, each, number, plain_number
from rotorid.reduction import SmallModel
from rotorid.tables.models.model_writing import ode_model_bytes
from rotorid.tables.rotor.bearing import KEYS_OF, NODE, read_support
from rotorid.tables.rotor.node_forces import KEYS_OF_FORCE, force_tables, read_force
from rotorid.tables.rotor.rotor_writing import bearing_table_bytes, support_table

_HELD = 1e-6  # of the largest stiffness: beyond, it is no rounding


def _list(section: Section, key: str) -> FloatArray | None:
    return _array(section, key, 1, "a list of finite numbers, one for each node")


def _matrix(section: Section, key: str) -> FloatArray | None:
    return _array(section, key, 2, "a square matrix of finite numbers, a row for each node")


def _array(section: Section, key: str, depth: int, expected: str) -> FloatArray | None:
    value = section.take(key)
    rows = value if depth == 2 else [value]
    if isinstance(rows, list) and all(isinstance(row, list) and len(row) == len(rows[0]) > 0 for row in rows):
        entries = [None if isinstance(one, str) else plain_number(one) for row in rows for one in row]
        if entries and None not in entries:
            return np.array(value, dtype=float)
    section.complain(key, expected, value=False)
    return None


def _nodes(section: Section, key: str) -> tuple[int, ...] | None:
    found = _list(section, key)
    if found is None:
        return None
    if (found % 1).any() or (found < 1).any() or len(np.unique(found)) < found.size:
        section.complain(key, "different whole numbers from 1 up", value=False)
        return None
    return tuple(int(node) for node in found)


def _apart(section: Section) -> Section:
    return section


def _table(section: Section, key: str) -> dict[str, Any] | None:
    value = section.take(key)
    if isinstance(value, dict):
        return value
    section.complain(key, "a table, [equations]", value=False)
    return None


_ROW = {"type": "array", "items": {"type": "number"}, "minItems": 1}
_LIST, _MATRIX = Kind(_list, _ROW), Kind(_matrix, {"type": "array", "items": _ROW, "minItems": 1})
_WHOLE = {"type": "integer", "minimum": 1}
_NODES = Kind(_nodes, {"type": "array", "items": _WHOLE, "minItems": 1, "uniqueItems": True})
_ANGLE = Key("angle_deg", TURN, "its angle with the rotation", units.ANGLE, required="the angle")
UNBALANCE = (
    Key("node", NODE, "the node"),
    Key("unbalance_g_mm", number(0.0), "mass times radius", units.UNBALANCE, required="the unbalance"),
    _ANGLE,
)
BOW = (
    Key("node", NODE, "the node"),
    Key("bow_um", number(0.0), "off the straight line at rest", units.LENGTH, required="the deflection"),
    _ANGLE,
)
ARRAYS = (
    Key("nodes", _NODES, "numbers of the nodes", required="a list of the nodes' numbers, nodes = [2, 7, 12]"),
    Key("masses_kg", _LIST, "mass at each node; 0 where only a force acts", required="a mass for each node"),
    Key("weight_N", _LIST, "what weighs at each node; default: the masses"),
    Key(
        "shaft_stiffness_N_per_m",
        _MATRIX,
        "of the shaft without supports, one plane, symmetric",
        required="the shaft's stiffness between the nodes, a matrix",
    ),
    Key("material_damping_N_s_per_m", _MATRIX, "of the shaft, which turns with it", default=0.0),
    Key("gyroscopic_kg", _MATRIX, "G of the gyroscopic effect: Ω G y' in x, −Ω G x' in y", default=0.0),
    Key("damping_N_s_per_m", _MATRIX, "of the surroundings", default=0.0),
)
"""In the order of `SmallModel`."""
SMALL_MODEL = (
    *ARRAYS,
    *(Key(kind.name, each(KEYS_OF[kind.name], _apart), kind.about, default=()) for kind in KINDS),
    *(Key(kind.name, each(KEYS_OF_FORCE[kind.name], _apart), kind.about, default=()) for kind in FORCES),
    Key("unbalance", each(UNBALANCE, _apart), "unbalance at a node; several are added", default=()),
    Key("bow", each(BOW, _apart), "bow of the shaft, at three nodes or more", default=()),
    Key(
        "equations",
        Kind(_table, {"type": "object"}),
        "for `fit`, `identify` and `simulate`: `speed_rad_s`, `both_planes`, and keys of an equation file, "
        "such as `inputs` and `[equations.estimate]`, where `d_x7` is a damper at x7",
        default={},
    ),
)
_ATTRIBUTES = {item.name: key.name for item, key in zip(fields(SmallModel), ARRAYS, strict=False)}


def is_small_model(path: Path) -> bool:
    """Whether a file has masses or a stiffness, which no rotor file has."""
    if path.suffix.lower() != ".toml":
        return False
    return not {"masses_kg", "shaft_stiffness_N_per_m"}.isdisjoint(read_toml(path, Problems()) or ())


def linear_equations(model: SmallModel, speed: float, both_planes: bool) -> Motion:
    """At a speed, rad/s; of one plane where nothing couples both and they are not asked for."""
    motion = model.motion(speed)
    y = np.array(["y" in name for name in motion.coordinates])
    across = np.ix_(~y, y)
    plane = "both" if both_planes or motion.C[across].any() or motion.K[across].any() else "x"
    with suppress(ValueError):  # damped supports stay, as states of first order
        return model.motion(speed, plane, condensed=True)
    return model.motion(speed, plane)


def equation_data(path: Path, problems: Problems) -> dict[str, Any] | None:
    """What stands in an equation file; of a small model its linear equations and `[equations]`.

    None with a problem.
    """
    data = read_toml(path, problems)
    if data is None or not is_small_model(path):
        return data
    model, more = read_small_model(path), {**data.get("equations", {})}
    if model.forces:
        problems.add(str(path), None, None, None, "linear forces alone; `rotorid motion` follows the others")
        return None
    speed, both = more.pop("speed_rad_s", 0.0), more.pop("both_planes", False)
    try:
        motion = linear_equations(model, speed, both)
        inputs = more.get("inputs", [])
        dampers = {f"d_{name}": name for name in motion.coordinates}
        estimate = more.get("estimate", {})
        made = ode_model_bytes(
            motion,
            {name: estimate[key] for key, name in dampers.items() if key in estimate},
            inputs=[name for name in inputs if name.removeprefix("f_") in motion.coordinates],
            outputs=[
                f"{axis}{node}"
                for axis in "xy"
                for node in model.massive
                if f"{axis}{node}" in motion.coordinates
            ],
        )
    except (ValueError, TypeError) as error:
        problems.add(str(path), None, "equations", None, str(error))
        return None
    equations = tomllib.loads(made.decode())
    del equations["schema_version"]
    for key, value in more.items():
        added = isinstance(value, dict) and key != "outputs"
        equations[key] = {**equations.get(key, {}), **value} if added else value
    return equations


def read_small_model(path: str | Path) -> SmallModel:
    """Read a small model for motion.

    Parameters
    ----------
    path
        As `small_model_bytes` writes it; tables of bearings are relative to it.

    Raises
    ------
    InputError
        With all problems of the file.
    """
    path, problems = Path(path), Problems()
    top = Section(str(path), problems.need(read_toml(path, problems)), problems)
    said = take(top, SMALL_MODEL)

    def node(section: Section) -> int | None:
        value, nodes = section.take("node"), said["nodes"] or ()
        if type(value) is int and value in nodes:
            return value
        if nodes:
            section.complain("node", f"one of the nodes {listing(map(str, nodes))}")
        return None

    def vectors(key: str, keys: Sequence[Key]) -> dict[int, complex]:
        total: dict[int, complex] = {}
        for section in said[key]:
            _, size, angle = take(section, keys).values()
            where = node(section)
            if where in total and key == "bow":
                section.complain("node", "a node that no other [[bow]] has")
            if where is not None and size is not None and angle is not None:
                total[where] = total.get(where, 0j) + complex(polar(size.si, angle.si))
        return total

    made: dict[str, Any] = {name: said[key] for name, key in _ATTRIBUTES.items()}
    made["supports"] = [
        read_support(section, node, path.parent, kind.name, problems)
        for kind in KINDS
        for section in said[kind.name]
    ]
    made["forces"] = [read_force(section, node, kind.name) for kind in FORCES for section in said[kind.name]]
    made |= {"unbalance": vectors("unbalance", UNBALANCE), "bow": vectors("bow", BOW)}
    problems.stop()
    if made["weight"] is None:
        made["weight"] = GRAVITY * made["masses"]
    try:
        model = SmallModel(**made)
    except ValueError as error:
        name, _, expected = str(error).partition(": ")
        top.complain(_ATTRIBUTES.get(name, name), expected, value=False)
        problems.stop()
        raise
    held = float(model.stiffness.sum())
    if abs(held) > _HELD * np.abs(model.stiffness).max() and (model.supports or model.forces):
        warnings.warn(
            f"{path}, key shaft_stiffness_N_per_m: the shaft itself resists a shift with {held:.4g} N/m; "
            "what holds it stands in tables such as [[bearing]], and the matrix needs all its digits",
            TableWarning,
            stacklevel=2,
        )
    return model


def small_model_bytes(model: SmallModel, comments: Sequence[str] = ()) -> bytes:
    """The file that `read_small_model` reads; numbers keep all their digits.

    Raises
    ------
    ValueError
        For a support whose coefficients depend on speed: they stand in a file of their own.
    """
    path = Path("small.toml")
    files = small_model_files(path, model, comments)
    if len(files) > 1:
        raise ValueError("coefficients of a support depend on speed: they stand in a file of their own")
    return files[path]


def small_model_files(
    path: Path, model: SmallModel, comments: Sequence[str] = (), equations: Mapping[str, Any] | None = None
) -> dict[Path, bytes]:
    """All files of a small model, its own last: tables of supports over speed stand beside it.

    `equations` is the table of that name.
    """
    import tomli_w

    lines = [*(f"# {comment}" for comment in comments), f"schema_version = {SCHEMA_VERSION}"]
    for name, key in _ATTRIBUTES.items():
        array = np.array(getattr(model, name))
        if array.ndim == 1:
            lines.append(f"{key} = {array.tolist()}")
        elif array.any() or name == "stiffness":
            lines += [f"{key} = [", *(f"  {row}," for row in array.tolist()), "]"]
    tables: dict[str, list[dict[str, Any]]] = {}
    files: dict[Path, bytes] = {}
    for count, support in enumerate(model.supports, start=1):
        beside = path.with_name(f"{path.stem}_{support.kind}_{count}.csv") if support.speeds else None
        if beside is not None:
            files[beside] = bearing_table_bytes(support)
        tables.setdefault("bearing", []).append(support_table(support, beside, mixed=True))
    tables |= force_tables(model.forces)
    for name, size in (("unbalance", "unbalance_kg_m"), ("bow", "bow_m")):
        tables[name] = [
            {"node": node, size: abs(value), "angle_rad": float(np.angle(value))}
            for node, value in getattr(model, name).items()
        ]
    for name, sections in tables.items():
        lines += [f"\n[[{name}]]\n{tomli_w.dumps(section).strip()}" for section in sections]
    if equations:
        lines.append(f"\n{tomli_w.dumps({'equations': equations}).strip()}")
    return {**files, path: ("\n".join(lines) + "\n").encode("utf-8")}
