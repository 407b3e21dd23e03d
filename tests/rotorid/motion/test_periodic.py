"""Periodic motion against closed forms, printed digits, and integration in time by scipy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from fem import CubicSpring, InternalDamping, JournalBearing, Motion, SqueezeFilm, Stop
from fem.forces import law, tables
from rotorid.base.plot_style import new_axes
from rotorid.motion.branches import DOUBLING, FOLD, HOPF, TORUS, jumps
from rotorid.motion.collocation import Periodic
from rotorid.motion.periodic import periodic_motion
from rotorid.motion.plots import draw_bifurcations
from rotorid.motion.system import system

SPEEDS = np.array([0.01, 1e4])


def disc(mass, forces, *, damping=0.0, stiffness=(0.0, 0.0), weight=0.0, unbalance=0.0):
    """A mass at one node."""
    matrices = {"M": mass * np.eye(2), "C": damping * np.eye(2), "K": np.diag(stiffness)}
    return system(
        lambda speed: Motion(**matrices, coordinates=("x1", "y1"), speed=speed),
        SPEEDS,
        forces=forces,
        weight={"y1": -weight},
        unbalance={1: unbalance} if unbalance else {},
    )


def damper(B, u):
    """A rigid rotor in a squeeze film with its centring spring, all in the units c = m = k = 1.

    B = η R L³ / (m c³ ω_n) and u = e / c, with the ω_n of the centring spring, r = Ω / ω_n.
    """
    film = SqueezeFilm(1, "", length=1.0, diameter=2.0, clearance=1.0, viscosity=B, centring_stiffness=1.0)
    return disc(1.0, [film], unbalance=u)


def crossings(found, speed):
    """Largest deflection and stability of all motions at a speed, by linear interpolation, ascending."""
    there = []
    for branch in found.branches:
        for a, b, p in zip(branch.speeds, branch.speeds[1:], branch.points, strict=False):
            if (a - speed) * (b - speed) <= 0:
                there.append((np.hypot(*p.readings(np.eye(2)).T).max(), p.stable))
    return sorted(there)


def exact(problem, found, speed, near):
    """The motion at a speed that is nearest to an amplitude: Newton's method from the branch's own point."""
    points = [p for branch in found.branches for p in branch.points]
    sizes = [abs(np.hypot(*p.ends.T).max() - near) + abs(p.speed - speed) for p in points]
    guess = points[int(np.argmin(sizes))]
    return Periodic(problem, speed, speed).solve(replace(guess, speed=speed), guess.at_speed).solution


def test_three_circular_orbits_in_a_squeeze_film():
    """Digits of the issue for B 0.05, u 0.30, r 2; the one in the middle is unstable."""
    problem = damper(0.05, 0.30)
    found = periodic_motion(problem, 0.4, 3.0)
    known = (0.41579958, 0.84178208, 0.87387530)
    for eccentricity, stable in zip(known, (True, False, True), strict=True):
        at = exact(problem, found, 2.0, eccentricity)
        orbit = np.hypot(*at.ends.T)
        np.testing.assert_allclose([orbit.min(), orbit.max()], eccentricity, rtol=3e-8)
        assert (abs(at.multipliers) < 1).all() == stable
    assert [stable for _, stable in crossings(found, 2.0)] == [True, False, True]


def circle(B, u, r):
    """What a centred circular orbit must fulfil: zeros over its eccentricity (short film, half circle)."""

    def left(e):
        radial = e * (1 - r * r) + 2 * B * r * e**2 / (1 - e * e) ** 2
        return radial**2 + (np.pi / 2 * B * r * e / (1 - e * e) ** 1.5) ** 2 - (u * r * r) ** 2

    e = np.linspace(1e-6, 1 - 1e-6, 20001)
    value = left(e)
    return [brentq(left, e[k], e[k + 1], xtol=1e-13) for k in np.flatnonzero(value[1:] * value[:-1] < 0)]


def test_jumps_of_a_squeeze_film_up_and_down():
    """Between the folds there are three circular orbits, outside one; arrows go to the other stable one."""
    B, u = 0.02, 0.2
    found = periodic_motion(damper(B, u), 0.5, 2.0)
    (branch,) = found.branches
    folds = sorted(b.speed for b in branch.bifurcations)
    assert {b.bifurcation for b in branch.bifurcations} == {FOLD}
    for fold, inside in zip(folds, (1e-5, -1e-5), strict=True):
        assert len(circle(B, u, fold + inside)) == 3
        assert len(circle(B, u, fold - inside)) == 1
    arrows = jumps(found.branches, np.eye(2)[:1])
    for speed, before, after in arrows:
        other = circle(B, u, speed + (1e-9 if speed == folds[0] else -1e-9))
        far = max(other, key=lambda e: abs(e - before[0]))
        np.testing.assert_allclose(after, far, rtol=3e-3)
    assert sorted(after[0] > before[0] for _, before, after in arrows) == [False, True]
    ax = new_axes()
    draw_bifurcations(found.branches, np.eye(2)[:1], "1", ax)
    assert sorted(arrow.xy[1] > arrow.xyann[1] for arrow in ax.texts) == [False, True]
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert {"synchronous, stable", "synchronous, unstable", "fold"} == {*labels}
    assert len(labels) == 3


def amplitudes(zeta, cubic, u, speed):
    """|z| of circular orbits: (a (1 − Ω²) + k₃ a³)² + (2 ζ Ω a)² = (u Ω²)², a cubic equation in a²."""
    detuned = 1 - speed**2
    squares = np.roots(
        [cubic**2, 2 * cubic * detuned, detuned**2 + (2 * zeta * speed) ** 2, -((u * speed**2) ** 2)]
    )
    return np.sort(np.sqrt(squares[(abs(squares.imag) < 1e-9) & (squares.real > 0)].real))


def test_a_cubic_spring_has_the_amplitudes_and_folds_of_its_cubic_equation():
    zeta, cubic, u = 0.05, 0.1, 0.2
    found = periodic_motion(disc(1.0, [CubicSpring(1, "", 1.0, cubic)], damping=0.1, unbalance=u), 0.3, 3.0)
    (branch,) = found.branches
    for point in branch.points[::9]:
        size = np.hypot(*point.ends.T)
        near = amplitudes(zeta, cubic, u, point.speed)
        assert abs(size.max() / near - 1).min() < 1e-7
        assert size.max() - size.min() < 1e-7 * size.max()

    def discriminant(speed):
        detuned = 1 - speed**2
        p = np.poly1d(
            [cubic**2, 2 * cubic * detuned, detuned**2 + (2 * zeta * speed) ** 2, -((u * speed**2) ** 2)]
        )
        low, high = np.sort(p.deriv().roots.real)
        return p(low), p(high)

    for bifurcation in branch.bifurcations:
        assert bifurcation.bifurcation == FOLD
        speed = bifurcation.speed
        which = int(abs(discriminant(speed)[0]) > abs(discriminant(speed)[1]))
        root = brentq(lambda s, k=which: discriminant(s)[k], speed - 1e-4, speed + 1e-4, xtol=1e-14)
        assert speed == pytest.approx(root, abs=1e-8)
        assert min(abs(bifurcation.multipliers - 1)) < 1e-6
    assert len(branch.bifurcations) == 2
    assert not found.warnings  # a third of the speed dies down: it is no motion of three revolutions


SAGGING = {"stiffness": (0.2, 0.0), "weight": 1.0, "unbalance": 0.3}
"""A disc that sags in a cubic spring, stiffer in x: its period doubles near twice the resonance."""


def duffing(t, s, speed, given, damping):
    """The same as first-order equations, and with 16 more unknowns their variation."""
    x, y, vx, vy = s[:4]
    k3, r2 = 0.1, x * x + y * y
    drive = given["unbalance"] * speed**2
    ax = drive * np.cos(speed * t) - damping * vx - (1 + given["stiffness"][0] + k3 * r2) * x
    ay = drive * np.sin(speed * t) - damping * vy - (1 + k3 * r2) * y - given["weight"]
    if s.size == 4:
        return [vx, vy, ax, ay]
    A = np.zeros((4, 4))
    A[0, 2] = A[1, 3] = 1
    A[2] = -(1 + given["stiffness"][0] + k3 * (r2 + 2 * x * x)), -2 * k3 * x * y, -damping, 0
    A[3] = -2 * k3 * x * y, -(1 + k3 * (r2 + 2 * y * y)), 0, -damping
    return np.concatenate([[vx, vy, ax, ay], (A @ s[4:].reshape(4, 4)).ravel()])


def monodromy(orbit, given, damping):
    """By integration: how far the state is from periodic, and the multipliers."""
    begin = np.concatenate([orbit.unknowns[:4], np.eye(4).ravel()])
    end = solve_ivp(
        duffing,
        (0, orbit.period),
        begin,
        "DOP853",
        rtol=1e-11,
        atol=1e-12,
        args=(orbit.speed, given, damping),
    ).y[:, -1]
    return abs(end[:4] - orbit.unknowns[:4]).max(), np.linalg.eigvals(end[4:].reshape(4, 4))


def by_size(values):
    return np.sort_complex(np.where(values.imag < 0, values.conj(), values))


@pytest.mark.full
def test_period_doublings_against_integration():
    damping = 0.04
    problem = disc(1.0, [CubicSpring(1, "", 1.0, 0.1)], damping=damping, **SAGGING)
    found = periodic_motion(problem, 2.1, 2.7)
    (main,) = found.branches
    assert [b.bifurcation for b in main.bifurcations] == [DOUBLING, DOUBLING]
    for bifurcation in main.bifurcations:
        away, multipliers = monodromy(bifurcation, SAGGING, damping)
        assert away < 1e-7
        assert min(abs(multipliers + 1)) < 1e-6
    point = main.points[len(main.points) // 2]
    away, multipliers = monodromy(point, SAGGING, damping)
    assert away < 1e-5
    np.testing.assert_allclose(by_size(multipliers), by_size(point.multipliers), atol=3e-5)


def test_a_neimark_sacker_bifurcation_against_integration():
    damping, given = 0.06, {"stiffness": (0.0, 0.0), "weight": 2.0, "unbalance": 0.5}
    problem = disc(1.0, [CubicSpring(1, "", 1.0, 0.1)], damping=damping, **given)
    found = periodic_motion(problem, 2.2, 3.0)
    torus = [b for branch in found.branches for b in branch.bifurcations if b.bifurcation == TORUS]
    assert len(torus) == 1
    away, multipliers = monodromy(torus[0], given, damping)
    assert away < 1e-7
    first = multipliers[np.argmin(abs(abs(multipliers) - 1))]
    assert abs(first) == pytest.approx(1, abs=1e-6)
    assert abs(first.imag) > 0.1


LOAD, CLEARANCE, NOMINAL = 525.0, 1e-4, 157.0


def journal(critical, film="pressure", eccentricity=0.2):
    """A rigid rotor, m c Ω² / W = `critical` and static ε = `eccentricity` at 157 rad/s."""
    e, L, R = eccentricity, 0.03, 0.05
    load = e / (4 * (1 - e * e) ** 2) * np.sqrt(16 * e * e + np.pi**2 * (1 - e * e))
    viscosity = LOAD * CLEARANCE**2 / (NOMINAL * R * L**3 * load)
    bearing = JournalBearing(
        1, "", length=L, diameter=2 * R, clearance=CLEARANCE, viscosity=viscosity, film=film
    )
    return disc(critical * LOAD / (CLEARANCE * NOMINAL**2), [bearing], weight=LOAD)


@pytest.mark.parametrize(
    ("critical", "eccentricity", "whirl"),
    [(7.51461, 0.1, 0.50294), (7.18997, 0.2, 0.51056), (6.46040, 0.5, 0.51464)],
)
def test_hopf_point_of_a_rigid_rotor_in_a_short_bearing(critical, eccentricity, whirl):
    found = periodic_motion(journal(critical, eccentricity=eccentricity), 120.0, 200.0)
    (point,) = found.branches[0].bifurcations
    assert point.bifurcation == HOPF
    assert point.speed == pytest.approx(NOMINAL, rel=3e-6)
    assert point.frequency / point.speed == pytest.approx(whirl, abs=1e-5)
    assert any("no unbalance" in warning for warning in found.warnings)


def test_limit_cycle_of_a_rigid_rotor_in_a_short_bearing():
    """Digits of the issue, M = 8.0: largest and smallest ε 0.8411 and 0.8287, whirl 0.4982 Ω."""
    problem = journal(8.0)
    found = periodic_motion(problem, 140.0, NOMINAL, limit_cycle=True)
    (cycle,) = found.branches[1:]
    last = cycle.points[-1]
    e = np.hypot(*last.readings(np.eye(2)).T) / CLEARANCE
    assert [f"{v:.4f}" for v in (e.max(), e.min(), 2 * np.pi / last.period / NOMINAL)] == [
        "0.8411", "0.8287", "0.4982",
    ]  # fmt: skip
    assert last.outside == 0
    solved = Periodic(problem, 140.0, NOMINAL).newton(last, last.at_speed)
    assert abs(solved.eigen[0] - 1).min() < 1e-4  # the multiplier of the phase
    assert [b.bifurcation for b in cycle.bifurcations] == [FOLD, FOLD]


def test_limit_cycle_with_the_film_at_the_line_of_centres():
    """Digits of the issue, M = 8.0: 0.8988, 0.8945, 0.500004 Ω, where the film's law has its kink."""
    found = periodic_motion(journal(8.0, "line of centres"), 140.0, NOMINAL, limit_cycle=True)
    (cycle,) = [p for branch in found.branches for p in branch.points[-1:] if p.speed > 156.9 and not p.turns]
    e = np.hypot(*cycle.readings(np.eye(2)).T) / CLEARANCE
    assert [f"{v:.4f}" for v in (e.max(), e.min())] == ["0.8988", "0.8945"]
    assert f"{2 * np.pi / cycle.period / NOMINAL:.6f}" == "0.500004"
    assert cycle.outside == 0


