"""A short run of the fuzzer, the same every time; `make fuzz` is the long one."""

import pytest
from repetitions import FULL

from fuzz.examining import CHANGED, FINDING, REFUSED, SAME, bench, examine, judge
from fuzz.subjects import SUBJECTS

MUTANTS = 500 if FULL else 40


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("fuzz")


def test_no_mutant_breaks_the_program_or_gives_a_wrong_answer(place):
    found = [examine(number, "suite", place) for number in range(MUTANTS)]
    assert [str(o) for o in found if o.result == FINDING] == []
    results = {o.result for o in found}
    assert results == {REFUSED, SAME, CHANGED}  # mutants that all were refused would show nothing


@pytest.fixture
def runs(place):
    ready = bench(SUBJECTS[0], place)
    yield ready
    ready.target.write_bytes(ready.data)


def test_a_changed_number_is_a_legitimate_change(runs):
    assert judge("table", runs, runs.data.replace(b",7.2,", b",7.9,", 1))[0] == CHANGED


def test_another_dress_is_the_same_answer(runs):
    text = runs.data.decode()
    for dress in (text.replace("\n", "\r\n"), "\ufeff" + text, text.replace(",", ";"), "# x\n" + text):
        assert judge("table", runs, dress.encode()) == (SAME, "")


@pytest.mark.parametrize("fault", ["a row is dropped", "a number is misread", "a traceback"])
def test_a_defect_would_be_found(runs, monkeypatch, fault):
    from rotorid.files import cells, columns

    make_grid, parse_number = cells.make_grid, columns.parse_number
    if fault == "a row is dropped":  # those of labels that begin with #, as it once was
        mutant = runs.data.replace(b"initial", b"#1")

        def without(source, rows, *rest, **options):
            rows = [row for row in rows if not row[1] or not row[1][0].startswith("#")]
            return make_grid(source, rows, *rest, **options)

        monkeypatch.setattr(cells, "make_grid", without)
    elif fault == "a number is misread":
        mutant = b"sep=;\n" + runs.data.replace(b",", b";").replace(b".", b",")
        monkeypatch.setattr(
            columns, "parse_number", lambda text, **_: parse_number(text.replace(",", ""), comma=False)
        )
    else:
        mutant = runs.data + b"\n"
        monkeypatch.setattr(cells, "make_grid", lambda *_, **__: {}["x"])
    assert judge("table", runs, mutant)[0] == (REFUSED if fault == "a row is dropped" else FINDING)
