"""What is a comment and what is data, and what is not shown of a file."""

import pytest
from cases import each_of
from tables_data import RUNS, WEIGHTS, complaints, csv_text, replaced, write_csv

from rotorid.files import read_rotor, read_trials


@each_of("separator, quoted", [(",", False), (";", True), ("\t", False)])
def test_rows_of_a_table_are_never_taken_for_comments(tmp_path, separator, quoted):
    runs = [[f"#{cell}" if cell in ("initial", "A") else cell for cell in row] for row in RUNS]
    text = csv_text(runs, separator)
    if quoted:
        text = text.replace("#A", '"#A"').replace("#initial", '"#initial"')
    (tmp_path / "runs.csv").write_text(f"# a, b; c\n{text}# alone\n", encoding="utf-8")
    trials = read_trials(tmp_path / "runs.csv", write_csv(tmp_path / "weights.csv", WEIGHTS))
    assert (trials.runs[0], trials.sensors) == ("#initial", ("#A", "B"))


@pytest.mark.parametrize("error", ["#N/A", "#ИМЯ?", "####"])
def test_an_error_of_a_spreadsheet_is_no_name(tmp_path, error):
    path = write_csv(tmp_path / "runs.csv", replaced(RUNS, 5, "sensor", error))
    first, *_ = complaints(read_trials, path, write_csv(tmp_path / "weights.csv", WEIGHTS))
    assert (first.row, first.column, first.value) == (5, "sensor", error)


def test_a_remark_with_a_separator_below_the_header_says_what_to_do(tmp_path):
    text = csv_text(RUNS).replace("trial 1", "# by hand, twice\ntrial 1", 1)
    (tmp_path / "runs.csv").write_text(text, encoding="utf-8")
    problems = complaints(read_trials, tmp_path / "runs.csv", write_csv(tmp_path / "weights.csv", WEIGHTS))
    assert {p.row for p in problems} == {4}


SECRET = "root:x:0:0:/hidden"


@each_of(
    "name, content",
    [
        ("some.csv", f"{SECRET}\n{SECRET}\n"),
        ("some.csv", f'{SECRET} "open\n'),
        ("some.csv", f"{SECRET},a\nb\nc,d,e\n"),
        ("some.toml", f"{SECRET}\n"),
        ("some.toml", f'[login]\nname = "{SECRET}"\n'),
    ],
)
def test_nothing_is_printed_of_a_file_that_is_no_table(tmp_path, name, content):
    (tmp_path / name).write_text(content, encoding="utf-8")
    for problem in complaints(read_rotor, tmp_path / name):
        assert "hidden" not in str(problem)
