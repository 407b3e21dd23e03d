"""What the first lines of a command say: judged, with errors, in the reader's units, at most 24 lines."""

import warnings

import pytest
from cases import each_of

from rotorid.base.answer import Answer, kinds
from rotorid.samples import sample_data

SAMPLES = sample_data()
COMPRESSOR, ROTOR = SAMPLES / "compressor" / "rotor.toml", SAMPLES / "rotor23.csv"
RESPONSE = ("response", COMPRESSOR, "--unbalance", SAMPLES / "compressor" / "unbalance.csv")
FIT = (SAMPLES / "fit/quasilinearization/model.toml", SAMPLES / "fit/quasilinearization/record_noisy.csv")


@pytest.mark.parametrize(
    ("command", "judgement"),
    [
        (
            ("critical", COMPRESSOR, "-n", 2, "--operating", "4200:6500rpm"),
            ["2 critical speeds without damping: 4066.84 and 4375.19 rpm.",
             "INSIDE the operating range 4200 to 6500 rpm: 4375.19 rpm."],
        ),
        (
            ("critical", COMPRESSOR, "-n", 2, "--operating", "5300:6500rpm"),
            ["2 critical speeds without damping: 4066.84 and 4375.19 rpm.",
             "NOT KNOWN whether a critical speed lies in the operating range 5300 to 6500 rpm: only speeds"],
        ),
        (
            ("critical", ROTOR, "--operating", "1910:2865rpm"),
            ["3 critical speeds without damping: 1291.45, 5163.62 and 11113.5 rpm.",
             "None lies in the operating range 1910 to 2865 rpm; the nearest, 1291.45 rpm, is 32.4 % away."],
        ),
        (
            ("campbell", ROTOR, "--speeds", "100:300:20", "-n", 2, "--operating", "200:600"),
            ["Stable: no motion grows.", "From 954.93 to 2864.79 rpm",
             "NOT KNOWN whether a critical speed lies in the operating range 1909.86 to 5729.58 rpm: only"],
        ),
        (
            (*RESPONSE, "--speeds", "2000:6000:500rpm", "--operating", "5800:6500rpm"),
            ["NOT KNOWN whether all are far enough from the operating range, 5800 to 6500 rpm (API 684): "],
        ),
        (
            ("critical", COMPRESSOR, "-n", 4, "--operating", "5300:6500rpm"),
            ["4 critical speeds without damping: ",
             "None lies in the operating range 5300 to 6500 rpm; the nearest, 4375.19 rpm, is 17.4 % away."],
        ),
        (
            ("campbell", COMPRESSOR, "--speeds", "1000:15000:1000rpm"),
            ["UNSTABLE above 10932.4 rpm: a motion grows there.",
             "From 1000 to 15000 rpm (104.72 to 1570.8 rad/s): 4 damped critical speeds, 2 more"],
        ),
        (
            (*RESPONSE, "--speeds", "2000:8000:500rpm", "--operating", "4800:6500rpm"),
            ["NOT far enough from the operating range, 4800 to 6500 rpm (API 684): critical speed 4"],
        ),
        (
            (*RESPONSE, "--speeds", "3000,4000rpm"),
            ["Too few speeds to find a peak: at 2 speeds from 3000 to 4000 rpm "],
        ),
        (
            ("reduce", ROTOR, "--nodes", "2,3,4", "--modes", 1),
            ["3 equivalent masses from the first mode, formula (50), together ",
             "NO physical model, a mass is not positive; condition number "],
        ),
        (
            ("fit", *FIT, "--max-iterations", 1),
            ["No estimates: the values are where the search stopped."],
        ),
        (
            ("identify", SAMPLES / "identify/task_4_1/model.toml", SAMPLES / "identify/task_4_1/data.csv"),
            ["Only c and b*(1 - delta) are determined; b and delta by themselves are not. Method: linear"],
        ),
    ],
)  # fmt: skip
def test_the_judgement_comes_first(cli, command, judgement):
    lines = cli(*command).out.splitlines()
    for line, said in zip(lines, judgement, strict=False):
        assert line.startswith(said)
    assert len(lines) <= 24
    assert max(map(len, lines)) <= 100


@pytest.mark.full
def test_one_peak_of_each_critical_speed_and_all_behind_them(cli):
    command = (*RESPONSE, "--speeds", "1000:10000:50rpm", "--operating", "4800:6500rpm")
    document = cli(*command, "--json").json
    brief, whole = cli(*command).out, cli(*command, "--table").out
    near = max((p for p in document["peaks"] if p["enough"] is False), key=lambda p: p["amplitude"])
    assert brief.count("NOT ENOUGH") == 1
    (line,) = [line for line in brief.splitlines() if "NOT ENOUGH" in line]
    assert line.split()[:4] == [
        *near["sensor"].split(),
        f"{near['speed_rpm']:.2f}",
        f"{near['speed_rad_s']:.4f}",
    ]
    assert whole.count("NOT ENOUGH") == 1 + sum(p["enough"] is False for p in document["peaks"])
    assert "largest force, N" in whole
    assert "largest force, N" not in brief


def test_what_a_fit_leaves_of_the_record_is_its_residual(cli):
    """The sample has noise of 0.02 on outputs of this size."""
    rows = [line.split(",")[1:] for line in FIT[1].read_text(encoding="utf-8").splitlines()[1:]]
    data = [float(y) for row in rows for y in row]
    rms = (sum(y * y for y in data) / len(data)) ** 0.5
    found = cli("fit", *FIT)
    residual = cli("fit", *FIT, "--json").json["residual_rms"]
    assert f"The model leaves {100 * residual / rms:.2g} % of the record (rms)." in found.out


def test_warnings_come_last_one_of_each_kind_and_numerical_ones_first(cli, monkeypatch):
    def work(*_):
        for line in (3, 5, 3):
            warnings.warn(f"line {line}: no mass", UserWarning, stacklevel=1)
        warnings.warn("an overflow", RuntimeWarning, stacklevel=1)
        raise ValueError("nothing can be done")

    monkeypatch.setattr("rotorid.cli.commands.critical.work", work)
    monkeypatch.setattr(warnings, "filters", [])
    found = cli("critical", ROTOR)
    assert found.code == 2
    assert found.err.splitlines() == [
        "rotorid: Warning: an overflow",
        "rotorid: Warning: line 3: no mass (and 1 more of this kind)",
        "rotorid: nothing can be done",
    ]
    assert kinds(["a 1", "b", "a 2."]) == ["a 1 (and 1 more of this kind)", "b"]


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
    assert kinds([first, second, first]) == [f"{(first, second)[worst]} (and 1 more of this kind)"]


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
    told = Answer("Fail.\n" * 9, f"Largest: 1\nand 2\n\n{block}", ("a warning " * 30,)).brief()
    assert "Largest: 1\nand 2\n\n" in told
    assert "plane" not in told
    assert "8 more lines: --table." in told
    assert len(told.splitlines()) <= 24


@pytest.mark.parametrize(("head", "left"), [(24, 3), (21, 3), (20, 2)])
def test_no_room_counts_every_line(head, left):
    told = Answer("Judged.\n" * head, "one\ntwo\nthree").brief()
    assert f"{left} more lines: --table." in told
