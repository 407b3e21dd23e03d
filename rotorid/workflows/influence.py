"""`influence`: vibration at sensors of a rotor model per unit unbalance at planes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorid.base.text import counted
from rotorid.workflows.input_checks import rotor_source
from rotorid.workflows.option_values import Nodes, Sensor, Speeds, nodes, rising_speeds, sensors
from rotorid.workflows.result_provenance import Parts, log_rotor, phase, provenance, workflow

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import pandas as pd
    from matplotlib.figure import Figure

    from fem import InfluenceCoefficients, Rotor


@dataclass(frozen=True)
class InfluenceOptions:
    """Options of `influence`.

    Attributes
    ----------
    planes : LIST
        Correction planes: nodes or stations, such as 7,12,18.
    sensors : LIST
        Sensors: nodes or stations, each with its angle from x in degrees: 2:45,22:45 (without: 0).
    speeds : SPEEDS
        FIRST:LAST:STEP or a list, rad/s; or with a unit: 1000:6000:50rpm.
    """

    planes: Nodes
    sensors: str | Sequence[Sensor]
    speeds: Speeds


@dataclass(frozen=True, eq=False, kw_only=True)
class RotorInfluence(Parts):
    """Influence coefficients, and the rotor that they are of."""

    coefficients: InfluenceCoefficients
    rotor: Rotor

    @property
    def parts(self) -> Mapping[str, Any]:
        """The coefficients."""
        return {"": self.coefficients}

    def to_frame(self) -> pd.DataFrame:
        """The file of stored coefficients that `balance` reads."""
        from rotorid.tables import influence_frame

        return influence_frame(self.coefficients)

    def figure(self) -> Figure:
        """The coefficients over speed, below the rotor with its planes and sensors."""
        from fem.plots import influence_figure

        return influence_figure(self.coefficients, self.rotor)


@workflow
def influence(rotor: Rotor | Path | str, options: InfluenceOptions) -> RotorInfluence:
    """Compute the vibration at sensors per unit unbalance at planes, over speeds.

    Parameters
    ----------
    rotor
        A rotor, a rotor table or a rotor file.
    options
        Planes, sensors and speeds.

    Raises
    ------
    ValueError
        For a rotor or an option that cannot be.
    """
    import fem

    model, files = rotor_source(rotor)
    planes, places = nodes(options.planes, "--planes"), sensors(options.sensors)
    speeds = rising_speeds(options.speeds)
    with phase(f"influence coefficients at {counted(len(speeds), 'speed')}"):
        found = fem.influence(model, planes, places, speeds)
    log_rotor(model, speeds=len(speeds))
    return RotorInfluence(coefficients=found, rotor=model, provenance=provenance(files, options))
