"""Steps of a rotor's motion by a Rosenbrock method, compiled: Rodas5P, of order 5, with dense output.

With v = q' the equations are q' = v, M v' = f(q, v, t). M may be singular: what has no mass must be bound by
its damping (a journal by its film). A step h from (q, v) solves for i = 1 … 8, with J_q and J_v the
derivatives of f and γ, a, c, α, d the method's coefficients,

    (1 / γh) p_i − w_i = v + Σ a_ij w_j + Σ (c_ij / h) p_j,
    (M / γh − J_v) w_i − J_q p_i = f(q + Σ a_ij p_j, v + Σ a_ij w_j, t + α_i h)
                                   + M Σ (c_ij / h) w_j + h d_i ∂f/∂t;

without p_i that is one matrix of n × n for all eight: M / γh − J_v − γh J_q. (p_8, w_8) estimates the error.

Source: G. Steinebach, Construction of Rosenbrock–Wanner method Rodas5P and numerical benchmarks within the
Julia Differential Equations package, BIT Numer. Math. 63 (2023) 27; stiffly accurate, L-stable, for index 1.
"""

from __future__ import annotations

import math

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray, IndexArray
from rotorid.base.compiled import compiled
from rotorid.motion.system import add_forces

Equations = tuple[
    IndexArray,
    FloatArray,
    IndexArray,
    FloatArray,
    FloatArray,
    FloatArray,
    FloatArray,
    FloatArray,
    FloatArray,
    ComplexArray,
    ComplexArray,
]
Turning = tuple[float, float, float]
DONE, STUCK = -1, -2
"""How `advance` ends, unless at a wall: at the end; because no step is small enough."""
TOUCH = 0.999
"""Part of its clearance at which a journal touches: a thousandth is left for the film."""
GAMMA = 0.21193756319429014
_ROW_6 = (
    -7.502846399306121,
    2.561846144803919,
    -11.627539656261098,
    -0.18268767659942256,
    0.030198172008377946,
)


def _lower(*rows: tuple[float, ...]) -> FloatArray:
    return np.array([[*row, *[0.0] * (8 - len(row))] for row in rows])


A = _lower(
    (),
    (3.0,),
    (2.849394379747939, 0.45842242204463923),
    (-6.954028509809101, 2.489845061869568, -10.358996098473584),
    (2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641),
    _ROW_6,
    (*_ROW_6, 1.0),
    (*_ROW_6, 1.0, 1.0),
)
C = _lower(
    (),
    (-14.155112264123755,),
    (-17.97296035885952, -2.859693295451294),
    (147.12150275711716, -1.41221402718213, 71.68940251302358),
    (165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306),
    (24.854864614690072, -3.0009227002832186, 47.4931110020768, 5.5814197821558125, -0.6610691825249471),
    (
        *(30.91273214028599, -3.1208243349937974, 77.79954646070892, 34.28646028294783),
        *(-19.097331116725623, -28.087943162872662),
    ),
    (
        *(37.80277123390563, -3.2571969029072276, 112.26918849496327, 66.9347231244047),
        *(-40.06618937091002, -54.66780262877968, -9.48861652309627),
    ),
)
ALPHA = np.array([0, 0.6358126895828704, 0.4095798393397535, 0.9769306725060716, 0.4288403609558664, 1, 1, 1])
D = np.array(
    [GAMMA, -0.42387512638858027, -0.3384627126235924, 1.8046452872882734, 2.325825639765069, 0, 0, 0]
)
DENSE = np.array(
    [
        *(25.948786856663858, -2.5579724845846235, 10.433815404888879, -2.3679251022685204),
        *(0.524948541321073, 1.1241088310450404, 0.4272876194431874, -0.17202221070155493),
        *(-9.91568850695171, -0.9689944594115154, 3.0438037242978453, -24.495224566215796),
        *(20.176138334709044, 15.98066361424651, -6.789040303419874, -6.710236069923372),
        *(11.419903575922262, 2.8879645146136994, 72.92137995996029, 80.12511834622643),
        *(-52.072871366152654, -59.78993625266729, -0.15582684282751913, 4.883087185713722),
    ]
).reshape(3, 8)


@compiled
def evaluate(equations: Equations, turning: Turning, t: float, state: FloatArray, slopes: bool) -> None:
    """Write f and its derivatives at the q and v of a state.

    Parameters
    ----------
    equations, turning
        As `advance` takes them.
    t
        s.
    state
        q, v, f, ∂f/∂Ω, ∂f/∂t, and the rows of J_q and of J_v, shape (5 + 2 n, n).
    slopes
        Whether J_q and J_v are wanted; else they hold nothing.
    """
    codes, values, places, _, damping, stiffness, damping_slope, stiffness_slope, weight, u, b = equations
    angle, first, alpha = turning
    n = state.shape[1]
    (q, v, f, f_speed, f_t), J_q, J_v = state[:5], state[5 : 5 + n], state[5 + n :]
    gain = alpha * t
    speed = first + gain
    turned = np.exp(1j * (angle + (first + 0.5 * gain) * t))
    state[2 : len(state) if slopes else 5] = 0.0
    add_forces(codes, values, places, q, v, speed, f, J_q, J_v, f_speed)
    for i in range(n):
        linear, slope = 0.0, 0.0
        for j in range(n):
            linear -= damping[i, j] * v[j] + stiffness[i, j] * q[j]
        for j in range(n if slopes or gain != 0.0 else 0):
            slope -= damping_slope[i, j] * v[j] + stiffness_slope[i, j] * q[j]
        force = u[i] * (speed * speed - 1j * alpha) + b[i]
        f[i] += weight[i] + linear + gain * slope + (force * turned).real
        f_speed[i] += slope + 2.0 * speed * (u[i] * turned).real
        f_t[i] = alpha * f_speed[i] + speed * (1j * force * turned).real
    if slopes:
        J_q -= stiffness + gain * stiffness_slope
        J_v -= damping + gain * damping_slope


