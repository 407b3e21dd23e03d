"""`bearings`: static equilibrium in journal bearings over speed, their linear coefficients, stability."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorid.base.answer import COLUMNS, Answer
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.rpm import RPM
from rotorid.base.text import capital, counted, figures
from rotorid.commands.input_checks import rotor_source
from rotorid.commands.outcome import Delivered, command, log_rotor, phase, provenance
from rotorid.commands.quantities import Speeds, degrees, rising_speeds

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from fem import Rotor, Stability
    from rotorid.motion.equilibrium import Equilibrium

_ROWS = 14
"""Of the table that is printed with the answer."""
_AXES = ("xx", "xy", "yx", "yy")


@dataclass(frozen=True)
class BearingsOptions:
    """Options of `bearings`.

    Attributes
    ----------
    speeds : SPEEDS
        FIRST:LAST:STEP or a list, rad/s; or with a unit: 1000:9000:250rpm.
    gravity_direction : DEGREES
        Where gravity points, from x with the rotation; default: -90, to -y.
    """

    speeds: Speeds
    gravity_direction: float = -90.0


@dataclass(frozen=True, eq=False, kw_only=True)
class BearingEquilibria(Delivered):
    """Equilibria at ascending speeds, the linear rotor with their coefficients, and where it loses stability.

    Attributes
    ----------
    found
        One for each speed.
    linear
        The rotor with bearing tables in place of its forces.
    stability
        Of the linear rotor; None for one speed alone.
    warnings
        What the reader must know.
    """

    found: Sequence[Equilibrium]
    linear: Rotor
    stability: Stability | None
    warnings: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, without the provenance."""
        return plain(
            {
                "speeds_rad_s": [at.speed for at in self.found],
                "bearings": rows(self._columns(self.found)),
                "stability": self.stability and self.stability.to_dict(),
                "warnings": self.warnings,
            }
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per bearing and speed."""
        return frame(self._columns(self.found))

    @property
    def answer(self) -> Answer:
        """Stability, and the bearings at a few of the speeds; behind it at all."""
        every = max(1, -(-(len(self.found) - 1) // max(_ROWS // len(self.labels) - 1, 1)))
        shown = [*self.found[:-1:every], self.found[-1]]
        return Answer(
            capital(self.stability.summary()) if self.stability else "One speed: no threshold is sought.",
            text(self._columns(shown), width=COLUMNS),
            self.warnings,
            tables=(text(self._columns(self.found), width=COLUMNS),) if every > 1 else (),
            more="every speed",
        )

    @property
    def labels(self) -> list[str]:
        """Names of the bearings."""
        from rotorid.motion.equilibrium import named

        return [one.name or named(one).removeprefix("the ") for one in self.found[0].bearings]

    def _columns(self, found: Sequence[Equilibrium]) -> tuple[Column, ...]:
        import numpy as np

        from rotorid.motion.linear_coefficients import coefficients

        bearings, forces = found[0].bearings, found[0].system.forces
        walled = [k for k, force in enumerate(forces) if force in bearings]
        K, C = (each[:, walled].reshape(-1, 4).T for each in coefficients(found))
        speeds = np.repeat([at.speed for at in found], len(bearings))
        load, e, attitude, sommerfeld = (
            np.concatenate([getattr(at, name) for at in found])
            for name in ("load", "eccentricity", "attitude", "sommerfeld")
        )
        film = np.tile([one.wall for one in bearings], len(found)) * (1 - e)
        return (
            Column("bearing", self.labels * len(found), str),
            Column("node", [one.node for one in bearings] * len(found)),
            Column("speed_rad_s", speeds),
            Column("speed_rpm", speeds * RPM, "{:.6g}".format, "rpm"),
            Column("load_N", abs(load), figures, "load, N"),
            Column("eccentricity", e, "{:.4f}".format),
            Column("attitude_deg", np.degrees(attitude), "{:z.2f}".format, "attitude, °"),
            Column("film_m", film, lambda film: figures(1e6 * film), "least film, µm"),
            Column("sommerfeld", sommerfeld, figures, "Sommerfeld"),
            *(Column(f"k{n}_N_per_m", values) for n, values in zip(_AXES, K, strict=True)),
            *(Column(f"c{n}_N_s_per_m", values) for n, values in zip(_AXES, C, strict=True)),
        )

    def figure(self) -> Figure:
        """Loci and stability map."""
        from rotorid.motion.bearing_pictures import bearings_figure

        return bearings_figure(self.found, self.labels)

    def files(self, path: Path) -> Mapping[Path, bytes]:
        """The linear rotor as a rotor file, .toml, with its tables; or the table, .csv or .xlsx.

        Raises
        ------
        ValueError
            For a rotor file of one speed, which would hold at all.
        """
        from rotorid.tables.reader.table_writing import table_bytes
        from rotorid.tables.rotor.rotor_writing import rotor_file_bytes

        if path.suffix.lower() != ".toml":
            return {path: table_bytes(path, self.to_frame())}
        if len(self.found) < 2:
            raise ValueError(f"{path}: a table over speed needs two speeds at least (--speeds)")
        return rotor_file_bytes(path, self.linear)


@command
def bearings(rotor: Rotor | Path | str, options: BearingsOptions) -> BearingEquilibria:
    """Find where the rotor rests in its journal bearings at each speed, and what is linear about it.

    Parameters
    ----------
    rotor
        A rotor or a rotor file, with journal bearings, squeeze films or seals.
    options
        The speeds, and what differs from the defaults.

    Raises
    ------
    ValueError
        For a rotor or an option that cannot be, and where there is no equilibrium.
    """
    import numpy as np

    from fem import SqueezeFilm
    from rotorid.motion.equilibrium import equilibria, named
    from rotorid.motion.linear_coefficients import linear_rotor, threshold
    from rotorid.motion.rotor_system import rotor_system

    speeds = rising_speeds(options.speeds)
    direction = degrees(options.gravity_direction, "--gravity-direction")
    model, files = rotor_source(rotor)
    if not any(np.isfinite(force.wall) for force in model.forces):
        raise ValueError("the rotor has no [[journal_bearing]], [[squeeze_film]] or [[annular_seal]]")
    highest = speeds[-1] if len(speeds) > 1 else speeds[0] * (1 + 1e-6) + 1e-9
    system = rotor_system(model, speeds[0], highest, direction=direction)
    with phase(f"equilibrium at {counted(len(speeds), 'speed')}"):
        found = equilibria(system, speeds)
    with phase("stability"):
        stability = threshold(model, system, found) if len(found) > 1 else None
    log_rotor(model, speeds=len(speeds))
    small = "stiffness and damping are those at its centre, they hold for small orbits about it"
    return BearingEquilibria(
        found=found,
        linear=linear_rotor(model, found),
        stability=stability,
        warnings=tuple(f"{named(f)}: {small}" for f in model.forces if isinstance(f, SqueezeFilm)),
        provenance=provenance(files, options),
    )
