"""Mutations: the same from a seed, of one line, still Python; and the tests that they meet."""

from pathlib import Path

import mutants
import mutation
from cases import each_of

import fem

ROOT = Path(__file__).resolve().parents[2]


def changed(source):
    """The lines that the mutations of a source make of it, without spaces at their ends."""
    return {each.shown(source)[1] for each in mutation.possible("fem/x.py", source)}


@each_of(
    ("line", "expected"),
    [
        ("a = b + c", {"a = b - c"}),
        ("a = b * 2", {"a = b / 2", "a = b * 3"}),
        ("a = 0.5 / b", {"a = 0.5 * b", "a = 0.25 / b"}),
        ("a += b", {"a -= b"}),
        ("a = -b", {"a = +b"}),
        ("a = b[0]", {"a = b[1]"}),
        ("a = b[:, -1]", {"a = b[:, -2]"}),
        ("a = b[i]", {"a = b[i + 1]"}),
        ("a = b < c", {"a = b <= c", "a = b > c"}),
        ("a = b == 3", {"a = b != 3", "a = b == 4"}),
        ("a = b and c", {"a = b or c"}),
        ("a = b.conj()", {"a = b"}),
        ("a = np.conj(b) @ c", {"a = (b) @ c"}),
        ("a = abs(b)", {"a = (b)"}),
        ("a = b if c else d", {"a = b if (not (c)) else d"}),
        ("a = [b for b in c if b]", {"a = [b for b in c if (not (b))]"}),
        ("a = 'ü' + str(b[0])", {"a = 'ü' + str(b[1])"}),
        ("a = f'{b + 1:8.2f} {c[0]}'", set()),
        ("a: tuple[int, ...] = b", set()),
        ("a = b < 1e-9", {"a = b <= 1e-9", "a = b > 1e-9"}),
        ("a += [b]", set()),
        ("ü = b[0] - c", {"ü = b[1] - c", "ü = b[0] + c"}),
    ],
)
def test_what_is_made_of_a_line(line, expected):
    assert changed(line) == expected


def test_texts_and_looks_of_pictures_stay():
    source = '"""1 + 1"""\ndef f(x: Literal[1]) -> Literal[2]:\n    """2 * 3"""\n    ax.plot(x, lw=2 * x)\n'
    assert mutation.possible("fem/plots.py", source) == ()
    assert len(mutation.possible("fem/model.py", source)) == 2


def test_an_operator_over_several_lines_changes_its_own_line():
    [found] = mutation.possible("fem/x.py", "def f(a, b):\n    return (\n        a\n        + b\n    )\n")
    assert (found.line, found.old, found.new, found.function) == (4, "+", "-", "f")


def test_functions_have_the_names_that_the_interpreter_gives():
    source = (
        "class A:\n    def f(self):\n        def g(x):\n            return -x\n        return g\nb = -c\n"
    )
    names = {}
    exec(source.replace("b = -c", ""), names)
    inner, outside = mutation.possible("fem/x.py", source)
    assert inner.function == names["A"]().f().__qualname__ == "A.f.<locals>.g"
    assert outside.function == ""


def test_a_draw_is_fixed_by_its_seed_and_spread_over_the_packages():
    first, again, other = (mutation.draw(ROOT, seed, 60) for seed in (1, 1, 2))
    assert first == again
    assert first != other
    assert len({(each.path, each.line) for each in first}) == len(first) == 60
    parts = {
        package: sum(each.path.startswith(f"{package}/") for each in first) for package in mutation.PACKAGES
    }
    sizes = {p: sum(mutation.code_lines(text) for _, text in mutation.modules(ROOT, p)) for p in parts}
    assert parts == mutation.shares(60, sizes)
    assert min(parts.values()) >= 5
    for each in first + other:
        source = (ROOT / each.path).read_text(encoding="utf-8")
        after = each.applied(source)
        compile(after, each.path, "exec")
        lines = list(zip(source.split("\n"), after.split("\n"), strict=True))
        assert [number for number, (old, new) in enumerate(lines, 1) if old != new] == [each.line]


def test_shares_are_of_largest_remainders():
    assert mutation.shares(10, {"a": 1, "b": 1, "c": 1}) == {"a": 4, "b": 3, "c": 3}
    assert mutation.shares(7, {"a": 60, "b": 25, "c": 15}) == {"a": 4, "b": 2, "c": 1}


def of_function(function, path="fem/peaks.py"):
    return mutation.Mutation(path, 1, 0, 1, "+", "-", function)


def test_tests_of_the_module_come_first_and_short_ones_before_long_ones():
    names = ["tests/test_cli.py::c", "tests/fem/test_peaks.py::long", "tests/test_fem_peaks.py::short"]
    seconds = dict(zip(names, (0.1, 9.0, 0.5), strict=True)) | {"tests/fem/test_speed.py::uses": 0.2}
    everything = {"fem/peaks.py::f": set(seconds), "fem/peaks.py::g": {names[1]}}
    suite = mutants.Suite(seconds | {"tests/test_other.py::no": 0.1, names[1] + "er": 1.0}, everything)
    imports = {name.partition("::")[0]: set() for name in suite.seconds}
    imports["tests/fem/test_speed.py"] = {"fem.peaks"}
    beside = names[1] + "er"
    found = mutants.order(of_function("f"), suite, imports)
    assert found == [names[2], names[1], "tests/fem/test_speed.py::uses", names[0], beside]
    assert mutants.order(of_function("g"), suite, imports) == [names[1], beside]
    assert mutants.order(of_function("never"), suite, imports) == []
    assert set(mutants.order(of_function(""), suite, imports)) == {*seconds, beside}


def test_a_fixture_and_an_import_count_for_all_tests_that_use_them():
    document = {
        "functions": ["fem/a.py::f", "fem/a.py::g", "fem/a.py::h"],
        "ran": {"fixture tests::made": [0], "file tests/test_a.py": [1], "test tests/test_a.py::one": [2]},
        "tests": {
            "tests/test_a.py::one": {"fixtures": [], "seconds": 1.0, "outcome": "passed"},
            "tests/test_a.py::two": {
                "fixtures": ["fixture tests::made"],
                "seconds": 2.0,
                "outcome": "passed",
            },
            "tests/test_a.py::bad": {"fixtures": [], "seconds": 2.0, "outcome": "failed"},
        },
    }
    suite = mutants.of_documents([document])
    one, two = "tests/test_a.py::one", "tests/test_a.py::two"
    assert suite.runs == {"fem/a.py::f": {two}, "fem/a.py::g": {one, two}, "fem/a.py::h": {one}}
    assert suite.failing == ["tests/test_a.py::bad"]


def test_imports_are_followed_through_helpers_and_packages(tmp_path):
    (tmp_path / "helper.py").write_text("from fem import critical_speeds\n", encoding="utf-8")
    (tmp_path / "test_it.py").write_text("import helper\nimport balancing.check\n", encoding="utf-8")
    found = mutants.imported(tmp_path / "test_it.py")
    assert found == {"fem", fem.critical_speeds.__module__, "balancing.check"}


def test_a_survivor_is_told_with_what_was_tried():
    mutant = mutants.Mutant(of_function("f"), [])
    assert mutant.words == "SURVIVED: no test runs this function"
    mutant.tried = 3
    assert mutant.words == "SURVIVED 3 tests"
    mutant.tests = ["a", "b"]
    assert mutant.words == "SURVIVED 3 of 5, time over tests"
    mutant.killer = "a"
    assert mutant.words == "killed by a"
