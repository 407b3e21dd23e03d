"""Small models for motion against the rotors that they stand for."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

import fem
from fem import GRAVITY, CubicSpring, JournalBearing, SqueezeFilm, Stop, static_deflection
from rotorid.files import read_rotor
from rotorid.motion.equilibrium import equilibrium
from rotorid.motion.system import rotor_system
from rotorid.reduction import SmallModel, held_rigidly, keep_supports, reduce, small_model
from rotorid.samples import sample_data
from tests.helpers.cases import each_of
from tests.helpers.fem_rotors import rotor23

NODES = (7, 12, 18)


def journal(node):
    return JournalBearing(node, "", 0.05, 0.11, 1.5e-4, 0.004)


def reduced(rotor, nodes=NODES, **how):
    masses = reduce(held_rigidly(rotor), nodes).masses.solution
    return keep_supports(rotor, nodes, masses, **how)


def on_films():
    return replace(rotor23(), supports=(), forces=[journal(2), journal(22)])


def test_forces_at_kept_nodes_bend_it_as_the_whole_shaft():
    model, springs = reduced(on_films()), {2: 3e7, 22: 5e7}
    held = replace(rotor23(), supports=[fem.Support(node, k) for node, k in springs.items()])
    K = model.stiffness.copy()
    for node, k in springs.items():
        K[model.nodes.index(node), model.nodes.index(node)] += k
    np.testing.assert_allclose(np.linalg.inv(K), fem.compliance(held, model.nodes), rtol=1e-9, atol=1e-19)


@pytest.mark.parametrize("three", [False, True])
def test_bearings_carry_the_weight_that_they_carry_in_the_rotor(three):
    """Of a shaft on three bearings, too, where the weight alone does not say what each carries."""
    supports = [fem.Support(2, 3e7), fem.Support(22, 5e7), *([fem.Support(10, 2e7)] if three else [])]
    rotor = replace(rotor23(), supports=supports)
    full, model = static_deflection(rotor), reduced(rotor)
    made = rotor_system(model, 0.0, 100.0)
    q = np.linalg.solve(made.K[0], made.weight)
    for k, support in enumerate(supports):
        _, y = made.index(support.node)
        assert -support.stiffness * q[y] == pytest.approx(full.reaction_y[k], rel=1e-9)
    for node in model.nodes:
        x, y = made.index(node)
        assert q[y] == pytest.approx(full.y[node - 1], rel=1e-9)
        assert abs(q[x]) < 1e-18
    moon = rotor_system(model, 0.0, 100.0, gravity=1.62, direction=0.0)
    np.testing.assert_allclose(moon.weight[: len(model.nodes)] * GRAVITY, -1.62 * made.weight[5 + three :])


def test_mass_and_centre_of_mass_are_the_rotor_s():
    rotor = rotor23()
    left, length = rotor.positions[:-1], rotor.length
    shaft = 7800 * np.pi / 4 * rotor.outer_diameter**2 * length
    total = shaft.sum() + sum(disc.mass for disc in rotor.discs)
    moment = shaft @ (left + length / 2) + sum(d.mass * rotor.positions[d.node - 1] for d in rotor.discs)
    for supports, nodes in (((2, 22), NODES), ((2, 10, 22), (6, 13, 17)), ((1, 4, 15, 24), NODES)):
        turned = replace(rotor, supports=[fem.Support(node, 1e8) for node in supports])
        model = reduced(turned, nodes)
        at = rotor.positions[np.array(model.nodes) - 1]
        assert model.masses.sum() == pytest.approx(total, rel=1e-12)
        assert model.weight.sum() == pytest.approx(GRAVITY * total, rel=1e-12)
        assert model.masses @ at == pytest.approx(moment, rel=1e-12)
        assert model.weight @ at == pytest.approx(GRAVITY * moment, rel=1e-10)
        assert (model.masses > 0).all()
        assert model.warnings == ()
    model = reduced(replace(rotor, supports=[fem.Support(2, 1e8), fem.Support(22, 1e8)]), (7, 18))
    assert (model.masses > 0).all()
    assert model.masses.sum() > 1.1 * total
    assert "too large to leave some for the supports" in model.warnings[0]


def test_nodes_beside_the_bearings_leave_them_a_mass():
    """Static condensation lets the bearings carry less than nothing there."""
    model = reduced(replace(rotor23(), supports=[fem.Support(2, 1e7), fem.Support(22, 1e7)]), (3, 12, 21))
    assert (model.weight[[0, -1]] < 0).all()
    assert (model.masses > 0).all()


def test_held_rigidly_is_a_simply_supported_shaft():
    shaft = fem.Rotor([0.05] * 40, 0.05, forces=[journal(1), SqueezeFilm(41, "", 0.05, 0.05, 1e-4, 0.01)])
    first = fem.critical_speeds(held_rigidly(shaft), 2).frequencies
    wave = np.sqrt(2.1e11 * np.pi / 64 * 0.05**4 / (7800 * np.pi / 4 * 0.05**2))
    np.testing.assert_allclose(first, np.array([1, 4]) * (np.pi / 2.0) ** 2 * wave, rtol=2e-6)


def test_threshold_and_static_loads_in_journal_bearings_are_the_rotor_s():
    """At each speed the equilibrium, then all eigenvalues of what is linear about it, of both."""
    rotor = read_rotor(sample_data() / "motion" / "rotor.toml")
    model = reduced(rotor)
    band = 600.0, 720.0
    both = [rotor_system(rotor, *band), rotor_system(model, *band)]

    def growth(speed, system):
        q = equilibrium(system, speed).q
        C, K = system.linear(speed)
        _, F_q, F_v, _ = system.acting(q, np.zeros_like(q), speed)
        eye, zero = np.eye(q.size), np.zeros((q.size, q.size))
        A = np.block([[zero, eye], [np.linalg.solve(system.M, F_q - K), np.linalg.solve(system.M, F_v - C)]])
        return np.linalg.eigvals(A).real.max()

    full, small = (brentq(growth, *band, args=(system,), xtol=1e-4) for system in both)
    assert full == pytest.approx(6407.0 * np.pi / 30, rel=1e-5)
    assert small == pytest.approx(full, rel=2e-4)
    loads = [equilibrium(system, 650.0) for system in both]
    np.testing.assert_allclose(loads[1].load, loads[0].load, rtol=1e-9)
    np.testing.assert_allclose(loads[1].eccentricity, loads[0].eccentricity, rtol=1e-8)


def test_gyroscopic_effect_supports_and_pedestals_are_those_of_the_small_rotor():
    discs = [fem.Disc(4, 30.0, 0.6, 0.3), fem.Disc(8, 20.0, 0.4, 0.2)]
    stand = fem.Pedestal(20.0, (3e8, 2e8), 1e3)
    table = ((1e7, 2e6), (-2e6, 2e7)), ((3e7, 2e6), (-2e6, 2e7))
    rotor = fem.Rotor(
        [0.15] * 10,
        0.08,
        discs=discs,
        supports=[
            fem.Support(1, 2e7, ((3e3, 50.0), (80.0, 5e3)), tilting_stiffness=1e5),
            fem.Support(11, table, 2e3, speeds=(0.0, 500.0), pedestal=stand),
            fem.Support(8, ((0.0, 1e6), (-1e6, 0.0)), 5e2, kind="seal"),
        ],
        material_damping=1e-5,
        model=fem.Model(shear=True, rotary_inertia=True, gyroscopic=True),
    )
    model, twin = reduced(rotor, (4, 8)), small_model(rotor, (4, 8), (1.0, 1.0))
    assert any("slopes that follow" in text for text in model.warnings)
    for speed in (0.0, 300.0):
        mine, theirs = model.motion(speed), twin.motion(speed)
        order = [mine.index(name) for name in theirs.coordinates]
        assert sorted(order) == list(range(len(mine.coordinates)))
        for name in "CK":
            own, other = getattr(mine, name)[np.ix_(order, order)], getattr(theirs, name)
            np.testing.assert_allclose(own, other, rtol=1e-12, atol=1e-12 * np.abs(other).max())
    assert mine.M[mine.index("foot_y2"), mine.index("foot_y2")] == 20.0
    assert np.array_equal(rotor_system(model, 100.0, 700.0 - 200.0).knots, [100.0, 500.0])
    assert np.array_equal(rotor_system(model, 0.0, 400.0).knots, [0.0, 400.0])


def test_modal_damping_has_its_ratios_on_rigid_bearings():
    model = reduced(on_films(), modal_damping=(0.02, 0.05))
    inner = [1, 2, 3]
    M, C, K = (A[np.ix_(inner, inner)] for A in (np.diag(model.masses), model.damping, model.stiffness))
    A = np.block([[np.zeros((3, 3)), np.eye(3)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    values = np.linalg.eigvals(A)
    values = values[np.argsort(np.abs(values))][::2]
    np.testing.assert_allclose(-values.real / np.abs(values), [0.02, 0.05, 0.0], atol=1e-7)


def test_a_force_where_no_mass_stands_is_kept_and_said():
    stop = Stop(9, "ring", 1e-4, 1e7, 1e3)
    rotor = replace(rotor23(), forces=[stop, CubicSpring(12, "", 1e5, 1e12)])
    model = reduced(rotor)
    assert model.nodes == (2, 7, 9, 12, 18, 22)
    assert model.masses[2] == 0
    assert "no mass stands at node 9, where" in model.warnings[0]
    assert model.masses.sum() == pytest.approx(rotor.total_mass)
    assert model.forces == rotor.forces
    heavy = keep_supports(rotor, NODES, np.array([300.0, 300.0, 300.0]))
    assert "too large to leave some for the supports: together 907.9 kg" in heavy.warnings[0]


def test_bow_and_unbalance_act_as_on_the_rotor():
    rotor = on_films()
    bow = {2: 1e-4, 12: 3e-4j, 22: 1e-4 - 1e-4j}
    full = rotor_system(rotor, 0.0, 100.0, bow=bow, unbalance={12: 1e-3j})
    model = replace(reduced(rotor), bow=bow, unbalance={12: 1e-3j})
    made = rotor_system(model, 0.0, 100.0)
    for node in model.nodes:
        mine, theirs = made.index(node), full.index(node)
        largest = np.abs(full.bow).max()
        np.testing.assert_allclose(made.bow[[*mine]], full.bow[[*theirs]], atol=1e-9 * largest)
        np.testing.assert_array_equal(made.unbalance[[*mine]], full.unbalance[[*theirs]])
    assert made.forces == rotor.forces
    other = rotor_system(model, 0.0, 100.0, unbalance={}, bow={})
    assert not other.bow.any()
    assert not other.unbalance.any()
    with pytest.raises(ValueError, match=r"node 9 does not exist: the small model has 2, 7, 12, 18 and 22"):
        rotor_system(model, 0.0, 100.0, bow={2: 0.0, 9: 1e-4, 22: 0.0})


@each_of(
    ("rotor", "nodes", "message"),
    [
        (on_films(), (2, 12), "node 2 is held rigidly .* leave it out"),
        (replace(on_films(), forces=[journal(2)]), NODES, "two nodes at least are needed, this rotor has 1"),
        (replace(rotor23(), supports=[fem.Support(2, 0.0, 1e3)]), NODES, "this rotor has 0"),
    ],
)
def test_rotors_that_cannot_be_held_are_refused(rotor, nodes, message):
    def reducing():
        held_rigidly(rotor)
        keep_supports(rotor, nodes, np.ones(len(nodes)))

    with pytest.raises(ValueError, match=message):
        reducing()


@each_of(
    ("change", "message"),
    [
        ({"nodes": (1, 1)}, "nodes: different nodes"),
        ({"nodes": ()}, "nodes: different nodes"),
        ({"masses": [1.0]}, "masses: 2 finite numbers for 2 nodes"),
        ({"masses": [1.0, -1.0]}, "masses: 0 or more"),
        ({"masses": [0.0, 0.0]}, "masses: 0 or more, and not all"),
        ({"weight": [1.0, np.inf]}, "weight: 2 finite"),
        ({"stiffness": [[1.0, 2.0], [3.0, 1.0]]}, "stiffness: a symmetric matrix"),
        ({"gyroscopic": np.eye(3)}, "gyroscopic: 2 × 2 finite"),
        ({"supports": [fem.Support(3, 1e6)]}, "node 3 does not exist"),
        ({"forces": [journal(7)]}, "node 7 does not exist"),
        ({"supports": [fem.Support(1, 1e6, tilting_stiffness=1.0)]}, "no slopes"),
        ({"unbalance": {3: 1e-3}}, "node 3 does not exist"),
    ],
)
def test_impossible_models_are_refused(change, message):
    given = {
        "nodes": (1, 2),
        "masses": [1.0, 2.0],
        "weight": [9.8, 19.6],
        "stiffness": [[1.0, 0.0], [0.0, 1.0]],
    }
    with pytest.raises(ValueError, match=message):
        SmallModel(**given | change)