def test_rotating_damping_against_its_threshold():
    """c_i (Ω − ω) > c ω ends stability: Ω = ω (1 + c / c_i); the cubic spring limits the circular whirl."""
    c, c_i, k3 = 0.1, 0.1, 0.5
    given = [CubicSpring(1, "", 1.0, k3), InternalDamping(1, "", c_i)]
    found = periodic_motion(disc(1.0, given, damping=c), 1.0, 3.0, limit_cycle=True)
    (hopf,) = found.branches[0].bifurcations
    assert hopf.speed == pytest.approx(1 + c / c_i, abs=1e-7)
    assert not found.branches[1].bifurcations  # it begins with next to no change of speed, which is no fold
    cycle = found.branches[1].points[-1]
    whirl = 2 * np.pi / cycle.period  # c ω = c_i (Ω − ω), ω² = 1 + k₃ a²
    assert whirl == pytest.approx(c_i * cycle.speed / (c + c_i), rel=1e-8)
    assert np.hypot(*cycle.ends.T).max() == pytest.approx(np.sqrt((whirl**2 - 1) / k3), rel=1e-7)


@pytest.mark.full
def test_a_journal_without_mass_against_long_integration():
    """A disc on a flexible shaft in a film, with unbalance and weight: the branch to 1e-4 of its size."""
    m, k, u, W = 30.0, 5e6, 30.0 * 2e-5, 300.0
    bearing = JournalBearing(1, "", length=0.03, diameter=0.1, clearance=1e-4, viscosity=0.03)
    K = k * np.kron([[1, -1], [-1, 1]], np.eye(2))
    matrices = {"M": np.diag([0.0, 0.0, m, m]), "C": 20.0 * np.diag([0.0, 0.0, 1, 1]), "K": K}
    problem = system(
        lambda speed: Motion(**matrices, coordinates=("x1", "y1", "x2", "y2"), speed=speed),
        np.array([50.0, 500.0]),
        forces=[bearing],
        weight={"y2": -W},
        unbalance={2: u},
    )
    found = periodic_motion(problem, 100.0, 300.0)
    point = found.branches[0].points[len(found.branches[0].points) // 2]
    speed, (codes, values) = point.speed, tables([bearing])
    out, v = np.zeros((2, 6)), np.zeros(2)

    def rate(t, s):
        """The film's force and the shaft's are in balance: that gives the journal's velocity."""
        pull = k * (s[2:4] - s[:2])
        for _ in range(30):
            law(codes[0], values[0], *s[:2], *v, speed, out)
            step = np.linalg.solve(out[:, 3:5], out[:, 0] + pull)
            v[:] -= step
            if abs(step).max() < 1e-12:
                break
        turning = u * speed**2 * np.array([np.cos(speed * t), np.sin(speed * t)])
        return [*v, *s[4:], *((-pull - 20.0 * s[4:] + turning - [0, W]) / m)]

    assert point.outside == 0
    period, n = point.period, 40
    begin = np.concatenate([point.start * 0.9, point.velocities[-1, -1, 2:]])
    times = (n + np.arange(8) / 8) * period
    run = solve_ivp(rate, (0, times[-1]), begin, "LSODA", rtol=1e-9, atol=1e-12, t_eval=times).y[:4].T
    ends = point.ends[:-1]
    np.testing.assert_allclose(run, ends[:: len(ends) // 8], atol=1e-4 * np.ptp(ends) / 2)


def test_a_stop_is_met_where_the_free_orbit_is_as_large_as_its_gap():
    """Above the resonance the branch folds there: the free orbit, u Ω² / |1 − Ω² + 2 i ζ Ω|, grazes it."""
    ring = Stop(1, "", gap=1.0, stiffness=10.0, damping=0.1, diameter=1.0)
    problem = disc(1.0, [ring], damping=0.1, stiffness=(1.0, 1.0), unbalance=0.3)
    found = periodic_motion(problem, 0.5, 2.0)
    graze = brentq(lambda s: 0.3 * s**2 - abs(1 - s**2 + 0.1j * s), 1.05, 2.0, xtol=1e-12)
    folds = [b.speed for branch in found.branches for b in branch.bifurcations if b.bifurcation == FOLD]
    assert folds == [pytest.approx(graze, abs=1e-6)]
    assert not any("stopped" in warning for warning in found.warnings)


@pytest.mark.parametrize(
    ("low", "high", "options", "words"),
    [
        (0.0, 2.0, {}, "speeds above 0"),
        (2.0, 1.0, {}, "the lower one first"),
        (1.0, 2.0, {"limit_cycle": True}, "a period of its own"),
    ],
)
def test_what_cannot_be_sought_is_refused(low, high, options, words):
    with pytest.raises(ValueError, match=words):
        periodic_motion(damper(0.05, 0.3), low, high, **options)


def test_too_few_steps_are_said(monkeypatch):
    monkeypatch.setattr("rotorid.motion.collocation.MOST_STEPS", 4)
    monkeypatch.setattr("rotorid.motion.collocation.LEAST_STEPS", 4)
    found = periodic_motion(damper(0.05, 0.3), 0.5, 1.5)
    assert any("too few steps" in warning for warning in found.warnings)


def test_a_rotor_that_does_not_whirl_and_one_without_mass_and_damping():
    """Overdamped it rests; what motion in time cannot follow is said, the branch is found all the same."""
    told = periodic_motion(disc(1.0, [CubicSpring(1, "", 1.0, 0.1)], damping=9.0, weight=1.0), 1.0, 2.0)
    assert told.branches[0].stable.all()
    assert len(told.warnings) == 1
    told = periodic_motion(disc(0.0, [CubicSpring(1, "", 1.0, 0.1)], weight=1.0, unbalance=0.1), 1.0, 2.0)
    assert "neither mass nor damping" in told.warnings[-1]


@pytest.mark.full
def test_motions_that_no_branch_shows_are_said():
    """A period doubling and self-excited whirl, not asked for."""
    damping = 0.04
    problem = disc(1.0, [CubicSpring(1, "", 1.0, 0.1)], damping=damping, **SAGGING)
    told = periodic_motion(problem, 2.1, 2.7).warnings
    assert "motion in time comes again after 2 revolutions only, at 21.5318 and 22.9183 rpm" in told
    given = [CubicSpring(1, "", 1.0, 0.5), InternalDamping(1, "", 0.1)]
    told = periodic_motion(disc(1.0, given, damping=0.1), 1.0, 3.0).warnings
    whirl = "motion in time comes to a whirl with a period of its own (--limit-cycle)"
    assert f"{whirl}, at 23.8732 and 28.6479 rpm" in told  # 3 and 2.5 rad/s; below 2 it rests


@pytest.mark.parametrize("cubic", [[], [CubicSpring(1, "", 0.0, 1.0)]])
@pytest.mark.parametrize("external", [20.0, 8.0])
def test_the_whirl_that_begins_is_told_by_its_shape(external, cubic):
    """c_i ω / (c_i + c_e): the natural frequency by the speed, which the multiplier does not tell."""
    internal, stiffness, mass = 40.0, 1e5, 5.0
    natural = np.sqrt(stiffness / mass)
    damping = [InternalDamping(1, "", damping=internal)]
    problem = disc(mass, [*damping, *cubic], damping=external, stiffness=(stiffness,) * 2, unbalance=1e-4)
    found = periodic_motion(problem, 1.05 * natural, 1.1 * natural * (1 + external / internal))
    (lost,) = found.branches[0].bifurcations
    assert lost.bifurcation == TORUS
    ratio = lost.frequency / lost.speed
    assert ratio == pytest.approx(internal / (internal + external), rel=1e-4)


def test_time_that_runs_out_leaves_what_is_known(monkeypatch):
    """By a clock that counts how often it is asked: the branch up to there, and what was not sought."""
    import time

    asked = [0]

    def clock():
        asked[0] += 1
        return float(asked[0])

    monkeypatch.setattr(time, "monotonic", clock)
    problem = damper(0.05, 0.30)
    found = periodic_motion(problem, 0.4, 3.0, max_seconds=60)
    (branch,) = found.branches
    assert branch.speeds[0] == 0.4
    assert 0.4 < branch.speeds[-1] < 3.0
    assert "60 s" in found.warnings[0]
    assert any("synchronous branch stopped" in text for text in found.warnings)
    with pytest.raises(ValueError, match="raise --max-seconds"):
        periodic_motion(problem, 0.4, 3.0, max_seconds=1)
