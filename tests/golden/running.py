"""Run cases in this process, one after the other, and keep all they give.

Run as a program of its own, so that a tree, the width of the terminal and the like are the same whoever asks:
`run` starts it with the product of any tree on its path.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import html
import io
import json
import os
import re
import shlex
import shutil
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from golden.cases import CASES, JSON, TEXT, Case

HERE = Path(__file__).resolve().parents[2]
"""The tree that this file is in."""
ENVIRONMENT = {
    "MPLBACKEND": "Agg",
    "COLUMNS": "100",
    "LINES": "50",
    "TERM": "dumb",
    "NO_COLOR": "1",
    "TZ": "UTC",
    "PYTHONIOENCODING": "utf-8",
    "OPENBLAS_NUM_THREADS": "1",
}
PROGRAM = "import sys; from golden.running import answer; answer(*sys.argv[1:])"
TREE = Path(os.environ.get("GOLDEN_TREE", HERE)).resolve()
"""The tree whose product is run."""
MASKS = (
    (re.compile(r"\b20\d\d-\d\d-\d\dT\d\d:\d\d:\d\d(\+00:00|Z)?"), "DATE"),
    (re.compile(r"\b20\d\d-\d\d-\d\d[ ,]+\d\d:\d\d(:\d\d)?( UTC)?"), "DATE"),
    (re.compile(r"^rotorid: .* s so far\n", re.M), ""),  # a sign of life after ten seconds
    (re.compile(r"^(rotorid: time: .*) [\d.]+ s$", re.M), r"\1 SECONDS s"),
    (re.compile(r"^(rotorid: versions:) .*$", re.M), r"\1 VERSIONS"),
    (re.compile(r'("version": )"[\w.+]+"'), r'\1"VERSION"'),
    (re.compile(r"\b(rotorid) \d+\.\d+\.\d+[\w.+]*"), r"\1 VERSION"),
    (re.compile(re.escape(str(TREE)) + "/"), "TREE/"),
    # what a command before this one wrote differs by rounding from machine to machine
    (re.compile(r'("file": "(?!sample_data/|[^"]*/sample_data/|d/)[^"]*",\s+"sha256": )"\w+"'), r'\1"HASH"'),
    (re.compile(r"(?<![\w./])((?!sample_data/)[\w./]+, )[0-9a-f]{64}\b"), r"\1HASH"),
)


def masked(text: str) -> str:
    """Without the date, versions and seconds."""
    for pattern, new in MASKS:
        text = pattern.sub(new, text)
    return text


def run(names: Iterable[str], tree: Path = HERE, environment: dict[str, str] | None = None) -> dict[str, Any]:
    """Outcomes by name, with the product of `tree`; see `outcome`."""
    with tempfile.TemporaryDirectory(prefix="golden") as folder:
        target = Path(folder) / "outcomes.json"
        env = {k: v for k, v in os.environ.items() if k not in ("PYTHONWARNINGS", "FORCE_COLOR", "LC_ALL")}
        env |= (
            ENVIRONMENT
            | {"GOLDEN_TREE": str(tree), "PYTHONPATH": f"{tree}{os.pathsep}{Path(__file__).parents[1]}"}
            | (environment or {})
        )
        subprocess.run(
            [sys.executable, "-P", "-c", PROGRAM, str(target), *names],
            check=True,
            cwd=folder,
            env=env,
        )
        return json.loads(target.read_text(encoding="utf-8"))


def outcome(case: Case, place: Path) -> dict[str, Any]:
    """What a case gives.

    Returns
    -------
    dict
        "command"; for each form "status", "output", "error", "seconds"; "copied": names of files,
        "files": name → {"hash", "content"}.
    """
    import rotorid.cli

    before = _files(place)
    try:
        for name, (source, old, new) in case.edits.items():
            text = (place / source).read_text(encoding="utf-8")
            if text.count(old) < 1:
                raise RuntimeError(f"{case.name}: {source} has no {old!r}")
            (place / name).write_text(text.replace(old, new), encoding="utf-8")
        for command in case.before:
            if (first := _call(rotorid.cli.main, shlex.split(command)))["status"]:
                raise RuntimeError(f"{case.name}: {command}: {first['error']}")
        given = _files(place)
        found: dict[str, Any] = {"command": case.command}
        if JSON in case.forms:
            found[JSON] = _call(rotorid.cli.main, case.json_words)
            _remove(place, given)
        if TEXT in case.forms:
            found[TEXT] = _call(rotorid.cli.main, case.words)
        made = sorted(_files(place) - given)
        found["copied"] = "\n".join(name for name in made if not _written(name))
        found["files"] = {name: _content(place / name) for name in made if _written(name)}
        return found
    finally:
        _remove(place, before)


def _written(name: str) -> bool:
    """Whether a file is a result: the demo's copies of the samples are none."""
    return not name.startswith("d/") or name.endswith((".png", "three_masses.toml"))


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
    return {
        "status": status,
        "output": masked(output.getvalue()),
        "error": masked(error.getvalue()),
        "seconds": round(time.process_time() - begun, 3),
    }


