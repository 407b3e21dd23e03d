"""What the worksheet shows, computed by the commands in a process of its own: one JSON line a request.

    python -m rotorid.worksheet.calculation

Each line of standard input is {"do": NAME, …arguments}; its answer is {"value": …}, or {"refused": sentence},
or {"problems": […]} of files. The page computes nothing, and neither does this: it calls what the command
line calls.
"""

from __future__ import annotations

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
    from rotorid.files import Job
    from rotorid.report.outcome import Outcome

NOT_FINISHED = "the check run is not finished: the answer is that of the runs before it"
_kept: dict[str, tuple[Balance, list[str]]] = {}
"""Newest balances by what was asked for: the result (for pictures and sheets), what was warned of."""
_read: dict[str, int] = {}
"""Names of the files that were read, and when each was changed before that (ns)."""


def main() -> None:
    """Answer requests until standard input ends."""
    from rotorid.files.disk import reading

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


def _balance(job: str, asked: dict[str, Any]) -> tuple[Balance, list[str]]:
    """The job as it is now, balanced once for each version of its files, and what reading it warned of."""
    from rotorid.base.answer import kinds
    from rotorid.commands.balance import BalanceOptions, balance

    name = json.dumps(asked)
    if name not in _kept:
        options = BalanceOptions(split=asked["split"], refine=asked["refine"])
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            made = balance(Path(job) if asked["checked"] else _without_check(Path(job)), options)
        if len(_kept) > 1:
            _kept.clear()
        _kept[name] = (
            made,
            kinds(str(one.message) for one in caught if issubclass(one.category, UserWarning)),
        )
    return _kept[name]


def _without_check(path: Path) -> Job:
    """The job as it is before its check run."""
    from rotorid.files.job import job_of, open_job
    from rotorid.files.problems import Problems

    problems = Problems()
    written = open_job(path, problems)
    for key in ("check", "check_weights"):
        written.settings.pop(key, None)
        written.tables.pop(key, None)
    return job_of(written, problems)


def in_words(outcome: Outcome) -> dict[str, Any]:
    """The document of `--json`, and what a person reads."""
    answer = outcome.answer
    return {
        "judgement": answer.judgement,
        "lines": answer.numbers,
        "warnings": list(answer.warnings),
        "notes": list(answer.notes),
        "document": outcome.document,
    }


def balanced(job: str, asked: dict[str, Any]) -> dict[str, Any]:
    """Weights, pieces in holes, a trim; `within` is what 95 % of such weights keep to, mass and degrees.

    What was warned of when the files were read stands first among the warnings.
    """
    import numpy as np

    made, warned = _balance(job, asked)
    answer, (sizes, angles) = in_words(made), made.result.half_widths()
    scale = made.job.trials.labels.weight_scale, 180 / math.pi
    within = [
        {
            key: value if math.isfinite(value) else None
            for key, value in zip(("mass", "angle_deg"), row, strict=True)
        }
        for row in (np.column_stack([sizes, angles]) * scale).tolist()
    ]
    first = [] if asked["checked"] else [NOT_FINISHED]
    return {**answer, "warnings": [*first, *warned, *answer["warnings"]], "within": within}


def so_far(job: str) -> dict[str, Any]:
    """What the finished rows of a job say."""
    from rotorid.worksheet.runs_so_far import runs_so_far

    return runs_so_far(Path(job)).to_dict()


def channel(job: str, speed: str, sensor: str) -> str:
    """Polar picture of the runs of one sensor at one speed."""
    from rotorid.worksheet.runs_so_far import runs_so_far

    return _svg(runs_so_far(Path(job)).figure(speed, sensor), f"Runs of {sensor} at {speed}")


def picture(job: str, asked: dict[str, Any]) -> str:
    """Weights and readings before and after, or discs with pieces in their holes."""
    made = _balance(job, asked)[0]
    return _svg(made.figure(), made.answer.judgement)


def _svg(figure: Figure, title: str) -> str:
    from rotorid.report.page import inline_svg

    return str(inline_svg(figure, title))


def sheet(job: str, asked: dict[str, Any]) -> str:
    """The balancing sheet."""
    return _balance(job, asked)[0].sheet().decode()


def trial(job: str | None, options: dict[str, Any]) -> dict[str, Any]:
    """A first trial weight, with the job's coefficients or from the load alone."""
    from rotorid.commands.trial_weight import TrialWeightOptions, trial_weight

    made = trial_weight(None if job is None else Path(job), TrialWeightOptions(**options))
    answer = in_words(made)
    to_draw = all(one["angle_deg"] is not None for one in answer["document"]["trial_weights"])
    return {**answer, "picture": _svg(made.figure(), answer["judgement"]) if to_draw else ""}


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


REQUESTS: Mapping[str, Callable[..., Any]] = {
    one.__name__: one for one in (so_far, balanced, channel, picture, sheet, trial, convention)
}

if __name__ == "__main__":
    main()
