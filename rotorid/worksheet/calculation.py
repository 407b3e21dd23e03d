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
from typing import TYPE_CHECKING, Any

from rotorid.worksheet.job_files import Stamp, is_inside, stamp

if TYPE_CHECKING:
    from rotorid.files import Job
    from rotorid.report.outcome import Outcome

Results = dict[str, Any]
"""What a window shows beside the files: the `answer` that `balanced` gives, and of what it was `asked`; else
the `problems` of files, as `Problem` with their `text`, or why it is `refused`."""


def answered(folder: str, do: Callable[..., Any], *given: Any) -> dict[str, Any]:  # noqa: ANN401
    """Do what is asked for in a folder: its `value`, or why it is `refused`; stamps of what was `read`."""
    from rotorid.files.disk import reading

    answer, read = dict[str, Any](), dict[str, Stamp]()

    def note(path: Path) -> None:
        if not is_inside(path, "."):  # by whatever file it is named
            why = "it is outside the folder of the job, where the worksheet reads nothing"
            raise OSError(errno.EACCES, why)
        read[str(path)] = stamp(path)

    reading.set(note)
    try:
        os.chdir(folder)  # each time: another one may have been put in its place
        answer["value"] = do(*given)
    except (ValueError, OSError, ArithmeticError) as error:
        answer["refused"] = str(error)
    except Exception as error:  # a defect of the program, of which the page must not wait for ever
        answer["refused"] = f"the calculation failed, {type(error).__name__}: {error}"
    return {**answer, "read": read}


def whole_job(job: str, version: int) -> Results:
    """The answer of this version of the files, or their problems.

    While a check run is being typed, or is wrong, the answer is that of the runs before it.
    """
    seen = Results()
    for asked in ((job, version, True), (job, version, False)):
        try:
            return {**seen, "answer": balanced(*asked), "asked": asked}
        except (ValueError, OSError, ArithmeticError) as error:
            if not seen:
                rows = [{**vars(one), "text": str(one)} for one in getattr(error, "problems", ())]
                seen = {"problems": rows, "refused": "" if rows else str(error)}
    return seen


@functools.lru_cache(maxsize=2)
def _balance(job: str, version: int, checked: bool) -> tuple[Outcome, Job, list[str]]:
    """The job, in pieces where planes have holes, with the trim after its check run; warnings of reading it.

    It is balanced once for each version of its files.
    """
    from rotorid.base.answer import kinds
    from rotorid.commands.balance import BalanceOptions, corrected
    from rotorid.commands.balance_options import job_of
    from rotorid.commands.without_phase import balanced_without_phase

    plain, warned = BalanceOptions(), list[str]()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        read, files, again = job_of(Path(job) if checked else _without_check(Path(job)), plain)
        if read.trials.amplitudes_only:
            return balanced_without_phase(read, plain), read, []
        options = BalanceOptions(split=bool(read.holes), refine=read.check is not None)
        try:
            made = corrected(read, options, files, again)
        except (ValueError, OSError, ArithmeticError) as error:
            made = corrected(read, plain, files, again)
            warned = [f"no {'trim' if options.refine else 'pieces'}: {error}"]
    texts = kinds(str(one.message) for one in caught if issubclass(one.category, UserWarning))
    return made, read, texts + warned


def _without_check(path: Path) -> Job:
    """The job as it is before its check run."""
    from rotorid.files.input_problems import Problems
    from rotorid.files.job import job_of, open_job

    problems = Problems()
    written = open_job(path, problems)
    for key in ("check", "check_weights"):
        written.settings.pop(key, None)
        written.tables.pop(key, None)
    return job_of(written, problems)


def balanced(job: str, version: int, checked: bool) -> dict[str, Any]:
    """The answer: what to do, its tables as HTML, remarks, what there is to mount."""
    from rotorid.report.balance import to_do
    from rotorid.report.page import block

    made, read, warned = _balance(job, version, checked)
    answer, document, labels = made.answer, made.document, read.trials.labels
    if not checked:
        warned = ["the check run is not finished: the answer is that of the runs before it", *warned]
    remarks = [("Warning:", text) for text in (*warned, *answer.warnings)]
    remarks += [("Note:", text) for text in answer.notes]
    shown = {"judgement": answer.judgement, "remarks": remarks}
    if read.trials.special or read.trials.amplitudes_only:  # the columns of these are others
        return {**shown, "tables": [block(answer.numbers)]}
    trim = "left_to_do" in document
    refer = "" if trim else f"For {document['corrections_refer_to']}. "
    if not trim and made.result.parts is not None:
        remarks.append(("In parts,", f"{labels.weight_in}: {made.result.parts.in_words()}."))
    remarks.append(("", f"{refer}Angles count {labels.angles}, phase {labels.phase}."))
    return {
        **shown,
        "tables": [*to_do(document, made.result, read, boxes=False).values()],
        "unit": labels.weight_in,
        "to_mount": document["mounting"]["holes"] if "mounting" in document else document["corrections"],
    }


def drawn(what: str, *asked: Any) -> str:  # noqa: ANN401
    """The balancing `sheet`, or a picture: readings before and after, or discs with pieces in their holes."""
    from rotorid.report.page import inline_svg

    made = _balance(*asked)[0]
    return made.sheet().decode() if what == "sheet" else str(inline_svg(made.figure(), made.answer.judgement))


def trial(job: str, fields: Mapping[str, str]) -> list[str]:
    """A first trial weight, from the load alone or `with_job` with the job's coefficients, as paragraphs."""
    from rotorid.commands.trial_weight import TrialWeightOptions, trial_weight

    options: dict[str, Any] = {}
    for name, text in fields.items():
        key, _, unit = name.partition(" ")
        number = text.replace(",", ".")
        if number and "with_job" not in fields:
            options[key] = float(number) if unit == "deg" else f"{number}{unit}"
    made = trial_weight(Path(job) if "with_job" in fields else None, TrialWeightOptions(**options))
    answer = made.answer
    return [answer.judgement, answer.numbers, *answer.warnings, *answer.notes]
