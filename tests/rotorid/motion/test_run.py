"""Motion in time against closed forms, printed numbers and integrations by scipy that are written here."""

import importlib.util

import numpy as np
import pytest
from moving_mass import one_mass
from scipy.integrate import solve_ivp

import fem
import rotorid.base.compiled
from fem import JournalBearing, MuszynskaSeal, Stop
from rotorid.motion import rosenbrock
from rotorid.motion.run import MotionRun, run
from rotorid.motion.steady import begin, steady_end, synchronous_part
from rotorid.motion.system import rotor_system, system

REST = np.zeros(2), np.zeros(2)


def jeffcott(zeta):
    """Of unit mass, stiffness and eccentricity."""
    return one_mass(1.0, 2 * zeta, 1.0, speeds=(0.0, 10.0), unbalance=1.0)


@pytest.mark.parametrize(
    ("zeta", "speeds", "alpha", "size", "speed"),
    [
        (0.0, (0.0, 1.5), 0.001, 47.15624, 1.06821),
        (0.0, (0.0, 1.5), 0.02, 11.14339, 1.30404),
        (0.02, (0.0, 1.5), 0.005, 13.99974, 1.13142),
        (0.02, (2.5, 0.5), 0.005, 12.73528, 0.87777),
        (0.02, (2.5, 0.5), 0.02, 7.52752, 0.73625),
    ],
)
def test_run_up_from_rest_and_run_down_from_steady_motion(zeta, speeds, alpha, size, speed):
    """Largest |z| and the speed where it occurs, between the samples; computed independently in issue 21."""
    made = jeffcott(zeta)
    start = REST if speeds[0] == 0 else begin(made, speeds[0], "steady")[:2]
    motion = run(made, speeds, abs(speeds[1] - speeds[0]) / alpha, start, tolerance=1e-8)
    sizes = abs(motion.z[:, 0])
    k = int(sizes.argmax())
    t = motion.time[k - 2 : k + 3]
    curve = np.polynomial.Polynomial.fit(t, sizes[k - 2 : k + 3], 4)
    top = next(r.real for r in curve.deriv().roots() if abs(r.imag) < 1e-12 and t[1] <= r.real <= t[3])
    largest = curve(top), np.interp(top, motion.time, motion.speed)
    assert largest == pytest.approx((size, speed), rel=1e-6, abs=1e-5)


def test_the_error_falls_with_the_fifth_root_of_the_work():
    """Order 5 of the method, 4 of its estimate."""
    exact = run(jeffcott(0.05), (0.0, 3.0), 30.0, REST, tolerance=1e-13, rate=20.0)
    runs = [run(jeffcott(0.05), (0.0, 3.0), 30.0, REST, tolerance=e, rate=20.0) for e in (1e-5, 1e-9)]
    errors, steps = [abs(one.z - exact.z).max() for one in runs], [one.steps for one in runs]
    assert 4.5 < np.log(errors[0] / errors[1]) / np.log(steps[1] / steps[0]) < 6.0
    assert errors[1] < 1e-8


def test_the_steady_end_on_linear_supports_is_the_response():
    rotor = fem.Rotor(
        length=[0.25] * 4,
        outer_diameter=0.05,
        discs=[fem.Disc(3, 30.0, 0.5, 0.3)],
        supports=[fem.Support(1, ((2e6, 1e5), (-1e5, 4e6)), 2e3), fem.Support(5, 3e6, 1e3)],
        model=fem.Model(rotary_inertia=True, gyroscopic=True),
    )
    speed, unbalance = 200.0, {3: 1e-3 * np.exp(0.4j)}
    made = rotor_system(rotor, speed, 210.0, unbalance=unbalance, gravity=0.0)
    rest = np.zeros(made.size), np.zeros(made.size)
    motion = run(made, (speed, speed), 500 * np.pi / speed, rest, tolerance=1e-9, nodes=[3, 5])
    steady = fem.unbalance_response(rotor, unbalance, [speed])
    x, y = (part[0][[2, 4]] for part in (steady.x, steady.y))
    last = np.exp(1j * motion.turned[-64:, None])
    expected = (x * last).real + 1j * (y * last).real
    np.testing.assert_allclose(motion.z[-64:], expected, atol=1e-6 * abs(expected).max())
    at, X = synchronous_part(motion)
    assert at == pytest.approx(speed)
    np.testing.assert_allclose(X[-1], x, atol=1e-5 * abs(x).max())
    end = steady_end(motion)
    assert end.periodic
    assert end.period * speed == pytest.approx(2 * np.pi)
    assert end.frequency == pytest.approx(speed, rel=1e-4)


