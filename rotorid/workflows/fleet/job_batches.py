"""Jobs of a tree as rows, read in this process or in several."""

from __future__ import annotations

import contextvars
import warnings
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any, NamedTuple

from rotorid.base.worker_processes import single_threads, worker_pool

if TYPE_CHECKING:
    from balancing import Influence
    from rotorid.base.arrays import ComplexArray
    from rotorid.tables import Job
    from rotorid.tables.fleet.fleet_tables import JobRows
    from rotorid.tables.fleet.job_search import FoundJob

CHUNK = 16
"""Jobs that a process reads before it gives them back."""
_SHOWN = 3
"""Lines of a reason."""


class ReadJob(NamedTuple):
    """A job, and its rows by table, or why there are none."""

    found: FoundJob
    rows: JobRows | None
    reason: str = ""


def read_jobs(found: Sequence[FoundJob], workers: int) -> Iterator[ReadJob]:
    """Jobs in their order; what was read of them is not kept."""
    chunks = [found[i : i + CHUNK] for i in range(0, len(found), CHUNK)]
    if workers == 1:
        yield from (read for chunk in chunks for read in _read_chunk(chunk))
        return
    with single_threads(), worker_pool(workers) as pool:
        under_way: deque[Future[list[ReadJob]]] = deque()
        for chunk in chunks:
            under_way.append(pool.submit(_read_chunk, chunk))
            if len(under_way) > 3 * workers:
                yield from under_way.popleft().result()
        while under_way:
            yield from under_way.popleft().result()


def _read_chunk(chunk: Sequence[FoundJob]) -> list[ReadJob]:
    return [apart(_read, found) for found in chunk]


def apart(function: Any, *given: Any) -> Any:  # noqa: ANN401 - any function
    """Call without what the command has read so far: the files of a whole tree would fill the memory."""
    return contextvars.Context().run(function, *given)


def reason_of(error: Exception) -> str:
    """The first lines of what is wrong with a file."""
    text = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    lines = text.splitlines() or [type(error).__name__]
    more = f"\nand {len(lines) - _SHOWN} more lines" if len(lines) > _SHOWN else ""
    return "\n".join(lines[:_SHOWN]) + more


def _read(found: FoundJob) -> ReadJob:
    from rotorid.tables import read_job
    from rotorid.tables.reader.input_file import each_file_once

    try:
        with each_file_once(), warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            rows = _rows(found, read_job(found.file), caught)
    except (ValueError, OSError, ArithmeticError, MemoryError) as error:
        return ReadJob(found, None, reason_of(error))
    return ReadJob(found, rows)


def _rows(found: FoundJob, job: Job, caught: Sequence[warnings.WarningMessage]) -> JobRows:
    """Rows of a job with its coefficients, and what `correct` proposes where that was mounted."""
    from balancing import estimate_influence
    from rotorid.tables.fleet.job_records import job_id, job_rows
    from rotorid.tables.reader.input_file import sha256

    influence, undetermined = job.influence, ""
    try:
        influence = influence or estimate_influence(job.trials)
    except ValueError as error:
        undetermined = str(error)
    before, proposed, refused = (None, None, "") if influence is None else _checked(job, influence)
    said = [*(job.trials if influence is None else influence).warnings, *(str(one.message) for one in caught)]
    said += [job.trials.labels.assumed_in_words(), refused]
    files = [sha256(file) for file in job.files]
    own = {
        "job": job_id(files),
        "path": found.path,
        "machine": found.machine,
        "machine_type": found.machine_type,
        "date": found.date,
        "files": files,
        "runs_file": sha256(found.runs_file),
        "warnings": list(dict.fromkeys(filter(None, said))),
        "undetermined": undetermined,
    }
    return job_rows(job, own, influence, proposed, before)


def _checked(
    job: Job, influence: Influence
) -> tuple[ComplexArray | None, tuple[Sequence[str], ComplexArray] | None, str]:
    """Of a job with check runs: vibration of the bare rotor, proposed corrections, or why there are none."""
    from balancing import correct
    from balancing.coefficients.baseline import starting_point

    if job.check is None:
        return None, None, ""
    runs = None if job.influence is None else job.trials
    try:
        before = starting_point(influence, runs).readings
        if job.check_mounted:
            return before, None, ""
        made = correct(
            influence,
            runs,
            [plane for plane in influence.planes if plane not in job.left_out],
            limits=job.limits_of(influence.planes),
            row_weights=job.row_weights,
            remove=sorted(job.remove),
        )
    except ValueError as error:
        return influence.baseline, None, f"no corrections are proposed: {error}"
    return before, (made.planes, made.weights), ""
