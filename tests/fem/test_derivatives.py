"""∂H = −H ∂D H against whole dense matrices that are written apart, and against differences of answers."""

from dataclasses import replace

import dense_rotor
import numpy as np
import pytest
from fem_rotors import machines, uniform
from hypothesis import example, given, settings
from hypothesis import strategies as st

import fem
from fem import matrix_change, receptance_with_derivatives, unit_loads
from fem.assembly import assemble
from fem.parameters import parameter_value, typical_size, with_changes, with_parameters
from rotorid.calibration.unknowns import as_they_stand

ALPHA = np.array([0.0, 90.0, 37.0])
DISCS = [fem.Disc(20, 30.0, 0.5, 0.3), fem.Disc(40, 20.0)]


TABLE = fem.Support(
    1,
    [((3e7, 2e6), (-5e6, 5e7)), 4e7, ((9e7, 8e6), (4e6, 6e7))],
    [((2e4, 0), (1e3, 1e4)), 3e4, 1e4],
    speeds=(0.0, 400.0, 2000.0),
    pedestal=fem.Pedestal(20.0, (8e7, 2e8), (3e3, 5e3)),
    tilting_stiffness=3e5,
)
SEAL = fem.Support(3, ((-3e5, 2e5), (-2e5, -3e5)), ((300.0, 0.0), (0.0, 300.0)), kind="seal")


def machine(*supports, shear=False):
    """With anything that a rotor file can say: tables, cross-coupling, pedestals, seals, tilting springs."""
    return fem.Rotor(
        [0.15, 0.2, 0.1, 0.2],
        [0.08, 0.1, 0.09, 0.07],
        [0.0, 0.04, 0.0, 0.0],
        material_damping=[0.0, 2e-6, 1e-6, 3e-6],
        discs=[fem.Disc(2, 20.0, 0.3, 0.2), fem.Disc(4, 30.0, 0.2, 0.3)],
        supports=[TABLE, fem.Support(5, ((2e7, 1e6), (-4e6, 1e7)), 5e3), *supports],
        model=fem.Model(shear, True, True),
    )


def paths_of(rotor):
    paths = ["material.youngs_modulus.scale", "material.density.scale"]
    paths += ["material.material_damping.scale"] * bool(rotor.material_damping.any())
    for i in range(1, len(rotor.discs) + 1):
        paths += [f"disc[{i}].{name}" for name in ("mass", "polar_inertia", "diametral_inertia", "scale")]
    bearings = [s for s in rotor.supports if s.kind == "bearing"]
    for i, support in enumerate(bearings, start=1):
        names = ["kxx", "kxy", "kyy", "cxx", "cyx", "kxx.scale", "stiffness.scale", "cyy.scale"]
        names += ["pedestal_stiffness_x", "pedestal_damping_y"] * bool(support.pedestal)
        names += ["pedestal_mass"] * bool(support.pedestal and support.pedestal.mass)
        names += ["tilting_stiffness"] * bool(support.tilting_stiffness)
        paths += [f"bearing[{i}].{name}" for name in names]
    return paths + ["seal[1].kxx", "seal[1].cxy"] * (len(bearings) < len(rotor.supports))


def computed(rotor, planes, nodes, speeds, paths=()):
    A, speeds = assemble(rotor), np.asarray(speeds, dtype=float)
    changes = [
        matrix_change(lambda by, path=path: with_changes(rotor, {path: by}), 1e-4 * size, speeds)
        for path, size in ((path, typical_size(rotor, path)) for path in paths)
    ]
    rows = np.array([A.deflection(node) for node in nodes])
    loads = unit_loads(A, np.array([A.deflection(node) for node in planes]))
    return receptance_with_derivatives(rotor, loads, rows, np.radians(ALPHA[: len(nodes)]), speeds, changes)


class Dense:
    """D, loads f and rows u of both planes with the pedestals' own unknowns, in which D is linear."""

    def __init__(self, rotor, planes, nodes, speed):
        self.rotor, self.speed = rotor, speed
        at = dense_rotor.assemble(rotor, speed)
        self.D = at.dynamic(1j * speed)
        f, u = np.zeros((len(self.D), len(planes)), complex), np.zeros((len(nodes), len(self.D)))
        for j, plane in enumerate(planes):
            f[at.x[plane - 1], j], f[at.y[plane - 1], j] = 1.0, -1j
        for j, (node, alpha) in enumerate(zip(nodes, np.radians(ALPHA), strict=False)):
            u[j, at.x[node - 1]], u[j, at.y[node - 1]] = np.cos(alpha), np.sin(alpha)
        self.q, self.p, self.u = np.linalg.solve(self.D, f), np.linalg.solve(self.D.T, u.T), u
        self.H = u @ self.q

    def derivative(self, path):
        """−pᵀ ∂D q and the size of what it is summed from: ∂D by a large step, as D is linear."""
        by = 0.25 * typical_size(self.rotor, path)
        D = dense_rotor.assemble(with_changes(self.rotor, {path: by}), self.speed).dynamic(1j * self.speed)
        change = (D - self.D) / by
        return -self.p.T @ change @ self.q, float((abs(self.p.T) @ abs(change) @ abs(self.q)).max())


def agree(rotor, planes, nodes, speeds, paths, *, exact=1e-9, allowed=1e-7):
    """H and its derivatives are those of whole dense matrices, to shares of the largest of what is summed."""
    found = computed(rotor, planes, nodes, speeds, paths)
    for s, speed in enumerate(speeds):
        dense = Dense(rotor, planes, nodes, speed)
        assert abs(found.H[s] - dense.H).max() < exact * abs(dense.q).max()
        for path, by_number in zip(paths, found.by_number[:, s], strict=True):
            expected, size = dense.derivative(path)
            assert abs(by_number - expected).max() <= allowed * size, (path, speed)
    return found


