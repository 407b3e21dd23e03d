"""`periodic`: periodic motion of a rotor over speed, its stability and bifurcations."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from rotorid.base.answer import COLUMNS, Answer, Answered
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.rpm import RPM, range_text, rpm_text
from rotorid.base.text import listing
from rotorid.commands.moving import Moving, moving
from rotorid.commands.quantities import Band, Sensor, sensors, speeds
from rotorid.report.outcome import USUAL, Outcome, command, outcome_of, provenance

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from fem import Rotor
    from rotorid.motion.periodic import Bifurcation, Branch, Point, Readings
    from rotorid.motion.system import MotionSystem, ReducedSystem
    from rotorid.reduction import SmallModel

_SMALL = 24
"""Unknowns above which a rotor is reduced, to so many or more."""


@dataclass(frozen=True)
class PeriodicOptions:
    """Options of `periodic`.

    Attributes
    ----------
    speeds : A:B
        Range of speeds, 1000:9000rpm; or one, 600:600 or 600.
    sensors : LIST
        Nodes or stations with angles from x in degrees, 2:45,22:45; default: where forces that are not linear
        act, in x.
    limit_cycle
        Also self-excited motions with a period of their own; of a rotor without unbalance.
    unbalance : FILE
        Table: plane, unbalance_g_mm (or mass_g and radius_mm), angle_deg; in place of a small model's own.
    """

    speeds: Band
    sensors: str | Sequence[Sensor] | None = None
    limit_cycle: bool = False
    unbalance: Path | str | Mapping[int, complex] | None = None
    panels: ClassVar[Mapping[str, str]] = {
        "Motion": "limit_cycle",
    }
    to: ClassVar[tuple[str, ...]] = USUAL


@dataclass(frozen=True, eq=False, kw_only=True)
class PeriodicMotions(Answered):
    """Branches of periodic motion as sensors read them, of a rotor that is perhaps reduced."""

    readings: Readings
    reduced: ReducedSystem | None

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, without the provenance."""
        motion, few = self.readings.motion, self.reduced
        branches = [
            {
                "kind": branch.kind,
                "turns": branch.turns or None,
                "ended": branch.ended,
                "speeds_rad_s": branch.speeds,
                "periods_s": [_period(branch, p) for p in branch.points],
                "stable": branch.stable,
                "largest_multiplier": [p.largest for p in branch.points],
                "steps": max(len(p.orbit.velocities) for p in branch.points),
                "amplitude_m": sizes.T,
            }
            for branch, sizes in zip(motion.branches, self.readings.along, strict=True)
        ]
        return plain(
            {
                "sensors": self.readings.labels,
                "branches": branches,
                "bifurcations": rows(self._bifurcations()),
                "jumps": [
                    {"speed_rad_s": speed, "from_m": before, "to_m": after}
                    for speed, before, after in self.readings.jumps
                ],
                "tried": motion.tried,
                "warnings": motion.warnings,
                "reduction": few and {"modes": few.modes, "frequency_error": few.error},
            }
        )

    @property
    def answer(self) -> Answer:
        """Where the motion is stable, and the bifurcations; behind it the branches."""
        bifurcations, motion = self._bifurcations(), self.readings.motion
        told = [self._judgement(k) for k in range(len(motion.branches))]
        return Answer(
            "\n".join(told),
            f"{text(bifurcations, width=COLUMNS) if bifurcations[0].values else 'No bifurcation.'}\n"
            f"{motion.tried}",
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
        over = range_text(low, high) if high > low else rpm_text(low)
        parts = [f"{least * RPM:.6g} to {rpm_text(most)}" for least, most in _stable_ranges(branch)]
        where = f"stable at {listing(parts, 'and')}" if parts else "unstable"
        where = "stable throughout" if branch.stable.all() else where
        return (
            f"Branch {k + 1}, {branch.kind}, {over}, up to {sizes.max():.4g} µm at "
            f"{self.readings.labels[0]}: {where}."
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per point of a branch."""
        readings = self.readings
        each = [(k, branch, p) for k, branch in enumerate(readings.motion.branches, 1) for p in branch.points]
        amplitudes = zip(*(column for values in readings.along for column in values), strict=True)
        return frame(
            (
                Column("branch", [k for k, _, _ in each]),
                Column("kind", [branch.kind for _, branch, _ in each]),
                Column("speed_rad_s", [p.orbit.speed for _, _, p in each]),
                Column("period_s", [_period(branch, p) for _, branch, p in each]),
                Column("stable", [p.outside == 0 for _, _, p in each]),
                Column("largest_multiplier", [p.largest for _, _, p in each]),
                *(
                    Column(f"amplitude_{label}_m", values)
                    for label, values in zip(readings.labels, amplitudes, strict=True)
                ),
            )
        )

    def _bifurcations(self) -> tuple[Column, ...]:
        """One row a bifurcation."""
        branches = self.readings.motion.branches
        each = [(k, branch, b) for k, branch in enumerate(branches, 1) for b in branch.bifurcations]
        sizes = [size for values in self.readings.at for size in values]
        return (
            Column("branch", [k for k, _, _ in each], str),
            Column("kind", [branch.kind for _, branch, _ in each], str, "motion"),
            Column("bifurcation", [b.kind for _, _, b in each], str),
            Column("speed_rad_s", [b.point.orbit.speed for _, _, b in each]),
            Column("speed_rpm", [b.point.orbit.speed * RPM for _, _, b in each], "{:.6g}".format, "rpm"),
            Column("whirl_ratio", [_whirl(*one[1:]) for one in each], "{:.4f}".format, "whirl/speed"),
            *(
                Column(f"amplitude_{name}_m", [m[k] for m in sizes], _micrometres, f"{name}, µm")
                for k, name in enumerate(self.readings.labels)
            ),
        )

    def figure(self) -> Figure:
        """The bifurcation diagram."""
        from rotorid.base.plot_style import on_figure
        from rotorid.motion.plots import draw_bifurcations

        return on_figure(lambda ax: draw_bifurcations(self.readings, ax), height=4.6)


def _micrometres(metres: float) -> str:
    return f"{1e6 * metres:.4g}"


def _whirl(branch: Branch, bifurcation: Bifurcation) -> float:
    """Frequency that begins there, of a cycle its own, by the speed; NaN where none begins."""
    orbit = bifurcation.point.orbit
    return (bifurcation.frequency if branch.turns else math.tau / orbit.period) / orbit.speed


def _period(branch: Branch, point: Point) -> float:
    """s; NaN for a rotor at rest."""
    return math.nan if branch.kind == "rest" else point.orbit.period


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
def periodic(model: Rotor | SmallModel | Path | str, options: PeriodicOptions) -> Outcome:
    """Periodic motion over speed: stability, bifurcations, self-excited motion.

    Example: rotorid periodic sample_data/motion/rotor.toml --speeds 5000:8000rpm --limit-cycle
    --plot bifurcations.png

    Example: rotorid periodic sample_data/motion/unbalanced.toml --speeds 1000:6000rpm --output branches.csv

    Parameters
    ----------
    model : MODEL
        Rotor file (.toml, .csv, .xlsx) or small model (.toml).
    options
        The speeds, and what differs from the defaults.

    Raises
    ------
    ValueError
        For a model or an option that cannot be, and where no periodic motion is found.
    """
    import numpy as np

    from rotorid.motion.periodic import Readings, periodic_motion
    from rotorid.motion.system import reduced_system

    low, high = _range(options.speeds)
    what = moving(model, options.unbalance)
    full = what.system(low, high)
    labels, sensed = _sensors(what, full, options.sensors)
    mounted = [node for node in full.nodes if full.unbalance[full.index(node)[0]]]
    kept = [node for node, _ in sensed] + (mounted if len(mounted) <= _SMALL // 2 else [])
    few = full.size <= _SMALL
    reduced = None if few else reduced_system(full, kept, None)
    system = full if reduced is None else reduced.system
    directions = np.zeros((len(sensed), system.size))
    for row, (node, angle) in zip(directions, sensed, strict=True):
        row[[*system.index(node)]] = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    motion = periodic_motion(system, low, high, limit_cycle=options.limit_cycle)
    readings = Readings(motion, labels, directions)
    result = PeriodicMotions(readings=readings, reduced=reduced)
    return outcome_of(result, provenance(what.files, options))


def _range(given: Band) -> tuple[float, float]:
    """First and last speed, rad/s, which may be the same."""
    ends = given.replace(":", ",") if isinstance(given, str) else given
    found = speeds(ends, what="--speeds")
    if not 1 <= len(found) <= 2 or found[0] > found[-1]:
        raise ValueError(f"--speeds {given!r} is not a range: use LOWEST:HIGHEST, such as 1000:9000rpm")
    if found[0] <= 0:
        raise ValueError("--speeds: periodic motion needs a turning rotor, so speeds above 0")
    return found[0], found[-1]


def _sensors(
    what: Moving, system: MotionSystem, given: str | Sequence[Sensor] | None
) -> tuple[tuple[str, ...], list[tuple[int, float]]]:
    """Names of the sensors, their nodes and angles, degrees."""
    nodes = dict.fromkeys(force.node for force in system.forces) or dict.fromkeys(system.nodes)
    places = [*nodes] if given is None else sensors(given)
    both = [place if isinstance(place, tuple) else (place, 0.0) for place in places]
    labels = tuple(f"{name}" if angle == 0 else f"{name}:{angle:g}" for name, angle in both)
    return labels, [(what.node(name), angle) for name, angle in both]
