"""`periodic`: periodic motion of a rotor over speed, its stability and bifurcations."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from rotorid.base.json import plain
from rotorid.base.tables import Column, Table
from rotorid.base.text import RPM, listing, range_text, rpm_text
from rotorid.commands.motion_inputs import (
    SMALL,
    Moving,
    mounted_nodes,
    moving,
    reduction,
    reduction_notes,
)
from rotorid.commands.option_values import Band, Sensor, sensors, two_speeds
from rotorid.report.outcome import USUAL, Outcome, command

if TYPE_CHECKING:
    from fem import Rotor
    from rotorid.base.arrays import FloatArray
    from rotorid.motion.branches import Branch
    from rotorid.motion.collocation import Orbit
    from rotorid.motion.periodic import PeriodicMotion
    from rotorid.motion.system import MotionSystem
    from rotorid.reduction import SmallModel


@dataclass(frozen=True)
class PeriodicOptions:
    """Options of `periodic`.

    Attributes
    ----------
    speeds : A:B
        Range of speeds, 1000:9000rpm; or one, 600:600 or 600.
    sensors : LIST
        Nodes or stations with angles from x in degrees, 2:45,22:45; default: where forces that are not linear
        act, or else at the supports, in x.
    limit_cycle
        Also self-excited motions with a period of their own; of a rotor without unbalance.
    unbalance : FILE
        Table: plane, unbalance_g_mm (or mass_g and radius_mm), angle_deg; in place of a small model's own.
    max_seconds : S from 0.01
        Limit of the search; what is known by then is given, with a warning. Default: none.
    """

    speeds: Band
    sensors: str | Sequence[Sensor] | None = None
    limit_cycle: bool = False
    unbalance: Path | str | Mapping[int, complex] | None = None
    max_seconds: float | None = None
    panels: ClassVar[Mapping[str, str]] = {
        "Motion": "limit_cycle",
        "Method": "max_seconds",
    }
    to = USUAL


def _outcome(motion: PeriodicMotion, labels: Sequence[str], directions: FloatArray) -> Outcome:
    """Branches as sensors read them, which have names and unit vectors (k, n): stability, bifurcations."""
    from rotorid.base.plot_style import on_figure
    from rotorid.motion.branches import amplitudes, jumps
    from rotorid.motion.plots import draw_bifurcations

    branches, first = motion.branches, labels[0]
    along = [amplitudes(branch.points, directions) for branch in branches]
    leaps = jumps(branches, directions)
    bifurcations = _bifurcations(branches, labels, directions)
    document = {
        "sensors": labels,
        "branches": [
            {
                "kind": branch.kind,
                "turns": branch.orbits[0].turns or None,
                "ended": branch.ended,
                "speeds_rad_s": branch.speeds,
                "periods_s": [_period(branch, p) for p in branch.points],
                "stable": branch.stable,
                "largest_multiplier": [abs(p.multipliers[0]) for p in branch.points],
                "steps": max(len(p.velocities) for p in branch.points),
                "amplitude_m": sizes.T,
            }
            for branch, sizes in zip(branches, along, strict=True)
        ],
        "bifurcations": bifurcations.records,
        "jumps": [{"speed_rad_s": speed, "from_m": at, "to_m": to} for speed, at, to in leaps],
        "tried": motion.tried,
        "warnings": motion.warnings,
        "reduction": reduction(motion.system),
    }
    return Outcome(
        result=motion,
        sentences=tuple(
            f"Branch {k}, {_judgement(branch, 1e6 * sizes[:, 0], first)}"
            for k, (branch, sizes) in enumerate(zip(branches, along, strict=True), 1)
        ),
        tables=(bifurcations if bifurcations.rows else "No bifurcation.",),
        file=lambda: _points(branches, labels, along),
        keys=plain(document),
        pictures={
            "": lambda: on_figure(lambda ax: draw_bifurcations(branches, directions, first, ax), height=4.6)
        },
        warnings=tuple(motion.warnings),
        notes=(
            *reduction_notes(motion.system),
            *(
                f"at {rpm_text(speed)} the motion jumps {'up' if to[0] > at[0] else 'down'} at {first}, from "
                f"{1e6 * at[0]:.4g} to {1e6 * to[0]:.4g} µm"
                for speed, at, to in leaps
            ),
            motion.tried,
        ),
    )


def _judgement(branch: Branch, sizes: FloatArray, label: str) -> str:
    """Over which speeds it goes, how large, µm, and where it is stable."""
    low, high = min(branch.speeds), max(branch.speeds)
    over = range_text(low, high) if high > low else rpm_text(low)
    parts = [f"{least * RPM:.6g} to {rpm_text(most)}" for least, most in branch.stable_ranges]
    where = f"stable at {listing(parts, 'and')}" if parts else "unstable"
    where = "stable throughout" if branch.stable.all() else where
    return f"{branch.kind}, {over}, up to {sizes.max():.4g} µm at {label}: {where}."


def _points(branches: Sequence[Branch], labels: Sequence[str], along: Sequence[FloatArray]) -> Table:
    """One row per point of a branch."""
    each = [(k, branch, p) for k, branch in enumerate(branches, 1) for p in branch.points]
    columns = [
        Column("branch", [k for k, _, _ in each]),
        Column("kind", [branch.kind for _, branch, _ in each]),
        Column("speed_rad_s", [p.speed for _, _, p in each]),
        Column("period_s", [_period(branch, p) for _, branch, p in each]),
        Column("stable", [p.stable for _, _, p in each]),
        Column("largest_multiplier", [abs(p.multipliers[0]) for _, _, p in each]),
    ]
    for k, label in enumerate(labels):
        columns.append(
            Column(f"amplitude_{label}_m", [size for sizes in along for size in sizes[:, k].tolist()])
        )
    return Table("branches", tuple(columns))


def _bifurcations(branches: Sequence[Branch], labels: Sequence[str], directions: FloatArray) -> Table:
    """One row a bifurcation."""
    from rotorid.motion.branches import amplitudes

    each = [(k, branch, b) for k, branch in enumerate(branches, 1) for b in branch.bifurcations]
    sizes = amplitudes([b for _, _, b in each], directions)
    # by the speed: the frequency that begins there, of a cycle its own; NaN where none begins
    whirl = [(b.frequency if b.turns else math.tau / b.period) / b.speed for _, _, b in each]
    return Table(
        "bifurcations",
        (
            Column("branch", [k for k, _, _ in each]),
            Column("kind", [branch.kind for _, branch, _ in each], title="motion"),
            Column("bifurcation", [b.bifurcation for _, _, b in each]),
            Column("speed_rad_s", [b.speed for _, _, b in each], None),
            Column("speed_rpm", [b.speed * RPM for _, _, b in each], "{:.6g}".format, title="rpm"),
            Column("whirl_ratio", whirl, "{:.4f}".format, title="whirl/speed"),
            *(
                Column(f"amplitude_{name}_m", values, lambda x: f"{1e6 * x:.4g}", title=f"{name}, µm")
                for name, values in zip(labels, sizes.T, strict=True)
            ),
        ),
    )


def _period(branch: Branch, orbit: Orbit) -> float:
    """s; NaN for a rotor at rest."""
    return math.nan if branch.kind == "rest" else orbit.period


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

    from rotorid.motion.periodic import periodic_motion
    from rotorid.motion.system import reduced_system

    low, high = _range(options.speeds)
    what = moving(model, options.unbalance)
    full = what.system(low, high)
    labels, sensed = _sensors(what, full, options.sensors)
    kept = [node for node, _ in sensed] + mounted_nodes(full)
    system = full if full.size <= SMALL else reduced_system(full, kept, None)
    directions = np.zeros((len(sensed), system.size))
    for row, (node, angle) in zip(directions, sensed, strict=True):
        row[[*system.index(node)]] = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    motion = periodic_motion(
        system,
        low,
        high,
        limit_cycle=options.limit_cycle,
        max_seconds=np.inf if options.max_seconds is None else options.max_seconds,
    )
    return _outcome(motion, labels, directions)


def _range(given: Band) -> tuple[float, float]:
    """First and last speed, rad/s, which may be the same."""
    alone = isinstance(given, str) and ":" not in given
    low, high = two_speeds(f"{given}:{given}" if alone else given, "--speeds", "LOWEST:HIGHEST")
    if not 0 < low <= high:
        raise ValueError(f"--speeds {given!r} is not a range of a turning rotor: use LOWEST:HIGHEST above 0")
    return low, high


def _sensors(
    what: Moving, system: MotionSystem, given: str | Sequence[Sensor] | None
) -> tuple[tuple[str, ...], list[tuple[int, float]]]:
    """Names of the sensors, their nodes and angles, degrees."""
    nodes = [each.node for each in system.forces or what.model.supports if each.node in system.nodes]
    places = list(dict.fromkeys(nodes or system.nodes)) if given is None else sensors(given)
    both = [place if isinstance(place, tuple) else (place, 0.0) for place in places]
    labels = tuple(f"{name}" if angle == 0 else f"{name}:{angle:g}" for name, angle in both)
    return labels, [(what.model.node(name), angle) for name, angle in both]