@given(machines(elements=(2, 24)), st.integers(0, 100))
@example(machine(SEAL), 1)
@example(uniform(60, supports=[fem.Support(1, 1e8, 1e4), fem.Support(50, 5e7, 1e3)], discs=DISCS), 2)
@settings(max_examples=8, deadline=None)
def test_derivatives_are_those_of_whole_dense_matrices(rotor, seed):
    rotor = replace(rotor, model=replace(rotor.model, shear=False))
    rng = np.random.default_rng(seed)
    planes, nodes = (rng.integers(1, rotor.n_nodes + 1, k).tolist() for k in (2, 3))
    speeds = np.sort(rng.uniform(60, 1000, 33 if seed == 1 else 2))
    exact = max(1e-9, np.finfo(float).eps * rotor.n_elements**4)  # rounding of displacement elements
    computed_ones = agree(rotor, planes, nodes, speeds, paths_of(rotor), exact=exact)
    influence = fem.influence(rotor, planes, list(zip(nodes, ALPHA, strict=True)), speeds).W
    difference = computed_ones.H * speeds[:, None, None] ** 2 - influence
    assert abs(difference).max() < exact * abs(influence).max()


def test_nothing_is_lost_at_the_resonances_of_the_conservative_rotor():
    """There the modes and series fail; damping that differs in x and y couples both directions."""
    supports = [fem.Support(node, 3e7, ((2e3, 0.0), (0.0, 5e3))) for node in (1, 9)]
    rotor = uniform(10, discs=[fem.Disc(5, 40.0)], supports=supports)
    critical = fem.critical_speeds(replace(rotor, supports=[fem.Support(s.node, 3e7) for s in supports]), 3)
    near = [w * (1 + e) for w in critical.frequencies for e in (0.0, 1e-12, -1e-9, 1e-7)]
    paths = ["bearing[1].kxx", "bearing[2].cyy", "bearing[2].cxx", "disc[1].mass"]
    agree(rotor, [5], [3, 7], near, paths, allowed=1e-8)


def test_derivatives_of_shear_are_differences_of_influences():
    """With shear the dense judge solves the continuum, and Poisson's ratio counts."""
    rotor, planes, speeds = machine(shear=True), [2, 4], np.array([150.0, 700.0])
    paths = [
        "material.poisson_ratio",
        "material.youngs_modulus.scale",
        "material.density.scale",
        "disc.scale",
    ]
    paths += ["bearing[1].kxx", "bearing[2].cyx"]
    found = computed(rotor, planes, [1, 3, 5], speeds, paths)
    places = list(zip([1, 3, 5], ALPHA, strict=True))

    def H(path, by):
        return fem.influence(with_changes(rotor, {path: by}), planes, places, speeds).W

    for path, own in zip(paths, found.by_number * speeds[:, None, None] ** 2, strict=True):
        h = 5e-4 * typical_size(rotor, path)
        coarse, fine = ((H(path, k * h) - H(path, -k * h)) / (2 * k * h) for k in (2, 1))
        richardson = (4 * fine - coarse) / 3
        assert abs(own - richardson).max() <= 1e-6 * abs(richardson).max(), path


def test_a_sensor_turned_by_a_quarter_reads_its_derivative_by_the_angle():
    rotor, speeds = machine(), np.array([120.0, 480.0])
    turned = [(node, alpha + 90.0) for node, alpha in zip((1, 2, 3), ALPHA, strict=True)]
    expected = fem.influence(rotor, [2], turned, speeds).W / speeds[:, None, None] ** 2
    found = computed(rotor, [2], [1, 2, 3], speeds)
    assert abs(found.by_angle - expected).max() < 1e-9 * abs(expected).max()


def test_at_rest_it_is_the_static_deflection():
    rotor = uniform(6, supports=[fem.Support(node, 2e7, 1e3) for node in (1, 7)])
    found = computed(rotor, [4], [4], [0.0], ["bearing.stiffness", "bearing.damping"])
    EI, k = float((rotor.youngs_modulus * rotor.second_moment)[0]), 2e7
    assert found.H[0, 0, 0] == pytest.approx(1 / (48 * EI) + 1 / (2 * k), rel=1e-9)
    assert found.by_number[:, 0, 0, 0] == pytest.approx([-1 / (2 * k**2), 0], rel=1e-8, abs=1e-25)


def test_a_number_at_its_end_changes_to_one_side():
    rotor = uniform(6, supports=[fem.Support(node, 2e7) for node in (1, 7)])
    agree(rotor, [4], [2], [300.0], ["bearing[1].cxx"], allowed=1e-8)
    with pytest.raises(ValueError, match="neither larger nor smaller"):
        matrix_change(lambda by: with_changes(rotor, {"bearing[1].cxx": -abs(by)}), 1.0, np.ones(1))


def test_of_a_scale_and_what_is_added_to_the_same_numbers():
    """As they stand together the scale multiplies what is added: that is not its derivative."""
    start = machine()
    values = {"bearing[1].kxx.scale": 1.3, "bearing[1].kxx.offset": -1e5}
    rotor = with_parameters(start, values)
    found = computed(rotor, [1], [2], [300.0], list(values)).by_number[:, 0, 0, 0]
    by_values = as_they_stand(start, values).T @ found
    for (path, value), own in zip(values.items(), by_values, strict=True):
        h = 1e-3 * typical_size(start, path)
        two = [with_parameters(start, {**values, path: value + by}) for by in (h, -h)]
        up, down = (Dense(each, [1], [2], 300.0).H[0, 0] for each in two)
        assert own == pytest.approx((up - down) / (2 * h), rel=1e-5)
    assert parameter_value(rotor, "bearing[1].kxx.scale") == 1
