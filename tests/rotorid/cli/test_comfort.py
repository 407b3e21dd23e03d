"""What makes the shell pleasant: nearest names, no colours where unwanted, progress."""

import sys
import time

import pytest

from rotorid.commands import progress

COLOURS = ("NO_COLOR", "FORCE_COLOR", "PY_COLORS", "GITHUB_ACTIONS", "TERM", "COLUMNS")


def test_plain_terminals(monkeypatch):
    for name in COLOURS:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("NO_COLOR", "")  # as no-color.org has it: empty does not count
    assert not progress.plain()
    monkeypatch.setenv("NO_COLOR", "0")
    assert progress.plain()
    monkeypatch.delenv("NO_COLOR")
    monkeypatch.setenv("TERM", "dumb")
    assert progress.plain()


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
