"""Linear models in time as state spaces; a reduced rotor written to a file and read back."""

from __future__ import annotations

import numpy as np
import pytest
from exact_solutions import frequency_response
from timedomain_cases import motion_in, state_space_of

import fem
from fem import state_space as of_motion
from rotorid.files import read_ode_model, read_rotor
from rotorid.files.settings import toml_bytes
from rotorid.files.small_model import equations_of
from rotorid.reduction import reduce, small_model
from rotorid.samples import sample_data

SPEED = 150.0
CROSS = ((4e7, 6e6), (-6e6, 5e7))


def turning(damping):
    """A rotor with gyroscopic discs on bearings with cross-coupled stiffness, and internal damping."""
    return fem.Rotor(
        length=[0.2, 0.3, 0.25, 0.3, 0.2],
        outer_diameter=0.07,
        discs=[fem.Disc(3, 40.0, 3.0, 1.6), fem.Disc(5, 25.0, 2.0, 1.1), fem.Disc(6, 10.0, 0.5, 0.3)],
        supports=[fem.Support(2, CROSS, damping), fem.Support(4, CROSS, damping)],
        model=fem.Model(gyroscopic=True),
    )


def farthest(found, expected):
    """Largest distance of an eigenvalue from its next in the other set, relative to its size."""
    assert found.shape == expected.shape
    distance = np.abs(found[:, None] - expected) / np.abs(expected)
    return max(distance.min(axis=0).max(), distance.min(axis=1).max())


def written(tmp_path, motion, **options):
    path = tmp_path / "model.toml"
    path.write_bytes(toml_bytes(equations_of(motion, options.pop("dampers", {}), **options)))
    return path


def singular(motion, eigenvalues):
    """Smallest singular value of λ² M + λ C + K in fractions of the largest, scaled by K."""
    scale = 1 / np.sqrt(np.diag(motion.K))
    scaled = scale[:, None] * scale
    worst = 0.0
    for s in eigenvalues:
        sigma = np.linalg.svd((s * s * motion.M + s * motion.C + motion.K) * scaled, compute_uv=False)
        worst = max(worst, sigma[-1] / sigma[0])
    return worst


def test_plane_of_a_reduced_rotor_through_a_file(tmp_path):
    small = reduce(read_rotor(sample_data() / "rotor23.csv"), (7, 12, 18), 2)
    motion = small.equations_of_motion
    path = written(tmp_path, motion, inputs=["f_x7", "f_x18"], dampers={"x7": 500.0, "x12": 90.0})
    damped = fem.Motion(motion.M, np.diag([500.0, 90.0, 0.0]), motion.K, motion.coordinates, 0.0)
    expected = of_motion(damped)
    found = state_space_of(read_ode_model(path))
    assert farthest(found.eigenvalues, expected.eigenvalues) < 1e-10
    again = of_motion(motion_in(path), inputs=["f_x7", "f_x18"])
    assert farthest(again.eigenvalues, expected.eigenvalues) < 1e-10
    assert (found.inputs, found.outputs) == (again.inputs, again.outputs)
    w = [50.0, 135.0, 700.0]
    np.testing.assert_allclose(frequency_response(found, w), frequency_response(again, w), rtol=1e-9)
    undamped = state_space_of(read_ode_model(path), [0.0, 0.0]).eigenvalues
    np.testing.assert_allclose(np.sort(np.abs(undamped))[::2], small.frequencies, rtol=1e-10)


@pytest.mark.parametrize(
    ("damping", "supports"),
    [(0.0, "condensed"), (0.0, "kept"), (900.0, "kept"), (((900.0, 100.0), (50.0, 700.0)), "kept")],
)
def test_both_planes_with_gyroscopic_discs_and_cross_coupling(tmp_path, damping, supports):
    """Supports that are condensed, and those that are kept: without mass, of first order."""
    small = small_model(turning(damping), (3, 5, 6), [40.0, 25.0, 10.0], modal_damping=(0.01, 0.02))
    motion = small.motion(SPEED, condensed=supports == "condensed")
    shown = ["x3", "x5", "x6", "y3", "y5", "y6"]
    forces = ["f_x3", "f_y6"]
    path = written(tmp_path, motion, inputs=forces, outputs=shown)
    found = state_space_of(read_ode_model(path))
    expected = of_motion(motion, inputs=forces, outputs=shown)
    assert farthest(found.eigenvalues, expected.eigenvalues) < 1e-10
    assert singular(motion, found.eigenvalues) < 1e-9
    assert (found.inputs, found.outputs) == (expected.inputs, expected.outputs)
    w = np.array([20.0, 77.0, 160.0, 400.0])
    np.testing.assert_allclose(
        frequency_response(found, w), frequency_response(expected, w), rtol=1e-9, atol=1e-14
    )


def test_dampers_in_states_act_like_dampers(tmp_path):
    small = small_model(turning(800.0), (3, 5, 6), [40.0, 25.0, 10.0])
    motion = small.motion(SPEED)
    path = written(tmp_path, motion, dampers={"x3": 400.0, "y6": 70.0})
    C = motion.C.copy()
    for name, value in (("x3", 400.0), ("y6", 70.0)):
        C[motion.index(name), motion.index(name)] += value
    damped = fem.Motion(motion.M, C, motion.K, motion.coordinates, SPEED)
    found = state_space_of(read_ode_model(path)).eigenvalues
    assert farthest(found, of_motion(damped).eigenvalues) < 1e-10
    assert farthest(found, small.state_space(SPEED).eigenvalues) > 1e-4
