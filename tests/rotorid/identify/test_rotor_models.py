"""Models in time from rotors: matrices of finite elements and of small models, through their files."""

import numpy as np
import pytest
from exact_solutions import frequency_response
from timedomain_cases import state_space_of

import fem
from fem import state_space
from rotorid.files import read_ode_model
from rotorid.files.settings import toml_bytes
from rotorid.files.small_model import equations_of
from rotorid.identify.fit_records import fit
from rotorid.identify.records import Record
from rotorid.identify.second_order import second_order
from rotorid.identify.simulation import simulate
from rotorid.reduction import small_model
from rotorid.samples import sample_data

SPEED = 150.0
CROSS = ((4e7, 6e6), (-6e6, 5e7))
W = np.array([20.0, 77.0, 160.0, 400.0])


def turning(damping):
    """Three masses of a rotor with gyroscopic discs on bearings with cross-coupled stiffness."""
    rotor = fem.Rotor(
        length=[0.2, 0.3, 0.25, 0.3, 0.2],
        outer_diameter=0.07,
        discs=[fem.Disc(3, 40.0, 3.0, 1.6), fem.Disc(5, 25.0, 2.0, 1.1), fem.Disc(6, 10.0, 0.5, 0.3)],
        supports=[fem.Support(2, CROSS, damping), fem.Support(4, CROSS, damping)],
        model=fem.Model(gyroscopic=True),
    )
    return small_model(rotor, (3, 5, 6), [40.0, 25.0, 10.0], modal_damping=(0.01, 0.02))


def farthest(ours, theirs):
    """Largest distance of an eigenvalue from its next in the other set, relative to its size."""
    assert ours.shape == theirs.shape
    distance = np.abs(ours[:, None] - theirs) / np.abs(theirs)
    return max(distance.min(axis=0).max(), distance.min(axis=1).max())


def through_a_file(tmp_path, motion, dampers=(), **options):
    path = tmp_path / "model.toml"
    path.write_bytes(toml_bytes(equations_of(motion, dict(dampers), **options)))
    return path, state_space_of(read_ode_model(path))


def damped(motion, dampers):
    """The motion with dampers between coordinates and the ground."""
    C = motion.C.copy()
    for name, value in dampers.items():
        C[motion.index(name), motion.index(name)] += value
    return fem.Motion(motion.M, C, motion.K, motion.coordinates, motion.speed)


@pytest.mark.parametrize(
    ("damping", "condensed", "dampers"),
    [
        (0.0, True, {}),
        (0.0, False, {}),
        (900.0, False, {"x3": 400.0, "y6": 70.0}),
        (((900.0, 100.0), (50.0, 700.0)), False, {}),
    ],
)
def test_both_planes_with_gyroscopic_discs_and_cross_coupling(tmp_path, damping, condensed, dampers):
    """Supports that are condensed, and those that are kept: without mass, of first order."""
    motion = turning(damping).motion(SPEED, condensed=condensed)
    ends = {"inputs": ["f_x3", "f_y6"], "outputs": ["x3", "x5", "x6", "y3", "y5", "y6"]}
    _, ours = through_a_file(tmp_path, motion, dampers, **ends)
    whole = damped(motion, dampers)
    theirs = state_space(whole, **ends)
    assert farthest(ours.eigenvalues, theirs.eigenvalues) < 1e-10
    scale = 1 / np.sqrt(np.outer(np.diag(whole.K), np.diag(whole.K)))
    for s in ours.eigenvalues:
        sigma = np.linalg.svd((s * s * whole.M + s * whole.C + whole.K) * scale, compute_uv=False)
        assert sigma[-1] < 1e-9 * sigma[0]
    one, other = frequency_response(ours, W), frequency_response(theirs, W)
    np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-14)


def test_bearing_of_a_finite_element_rotor_from_its_decay():
    """A bearing's stiffness and damping from the motion of two nodes, three elements, no reduction."""
    shaft = fem.Rotor(length=[0.3, 0.4, 0.3], outer_diameter=0.06, discs=[fem.Disc(2, 20.0)])
    motion = fem.equations_of_motion(shaft, plane="x")
    M, C, K = (matrix.tolist() for matrix in (motion.M, motion.C, motion.K))
    for matrix, name, added in (
        (K, "x1", "k"), (K, "x4", 2e7), (C, "x1", "c"), (C, "x4", 500), (M, "x3", "m"),
    ):  # fmt: skip
        i = motion.index(name)
        matrix[i][i] = f"{matrix[i][i]} + {added}"
    model = second_order(
        M,
        C,
        K,
        names=motion.coordinates,
        estimate={"k": 8e6, "c": 300.0, "m": 4.0},
        initial={"v_x2": 0.1},
        outputs={"near": "1e6*x1", "far": "1e6*x3"},
    )
    t, truth = np.linspace(0.0, 0.2, 201), np.array([1.1e7, 700.0, 6.0])
    y = simulate(model, truth, t).y + 0.5 * np.random.default_rng(3).standard_normal((201, 2))
    result = fit(model, Record(t, {"near": y[:, 0], "far": y[:, 1]}))
    assert result.reliable
    assert np.abs((result.values - truth) / result.std).max() < 4
    assert (result.std < 0.05 * truth).all()


def test_a_model_with_a_negative_mass_is_not_written(cli, tmp_path):
    path = tmp_path / "bad.toml"
    rotor = sample_data() / "rotor23.csv"
    outcome = cli("reduce", rotor, "--nodes", "2,3,23", "--modes", "2", "--output", path)
    assert outcome.code == 2
    assert "not positive" in outcome.err
    assert not path.exists()
