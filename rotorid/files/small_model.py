"""Small models for motion (.toml): masses, the shaft between them as a matrix, supports and forces."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, PlainValidator

from fem import GRAVITY, Motion
from rotorid.base.arrays import FloatArray, polar
from rotorid.files import units
from rotorid.files.bearing import Attached, read_attached, support_tables
from rotorid.files.forces import Place, Places, each, force_tables, whole
from rotorid.files.problems import InputError, Problem, Problems, TableWarning
from rotorid.files.settings import NotNegative, Turn, key, read_settings
from rotorid.files.toml_file import read_toml
from rotorid.files.toml_writing import toml_bytes
from rotorid.reduction import SmallModel

FORCE = "f_"
"""Before the name of a coordinate: the force on it."""
_HELD = 1e-6  # of the largest stiffness: beyond, it is no rounding


def _numbers(value: object) -> FloatArray:
    with suppress(TypeError, ValueError, OverflowError):
        array = np.array(value, dtype=float)
        if array.size and np.isfinite(array).all() and array.ndim:
            return array
    raise ValueError("a list of finite numbers, one for each node, or a square matrix of them")


List = Annotated[Any, PlainValidator(_numbers, json_schema_input_type=list[float])]
Matrix = Annotated[Any, PlainValidator(_numbers, json_schema_input_type=list[list[float]])]


class UnbalanceKeys(Place):
    """Unbalance at a node."""

    unbalance: NotNegative = key("mass times radius", "unbalance_g_mm", units=units.UNBALANCE)
    angle: Turn = key("its angle with the rotation", "angle_deg", units=units.ANGLE)


class BowKeys(Place):
    """Bow at a node."""

    bow: NotNegative = key("off the straight line at rest", "bow_um", units=units.LENGTH)
    angle: Turn = key("its angle with the rotation", "angle_deg", units=units.ANGLE)


class SmallModelFile(Attached):  # type: ignore[misc, valid-type]
    """A small model; arrays in the order of `SmallModel`."""

    nodes: tuple[Annotated[int, Field(ge=1)], ...] = key(
        "numbers of the nodes", expected="different whole numbers from 1 up, nodes = [2, 7, 12]", min_length=1
    )
    masses: List = key(
        "mass at each node; 0 where only a force acts", "masses_kg", expected="a mass for each node"
    )
    weight: List | None = key("what weighs at each node; default: the masses", "weight_N", None)
    stiffness: Matrix = key(
        "of the shaft without supports, one plane, symmetric",
        "shaft_stiffness_N_per_m",
        expected="the shaft's stiffness between the nodes, a matrix",
    )
    material_damping: Matrix = key("of the shaft, which turns with it", "material_damping_N_s_per_m", 0.0)
    gyroscopic: Matrix = key("G of the gyroscopic effect: Ω G y' in x, −Ω G x' in y", "gyroscopic_kg", 0.0)
    damping: Matrix = key("of the surroundings", "damping_N_s_per_m", 0.0)
    unbalance: list[UnbalanceKeys] = key("unbalance at a node; several are added", default=[])
    bow: list[BowKeys] = key("bow of the shaft, at three nodes or more", default=[])
    equations: dict[str, Any] = key(
        "for `fit`, `identify` and `simulate`: `speed_rad_s`, `both_planes`, and keys of an equation file, "
        "such as `inputs` and `[equations.estimate]`, where `d_x7` is a damper at x7",
        default={},
    )


ARRAYS = {
    item.name: SmallModelFile.model_fields[item.name].alias or item.name for item in fields(SmallModel)[:7]
}
"""Keys by attribute."""


def is_small_model(path: Path) -> bool:
    """Whether a file has masses or a stiffness, which no rotor file has."""
    if path.suffix.lower() != ".toml":
        return False
    return not {"masses_kg", "shaft_stiffness_N_per_m"}.isdisjoint(read_toml(path, Problems()) or ())


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
    return _read(Path(path))[0]


def _read(path: Path) -> tuple[SmallModel, dict[str, Any]]:
    """A small model and its `[equations]`."""
    problems = Problems()
    data = problems.need(read_toml(path, problems))
    file = problems.need(read_settings(SmallModelFile, data, str(path), problems))
    problems.stop()
    at, unbalance, bow = Places(file.nodes, {}), dict[int, complex](), dict[int, complex]()

    def mount(item: UnbalanceKeys) -> None:
        node = at(item)
        unbalance[node] = unbalance.get(node, 0j) + complex(polar(item.unbalance, item.angle))

    def bend(item: BowKeys) -> None:
        if at(item) in bow:
            raise ValueError("it stands at a node that has one already")
        bow[at(item)] = complex(polar(item.bow, item.angle))

    supports, forces = read_attached(file, at, path.parent, problems)
    each(problems, file.unbalance, "unbalance", mount)
    each(problems, file.bow, "bow", bend)
    problems.stop()
    arrays: dict[str, Any] = {name: getattr(file, name) for name in ARRAYS}
    if arrays["weight"] is None:
        arrays["weight"] = GRAVITY * arrays["masses"]
    more: dict[str, Any] = {"supports": supports, "forces": forces, "unbalance": unbalance, "bow": bow}
    model = whole(file, "small model", lambda _: SmallModel(**arrays, **more))
    held = float(model.stiffness.sum())
    if abs(held) > _HELD * np.abs(model.stiffness).max() and (supports or forces):
        warnings.warn(
            f"{path}, key shaft_stiffness_N_per_m: the shaft itself resists a shift with {held:.4g} N/m; "
            "what holds it stands in tables such as [[bearing]], and the matrix needs all its digits",
            TableWarning,
            stacklevel=3,
        )
    return model, {**file.equations}


def linear_equations(model: SmallModel, speed: float, both_planes: bool) -> Motion:
    """At a speed, rad/s; of one plane where nothing couples both and they are not asked for."""
    motion = model.motion(speed)
    y = np.array(["y" in name for name in motion.coordinates])
    across = np.ix_(~y, y)
    plane = "both" if both_planes or motion.C[across].any() or motion.K[across].any() else "x"
    with suppress(ValueError):  # damped supports stay, as states of first order
        return model.motion(speed, plane, condensed=True)
    return model.motion(speed, plane)


def equations_of(
    motion: Motion,
    dampers: Mapping[str, float],
    inputs: Sequence[str] = (),
    outputs: Sequence[str] | None = None,
) -> dict[str, Any]:
    """M y'' + C y' + K y = f as a model file has it, with dampers to the ground that are to be estimated.

    Coordinates with neither mass nor damping, behind the others, are eliminated: K = K₁₁ − K₁₂ K₂₂⁻¹ K₂₁.

    Parameters
    ----------
    motion
        Matrices and names of the displacements, of one plane or both.
    dampers
        {displacement: starting value of its damper, N·s/m}; the parameter of `x7` is called `d_x7`. Empty:
        nothing is estimated.
    inputs
        Forces that are measured: `f_x7` on the displacement `x7`. Records then need a column of each. Without
        inputs `read_harmonic_model` takes a force on every coordinate.
    outputs
        What is measured: displacements `x7` or velocities `v_x7`. Default: all displacements.

    Raises
    ------
    ValueError
        Coordinates that nothing holds, dampers at none.
    """
    M, C, K = motion.M, motion.C, motion.K
    free = ~np.any([M, M.T, C, C.T], axis=(0, 1)) & [name not in dampers for name in motion.coordinates]
    on, off = np.flatnonzero(~free), np.flatnonzero(free)
    if np.linalg.matrix_rank(K[np.ix_(off, off)]) < off.size:
        raise ValueError("coordinates with neither mass nor damping need stiffness: they move without force")
    bent = np.linalg.solve(K[np.ix_(off, off)], K[np.ix_(off, on)])
    M, C, K = (matrix[np.ix_(on, on)] for matrix in (M, C, K - K[:, off] @ bent @ np.eye(len(K))[on]))
    names, damping = [motion.coordinates[i] for i in on], C.astype(float).astype(object)
    for i in [names.index(name) for name in dampers]:
        damping[i, i] = f"{damping[i, i]!r} + d_{names[i]}" if damping[i, i] else f"d_{names[i]}"
    data: dict[str, Any] = {
        "speed_rad_s": float(motion.speed),
        "inputs": [*inputs],
        "coordinates": names,
        "M": M.tolist(),
        "C": damping.tolist(),
        "K": K.tolist(),
        "force": {name.removeprefix(FORCE): name for name in inputs},
        "outputs": {name: name for name in outputs or ()},
        "bounds": {f"d_{name}": [0.0, math.inf] for name in dampers},
    }
    estimate = {f"d_{name}": float(value) for name, value in dampers.items()}
    return {name: part for name, part in data.items() if part} | {"estimate": estimate}


def small_equations(path: Path) -> dict[str, Any]:
    """The linear equations of a small model as keys of a model file."""
    model, more = _read(path)
    speed, both = more.pop("speed_rad_s", 0.0), more.pop("both_planes", False)
    try:
        if model.forces:
            raise ValueError("linear forces alone; `rotorid motion` follows the others")
        motion = linear_equations(model, speed, both)
        estimate, inputs = more.get("estimate", {}), more.get("inputs", [])
        shown = [f"{axis}{node}" for axis in "xy" for node in model.massive]
        equations = equations_of(
            motion,
            {name: estimate[f"d_{name}"] for name in motion.coordinates if f"d_{name}" in estimate},
            [name for name in inputs if name.removeprefix("f_") in motion.coordinates],
            [name for name in shown if name in motion.coordinates],
        )
    except (ValueError, TypeError) as error:
        raise InputError([Problem(str(path), None, "equations", None, str(error))]) from None
    for name, value in more.items():
        added = isinstance(value, dict) and name != "outputs"
        equations[name] = {**equations.get(name, {}), **value} if added else value
    return equations


def small_model_files(
    path: Path, model: SmallModel, comments: Sequence[str] = (), equations: Mapping[str, Any] | None = None
) -> dict[Path, bytes]:
    """All files of a small model, its own last: tables of supports over speed stand beside it.

    `equations` is the table of that name.
    """
    arrays = {key: np.array(getattr(model, name)) for name, key in ARRAYS.items()}
    tables, files = support_tables(model.supports, path, ordered=True)
    data: dict[str, Any] = {
        **{key: array.tolist() for key, array in arrays.items() if array.any() or "shaft" in key},
        **tables,
        **force_tables(model.forces),
        **{
            name: [
                {"node": node, size: abs(value), "angle_rad": float(np.angle(value))}
                for node, value in getattr(model, name).items()
            ]
            for name, size in (("unbalance", "unbalance_kg_m"), ("bow", "bow_m"))
        },
        "equations": equations,
    }
    written = toml_bytes({name: part for name, part in data.items() if part}, comments)
    return {**files, path: written}
