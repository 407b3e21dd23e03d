"""Run cases in a process of their own, one after the other, with the product of any tree.

A tree, the width of the terminal and the like are then the same whoever asks.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import io
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from golden.cases import CASES, Case

HERE = Path(__file__).resolve().parents[2]
"""The tree that this file is in."""
ENVIRONMENT = {
    "MPLBACKEND": "Agg",
    "COLUMNS": "100",
    "LINES": "50",
    "TERM": "dumb",
    "NO_COLOR": "1",
    "TZ": "UTC",
    "PYTHONHASHSEED": "0",
    "PYTHONIOENCODING": "utf-8",
    "OPENBLAS_NUM_THREADS": "1",
}
PROGRAM = "import sys; from golden.running import answer; answer(*sys.argv[1:])"
MASKS = (
    (re.compile(r"\b20\d\d-\d\d-\d\d([T ,]+\d\d:\d\d(:\d\d)?(\+00:00|Z| UTC)?)"), "DATE"),
    (re.compile(r"^rotorid: .* s so far\n", re.M), ""),  # a sign of life after ten seconds
    (re.compile(r"^(rotorid: time: .*) [\d.]+ s$", re.M), r"\1 SECONDS s"),
)


def run(
    names: Iterable[str],
    tree: Path = HERE,
    *,
    python: str | Path = sys.executable,
    whole: bool = False,
    environment: dict[str, str] | None = None,
) -> dict[str, Any]:
    """Outcomes by name, with the product of `tree` and the packages of `python`; see `outcome`."""
    with tempfile.TemporaryDirectory(prefix="golden") as folder:
        target = Path(folder) / "outcomes.json"
        env = {k: v for k, v in os.environ.items() if k not in ("PYTHONWARNINGS", "FORCE_COLOR", "LC_ALL")}
        path = os.pathsep.join((str(tree), str(Path(__file__).parents[1])))
        env |= ENVIRONMENT | {"PYTHONPATH": path} | (environment or {})
        words = [str(python), "-P", "-c", PROGRAM, str(target), str(tree), "whole" if whole else ""]
        subprocess.run([*words, *names], check=True, cwd=folder, env=env)
        return json.loads(target.read_text(encoding="utf-8"))


def answer(target: str, tree: str, whole: str, *names: str) -> None:
    """The program that `run` starts: outcomes of the cases, to a file."""
    import balancing
    import fem
    import rotorid

    with contextlib.suppress(ImportError):
        import typer.main

        typer.main.get_command = functools.cache(typer.main.get_command)  # once for all command lines
    for package in (balancing, fem, rotorid):
        if not Path(package.__file__).resolve().is_relative_to(Path(tree).resolve()):
            raise RuntimeError(f"{package.__file__} is not in {tree}")
    place = Path.cwd() / "place"
    shutil.copytree(Path(tree) / "sample_data", place / "sample_data")
    os.chdir(place)
    outcomes = {name: outcome(CASES[name], place, whole=bool(whole)) for name in names}
    Path(target).write_text(json.dumps(outcomes, ensure_ascii=False), encoding="utf-8")


def outcome(case: Case, place: Path, *, whole: bool = False) -> dict[str, Any]:
    """What a case gives: "status", "output", "error", "seconds", with `--json` where there is a document.

    With `whole`, also "text", the same without `--json`, and "files", what is in those that it wrote.
    """
    import rotorid.cli

    before = _files(place)
    try:
        for name, (source, old, new) in case.edits.items():
            text = (place / source).read_text(encoding="utf-8")
            if old not in text:
                return {"status": f"{source} has no {old!r}", "output": "", "error": ""}
            (place / name).write_text(text.replace(old, new), encoding="utf-8")
        for command in case.before:
            if (first := _call(rotorid.cli.main, shlex.split(command)))["status"]:
                return first | {"status": f"{command}: {first['status']}"}
        given = _files(place)
        found = _call(rotorid.cli.main, case.json_words)
        if whole:
            _remove(place, given)
            found["text"] = _call(rotorid.cli.main, case.words)
            found["files"] = {name: _content(place / name) for name in sorted(_files(place) - given)}
        return found
    finally:
        _remove(place, before)


def _call(main: Any, words: list[str]) -> dict[str, Any]:
    output, error = io.StringIO(), io.StringIO()
    sys.argv = ["rotorid", *words]
    status: object = 0
    begun = time.process_time()
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(error):
        try:
            main()
        except SystemExit as stop:
            status = 0 if stop.code is None else stop.code
        except Exception as raised:
            status = f"raises {type(raised).__name__}"
    seconds = round(time.process_time() - begun, 3)
    texts = {"output": masked(output.getvalue()), "error": masked(error.getvalue())}
    return {"status": status, **texts, "seconds": seconds}


def masked(text: str) -> str:
    """Without dates with their time, and seconds that it took."""
    for pattern, new in MASKS:
        text = pattern.sub(new, text)
    return text


def _files(place: Path) -> set[str]:
    return {str(path.relative_to(place)) for path in place.rglob("*") if path.is_file()}


def _remove(place: Path, but: set[str]) -> None:
    for name in _files(place) - but:
        (place / name).unlink()
    shutil.rmtree(place / "d", ignore_errors=True)


def _content(path: Path) -> str:
    """The text of a file; of others the hash of what does not depend on the time."""
    if zipfile.is_zipfile(path):
        with zipfile.ZipFile(path) as file:
            names = [name for name in sorted(file.namelist()) if name != "docProps/core.xml"]
            return "\n".join(f"{name} {hashlib.sha256(file.read(name)).hexdigest()}" for name in names)
    data = path.read_bytes()
    try:
        return masked(data.decode("utf-8"))
    except UnicodeDecodeError:
        data = data[116:] if path.suffix == ".mat" else data  # a head with the date
        return hashlib.sha256(data).hexdigest()