def test_a_run_through_knots_of_a_bearing_table():
    """C and K change their slope there: against scipy, which takes them as they are."""
    knots, values = np.array([0.0, 20.0, 35.0, 60.0]), np.array([[3, 900], [1, 1600], [6, 1000], [2, 2500.0]])
    unit, gyroscopic = np.eye(2), 0.1 * np.array([[0, 1], [-1, 0]])

    def at(speed):
        c, k = values[np.searchsorted(knots, speed)]
        return fem.Motion(unit, c * unit + speed * gyroscopic, k * unit, ("x1", "y1"), speed)

    def slope(t, s):
        z, dz = complex(*s[:2]), complex(*s[2:])
        speed = 5 + 27 * t
        c, k = (np.interp(speed, knots, column) for column in values.T)
        push = 1e-3 * (speed**2 - 27j) * np.exp(1j * (5 * t + 13.5 * t * t))
        a = push - (c - 0.1j * speed) * dz - k * z
        return [dz.real, dz.imag, a.real, a.imag]

    table = system(at, knots, unbalance={1: 1e-3})
    motion = run(table, (5.0, 59.0), 2.0, REST, tolerance=1e-9, rate=50.0)
    exact = solve_ivp(
        slope, (0, 2), np.zeros(4), "DOP853", motion.time, rtol=1e-11, atol=1e-14, max_step=0.01
    )
    z = exact.y[0] + 1j * exact.y[1]
    np.testing.assert_allclose(motion.z[:, 0], z, atol=1e-7 * abs(z).max())


SPEED, CLEARANCE = 100.0, 1e-4


def rigid(mass, film="pressure", **more):
    """A rigid rotor in a short bearing at static eccentricity 0.2, mass = m c Ω² / W; 7.18997 is critical."""
    L, D, eta, e = 0.03, 0.1, 0.1, 0.2
    W = eta * SPEED * D * L**3 / 8 / CLEARANCE**2 * e / (1 - e * e) ** 2
    W *= np.sqrt(16 * e * e + np.pi**2 * (1 - e * e))
    bearing = JournalBearing(1, "drive end", L, D, CLEARANCE, eta, film)
    return one_mass(mass * W / CLEARANCE / SPEED**2, forces=[bearing], weight=float(W), **more)


def end_of(mass, film, turns, tolerance=1e-6):
    """How a motion ends that begins 5 µm beside the equilibrium."""
    made = rigid(mass, film)
    q, v, _ = begin(made, SPEED, shift={1: 5e-6})
    return steady_end(run(made, (SPEED, SPEED), turns * 2 * np.pi / SPEED, (q, v), tolerance=tolerance))


def test_below_its_critical_mass_a_rotor_returns_to_rest():
    end = end_of(7.0, "line of centres", 1500)
    assert end.at_rest
    assert end.eccentricity == pytest.approx(np.array([[0.2, 0.2]]))
    soon = end_of(7.0, "pressure", 40)
    assert (soon.steady, soon.trend, soon.periodic) == (False, "decays", False)
    assert soon.change > 0.01


def test_above_its_critical_mass_a_rotor_ends_on_a_limit_cycle():
    """Digits of issue 21; a looser tolerance changes neither amplitude nor frequency by a thousandth."""
    end, loose = (end_of(8.0, "pressure", 800, tolerance) for tolerance in (1e-6, 1e-5))
    assert end.periodic
    assert end.period * SPEED / (2 * np.pi) == pytest.approx(1 / 0.4982, abs=1e-3)
    assert end.whirl_ratio == pytest.approx(0.4982, abs=5e-5)
    assert end.eccentricity == pytest.approx(np.array([[0.8287, 0.8411]]), abs=5e-5)
    assert loose.amplitude == pytest.approx(end.amplitude, rel=1e-3)
    assert loose.frequency == pytest.approx(end.frequency, rel=1e-3)


@pytest.mark.parametrize(("speed", "load", "chaotic"), [(1.1, 1.2, True), (1.6, 0.0, False)])
def test_a_chaotic_rub_is_not_called_steady(speed, load, chaotic):
    """A disc in a stop with friction; the other beats, which is steady, and does not come again either."""
    ring = Stop(1, "", gap=1.0, stiffness=20.0, damping=0.1, friction=0.1)
    made = one_mass(1.0, 0.1, 1.0, forces=[ring], unbalance=0.4, weight=load)
    q, v, _ = begin(made, speed)
    end = steady_end(run(made, (speed, speed), 150 * 2 * np.pi / speed, (q, v)))
    assert np.isnan(end.period)
    assert (end.chaotic, end.steady, end.periodic) == (chaotic, not chaotic, False)


@pytest.mark.parametrize(("damping", "trend"), [(0.01, "decays"), (-0.01, "grows")])
def test_what_dies_down_and_what_grows_are_told_apart(damping, trend):
    start = np.array([1e-3, 0.0]), np.zeros(2)
    end = steady_end(run(one_mass(1.0, damping, 1.0), (2.0, 2.0), 100.0, start))
    assert (end.steady, end.trend) == (False, trend)


def end_of_curve(z, rate=64):
    """The end of a motion of one node that was not computed, z over the angle of rotation."""
    angle = np.linspace(0, 200 * np.pi, 100 * rate + 1)
    values = np.asarray(z(angle), dtype=complex)[:, None]
    made = one_mass(1.0, 0.0, 1.0, unbalance=1.0)
    return steady_end(MotionRun(made, (1,), angle / SPEED, (SPEED, SPEED), values, *REST, 0.0, 1, 1e-6, ""))


