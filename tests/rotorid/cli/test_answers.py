"""What the first lines of a command say: judged, with errors, in the reader's units, few lines."""

import warnings

import pytest
from cases import each_of

from rotorid.base.answer import Answer, kinds
from rotorid.samples import sample_data

SAMPLES = sample_data()
COMPRESSOR, ROTOR = SAMPLES / "compressor" / "rotor.toml", SAMPLES / "rotor23.csv"
RESPONSE = ("response", COMPRESSOR, "--unbalance", SAMPLES / "compressor" / "unbalance.csv")


@pytest.mark.parametrize(
    ("command", "line", "judgement"),
    [
        (("critical", COMPRESSOR, "-n", 2, "--operating", "4200:6500rpm"), 1, "INSIDE"),
        (("critical", COMPRESSOR, "-n", 2, "--operating", "5300:6500rpm"), 1, "NOT KNOWN"),
        (("critical", COMPRESSOR, "-n", 4, "--operating", "5300:6500rpm"), 1, "None lies"),
        (("campbell", ROTOR, "--speeds", "100:300:20", "-n", 2), 0, "Stable"),
        (("campbell", COMPRESSOR, "--speeds", "1000:15000:1000rpm"), 0, "UNSTABLE above 10932.4 rpm"),
        ((*RESPONSE, "--speeds", "2000:6000:500rpm", "--operating", "5800:6500rpm"), 0, "NOT KNOWN"),
        ((*RESPONSE, "--speeds", "2000:8000:500rpm", "--operating", "4800:6500rpm"), 0, "NOT far enough"),
        ((*RESPONSE, "--speeds", "3000,4000rpm"), 0, "Too few speeds"),
        (("reduce", ROTOR, "--nodes", "2,3,4", "--modes", 1), 1, "NO physical model"),
    ],
)
def test_the_judgement_comes_first(cli, command, line, judgement):
    lines = cli(*command).out.splitlines()
    assert lines[line].startswith(judgement)
    assert len(lines) <= 24
    assert max(map(len, lines)) <= 100


def test_warnings_come_last_one_of_each_kind_and_numerical_ones_first(cli, monkeypatch):
    def work(*_):
        for line in (3, 5, 3):
            warnings.warn(f"line {line}: no mass", UserWarning, stacklevel=1)
        warnings.warn("an overflow", RuntimeWarning, stacklevel=1)
        raise ValueError("nothing can be done")

    monkeypatch.setattr("fem.critical_speeds", work)
    monkeypatch.setattr(warnings, "filters", [])
    found = cli("critical", ROTOR)
    assert found.code == 2
    assert found.err.splitlines() == [
        "rotorid: Warning: an overflow",
        "rotorid: Warning: line 3: no mass",
        "rotorid: nothing can be done",
    ]
    assert kinds(["a 1", "b", "a 2."]) == ["a 1", "b"]


@each_of(
    "first, second, worst",
    [
        ("plane 'A': 3 g over", "plane 'B': 300 g over", 1),
        ("plane 'A1': 300 g over", "plane 'B900': 3 g over", 0),
        ("'p' at 900 rpm rises from 2 to 30 µm", "'p' at 9000 rpm rises from 2 to 3 µm", 0),
        ("'A' changed at most 16 % of it", "'B' changed at most 2 % of it", 1),
        ("it is only 3 times its error", "it is only 4 times its error", 0),
        ("line 3: no mass", "line 500: no mass", 0),
    ],
)
def test_of_a_kind_the_worst_is_kept(first, second, worst):
    assert kinds([first, second, first]) == [(first, second)[worst]]


def weights_and_signs(text):
    """Names, work and angles in the table of weights."""
    return [line.split() for line in text.splitlines() if line.startswith("  ") and "°  ±" in line]


def test_a_long_name_hides_no_plane_where_material_is_removed(cli, tmp_path):
    long = "a plane of which the name goes on and on to the very end of the line"
    for name in ("runs.csv", "weights.csv", "job.toml"):
        text = (SAMPLES / "turbo_job" / name).read_text(encoding="utf-8")
        (tmp_path / name).write_text(text.replace("left", long), encoding="utf-8")
    with (tmp_path / "job.toml").open("a", encoding="utf-8") as job:
        job.write(f'[planes."{long}"]\nremove = true\n')
    rows = weights_and_signs(cli("balance", tmp_path / "job.toml").out)
    assert [("(remove)" in row, "(add)" in row) for row in rows] == [
        (True, False),
        (False, True),
        (False, True),
    ]
    assert len(rows) == 3


def test_half_a_table_of_weights_is_never_shown():
    block = "\n".join(f"  plane {p}  {p} g" for p in range(8))
    told = Answer("Fail.\n" * 9, f"Largest: 1\nand 2\n\n{block}", ("a warning " * 30,), to_mount=True).brief()
    assert "Largest: 1\nand 2\n\n" in told
    assert "plane" not in told
    assert "8 more lines: --table." in told
    assert len(told.splitlines()) <= 24
