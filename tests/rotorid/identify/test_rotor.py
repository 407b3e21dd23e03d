"""Models in time from rotors: the finite elements' matrices, reduced models, and their files."""

from __future__ import annotations

import numpy as np

import fem
from rotorid.files import read_ode_model, read_rotor
from rotorid.identify.fit_records import fit
from rotorid.identify.records import Record
from rotorid.identify.second_order import second_order
from rotorid.identify.simulation import simulate
from rotorid.reduction import reduce
from rotorid.samples import sample_data

ROTOR = sample_data() / "rotor23.csv"


def test_bearing_of_a_finite_element_rotor_from_its_decay():
    """A bearing's stiffness and damping from the motion of two nodes, three elements, no reduction."""
    shaft = fem.Rotor(length=[0.3, 0.4, 0.3], outer_diameter=0.06, discs=[fem.Disc(2, 20.0)])
    motion = fem.equations_of_motion(shaft, plane="x")
    M, C, K = (matrix.tolist() for matrix in (motion.M, motion.C, motion.K))
    for matrix, name, added in (
        (K, "x1", "k"),
        (K, "x4", 2e7),
        (C, "x1", "c"),
        (C, "x4", 500),
        (M, "x3", "m"),
    ):
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
    assert model.linear_driven
    t = np.linspace(0.0, 0.2, 201)
    truth = np.array([1.1e7, 700.0, 6.0])
    y = simulate(model, truth, t).y + 0.5 * np.random.default_rng(3).standard_normal((201, 2))
    found = fit(model, Record(t, {"near": y[:, 0], "far": y[:, 1]}))
    assert found.converged
    assert found.reliable
    assert np.abs((found.values - truth) / found.std).max() < 4
    assert (found.std < 0.05 * truth).all()


def test_sample_has_the_matrices_of_the_reduction():
    model = read_ode_model(sample_data() / "fit" / "run_down" / "model.toml")
    small = reduce(read_rotor(ROTOR), (7, 12, 18), 2)
    theta = np.array([0.0, 0.0, 0.0, small.masses.solution[1], 0.0])
    A = model.matrices(theta)[0, :, :6]
    found = np.unique(np.abs(np.linalg.eigvals(A)).round(8))
    np.testing.assert_allclose(found, small.frequencies, rtol=1e-9)


def test_model_with_a_negative_mass_is_not_written(cli, tmp_path):
    path = tmp_path / "bad.toml"
    outcome = cli("reduce", ROTOR, "--nodes", "2,3,23", "--modes", "2", "--output", path)
    assert outcome.code == 2
    assert "not positive" in outcome.err
    assert not path.exists()
