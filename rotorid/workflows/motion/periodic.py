"""`periodic`: periodic motion of a rotor over speed, its stability and bifurcations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorid.base.answer import COLUMNS, Answer
from rotorid.base.json import cell
from rotorid.base.result import frame, text
from rotorid.base.rpm import RPM, range_text, rpm_text
from rotorid.base.text import listing
from rotorid.commands.outcome import Delivered, command, phase, provenance
from rotorid.commands.quantities import Band, Sensor, band, degrees, sensors
from rotorid.workflows.motion.moving_system import Moving, moving

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from fem import Rotor
    from rotorid.motion.continuation import Branch
    from rotorid.motion.periodic_table import Readings
    from rotorid.motion.reduced_system import ReducedSystem
    from rotorid.motion.system import MotionSystem
    from rotorid.reduction import SmallModel

_SMALL = 24
"""Unknowns above which a rotor is reduced, to so many or more."""


@dataclass(frozen=True)
class PeriodicOptions:
    """Options of `periodic`.

    Attributes
    ----------
    speeds : A:B
        Range of speeds, 1000:9000rpm.
    sensors : LIST
        Nodes or stations with angles from x in degrees, 2:45,22:45; default: where forces that are not linear
        act, in x.
    subsynchronous : K
        Also motions that repeat after K revolutions.
    limit_cycle
        Also self-excited motions with a period of their own; of a rotor without unbalance.
    unbalance : FILE
        Table: plane, unbalance_g_mm (or mass_g and radius_mm), angle_deg; in place of a small model's own.
    bow : FILE
        Table of the shaft's bow at rest; in place of a small model's own.
    modes : N
        Modes that a rotor keeps between sensors and bearings (Craig and Bampton), in both planes together;
        default: as of `motion`; small models keep all.
    gravity_direction : DEGREES
        Where gravity points, from x with the rotation; default: -90, to -y.
    max_seconds : S
        Limit of the search; what is known by then is given, with a warning. Default: none.
    """

    speeds: Band
    sensors: str | Sequence[Sensor] | None = None
    subsynchronous: int | None = None
    limit_cycle: bool = False
    unbalance: Path | str | Mapping[int, complex] | None = None
    bow: Path | str | Mapping[int, complex] | None = None
    modes: int | None = None
    gravity_direction: float = -90.0
    max_seconds: float | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class PeriodicMotions(Delivered):
    """Branches of periodic motion as sensors read them, of a rotor that is perhaps reduced."""

    readings: Readings
    reduced: ReducedSystem | None

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, without the provenance."""
        few = self.reduced
        costs = few and {"modes": few.modes, "frequency_error": cell(few.error)}
        return {**self.readings.to_dict(), "reduction": costs}

    @property
    def answer(self) -> Answer:
        """Where the motion is stable, and the bifurcations; behind it the branches."""
        bifurcations, motion = self.readings.bifurcations(), self.readings.motion
        told = [self._judgement(k) for k in range(len(motion.branches))]
        return Answer(
            "\n".join(told),
            text(bifurcations, width=COLUMNS)
            if bifurcations[0].values
            else f"No bifurcation. {motion.tried}",
            motion.warnings,
            (
                *([] if self.reduced is None else [self.reduced.note]),
                *(
                    f"at {rpm_text(speed)} the motion jumps {'up' if to[0] > at[0] else 'down'} at "
                    f"{self.readings.labels[0]}, from {1e6 * at[0]:.4g} to {1e6 * to[0]:.4g} µm"
                    for speed, at, to in self.readings.jumps
                ),
            ),
        )

    def _judgement(self, k: int) -> str:
        branch, sizes = self.readings.motion.branches[k], 1e6 * self.readings.along[k][:, 0]
        low, high = min(branch.speeds), max(branch.speeds)
        parts = [f"{least * RPM:.6g} to {rpm_text(most)}" for least, most in _stable_ranges(branch)]
        where = f"stable at {listing(parts, 'and')}" if parts else "unstable"
        where = "stable throughout" if branch.stable.all() else where
        return (
            f"Branch {k + 1}, {branch.kind}, {range_text(low, high)}, up to {sizes.max():.4g} µm at "
            f"{self.readings.labels[0]}: {where}."
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per point of a branch."""
        return frame(self.readings.points())

    def figure(self) -> Figure:
        """The bifurcation diagram."""
        from rotorid.base.plot_style import on_figure
        from rotorid.motion.bifurcation_diagram import draw_bifurcations

        return on_figure(lambda ax: draw_bifurcations(self.readings, ax), height=4.6)


def _stable_ranges(branch: Branch) -> list[tuple[float, float]]:
    """Speeds of the stretches of a branch that are stable, from bifurcation to bifurcation, rad/s."""
    found: list[list[float]] = []
    turns = {one.after: one.point.orbit.speed for one in branch.bifurcations}
    before = False
    for k, (speed, stable) in enumerate(zip(branch.speeds, branch.stable, strict=True)):
        at = [turns[k]] if k in turns and stable != before else []
        if stable:
            found = found if before else [*found, []]
            found[-1] += [*at, speed]
        elif before:
            found[-1] += at
        before = stable
    return [(min(speeds), max(speeds)) for speeds in found]


@command
def periodic(model: Rotor | SmallModel | Path | str, options: PeriodicOptions) -> PeriodicMotions:
    """Find periodic motions of a rotor over a range of speeds, their stability and bifurcations.

    Parameters
    ----------
    model
        A rotor, a rotor table or file, or a small model.
    options
        The speeds, and what differs from the defaults.

    Raises
    ------
    ValueError
        For a model or an option that cannot be, and where no periodic motion is found.
    """
    import numpy as np

    from rotorid.motion.periodic import periodic_motion
    from rotorid.motion.periodic_table import Readings
    from rotorid.motion.reduced_system import reduced_system

    low, high = band(options.speeds, "--speeds") or (0.0, 0.0)
    if low <= 0:
        raise ValueError("--speeds: periodic motion needs a turning rotor, so speeds above 0")
    if options.subsynchronous is not None and not 2 <= options.subsynchronous <= 8:
        raise ValueError("--subsynchronous takes a whole number of revolutions from 2 to 8")
    if options.max_seconds is not None and not options.max_seconds > 0:
        raise ValueError("--max-seconds takes a number above 0")
    direction = degrees(options.gravity_direction, "--gravity-direction")
    what = moving(model, options.unbalance, options.bow, direction)
    full = what.system(low, high)
    labels, sensed = _sensors(what, full, options.sensors)
    mounted = [node for node in full.nodes if full.unbalance[full.index(node)[0]]]
    kept = [node for node, _ in sensed] + (mounted if len(mounted) <= _SMALL // 2 else [])
    few = full.size <= _SMALL and options.modes is None
    reduced = None if few else reduced_system(full, kept, options.modes)
    system = full if reduced is None else reduced.system
    directions = np.zeros((len(sensed), system.size))
    for row, (node, angle) in zip(directions, sensed, strict=True):
        row[[*system.index(node)]] = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    with phase("periodic motion"):
        motion = periodic_motion(
            system,
            low,
            high,
            subsynchronous=options.subsynchronous,
            limit_cycle=options.limit_cycle,
            max_seconds=np.inf if options.max_seconds is None else options.max_seconds,
        )
    readings = Readings(motion, labels, directions)
    return PeriodicMotions(readings=readings, reduced=reduced, provenance=provenance(what.files, options))


def _sensors(
    what: Moving, system: MotionSystem, given: str | Sequence[Sensor] | None
) -> tuple[tuple[str, ...], list[tuple[int, float]]]:
    """Names of the sensors, their nodes and angles, degrees."""
    nodes = dict.fromkeys(force.node for force in system.forces) or dict.fromkeys(system.nodes)
    places = [*nodes] if given is None else sensors(given)
    both = [place if isinstance(place, tuple) else (place, 0.0) for place in places]
    labels = tuple(f"{name}" if angle == 0 else f"{name}:{angle:g}" for name, angle in both)
    return labels, [(what.node(name), angle) for name, angle in both]