def _files(place: Path) -> set[str]:
    return {str(path.relative_to(place)) for path in place.rglob("*") if path.is_file()}


def _remove(place: Path, but: set[str]) -> None:
    for name in _files(place) - but:
        (place / name).unlink()
    shutil.rmtree(place / "d", ignore_errors=True)


def _content(path: Path) -> dict[str, str]:
    """What a file says as text (a table or a matrix as JSON), and the hash of a picture."""
    data = path.read_bytes()
    kind = path.suffix
    if kind == ".png":
        width, height = struct.unpack(">II", data[16:24])
        return {
            "content": f"{data[1:4].decode('ascii')} {width} × {height}",
            "hash": hashlib.sha256(data).hexdigest(),
        }
    if kind == ".xlsx":
        return {"content": masked(_workbook(path))}
    if kind in (".mat", ".npz"):
        return {"content": json.dumps(_arrays(path), indent=1, default=lambda value: value.tolist())}
    text = masked(data.decode("utf-8"))
    if kind == ".html":
        return {"content": _page(text), "hash": hashlib.sha256(text.encode()).hexdigest()}
    return {"content": text}


def _workbook(path: Path) -> str:
    """One line per row that has a cell: sheet, number, values, as JSON."""
    import openpyxl

    lines = []
    for sheet in openpyxl.load_workbook(path):
        for number, row in enumerate(sheet.iter_rows(values_only=True), start=1):
            cells = [value if isinstance(value, int | float | str | None) else str(value) for value in row]
            while cells and cells[-1] is None:
                cells.pop()
            if cells:
                lines.append(json.dumps([sheet.title, number, *cells], ensure_ascii=False))
    return "\n".join(lines) + "\n"


def _arrays(path: Path) -> dict[str, Any]:
    import numpy as np

    if path.suffix == ".npz":
        with np.load(path) as file:
            return {name: file[name].tolist() for name in sorted(file.files)}
    from scipy.io import loadmat

    return {
        name: value.tolist() for name, value in sorted(loadmat(path).items()) if not name.startswith("__")
    }


def _page(text: str) -> str:
    """The words of a page, a row of a table on one line."""
    text = re.sub(r"<(style|script|svg)\b.*?</\1>", "", text, flags=re.DOTALL)
    text = re.sub(r"\s+", " ", text)
    text = re.sub(r"</t[dh]>", " | ", text)
    text = re.sub(
        r"</(tr|p|li|h\d|caption|title|dt|dd|div|section|figcaption|thead|header)>|<br[^>]*>", "\n", text
    )
    lines = (" ".join(html.unescape(re.sub(r"<[^>]*>", "", line)).split()) for line in text.split("\n"))
    return "\n".join(line for line in lines if line.strip(" |")) + "\n"


def answer(target: str, *names: str) -> None:
    """The program that `run` starts: outcomes of the cases, to a file."""
    import typer.main

    import balancing
    import fem
    import rotorid

    typer.main.get_command = functools.cache(typer.main.get_command)  # once for all command lines
    for package in (balancing, fem, rotorid):
        if not Path(package.__file__).resolve().is_relative_to(TREE):
            raise RuntimeError(f"{package.__file__} is not in {TREE}")
    place = Path.cwd() / "place"
    shutil.copytree(TREE / "sample_data", place / "sample_data")
    os.chdir(place)
    outcomes = {name: outcome(CASES[name], place) for name in names}
    Path(target).write_text(json.dumps(outcomes, ensure_ascii=False), encoding="utf-8")
