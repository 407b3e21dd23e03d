"""Critical speeds with gyroscopic effect, any supports, tables and pedestals."""

import dataclasses
import math

import numpy as np
import pytest
from fem_rotors import machines, mirrored, rotor23, uniform
from hypothesis import given, settings
from hypothesis import strategies as st

import fem
from fem.assembly import assemble, dense

FULL = fem.Model(shear=True, rotary_inertia=True, gyroscopic=True)


def dense_critical(rotor, speed=0.0):
    """All critical speeds from dense matrices in x and y with pedestals as unknowns."""
    import scipy.linalg

    A = assemble(rotor)
    n, stands = A.size, [s for s in rotor.supports if s.pedestal is not None]
    size = 2 * n + 2 * len(stands)
    K, M = np.zeros((2, size, size), dtype=complex)
    x, y = slice(0, n), slice(n, 2 * n)
    K[x, x] = K[y, y] = dense(A.shaft)
    M[x, x] = M[y, y] = dense(A.mass)
    M[x, y], M[y, x] = -1j * dense(A.gyroscopic), 1j * dense(A.gyroscopic)
    for s in rotor.supports:
        k = s.at(speed)[0]
        k = (k + k.T) / 2
        foot = [A.deflection(s.node), n + A.deflection(s.node)]
        K[np.ix_(foot, foot)] += k
        if s.pedestal is not None:
            own = [2 * n + 2 * stands.index(s), 2 * n + 2 * stands.index(s) + 1]
            K[np.ix_(own, own)] += k + np.diag(s.pedestal.xy("stiffness"))
            K[np.ix_(foot, own)] -= k
            K[np.ix_(own, foot)] -= k
            M[own, own] += s.pedestal.mass
    mu = scipy.linalg.eigh(M, K, eigvals_only=True)
    mu = mu[mu > 1e-13 * mu.max()][::-1]
    return 1 / np.sqrt(mu)


@given(machines(elements=(3, 10), tables=False))
@settings(max_examples=15, deadline=None)
def test_any_rotor_against_dense_matrices_in_both_planes(rotor):
    found = fem.critical_speeds(rotor, 4)
    every = dense_critical(rotor)
    if rotor.symmetric:
        # Forward ones only: each stands in the list of all.
        nearest = [every[np.argmin(np.abs(every - omega))] for omega in found.frequencies]
        np.testing.assert_allclose(found.frequencies, nearest, rtol=1e-7)
        assert set(found.direction) == {"forward"}
    else:
        np.testing.assert_allclose(found.frequencies, every[:4], rtol=1e-7)
    np.testing.assert_allclose(
        fem.critical_speeds(_mirrored(rotor), 4).frequencies, found.frequencies, rtol=1e-7
    )


def _mirrored(rotor):
    last = rotor.n_nodes + 1
    return dataclasses.replace(
        rotor,
        **{
            name: getattr(rotor, name)[::-1]
            for name in (
                "length",
                "outer_diameter",
                "inner_diameter",
                "youngs_modulus",
                "density",
                "poisson_ratio",
                "material_damping",
            )
        },
        discs=[dataclasses.replace(d, node=last - d.node) for d in rotor.discs],
        supports=[dataclasses.replace(s, node=last - s.node) for s in rotor.supports],
    )


