"""`rotorid reduce` in full: places, methods, response, stability, measured modes, files."""

import json
from pathlib import Path

import numpy as np
import pytest
from cases import each_of
from scipy.io import loadmat
from timedomain_cases import state_space_of

import fem
from rotorid import read_ode_model, read_rotor, small_model
from rotorid import reduce as reduce_rotor
from rotorid.files import read_small_model
from rotorid.samples import sample_data

ROTOR = sample_data() / "rotor23.csv"
BOOK = sample_data() / "book_task_9"
MOTION = sample_data() / "motion"
COMPRESSOR = sample_data() / "compressor" / "rotor.toml"


def book(which, modes, *more):
    return (
        "reduce", "--compliance", BOOK / f"compliance{which}.csv", "--measured", BOOK / f"modes{which}.csv",
        "--modes", modes, *more,
    )  # fmt: skip


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


@each_of(
    ("arguments", "message"),
    [
        ((ROTOR,), "say where the masses stand"),
        ((), "give a rotor, or --compliance and --measured"),
        ((ROTOR, "--nodes", "7,12", "--place", "best"), "choose one"),
        ((ROTOR, "--nodes", "7,12", "--errors", "alpha13=1"), "'alpha13' is not known"),
        ((ROTOR, "--nodes", "7,12", "--errors", "stiffness=1"), "'stiffness' is not known"),
        ((ROTOR, "--nodes", "7,12", "--errors", "compliance"), "is no NAME=VALUE"),
        ((ROTOR, "--nodes", "7,12", "--errors", "compliance=x"), "compliance=x is no NAME=NUMBER"),
        ((ROTOR, "--nodes", "7,12", "--errors", "compliance=1,compliance=2"), "stands twice"),
        ((ROTOR, "--nodes", "7,12", "--errors", "compliance=-1"), "from 0 to 100 percent"),
        ((ROTOR, "--nodes", "7,12,18", "--stability", "100"), "--stability '100' is not a range"),
        ((ROTOR, "--nodes", "7,12", "--compliance", BOOK / "compliance.csv"), "takes the place of a rotor"),
        ((ROTOR, "--nodes", "7,12", "--output", "x.txt"), "cannot write this kind of file"),
        ((*book("", 2)[1:], "--place", "mac"), "--place needs a rotor"),
        ((*book("", 2)[1:], "--seals", "9=1e6"), "no mass stands at '9'"),
        ((*book("", 4)[1:],), "can use 1 … 3 modes"),
    ],
)
def test_what_cannot_be_is_refused(cli, arguments, message):
    outcome = cli("reduce", *arguments)
    assert outcome.code == 2
    assert message in outcome.err
    assert outcome.out == ""


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


def test_masses_that_nobody_would_believe_are_said():
    rotor = read_rotor(ROTOR)
    one = reduce_rotor(rotor, (2,), 1)
    assert any("more than the rotor" in text for text in one.warnings)
    two = reduce_rotor(rotor, (2, 23), 1)
    assert any("far off: mode 2 by -7" in text for text in two.warnings)


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


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (("--masses", 4), "--masses does nothing without --place"),
        (("--measured", BOOK / "modes.csv", "--methods"), "--methods compares with the computed rotor"),
        (("--response", "1:2"), "--response '1:2' is not a range"),
    ],
)
def test_options_without_effect_are_refused(cli, more, message):
    outcome = cli("reduce", ROTOR, "--nodes", "7,12,18", *more)
    assert outcome.code == 2
    assert message in outcome.err


def test_the_sample_small_model_is_what_its_command_makes(cli, tmp_path, monkeypatch):
    monkeypatch.chdir(Path(__file__).resolve().parents[3])
    stored = MOTION / "small.toml"
    made = tmp_path / "small.toml"
    said = (MOTION / "README.md").read_text(encoding="utf-8")
    command = said.partition("`rotorid reduce ")[2].partition("small.toml`")[0]
    assert cli("reduce", *command.split(), made).code == 0
    mine, theirs = read_small_model(made), read_small_model(stored)
    first, again = (path.read_text(encoding="utf-8").splitlines()[0] for path in (made, stored))
    assert first == again
    assert mine.nodes == theirs.nodes == (2, 7, 12, 18, 22)
    assert mine.forces == theirs.forces
    unbalanced = (MOTION / "unbalanced.toml").read_text(encoding="utf-8")
    assert unbalanced.startswith(stored.read_text(encoding="utf-8"))
    assert list(read_small_model(MOTION / "unbalanced.toml").unbalance) == [7, 18]
    for name in ("masses", "weight", "stiffness", "damping"):
        stated = getattr(theirs, name)
        np.testing.assert_allclose(getattr(mine, name), stated, rtol=1e-7, atol=1e-9 * np.abs(stated).max())


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


