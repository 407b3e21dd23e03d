"""Periodic motion against closed forms, printed digits, and integration in time."""

import time

import numpy as np
import pytest
from moving_mass import one_mass
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from fem import CubicSpring, InternalDamping, JournalBearing, Motion, SqueezeFilm, Stop
from rotorid.base.plot_style import new_axes
from rotorid.motion.branches import DOUBLING, FOLD, HOPF, TORUS, jumps
from rotorid.motion.collocation import Periodic
from rotorid.motion.periodic import periodic_motion
from rotorid.motion.plots import draw_bifurcations
from rotorid.motion.run import run
from rotorid.motion.system import system

CUBIC = CubicSpring(1, "", 1.0, 0.1)


def damper(B, u):
    """A rigid rotor in a squeeze film with its centring spring, all in the units c = m = k = 1.

    B = η R L³ / (m c³ ω_n) and u = e / c, with the ω_n of the centring spring, r = Ω / ω_n.
    """
    film = SqueezeFilm(1, "", length=1.0, diameter=2.0, clearance=1.0, viscosity=B, centring_stiffness=1.0)
    return one_mass(forces=[film], unbalance=u, speeds=(0.01, 1e4))


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
    (branch,) = branches = periodic_motion(damper(B, u), 0.5, 2.0).branches
    folds = sorted(b.speed for b in branch.bifurcations)
    assert {b.bifurcation for b in branch.bifurcations} == {FOLD}
    for fold, inside in zip(folds, (1e-5, -1e-5), strict=True):
        assert [len(circle(B, u, fold + side)) for side in (inside, -inside)] == [3, 1]
    arrows = jumps(branches, np.eye(2)[:1])
    for speed, before, after in arrows:
        other = circle(B, u, speed + (1e-9 if speed == folds[0] else -1e-9))
        np.testing.assert_allclose(after, max(other, key=lambda e: abs(e - before[0])), rtol=3e-3)
    assert sorted(after[0] > before[0] for _, before, after in arrows) == [False, True]
    ax = new_axes()
    draw_bifurcations(branches, np.eye(2)[:1], "1", ax)
    assert sorted(arrow.xy[1] > arrow.xyann[1] for arrow in ax.texts) == [False, True]
    labels = sorted(text.get_text() for text in ax.get_legend().get_texts())
    assert labels == ["fold", "synchronous, stable", "synchronous, unstable"]


def test_a_cubic_spring_has_the_amplitudes_and_folds_of_its_cubic_equation():
    """(a (1 − Ω²) + k₃ a³)² + (2 ζ Ω a)² = (u Ω²)², a cubic equation in a²; two roots meet at a fold."""
    zeta, cubic, u = 0.05, 0.1, 0.2
    result = periodic_motion(one_mass(c=0.1, forces=[CUBIC], unbalance=u, speeds=(0.01, 1e4)), 0.3, 3.0)

    def polynomial(speed):
        d = 1 - speed**2
        return np.poly1d([cubic**2, 2 * cubic * d, d**2 + (2 * zeta * speed) ** 2, -((u * speed**2) ** 2)])

    (branch,) = result.branches
    for point in branch.points[::9]:
        size = np.hypot(*point.ends.T)
        squares = polynomial(point.speed).roots
        near = np.sqrt(squares[(abs(squares.imag) < 1e-9) & (squares.real > 0)].real)
        assert abs(size.max() / near - 1).min() < 1e-7
        assert size.max() - size.min() < 1e-7 * size.max()
    assert [b.bifurcation for b in branch.bifurcations] == [FOLD, FOLD]
    for bifurcation in branch.bifurcations:
        extremes = [
            lambda s, k=k: polynomial(s)(np.sort(polynomial(s).deriv().roots.real)[k]) for k in (0, 1)
        ]
        touching = min(extremes, key=lambda f, at=bifurcation.speed: abs(f(at)))
        root = brentq(touching, bifurcation.speed - 1e-4, bifurcation.speed + 1e-4, xtol=1e-14)
        assert bifurcation.speed == pytest.approx(root, abs=1e-8)
        assert min(abs(bifurcation.multipliers - 1)) < 1e-6
    assert not result.warnings  # a third of the speed dies down: it is no motion of three revolutions


SAGGING = {"k": (0.2, 0.0), "weight": 1.0, "unbalance": 0.3, "c": 0.04}
"""A disc that sags in a cubic spring, stiffer in x: its period doubles near twice the resonance."""
ROUND = {"k": (0.0, 0.0), "weight": 2.0, "unbalance": 0.5, "c": 0.06}