@pytest.mark.parametrize("n", [8, 60])
def test_gyroscopic_moment_stiffens_forward_whirl(n):
    """Overhung disc on a massless shaft: closed form of Föppl's 2 × 2 problem."""
    E, L, d, Ip, Id, m = 2.1e11, 0.5, 0.04, 0.3, 0.16, 20.0
    EI = E * math.pi * d**4 / 64
    rotor = fem.Rotor(
        np.full(n, L / n),
        d,
        density=0.0,
        discs=[fem.Disc(n + 1, m, Ip, Id)],
        supports=[fem.Support(1, 1e17, tilting_stiffness=1e17)],
        model=fem.Model(rotary_inertia=True, gyroscopic=True),
    )
    # Compliance of the free end: w = F L³/3EI + Q L²/2EI, θ = F L²/2EI + Q L/EI;
    # F = ω² m w, Q = −ω² (Ip − Id) θ.
    J = Ip - Id
    a, b, c = L**3 / 3 / EI, L**2 / 2 / EI, L / EI
    # The determinant of [[1 − a m q, b J q], [−b m q, 1 + c J q]] = 0 with q = ω².
    roots = np.roots([(b * b - a * c) * m * J, c * J - a * m, 1.0])
    (q,) = roots[roots > 0]
    assert fem.critical_speeds(rotor, 1).frequencies[0] == pytest.approx(math.sqrt(q), rel=1e-8)
    # A thin disc removes the second forward critical speed.
    with pytest.raises(ValueError, match="the model has 1 to 1"):
        fem.critical_speeds(rotor, 2)
    thick = dataclasses.replace(rotor, discs=[fem.Disc(n + 1, m, 0.1, 0.16)])
    assert fem.critical_speeds(thick, 2).frequencies.size == 2


def test_directions_come_in_pairs_on_slightly_different_supports():
    supports = [fem.Support(n, ((1e8, 0), (0, 0.97e8))) for n in (2, 22)]
    rotor = dataclasses.replace(
        rotor23(), supports=supports, discs=[fem.Disc(12, 50.0, 6.0, 3.0)], model=FULL
    )
    modes = fem.critical_speeds(rotor, 4)
    assert modes.direction == ("backward", "forward") * 2
    assert "backward" in modes.summary()
    assert modes.to_dict()["direction"] == ["backward", "forward"] * 2
    assert modes.x.shape == modes.y.shape == modes.shapes.shape == modes.slopes.shape
    plain = dataclasses.replace(rotor, model=fem.Model())
    apart = fem.critical_speeds(plain, 4)
    # Without gyroscopic effect each plane whirls alone, in straight lines.
    assert set(apart.direction) == {"mixed"}
    assert (np.minimum(np.abs(apart.x).max(axis=0), np.abs(apart.y).max(axis=0)) < 1e-6).all()
    alone = [
        fem.critical_speeds(
            dataclasses.replace(plain, supports=[fem.Support(n, k) for n in (2, 22)]), 2
        ).frequencies
        for k in (0.97e8, 1e8)
    ]
    np.testing.assert_allclose(apart.frequencies, np.sort(np.concatenate(alone)), rtol=1e-10)


def test_supports_turned_by_an_angle_change_nothing():
    c, s = math.cos(0.4), math.sin(0.4)
    turn = np.array([[c, -s], [s, c]])
    rotor = dataclasses.replace(rotor23(), discs=[fem.Disc(12, 50.0, 6.0, 3.0)], model=FULL)

    def on(k):
        return dataclasses.replace(rotor, supports=[fem.Support(n, k) for n in (2, 22)])

    straight = fem.critical_speeds(on(np.diag([1e8, 3e7])), 5)
    turned = fem.critical_speeds(on(turn @ np.diag([1e8, 3e7]) @ turn.T), 5)
    np.testing.assert_allclose(turned.frequencies, straight.frequencies, rtol=1e-9)
    assert turned.direction == straight.direction


@pytest.mark.parametrize("kind", ["isotropic", "anisotropic"])
def test_bearing_tables_are_read_at_the_critical_speed(kind):
    speeds = np.linspace(0, 3000, 31)

    def k(omega):
        stiff = 2e7 + 3e4 * omega
        return stiff if kind == "isotropic" else ((stiff, 0.0), (0.0, 0.6 * stiff))

    def on(stiffness, **others):
        return dataclasses.replace(
            rotor23(), supports=[fem.Support(n, stiffness, **others) for n in (2, 22)], model=FULL
        )

    modes = fem.critical_speeds(on([k(v) for v in speeds], speeds=speeds), 4)
    assert (np.diff(modes.frequencies) > 0).all()
    for i, omega in enumerate(modes.frequencies):
        fixed = fem.critical_speeds(on(k(omega)), 4)
        assert fixed.frequencies[i] == pytest.approx(omega, rel=1e-10)
        np.testing.assert_allclose(modes.shapes[:, i], fixed.shapes[:, i], rtol=0, atol=1e-6)


