"""What the worksheet shows, computed by the commands in processes beside the server.

The page computes nothing, and neither does this: it calls what the command line calls.
"""

from __future__ import annotations

import errno
import functools
import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rotorid.base.tables import Column, Table, html
from rotorid.base.text import figures
from rotorid.worksheet.job_files import Stamp, stamp

if TYPE_CHECKING:
    from markupsafe import Markup

    from balancing import Labels
    from rotorid.commands.balance import Balance
    from rotorid.files import Job

NOT_FINISHED = "the check run is not finished: the answer is that of the runs before it"
_TWO = partial(figures, digits=2)
_SHOWN: Mapping[str, Callable[[Any], str]] = {"mass": figures, "angle_deg": "{:.1f}°".format}
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


def _problems(error: Exception) -> tuple[dict[str, Any], ...]:
    return tuple({**vars(one), "text": str(one)} for one in getattr(error, "problems", ()))


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
                seen = seen._replace(problems=_problems(error), refused=why)
    return seen


@functools.lru_cache(maxsize=2)
def _balance(job: str, version: int, checked: bool) -> tuple[Balance, list[str]]:
    """The job, in pieces where planes have holes, with the trim after its check run; warnings of reading it.

    It is balanced once for each version of its files.
    """
    from rotorid.base.answer import kinds
    from rotorid.commands.balance import BalanceOptions, balance

    source = Path(job) if checked else _without_check(Path(job))
    refused = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        made = balance(source, BalanceOptions())
        split, refine = bool(made.job.holes), made.job.check is not None
        if split or refine:
            try:
                made = balance(source, BalanceOptions(split=split, refine=refine))
            except (ValueError, OSError, ArithmeticError) as error:
                refused = [f"no {'trim' if refine else 'pieces'}: {error}"]
    return made, kinds(str(one.message) for one in caught if issubclass(one.category, UserWarning)) + refused


def _without_check(path: Path) -> Job:
    """The job as it is before its check run; InputError where it has none."""
    from rotorid.files.job import job_of, open_job
    from rotorid.files.problems import InputError, Problems

    problems = Problems()
    written = open_job(path, problems)
    if "check" not in {**written.settings, **written.tables}:
        raise InputError(())
    for key in ("check", "check_weights"):
        written.settings.pop(key, None)
        written.tables.pop(key, None)
    return job_of(written, problems)


def balanced(*asked: Any) -> dict[str, Any]:  # noqa: ANN401
    """The answer: what to do, with its tables as HTML; what there is to mount, and a list of it to tick."""
    made, read = _balance(*asked)
    answer, document, labels = made.answer, made.document, made.job.trials.labels
    path = "mounting.holes" if "mounting" in document else "corrections"
    boxes = Column("mounted", [f"{k}" for k in range(len(_at(document, path)))], _box)
    return {
        "judgement": answer.judgement,
        "tables": str(_tables(document, made, labels)),
        "warnings": [*([] if asked[-1] else [NOT_FINISHED]), *read, *answer.warnings],
        "notes": list(answer.notes),
        "to_mount": [dict(row) for row in _at(document, path)],
        "unit": labels.weight_unit,
        "list": str(html(_table(document, path, _work(labels), more=[boxes]))),
    }


def _box(row: str) -> str:
    from markupsafe import Markup

    box = '<label class="check"><input type="checkbox" name="{0}" aria-label="mounted, {0}" checked></label>'
    return Markup(box).format(row)


def _work(labels: Labels) -> dict[str, str]:
    """Headings of what is to be done, by the keys of the document."""
    places = {"plane": "plane", "action": "", "hole": "hole", "pieces": "pieces"}
    return {**places, "mass": labels.weight_in, "angle_deg": "at"}


def _tables(document: Mapping[str, Any], made: Balance, labels: Labels) -> Markup:
    """What to mount, with 95 % of it, or what is left to do."""
    from markupsafe import Markup

    left, pieces, last = document.get("left_to_do"), document.get("mounting"), document["mounted_in_last_run"]
    table, work, words = partial(_table, document), _work(labels), f"For {document['corrections_refer_to']}. "
    tables = []
    if left:
        words = ""
        if left["word"] == "trim":
            tables += [table("left_to_do.holes" if left["holes"] else "left_to_do.add", work, "To add")]
        tables += [table("left_to_do.mounted", work, f"Mounted in {left['run']}")]
    elif pieces:
        tables += [table("mounting.holes", work)]
    else:
        sizes, angles = made.result.half_widths()
        within = [
            Column(f"± {labels.weight_in}", sizes * labels.weight_scale, _TWO),
            Column("± °", np.degrees(angles), _TWO),
        ]
        tables += [table("corrections", work, more=within)]
        words += "95 of 100 such weights lie within ±. "
        if last and any(row["mass"] for row in last["weights"]):
            tables += [table("add_to_mounted", work, f"Instead, if the weights of {last['run']} stay")]
        if document["other_readings"]:
            tables += [table("other_readings", {"if": "if", **work}, "Under another convention")]
    words += f"Angles count {labels.angles}, phase {labels.phase}."
    first, *others = map(html, tables)
    return Markup("\n").join([first, Markup("<p>{}</p>").format(words), *others])


def _at(document: Mapping[str, Any], path: str) -> Sequence[Mapping[str, Any]]:
    rows: Any = document
    for part in path.split("."):
        rows = rows[part]
    return rows  # type: ignore[no-any-return]


def _table(
    document: Mapping[str, Any],
    path: str,
    headings: Mapping[str, str],
    name: str = "",
    *,
    more: Sequence[Column] = (),
) -> Table:
    """Rows of the document; columns in which nothing stands are left out."""
    rows = _at(document, path)
    if all(row.get("action") == "add" for row in rows):  # which needs no words
        headings = {key: text for key, text in headings.items() if key != "action"}
    columns = []
    for key, heading in headings.items():
        shown = _SHOWN.get(key, str)
        if key == "angle_deg" and all(row.get("remove_at_deg") is not None for row in rows):
            key = "remove_at_deg"  # where it is drilled
        if key.endswith("_deg") and any("hole" in row for row in rows):
            shown = "{:.6g}°".format  # holes are where they are
        columns.append(Column(heading, [row.get(key) for row in rows], shown, f"{path}.*.{key}"))
    return Table(name, (*(one for one in columns if any(one.texts)), *more))


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
