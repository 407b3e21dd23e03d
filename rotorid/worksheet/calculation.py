"""What the worksheet shows, computed by the commands in a process of its own: one JSON line a request.

    python -m rotorid.worksheet.calculation

Each line of standard input is {"do": NAME, …arguments}; its answer is {"value": …}, or {"refused": sentence},
or {"problems": […]} of files. The page computes nothing, and neither does this: it calls what the command
line calls.
"""

from __future__ import annotations

import base64
import errno
import json
import math
import os
import signal
import sys
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rotorid.commands.balance import Balance
    from rotorid.report.outcome import Outcome
    from rotorid.tables import Job

KINDS: Mapping[str, Mapping[str, Any]] = {"answer": {}, "pieces": {"split": True}, "trim": {"refine": True}}
"""Balances of one job, by the options of `rotorid balance`."""
UNCHECKED = " before the check run"
"""Behind a kind: as if there were no check run, which somebody is typing."""
_kept: dict[str, tuple[int, Balance, list[str]]] = {}
"""The newest of each kind: version of the files, result (for pictures and sheets), what was warned of."""
_read: dict[str, int] = {}
"""Names of the files that were read, and when each was changed before that (ns)."""


def main() -> None:
    """Answer requests until standard input ends."""
    from rotorid.files.input_file import reading

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    reading.set(_noted)
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    sys.stdout = sys.stderr  # nothing that is printed may come between the answers
    for line in sys.stdin:
        request = json.loads(line)
        answer = {**_answered(request.pop("do"), request.pop("folder"), request), "read": _read}
        print(json.dumps(answer), file=answers, flush=True)


def _noted(path: Path) -> None:
    """Refuse a file outside of the folder, by whatever file it is named."""
    if not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(".")):
        raise OSError(errno.EACCES, "it is outside the folder of the job, where the worksheet reads nothing")
    _read[str(path)] = path.stat().st_mtime_ns if path.exists() else 0


def _answered(name: str, folder: str, request: dict[str, Any]) -> dict[str, Any]:
    from rotorid.files.problems import InputError

    try:
        os.chdir(folder)  # each time: another one may have been put in its place
        return {"value": REQUESTS[name](**request)}
    except InputError as error:
        return {"problems": [{**vars(one), "text": str(one)} for one in error.problems]}
    except (ValueError, OSError, ArithmeticError) as error:
        return {"refused": str(error)}


def _balance(job: str, version: int, kind: str) -> Balance:
    """The job as it is now, balanced; once for each version of its files."""
    from rotorid.base.answer import kinds
    from rotorid.commands import BalanceOptions, balance

    if kind not in _kept or _kept[kind][0] != version:
        options = BalanceOptions(**KINDS[kind.removesuffix(UNCHECKED)])
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            found = balance(_without_check(Path(job)) if kind.endswith(UNCHECKED) else Path(job), options)
        said = kinds(str(one.message) for one in caught if issubclass(one.category, UserWarning))
        _kept[kind] = version, found, said
    return _kept[kind][1]


def _without_check(path: Path) -> Job:
    """The job as it is before its check run."""
    from rotorid.files.job import Overrides, job_of
    from rotorid.files.job_excel import open_job
    from rotorid.files.problems import Problems

    problems = Problems()
    written = open_job(path, problems)
    for key in ("check", "check_weights"):
        written.settings.pop(key, None)
        written.tables.pop(key, None)
    return job_of(written, Overrides(), problems)


def told(outcome: Outcome) -> dict[str, Any]:
    """The document of `--json`, and what a person reads."""
    answer = outcome.answer
    words = {"judgement": answer.judgement, "found": answer.found}
    return {
        **words,
        "warnings": list(answer.warnings),
        "notes": list(answer.notes),
        "document": outcome.document,
    }


def balanced(job: str, version: int, kind: str) -> dict[str, Any]:
    """Weights, pieces in holes, or a trim; what was warned of when the files were read stands first."""
    found, said = told(_balance(job, version, kind)), _kept[kind][2]
    if kind.endswith(UNCHECKED):
        said = ["the check run is not finished: the answer is that of the runs before it", *said]
    return {**found, "warnings": [*said, *found["warnings"]]}


def so_far(job: str, version: int) -> dict[str, Any]:
    """What the finished rows of a job say."""
    from rotorid.worksheet.runs_so_far import runs_so_far

    return runs_so_far(Path(job)).to_dict()


def channel(job: str, version: int, speed: str, sensor: str) -> str:
    """Polar picture of the runs of one sensor at one speed."""
    from rotorid.worksheet.runs_so_far import runs_so_far

    return _svg(runs_so_far(Path(job)).figure(speed, sensor), f"Runs of {sensor} at {speed}")


def picture(job: str, version: int, kind: str) -> str:
    """Weights and readings before and after, or discs with pieces in their holes."""
    found = _balance(job, version, kind)
    return _svg(found.figure(), found.answer.judgement)


def _svg(figure: Figure, title: str) -> str:
    from rotorid.report.page import inline_svg

    return str(inline_svg(figure, title))


def sheet(job: str, version: int, kind: str) -> str:
    """The balancing sheet."""
    return _balance(job, version, kind).sheet().decode()


def whole(job: str, version: int, kind: str) -> str:
    """All tables."""
    return _balance(job, version, kind).answer.whole()


def trial(job: str | None, version: int, options: dict[str, Any]) -> dict[str, Any]:
    """A first trial weight, with the job's coefficients or from the load alone."""
    from rotorid.commands import TrialWeightOptions, trial_weight

    found = told(made := trial_weight(None if job is None else Path(job), TrialWeightOptions(**options)))
    to_draw = all(one["angle_deg"] is not None for one in found["document"]["trial_weights"])
    return {**found, "picture": _svg(made.figure(), found["judgement"]) if to_draw else ""}


def convention(phase: str, angles: str) -> str:
    """Two drawings: how the angles of weights count, and what a phase is."""
    from balancing import Labels
    from balancing.plots import weight_figure
    from rotorid.files.conventions import as_angles, as_phase
    from rotorid.report.conventions_explained import phase_figure

    labels = Labels(phase=as_phase(phase), angles=as_angles(angles))
    weight, title = labels.weight_from(1.0, math.radians(60.0)), f"phase {phase}, angles {angles}"
    turning = _svg(weight_figure(labels, complex(weight)), f"The rotor from its end: {title}")
    return turning + _svg(phase_figure(labels), f"A reading over time: {title}")


def rows(name: str, data: str, phase: str) -> dict[str, Any]:
    """Header and rows of a runs table that is no file of the job, also as an instrument exports it.

    A file that says that its phases are others than the job's, `phase`, is refused.
    """
    from balancing import Labels
    from rotorid.files.cells import show
    from rotorid.files.conventions import Conventions, as_phase
    from rotorid.files.input_file import each_file_once
    from rotorid.files.layout import read_runs_grid
    from rotorid.files.problems import Problems

    problems, path = Problems(), Path(name)
    conventions = Conventions(Labels(phase=as_phase(phase)))
    with each_file_once({path: base64.b64decode(data)}):
        grid = problems.need(read_runs_grid(path, conventions, problems))
    problems.stop()
    return {"header": list(grid.header), "rows": [[show(cell) for cell in cells] for _, cells in grid.rows]}


REQUESTS: Mapping[str, Callable[..., Any]] = {
    "so_far": so_far,
    "balanced": balanced,
    "channel": channel,
    "picture": picture,
    "sheet": sheet,
    "whole": whole,
    "trial": trial,
    "convention": convention,
    "rows": rows,
}

if __name__ == "__main__":
    main()
