"""What `motion` and `periodic` move: a rotor with unbalance and bow, or a small model that has its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rotorid.workflows.input_checks import file_of, rotor_source

if TYPE_CHECKING:
    from fem import Rotor
    from rotorid.motion.small_model import SmallModel
    from rotorid.motion.system import MotionSystem

Table = Mapping[int, complex] | Path | str


@dataclass(frozen=True, eq=False)
class Moving:
    """A model, what is mounted on it, and its weight.

    Attributes
    ----------
    model
        The rotor or the small model.
    unbalance, bow
        By node, kg·m and m, complex; None: the small model's own.
    direction
        Of gravity, degrees from x with the rotation.
    files
        Read for it.
    """

    model: Rotor | SmallModel
    unbalance: Mapping[int, complex] | None
    bow: Mapping[int, complex] | None
    direction: float
    files: tuple[Path, ...]

    def node(self, name: str | int) -> int:
        """Number of a node, given so or as the name of a station.

        Raises
        ------
        ValueError
            If the model has no such node.
        """
        from fem import Rotor

        if isinstance(self.model, Rotor):
            return self.model.node(name)
        if str(name) not in map(str, self.model.nodes):
            raise ValueError(f"no node {name}: the small model has {', '.join(map(str, self.model.nodes))}")
        return int(name)

    def system(self, lowest: float, highest: float) -> MotionSystem:
        """Its equations from one speed to another, rad/s.

        Raises
        ------
        ValueError
            As `rotorid.motion.rotor_system.rotor_system`.
        """
        from fem import Rotor
        from rotorid.motion.rotor_system import rotor_system

        model = self.model
        made = partial(rotor_system, model) if isinstance(model, Rotor) else model.system
        return made(lowest, highest, unbalance=self.unbalance, bow=self.bow, direction=self.direction)


def moving(
    given: Rotor | SmallModel | Path | str,
    unbalance: Table | None = None,
    bow: Table | None = None,
    direction: float = -90.0,
) -> Moving:
    """Read a rotor table, a rotor file or a small model, with tables of unbalance and bow for a rotor.

    Raises
    ------
    ValueError
        For files that cannot be read, and tables beside a small model, whose file has them.
    """
    from rotorid.motion.small_model import SmallModel
    from rotorid.tables import read_bow, read_unbalance

    model, files = _source(given)
    mounted: dict[str, Mapping[int, complex] | None] = {}
    for what, table, read in (("unbalance", unbalance, read_unbalance), ("bow", bow, read_bow)):
        if not isinstance(table, Path | str):
            mounted[what] = table
        elif isinstance(model, SmallModel):
            raise ValueError(f"--{what}: a small model has it in its own file, as [[{what}]]")
        else:
            files = (*files, file_of(table, f"a table of {what}"))
            mounted[what] = read(files[-1], model)
    return Moving(model, mounted["unbalance"], mounted["bow"], direction, files)


def _source(given: Rotor | SmallModel | Path | str) -> tuple[Rotor | SmallModel, tuple[Path, ...]]:
    from rotorid.motion.small_model import SmallModel
    from rotorid.tables.models.small_model_file import is_small_model, read_small_model
    from rotorid.tables.rotor.rotor_file import rotor_files

    if isinstance(given, SmallModel):
        return given, ()
    if isinstance(given, Path | str) and is_small_model(file := file_of(given, "a rotor or a small model,")):
        return read_small_model(file), rotor_files(file)
    return rotor_source(given)
