"""Motion in time at a constant speed or through a range of speeds, sampled evenly.

A rotor without forces that are not linear, at a constant speed and with mass at all unknowns, has constant
coefficients: y′ = A y for y = (q, v, 1, e^{iφ}), of which q and v are the real parts, and y(t + h) = e^{Ah} y
at any step h. All others take the steps of `rotorid.motion.rosenbrock`.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fem import NodeForce
from rotorid.base.arrays import ComplexArray, FloatArray, IndexArray, number
from rotorid.base.text import counted, rpm_text
from rotorid.motion.equilibrium import check_journals, named
from rotorid.motion.rosenbrock import DONE, Equations, Turning, advance, evaluate
from rotorid.motion.system import MotionSystem

TOLERANCE, LOOSEST = 1e-6, 1e-2
A_TURN = 64
"""Samples a turn at the highest speed, where no rate is given."""
LEAST_A_TURN = 8
"""Samples a turn below which what the shaft does in a turn is not seen."""
_BLOCK, _TURNS = 10_000, 500
"""Samples and turns at most that are computed at once: what memory takes, and how long Ctrl-C waits."""
_MOST = 10_000_000
"""Positions that are kept, x and y of one node counted as one: 160 MB, some times over."""
_MASSLESS = 1e-12
_SMALLEST = 1e-4
"""Way that a tolerance refers to at least, by the largest deflection at the beginning."""


@dataclass(frozen=True, eq=False)
class MotionRun:
    """A rotor's motion in time.

    Attributes
    ----------
    system
        What moved.
    nodes
        Where it is known, m of them.
    time
        Of the samples, evenly spaced, s, shape (k,).
    speeds
        First and last one, rad/s; between them the speed changes evenly.
    z
        x + iy at these nodes, m, shape (k, m).
    q, v
        All unknowns and their velocities at the last sample, shape (n,).
    angle
        Of rotation at time 0, rad.
    steps
        Of the method, or samples where none is needed.
    tolerance
        Error of one step, see `rotorid.motion.rosenbrock.advance`.
    stopped
        Why it ends before its time; empty where it does not.
    """

    system: MotionSystem
    nodes: tuple[int, ...]
    time: FloatArray
    speeds: tuple[float, float]
    z: ComplexArray
    q: FloatArray
    v: FloatArray
    angle: float
    steps: int
    tolerance: float
    stopped: str

    @cached_property
    def speed(self) -> FloatArray:
        """rad/s at the samples, shape (k,)."""
        return np.linspace(*self.speeds, self.time.size)

    @cached_property
    def turned(self) -> FloatArray:
        """Angle of rotation at the samples, rad, shape (k,)."""
        return np.asarray(self.angle + (self.speeds[0] + self.speed) / 2 * self.time)

    @property
    def resolved(self) -> bool:
        """Whether each turn has `LEAST_A_TURN` samples."""
        return self.time.size > 1 and max(self.speeds) * self.time[1] * LEAST_A_TURN <= 2 * np.pi

    @property
    def bearings(self) -> tuple[tuple[NodeForce, int], ...]:
        """Forces with a wall, each with the column of its node in `z`; those whose node is known here."""
        return tuple(
            (force, self.nodes.index(force.node))
            for force in self.system.forces
            if np.isfinite(force.wall) and force.node in self.nodes
        )

    def eccentricity(self, since: int = 0) -> FloatArray:
        """Smallest and largest by the clearance, of each bearing, from a sample on, shape (b, 2)."""
        sizes = [np.abs(self.z[since:, i]) / force.wall for force, i in self.bearings]
        return np.array([(size.min(), size.max()) for size in sizes]).reshape(-1, 2)


def run(
    system: MotionSystem,
    speeds: tuple[float, float],
    time: float,
    start: tuple[FloatArray, FloatArray],
    *,
    nodes: Sequence[int] | None = None,
    rate: float | None = None,
    tolerance: float = TOLERANCE,
    angle: float = 0.0,
) -> MotionRun:
    """Follow a rotor's motion.

    Parameters
    ----------
    system
        What moves.
    speeds
        At the beginning and at the end, rad/s; the speed changes evenly.
    time
        s.
    start
        All unknowns and their velocities at the beginning, (n,) each; velocities of what has no mass follow
        from the others.
    nodes
        Where the motion is kept; None: at all nodes.
    rate
        Samples a second; None: 64 a turn at the highest speed, and 10,000 in all where nothing turns.
    tolerance
        Of the error of one step, by how far the rotor has moved from where it began.
    angle
        Of rotation at the beginning, rad.

    Raises
    ------
    ValueError
        For numbers that are impossible, speeds outside the range of the equations, journal bearings at speed
        0, an unknown with neither mass nor damping, more samples than memory holds.
    """
    first, last = (number(speed, "speed") for speed in speeds)
    if not number(time, "time") > 0:
        raise ValueError("time must be above 0 s")
    if not 1e-13 <= tolerance <= LOOSEST:
        raise ValueError(f"tolerance must be from 1e-13 to {LOOSEST:g}, not {tolerance:g}")
    for speed in (first, last):
        system.linear(speed)  # refuses what lies outside the knots
    check_journals(system, min(first, last), "begin and end above it")
    turn = 2 * np.pi / max(first, last) if max(first, last) else time
    if rate is None:
        rate = A_TURN / turn if max(first, last) else 10_000 / time
    elif not number(rate, "rate") > 0:
        raise ValueError("rate must be above 0 samples a second")
    names = system.nodes if nodes is None else tuple(nodes)
    places = np.array([system.index(node) for node in names], dtype=np.intp).reshape(-1, 2)
    count = int(np.ceil(rate * time * (1 - 1e-12))) or 1
    if count * max(len(names), 1) > _MOST:
        raise ValueError(
            f"{count:,} samples at {counted(len(names), 'node')} are more than memory should hold: give "
            f"fewer nodes, a shorter time or a lower rate than {rate:.6g} samples a second"
        )
    times = np.linspace(0.0, time, count + 1)
    deflections = np.empty((count + 1, *places.shape))
    q, v = moving = np.array(start, dtype=float)
    _consistent(system, moving, (angle, first, (last - first) / time))
    deflections[0] = q[places]
    others, origin = np.array([float(name[0] not in "xy") for name in system.coordinates]), q.copy()
    largest = _SMALLEST * np.where(others, np.abs(q * others).max(), np.abs(q * (1 - others)).max())
    shorter = min(time, turn)
    h, least, done, steps, stopped = 1e-3 * shorter, 1e-10 * shorter, 1, 0, ""
    exact = not system.forces and first == last and np.linalg.cond(system.M) < 1 / _MASSLESS
    if exact:
        deflections, done, steps = _follow(system, moving, angle, first, times, places), times.size, count
    for (begin, end), equations, turning in (
        () if exact else _pieces(system, (first, last), time, angle, count)
    ):
        at = times[done:][times[done:] <= end]
        out = np.empty((at.size, system.size))
        span, at = (0.0, end - begin), np.minimum(at, end) - begin
        settings = equations, turning, system.walls, span, (max(h, least), least), tolerance
        how, now, h, more, written = advance(*settings, others, origin, moving, largest, at, out)
        deflections[done : done + written] = out[:written, places]
        done, steps = done + written, steps + more
        if how != DONE:
            when = f"after {begin + now:.6g} s, at {rpm_text(first + (last - first) * (begin + now) / time)}"
            stopped = f"no step is short enough {when}: the forces change faster than any motion could follow"
            if how >= 0:
                stopped = (
                    f"the shaft touches the wall of {named(system.forces[how])} {when}: under a thousandth "
                    "of its clearance is left"
                )
            last = first + (last - first) * times[done - 1] / time
            break
    z = deflections[:done, :, 0] + 1j * deflections[:done, :, 1]
    return MotionRun(system, names, times[:done], (first, last), z, q, v, angle, steps, tolerance, stopped)


def _follow(
    system: MotionSystem,
    moving: FloatArray,
    angle: float,
    speed: float,
    times: FloatArray,
    places: IndexArray,
) -> FloatArray:
    """Some unknowns at the times, of constant coefficients; `moving`, q and v, is that at the last then."""
    from scipy.linalg import expm

    C, K = system.linear(speed)
    n = system.size
    A = np.zeros((2 * n + 2, 2 * n + 2), complex)
    A[:n, n : 2 * n] = np.eye(n)
    A[n : 2 * n] = np.linalg.solve(
        system.M, np.column_stack((-K, -C, system.weight, system.unbalance * speed**2 + system.bow))
    )
    A[-1, -1] = 1j * speed
    y = np.concatenate((*moving, [1.0, np.exp(1j * angle)]))
    kept, before = [moving[0, places]], 0.0
    for step in np.diff(times):
        if abs(step - before) > 1e-9 * before:
            change, before = expm(A * step), step
        y = change @ y
        kept.append(y[places].real)
    moving[:] = y[: 2 * n].real.reshape(2, n)
    return np.array(kept)


def _consistent(system: MotionSystem, moving: FloatArray, turning: Turning) -> None:
    """Change the velocities of `moving`, q and v, so that the forces on what has no mass are in equilibrium.

    Raises
    ------
    ValueError
        For motion without mass that nothing damps.
    """
    n, free = system.size, np.flatnonzero(~system.M.any(axis=1))
    state, equations = np.zeros((5 + 2 * n, n)), equations_of(system, turning[1], turning[1])
    for _ in range(20 if free.size else 0):
        state[:2] = moving
        evaluate(equations, turning, 0.0, state, True)
        J = state[5 + n :][np.ix_(free, free)]
        if not np.isfinite(state).all() or np.linalg.cond(J) > 1 / _MASSLESS:
            where = system.coordinates[free[np.abs(J).sum(axis=1).argmin()]]
            raise ValueError(
                f"{where} has neither mass nor damping, so that its velocity is not determined: give it a "
                "mass, or a bearing with damping"
            )
        change = np.linalg.solve(J, state[2, free])
        moving[1, free] -= change
        if np.abs(change).max() <= 1e-13 * np.abs(moving[1]).max():
            break


def _pieces(
    system: MotionSystem, speeds: tuple[float, float], time: float, angle: float, count: int
) -> Iterator[tuple[tuple[float, float], Equations, Turning]]:
    """Times within which C and K are linear in speed, with the equations and φ, Ω, α at their beginning."""
    first, last = speeds
    alpha = (last - first) / time
    inner = system.knots[(system.knots > min(speeds)) & (system.knots < max(speeds))]
    turns = (first + last) / 2 * time / (2 * np.pi)
    blocks = np.linspace(0.0, time, int(max(count / _BLOCK, turns / _TURNS)) + 2)
    ends = np.unique(np.concatenate([blocks, (inner - first) / alpha if alpha else []]))
    for begin, end in itertools.pairwise(ends):
        speed = first + alpha * begin
        turned = (angle + (first + speed) / 2 * begin) % (2 * np.pi)
        yield (begin, end), equations_of(system, speed, first + alpha * end), (turned, speed, alpha)


def equations_of(system: MotionSystem, first: float, last: float) -> Equations:
    """As `advance` takes them, for speeds between two neighbouring knots."""
    middle = (first + last) / 2
    C, K, C_speed, K_speed = system.around(middle)
    back = first - middle
    return (
        *system.law_tables,
        *(system.M, C + back * C_speed, K + back * K_speed, C_speed, K_speed),
        *(system.weight, system.unbalance, system.bow),
    )
