"""The rotor model that a job names, and where its planes and sensors are in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from balancing import Labels
from fem import Sensor
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.files.problems import InputError, Problems
from rotorid.files.settings_keys import Said

if TYPE_CHECKING:
    from fem import Rotor


@dataclass(frozen=True)
class Model:
    """A rotor model with the places of planes and sensors in it; files that were read."""

    rotor: Rotor | None = None
    plane_nodes: Mapping[str, int] = field(default_factory=dict)
    sensor_places: Mapping[str, Sensor] = field(default_factory=dict)
    files: tuple[Path, ...] = ()


def read_model(said: Said, folder: Path, labels: Labels, problems: Problems) -> Model:
    """Read the rotor of a job and find the nodes of its planes and sensors.

    Parameters
    ----------
    said
        All keys of the job; without a rotor no plane or sensor may have a node.
    folder
        From which the rotor table or file is named.
    labels
        How the job counts angles: `angle_deg` of a sensor, too.
    problems
        Collects the complaints, those about the rotor's files too.
    """
    planes, sensors = said["planes"], said["sensors"]
    if said["rotor"] is None:
        for item in [*planes.values(), *sensors.values()]:
            if item["node"] is not None and "rotor" not in said.section:
                key = "station" if isinstance(item["node"], str) else "node"
                item.section.complain(key, f'the rotor model of this {key} too, rotor = "rotor.toml"')
        return Model()
    from rotorid.files.rotor import read_rotor, rotor_files

    path = folder / said["rotor"]
    try:
        rotor = read_rotor(path)
    except InputError as error:
        problems.extend(error.problems)
        return Model()
    plane_nodes = {name: node for name, plane in planes.items() if (node := _node(plane, rotor)) is not None}
    places = {
        name: Sensor(node, labels.with_rotation(sensor["angle_deg"] or 0.0))
        for name, sensor in sensors.items()
        if (node := _node(sensor, rotor)) is not None
    }
    return Model(rotor, plane_nodes, places, rotor_files(path))


def _node(said: Said, rotor: Rotor) -> int | None:
    place: int | str | None = said["node"]
    if isinstance(place, str):
        if place in rotor.stations:
            return rotor.stations[place]
        known = listing(map(repr, rotor.stations), "and") or "none"
        hint = did_you_mean(place, rotor.stations)
        said.section.complain("station", f"a station of the rotor model{hint}; its stations are {known}")
        return None
    if place is not None and place > rotor.n_nodes:
        said.section.complain("node", f"a node of the rotor model, from 1 to {rotor.n_nodes}")
        return None
    return place
