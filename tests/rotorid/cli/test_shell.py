"""The command as shells use it: interrupts, pipes, standard input, files that stay what they are."""

import hashlib
import io
import itertools
import os
import signal
import stat
import subprocess
import sys

import pytest

from rotorid.files.disk import write_files
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


def test_the_hash_is_that_of_what_was_read(cli, tmp_path, monkeypatch):
    import fem

    path = tmp_path / "rotor.csv"
    path.write_bytes(ROTOR.read_bytes())
    critical = fem.critical_speeds

    def meanwhile(*words, **options):
        path.write_bytes(b"another file")
        return critical(*words, **options)

    monkeypatch.setattr(fem, "critical_speeds", meanwhile)
    outcome = cli("critical", path, "--json")
    assert path.read_bytes() == b"another file"
    expected = hashlib.sha256(ROTOR.read_bytes()).hexdigest()
    assert outcome.json["provenance"]["inputs"][0]["sha256"] == expected


def test_mode_and_link_of_a_file_stay(tmp_path):
    (tmp_path / "sub").mkdir()
    target, link = tmp_path / "sub" / "real.csv", tmp_path / "link.csv"
    target.write_bytes(b"old")
    target.chmod(0o640)
    link.symlink_to(target)
    dangling, new = tmp_path / "dangling.csv", tmp_path / "sub" / "new.csv"
    dangling.symlink_to(new)
    long = tmp_path / ("x" * 250 + ".csv")
    write_files({link: b"1", dangling: b"2", long: b"3"})
    assert link.is_symlink()
    assert dangling.is_symlink()
    assert [p.read_bytes() for p in (target, new, long)] == [b"1", b"2", b"3"]
    assert stat.S_IMODE(target.stat().st_mode) == 0o640
    assert len(list(tmp_path.rglob("*"))) == 6


def test_what_is_written_is_on_the_disk_before_it_replaces(tmp_path, monkeypatch):
    done = []
    sync, replace = os.fsync, os.replace
    monkeypatch.setattr(os, "fsync", lambda fd: (done.append("sync"), sync(fd))[1])
    monkeypatch.setattr(os, "replace", lambda *a: (done.append("replace"), replace(*a))[1])
    write_files({tmp_path / "a.csv": b"1", tmp_path / "b.csv": b"2"})
    assert done == ["sync", "sync", "replace", "replace"]


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


def test_speeds_are_bounded():
    from rotorid.commands.quantities import FASTEST, band, speeds

    for text, unit in itertools.product(("1e9", "9e9", "1e300"), ("rpm", "Hz", "")):
        if float(text) * {"rpm": 0.105, "Hz": 6.28, "": 1.0}[unit] > FASTEST:
            with pytest.raises(ValueError, match="speeds must be 0 or from 1e-09 to"):
                speeds(text + unit)
            with pytest.raises(ValueError, match="speeds must be 0"):
                band(f"1:{text}{unit}")


def test_without_docstrings_there_are_no_options():
    done = subprocess.run([sys.executable, "-OO", "-m", "rotorid", "demo"], capture_output=True, timeout=120)
    assert (done.returncode, done.stdout) == (2, b"")
    assert done.stderr.startswith(b"rotorid: python -OO drops the texts")


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
