"""`motion`: motion in time of a rotor whose forces are not linear, at a speed or through a range of them."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple, get_args

from rotorid.base.json import plain
from rotorid.base.tables import Column, Table
from rotorid.base.text import RPM, figures, percent, rpm_text
from rotorid.commands.motion_inputs import SMALL, mounted_nodes, moving, reduction, reduction_notes
from rotorid.commands.option_values import (
    FASTEST,
    Nodes,
    Speeds,
    degrees,
    nodes,
    number,
    one_of,
    one_speed,
    pairs,
    two_speeds,
)
from rotorid.report.outcome import USUAL, Outcome, command

if TYPE_CHECKING:
    from fem import Rotor
    from rotorid.commands.motion_inputs import Moving
    from rotorid.motion.run import MotionRun
    from rotorid.motion.steady import SteadyEnd
    from rotorid.motion.system import MotionSystem
    from rotorid.reduction import SmallModel

View = Literal["motion", "orbits", "bode"]
"""What a picture shows."""
Start = Literal["rest", "steady"]
_TOLERANCE = 1e-6
"""Error of one step, by how far the rotor has moved from where it began."""
_LOOSER = 30.0
"""Times the tolerance: the motion is found twice, and what differs is told as its error."""
_UNSURE = 1e-3


@dataclass(frozen=True)
class MotionOptions:
    """Options of `motion`.

    Attributes
    ----------
    speed : SPEED
        A constant speed, 6000rpm; without a unit rad/s.
    run_up : A:B
        From one speed to another one, up or down, evenly: 500:9000rpm, 9000:500rpm.
    time : TIME
        How long, 2s.
    unbalance : FILE
        Table: plane, unbalance_g_mm (or mass_g and radius_mm), angle_deg; in place of a small model's own.
    bow : FILE
        Table of the shaft's bow at rest; in place of a small model's own.
    gravity_direction : DEGREES
        Where gravity points, from x with the rotation; default: -90, to -y.
    start
        At rest in equilibrium, or in steady motion at the first speed.
    displaced : LIST
        Nodes moved from there, with the direction from x: 7=20um@90,12=5um.
    sensors : NODES
        Where the motion is given: nodes or stations with commas; default: stations and bearings, or all.
    rate : N
        Samples a second; default: 64 a turn at the highest speed.
    view
        What --plot draws: x and y over time with the spectrum, orbits, or a run-up over speed.
    """

    speed: str | float | None = None
    run_up: Speeds | None = None
    time: str | float | None = None
    unbalance: Path | str | Mapping[int, complex] | None = None
    bow: Path | str | Mapping[int, complex] | None = None
    gravity_direction: float = -90.0
    start: Start = "rest"
    displaced: str | Mapping[str, complex] | None = None
    sensors: Nodes | None = None
    rate: float | None = None
    view: View = "motion"
    panels: ClassVar[Mapping[str, str]] = {
        "Start": "start displaced",
        "Method": "rate",
        "Output": "view",
    }
    to = USUAL


class Motion(NamedTuple):
    """Motion in time, what it comes to, and how sure it is.

    `end` is None where the speed changes or too little is known; `error` the largest difference of positions
    from those with a tolerance thirty times as large, by its way: the error itself is smaller, except where
    two motions part.
    """

    motion: MotionRun
    end: SteadyEnd | None
    error: float


def _furthest(motion: MotionRun) -> tuple[int, float, float, float]:
    """Node, time, speed and distance where it is furthest from the line of bearings."""
    size = abs(motion.z)
    k, i = divmod(int(size.argmax()), len(motion.nodes))
    return motion.nodes[i], float(motion.time[k]), float(motion.speed[k]), float(size[k, i])


def _document(result: Motion, bearings: Sequence[str], warnings: Sequence[str]) -> dict[str, Any]:
    import numpy as np

    motion, end = result.motion, result.end
    ranges = motion.eccentricity() if end is None else end.eccentricity
    nodes = [str(node) for node in motion.nodes]
    deflections = np.stack([motion.z.real, motion.z.imag], axis=2)
    furthest = zip(("node", "time_s", "speed_rad_s", "distance_m"), _furthest(motion), strict=True)
    return plain(
        {
            "time_s": motion.time,
            "speed_rad_s": motion.speed,
            "angle_rad": motion.turned,
            "positions_m": {node: deflections[:, i] for i, node in enumerate(nodes)},
            "furthest": dict(furthest),
            "steady": end and end.steady,
            "at_rest": end and end.at_rest,
            "chaotic": end and end.chaotic,
            "trend": end and (end.trend or None),
            "change": end and end.change,
            "periodic": end and end.periodic,
            "period_s": end and end.period,
            "whirl_ratio": end and end.whirl_ratio,
            "whirl_frequency_rad_s": end and end.frequency,
            "amplitude_m": end and dict(zip(nodes, end.amplitude, strict=True)),
            "eccentricity": dict(zip(bearings, ranges.tolist(), strict=True)),
            "tolerance": motion.tolerance,
            "position_error": result.error,
            "reduction": reduction(motion.system),
            "warnings": warnings,
        }
    )


def _samples(motion: MotionRun) -> Table:
    """One row a sample: time, speed, angle, deflections."""
    import numpy as np

    columns = [
        Column("t_s", motion.time),
        Column("speed_rpm", motion.speed * RPM),
        Column("angle_deg", np.degrees(motion.turned)),
    ]
    for node, z in zip(motion.nodes, motion.z.T, strict=True):
        columns += [Column(f"x_{node}_um", 1e6 * z.real), Column(f"y_{node}_um", 1e6 * z.imag)]
    return Table("motion", tuple(columns))


def _sentence(motion: MotionRun, end: SteadyEnd | None) -> str:
    first, last = motion.speeds
    if end is None and first == last:
        return f"At {rpm_text(first)} for {figures(motion.time[-1])} s: too few samples to say more."
    if end is None:
        node, _, speed, distance = _furthest(motion)
        return (
            f"From {rpm_text(first)} to {rpm_text(last)} in {figures(motion.time[-1])} s: furthest from "
            f"the line of bearings at node {node}, {figures(1e6 * distance)} µm at {rpm_text(speed)}."
        )
    where = f"At {rpm_text(first)}"
    if end.at_rest:
        return f"{where} it comes to rest."
    whirl = f"the largest part of its motion has {abs(end.frequency) * RPM:.6g} cycles a minute"
    if end.speed:
        way = ", against the rotation" if end.frequency < 0 else ""
        whirl += f", {abs(end.whirl_ratio):.4f} of the speed{way}"
    if not end.steady:
        more = {
            "grows": "it grows, to a limit cycle or to a wall: more --time shows which",
            "decays": "it dies down: give it more --time to settle",
            "drifts": "its mean drifts: give it more --time to settle",
            "": "with more --time still so, it beats",
        }[end.trend]
        if end.chaotic:
            more = "it does not come again, and its spectrum is no few lines: it is chaotic"
        return (
            f"{where} it is NOT STEADY after {figures(motion.time[-1])} s: size or mean change by "
            f"{percent(end.change)} % in its last part; {more}; {whirl}."
        )
    again = "does not come again"
    if end.periodic:
        turns = end.period * end.speed * RPM / 60
        unit = "s" if not turns else "turn" if round(turns, 3) == 1 else "turns"
        again = f"comes again every {turns or end.period:.5g} {unit}"
    return f"{where} the motion is steady to {percent(max(end.change, 1e-4))} % and {again}; {whirl}."


def _tables(motion: MotionRun, end: SteadyEnd | None, bearings: Sequence[str]) -> tuple[Table, ...]:
    """A row for each node: where it was furthest from the line of bearings, and the end; the bearings."""
    size = abs(motion.z)
    at = size.argmax(axis=0)
    columns = [
        Column("node", [str(node) for node in motion.nodes]),
        Column("furthest, µm", 1e6 * size.max(axis=0), figures),
        Column("at, s", motion.time[at], figures),
        Column("at, rpm", motion.speed[at] * RPM, "{:.6g}".format),
    ]
    if end is not None:
        columns += [
            Column("at the end: amplitude, µm", 1e6 * end.amplitude, figures),
            Column("mean x, µm", 1e6 * end.mean.real, figures),
            Column("mean y, µm", 1e6 * end.mean.imag, figures),
        ]
    nodes = Table("nodes", tuple(columns))
    if not bearings:
        return (nodes,)
    when = "" if end is None else "at the end "
    least, most = (motion.eccentricity() if end is None else end.eccentricity).T
    ranges = (
        Column("bearing", bearings),
        Column(f"eccentricity {when}from", least, "{:.4f}".format),
        Column("to", most, "{:.4f}".format),
    )
    return nodes, Table("bearings", ranges)


@command
def motion(model: Rotor | SmallModel | Path | str, options: MotionOptions) -> Outcome:
    """Motion in time at a constant speed, through a run-up or a run-down.

    Example: rotorid motion sample_data/motion/unbalanced.toml --speed 4000rpm --time 2s --plot motion.png

    Example: rotorid motion sample_data/motion/unbalanced.toml --run-up 1000:9000rpm --time 10 --plot bode.png
    --view bode

    Parameters
    ----------
    model : MODEL
        Rotor file (.toml, .csv, .xlsx) or small model (.toml).
    options
        Speed and time, and what differs from the defaults.

    Raises
    ------
    ValueError
        For a model or options that cannot be; where a journal touches its wall, with time and node.
    """
    from rotorid.motion.plots import FIGURES
    from rotorid.motion.run import run
    from rotorid.motion.steady import begin, steady_end
    from rotorid.motion.system import reduced_system

    one_of(options.view, "--view", get_args(View))
    ends, time = _course(options)
    direction = degrees(options.gravity_direction, "--gravity-direction")
    source = moving(model, options.unbalance, options.bow, direction)
    system = source.system(min(ends), max(ends))
    shown = _shown(source, system, options.sensors)
    shift = {source.model.node(node): by for node, by in _displaced(options.displaced).items()}
    if system.size > SMALL:
        system = reduced_system(system, [*shown, *shift, *mounted_nodes(system)], None)
    q, v, unsettled = begin(system, ends[0], options.start, shift, _TOLERANCE)
    move = partial(run, system, ends, time, (q, v), nodes=shown, rate=options.rate)
    fine = move(tolerance=_TOLERANCE)
    rough = move(tolerance=_LOOSER * _TOLERANCE)
    if fine.stopped:
        until = f" (--time {0.999 * fine.time[-1]:.4g} shows it until then)" if fine.time[-1] else ""
        raise ValueError(fine.stopped + until)
    k = min(fine.time.size, rough.time.size)
    error = float(
        abs(fine.z[:k] - rough.z[:k]).max()
        / max(abs(fine.z - fine.z[0]).max(), 1e-4 * abs(fine.z).max(), 1e-300)
    )
    result = Motion(fine, steady_end(fine), error)
    warnings = (*unsettled, *_warnings(fine, error, bool(shift)))
    bearings = [force.name or f"node {force.node}" for force, _ in fine.bearings]
    step = figures(1e3 * fine.time[-1] / fine.steps, 1)
    return Outcome(
        result=result,
        sentences=(_sentence(fine, result.end),),
        tables=_tables(fine, result.end, bearings),
        file=lambda: _samples(fine),
        keys=lambda: _document(result, bearings, warnings),
        pictures={"": lambda: FIGURES[options.view](fine)},
        warnings=warnings,
        notes=(
            f"steps of about {step} ms, each to {fine.tolerance:g} of how far the rotor moves; positions "
            f"differ by {error:.1g} of that from those with {_LOOSER:g} times this tolerance",
            *reduction_notes(fine.system),
        ),
    )


def _course(options: MotionOptions) -> tuple[tuple[float, float], float]:
    """First and last speed, rad/s, and the time between them, s."""
    constant = options.speed is not None
    if constant == (options.run_up is not None):
        raise ValueError("one of --speed and --run-up is needed")
    if constant:
        speed = one_speed(options.speed or 0.0, "--speed")
        ends = (speed, speed)
    else:
        ends = two_speeds(options.run_up or "", "--run-up", "FIRST:LAST")
        if ends[0] == ends[1]:
            raise ValueError(f"--run-up {options.run_up!r}: two different speeds are needed; else --speed")
    if options.time is None:
        raise ValueError("--time is needed")
    time = number(str(options.time).strip().removesuffix("s"))
    if not 0 < time < FASTEST:
        raise ValueError(f"--time {options.time!r}: seconds above 0 are needed, such as 2s")
    return ends, time


def _shown(source: Moving, system: MotionSystem, given: Nodes | None) -> tuple[int, ...]:
    """Nodes whose motion is given."""
    import numpy as np

    walled = [force.node for force in system.forces if np.isfinite(force.wall)]
    if given is not None:
        return tuple(
            dict.fromkeys([*(source.model.node(node) for node in nodes(given, "--sensors")), *walled])
        )
    stations = list(getattr(source.model, "stations", {}))
    supports = [support.node for support in source.model.supports if support.node in system.nodes]
    chosen = (
        {*map(source.model.node, stations), *walled, *supports, *mounted_nodes(system)}
        if stations or system.size > SMALL
        else ()
    )
    return tuple(sorted(chosen)) or system.nodes


def _displaced(given: str | Mapping[str, complex] | None) -> dict[str, complex]:
    """Read "7=20um@90" as x + iy in m, by node."""
    from rotorid.commands.option_units import length

    def read(_: str, value: str) -> complex:
        size, _, angle = value.partition("@")
        turned = math.radians(degrees(angle or "0", "--displaced"))
        return cmath.rect(length(size, "--displaced", "20um"), turned)

    return pairs(given or {}, "--displaced", read, "7=20um@90")


def _warnings(run: MotionRun, error: float, shifted: bool) -> tuple[str, ...]:
    warnings = []
    if not run.resolved:
        warnings.append("too few samples a turn (--rate): what the shaft does between them is not told")
    if error > _UNSURE:
        warnings.append(
            f"positions with {_LOOSER:g} times the tolerance differ by {percent(error)} % of how far "
            "the rotor moves: where it whips, amplitude and frequency of the whirl count, not its phase; "
            "where it is chaotic, positions cannot be compared"
        )
    if not shifted and not run.system.unbalance.any() and not run.system.bow.any():
        warnings.append("nothing excites it: no unbalance, no bow (--unbalance)")
    return tuple(warnings)
