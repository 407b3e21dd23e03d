"""What makes the shell pleasant: nearest names, no colours where unwanted, progress, the numbers behind."""

import json
import re
import sys
import time

import pytest
import typer
from cases import each_of

from rotorid.commands import progress, terminal, verbose
from rotorid.samples import sample_data

JOB = sample_data() / "turbo_job" / "job.toml"
COMPRESSOR = sample_data() / "compressor"
TASK = sample_data() / "identify" / "task_5_1"
COLOURS = ("NO_COLOR", "FORCE_COLOR", "PY_COLORS", "GITHUB_ACTIONS", "TERM", "COLUMNS")


def words(text):
    """A message without the frame and the line breaks that rich gives it."""
    return " ".join(text.replace("│", " ").split())


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["balanec"], "No such command 'balanec'. Did you mean 'balance', 'unbalance'?"),
        (["trail-weight"], "No such command 'trail-weight'. Did you mean 'trial-weight'?"),
        (["xyzzy"], "No such command 'xyzzy'."),
        (["--versoin"], "No such option: --versoin (Possible options: --version)"),
        (
            ["balance", JOB, "--limt", "3"],
            "No such option: --limt (Possible options: --limit, --plot, --split)",
        ),
        (["critical", JOB, "--qqq"], "No such option: --qqq"),
        (
            ["reduce", "a.csv", "--place", "bset"],
            "Invalid value for '--place': 'bset' is not one of 'best', 'compromise', 'mac', 'book'. "
            "Did you mean 'best'?",
        ),
    ],
)
def test_usage_with_the_nearest_name(cli, args, message):
    outcome = cli(*args)
    assert outcome.code == 2
    assert outcome.out == ""
    said = words(outcome.err)
    assert message in said
    assert said.count("Did you mean") == message.count("Did you mean")


@each_of(
    ("args", "message"),
    [
        (["balance", JOB, "--method", "minmx"], "'minmx' is not known (did you mean 'minmax'?)"),
        (["balance", JOB, "--planes", "lefft"], "there is no plane 'lefft' (did you mean 'left'?)"),
        (["balance", JOB, "--limit", "prob 4=2"], "there is no sensor 'prob 4' (did you mean 'probe 4'?)"),
        (["balance", JOB.with_name("jb.toml")], "(did you mean 'job.toml'?)"),
        (
            ["reduce", COMPRESSOR / "rotor.toml", "--nodes", "8,impeler 4"],
            "no station is called 'impeler 4' (did you mean 'impeller 4'?)",
        ),
        (
            ["influence", COMPRESSOR / "rotor.toml", "--planes=8", "--sensors=prob DE", "--speeds=500"],
            "no station is called 'prob DE' (did you mean 'probe DE'?)",
        ),
        (
            ["identify", TASK / "model.toml", TASK / "data.csv", "--loss", "hubr"],
            "'hubr' is not known (did you mean 'huber'?)",
        ),
        (["demo", "--sample", "hols"], "--sample 'hols' is not known (did you mean 'holes'?)"),
    ],
)  # fmt: skip
def test_values_with_the_nearest_name(cli, args, message):
    outcome = cli(*args)
    assert outcome.code == 2
    assert outcome.out == ""
    assert outcome.err.startswith("rotorid: ")
    assert message in outcome.err
    assert outcome.err.count("did you mean") == 1


def test_plain_terminals(monkeypatch):
    for name in COLOURS:
        monkeypatch.delenv(name, raising=False)
    assert terminal.markup_mode() == "rich"
    monkeypatch.setenv("NO_COLOR", "")  # as no-color.org has it: empty does not count
    assert not terminal.plain()
    monkeypatch.setenv("NO_COLOR", "0")
    assert terminal.plain()
    monkeypatch.delenv("NO_COLOR")
    monkeypatch.setenv("TERM", "dumb")
    assert terminal.markup_mode() is None


def wait_for(said, word):
    """Wait until the standard error holds a word; the other thread writes it."""
    text = ""
    for _ in range(500):
        text += said()
        if word in text:
            return text
        time.sleep(0.01)
    return text