@compiled
def attempt(
    equations: Equations,
    turning: Turning,
    t: float,
    h: float,
    state: FloatArray,
    now: FloatArray,
    stages: FloatArray,
) -> bool:
    """Try a step h: write the p and w of all stages, and what is at its end; False where that is impossible.

    `state` is that of `evaluate` at t, `now` that at the end of the step; `stages` (p, w), shape (2, 8, n).
    """
    n, M = state.shape[1], equations[3]
    J_q, (p, w), (slip, pull, right) = state[5 : 5 + n], stages, np.empty((3, n))
    inverse = np.linalg.inv(M / (GAMMA * h) - state[5 + n :] - GAMMA * h * J_q)
    for stage in range(8):
        for i in range(n):
            x, y, by_p, by_w = state[0, i], state[1, i], 0.0, 0.0
            for k in range(stage):
                x += A[stage, k] * p[k, i]
                y += A[stage, k] * w[k, i]
                by_p += C[stage, k] * p[k, i]
                by_w += C[stage, k] * w[k, i]
            now[0, i], now[1, i], now[2, i] = x, y, state[2, i]
            slip[i], pull[i] = GAMMA * (by_p + h * y), by_w / h
        if stage:
            evaluate(equations, turning, t + ALPHA[stage] * h, now, False)
        for i in range(n):
            push = now[2, i] + h * D[stage] * state[4, i]
            for j in range(n):
                push += M[i, j] * pull[j] + J_q[i, j] * slip[j]
            right[i] = push
        for i in range(n):
            rate = 0.0
            for j in range(n):
                rate += inverse[i, j] * right[j]
            p[stage, i], w[stage, i] = slip[i] + GAMMA * h * rate, rate
    np.add(now[:2], stages[:, 7], now[:2])
    evaluate(equations, turning, t + h, now, True)
    return bool(np.isfinite(now[2]).all())


@compiled
def advance(  # noqa: PLR0913  what is compiled takes no objects
    equations: Equations,
    turning: Turning,
    walls: FloatArray,
    span: tuple[float, float],
    steps: tuple[float, float],
    tolerance: float,
    others: FloatArray,
    origin: FloatArray,
    moving: FloatArray,
    largest: FloatArray,
    times: FloatArray,
    out: FloatArray,
) -> tuple[int, float, float, int, int]:
    """Advance a motion, in place, through a time in which C and K are linear in speed.

    Parameters
    ----------
    equations
        Codes, parameters and places of the laws (`MotionSystem.law_tables`); M; C and K at the first speed
        and their slopes over speed, (n, n); weight, unbalance and bow, (n,).
    turning
        Angle rad, speed rad/s and acceleration rad/s² at time 0: φ, Ω, α.
    walls
        Of each force, m, (f,).
    span
        Time when it begins and ends, s.
    steps
        First and least step, s.
    tolerance
        Of the error of q in one step: of a deflection by how far it has been from `origin`, or by a hundredth
        of the largest such way; of other unknowns by the largest of theirs.
    others
        0 for deflections, 1 for other unknowns, (n,).
    origin
        Where the motion began, (n,).
    moving
        q and v where it begins now and then where it ends, (2, n).
    largest
        How far each of q has been from its origin, (n,); changed.
    times, out
        When the motion is wanted, s, ascending, above the beginning, (k,); and q then, (k, n), written.

    Returns
    -------
    How it ends, see `DONE`, or which force's journal is at its wall; the time; the next step; how many steps;
    how many of `times` are written.
    """
    places, n, q = equations[2], len(origin), moving[0]
    t, end = span
    h, least = steps
    state, now, stages = np.empty((5 + 2 * n, n)), np.empty((5 + 2 * n, n)), np.empty((2, 8, n))
    np.positive(moving, state[:2])  # an assignment to a slice takes seconds to compile
    done, written = 0, 0
    evaluate(equations, turning, t, state, True)
    while t < end:
        for force in range(len(walls)):
            if math.hypot(q[places[force, 0]], q[places[force, 1]]) >= TOUCH * walls[force]:
                return force, t, h, done, written
        if h < least:
            return STUCK, t, h, done, written
        step = end - t if t + 1.0001 * h >= end else h
        error, ways = math.inf, largest
        if attempt(equations, turning, t, step, state, now, stages):
            ways = np.maximum(largest, np.abs(now[0] - origin))
            sizes = (1.0 - others) * np.maximum(ways, 0.01 * np.max(ways * (1.0 - others)))
            sizes += others * np.max(ways * others) + 1e-300
            error = np.max(np.abs(stages[0, 7]) / sizes) / tolerance
        if not error <= 1.0:
            h = step * max(0.2, 0.9 * error**-0.2 if error < 1e9 else 0.2)
            continue
        then = end if step == end - t else t + step
        bends = DENSE @ stages[0]
        while written < len(times) and times[written] <= then:  # by the method's polynomial of degree 4
            part = (times[written] - t) / step
            bend = bends[0] + part * (bends[1] + part * bends[2])
            np.add((1.0 - part) * state[0], part * (now[0] + (1.0 - part) * bend), out[written])
            written += 1
        state, now = now, state
        np.positive(state[:2], moving)
        np.positive(ways, largest)
        t = then
        done += 1
        h = max(step * min(5.0, 0.9 * max(error, 1e-9) ** -0.2), h if step < h else 0.0)
    return DONE, t, h, done, written
