"""What makes the shell pleasant: nearest names, no colours where unwanted, progress."""

import sys
import time

import pytest
from cases import each_of

from rotorid.commands import progress
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
        (["--", "-job.toml"], "No such command '-job.toml': the command stands first"),
        (
            ["motion", "a.csv", "--speed", "9", "--view", "orbist"],
            "Invalid value for '--view': 'orbist' is not one of 'motion', 'orbits', 'bode'. "
            "Did you mean 'orbits'?",
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
    assert progress.markup_mode() == "rich"
    monkeypatch.setenv("NO_COLOR", "")  # as no-color.org has it: empty does not count
    assert not progress.plain()
    monkeypatch.setenv("NO_COLOR", "0")
    assert progress.plain()
    monkeypatch.delenv("NO_COLOR")
    monkeypatch.setenv("TERM", "dumb")
    assert progress.markup_mode() is None


def test_a_terminal_gets_a_status_and_a_dumb_one_or_a_log_nothing(monkeypatch, capsys):
    with progress.busy("fit"):
        pass
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    for name in COLOURS:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm")
    with progress.busy("study"):
        progress.log.info("%d of %d", 3, 7)
        time.sleep(0.5)
    assert "study" in capsys.readouterr().err
    monkeypatch.setenv("TERM", "dumb")
    with progress.busy("study"):
        progress.log.info("%d of %d", 3, 7)
    assert capsys.readouterr().err == ""
    assert not [one for one in progress.log.handlers if one.__class__.__name__ == "Handler"]


def test_progress_does_not_hide_an_error(monkeypatch):
    with pytest.raises(ZeroDivisionError), progress.busy("division"):
        1 / 0  # noqa: B018
