"""Small models for motion as files."""

import numpy as np
import pytest

import fem
from fem import CubicSpring, InternalDamping, JournalBearing, MuszynskaSeal, SqueezeFilm, Stop
from rotorid.files import InputError
from rotorid.files.small_model import read_small_model, small_model_files
from rotorid.reduction import SmallModel
from tests.helpers.cases import each_of

PLAIN = """
nodes = [1, 5, 9]
masses_kg = [10, 80.5, 12]
shaft_stiffness_N_per_m = [[1e6, -2e6, 1e6], [-2e6, 4e6, -2e6], [1e6, -2e6, 1e6]]

[[bearing]]
node = 1
stiffness_N_per_m = 1e7

[[journal_bearing]]
node = 9
length_mm = 50
diameter_mm = 110
clearance_um = 150
viscosity_mPa_s = 4

[[unbalance]]
node = 5
unbalance_g_mm = 500
angle_deg = 90

[[unbalance]]
node = 5
unbalance_g_mm = 500
angle_deg = 90
"""


def written(tmp_path, text):
    path = tmp_path / "small.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def some(seed):
    rng = np.random.default_rng(seed)
    half = rng.normal(size=(4, 3, 3))
    half[0] -= half[0].mean(axis=0)  # a shaft resists no shift
    K, B, G, C = half @ half.swapaxes(1, 2)
    return SmallModel(
        nodes=(2, 7, 30),
        masses=rng.uniform(0, 100, 3),
        weight=rng.uniform(0, 1000, 3),
        stiffness=1e7 * K,
        material_damping=B,
        gyroscopic=G,
        damping=0.0 if seed else 1e3 * C,
        supports=[
            fem.Support(
                2, ((1e7, 2e5), (-2e5, 3e7)), 1e3, "drive", pedestal=fem.Pedestal(5.0, (1e8, 2e8), 10.0)
            ),
            fem.Support(7, -1e5, kind="seal", pedestal=fem.Pedestal(1.0, (1e6, 1e6))),
            fem.Support(30, (1e6, 2e6), 5.0, speeds=(0.0, 100.0)),
        ],
        forces=[
            JournalBearing(30, "far", 0.05, 0.11, 1.5e-4, 0.004, "line of centres"),
            SqueezeFilm(2, "", 0.03, 0.1, 1e-4, 0.01, 1e7),
            MuszynskaSeal(7, "", 1e6, 1e3, 2.0, 0.45, 2e-4, 1.5, 0.3),
            CubicSpring(7, "", 1e4, 1e13),
            Stop(7, "ring", 1e-4, 1e8, 1e3, 0.1, 0.2),
            InternalDamping(7, "", 100.0),
        ],
        unbalance={7: 1e-3 * np.exp(2j)},
        bow={2: 1e-4, 7: -1e-4j, 30: 2e-5 + 1e-5j},
    )


@pytest.mark.parametrize("seed", [0, 1])
def test_what_is_written_is_read(tmp_path, seed):
    model = some(seed)
    path = tmp_path / "small.toml"
    for file, content in small_model_files(path, model, ["a comment"]).items():
        file.write_bytes(content)
    back = read_small_model(path)
    assert back.nodes == model.nodes
    for name in ("masses", "weight", "stiffness", "material_damping", "gyroscopic", "damping"):
        np.testing.assert_array_equal(getattr(back, name), getattr(model, name), err_msg=name)
    assert list(back.supports) == list(model.supports)
    assert list(back.forces) == list(model.forces)
    for name in ("unbalance", "bow"):
        mine, theirs = getattr(back, name), getattr(model, name)
        assert mine.keys() == theirs.keys()
        for node, value in theirs.items():
            assert mine[node] == pytest.approx(value, rel=1e-14)


def test_units_defaults_and_sums(tmp_path):
    model = read_small_model(written(tmp_path, PLAIN))
    np.testing.assert_allclose(model.weight, 9.80665 * np.array([10, 80.5, 12]))
    assert not model.gyroscopic.any()
    assert model.forces == [JournalBearing(9, "", 0.05, 0.11, 150e-6, 4e-3)]
    assert model.supports == [fem.Support(1, 1e7)]
    assert model.unbalance == {5: pytest.approx(1e-3j)}
    assert model.bow == {}


@each_of(
    ("old", "new", "message"),
    [
        ("80.5, 12", "80.5", r"masses: 3 finite numbers for 3 nodes"),
        ("[-2e6, 4e6", "[-2.1e6, 4e6", r"stiffness: a symmetric matrix"),
        (
            "node = 1\n",
            "node = 2\n",
            r"key bearing\[1\].node: found '2', expected a node 1, 5 or 9",
        ),
        (
            "[[unbalance]]",
            "[[bow]]\nnode = 5\nbow_um = 1\nangle_deg = 2\n" * 2 + "[[unbalance]]",
            r"key bow: .*once",
        ),
        (
            "stiffness_N_per_m = 1e7",
            "tilting_stiffness_N_m_per_rad = 1.0\ndamping_N_s_per_m = 1",
            "no slopes",
        ),
    ],
)
def test_bad_files_are_refused_with_file_and_key(tmp_path, old, new, message):
    assert old in PLAIN
    path = written(tmp_path, PLAIN.replace(old, new, 1))
    with pytest.raises(InputError, match=message) as raised:
        read_small_model(path)
    assert str(path) in str(raised.value)
