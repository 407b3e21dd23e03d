"""Motion in time against closed forms, printed numbers and integrations by scipy that are written here."""

import importlib.util

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import fem
from fem import CubicSpring, JournalBearing, MuszynskaSeal, Stop
from rotorid.motion.run import MotionRun, run
from rotorid.motion.steady import begin, steady_end, synchronous_part
from rotorid.motion.system import system

REST = np.zeros(2), np.zeros(2)


def one_mass(m, c, k, speeds=(0.0, 1e4), **more):
    """A mass with the same damping and stiffness in both directions."""
    unit = np.eye(2)
    return system(
        lambda speed: fem.Motion(m * unit, c * unit, k * unit, ("x1", "y1"), speed), np.array(speeds), **more
    )


def jeffcott(zeta):
    """Of unit mass, stiffness and eccentricity."""
    return one_mass(1.0, 2 * zeta, 1.0, (0.0, 10.0), unbalance={1: 1.0})


def largest(motion):
    """Largest |z| and the speed where it occurs, between the samples."""
    size = np.abs(motion.z[:, 0])
    k = int(size.argmax())
    t = motion.time[k - 2 : k + 3]
    curve = np.polynomial.Polynomial.fit(t, size[k - 2 : k + 3], 4)
    top = next(r.real for r in curve.deriv().roots() if abs(r.imag) < 1e-12 and t[1] <= r.real <= t[3])
    return curve(top), np.interp(top, motion.time, motion.speed)


@pytest.mark.parametrize(
    ("zeta", "alpha", "size", "speed"),
    [
        (0.0, 0.001, 47.15624, 1.06821),
        (0.0, 0.005, 21.51865, 1.15244),
        (0.0, 0.02, 11.14339, 1.30404),
        (0.02, 0.001, 20.28373, 1.04919),
        (0.02, 0.005, 13.99974, 1.13142),
        (0.02, 0.02, 8.93333, 1.28490),
    ],
)
def test_run_up_of_a_jeffcott_rotor(zeta, alpha, size, speed):
    # issue 21: computed independently
    found = run(jeffcott(zeta), (0.0, 1.5), 1.5 / alpha, REST, tolerance=1e-8)
    assert largest(found) == pytest.approx((size, speed), rel=1e-6, abs=1e-5)


@pytest.mark.parametrize(
    ("alpha", "size", "speed"),
    [(0.001, 19.36986, 0.95432), (0.005, 12.73528, 0.87777), (0.02, 7.52752, 0.73625)],
)
def test_run_down_of_a_jeffcott_rotor_from_steady_motion(alpha, size, speed):
    rotor = jeffcott(0.02)
    q, v, _ = begin(rotor, 2.5, "steady")
    found = run(rotor, (2.5, 0.5), 2.0 / alpha, (q, v), tolerance=1e-8)
    assert largest(found) == pytest.approx((size, speed), rel=1e-6, abs=1e-5)


def test_the_error_falls_with_the_fifth_root_of_the_work():
    # order 5 of the method, 4 of its estimate: a tolerance 1e-5 times as large takes ten times as many steps
    rotor = jeffcott(0.05)
    exact = run(rotor, (0.0, 3.0), 30.0, REST, tolerance=1e-13, rate=20.0)
    errors, steps = [], []
    for tolerance in (1e-5, 1e-7, 1e-9):
        found = run(rotor, (0.0, 3.0), 30.0, REST, tolerance=tolerance, rate=20.0)
        errors.append(np.abs(found.z - exact.z).max())
        steps.append(found.steps)
    order = np.log(errors[0] / errors[2]) / np.log(steps[2] / steps[0])
    assert 4.5 < order < 6.0
    assert errors[2] < 1e-8


def test_energy_of_a_free_rotor_is_kept():
    m, k = 3.0, 2e5
    free = one_mass(m, 0.0, k, forces=[CubicSpring(1, "", 0.0, 5e10)])
    q, v = np.array([1e-3, 2e-4]), np.array([0.1, -0.3])

    def energy(q, v):
        r2 = q @ q
        return m / 2 * v @ v + k / 2 * r2 + 5e10 / 4 * r2**2

    found = run(free, (0.0, 0.0), 1.0, (q, v), tolerance=1e-11)
    assert energy(found.q, found.v) == pytest.approx(energy(q, v), rel=1e-8)


def rotor():
    return fem.Rotor(
        length=[0.25] * 4,
        outer_diameter=0.05,
        discs=[fem.Disc(3, 30.0, 0.5, 0.3)],
        supports=[fem.Support(1, ((2e6, 1e5), (-1e5, 4e6)), 2e3), fem.Support(5, 3e6, 1e3)],
        model=fem.Model(rotary_inertia=True, gyroscopic=True),
    )


