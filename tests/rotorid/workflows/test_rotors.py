"""campbell, influence, response and reduce from Python: the document of the command, in SI or as text."""

import dataclasses

import numpy as np
import pytest

from rotorid import read_rotor, read_unbalance
from rotorid.samples import sample_data
from rotorid.workflows.campbell import CampbellOptions, campbell
from rotorid.workflows.influence import InfluenceOptions, influence
from rotorid.workflows.reduce import ReduceOptions, reduce
from rotorid.workflows.response import ResponseOptions, response

ROTOR = sample_data() / "rotor23.csv"
COMPRESSOR = sample_data() / "compressor" / "rotor.toml"
UNBALANCE = sample_data() / "compressor" / "unbalance.csv"
BOOK = sample_data() / "book_task_9"
RPM = np.pi / 30
CASES = {
    "campbell": (
        campbell,
        (ROTOR,),
        CampbellOptions(speeds="500:5500:1000rpm", number=4, operating="1500:2500rpm"),
        CampbellOptions(
            speeds=RPM * np.arange(500.0, 5501.0, 1000.0), number=4, operating=(1500 * RPM, 2500 * RPM)
        ),
    ),
    "influence": (
        influence,
        (ROTOR,),
        InfluenceOptions(planes="7,12", sensors="2:45,22", speeds="100,120"),
        InfluenceOptions(planes=[7, 12], sensors=[(2, 45.0), 22], speeds=[100.0, 120.0]),
    ),
    "response": (
        response,
        (COMPRESSOR, UNBALANCE),
        ResponseOptions(
            speeds="4000:6000:500rpm", sensors="probe DE:45", operating="5300:6500rpm", at="5000rpm"
        ),
        ResponseOptions(
            speeds=RPM * np.arange(4000.0, 6001.0, 500.0),
            sensors=[("probe DE", 45.0)],
            operating=(5300 * RPM, 6500 * RPM),
            at=5000 * RPM,
        ),
    ),
    "reduce": (
        reduce,
        (ROTOR,),
        ReduceOptions(
            nodes="7,12,18",
            modes=2,
            normalise="largest",
            rows="relative",
            errors="compliance=1,U31=2",
            what_if="alpha12=1.3",
            response="20:300:70",
            stability="0:3000rpm",
            damping="1,0.5",
            methods=True,
        ),
        ReduceOptions(
            nodes=[7, 12, 18],
            modes=2,
            normalise="largest",
            rows="relative",
            errors={"compliance": 0.01, "U31": 0.02},
            what_if={"alpha12": 0.013},
            response=[20.0, 90.0, 160.0, 230.0, 300.0],
            stability=(0.0, 3000 * RPM),
            damping=[0.01, 0.005],
            methods=True,
        ),
    ),
    "reduce tables": (
        reduce,
        (None,),
        ReduceOptions(compliance=BOOK / "compliance.csv", measured=BOOK / "modes.csv", seals="12=2e6"),
        ReduceOptions(
            compliance=str(BOOK / "compliance.csv"), measured=str(BOOK / "modes.csv"), seals={"12": 2e6}
        ),
    ),
}


def words(options):
    """The options of a command line that are not the defaults."""
    for field in dataclasses.fields(options):
        value = getattr(options, field.name)
        if value is True:
            yield f"--{field.name.replace('_', '-')}"
        elif value is not False and value is not None and value != field.default:
            yield from (f"--{field.name.replace('_', '-')}", str(value))


def same(one, other):
    """Whether two documents say the same: numbers to rounding."""
    if isinstance(one, dict):
        assert list(one) == list(other)
        for key, value in one.items():
            same(value, other[key])
    elif isinstance(one, list):
        assert len(one) == len(other)
        for pair in zip(one, other, strict=True):
            same(*pair)
    else:
        assert other == (pytest.approx(one, rel=1e-7, abs=1e-12) if isinstance(one, float) else one)


@pytest.mark.full
@pytest.mark.parametrize("name", CASES)
def test_python_gives_what_the_command_prints(cli, tmp_path, name):
    work, data, text, si = CASES[name]
    files = [data[0], "--unbalance", data[1]] if len(data) == 2 else [path for path in data if path]
    more = ("--state-space", tmp_path / "s.json") if name == "reduce" else ()
    outcome = cli(name.split()[0], *files, *words(text), *more, "--json")
    assert outcome.code == 0, outcome.err
    printed, own = outcome.json, work(*data, text)
    there, here = (document.pop("provenance") for document in (printed, own.document))
    assert there | {"date": here["date"]} == here
    assert printed.pop("schema_version") == own.document["schema_version"]
    given = {field.name for field in dataclasses.fields(text) if getattr(text, field.name) != field.default}
    assert set(here["options"]) == given
    same(printed, own.to_dict())
    same(printed, work(*data, si).to_dict())
    assert own.summary()


@pytest.mark.full
def test_a_rotor_and_its_unbalance_need_no_file():
    rotor, unbalance = read_rotor(COMPRESSOR), read_unbalance(UNBALANCE, read_rotor(COMPRESSOR))
    options = CASES["response"][2]
    found = response(rotor, unbalance, options)
    same(response(COMPRESSOR, UNBALANCE, options).to_dict(), found.to_dict())
    assert found.provenance["inputs"] == []
    with pytest.raises(ValueError, match="view '3d' is not known"):
        found.figure("3d")
    with pytest.raises(ValueError, match="asked for from"):
        response(rotor, unbalance, dataclasses.replace(options, at=900.0))


def test_the_small_model_is_made_when_it_is_asked_for():
    found = reduce(read_rotor(ROTOR), ReduceOptions(nodes=(7, 12, 18), damping=(), force=[12]))
    assert found.small is None
    assert found.with_small().small.modal_damping == ()
    assert "[states]" not in found.with_small().model_bytes("rotor").decode()
    assert "f_x12" in found.model_bytes().decode()
    assert found.state_space_bytes().startswith(b"{")
    assert found.with_small().with_small().to_dict()["small_model"]


def test_forces_act_on_masses_from_tables_too(cli, tmp_path):
    tables = ("--compliance", BOOK / "compliance.csv", "--measured", BOOK / "modes.csv")
    path = tmp_path / "m.toml"
    assert cli("reduce", *tables, "--force", "12", "--model", path).code == 0
    assert '"f_x12"' in path.read_text()


def test_a_measured_rotor_is_used_beside_its_model():
    found = reduce(ROTOR, ReduceOptions(measured=BOOK / "modes.csv"))
    assert [entry["file"] for entry in found.provenance["inputs"]] == [str(ROTOR), str(BOOK / "modes.csv")]
    assert found.document["source"] == "measured"
