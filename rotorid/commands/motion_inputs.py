"""What `bearings`, `motion` and `periodic` take: a rotor or a small model, its unbalance, bow and weight."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorid.base.text import counted, percent
from rotorid.report.options import rotor_of

if TYPE_CHECKING:
    from fem import Rotor
    from rotorid.motion.system import MotionSystem
    from rotorid.reduction import SmallModel

SMALL = 24
"""Unknowns above which a rotor is reduced."""
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
    """

    model: Rotor | SmallModel
    unbalance: Mapping[int, complex] | None
    bow: Mapping[int, complex] | None
    direction: float

    def system(self, lowest: float, highest: float) -> MotionSystem:
        """Its equations from one speed to another, rad/s, as `rotorid.motion.system` has them."""
        from rotorid.motion.system import rotor_system

        return rotor_system(
            self.model, lowest, highest, unbalance=self.unbalance, bow=self.bow, direction=self.direction
        )


def reduction(system: MotionSystem) -> dict[str, Any] | None:
    """What a reduced system has of the rotor's, for JSON; None of others."""
    if system.modes is None:
        return None
    return {"modes": system.modes, "frequency_error": system.frequency_error}


def reduction_notes(system: MotionSystem) -> tuple[str, ...]:
    """How many unknowns of a rotor move, and what that costs; none where all do."""
    if system.modes is None:
        return ()
    size, modes = counted(system.size, "unknown"), counted(system.modes, "mode")
    high = f"natural frequencies without films are high by {percent(system.frequency_error)} % at most"
    if system.frequency_error == float("inf"):
        high = "NOT ENOUGH for its natural frequencies up to twice the speed"
    return (f"of the rotor {size} move, {modes} among them; {high}",)


def mounted_nodes(system: MotionSystem) -> list[int]:
    """Nodes with unbalance, unless they are too many to be kept in a reduced system."""
    nodes = [node for node in system.nodes if system.unbalance[system.index(node)[0]]]
    return nodes if len(nodes) <= SMALL // 2 else []


def moving(
    given: Rotor | SmallModel | Path | str,
    unbalance: Table | None = None,
    bow: Table | None = None,
    direction: float = -90.0,
) -> Moving:
    """Read a rotor table, a rotor file or a small model, and tables of unbalance and bow.

    Raises
    ------
    ValueError
        For files that cannot be read.
    """
    from rotorid.files import read_bow, read_small_model, read_unbalance
    from rotorid.files.small_model import is_small_model
    from rotorid.reduction import SmallModel

    model: Rotor | SmallModel
    if isinstance(given, SmallModel):
        model = given
    elif isinstance(given, Path | str) and is_small_model(Path(given)):
        model = read_small_model(given)
    else:
        model = rotor_of(given)
    if isinstance(unbalance, Path | str):
        unbalance = read_unbalance(Path(unbalance), model)
    if isinstance(bow, Path | str):
        bow = read_bow(Path(bow), model)
    return Moving(model, unbalance, bow, direction)