def test_a_log_gets_a_line_now_and_then(monkeypatch, capsys):
    monkeypatch.setattr(progress, "FIRST_LINE", 0.05)
    with progress.busy("fit"):
        text = wait_for(lambda: capsys.readouterr().err, "s so far")
    assert re.match(r"rotorid: fit, \d+ s so far\n", text)
    assert "\x1b" not in text


def test_lines_become_fewer(monkeypatch):
    """The pauses double up to the longest, and end at once when the work is done."""

    class Done:
        def __init__(self):
            self.pauses = []

        def wait(self, pause):
            self.pauses.append(pause)
            return len(self.pauses) > 5

    done = Done()
    progress._lines("fit", done, progress._Stage())
    assert done.pauses == [10, 20, 40, 60, 60, 60]


def test_a_terminal_gets_a_spinner_and_a_dumb_one_lines(monkeypatch, capsys):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("NO_COLOR", "1")  # says nothing about movement
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(progress, "PATIENCE", 0.01)
    with progress.busy("bootstrap"):
        text = wait_for(lambda: capsys.readouterr().err, "bootstrap")
    assert "bootstrap" in text
    assert "s so far" not in text
    capsys.readouterr()
    monkeypatch.setenv("TERM", "dumb")
    monkeypatch.setattr(progress, "FIRST_LINE", 0.05)
    with progress.busy("fit"):
        text = wait_for(lambda: capsys.readouterr().err, "s so far")
    assert re.match(r"rotorid: fit, \d+ s so far\n", text)


def test_progress_does_not_hide_an_error(monkeypatch):
    with pytest.raises(ZeroDivisionError), progress.busy("division"):
        1 / 0  # noqa: B018


def numbers(text):
    """Lines `rotorid: NAME = VALUE` of a command that ran with --verbose."""
    pairs = (line.removeprefix("rotorid: ").partition(" = ") for line in text.splitlines())
    return {name: value for name, sign, value in pairs if sign}


def test_the_numbers_behind_a_balance(cli):
    plain = cli("balance", JOB, "--json")
    assert plain.err == ""
    outcome = cli("balance", JOB, "--json", "--verbose")
    document = json.loads(outcome.out)
    assert {**document, "provenance": None} == {**plain.json, "provenance": None}
    shown = numbers(outcome.err)
    assert shown["rank"] == "3"
    assert shown["condition_number"] == f"{document['condition_number']:.6g}"
    assert shown["singular_values"] == ", ".join(f"{s:.6g}" for s in document["singular_values"])
    assert shown["rms_after"] == f"{document['rms_after']:.6g}"
    assert shown["errors.amplitude_percent"] == "0.15"
    lines = outcome.err.splitlines()
    assert lines[-2].startswith("rotorid: time: all ")
    assert lines[-1].startswith("rotorid: versions: rotorid 0.1.0, python 3.")
    assert all(name in lines[-1] for name in ("numpy", "scipy"))


def test_the_numbers_behind_an_identification_and_a_fit(cli):
    outcome = cli("identify", TASK / "model.toml", TASK / "data.csv", "--verbose")
    shown = numbers(outcome.err)
    assert (shown["rank"], shown["degrees_of_freedom"]) == ("2", "4")  # 3 complex equations, 2 unknowns
    assert "time: identification " in outcome.err


def test_notes_are_kept_only_for_those_who_ask(capsys):
    verbose.note({"rank": 3})

    def command(n: int = 1) -> None:
        """Count."""
        verbose.note({"rank": n, "provenance": {"rank": 9}, "masses": [1.0], "deep": {"mac": [0.5] * 20}})
        verbose.note({"history": [{"cost": 9.0}, {"cost": 2.5}]})

    verbose.verbosely(command)(4)
    assert capsys.readouterr() == ("", "")
    verbose.verbosely(command)(4, verbose=True)
    shown = numbers(capsys.readouterr().err)
    many = ", ".join(["0.5"] * 12) + ", … (20 in all)"
    assert shown == {"rank": "4", "deep.mac": many, "history.cost": "9 … 2.5 in 2 entries"}
    assert not verbose.log.handlers


def test_an_exit_status_is_no_failure(capsys):
    def command() -> None:
        """Judge."""
        verbose.note({"rank": 2})
        raise typer.Exit(1)

    with pytest.raises(typer.Exit):
        verbose.verbosely(command)(verbose=True)
    assert numbers(capsys.readouterr().err) == {"rank": "2"}
