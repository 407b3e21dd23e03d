"""The small model against the rotor itself where that is a few masses, and against formula (50)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cases import each_of
from exact_solutions import exactly, whirl_exactly
from fem_rotors import machines, rotor23
from hypothesis import given, settings
from hypothesis import strategies as st

import fem
from fem import state_space
from rotorid.reduction import reduce, small_model

NODES = (7, 12, 18)


@pytest.fixture(scope="module")
def rotor():
    return rotor23()


@pytest.fixture(scope="module")
def reduction(rotor):
    return reduce(rotor, NODES, 2)


def eigenvalues(small, speed=0.0):
    """All finite eigenvalues at a speed, 1/s, by rising frequency."""
    return state_space(small.motion(speed), inputs=(), outputs=()).eigenvalues


@st.composite
def lumped_rotors(draw):
    """Discs on a massless shaft; bearings of any kind, some of them undamped, some at a disc."""
    rotor = draw(machines(elements=(4, 9)))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    nodes = rng.choice(np.arange(1, rotor.n_nodes + 1), size=rng.integers(1, 4), replace=False)
    return replace(
        rotor,
        density=0.0,
        discs=[fem.Disc(node, rng.uniform(5, 50)) for node in sorted(nodes.tolist())],
        supports=[replace(s, damping=0.0) if rng.random() < 0.4 else s for s in rotor.supports],
        material_damping=draw(st.sampled_from([0.0, 1e-5])),
        model=fem.Model(shear=rotor.model.shear),
    )


@settings(max_examples=60, deadline=None)
@given(lumped_rotors(), st.sampled_from([0.0, 130.0, 900.0]))
def test_a_rotor_that_is_a_few_masses_is_its_own_small_model(rotor, speed):
    nodes = [disc.node for disc in rotor.discs]
    small = small_model(rotor, nodes, [disc.mass for disc in rotor.discs])
    mine = eigenvalues(small, speed)
    # the finite element model as plain matrices, every eigenvalue; and the program's own whirl solver
    theirs = state_space(fem.equations_of_motion(rotor, speed=speed), inputs=(), outputs=()).eigenvalues
    # material damping without mass beside it decays with 1/β = 1e5 1/s: of the nodes left out only
    limit = min(1e3 * abs(mine).min(), 3e4)
    for some, others in ((mine, theirs), (theirs, mine)):
        for value in some[abs(some) < limit]:
            assert abs(others - value).min() < 1e-8 * abs(value)
    omega = np.array([speed + 40.0])
    unbalance = {node: 1e-3 * np.exp(2j * node) for node in nodes}
    mine = small.deflections(omega, unbalance)[0]
    full = exactly(fem.unbalance_response, rotor, unbalance, omega, nodes=nodes)
    n, size = len(nodes), abs(full.major).max()
    np.testing.assert_allclose(mine[:n], full.x[0], rtol=0, atol=1e-8 * size)
    np.testing.assert_allclose(mine[len(small.nodes) :][:n], full.y[0], rtol=0, atol=1e-8 * size)


def full_machine(**changes):
    """Two discs on a massless shaft with all that supports can be."""
    stand = fem.Pedestal(20.0, (3e8, 1e8), (1e3, 2e3))
    rotor = fem.Rotor(
        [0.1] * 10,
        0.06,
        density=0.0,
        discs=[fem.Disc(4, 30.0), fem.Disc(8, 20.0)],
        supports=[
            fem.Support(1, ((2e7, 3e6), (-2e6, 5e7)), ((2e3, 1e2), (50.0, 3e3)), name="A"),
            fem.Support(
                11, [1e7, ((3e7, 1e6), (0, 2e7))], [1e3, 2e3], speeds=(0.0, 500.0), pedestal=stand, name="B"
            ),
        ],
        material_damping=2e-6,
        stations={"wheel": 8},
        model=fem.Model(shear=True),
    )
    return replace(rotor, **changes)


def test_static_slopes_make_gyroscopic_terms_right_to_first_order_in_speed():
    """The slopes at the discs follow the moments, too: an error that grows with the square of the speed."""
    discs = [fem.Disc(4, 30.0, polar_inertia=0.6), fem.Disc(8, 20.0, polar_inertia=0.4)]
    rotor = full_machine(discs=discs, model=fem.Model(gyroscopic=True))
    small = small_model(rotor, (4, 8), (30.0, 20.0))
    still = small_model(full_machine(model=fem.Model()), (4, 8), (30.0, 20.0))

    def error(model, speed):
        mine, theirs = eigenvalues(model, speed), whirl_exactly(rotor, speed, 4).eigenvalues
        return np.array([abs(mine - value).min() / abs(value) for value in theirs])

    slow, fast = error(small, 60.0), error(small, 120.0)
    np.testing.assert_allclose(fast / slow, 4.0, rtol=0.08)
    assert fast.max() < 2.5e-4  # at 120 rad/s, a third of the first natural frequency
    assert error(small, 480.0).max() < 4e-3
    assert (error(still, 120.0) > 20 * fast).all()  # without gyroscopic terms
    assert any("slopes that follow" in text for text in small.warnings)


def test_condensed_supports_are_formula_50(rotor, reduction):
    for nodes in (NODES, (2, 12, 22), (2, 9), (1, 5, 14, 24)):
        small = small_model(rotor, nodes, np.full(len(nodes), 100.0))
        K = small.motion(plane="x", condensed=True).K
        np.testing.assert_allclose(np.linalg.inv(K), fem.compliance(rotor, nodes), rtol=1e-10, atol=1e-19)
    small = small_model(rotor, NODES, reduction.masses.solution)
    mine, theirs = small.motion(plane="x", condensed=True), reduction.equations_of_motion
    assert mine.coordinates == theirs.coordinates == ("x7", "x12", "x18")
    np.testing.assert_allclose(mine.K, theirs.K, rtol=1e-9)
    np.testing.assert_array_equal(mine.M, theirs.M)
    np.testing.assert_allclose(np.sort(eigenvalues(small).imag)[-6::2], reduction.frequencies, rtol=1e-10)


def test_damped_supports_cannot_be_condensed():
    small = small_model(full_machine(), (4, 8), (30.0, 20.0))
    with pytest.raises(ValueError, match="damping acts on 'x1', which has no mass"):
        small.motion(100.0, condensed=True)
    at_bearings = small_model(full_machine(), (1, 6, 11), (5.0, 30.0, 5.0))
    motion = at_bearings.motion(100.0, condensed=True)
    assert motion.coordinates == at_bearings.coordinates  # nothing is massless


@each_of(
    ("nodes", "masses", "options", "message"),
    [
        ((), (), {}, "different nodes"),
        ((4, 4), (1.0, 1.0), {}, "different nodes"),
        ((4, 12), (1.0, 1.0), {}, "node 12 does not exist"),
        (("fan",), (1.0,), {}, "no station is called 'fan'"),
        ((4, 8), (1.0,), {}, "as many masses"),
        ((4, 8), (1.0, -2.0), {}, "node 8 is -2 kg, not positive: a physical model needs positive masses"),
        ((4, 8), (1.0, 0.0), {}, "positive masses"),
        ((4, 8), (np.nan, 1.0), {}, "positive masses"),
        ((4, 8), (1.0, 1.0), {"modal_damping": (1.2,)}, "below 1"),
        ((4, 8), (1.0, 1.0), {"modal_damping": (np.nan,)}, "below 1"),
        ((4, 8), (1.0, 1.0), {"modal_damping": 0.02}, "list of damping ratios"),
        ((4, 8), (1.0, 1.0), {"modal_damping": (0.01,) * 4}, "each plane has 2 modes"),
    ],
)
def test_bad_input_is_refused(nodes, masses, options, message):
    with pytest.raises(ValueError, match=message):
        small_model(full_machine(), nodes, masses, **options)


def test_a_shaft_that_nothing_holds_is_refused_in_words():
    held = full_machine(supports=[fem.Support(4, 1e7, tilting_stiffness=1e5)], material_damping=0.0)
    assert eigenvalues(small_model(held, (4,), (30.0,))).imag.max() == pytest.approx(np.sqrt(1e7 / 30.0))
    one = full_machine(supports=[fem.Support(4, 1e7)])
    free = full_machine(supports=[fem.Support(1), fem.Support(11)], material_damping=0.0)
    pushed = full_machine(supports=[*full_machine().supports, fem.Support(6, -1e8, kind="seal")])
    for what, words in (
        (lambda: small_model(one, (4,), (30.0,)), "can turn about it"),
        (lambda: small_model(free, (4,), (30.0,)).motion(condensed=True), "can move without force"),
        (lambda: small_model(free, (4,), (30.0,), modal_damping=(0.01,)), "is not held has no rest"),
        (lambda: eigenvalues(small_model(free, (4,), (30.0,))), "held neither"),
        (lambda: small_model(pushed, (4, 8), (30.0, 20.0), modal_damping=(0.01,)), "negative stiffness"),
    ):
        with pytest.raises(ValueError, match=words):
            what()


def test_speeds_are_checked(rotor):
    small = small_model(full_machine(), (4, 8), (30.0, 20.0))
    with pytest.raises(ValueError, match="its table holds 0 to 500"):
        eigenvalues(small, 600.0)
    for bad in (-1.0, np.inf, "fast"):
        with pytest.raises(ValueError, match="speeds must be"):
            small.response(bad, {4: 1e-3})
    for plane, words in (("z", "it is"), ("x", "coupled: take both")):
        with pytest.raises(ValueError, match=words):
            small.motion(plane=plane)
    jeffcott = fem.Rotor(
        [0.5, 0.5],
        0.05,
        density=0.0,
        discs=[fem.Disc(1, 1.0)],
        supports=[fem.Support(1, 1e4), fem.Support(3, 1e4)],
    )
    with pytest.raises(ValueError, match="exactly at a critical speed"):
        small_model(jeffcott, (1, 3), (1.0, 1.0)).response(100.0, {1: 1e-3})


def test_the_response_is_that_of_a_rotor_which_is_a_few_masses():
    """Readings, forces on the supports and ranges without a steady state; critical speeds are its peaks."""
    rotor = full_machine(supports=full_machine().supports[:2])
    small, unbalance = small_model(rotor, (4, 8), (30.0, 20.0)), {4: 2e-4, 8: 1e-4j}
    speeds = np.linspace(0.0, 450.0, 46)
    mine, full = small.response(speeds, unbalance), fem.unbalance_response(rotor, unbalance, speeds)
    for sensor in ((4, 30.0), 8):
        np.testing.assert_allclose(mine.at(sensor), full.at(sensor), rtol=1e-8, atol=1e-15)
    forces = (each.bearing_forces().largest for each in (mine, full))
    np.testing.assert_allclose(*forces, rtol=1e-7, atol=1e-12)
    np.testing.assert_array_equal(mine.largest, mine.major.max(axis=1))
    assert [w.to_dict() for w in mine.windows] == [pytest.approx(w.to_dict()) for w in full.windows]


def test_the_response_of_an_unstable_model_has_a_range_without_steady_state():
    k = ((1e7, 4e6), (-4e6, 1e7))
    rotor = full_machine(supports=[fem.Support(1, k, 2e3), fem.Support(11, k, 2e3)])
    small = small_model(rotor, (4, 8), (30.0, 20.0))
    response = small.response([100.0, 500.0], {4: 1e-4})
    (window,) = response.windows
    assert not response.steady.any()
    assert "grows" in response.warnings[-1]
    theirs = fem.unbalance_response(rotor, {4: 1e-4}, [100.0, 500.0]).windows[0]
    assert (window.first, window.frequency) == pytest.approx((theirs.first, theirs.frequency))


def test_what_no_response_is_computed_of():
    rotor = full_machine()
    films = replace(rotor, forces=[fem.Stop(4, gap=1e-3, stiffness=1e8)])
    small, stopped = (small_model(each, (4, 8), (30.0, 20.0)) for each in (rotor, films))
    for model, unbalance, words in (
        (small, None, "no unbalance is given"),
        (small, {5: 1e-4}, "node 5 does not exist"),
        (stopped, {4: 1e-4}, "rotorid motion"),
    ):
        with pytest.raises(ValueError, match=words):
            model.response(100.0, unbalance)
    bent = replace(small, bow={4: 1e-5, 8: 1e-5, 1: 0.0}, unbalance={4: 1e-4})
    assert any("bow of the model is left out" in warning for warning in bent.response(100.0).warnings)
