"""The command as shells use it: interrupts, pipes, standard input, files that stay what they are."""

import hashlib
import io
import os
import signal
import subprocess
import sys

import pytest

from rotorid.samples import sample_data

ROTOR = sample_data() / "rotor23.csv"
BK = sample_data() / "bk_two_plane"
FIT = sample_data() / "fit" / "run_down"


def start(*words, **options):
    command = [sys.executable, "-m", "rotorid", *map(str, words)]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, **options)


def test_ctrl_c_while_loading_ends_quietly(tmp_path):
    # an interpreter that stops itself at the first import that takes long
    (tmp_path / "typer.py").write_text(
        "import os, signal, time\nos.kill(os.getpid(), signal.SIGINT)\ntime.sleep(9)\n", encoding="utf-8"
    )
    path = os.pathsep.join([str(tmp_path), *filter(None, sys.path)])
    process = start("critical", ROTOR, env={**os.environ, "PYTHONPATH": path})
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (130, b"", b"")


def test_ctrl_c_while_it_reads_ends_quietly():
    process = start("critical", "-", "--json")
    process.stdin.write(b"length_m,")
    process.stdin.flush()
    while b"1" not in _pending(process):
        pass
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (130, b"", b"")


def _pending(process):
    """Whether the process has loaded everything: it waits for its standard input."""
    wchan = f"/proc/{process.pid}/wchan"
    try:
        with open(wchan, encoding="ascii") as stream:
            return b"1" if "pipe" in stream.read() else b""
    except OSError:
        return b"1"


def test_a_closed_pipe_ends_quietly():
    process = start("critical", ROTOR)
    for stream in (process.stdin, process.stdout, process.stderr):
        stream.close()
    assert process.wait(timeout=60) == -signal.SIGPIPE  # 141 for a shell, as with any other program


@pytest.mark.parametrize("redirection", ["2>/dev/full", pytest.param("2>&-", marks=pytest.mark.full)])
@pytest.mark.parametrize(
    "words",
    [
        "critical nofile.csv",
        "critical --nope",
        "critical {} -n 99",
    ],
)
def test_a_complaint_that_nobody_can_read_keeps_its_status(redirection, words):
    words = words.format(ROTOR)
    command = f"{sys.executable} -m rotorid {words} {redirection}"
    done = subprocess.run(command, shell=True, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (2, "", "")


def test_a_table_from_standard_input(cli, monkeypatch):
    data = (BK / "runs.csv").read_bytes()
    plain = cli("balance", BK / "runs.csv", BK / "weights.csv", "--json").json
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(data)))
    outcome = cli("balance", "-", BK / "weights.csv", "--json")
    assert outcome.json["corrections"] == plain["corrections"]
    source = outcome.json["provenance"]["inputs"][0]
    assert source == {"file": "-", "sha256": hashlib.sha256(data).hexdigest()}
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(data)))
    outcome = cli("critical", "-")
    assert outcome.code == 2
    assert outcome.err.startswith("rotorid: standard input, row 2: expected a header row")
    monkeypatch.setattr(sys, "stdin", None)
    assert "standard input: expected a file that can be read (it is closed)" in cli("critical", "-").err


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names")
def test_a_pipe_is_no_target(cli, tmp_path):
    os.mkfifo(tmp_path / "o.csv")
    outcome = cli("critical", ROTOR, "--output", tmp_path / "o.csv")
    assert outcome.code == 2
    assert "no regular file" in outcome.err


EXTREME = ("1e308", "-1e308", "1e400", "nan", "inf", "-inf", "1e-320", "9" * 25, "1e13", "", "abc")
SPEEDS = (
    *EXTREME,
    "0:1e308:1e307",
    "1e300:1e301:1e300",
    "1e300rpm",
    "1e308Hz",
    "1e308:1.7e308:1e307",
    "0:0:1",
)
OPTIONS = {
    ("campbell", ROTOR): {"--speeds": SPEEDS, "--operating": SPEEDS},
    ("influence", ROTOR, "--planes", "3", "--sensors", "5"): {"--speeds": SPEEDS},
    ("critical", ROTOR): {"-n": EXTREME, "--operating": ("1:1e308", "1e308:1e309", "1e300rpm:1e301rpm")},
    ("balance", BK / "job.toml"): {
        "--errors": (*EXTREME, *(f"{each},{each}" for each in EXTREME)),
        "--ridge": EXTREME,
        "--max-mass": (*EXTREME, "1e30g", "1e-300g"),
        "--speeds": SPEEDS,
    },
    ("tolerance", "--mass", "500kg", "--grade", "G2.5"): {"--speed": (*SPEEDS, "1e-300rpm", "1e-9")},
    ("split", "3g@120", "--radius", "100mm"): {"--drill": ("1e-300mm", "1e300mm")},
    ("trial-weight", "--load", "500kg", "--radius", "200mm", "--speed", "3000rpm"): {
        "--share": EXTREME,
    },
    ("reduce", ROTOR, "--nodes", "7,12,18"): {"--response": ("1e-308", "1e-320", "1e308", "nan")},
    ("fit", FIT / "model.toml", FIT / "record.csv"): {
        "--sigma": ("1e-308", "1e-320", "1e308", "nan", "-1"),
        "--tolerance": ("inf", "1e-308", "0"),
    },
}


def test_extreme_options_are_answered_or_refused(cli):
    for words, options in OPTIONS.items():
        for option, values in options.items():
            for value in values if option != "--speeds" or words[0] != "balance" else values[::2]:
                outcome = cli(*words, *(f"{option}={value}",) if option[1] == "-" else (option, value))
                what = (words[0], option, value, outcome.err[-300:])
                assert outcome.code in (0, 2), what
                printed = (outcome.out + outcome.err).replace(repr(value), "").replace(value or "-", "")
                assert not any(f" {bad} " in printed for bad in ("inf", "nan", "-inf")), what
                assert "encountered in" not in printed, what
                assert "Traceback" not in printed, what


@pytest.mark.parametrize("way", [["-OO"], pytest.param([], marks=pytest.mark.full)])
def test_without_docstrings_commands_work_and_their_help_is_the_same(way, tmp_path):
    def output(way, *words, **environment):
        command = [sys.executable, *way, "-m", "rotorid", *map(str, words)]
        done = subprocess.run(
            command, capture_output=True, env={**os.environ, **environment}, cwd=tmp_path, timeout=120
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    level = {} if way else {"PYTHONOPTIMIZE": "2"}
    for words in (["balance", "--help"], [], ["critical", ROTOR, "-n", "2"]):
        assert output(way, *words, **level) == output([], *words) != b""


@pytest.mark.skipif(os.name == "nt", reason="limits of a process")
def test_a_workbook_that_does_not_fit_is_one_message_that_names_it(tmp_path):
    import resource

    def little_room():
        resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))

    options = {"cwd": tmp_path, "preexec_fn": little_room, "env": {**os.environ, "TMPDIR": str(tmp_path)}}
    process = start("critical", ROTOR, "--output", "modes.xlsx", **options)
    out, err = process.communicate(timeout=60)
    expected = b"rotorid: modes.xlsx: expected a file that can be written (File too large)\n"
    assert (process.returncode, out, err) == (2, b"", expected)
    assert list(tmp_path.iterdir()) == []
