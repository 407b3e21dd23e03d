"""What is a comment and what is data: labels, sensors and runs may begin with #."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tables_data import RUNS, WEIGHTS, complaints, csv_text, replaced, write_csv

from rotorid.files import read_rotor, read_trials
from rotorid.files.cells import parse_text
from rotorid.files.problems import Problems

HEADER = ("run", "value", "text")


def read(text):
    """(comments, rows without their numbers) and the problems."""
    problems = Problems()
    grid = parse_text("t.csv", text, problems)
    assert grid is not None
    return grid, [list(cells) for _, cells in grid.rows], [*problems]


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


@pytest.mark.parametrize("error", ["#N/A", "#DIV/0!", "#ИМЯ?", "####"])
def test_an_error_of_a_spreadsheet_is_no_name(tmp_path, error):
    weights = write_csv(tmp_path / "weights.csv", WEIGHTS)
    for row, column in ((2, "run"), (5, "sensor")):
        path = write_csv(tmp_path / "runs.csv", replaced(RUNS, row, column, error))
        first, *_ = complaints(read_trials, path, weights)
        assert (first.row, first.column, first.value) == (row, column, error)
        assert "not an error of the spreadsheet" in first.expected


def test_a_remark_with_a_separator_below_the_header_says_what_to_do(tmp_path):
    text = csv_text(RUNS).replace("trial 1", "# by hand, twice\ntrial 1", 1)
    (tmp_path / "runs.csv").write_text(text, encoding="utf-8")
    problems = complaints(read_trials, tmp_path / "runs.csv", write_csv(tmp_path / "weights.csv", WEIGHTS))
    assert {p.row for p in problems} == {4}
    _, _, found = read("a,b\n# x,y,z\n1,2\n")
    assert "comments have no ," in str(found[0])


SECRET = "root:x:0:0:/hidden"


@pytest.mark.parametrize("content", [f"{SECRET}\n{SECRET}\n", f'{SECRET} "open\n', f"{SECRET},a\nb\nc,d,e\n"])
def test_nothing_is_printed_of_a_file_that_is_no_table(tmp_path, content):
    path = tmp_path / "some.csv"
    path.write_text(content, encoding="utf-8")
    for problem in complaints(read_rotor, path):
        assert "hidden" not in str(problem)
    toml = tmp_path / "some.toml"
    for text in (f"{SECRET}\n", f'[login]\nname = "{SECRET}"\n'):
        toml.write_text(text, encoding="utf-8")
        for problem in complaints(read_rotor, toml):
            assert "hidden" not in str(problem)
