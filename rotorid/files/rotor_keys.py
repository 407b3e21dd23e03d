"""Keys of rotor files: what is attached to a shaft, and what a calibration found."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from fem import STEEL_DENSITY, STEEL_MODULUS, STEEL_POISSON, Calibration, Disc, Model, Rotor
from fem.parameters import expand
from rotorid.base.text import counted
from rotorid.files import units
from rotorid.files.bearings_and_seals import Attached, Place, each, places, read_attached, whole
from rotorid.files.input_problems import InputError, Problems, refusal
from rotorid.files.settings import (
    NotNegative,
    Number,
    Positive,
    Settings,
    Text,
    key,
    listed,
    optional,
    read_settings,
    read_toml,
)


class Material(Settings):
    """What a shaft is made of where its table does not say."""

    youngs_modulus: Positive = key("Young's modulus", "youngs_modulus_Pa", STEEL_MODULUS, units=units.MODULUS)
    density: NotNegative = key("density", "density_kg_per_m3", STEEL_DENSITY, units=units.DENSITY)
    poisson_ratio: Annotated[Number, Field(gt=-1, le=0.5)] = key(
        "Poisson's ratio; where it is given, shear is counted unless `[model] shear = false`",
        default=STEEL_POISSON,
    )
    material_damping: NotNegative = key(
        "loss per stress rate: the stress is E (ε + τ dε/dt)", "material_damping_s", 0.0, units=units.TIME
    )


class Effects(Settings):
    """What the elements take into account."""

    shear: bool = key("shear deformation (Timoshenko)", default=False)
    rotary_inertia: bool = key("inertia of tilting sections and discs", default=False)
    gyroscopic: bool = key("gyroscopic moments of shaft and discs", default=False)


class Station(Place):
    """A name for a node."""

    name: Text = key("the name, which stands wherever a node may", expected="a name for the node")

    def wrong(self) -> Iterator[tuple[str, str]]:
        """A name that means something else."""
        if self.name.isdecimal() or {":", ","} & {*self.name}:
            yield (
                "name",
                "a name, not a number, without ':' and ',', which separate names on the command line",
            )


class DiscKeys(Place):
    """A disc by its mass, or by its geometry."""

    mass: NotNegative | None = optional("mass; with moments of inertia or alone", "mass_kg", units=units.MASS)
    polar_inertia: NotNegative | None = optional(
        "about the shaft's line", "polar_inertia_kg_m2", units=units.INERTIA
    )
    diametral_inertia: NotNegative | None = optional(
        "across it", "diametral_inertia_kg_m2", units=units.INERTIA
    )
    width: Positive | None = optional(
        "of a disc by geometry, with `outer_diameter_m`", "width_m", units=units.LENGTH
    )
    outer_diameter: Positive | None = optional(
        "of a disc by geometry", "outer_diameter_m", units=units.LENGTH
    )
    inner_diameter: NotNegative | None = optional(
        "bore of a disc by geometry; default: none", "inner_diameter_m", units=units.LENGTH
    )
    density: NotNegative | None = optional(
        "of a disc by geometry; default: the material's", "density_kg_per_m3", units=units.DENSITY
    )

    def wrong(self) -> Iterator[tuple[str, str]]:
        """Neither of both, or some of both."""
        both = {"width", "outer_diameter"}
        sizes = self.model_fields_set & {*both, "inner_diameter", "density"}
        if bool(sizes) == self.has("mass"):
            yield "mass", "either the mass of the disc or its geometry: width_m, outer_diameter_m"
        elif sizes and (self.has("polar_inertia") or self.has("diametral_inertia") or not both <= sizes):
            yield "width", "the disc's width and outer diameter, and no moments of inertia beside them"

    def made(self, node: int, density: float) -> Disc:
        """The disc at a node, of the material's density."""
        values = self.model_dump(exclude_none=True) | {"node": node}
        return Disc(**values) if self.has("mass") else Disc.from_geometry(**{"density": density} | values)


class Parameter(Settings):
    """A number of a rotor that was fitted."""

    name: Text = key("which of the rotor's numbers, such as `bearing[1].kxx.scale`", expected="its name")
    value: Number = key("what was found, in SI; a scale of the file calibrated", expected="its value")
    std: NotNegative = key(
        "standard deviation; of a scale relative to this file", expected="its std, 0 or more"
    )
    correlation: listed(Number) = key(  # type: ignore[valid-type]
        "with all parameters in their order; default: with none", default=()
    )