def monodromy(orbit, given):
    """By integration with the variation: how far the state is from periodic, and the multipliers."""

    def rate(t, s):
        x, y, vx, vy = s[:4]
        k3, r2, (kx, _), c = 0.1, x * x + y * y, given["k"], given["c"]
        drive = given["unbalance"] * orbit.speed**2
        ax = drive * np.cos(orbit.speed * t) - c * vx - (1 + kx + k3 * r2) * x
        ay = drive * np.sin(orbit.speed * t) - c * vy - (1 + k3 * r2) * y - given["weight"]
        A = np.zeros((4, 4))
        A[0, 2] = A[1, 3] = 1
        A[2] = -(1 + kx + k3 * (r2 + 2 * x * x)), -2 * k3 * x * y, -c, 0
        A[3] = -2 * k3 * x * y, -(1 + k3 * (r2 + 2 * y * y)), 0, -c
        return np.concatenate([[vx, vy, ax, ay], (A @ s[4:].reshape(4, 4)).ravel()])

    begin = np.concatenate([orbit.unknowns[:4], np.eye(4).ravel()])
    end = solve_ivp(rate, (0, orbit.period), begin, "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    return abs(end[:4] - orbit.unknowns[:4]).max(), np.linalg.eigvals(end[4:].reshape(4, 4))


@pytest.mark.full
def test_period_doublings_against_integration():
    result = periodic_motion(one_mass(forces=[CUBIC], speeds=(0.01, 1e4), **SAGGING), 2.1, 2.7)
    (main,) = result.branches
    assert [b.bifurcation for b in main.bifurcations] == [DOUBLING, DOUBLING]
    for bifurcation in main.bifurcations:
        away, multipliers = monodromy(bifurcation, SAGGING)
        assert away < 1e-7
        assert min(abs(multipliers + 1)) < 1e-6
    assert (
        "motion in time comes again after 2 revolutions only, at 21.5318 and 22.9183 rpm" in result.warnings
    )


def test_a_neimark_sacker_bifurcation_against_integration():
    result = periodic_motion(one_mass(forces=[CUBIC], speeds=(0.01, 1e4), **ROUND), 2.2, 3.0)
    (torus,) = [b for branch in result.branches for b in branch.bifurcations if b.bifurcation == TORUS]
    away, multipliers = monodromy(torus, ROUND)
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
    bearing = JournalBearing(1, "", L, 2 * R, CLEARANCE, viscosity, film)
    mass = critical * LOAD / (CLEARANCE * NOMINAL**2)
    return one_mass(mass, forces=[bearing], weight=LOAD, speeds=(0.01, 1e4))


@pytest.mark.parametrize(
    ("critical", "eccentricity", "whirl"), [(7.51461, 0.1, 0.50294), (6.46040, 0.5, 0.51464)]
)
def test_hopf_point_of_a_rigid_rotor_in_a_short_bearing(critical, eccentricity, whirl):
    result = periodic_motion(journal(critical, eccentricity=eccentricity), 120.0, 200.0)
    (point,) = result.branches[0].bifurcations
    assert point.bifurcation == HOPF
    assert point.speed == pytest.approx(NOMINAL, rel=3e-6)
    assert point.frequency / point.speed == pytest.approx(whirl, abs=1e-5)
    assert any("no unbalance" in warning for warning in result.warnings)


@pytest.mark.parametrize(
    ("film", "digits"), [("pressure", (0.8411, 0.8287, 0.4982)), ("line of centres", (0.8988, 0.8945, 0.5))]
)
def test_limit_cycle_of_a_rigid_rotor_in_a_short_bearing(film, digits):
    """Digits of the issue, M = 8.0: largest and smallest ε, whirl in Ω; one film has its kink there."""
    problem = journal(8.0, film)
    branches = periodic_motion(problem, 140.0, NOMINAL, limit_cycle=True).branches
    (last,) = [p for branch in branches for p in branch.points[-1:] if p.speed > 156.9 and not p.turns]
    e = np.hypot(*last.readings(np.eye(2)).T) / CLEARANCE
    values = e.max(), e.min(), 2 * np.pi / last.period / NOMINAL
    np.testing.assert_allclose(values, digits, atol=5e-5)
    assert last.outside == 0
    if film == "pressure":
        solved = Periodic(problem, 140.0, NOMINAL).newton(last, last.at_speed)
        assert abs(solved.eigen[0] - 1).min() < 1e-4  # the multiplier of the phase
        assert [b.bifurcation for b in branches[1].bifurcations] == [FOLD, FOLD]


def test_rotating_damping_against_its_threshold():
    """c_i (Ω − ω) > c ω ends stability: Ω = ω (1 + c / c_i); the cubic spring limits the circular whirl."""
    c, c_i, k3 = 0.1, 0.1, 0.5
    forces = [CubicSpring(1, "", 1.0, k3), InternalDamping(1, "", c_i)]
    problem = one_mass(c=c, forces=forces, speeds=(0.01, 1e4))
    branches = periodic_motion(problem, 1.0, 3.0, limit_cycle=True).branches
    (hopf,) = branches[0].bifurcations
    assert hopf.speed == pytest.approx(1 + c / c_i, abs=1e-7)
    assert not branches[1].bifurcations  # it begins with next to no change of speed, which is no fold
    cycle = branches[1].points[-1]
    whirl = 2 * np.pi / cycle.period  # c ω = c_i (Ω − ω), ω² = 1 + k₃ a²
    assert whirl == pytest.approx(c_i * cycle.speed / (c + c_i), rel=1e-8)
    assert np.hypot(*cycle.ends.T).max() == pytest.approx(np.sqrt((whirl**2 - 1) / k3), rel=1e-7)
    told = periodic_motion(problem, 1.0, 3.0).warnings
    assert "a whirl with a period of its own (--limit-cycle)" in " ".join(told)


@pytest.mark.full
def test_a_journal_without_mass_against_motion_in_time():
    """A disc on a flexible shaft in a film, with unbalance and weight: the branch to 1e-4 of its size."""
    bearing = JournalBearing(1, "", length=0.03, diameter=0.1, clearance=1e-4, viscosity=0.03)
    K, ends = 5e6 * np.kron([[1, -1], [-1, 1]], np.eye(2)), np.diag([0.0, 0.0, 1.0, 1.0])
    matrices = {"M": 30 * ends, "C": 20 * ends, "K": K, "coordinates": ("x1", "y1", "x2", "y2")}
    problem = system(
        lambda speed: Motion(**matrices, speed=speed),
        np.array([50.0, 500.0]),
        forces=[bearing],
        weight={"y2": -300.0},
        unbalance={2: 6e-4},
    )
    branch = periodic_motion(problem, 100.0, 300.0).branches[0]
    point = branch.points[len(branch.points) // 2]
    assert point.outside == 0
    start, turns = (np.real(part) for part in (0.9 * point.ends[0], point.velocities[-1, -1])), 40
    motion = run(
        problem, (point.speed,) * 2, turns * point.period, tuple(start), tolerance=1e-8, nodes=[1, 2]
    )
    last = np.stack([motion.z[-1].real, motion.z[-1].imag], 1).ravel()
    np.testing.assert_allclose(last, point.ends[0], atol=1e-4 * np.ptp(point.ends) / 2)


def test_a_stop_is_met_where_the_free_orbit_is_as_large_as_its_gap():
    """Above the resonance the branch folds there: the free orbit, u Ω² / |1 − Ω² + 2 i ζ Ω|, grazes it."""
    ring = Stop(1, "", gap=1.0, stiffness=10.0, damping=0.1, diameter=1.0)
    result = periodic_motion(one_mass(c=0.1, k=1.0, forces=[ring], unbalance=0.3), 0.5, 2.0)
    graze = brentq(lambda s: 0.3 * s**2 - abs(1 - s**2 + 0.1j * s), 1.05, 2.0, xtol=1e-12)
    folds = [b.speed for branch in result.branches for b in branch.bifurcations if b.bifurcation == FOLD]
    assert folds == [pytest.approx(graze, abs=1e-6)]
    assert not any("stopped" in warning for warning in result.warnings)


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
    assert "too few steps" in " ".join(periodic_motion(damper(0.05, 0.3), 0.5, 1.5).warnings)


def test_a_rotor_that_does_not_whirl_and_one_without_mass_and_damping():
    """Overdamped it rests; what motion in time cannot follow is said, the branch is there all the same."""
    result = periodic_motion(one_mass(c=9.0, forces=[CUBIC], weight=1.0), 1.0, 2.0)
    assert result.branches[0].stable.all()
    assert len(result.warnings) == 1
    result = periodic_motion(one_mass(0.0, forces=[CUBIC], weight=1.0, unbalance=0.1), 1.0, 2.0)
    assert "neither mass nor damping" in result.warnings[-1]


@pytest.mark.parametrize(("external", "cubic"), [(20.0, []), (8.0, [CubicSpring(1, "", 0.0, 1.0)])])
def test_the_whirl_that_begins_is_told_by_its_shape(external, cubic):
    """c_i ω / (c_i + c_e): the natural frequency by the speed, which the multiplier does not tell."""
    internal, stiffness, mass = 40.0, 1e5, 5.0
    natural = np.sqrt(stiffness / mass)
    forces = [InternalDamping(1, "", damping=internal), *cubic]
    problem = one_mass(mass, external, stiffness, forces=forces, unbalance=1e-4)
    result = periodic_motion(problem, 1.05 * natural, 1.1 * natural * (1 + external / internal))
    (lost,) = result.branches[0].bifurcations
    assert lost.bifurcation == TORUS
    assert lost.frequency / lost.speed == pytest.approx(internal / (internal + external), rel=1e-4)


def test_time_that_runs_out_leaves_what_is_known(monkeypatch):
    """By a clock that counts how often it is asked: the branch up to there, and what was not sought."""
    clock = iter(range(10**9))
    monkeypatch.setattr(time, "monotonic", lambda: float(next(clock)))
    problem = damper(0.05, 0.30)
    result = periodic_motion(problem, 0.4, 3.0, max_seconds=60)
    (branch,) = result.branches
    assert branch.speeds[0] == 0.4
    assert 0.4 < branch.speeds[-1] < 3.0
    assert "60 s" in result.warnings[0]
    assert any("synchronous branch stopped" in text for text in result.warnings)
    with pytest.raises(ValueError, match="raise --max-seconds"):
        periodic_motion(problem, 0.4, 3.0, max_seconds=1)