def test_the_steady_end_on_linear_supports_is_the_response():
    from fem import unbalance_response
    from rotorid.motion.system import rotor_system

    speed, unbalance = 200.0, {3: 1e-3 * np.exp(0.4j)}
    made = rotor_system(rotor(), speed, 210.0, unbalance=unbalance, gravity=0.0)
    turn = 2 * np.pi / speed
    at_rest = np.zeros(made.size)
    found = run(made, (speed, speed), 250 * turn, (at_rest, at_rest), tolerance=1e-9, nodes=[3, 5])
    steady = unbalance_response(rotor(), unbalance, [speed])
    x, y = ([part[0][node - 1] for node in (3, 5)] for part in (steady.x, steady.y))
    last = np.exp(1j * found.turned[-64:, None])
    expected = (x * last).real + 1j * (y * last).real
    np.testing.assert_allclose(found.z[-64:], expected, atol=1e-6 * np.abs(expected).max())
    at, X = synchronous_part(found)
    assert at == pytest.approx(speed)
    np.testing.assert_allclose(X[-1], x, atol=1e-5 * np.abs(x).max())
    end = steady_end(found)
    assert end.periodic
    assert end.period * speed == pytest.approx(2 * np.pi)
    assert end.frequency == pytest.approx(speed, rel=1e-4)


def test_a_run_through_knots_of_a_bearing_table():
    # C and K change their slope there: against scipy, which takes them as they are
    unit = np.eye(2)
    rows = {0.0: (3.0, 900.0), 20.0: (1.0, 1600.0), 35.0: (6.0, 1000.0), 60.0: (2.0, 2500.0)}
    gyroscopic = 0.1 * np.array([[0, 1], [-1, 0]])

    def at(speed):
        c, k = rows[speed]
        return fem.Motion(unit, c * unit + speed * gyroscopic, k * unit, ("x1", "y1"), speed)

    table = system(at, np.array(sorted(rows)), unbalance={1: 1e-3})
    knots, values = np.array(sorted(rows)), np.array([rows[speed] for speed in sorted(rows)])

    def slope(t, s):
        z, dz = complex(*s[:2]), complex(*s[2:])
        speed = 5 + 27 * t
        c, k = (np.interp(speed, knots, column) for column in values.T)
        push = 1e-3 * (speed**2 - 27j) * np.exp(1j * (5 * t + 13.5 * t * t))
        a = push - (c - 0.1j * speed) * dz - k * z
        return [dz.real, dz.imag, a.real, a.imag]

    found = run(table, (5.0, 59.0), 2.0, REST, tolerance=1e-9, rate=50.0)
    exact = solve_ivp(slope, (0, 2), np.zeros(4), "DOP853", found.time, rtol=1e-11, atol=1e-14, max_step=0.01)
    z = exact.y[0] + 1j * exact.y[1]
    np.testing.assert_allclose(found.z[:, 0], z, atol=1e-7 * np.abs(z).max())


SPEED, CLEARANCE = 100.0, 1e-4


def rigid(mass, film, **more):
    """A rigid rotor in a short bearing at static eccentricity 0.2, mass = m c Ω² / W."""
    L, D, eta, e = 0.03, 0.1, 0.1, 0.2
    W = eta * SPEED * D * L**3 / 8 / CLEARANCE**2 * e / (1 - e * e) ** 2
    W *= np.sqrt(16 * e * e + np.pi**2 * (1 - e * e))
    bearing = JournalBearing(1, "drive end", L, D, CLEARANCE, eta, film)
    return one_mass(mass * W / CLEARANCE / SPEED**2, 0.0, 0.0, forces=[bearing], weight={"y1": -W}, **more)


def moved(mass, film, turns, tolerance=1e-6, by=5e-6, **more):
    made = rigid(mass, film, **more)
    q, v, _ = begin(made, SPEED, shift={1: by})
    return run(made, (SPEED, SPEED), turns * 2 * np.pi / SPEED, (q, v), tolerance=tolerance)


@pytest.mark.parametrize("film", ["pressure", "line of centres"])
def test_below_its_critical_mass_a_rotor_returns_to_rest(film):
    # 7.18997 is critical
    end = steady_end(moved(7.0, film, 1500))
    assert end.at_rest
    assert end.eccentricity == pytest.approx(np.array([[0.2, 0.2]]))


def test_above_its_critical_mass_a_rotor_ends_on_a_limit_cycle():
    # issue 21; a looser tolerance changes neither amplitude nor frequency by a thousandth
    ends = [steady_end(moved(8.0, "pressure", 800, tolerance)) for tolerance in (1e-6, 1e-5)]
    for end in ends:
        assert end.periodic
        assert end.period * SPEED / (2 * np.pi) == pytest.approx(1 / 0.4982, abs=1e-3)
    assert ends[0].whirl_ratio == pytest.approx(0.4982, abs=5e-5)
    assert ends[0].eccentricity == pytest.approx(np.array([[0.8287, 0.8411]]), abs=5e-5)
    assert ends[1].amplitude == pytest.approx(ends[0].amplitude, rel=1e-3)
    assert ends[1].frequency == pytest.approx(ends[0].frequency, rel=1e-3)


