"""Small models for motion (.toml): masses, the shaft between them as a matrix, supports and forces."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from fem import GRAVITY, Motion
from rotorid.base.arrays import polar
from rotorid.files import units
from rotorid.files.bearings_and_seals import (
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
from rotorid.files.input_problems import InputError, Problems, refusal
from rotorid.files.settings import (
    NotNegative,
    Number,
    Turn,
    key,
    optional,
    read_settings,
    read_toml,
    toml_bytes,
)
from rotorid.reduction import SmallModel

FORCE = "f_"
"""Before the name of a coordinate: the force on it."""


class UnbalanceKeys(Place):
    """Unbalance at a node."""

    size: NotNegative = key("mass times radius", "unbalance_g_mm", units=units.UNBALANCE)
    angle: Turn = key("its angle with the rotation", "angle_deg", units=units.ANGLE)


class BowKeys(UnbalanceKeys):
    """Bow at a node."""

    size: NotNegative = key("off the straight line at rest", "bow_um", units=units.LENGTH)


class SmallModelFile(Attached):  # type: ignore[misc, valid-type]
    """A small model; arrays in the order of `SmallModel`."""

    nodes: tuple[Annotated[int, Field(ge=1)], ...] = key(
        "numbers of the nodes", expected="different whole numbers from 1 up, nodes = [2, 7, 12]", min_length=1
    )
    masses: list[Number] = key(
        "mass at each node; 0 where only a force acts", "masses_kg", expected="a mass for each node"
    )
    weight: list[Number] | None = optional("what weighs at each node; default: the masses", "weight_N")
    stiffness: list[list[Number]] = key(
        "of the shaft without supports, one plane, symmetric",
        "shaft_stiffness_N_per_m",
        expected="the shaft's stiffness between the nodes, a matrix",
    )
    material_damping: list[list[Number]] = key(
        "of the shaft, which turns with it", "material_damping_N_s_per_m", 0.0
    )
    gyroscopic: list[list[Number]] = key(
        "G of the gyroscopic effect: Ω G y' in x, −Ω G x' in y", "gyroscopic_kg", 0.0
    )
    damping: list[list[Number]] = key("of the surroundings", "damping_N_s_per_m", 0.0)
    unbalance: list[UnbalanceKeys] = key("unbalance at a node; several are added", default=[])
    bow: list[BowKeys] = key("bow of the shaft, at three nodes or more", default=[])
    equations: dict[str, Any] = key(
        "for `fit`, `identify` and `simulate`: `speed_rad_s`, `both_planes`, and keys of an equation file, "
        "such as `inputs` and `[equations.estimate]`, where `d_x7` is a damper at x7",
        default={},
    )

    def wrong(self) -> Iterator[tuple[str, str]]:
        """Matrices with rows of several lengths."""
        for name in ARRAYS:
            rows = getattr(self, name)
            if isinstance(rows, list) and len({*map(np.size, rows)}) > 1:
                yield name, "rows of one length"


ARRAYS = {
    item.name: SmallModelFile.model_fields[item.name].alias or item.name for item in fields(SmallModel)[:7]
}
"""Keys by attribute."""


def is_small(data: Mapping[str, Any]) -> bool:
    """Whether a file has masses or a stiffness, which no other file has."""
    return not {"masses_kg", "shaft_stiffness_N_per_m"}.isdisjoint(data)


def is_small_model(path: Path) -> bool:
    """Whether a file is a small model."""
    with suppress(InputError):
        return path.suffix.lower() == ".toml" and is_small(read_toml(path))
    return False


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
    file = read_settings(SmallModelFile, read_toml(path), str(path))
    at = places(file.nodes, {})

    def vector(item: UnbalanceKeys) -> tuple[int, complex]:
        return at(item), complex(polar(item.size, item.angle))

    parts: dict[str, Any] = read_attached(file, at, path.parent, problems)
    unbalance = each(problems, file.unbalance, "unbalance", vector)
    bow = each(problems, file.bow, "bow", vector)
    if len(dict(bow)) < len(bow):
        file.complain(problems, "bow", "each node once")
    problems.stop()
    parts |= {name: getattr(file, name) for name in ARRAYS}
    parts["weight"] = file.weight or GRAVITY * np.array(file.masses)
    parts["unbalance"] = dict.fromkeys(dict(unbalance), 0j)
    for node, value in unbalance:
        parts["unbalance"][node] += value
    return whole(file, "small model", lambda _: SmallModel(**parts, bow=dict(bow))), {**file.equations}


def linear_equations(model: SmallModel, speed: float, both_planes: bool) -> Motion:
    """At a speed, rad/s; of one plane where nothing couples both and they are not asked for."""
    for plane in ("x", "both")[both_planes:]:
        for condensed in (True, False):  # damped supports stay, as states of first order
            with suppress(ValueError):
                return model.motion(speed, plane, condensed=condensed)
    return model.motion(speed)


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
    M, C, K, names = motion.M, motion.C, motion.K, np.array(motion.coordinates)
    moves = np.any([M, M.T, C, C.T], axis=(0, 1)) | np.isin(names, [*dampers])
    on, off = np.flatnonzero(moves), np.flatnonzero(~moves)
    loose = K[np.ix_(off, off)]
    if loose.size and np.linalg.matrix_rank(loose) < off.size:
        raise ValueError("coordinates with neither mass nor damping need stiffness: they move without force")
    K = K - K[:, off] @ np.linalg.solve(loose, K[off])
    M, C, K = (matrix[np.ix_(on, on)] for matrix in (M, C, K))
    names, damping = names[on].tolist(), C.astype(float).astype(object)
    for i in [names.index(name) for name in dampers]:
        damping[i, i] = f"{damping[i, i]!r} + d_{names[i]}" if damping[i, i] else f"d_{names[i]}"
    estimate = {f"d_{name}": float(value) for name, value in dampers.items()}
    data = {
        "speed_rad_s": float(motion.speed),
        "inputs": [*inputs],
        "coordinates": names,
        "M": M.tolist(),
        "C": damping.tolist(),
        "K": K.tolist(),
        "force": {name.removeprefix(FORCE): name for name in inputs},
        "outputs": {name: name for name in outputs or ()},
        "bounds": {name: [0.0, math.inf] for name in estimate},
    }
    return {name: part for name, part in data.items() if part} | {"estimate": estimate}


def small_equations(path: Path) -> dict[str, Any]:
    """The linear equations of a small model as keys of a model file."""
    model, more = _read(path)
    speed, both = more.pop("speed_rad_s", 0.0), more.pop("both_planes", False)
    try:
        if model.forces:
            raise ValueError("linear forces alone; `rotorid motion` follows the others")
        motion = linear_equations(model, speed, both)
        names, estimate, inputs = motion.coordinates, more.get("estimate", {}), more.get("inputs", [])
        shown = [f"{axis}{node}" for axis in "xy" for node in model.massive]
        equations = equations_of(
            motion,
            {name: estimate[f"d_{name}"] for name in names if f"d_{name}" in estimate},
            [name for name in inputs if name.removeprefix(FORCE) in names],
            [name for name in shown if name in names],
        )
        merged = {name: equations.get(name, {}) | more.get(name, {}) for name in ("force", "bounds")}
    except (ValueError, TypeError) as error:
        raise refusal(path, str(error), column="equations") from None
    return equations | more | merged


def small_model_files(
    path: Path, model: SmallModel, comments: Sequence[str] = (), equations: Mapping[str, Any] | None = None
) -> dict[Path, bytes]:
    """All files of a small model, its own last: tables of supports over speed stand beside it.

    `equations` is the table of that name.
    """
    arrays = {key: np.array(getattr(model, name)) for name, key in ARRAYS.items()}
    supports, files = support_tables(model.supports, path)
    data = {
        **{key: array.tolist() for key, array in arrays.items() if array.any() or "shaft" in key},
        **supports,
        **force_tables(model.forces),
        "unbalance": _vectors(UnbalanceKeys, model.unbalance),
        "bow": _vectors(BowKeys, model.bow),
        "equations": equations,
    }
    return {**files, path: toml_bytes({name: part for name, part in data.items() if part}, comments)}


def _vectors(keys: type[UnbalanceKeys], by_node: Mapping[int, complex]) -> list[dict[str, Any]]:
    return [
        {"node": node} | in_si(keys, {"size": abs(value), "angle": float(np.angle(value))})
        for node, value in by_node.items()
    ]
