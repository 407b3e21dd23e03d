"""`bearings`: static equilibrium in journal bearings over speed, their linear coefficients, stability."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rotorid.base.json import plain
from rotorid.base.tables import Column, Table
from rotorid.base.text import RPM, figures, sentence
from rotorid.commands.motion_inputs import moving
from rotorid.commands.option_values import Speeds, rising_speeds
from rotorid.report.outcome import USUAL, Outcome, command

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fem import Rotor, Stability
    from rotorid.motion.equilibrium import Equilibrium
    from rotorid.reduction import SmallModel

_ROWS = 6
"""Of the table that is printed with the answer."""
_AXES = ("xx", "xy", "yx", "yy")


@dataclass(frozen=True)
class BearingsOptions:
    """Options of `bearings`.

    Attributes
    ----------
    speeds : SPEEDS
        FIRST:LAST:STEP or a list, rad/s; or with a unit: 1000:9000:250rpm.
    """

    speeds: Speeds
    outputs = (".csv", ".xlsx", ".toml")
    to = USUAL


@dataclass(frozen=True, eq=False, kw_only=True)
class BearingEquilibria:
    """Equilibria at ascending speeds, the linear rotor with their coefficients, and where it loses stability.

    Attributes
    ----------
    equilibria
        One for each speed.
    linear
        The rotor with bearing tables in place of its forces.
    stability
        Of the linear rotor; None for one speed alone.
    """

    equilibria: Sequence[Equilibrium]
    linear: Rotor | SmallModel
    stability: Stability | None

    @property
    def labels(self) -> list[str]:
        """Names of the bearings."""
        from rotorid.motion.equilibrium import named

        return [one.name or named(one).removeprefix("the ") for one in self.equilibria[0].bearings]

    def table(self, every: int = 1) -> Table:
        """One row per bearing and speed, of each so many speeds and the last one."""
        import numpy as np

        from rotorid.motion.linear_coefficients import coefficients

        shown = [*self.equilibria[:-1:every], self.equilibria[-1]]
        bearings, forces = shown[0].bearings, shown[0].system.forces
        walled = [k for k, force in enumerate(forces) if force in bearings]
        K, C = (each[:, walled].reshape(-1, 4).T for each in coefficients(shown))
        speeds = np.repeat([at.speed for at in shown], len(bearings))
        load, e, attitude, sommerfeld = (
            np.concatenate([getattr(at, name) for at in shown])
            for name in ("load", "eccentricity", "attitude", "sommerfeld")
        )
        film = np.tile([one.wall for one in bearings], len(shown)) * (1 - e)
        columns = (
            Column("bearing", self.labels * len(shown)),
            Column("node", [one.node for one in bearings] * len(shown), None),
            Column("speed_rad_s", speeds, None),
            Column("speed_rpm", speeds * RPM, "{:.6g}".format, title="rpm"),
            Column("load_N", abs(load), figures, title="load, N"),
            Column("eccentricity", e, "{:.4f}".format),
            Column("attitude_deg", np.degrees(attitude), "{:z.2f}".format, title="attitude, °"),
            Column("film_m", film, lambda film: figures(1e6 * film), title="least film, µm"),
            Column("sommerfeld", sommerfeld, figures, title="Sommerfeld"),
            *(Column(f"k{n}_N_per_m", values, None) for n, values in zip(_AXES, K, strict=True)),
            *(Column(f"c{n}_N_s_per_m", values, None) for n, values in zip(_AXES, C, strict=True)),
        )
        return Table("every speed", columns)

    def figure(self) -> Figure:
        """Paths of the journals in their clearance circles, below where they lose stability."""
        from rotorid.base.plot_style import on_figure
        from rotorid.motion.plots import draw_journals

        figure = on_figure(lambda ax: draw_journals(self.equilibria, self.labels, ax), height=4.6)
        if self.stability:
            words = textwrap.fill(sentence(self.stability.sentence()), 76)
            figure.suptitle(words, fontsize="medium", fontweight="bold")
        return figure

    def linear_files(self, path: Path) -> Mapping[Path, bytes]:
        """The linear rotor as a rotor file, .toml, with its tables.

        Raises
        ------
        ValueError
            For one speed, which would hold at all.
        """
        from fem import Rotor
        from rotorid.files.rotor import rotor_file_bytes
        from rotorid.files.small_model import small_model_files

        if len(self.equilibria) < 2:
            raise ValueError(f"{path}: a table over speed needs two speeds at least (--speeds)")
        if isinstance(self.linear, Rotor):
            return rotor_file_bytes(path, self.linear)
        return small_model_files(path, self.linear)


@command
def bearings(rotor: Rotor | SmallModel | Path | str, options: BearingsOptions) -> Outcome:
    """Static equilibrium in journal bearings over speed, linear coefficients, stability.

    Gravity points to -y. --output FILE.toml writes the rotor with bearing tables over speed, which critical,
    campbell, response and reduce read.

    Example: rotorid bearings sample_data/motion/rotor.toml --speeds 1000:9000:250rpm

    Example: rotorid bearings sample_data/motion/rotor.toml --speeds 600:9000:100rpm --output linear.toml
    --plot bearings.png

    Parameters
    ----------
    rotor : MODEL
        Rotor file (.toml) or small model (.toml), with journal bearings, squeeze films or seals.
    options
        The speeds, and what differs from the defaults.

    Raises
    ------
    ValueError
        For a rotor or an option that cannot be, and where there is no equilibrium.
    """
    from fem import SqueezeFilm
    from rotorid.motion.equilibrium import equilibria, named
    from rotorid.motion.linear_coefficients import linear_rotor, threshold

    speeds = rising_speeds(options.speeds)
    what = moving(rotor)
    system = what.system(speeds[0], speeds[-1])
    if not (system.walls < float("inf")).any():
        raise ValueError("the rotor has no [[journal_bearing]], [[squeeze_film]] or [[annular_seal]]")
    resting = equilibria(system, speeds)
    stability = threshold(what.model, system, resting) if len(resting) > 1 else None
    small = "stiffness and damping are those at its centre, they hold for small orbits about it"
    films = [f"{named(f)}: {small}" for f in system.forces if isinstance(f, SqueezeFilm)]
    touched = dict.fromkeys(named(stop) for at in resting for stop in at.touched)
    result = BearingEquilibria(
        equilibria=resting, linear=linear_rotor(what.model, resting), stability=stability
    )
    every = max(1, -(-(len(resting) - 1) // max(_ROWS // len(result.labels) - 1, 1)))
    table, warnings = result.table(), (*(f"the shaft rests on {stop}" for stop in touched), *films)
    return Outcome(
        result=result,
        sentences=(sentence(stability.sentence()) if stability else "One speed: no threshold is sought.",),
        tables=(result.table(every),),
        more=(table,) if every > 1 else (),
        short=every > 1,
        file=table,
        files={".toml": result.linear_files},
        keys=plain(
            {
                "speeds_rad_s": speeds,
                "bearings": table.records,
                "stability": stability and stability.to_dict(),
                "warnings": warnings,
            }
        ),
        pictures={"": result.figure},
        warnings=warnings,
    )
