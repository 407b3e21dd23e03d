"""Models in time from rotors: matrices of finite elements and of small models, through their files."""

import numpy as np

import fem
from rotorid.identify.fit_records import fit
from rotorid.identify.records import Record
from rotorid.identify.second_order import second_order
from rotorid.identify.simulation import simulate


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
