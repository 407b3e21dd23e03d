"""Every exercise of [S] from the command line: singular problems, exact data, options."""

import tomllib

import numpy as np
import pytest

from rotorid.identify import AmplitudeErrors, harmonic_model
from rotorid.identify import identify as identify_model
from rotorid.identify.amplitudes import experiments
from rotorid.samples import sample_data

FOLDER = sample_data() / "identify"
EXPECTED = {
    path.parent.name: tomllib.loads(path.read_text(encoding="utf-8"))
    for path in sorted(FOLDER.glob("*/expected.toml"))
}
EXACT = [path.parent.name for path in sorted(FOLDER.glob("*/data_exact.csv"))]
KEYS = {
    "parameters", "rank", "condition_number", "identifiable", "unidentifiable", "combinations", "solutions",
    "residual_rms", "warnings", "provenance",
}  # fmt: skip


@pytest.fixture
def identify(cli):
    def run(task, *options, data="data.csv"):
        outcome = cli("identify", FOLDER / task / "model.toml", FOLDER / task / data, *options, "--json")
        assert outcome.code == 0, outcome.err
        assert outcome.err == ""
        return outcome.json

    return run


@pytest.mark.parametrize("task", EXACT)
def test_exact_data_give_the_parameters_back(identify, task):
    found = identify(task, data="data_exact.csv")
    expected = EXPECTED[task]
    lost = expected.get("undetermined", [])
    exchange = expected.get("exchange", [])
    assert found["identifiable"] is not bool(lost or exchange)
    assert bool(found["unidentifiable"]) is bool(lost or exchange)
    for name, truth in expected["truth"].items():
        value = found["parameters"][name]["value"]
        if name in lost or name in exchange:
            assert value is None
            assert found["parameters"][name]["std"] is None
        else:
            assert value == pytest.approx(truth, rel=1e-6)
    if exchange:
        pairs = [[solution[name] for name in exchange] for solution in found["solutions"]]
        truth = [expected["truth"][name] for name in exchange]
        np.testing.assert_allclose(sorted(pairs), sorted([truth, truth[::-1]]), rtol=1e-6)
        assert "exchanged" in " ".join(found["unidentifiable"])


@pytest.mark.parametrize("task", [t for t in EXPECTED if "combinations" in EXPECTED[t]])
@pytest.mark.parametrize("data", ["data.csv", "data_exact.csv"])
def test_singular_exercises_name_their_combinations(identify, task, data):
    found = identify(task, data=data)
    words = list(found["combinations"])
    assert words == EXPECTED[task]["combinations"]
    truth = {
        **EXPECTED[task]["truth"],
        **tomllib.loads((FOLDER / task / "model.toml").read_text()).get("known", {}),
    }
    tolerance = 1e-6 if data == "data_exact.csv" else 0.3
    for expression, combination in found["combinations"].items():
        expected = eval(expression, {"__builtins__": {}}, truth)  # the words are arithmetic of Python
        assert combination["value"] == pytest.approx(expected, rel=tolerance)


def test_two_digits_give_the_parameters_roughly(identify):
    """The book's rounding: no parameter of a simulated exercise is off by more than its interval allows."""
    for task in EXACT:
        found = identify(task)
        for name, entry in found["parameters"].items():
            if entry["value"] is None:
                continue
            gap = abs(entry["value"] - EXPECTED[task]["truth"][name])
            assert gap <= 8 * entry["std"], (task, name)


def test_the_generator_wrote_these_tables(tmp_path, monkeypatch):
    import runpy

    script = FOLDER / "make_data.py"
    copy = tmp_path / "make_data.py"
    copy.write_bytes(script.read_bytes())
    runpy.run_path(str(copy), run_name="__main__")
    written = sorted(path.relative_to(tmp_path) for path in tmp_path.glob("*/*.csv"))
    assert written == sorted(path.relative_to(FOLDER) for path in FOLDER.glob("*/*.csv"))
    for path in written:
        if path.name != "data_exact.csv":  # whose last digits depend on the processor
            assert (tmp_path / path).read_text() == (FOLDER / path).read_text(), path


def test_few_degrees_of_freedom_are_told(cli):
    few, more = (
        cli("identify", FOLDER / task / "model.toml", FOLDER / task / "data.csv")
        for task in ("task_8_1", "task_7_1")
    )
    assert "rest on what is left by 2 degrees of freedom only" in few.out
    assert "degrees of freedom" not in more.out


def test_stated_errors(identify):
    found = identify("task_5_1", "--errors", "2,1")
    assert found["method"] == "output-error"
    for name, truth in {"c": 1000.0, "alpha": 10.0}.items():
        low, high = found["parameters"][name]["ci95"]
        assert low < truth < high
        assert high - low < 0.1 * truth
    assert found["provenance"]["options"]["errors"] == "2,1"
    assert found["correlation"]["c"]["c"] == pytest.approx(1)


def test_errors_of_the_command_line_are_percent_and_degrees_and_stand_before_those_of_the_file(cli, tmp_path):
    folder = FOLDER / "task_5_1"
    text = (folder / "model.toml").read_text(encoding="utf-8")
    model = tmp_path / "model.toml"
    model.write_text(f"{text}\n[errors]\namplitude_percent = 5\nphase_deg = 3\n", encoding="utf-8")
    equations = harmonic_model(["(m*p**2 + alpha*p + c)*X = F"], known={"m": 10.0}, estimate=["c", "alpha"])
    values = {"F": 10.0, "X": [-0.1j, -3.3e-3 - 2.2e-4j, -1.2e-3 - 4.7e-5j]}
    for options, percent, degrees in (
        (("--errors", "2,1"), 2, 1),
        ((), 5, 3),
    ):
        found = cli("identify", model, folder / "data.csv", *options, "--json").json["parameters"]
        errors = AmplitudeErrors(percent / 100, np.radians(degrees))
        expected = identify_model(equations, experiments(equations, [10, 20, 30], values, errors=errors))
        for k, name in enumerate(("c", "alpha")):
            assert found[name]["std"] == pytest.approx(expected.std[k], rel=1e-9)
    bare = cli("identify", folder / "model.toml", folder / "data.csv", "--errors", "2,0", "--json").json
    expected = identify_model(
        equations, experiments(equations, [10, 20, 30], values, errors=AmplitudeErrors(0.02, 0.0))
    )
    assert bare["parameters"]["c"]["std"] == pytest.approx(expected.std[0], rel=1e-9)


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (("--errors", "-1,1"), "percent of an amplitude"),
        (("--errors", "1,nan"), "percent of an amplitude"),
        (("--errors", "0,0"), "greater than zero"),
        (("--plot", "x.gif"), ".png, .svg, .pdf"),
    ],
)
def test_bad_options_end_with_one_message(cli, args, message):
    folder = FOLDER / "task_5_1"
    outcome = cli("identify", folder / "model.toml", folder / "data.csv", *args)
    assert outcome.code == 2
    assert message in outcome.err
    assert "Traceback" not in outcome.err
