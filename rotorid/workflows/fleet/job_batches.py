"""Jobs of a tree as rows, read in this process or in several."""

from __future__ import annotations

import contextvars
import warnings
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from rotorid.base.worker_processes import single_threads, worker_pool

if TYPE_CHECKING:
    from rotorid.tables import Job
    from rotorid.tables.fleet.fleet_tables import JobRows
    from rotorid.tables.fleet.job_search import FoundJob

CHUNK, UNDER_WAY = 8, 512
"""Jobs that a process reads before it gives them back, and that all are given at once."""


def read_jobs(found: Sequence[FoundJob], workers: int) -> Iterator[JobRows | str]:
    """Of each job its rows by table, or why there are none; what was read of it is not kept."""
    if workers == 1:
        yield from (apart(_read, job) for job in found)
        return
    with single_threads(), worker_pool(workers) as pool:
        for k in range(0, len(found), UNDER_WAY):
            yield from pool.map(_read, found[k : k + UNDER_WAY], chunksize=CHUNK)


def apart(function: Any, *given: Any) -> Any:  # noqa: ANN401 - any function
    """Call without what the command has read so far: the files of a whole tree would fill the memory."""
    return contextvars.Context().run(function, *given)


def _read(found: FoundJob) -> JobRows | str:
    from rotorid.tables import read_job
    from rotorid.tables.fleet.job_search import reason_of
    from rotorid.tables.reader.input_file import each_file_once

    try:
        with each_file_once(), warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            return _rows(found, read_job(found.file), caught)
    except (ValueError, OSError, ArithmeticError, MemoryError) as error:
        return reason_of(error)


def _rows(found: FoundJob, job: Job, caught: Sequence[warnings.WarningMessage]) -> JobRows:
    """Rows of a job with its coefficients, and what `correct` proposes where that was mounted."""
    from balancing import estimate_influence
    from balancing.coefficients.baseline import starting_point
    from rotorid.tables.fleet.job_records import job_rows, kind_of
    from rotorid.tables.fleet.job_search import job_id
    from rotorid.tables.reader.input_file import sha256
    from rotorid.workflows.coefficients import proposed

    influence, trials, check, labels = job.influence, job.trials, job.check, job.trials.labels
    before = mounted = None
    undetermined = refused = ""
    try:
        influence = influence or estimate_influence(trials)
    except ValueError as error:
        undetermined = str(error)
    if influence is not None and check is not None:
        before, runs = influence.baseline, None if job.influence is None else trials
        try:
            before = starting_point(influence, runs).readings
            if not job.check_mounted:
                correction = proposed(job, influence, runs)
                mounted = correction.planes, correction.weights
        except ValueError as error:
            refused = f"no corrections are proposed: {error}"
    told = [str(one.message).encode(errors="replace").decode() for one in caught]  # of any names of files
    said = [*(trials if influence is None else influence).warnings, *told]
    said += [labels.assumed_in_words(), refused]
    files = [sha256(file) for file in job.files]
    quantity, weight_kind = kind_of(labels)
    own = {
        "job": job_id(files),
        "path": found.path,
        "machine": job.machine or found.machine,
        "machine_type": job.machine_type or found.machine_type,
        "date": job.date or found.date,
        "quantity": quantity,
        "weight_kind": weight_kind,
        "vibration_unit": labels.vibration_unit,
        "weight_unit": labels.weight_unit,
        "files": files,
        "runs_file": sha256(found.tables.get("runs", found.file)),
        "warnings": list(dict.fromkeys(filter(None, said))),
        "trial_runs": len(trials.runs),
        "check_runs": 0 if check is None else len(check.runs),
        "vectors": sum(int(runs.repeats.sum()) for runs in (trials, check) if runs is not None),
        "undetermined": undetermined,
    }
    return job_rows(job, own, influence, mounted, before)