@pytest.mark.parametrize(
    ("z", "steady", "trend", "turns"),
    [
        (lambda a: np.exp(1j * a), True, None, 1),
        (lambda a: 2 + np.exp(1j * a) + 0.1 * np.exp(-0.5j * a), True, None, 2),
        (lambda a: np.exp(1j * a) + 0.3 * np.exp(0.4j * a), True, None, 5),
        (lambda a: np.exp(1j * a) + np.exp(0.1j * np.sqrt(26) * a), True, None, None),  # never again
        (lambda a: (1 + 3e-4 * np.sin(a / 40)) * np.exp(1j * a), True, None, 1),
        (lambda a: (1 + np.exp(-a / 200)) * np.exp(1j * a), False, True, None),  # decays
        (lambda a: a / 1e4 + np.exp(1j * a), False, True, None),  # goes aside
        (lambda a: (1 + 0.5 * np.sin(a / 13)) * np.exp(1j * a), False, False, None),  # beats
        (lambda a: a * 0 + 3, True, None, None),
    ],
)
@pytest.mark.parametrize("rate", [64, 9])
def test_what_is_called_steady(z, steady, trend, turns, rate):
    end = end_of_curve(z, rate)
    assert end.steady is steady
    assert trend in (None, bool(end.trend))
    if turns is None:
        assert not end.periodic or end.at_rest
    elif rate > 9:
        assert end.periodic
        assert end.period * end.speed == pytest.approx(2 * np.pi * turns)


@pytest.mark.parametrize("ratio", [1.0, 0.4982, -0.31, 3.0])
def test_the_frequency_of_a_whirl_with_other_lines_beside_it(ratio):
    end = end_of_curve(
        lambda a: np.exp(1j * ratio * a) + 0.4 * np.exp(-1j * ratio * a) + 0.2 * np.exp(0.75j * a)
    )
    assert end.whirl_ratio == pytest.approx(ratio, abs=1e-4)


def test_a_shaft_that_touches_its_wall_stops_the_motion():
    """A seal that drives the whirl: K = 0, the fluid turns faster than the natural frequency."""
    seal = MuszynskaSeal(1, "labyrinth", 0.0, 20.0, 0.0, 0.5, 2e-4, 0.5, 0.0)
    made = one_mass(1.0, 0.0, 1e4, forces=[seal])
    motion = run(made, (400.0, 400.0), 5.0, (np.array([1e-5, 0.0]), np.zeros(2)))
    assert "touches the wall of the annular seal 'labyrinth' at node 1 after" in motion.stopped
    assert "at 3819.72 rpm" in motion.stopped
    assert abs(motion.z).max() == pytest.approx(2e-4, rel=0.05)
    touches = float(motion.stopped.split(" after ")[1].split(" s")[0])
    assert motion.time[-1] <= touches <= motion.time[-1] + motion.time[1] < 1.0
    beyond = run(rigid(7.0), (SPEED, SPEED), 1.0, (np.array([1.2e-4, 0.0]), np.zeros(2)))
    assert "the journal bearing 'drive end' at node 1 after 0 s" in beyond.stopped


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"speeds": (0.0, 50.0)}, "speed 0: the journal bearing 'drive end' at node 1"),
        ({"speeds": (50.0, 2e5)}, "not at 200000 rad/s"),
        ({"time": 0.0}, "time must be above 0"),
        ({"tolerance": 1.0}, "tolerance must be from"),
        ({"rate": 1e9, "time": 100.0}, "more than memory should hold"),
        ({"nodes": [4]}, "node 4 does not move"),
    ],
)
def test_what_is_impossible(change, message):
    options = {"speeds": (50.0, 60.0), "time": 1.0} | change
    with pytest.raises(ValueError, match=message):
        run(rigid(7.0), options.pop("speeds"), options.pop("time"), REST, **options)


def test_what_has_neither_mass_nor_damping():
    M, C, K = np.diag([1.0, 0, 1, 0]), np.zeros((4, 4)), np.eye(4)
    made = system(lambda speed: fem.Motion(M, C, K, ("x1", "x2", "y1", "y2"), speed), np.array([0.0, 1.0]))
    with pytest.raises(ValueError, match=r"[xy]2 has neither mass nor damping"):
        run(made, (0.0, 0.0), 1.0, (np.ones(4), np.zeros(4)))


def test_interpreted_and_compiled_agree(monkeypatch):
    monkeypatch.setattr(rotorid.base.compiled, "COMPILED", False)
    spec = importlib.util.spec_from_file_location("plain_rosenbrock", rosenbrock.__file__)
    plain = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(plain)
    made = rigid(7.5, unbalance=1e-3)
    q, v, _ = begin(made, SPEED)
    compiled = run(made, (SPEED, 2 * SPEED), 0.1, (q, v))
    monkeypatch.setattr("rotorid.motion.run.advance", plain.advance)
    interpreted = run(made, (SPEED, 2 * SPEED), 0.1, (q, v))
    assert compiled.steps == interpreted.steps
    np.testing.assert_allclose(compiled.z, interpreted.z, rtol=1e-9)