class DataFile(Settings):
    """A file of readings."""

    file: Text = key("name of a file that it was made from", expected="its name")
    sha256: Text = key("hash of its content", expected="its hash")


class CalibrationKeys(Settings):
    """What a fit to readings found."""

    needs_trial_run: bool = key("whether the data contradict the model", default=False)
    lack_of_fit: NotNegative = key(
        "what the model leaves of a coefficient, one relative standard deviation", default=0.0
    )
    parameter: list[Parameter] = key("what was fitted", default=[])
    data: list[DataFile] = key("a file that it was made from, which must not count twice", default=[])


class RotorFile(Attached):  # type: ignore[misc, valid-type]
    """A rotor file."""

    shaft: Text = key(
        "the rotor table, relative to this file; required",
        expected='the file of the shaft, shaft = "shaft.csv"',
    )
    material: Material = key("of elements whose row says nothing", default=Material.model_construct())
    model: Effects = key(
        "effects that count, true or false; an inertia that is thereby ignored gives a warning",
        default=Effects.model_construct(),
    )
    disc: list[DiscKeys] = key("a disc, as many as there are", default=[])
    station: list[Station] = key("a name for a node", default=[])
    calibration: CalibrationKeys | None = optional("what a fit to readings found, with its errors")


def read_keys(path: Path) -> RotorFile:
    """The keys of a rotor file."""
    from rotorid.files.small_model import is_small

    data = read_toml(path)
    if is_small(data):
        expected = "a rotor file; this is a small model, for `rotorid motion`, `response`, `fit` and such"
        raise refusal(path, expected, column="shaft")
    return read_settings(RotorFile, data, str(path))


def completed(parts: dict[str, Any], has_ratio: bool, file: RotorFile, folder: Path) -> Rotor:
    """The rotor of a shaft and of what else its file says, with tables named from its folder."""
    problems, stations = Problems(), dict[str, int]()
    at = places(range(1, len(parts["length"]) + 2), stations)

    def name(item: Station) -> None:
        if item.name in stations:
            raise InputError([item.problem("name", "a name that no other station has")])
        stations[item.name] = at(item)

    each(problems, file.station, "station", name)
    parts["discs"] += each(
        problems, file.disc, "disc", lambda item: item.made(at(item), file.material.density)
    )
    attached = read_attached(file, at, folder, problems)
    problems.stop()
    parts |= {"forces": attached["forces"], "stations": stations}
    parts["supports"] += attached["supports"]
    # nothing but shear depends on the ratio
    effects = {"shear": has_ratio or file.material.has("poisson_ratio")}
    effects |= file.model.model_dump(exclude_unset=True)
    rotor = whole(file, "rotor", lambda _: Rotor(**parts, model=Model(**effects)))
    if file.calibration:
        return replace(
            rotor, calibration=whole(file.calibration, "calibration", lambda keys: _calibration(keys, rotor))
        )
    return rotor


def _calibration(file: CalibrationKeys, rotor: Rotor) -> Calibration:
    """ValueError for what is none of this rotor."""
    parameters, n = file.parameter, len(file.parameter)
    for one in parameters:
        if expand(rotor, one.name) != (one.name,):
            raise ValueError(f"{one.name} is not a single parameter: name one, without [*]")
        if len(one.correlation) not in (0, n):
            raise ValueError(f"{one.name}: correlation needs {counted(n, 'number')}, one for each parameter")
    std = np.array([one.std for one in parameters])
    R = [one.correlation or row for one, row in zip(parameters, np.eye(n), strict=True)]
    return Calibration(
        tuple(one.name for one in parameters),
        np.array([one.value for one in parameters]),
        np.reshape(R, (n, n)) * np.outer(std, std),
        file.lack_of_fit,
        file.needs_trial_run,
        {one.file: one.sha256 for one in file.data},
    )


def calibration_tables(calibration: Calibration) -> dict[str, Any]:
    """As tables of a rotor file."""
    arrays = calibration.values, calibration.std, calibration.correlation
    return {
        "needs_trial_run": calibration.needs_trial_run,
        "lack_of_fit": calibration.lack_of_fit,
        "parameter": [
            dict(zip(Parameter.model_fields, row, strict=True))
            for row in zip(calibration.names, *(array.tolist() for array in arrays), strict=True)
        ],
        "data": [{"file": name, "sha256": value} for name, value in calibration.data.items()],
    }
