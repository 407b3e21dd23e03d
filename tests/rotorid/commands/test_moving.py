"""What motion and periodic read: rotors with tables of unbalance and bow, and small models."""

import numpy as np
import pytest

from fem import JournalBearing, Rotor
from rotorid.commands.motion_inputs import moving
from rotorid.files import InputError
from rotorid.files.small_model import small_model_files
from rotorid.reduction import SmallModel

FILM = {"length": 0.02, "diameter": 0.05, "clearance": 5e-5, "viscosity": 0.02}
ROTOR = Rotor(
    length=[0.2] * 4,
    outer_diameter=0.05,
    stations={"disc": 3},
    forces=[JournalBearing(1, **FILM), JournalBearing(5, **FILM)],
)
SMALL = SmallModel(
    (1, 3, 5), [0.0, 9.0, 0.0], [1.0, 88.0, 1.0], [[1e7, -2e7, 1e7], [-2e7, 4e7, -2e7], [1e7, -2e7, 1e7]],
    forces=ROTOR.forces, unbalance={3: 1e-4 + 2e-5j},
)  # fmt: skip


def test_a_rotor_with_its_tables(tmp_path):
    (tmp_path / "u.csv").write_text("plane,unbalance_g_mm,angle_deg\ndisc,100,90\n")
    (tmp_path / "b.csv").write_text("node,bow_um,angle_deg\n1,0,0\ndisc,20,0\n5,0,0\n")
    found = moving(ROTOR, tmp_path / "u.csv", str(tmp_path / "b.csv"), direction=180.0)
    system = found.system(10.0, 500.0)
    x, y = system.index(3)
    np.testing.assert_allclose(system.unbalance[[x, y]], [1e-4j, 1e-4], rtol=1e-12, atol=1e-20)
    assert system.bow[x].real > 0
    assert system.weight[x] < 0
    assert system.weight[y] == 0
    assert (found.model.node("disc"), found.model.node("4")) == (3, 4)


def test_a_small_model_has_its_own(tmp_path):
    path = tmp_path / "small.toml"
    path.write_bytes(small_model_files(path, SMALL)[path])
    found = moving(path)
    assert isinstance(found.model, SmallModel)
    assert found.model.node("3") == 3
    x, y = (system := found.system(10.0, 500.0)).index(3)
    np.testing.assert_allclose(system.unbalance[[x, y]], [1e-4 + 2e-5j, 2e-5 - 1e-4j])
    with pytest.raises(ValueError, match="node 2 does not exist: the small model has 1, 3 and 5"):
        found.model.node("2")


def test_tables_stand_in_place_of_a_small_model_s_own(tmp_path):
    """The same tables as of the rotor; nodes that the small model has not are refused with their row."""
    (tmp_path / "u.csv").write_text("plane,mass_g,radius_mm,angle_deg\n3,2,50,90\n3,1,100,0\n")
    (tmp_path / "b.csv").write_text("node,bow_um,angle_deg\n1,0,0\n3,20,0\n5,0,0\n")
    found = moving(SMALL, tmp_path / "u.csv", tmp_path / "b.csv")
    x, y = (system := found.system(10.0, 500.0)).index(3)
    np.testing.assert_allclose(system.unbalance[[x, y]], [1e-4 + 1e-4j, 1e-4 - 1e-4j], rtol=1e-12)
    whole = moving(ROTOR, tmp_path / "u.csv").system(10.0, 500.0)
    np.testing.assert_array_equal(whole.unbalance[[*whole.index(3)]], system.unbalance[[x, y]])
    assert system.bow[x].real == pytest.approx(4e7 * 20e-6)
    (tmp_path / "u.csv").write_text("plane,unbalance_g_mm,angle_deg\n4,2,0\n")
    with pytest.raises(InputError, match=r"row 2, column plane: .* the small model has 1, 3 and 5"):
        moving(SMALL, tmp_path / "u.csv")
