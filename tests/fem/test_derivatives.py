"""∂H = −H ∂D H against whole dense matrices that are written apart, and against differences of answers."""

from dataclasses import replace

import dense_rotor
import numpy as np
import pytest
from fem_rotors import uniform

import fem
from fem import matrix_change, receptance_with_derivatives, unit_loads
from fem.assembly import assemble
from fem.parameters import parameter_value, typical_size, with_changes, with_parameters
from rotorid.calibration.unknowns import as_they_stand

ALPHA = np.array([0.0, 90.0, 37.0])


def drawn(seed, n=None, *, shear=False):
    """With anything that a rotor file can say: tables, cross-coupling, pedestals, seals, tilting springs."""
    rng = np.random.default_rng(seed)
    n = n or int(rng.integers(2, 16))

    def coin(p):
        return bool(rng.random() < p)

    def coefficient(size, same):
        (a, b), c = rng.uniform(-0.4, 0.4, 2) * size, size * rng.uniform(0.4, 2.0)
        return size if same else ((size, a), (b, c))

    supports = []
    for node in rng.choice(np.arange(1, n + 2), size=min(n + 1, int(rng.integers(2, 4))), replace=False):
        k, c, same = 10 ** rng.uniform(6.5, 8.5), 10 ** rng.uniform(3, 4.5), coin(0.3)
        pedestal = fem.Pedestal(
            rng.uniform(0, 50), tuple(10 ** rng.uniform(7, 9, 2)), tuple(10 ** rng.uniform(2, 4, 2))
        )
        speeds = (0.0, 500.0, 1500.0, 6000.0) if coin(0.4) else ()
        k, c = (
            [coefficient(size * rng.uniform(0.5, 2.0), same) for _ in speeds]
            if speeds
            else coefficient(size, same)
            for size in (k, c)
        )
        tilting = 10 ** rng.uniform(4, 7) if coin(0.3) else 0.0
        supports.append(
            fem.Support(
                int(node),
                k,
                c,
                speeds=speeds,
                pedestal=pedestal if coin(0.5) else None,
                tilting_stiffness=tilting,
            )
        )
    if coin(0.6):
        k = 10 ** rng.uniform(5, 6)
        seal = ((-k, 0.5 * k), (-0.5 * k, -k)), ((300.0, 0.0), (0.0, 300.0))
        supports.append(fem.Support(int(rng.integers(1, n + 2)), *seal, kind="seal"))
    beta = (0.0, 2e-6, rng.uniform(0, 3e-6, n))[int(rng.integers(3))]
    outer = rng.uniform(0.04, 0.12, n)
    return fem.Rotor(
        rng.uniform(0.05, 0.25, n) * 12 / max(n, 12),
        outer,
        np.where(rng.random(n) < 0.3, outer / 2, 0.0),
        youngs_modulus=rng.uniform(1e11, 2.2e11, n),
        density=rng.uniform(2700, 8000, n),
        poisson_ratio=0.3,
        material_damping=beta,
        discs=[
            fem.Disc.from_geometry(int(node), rng.uniform(0.02, 0.1), rng.uniform(0.15, 0.4))
            for node in rng.integers(1, n + 2, 2)
        ],
        supports=supports,
        model=fem.Model(shear, coin(0.6), coin(0.6)),
    )


def paths_of(rotor):
    found = ["material.youngs_modulus.scale", "material.density.scale", "disc[1].mass", "disc.scale"]
    found += ["disc[2].polar_inertia", "disc[2].diametral_inertia"]
    found += ["material.material_damping.scale"] * bool(rotor.material_damping.any())
    bearings = [s for s in rotor.supports if s.kind == "bearing"]
    for i, support in enumerate(bearings, start=1):
        own = [
            *("kxx", "kxy", "kyy", "cxx", "cyx"),
            *("kxx.scale", "stiffness.scale", "cyy.scale"),
        ]
        own += ["pedestal_mass", "pedestal_stiffness_x", "pedestal_damping_y"] * bool(support.pedestal)
        own += ["tilting_stiffness"] * bool(support.tilting_stiffness)
        found += [f"bearing[{i}].{name}" for name in own]
    if len(bearings) < len(rotor.supports):
        found += ["seal[1].kxx", "seal[1].cxy"]
    return found