def test_where_a_table_ends_is_said():
    def on(first, last):
        return dataclasses.replace(
            rotor23(),
            supports=[fem.Support(n, [5e7, 6e7], speeds=[first, last], name="left") for n in (2, 22)],
        )

    some = fem.critical_speeds(on(50.0, 300.0), 3)
    assert some.frequencies == pytest.approx(fem.critical_speeds(on(50.0, 300.0), 1).frequencies)
    assert "only 1 of 3 critical speeds between 50 and 300 rad/s" in some.warnings[0]
    assert fem.mesh_check(on(50.0, 300.0), 3).frequencies == pytest.approx(some.frequencies)
    with pytest.raises(ValueError, match=r"no critical speed lies between 10 and 60 rad/s"):
        fem.critical_speeds(on(10.0, 60.0), 1)
    with pytest.raises(ValueError, match=r"lowest natural frequency at 200 rad/s is .*: extend the tables"):
        fem.critical_speeds(on(200.0, 250.0), 1)
    late = fem.critical_speeds(on(200.0, 900.0), 1)
    assert 200 < late.frequencies[0] < 900
    assert "critical speeds below the tables are not known" in late.warnings[0]
    with pytest.raises(ValueError, match="no speed in common"):
        fem.critical_speeds(
            dataclasses.replace(
                rotor23(),
                supports=[
                    fem.Support(2, 1e8, speeds=[0, 10]),
                    fem.Support(22, 1e8, speeds=[20, 30]),
                ],
            )
        )


def test_a_massless_pedestal_is_a_spring_in_series():
    stand = fem.Pedestal(0.0, 3e8)
    on_stand = dataclasses.replace(
        rotor23(), supports=[fem.Support(n, 2e8, pedestal=stand) for n in (2, 22)], model=FULL
    )
    series = dataclasses.replace(on_stand, supports=[fem.Support(n, 1.2e8) for n in (2, 22)])
    a, b = fem.critical_speeds(on_stand), fem.critical_speeds(series)
    np.testing.assert_allclose(a.frequencies, b.frequencies, rtol=1e-10)
    np.testing.assert_allclose(a.shapes, b.shapes, atol=1e-7)


@pytest.mark.parametrize("n", [12, 60])
def test_free_and_barely_held_rotors_whirl(n):
    free = fem.critical_speeds(uniform(n, model=FULL), 4)
    assert (free.frequencies[:2] == 0).all()
    still = fem.critical_speeds(uniform(n, model=dataclasses.replace(FULL, gyroscopic=False)), 4)
    assert (free.frequencies[2:] > still.frequencies[2:]).all()
    soft = fem.critical_speeds(
        uniform(n, model=FULL, supports=[fem.Support(k, ((2.0, 0), (0, 1.0))) for k in (1, n + 1)]), 6
    )
    mass = 7850 * math.pi / 4 * 0.01
    np.testing.assert_allclose(soft.frequencies[:2] ** 2, [2 / mass, 4 / mass], rtol=1e-3)
    assert soft.frequencies[5] == pytest.approx(
        fem.critical_speeds(uniform(n, model=FULL, supports=[]), 3).frequencies[2], rel=1e-5
    )
    one_way = uniform(n, model=FULL, supports=[fem.Support(k, ((1e8, 0), (0, 0))) for k in (1, n + 1)])
    held_in_x = fem.critical_speeds(one_way, 4)
    assert (held_in_x.frequencies[:2] == 0).all()
    assert held_in_x.frequencies[2] > 100


