"""What is a comment and what is data: labels, sensors and runs may begin with #."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tables_data import RUNS, WEIGHTS, complaints, csv_text, write_book, write_csv

from rotorid.files import read_rotor, read_trials
from rotorid.files.cells import parse_text
from rotorid.files.problems import Problems

HEADER = ("run", "value", "text")


def read(text):
    """(comments, rows without their numbers) and the problems."""
    problems = Problems()
    grid = parse_text("t.csv", text, problems)
    assert grid is not None
    return grid, [list(cells) for _, cells in grid.rows], problems.of("t.csv")


CELLS = st.text(alphabet="#ab1 '!?/NAé", max_size=6).map(str.strip)


@given(
    st.lists(st.tuples(CELLS, CELLS, CELLS), min_size=1, max_size=5), st.sampled_from(",;\t"), st.booleans()
)
def test_rows_of_a_table_are_never_taken_for_comments(rows, separator, quoted):
    rows = [row for row in rows if any(row)]
    if not rows:
        return
    mark = '"' if quoted else ""
    lines = [separator.join(f"{mark}{cell}{mark}" for cell in row) for row in (HEADER, *rows)]
    grid, found, problems = read("\n".join(["# a, b; c", *lines, "# alone"]))
    assert found == [list(row) for row in rows]
    assert grid.comments == ("a, b; c", "alone")
    assert problems == []


def test_sensors_and_runs_that_begin_with_a_sign_count(tmp_path):
    names = {"initial": "#0", "trial 1": "#1", "trial 2": "#2 again", "A": "#A", "B": "#12 B"}
    runs, weights = ([[names.get(cell, cell) for cell in line] for line in t] for t in (RUNS, WEIGHTS))
    book = write_book(tmp_path / "job.xlsx", {"runs": runs, "weights": weights})
    tables = write_csv(tmp_path / "runs.csv", runs), write_csv(tmp_path / "weights.csv", weights)
    for trials in (read_trials(*tables), read_trials(book, book)):
        assert trials.sensors == ("#A", "#12 B")
        assert trials.runs == ("#0", "#1", "#2 again")


def test_an_element_that_begins_with_a_sign_is_part_of_the_shaft(tmp_path):
    path = tmp_path / "rotor.csv"
    head = "element,length_m,diameter_m\n"
    path.write_text(
        f"# pump\n{head}1,0.1,0.05\n#12 coupling,0.2,0.05\n# in all 3\nend,0,\n", encoding="utf-8"
    )
    assert list(read_rotor(path).length) == [0.1, 0.2]


@pytest.mark.parametrize("error", ["#N/A", "#NV", "#DIV/0!", "#WERT!", "#ИМЯ?", "#Н/Д", "####"])
def test_an_error_of_a_spreadsheet_is_no_name(tmp_path, error):
    weights = write_csv(tmp_path / "weights.csv", WEIGHTS)
    for row, column in itertools.product((2, 5), ("run", "sensor")):
        runs = [list(line) for line in RUNS]
        runs[row - 1][RUNS[0].index(column)] = error
        problems = complaints(read_trials, write_csv(tmp_path / "runs.csv", runs), weights)
        assert [(p.row, p.column, p.value) for p in problems][:1] == [(row, column, error)]
        assert "not an error of the spreadsheet" in problems[0].expected


def test_a_remark_with_a_separator_below_the_header_says_what_to_do(tmp_path):
    text = csv_text(RUNS).replace("trial 1", "# by hand, twice\ntrial 1", 1)
    (tmp_path / "runs.csv").write_text(text, encoding="utf-8")
    problems = complaints(read_trials, tmp_path / "runs.csv", write_csv(tmp_path / "weights.csv", WEIGHTS))
    assert {p.row for p in problems} == {4}
    text = text.replace(", twice", " twice")
    (tmp_path / "runs.csv").write_text(text, encoding="utf-8")
    assert read_trials(tmp_path / "runs.csv", tmp_path / "weights.csv").runs[0] == "initial"
    _, _, found = read("a,b\n# x,y,z\n1,2\n")
    assert "a comment below the header begins with # and has no , in it" in str(found[0])


SECRET = "root:x:0:0:/hidden"


@pytest.mark.parametrize("content", [f"{SECRET}\n{SECRET}\n", f'{SECRET} "open\n', f"{SECRET},a\nb\nc,d,e\n"])
def test_nothing_is_printed_of_a_file_that_is_no_table(tmp_path, content):
    path = tmp_path / "some.csv"
    path.write_text(content, encoding="utf-8")
    for problem in complaints(read_rotor, path):
        assert "hidden" not in str(problem)
    toml = tmp_path / "some.toml"
    for text in (f'password = "{SECRET}"\n', f"{SECRET}\n", f'[login]\nname = "{SECRET}"\n'):
        toml.write_text(text, encoding="utf-8")
        for problem in complaints(read_rotor, toml):
            assert "hidden" not in str(problem)