def test_the_end_is_not_called_steady_while_it_changes():
    end = steady_end(moved(7.0, "pressure", 40))
    assert not end.steady
    assert end.trend == "decays"
    assert not end.periodic
    assert end.change > 0.01


@pytest.mark.parametrize(
    ("speed", "load", "chaotic"), [(1.1, 1.2, True), (0.9, 0.5, True), (1.6, 0.0, False), (2.4, 0.0, False)]
)
def test_a_chaotic_rub_is_not_called_steady(speed, load, chaotic):
    """A disc in a stop with friction; the others beat, which is steady, and do not come again either."""
    ring = Stop(1, "", gap=1.0, stiffness=20.0, damping=0.1, friction=0.1)
    made = one_mass(1.0, 0.1, 1.0, forces=[ring], unbalance={1: 0.4}, weight={"y1": -load})
    q, v, _ = begin(made, speed)
    end = steady_end(run(made, (speed, speed), 150 * 2 * np.pi / speed, (q, v)))
    assert np.isnan(end.period)
    assert end.chaotic is chaotic
    assert end.steady is not chaotic
    assert not end.periodic


@pytest.mark.parametrize(("damping", "trend"), [(0.01, "decays"), (-0.01, "grows")])
def test_what_dies_down_and_what_grows_are_told_apart(damping, trend):
    made = one_mass(1.0, damping, 1.0)
    end = steady_end(run(made, (2.0, 2.0), 100.0, (np.array([1e-3, 0.0]), np.zeros(2))))
    assert not end.steady
    assert end.trend == trend


def told(z, turns=100.0, speed=100.0, rate=64):
    """A motion of one node that was not computed, z over the angle of rotation."""
    angle = np.linspace(0, 2 * np.pi * turns, int(rate * turns) + 1)
    made = one_mass(1.0, 0.0, 1.0, unbalance={1: 1.0})
    values = np.asarray(z(angle), dtype=complex)[:, None]
    rest = np.zeros(2)
    return MotionRun(made, (1,), angle / speed, (speed, speed), values, rest, rest, 0.0, 1, 1e-6, "")


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
    end = steady_end(told(z, rate=rate))
    assert end.steady is steady
    if trend is not None:
        assert bool(end.trend) is trend
    if turns is None:
        assert not end.periodic or end.at_rest
    elif rate > 9:
        assert end.periodic
        assert end.period * end.speed == pytest.approx(2 * np.pi * turns)


@pytest.mark.parametrize("ratio", [1.0, 0.4982, -1.0, -0.31, 3.0, 0.27123])
def test_the_frequency_of_a_whirl_with_other_lines_beside_it(ratio):
    end = steady_end(
        told(lambda a: np.exp(1j * ratio * a) + 0.4 * np.exp(-1j * ratio * a) + 0.2 * np.exp(0.75j * a))
    )
    assert end.whirl_ratio == pytest.approx(ratio, abs=1e-4)