def test_a_small_model_is_fitted_and_simulated(cli, tmp_path):
    """The same file as `motion` reads: a damper at each mass is estimated."""
    path = tmp_path / "small.toml"
    assert cli("reduce", ROTOR, "--nodes", "7,12,18", "--modes", 2, "--output", path).code == 0
    model = read_ode_model(path)
    assert [*model.parameters] == ["d_x7", "d_x12", "d_x18"]
    assert cli("motion", path, "--speed", "3000rpm", "--time", "0.1s", "--displaced", "12=5um").code == 0
    given = ("--with", "d_x7=0,d_x12=1500,d_x18=0", "--times", "0:0.1:0.01", "--json")
    assert cli("simulate", path, *given).code == 0
    start = "[equations.initial]\nx12 = 1e-4\n"
    path.write_text(path.read_text(encoding="utf-8") + start, encoding="utf-8")
    moved = cli("simulate", path, *given, "--output", tmp_path / "s.csv")
    assert moved.code == 0, moved.err
    assert "0.0001" in (tmp_path / "s.csv").read_text()


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


def test_what_is_not_linear_is_not_fitted(cli):
    small, record = MOTION / "small.toml", sample_data() / "fit" / "run_down" / "record.csv"
    refused = cli("fit", small, record)
    assert refused.code == 2
    assert "`rotorid motion` follows the others" in refused.err


@each_of(
    ("arguments", "message"),
    [
        ((MOTION / "rotor.toml", "--nodes", "7,12"), "reduce it with --keep-supports"),
        ((ROTOR, "--nodes", "2,7", "--keep-supports"), "node 2 is held rigidly while the masses are found"),
        (
            (ROTOR, "--nodes", "7", "--keep-supports", "--speed", "10"),
            "--speed asks for the rotor on its supp",
        ),
        (
            (ROTOR, "--nodes", "7", "--keep-supports", "--stability", "0:9"),
            "--stability asks for the rotor on",
        ),
        (
            (ROTOR, "--nodes", "7,12,18", "--keep-supports", "--output", "m.npz"),
            "m.npz: with --keep-supports the small model is for motion",
        ),
        (("--compliance", ROTOR, "--measured", ROTOR, "--keep-supports"), "--keep-supports needs a rotor"),
    ],
)
def test_kept_supports_are_refused(cli, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    refused = cli("reduce", *arguments)
    assert refused.code == 2
    assert message in " ".join(refused.err.split())
    assert not (tmp_path / "m.toml").exists()


def test_all_triples_are_ranked_and_the_trap_is_not_chosen(cli):
    for place, nodes in (("best", [3, 11, 14]), ("compromise", [4, 10, 16]), ("book", [7, 12, 18])):
        assert cli("reduce", ROTOR, "--place", place, "--json").json["nodes"] == nodes
    few = cli("reduce", ROTOR, "--place", "compromise", "--candidates", "7,12,18,20", "--json").json
    assert few["placement"]["considered"] == 4
    document = cli("reduce", ROTOR, "--place", "compromise", "--json").json
    assert document["nodes"] == [4, 10, 16]
    assert document["placement"]["best_by_frequency"]["nodes"] == [3, 11, 14]
    assert document["placement"]["book_rule"]["nodes"] == [7, 12, 18]


def test_kept_supports_in_the_document_and_in_places(cli, tmp_path):
    kept = ("--nodes", "7,12,18", "--keep-supports")
    document = cli("reduce", MOTION / "rotor.toml", *kept, "--json").json
    assert document["small_model"]["nodes"] == sorted([2, 22, *document["nodes"]])
    assert sum(document["small_model"]["weight_N"]) == pytest.approx(9.80665 * 558.5346506833)
    words = ("--place", "compromise", "--masses", 2, "--keep-supports", "--json")
    ranked = cli("reduce", MOTION / "rotor.toml", *words).json
    assert not {2, 22} & {node for choice in ranked["placement"]["choices"] for node in choice["nodes"]}
    path = tmp_path / "small.toml"
    cli("reduce", ROTOR, *kept, "--output", path, "--report", tmp_path / "page.html")
    model = read_small_model(path)
    assert model.supports == [fem.Support(2, 1e8), fem.Support(22, 1e8)]


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
