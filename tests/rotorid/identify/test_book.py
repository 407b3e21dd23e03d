"""Every exercise of [S] from the command line: singular problems, exact data, errors."""

import runpy
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


@pytest.fixture
def identify(cli):
    def run(task, *options, data="data.csv", model=None):
        outcome = cli(
            "identify", model or FOLDER / task / "model.toml", FOLDER / task / data, *options, "--json"
        )
        assert (outcome.code, outcome.err) == (0, "")
        return outcome.json

    return run


@pytest.mark.parametrize("task", EXACT)
def test_exact_data_give_the_parameters_back(identify, task):
    result, expected = identify(task, data="data_exact.csv"), EXPECTED[task]
    lost, exchange = expected.get("undetermined", []), expected.get("exchange", [])
    assert result["identifiable"] is not bool(lost or exchange)
    assert bool(result["unidentifiable"]) is bool(lost or exchange)
    for name, truth in expected["truth"].items():
        entry = result["parameters"][name]
        if name in lost or name in exchange:
            assert entry["value"] is entry["std"] is None
        else:
            assert entry["value"] == pytest.approx(truth, rel=1e-6)
    if exchange:
        pairs = [[solution[name] for name in exchange] for solution in result["solutions"]]
        truth = [expected["truth"][name] for name in exchange]
        np.testing.assert_allclose(sorted(pairs), sorted([truth, truth[::-1]]), rtol=1e-6)


@pytest.mark.parametrize("task", [t for t in EXPECTED if "combinations" in EXPECTED[t]])
@pytest.mark.parametrize(("data", "tolerance"), [("data.csv", 0.3), ("data_exact.csv", 1e-6)])
def test_singular_exercises_name_their_combinations(identify, task, data, tolerance):
    combinations = identify(task, data=data)["combinations"]
    assert [*combinations] == EXPECTED[task]["combinations"]
    known = tomllib.loads((FOLDER / task / "model.toml").read_text()).get("known", {})
    for expression, combination in combinations.items():
        # the words are arithmetic of Python
        expected = eval(expression, {"__builtins__": {}}, EXPECTED[task]["truth"] | known)
        assert combination["value"] == pytest.approx(expected, rel=tolerance)


def test_the_generator_wrote_these_tables(tmp_path):
    copy = tmp_path / "make_data.py"
    copy.write_bytes((FOLDER / "make_data.py").read_bytes())
    runpy.run_path(str(copy), run_name="__main__")
    written = sorted(path.relative_to(tmp_path) for path in tmp_path.glob("*/*.csv"))
    assert written == sorted(path.relative_to(FOLDER) for path in FOLDER.glob("*/*.csv"))
    for path in written:
        if path.name != "data_exact.csv":  # whose last digits depend on the processor
            assert (tmp_path / path).read_text() == (FOLDER / path).read_text(), path


def test_few_degrees_of_freedom_are_told(cli):
    few, more = (
        cli("identify", FOLDER / task / "model.toml", FOLDER / task / "data.csv").out
        for task in ("task_8_1", "task_7_1")
    )
    assert "rest on what is left by 2 degrees of freedom only" in few
    assert "degrees of freedom" not in more


@pytest.mark.parametrize(
    ("of_file", "options", "percent", "degrees"),
    [(True, ("--errors", "2,1"), 2, 1), (True, (), 5, 3), (False, ("--errors", "2,0"), 2, 0)],
)
def test_errors_are_percent_and_degrees_and_options_stand_before_the_file(
    identify, tmp_path, of_file, options, percent, degrees
):
    model, task = tmp_path / "model.toml", "task_5_1"
    text = (FOLDER / task / "model.toml").read_text(encoding="utf-8")
    stated = "\n[errors]\namplitude_percent = 5\nphase_deg = 3\n" if of_file else ""
    model.write_text(text + stated, encoding="utf-8")
    result = identify(task, *options, model=model)["parameters"]
    equations = harmonic_model(["(m*p**2 + alpha*p + c)*X = F"], known={"m": 10.0}, estimate=["c", "alpha"])
    values = {"F": 10.0, "X": [-0.1j, -3.3e-3 - 2.2e-4j, -1.2e-3 - 4.7e-5j]}
    errors = AmplitudeErrors(percent / 100, np.radians(degrees))
    expected = identify_model(equations, experiments(equations, [10, 20, 30], values, errors=errors))
    for name, std in zip(("c", "alpha"), expected.std, strict=True):
        assert result[name]["std"] == pytest.approx(std, rel=1e-9)


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
    outcome = cli("identify", FOLDER / "task_5_1/model.toml", FOLDER / "task_5_1/data.csv", *args)
    assert outcome.code == 2
    assert message in outcome.err
    assert "Traceback" not in outcome.err
