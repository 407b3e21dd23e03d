"""What the worksheet shows, computed by the commands in a process beside the server.

The page computes nothing, and neither does this: it calls what the command line calls.
"""

from __future__ import annotations

import errno
import functools
import os
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rotorid.worksheet.job_files import Stamp, stamp

if TYPE_CHECKING:
    from rotorid.files import Job
    from rotorid.report.outcome import Outcome

NOT_FINISHED = "the check run is not finished: the answer is that of the runs before it"
_read: dict[str, Stamp] = {}
"""Names of the files that were read, each with its stamp before that."""


def answered(folder: str, do: str, *given: object) -> dict[str, Any]:
    """Do what is asked for in a folder: its `value`, or why it is `refused`; which files were `read`."""
    from rotorid.files.disk import reading

    reading.set(_note)
    answer: dict[str, Any]
    try:
        os.chdir(folder)  # each time: another one may have been put in its place
        answer = {"value": REQUESTS[do](*given)}
    except (ValueError, OSError, ArithmeticError) as error:
        answer = {"refused": str(error)}
    except Exception as error:  # a defect of the program, of which the page must not wait for ever
        answer = {"refused": f"the calculation failed, {type(error).__name__}: {error}"}
    return {**answer, "read": dict(_read)}


def _note(path: Path) -> None:
    """Refuse a file outside of the folder, by whatever file it is named."""
    if not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(".")):
        raise OSError(errno.EACCES, "it is outside the folder of the job, where the worksheet reads nothing")
    _read[str(path)] = stamp(path)


class Results(NamedTuple):
    """What a window shows beside the files.

    Attributes
    ----------
    problems, refused
        Of the files, as `Problem` with their `text`; why there is no answer.
    answer, asked
        As `balanced` gives it, and of what; None: there is none.
    busy, version
        What is being computed; another number for another answer.
    """

    problems: tuple[dict[str, Any], ...] = ()
    refused: str = ""
    answer: dict[str, Any] | None = None
    asked: tuple[str, int, bool] | None = None
    busy: str = ""
    version: int = 0


def whole_job(job: str, version: int) -> Results:
    """The answer of this version of the files, or their problems.

    While a check run is being typed, or is wrong, the answer is that of the runs before it.
    """
    from rotorid.files.problems import InputError

    seen = Results()
    for asked in ((job, version, True), (job, version, False)):
        try:
            return seen._replace(answer=balanced(*asked), asked=asked)
        except (ValueError, OSError, ArithmeticError) as error:
            if asked[2]:
                why = "" if isinstance(error, InputError) else str(error)
                rows = [{**vars(one), "text": str(one)} for one in getattr(error, "problems", ())]
                seen = seen._replace(problems=tuple(rows), refused=why)
    return seen


@functools.lru_cache(maxsize=2)
def _balance(job: str, version: int, checked: bool) -> tuple[Outcome, Job, list[str]]:
    """The job, in pieces where planes have holes, with the trim after its check run; warnings of reading it.

    It is balanced once for each version of its files.
    """
    from rotorid.base.answer import kinds
    from rotorid.commands.balance import BalanceOptions, corrected
    from rotorid.commands.balance_solution import job_of
    from rotorid.commands.without_phase import balanced_without_phase

    source = Path(job) if checked else _without_check(Path(job))
    refused = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        read, files, again = job_of(source, BalanceOptions())
        if read.trials.amplitudes_only:
            return balanced_without_phase(read, BalanceOptions()), read, []
        made = corrected(read, BalanceOptions(), files, again)
        split, refine = bool(read.holes), read.check is not None
        if split or refine:
            try:
                made = corrected(read, BalanceOptions(split=split, refine=refine), files, again)
            except (ValueError, OSError, ArithmeticError) as error:
                refused = [f"no {'trim' if refine else 'pieces'}: {error}"]
    warned = kinds(str(one.message) for one in caught if issubclass(one.category, UserWarning))
    return made, read, warned + refused


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


def balanced(*asked: Any) -> dict[str, Any]:  # noqa: ANN401
    """The answer: what to do, its tables as HTML, what there is to mount."""
    from markupsafe import Markup

    from rotorid.base.tables import Column, Table, html
    from rotorid.base.text import figures
    from rotorid.report.balance import to_do

    made, job, read = _balance(*asked)
    answer, document, labels = made.answer, made.document, job.trials.labels
    shown = {
        "judgement": answer.judgement,
        "warnings": [*([] if asked[-1] else [NOT_FINISHED]), *read, *answer.warnings],
    }
    if job.trials.special or job.trials.amplitudes_only:  # the columns of these are others
        tables = str(Markup("<pre>{}</pre>").format(answer.numbers))
        return {**shown, "tables": tables, "parts": "", "notes": [*answer.notes], "to_mount": []}
    rows = document["mounting"]["holes"] if "mounting" in document else document["corrections"]

    def at(row: Mapping[str, Any]) -> float:  # removed from the other side
        drilled = row.get("remove_at_deg")
        return float(row["angle_deg"] if drilled is None else drilled)

    parts = [] if "left_to_do" in document else document["parts"]
    shapes = (("part", "part", str), (labels.weight_in, "mass", figures), ("at °", "angle_deg", figures))
    columns = tuple(Column(title, [row[key] for row in parts], words) for title, key, words in shapes)
    refer = f"For {document['corrections_refer_to']}. " * ("left_to_do" not in document)
    return {
        **shown,
        "tables": str(Markup("\n").join(to_do(document, made.result, job, boxes=False).values())),
        "parts": html(Table("parts", columns)) if parts else "",
        "notes": [f"{refer}Angles count {labels.angles}, phase {labels.phase}.", *answer.notes],
        "to_mount": [{**row, "at": at(row)} for row in rows],
    }


def picture(*asked: Any) -> str:  # noqa: ANN401
    """Weights and readings before and after, or discs with pieces in their holes."""
    from rotorid.report.page import inline_svg

    made = _balance(*asked)[0]
    return str(inline_svg(made.figure(), made.answer.judgement))


def sheet(*asked: Any) -> str:  # noqa: ANN401
    """The balancing sheet."""
    return _balance(*asked)[0].sheet().decode()


def trial(job: str | None, options: dict[str, Any]) -> str:
    """A first trial weight, with the job's coefficients or from the load alone, in HTML."""
    from markupsafe import Markup

    from rotorid.commands.trial_weight import TrialWeightOptions, trial_weight

    made = trial_weight(None if job is None else Path(job), TrialWeightOptions(**options))
    answer = made.answer
    lines = [answer.judgement, answer.numbers, *answer.warnings, *answer.notes]
    return Markup("").join(Markup("<p>{}</p>").format(line) for line in lines if line)


REQUESTS: Mapping[str, Callable[..., Any]] = {one.__name__: one for one in (whole_job, picture, sheet, trial)}