@pytest.mark.full
def test_three_masses_in_two_bearings_without_mass():
    # against scipy, where the velocities of the journals follow from the balance of forces; the issue: 1e-4
    L, D, c, eta = 0.05, 0.11, 1.5e-4, 0.02
    m, W, k, e = 40.0, 40.0 * 9.81, 2e7, 2e-5
    K = k * np.array(
        [[2, -2, 0, 0, 0], [-2, 3, -1, 0, 0], [0, -1, 2, -1, 0], [0, 0, -1, 3, -2], [0, 0, 0, -2, 2]]
    )
    M = m * np.diag([0.0, 1.0, 1.0, 1.0, 0.0])
    two = np.kron(np.eye(2), K), np.kron(np.eye(2), M)
    names = tuple(f"{axis}{node}" for axis in "xy" for node in range(1, 6))
    made = system(
        lambda speed: fem.Motion(two[1], 30.0 * np.kron(np.eye(2), M / m), two[0], names, speed),
        np.array([50.0, 900.0]),
        forces=[JournalBearing(node, "", L, D, c, eta) for node in (1, 5)],
        weight={f"y{node}": -W for node in (2, 3, 4)},
        unbalance={3: m * e},
    )
    first, last, time = 100.0, 300.0, 0.15
    q, v, _ = begin(made, first)
    found = run(made, (first, last), time, (q, v))
    alpha = (last - first) / time

    nodes, weights = np.polynomial.legendre.leggauss(64)

    def film(direction, z):
        """Force of a film that a journal presses with unit velocity, by quadrature of its pressure."""
        phi = nodes * np.pi / 2
        h = c - (z * np.exp(-1j * (phi + direction))).real
        pressure = eta * L**3 * np.cos(phi) / h**3
        return -D / 2 * np.sum(weights * np.pi / 2 * pressure * np.exp(1j * (phi + direction)))

    def velocity(z, speed, force):
        """Of a journal whose film must carry a force: it depends on z' − i Ω z / 2 alone, and in scale."""
        direction = np.angle(force)
        for _ in range(200):
            miss = np.angle(-film(direction, z) / force)
            direction -= miss
            if abs(miss) < 1e-13:
                break
        return np.abs(force / film(direction, z)) * np.exp(1j * direction) + 0.5j * speed * z

    def slope(t, s):
        z, dz = s[:5] + 1j * s[5:10], np.zeros(5, dtype=complex)
        dz[1:4] = s[10:13] + 1j * s[13:16]
        speed, phi, elastic = first + alpha * t, first * t + alpha * t * t / 2, -K @ z
        for j in (0, 4):
            dz[j] = velocity(z[j], speed, elastic[j])
        a = elastic[1:4] / m - 30.0 * dz[1:4] / m - 9.81j
        a[1] += e * (speed**2 - 1j * alpha) * np.exp(1j * phi)
        return np.concatenate([dz.real, dz.imag, a.real, a.imag])

    s0 = np.concatenate([q[:5], q[5:], v[1:4], v[6:9]])
    exact = solve_ivp(slope, (0, time), s0, "LSODA", found.time[::50], rtol=1e-8, atol=1e-12)
    z = (exact.y[:5] + 1j * exact.y[5:10]).T
    assert np.abs(found.z[::50] - z).max() < 1e-5 * np.abs(z).max()


def test_a_shaft_that_touches_its_wall_stops_the_motion():
    # a seal that drives the whirl: K = 0, D e growing as the fluid turns faster than the natural frequency
    seal = MuszynskaSeal(1, "labyrinth", 0.0, 20.0, 0.0, 0.5, 2e-4, 0.5, 0.0)
    made = one_mass(1.0, 0.0, 1e4, forces=[seal])
    found = run(made, (400.0, 400.0), 5.0, (np.array([1e-5, 0.0]), np.zeros(2)))
    assert "touches the wall of the annular seal 'labyrinth' at node 1 after" in found.stopped
    assert "at 3819.72 rpm" in found.stopped
    assert found.time[-1] < 1.0
    assert np.isfinite(found.z).all()
    assert np.abs(found.z).max() == pytest.approx(2e-4, rel=0.05)
    touches = float(found.stopped.split(" after ")[1].split(" s")[0])
    assert found.time[-1] <= touches <= found.time[-1] + found.time[1]


def test_a_motion_that_begins_beyond_a_wall_ends_at_once():
    found = run(rigid(7.0, "pressure"), (SPEED, SPEED), 1.0, (np.array([1.2e-4, 0.0]), np.zeros(2)))
    assert "the journal bearing 'drive end' at node 1 after 0 s" in found.stopped


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
    given = {"speeds": (50.0, 60.0), "time": 1.0} | change
    with pytest.raises(ValueError, match=message):
        run(rigid(7.0, "pressure"), given.pop("speeds"), given.pop("time"), REST, **given)


def test_what_has_neither_mass_nor_damping():
    M, C, K = np.diag([1.0, 0, 1, 0]), np.zeros((4, 4)), np.eye(4)
    made = system(lambda speed: fem.Motion(M, C, K, ("x1", "x2", "y1", "y2"), speed), np.array([0.0, 1.0]))
    with pytest.raises(ValueError, match=r"[xy]2 has neither mass nor damping"):
        run(made, (0.0, 0.0), 1.0, (np.ones(4), np.zeros(4)))


def test_interpreted_and_compiled_agree(monkeypatch):
    import rotorid.base.compiled
    import rotorid.motion.rosenbrock as compiled

    monkeypatch.setattr(rotorid.base.compiled, "COMPILED", False)
    spec = importlib.util.spec_from_file_location("plain_rosenbrock", compiled.__file__)
    plain = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(plain)
    made = rigid(7.5, "pressure", unbalance={1: 1e-3})
    q, v, _ = begin(made, SPEED)
    found = [run(made, (SPEED, 2 * SPEED), 0.1, (q, v))]
    monkeypatch.setattr("rotorid.motion.run.advance", plain.advance)
    found.append(run(made, (SPEED, 2 * SPEED), 0.1, (q, v)))
    assert found[0].steps == found[1].steps
    np.testing.assert_allclose(found[0].z, found[1].z, rtol=1e-9)