@given(machines(elements=(3, 10), tables=False), st.floats(0.1, 10.0))
@settings(max_examples=12, deadline=None)
def test_units_do_not_matter(rotor, factor):
    """Another unit of mass: every kg is `factor` of it, newtons and stiffness follow."""

    def scaled(value):
        return (
            value * factor if isinstance(value, float) else tuple(tuple(e * factor for e in r) for r in value)
        )

    def stand(p):
        if p is None:
            return None
        both = [np.multiply(p.xy(name), factor).tolist() for name in ("stiffness", "damping")]
        return fem.Pedestal(p.mass * factor, tuple(both[0]), tuple(both[1]))

    other = dataclasses.replace(
        rotor,
        youngs_modulus=rotor.youngs_modulus * factor,
        density=rotor.density * factor,
        discs=[
            fem.Disc(d.node, d.mass * factor, d.polar_inertia * factor, d.diametral_inertia * factor)
            for d in rotor.discs
        ],
        supports=[
            fem.Support(s.node, scaled(s.stiffness), scaled(s.damping), pedestal=stand(s.pedestal))
            for s in rotor.supports
        ],
    )
    np.testing.assert_allclose(
        fem.critical_speeds(other, 3).frequencies, fem.critical_speeds(rotor, 3).frequencies, rtol=1e-8
    )


@given(machines(elements=(3, 8), tables=False))
@settings(max_examples=12, deadline=None)
def test_splitting_elements_changes_nothing_beyond_the_rate(rotor):
    check = fem.mesh_check(rotor, 2)
    finer = fem.critical_speeds(fem.refined(rotor, 3), 2).frequencies
    bound = np.maximum(3 * np.abs(check.errors), 1e-8)
    assert (np.abs(finer / check.frequencies - 1) <= bound).all()


def test_mirroring_is_symmetric_for_the_reference_rotor():
    np.testing.assert_allclose(
        fem.critical_speeds(mirrored(rotor23())).frequencies,
        fem.critical_speeds(rotor23()).frequencies,
        rtol=1e-10,
    )


def test_ignored_inertia_names_what_is_missing():
    disc = fem.Disc(2, 1.0, 0.2, 0.1)

    def warnings(**flags):
        rotor = fem.Rotor(
            [0.5, 0.5],
            0.05,
            discs=[disc],
            supports=[fem.Support(1, 1e8), fem.Support(3, 1e8)],
            model=fem.Model(**flags),
        )
        return fem.critical_speeds(rotor, 1).warnings

    polar = "disc at node 2: polar inertia is ignored, the model has no gyroscopic effect"
    assert warnings()[1] == polar
    assert warnings(rotary_inertia=True) == (polar,)
    assert "diametral inertia is ignored" in warnings(gyroscopic=True)[0]
    assert warnings(gyroscopic=True, rotary_inertia=True) == ()


def on_ends(lengths):
    """A shaft on two springs."""
    ends = [fem.Support(1, 1e8), fem.Support(len(lengths) + 1, 1e8)]
    return fem.Rotor(lengths, 0.05, supports=ends)


def test_an_element_of_a_thousandth_of_its_neighbour_is_computed():
    fine = fem.critical_speeds(on_ends([0.05] * 20), 2).frequencies
    short = [0.05] * 10 + [5e-5, 0.05 - 5e-5] + [0.05] * 9
    np.testing.assert_allclose(fem.critical_speeds(on_ends(short), 2).frequencies, fine, rtol=1e-8)


@pytest.mark.parametrize("lengths", [[0.25, 1e-9, 0.25], [8e-5, 0.25], [0.25, 1e-9, 1e-9, 0.25]])
def test_much_shorter_elements_are_refused(lengths):
    with pytest.raises(ValueError, match=r"element [12]: length .* 1/3000 of its longer neighbour"):
        on_ends(lengths)
