"""`influence`: vibration at sensors of a rotor model per unit unbalance at planes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rotorid.commands.option_values import Nodes, Sensor, Speeds, nodes, rising_speeds, sensors
from rotorid.report.options import rotor_of
from rotorid.report.outcome import USUAL, Outcome, command

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fem import Rotor


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
    to = USUAL


@command
def influence(rotor: Rotor | Path | str, options: InfluenceOptions) -> Outcome:
    """Vibration at sensors per unit unbalance at planes, over speeds.

    The table that --output writes is the stored-coefficients file that `rotorid balance --influence` reads.

    Example: rotorid influence sample_data/rotor23.csv --planes 7,12 --sensors 2:45,22:45 --speeds 100,120

    Parameters
    ----------
    rotor : ROTOR
        Rotor table (.csv, .xlsx) or rotor file (.toml).
    options
        Planes, sensors and speeds.

    Raises
    ------
    ValueError
        For a rotor or an option that cannot be.
    """
    import fem
    from fem.plots import influence_figure

    model = rotor_of(rotor)
    planes, places = nodes(options.planes, "--planes"), sensors(options.sensors)
    speeds = rising_speeds(options.speeds)
    result = fem.influence(model, planes, places, speeds)
    *largest, every = result.tables()
    return Outcome(
        result=result,
        sentences=tuple(result.sentence().splitlines()),
        tables=tuple(largest),
        file=every,
        keys=result.to_dict(),
        warnings=result.warnings,
        pictures={
            "Influence coefficients over speed, below the rotor with its planes and sensors.": lambda: (
                influence_figure(result, model)
            )
        },
        title="Influence coefficients",
    )