def computed(rotor, planes, nodes, speeds, paths=()):
    A, speeds = assemble(rotor), np.asarray(speeds, dtype=float)
    changes = [
        matrix_change(lambda by, path=path: with_changes(rotor, {path: by}), 0.0, 1e-4 * size, speeds)
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


@pytest.mark.parametrize(("seed", "n"), [*((k, None) for k in range(10)), (16, 1), (17, 60)])
def test_derivatives_of_drawn_rotors_are_those_of_whole_dense_matrices(seed, n):
    rotor = drawn(seed, n)
    rng = np.random.default_rng(seed)
    planes, nodes = (rng.integers(1, rotor.n_nodes + 1, k).tolist() for k in (2, 3))
    speeds, paths = np.sort(rng.uniform(60, 1000, 2)), paths_of(rotor)
    found = computed(rotor, planes, nodes, speeds, paths)
    influence = fem.influence(rotor, planes, list(zip(nodes, ALPHA, strict=True)), speeds).W
    exact = max(1e-9, np.finfo(float).eps * rotor.n_elements**4)  # rounding of displacement elements
    assert abs(found.H * speeds[:, None, None] ** 2 - influence).max() < exact * abs(influence).max()
    for s, speed in enumerate(speeds):
        dense = Dense(rotor, planes, nodes, speed)
        assert abs(found.H[s] - dense.H).max() < exact * abs(dense.q).max()
        for path, own in zip(paths, found.by_number[:, s], strict=True):
            expected, size = dense.derivative(path)
            assert abs(own - expected).max() <= 1e-7 * size, path


def test_derivatives_of_shear_are_differences_of_influences():
    """With shear the dense judge solves the continuum, and Poisson's ratio counts."""
    rotor, planes, speeds = drawn(3, 4, shear=True), [2, 4], np.array([150.0, 700.0])
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


def test_nothing_is_lost_at_the_resonances_of_the_conservative_rotor():
    """There the modes and series fail; damping that differs in x and y couples both directions."""
    supports = [fem.Support(node, 3e7, ((2e3, 0.0), (0.0, 5e3))) for node in (1, 9)]
    rotor = uniform(10, discs=[fem.Disc(5, 40.0)], supports=supports)
    critical = fem.critical_speeds(replace(rotor, supports=[fem.Support(s.node, 3e7) for s in supports]), 3)
    near = [w * (1 + e) for w in critical.frequencies for e in (0.0, 1e-12, -1e-9, 1e-7)]
    paths = ["bearing[1].kxx", "bearing[2].cyy", "disc[1].mass", "material.youngs_modulus.scale"]
    found = computed(rotor, [5], [3, 7], near, paths)
    for s, speed in enumerate(near):
        dense = Dense(rotor, [5], [3, 7], speed)
        assert abs(found.H[s] - dense.H).max() < 1e-9 * abs(dense.H).max()
        for path, own in zip(paths, found.by_number[:, s], strict=True):
            expected, size = dense.derivative(path)
            assert abs(own - expected).max() < 1e-8 * size, (path, speed)


def test_a_sensor_turned_by_a_quarter_reads_its_derivative_by_the_angle():
    rotor, speeds = drawn(4), np.array([120.0, 480.0])
    turned = [(node, alpha + 90.0) for node, alpha in zip((1, 2, 3), ALPHA, strict=True)]
    expected = fem.influence(rotor, [2], turned, speeds).W / speeds[:, None, None] ** 2
    found = computed(rotor, [2], [1, 2, 3], speeds)
    assert abs(found.by_angle - expected).max() < 1e-9 * abs(expected).max()


@pytest.mark.parametrize("count", [1, 31, 32, 33, 200])
def test_any_number_of_speeds(count):
    rotor, speeds = drawn(1), np.linspace(100.0, 900.0, count)
    paths = paths_of(rotor)[:9]
    found = computed(rotor, [1, 3], [2, 4], speeds, paths)
    for s in {0, count // 2, max(count - 2, 0), count - 1}:
        dense = Dense(rotor, [1, 3], [2, 4], speeds[s])
        assert abs(found.H[s] - dense.H).max() < 1e-9 * abs(dense.q).max()
        for path, own in zip(paths, found.by_number[:, s], strict=True):
            expected, size = dense.derivative(path)
            assert abs(own - expected).max() <= 1e-7 * size, path


def test_at_rest_it_is_the_static_deflection():
    rotor = uniform(6, discs=[fem.Disc(3, 20.0)], supports=[fem.Support(node, 2e7, 1e3) for node in (1, 7)])
    found = computed(rotor, [4], [4], [0.0], ["bearing.stiffness", "disc[1].mass", "bearing.damping"])
    L, EI, k = 1.0, float((rotor.youngs_modulus * rotor.second_moment)[0]), 2e7
    assert found.H[0, 0, 0] == pytest.approx(L**3 / (48 * EI) + 1 / (2 * k), rel=1e-9)
    assert found.by_number[:, 0, 0, 0] == pytest.approx([-1 / (2 * k**2), 0, 0], rel=1e-8, abs=1e-25)


@pytest.mark.parametrize("soft", [0.0, 1e3])
def test_free_rotors_and_soft_supports(soft):
    supports = [fem.Support(node, soft) for node in (1, 7)] if soft else []
    rotor = uniform(
        6, supports=supports, discs=[fem.Disc(3, 20.0, 0.3, 0.2)], model=fem.Model(False, True, True)
    )
    paths = ["material.density.scale", "material.youngs_modulus.scale", "disc[1].polar_inertia"]
    found = computed(rotor, [4], [2, 6], [90.0, 400.0], paths)
    for s, speed in enumerate((90.0, 400.0)):
        dense = Dense(rotor, [4], [2, 6], speed)
        assert abs(found.H[s] - dense.H).max() < 1e-9 * abs(dense.H).max()
        for path, own in zip(paths, found.by_number[:, s], strict=True):
            expected, size = dense.derivative(path)
            assert abs(own - expected).max() <= 1e-7 * size, path


def test_a_pedestal_a_million_times_stiffer_costs_no_digits():
    stand = fem.Pedestal(5.0, 1e13, 1e3)
    supports = [fem.Support(1, 1e7, 1e3, pedestal=stand), fem.Support(7, 1e7, 1e3)]
    paths = ["bearing[1].pedestal_damping", "bearing[1].pedestal_stiffness"]
    found = computed(uniform(6, supports=supports), [4], [2], [300.0], paths)
    B, S = 1e7 + 300e3j, 1e13 - 5 * 300**2 + 300e3j
    share = (B / (B + S)) ** 2  # of dS in the series B S / (B + S), the same forward and backward
    bare = uniform(6, supports=[fem.Support(1, 1e7, 1e3), supports[1]])
    by_k = Dense(bare, [4], [2], 300.0).derivative("bearing[1].stiffness")[0] * share
    expected = np.array([by_k * 300j, by_k])
    assert abs(found.by_number[:, 0] / expected - 1).max() < 1e-5


def test_a_number_at_its_end_changes_to_one_side():
    rotor = uniform(6, supports=[fem.Support(node, 2e7) for node in (1, 7)])
    found = computed(rotor, [4], [2], [300.0], ["bearing[1].cxx"])
    expected, size = Dense(rotor, [4], [2], 300.0).derivative("bearing[1].cxx")
    assert abs(found.by_number[0, 0] - expected).max() < 1e-8 * size
    with pytest.raises(ValueError, match="neither larger nor smaller"):
        matrix_change(lambda by: with_changes(rotor, {"bearing[1].cxx": -abs(by)}), 0.0, 1.0, np.ones(1))


def test_of_a_scale_and_what_is_added_to_the_same_numbers():
    """As they stand together the scale multiplies what is added: that is not its derivative."""
    start = drawn(9)
    table = next(f"bearing[{i}]" for i, s in enumerate(start.supports, 1) if s.speeds)
    values = {f"{table}.kxx.scale": 1.3, f"{table}.kxx.offset": -1e5}
    rotor = with_parameters(start, values)
    found = computed(rotor, [1], [2], [300.0], list(values)).by_number[:, 0, 0, 0]
    by_values = as_they_stand(start, values).T @ found
    for (path, value), own in zip(values.items(), by_values, strict=True):
        h = 1e-3 * typical_size(start, path)
        two = [with_parameters(start, {**values, path: value + by}) for by in (h, -h)]
        up, down = (Dense(each, [1], [2], 300.0).H[0, 0] for each in two)
        assert own == pytest.approx((up - down) / (2 * h), rel=1e-5)
    assert parameter_value(rotor, f"{table}.kxx.scale") == 1
