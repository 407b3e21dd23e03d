"""A short run of the fuzzer, the same every time; `make fuzz` is the long one."""

import pytest
from repetitions import FULL

from fuzz.examining import CHANGED, FINDING, REFUSED, SAME, bench, examine, judge
from fuzz.judging import Answer, answer
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


@pytest.mark.parametrize("fault", ["a number is misread", "a traceback"])
def test_a_defect_would_be_found(runs, monkeypatch, fault):
    """As of a reader that fails, or reads 72 for 7.2, where lines end as on Windows."""

    def defective(words):
        if fault == "a traceback":
            return Answer(0, broken="KeyError: 'x'")
        data = runs.target.read_bytes()
        runs.target.write_bytes(data.replace(b",7.2,", b",72,") if b"\r" in data else data)
        return answer(words)

    monkeypatch.setattr("fuzz.examining.answer", defective)
    assert judge("table", runs, runs.data.replace(b"\n", b"\r\n"))[0] == FINDING
