"""`rotorid reduce` in full: places, methods, response, stability, measured modes, files."""

import json

import numpy as np
import pytest
from scipy.io import loadmat
from timedomain_cases import state_space_of

import fem
from rotorid import read_ode_model, read_rotor, small_model
from rotorid import reduce as reduce_rotor
from rotorid.files import read_small_model
from rotorid.samples import sample_data

ROTOR = sample_data() / "rotor23.csv"
BOOK = sample_data() / "book_task_9"
COMPRESSOR = sample_data() / "compressor" / "rotor.toml"


def test_measured_modes_of_a_rotor_are_used_and_compared(cli):
    own = cli("reduce", ROTOR, "--measured", BOOK / "modes.csv", "--json").json
    assert own["nodes"] == [7, 12, 18]
    np.testing.assert_allclose(own["masses_kg"], [134.203, 196.617, 157.083], atol=2e-3)
    assert not own["warnings"]
    one = cli("reduce", ROTOR, "--measured", BOOK / "modes.csv", "--nodes", "7,20", "--json")
    assert one.code == 2
    assert "no shape was measured at 20" in one.err


@pytest.mark.parametrize("ending", ["json", "npz", "mat"])
def test_the_state_space_has_the_eigenvalues_of_the_model_file(cli, tmp_path, ending):
    space, model = tmp_path / f"space.{ending}", tmp_path / "model.toml"
    for path in (space, model):
        outcome = cli("reduce", ROTOR, "--nodes", "7,12,18", "--output", path)
        assert outcome.code == 0, outcome.err
    if ending == "json":
        found = {key: np.array(value) for key, value in json.loads(space.read_text()).items()}
    else:
        found = dict(np.load(space)) if ending == "npz" else loadmat(space)
    assert "allow_pickle" not in found  # numpy 1.26 stores this argument of savez as an array
    back = state_space_of(read_ode_model(model), np.zeros(3))
    ours = np.sort(np.abs(np.linalg.eigvals(found["A"])))
    np.testing.assert_allclose(ours, np.sort(np.tile(np.abs(back.eigenvalues), 2)), rtol=1e-10)
    names = [str(np.squeeze(name)) for name in np.ravel(found["outputs"])]
    assert names == ["x7", "x12", "x18", "y7", "y12", "y18"]


def test_the_mass_of_a_pedestal_counts_once():
    """The regression sees the rotor alone; the feet come back with the small model."""
    base = read_rotor(ROTOR)
    on_feet, on_springs = (
        fem.Rotor(
            base.length,
            base.outer_diameter,
            discs=base.discs,
            supports=[fem.Support(n, 1e8, pedestal=fem.Pedestal(mass, 4e8)) for n in (2, 22)],
        )
        for mass in (300.0, 0.0)
    )
    feet, springs = (reduce_rotor(rotor, (7, 12, 18), 2) for rotor in (on_feet, on_springs))
    np.testing.assert_allclose(feet.masses.values, springs.masses.values, rtol=1e-12)
    assert "nor masses of pedestals" in feet.warnings[0]
    small = small_model(on_feet, (7, 12, 18), feet.masses.solution)
    own = np.unique(np.round(np.abs(small.state_space().eigenvalues), 6))
    whole = fem.critical_speeds(on_feet, 2).frequencies
    np.testing.assert_allclose(own[:2], whole, rtol=0.005)
    with pytest.raises(ValueError, match="hold the masses of the pedestals"):
        reduce_rotor(on_feet, (7, 12, 18), 2, measured=(feet.rotor_frequencies, feet.rotor_shapes))


def test_measured_shapes_are_compared_with_the_rotor():
    rotor = read_rotor(ROTOR)
    good = reduce_rotor(rotor, (7, 12, 18), 2)
    omega, shapes = good.rotor_frequencies, good.rotor_shapes
    signs = shapes.copy()
    signs[2, 1] *= -1
    turned = reduce_rotor(rotor, (7, 12, 18), 2, measured=(omega[:2], signs[:, :2]))
    assert any("is a mode missing, or a sign wrong?" in text for text in turned.warnings)
    missed = reduce_rotor(rotor, (7, 12, 18), 2, measured=(omega[1:], shapes[:, 1:]))
    assert any("nearest is its mode 2 (MAC 1.00): is a mode missing" in text for text in missed.warnings)


@pytest.mark.parametrize("kept", [(), ("--keep-supports",)])
def test_bearings_over_speed_stand_beside_a_small_model_that_moves(cli, tmp_path, kept):
    """The compressor's tables go with it, whether or not its masses are found on rigid supports."""
    path = tmp_path / "small.toml"
    assert cli("reduce", COMPRESSOR, "--nodes", "8,14,20", "--modes", 1, "--output", path, *kept).code == 0
    assert {each.suffix for each in tmp_path.iterdir()} == {".toml", ".csv"}
    model = read_small_model(path)
    assert all(support.speeds for support in model.supports if support.kind == "bearing")
    found = cli(
        "motion", path, "--speed", "3000rpm", "--time", "0.2s", "--displaced", "14=5um", "--json"
    ).json
    assert found["positions_m"]["14"]
    assert cli("bearings", path, "--speeds", "3000rpm").code == 2  # no film


def test_a_run_down_fitted_with_the_small_model_gives_what_its_model_of_equations_gives(cli, tmp_path):
    """The sample's matrices are those of this reduction; there the mass in the middle is estimated, too."""
    path, sample = tmp_path / "small.toml", sample_data() / "fit" / "run_down"
    assert cli("reduce", ROTOR, "--nodes", "7,12,18", "--modes", 2, "--output", path).code == 0
    text = path.read_text(encoding="utf-8").replace(
        "[equations.estimate]", "[equations.estimate]\nblow = 0.04"
    )
    more = """
    [equations.initial]
    v_x12 = "blow"
    [equations.outputs]
    drive_end = "1e6*x7"
    middle = "1e6*x12"
    free_end = "1e6*x18"
    """
    path.write_text(text + more, encoding="utf-8")
    found = cli("fit", path, sample / "record.csv", "--json")
    assert found.code == 0, found.err
    equations = (sample / "model.toml").read_text(encoding="utf-8")
    mass = reduce_rotor(read_rotor(ROTOR), (7, 12, 18), 2).masses.solution[1]
    equations = equations.replace("m_x12 = 180.0\n", "").replace("m_x12 = [1, inf]\n", "")
    other = tmp_path / "equations.toml"
    other.write_text(equations.replace('"m_x12"', repr(float(mass))), encoding="utf-8")
    expected = cli("fit", other, sample / "record.csv", "--json").json["parameters"]
    assert {*found.json["parameters"]} == {*expected}
    for name, one in expected.items():
        assert found.json["parameters"][name]["value"] == pytest.approx(one["value"], rel=1e-4), name


def test_seals_at_the_masses_go_to_the_right_side(tmp_path, cli):
    base = f'shaft = "{ROTOR}"\n[[seal]]\nnode = 12\nstiffness_N_per_m = 2e6\n'
    path = tmp_path / "sealed.toml"
    path.write_text(base)
    plain = cli("reduce", path, "--nodes", "7,12,18", "--modes", 3, "--json")
    apart = cli("reduce", path, "--nodes", "7,12,18", "--modes", 3, "--supports-apart", "--json")
    assert plain.code == apart.code == 0, plain.err + apart.err
    assert apart.json["seal_stiffness_N_per_m"] == [0.0, 2e6, 0.0]
    # other rows of the same equations: the seal stands in the compliance, or beside it
    np.testing.assert_allclose(apart.json["masses_kg"], plain.json["masses_kg"], rtol=0.01)
