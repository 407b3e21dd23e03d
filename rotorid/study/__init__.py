"""Studies: what becomes of many drawn machines, on any executor."""

from __future__ import annotations

import json
from collections.abc import Mapping
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import ClassVar

from rotorid.base.tables import Column, Table
from rotorid.base.text import counted
from rotorid.report.options import file_of
from rotorid.report.outcome import Outcome, command, provenance

__all__ = ["StudyOptions", "study"]


@dataclass(frozen=True)
class StudyOptions:
    """Options of `study`.

    Attributes
    ----------
    samples : N from 1
        How many, in place of what the file says; a finished study is continued with more.
    workers : N from 1
        Processes on this machine.
    scheduler : ADDRESS
        Of a Dask cluster whose workers draw the samples, such as tcp://10.0.0.5:8786.
    results : FILE
        For the samples, .parquet; a study that was broken off there is continued.
    """

    samples: int | None = None
    workers: int = 1
    scheduler: str | None = None
    results: Path | str | None = None
    panels: ClassVar[Mapping[str, str]] = {"Work": "workers scheduler results"}
    to = ("output", "table", "json")


@command
def study(file: Path | str, options: StudyOptions | None = None, executor: Executor | None = None) -> Outcome:
    """Chance that a machine meets its limit, as built and balanced, by simulation.

    A study that was broken off is continued by the same command with --results; the samples do not
    depend on the workers.

    Example: rotorid study sample_data/study/study.toml --samples 50

    Parameters
    ----------
    file : STUDY
        Study file (.toml).
    options
        How many samples, who draws them, where they are kept.
    executor
        Any of `concurrent.futures`, in place of own processes.

    Raises
    ------
    ValueError
        For files that cannot be, a result file of another study or of one that is running, a sample that
        fails, and workers that die.
    """
    from scipy.stats import binomtest

    from rotorid.files.disk import sha256
    from rotorid.fleet.jobs import arrow
    from rotorid.study.samples import draw_all
    from rotorid.study.study_file import draw_machine, influence_of, read_study

    options = options or StudyOptions()
    read = read_study(file_of(file, "a study file"))
    n = options.samples or read.samples
    model, made = influence_of(read, read.rotor), provenance(read.files, options)
    if model.windows:
        raise ValueError("the rotor itself is unstable at the speeds of the study: it has no steady response")
    identity = {"version": made["version"], "seed": read.seed, "inputs": [*map(sha256, read.files)]}
    columns = {"sample": "int64"} | {f"ratio_{k}": "double" for k in range(read.corrections + 1)}
    columns |= {"runs_needed": "int32", "held": "bool", "warned": "bool", "why": "string"}
    schema = arrow("a study").schema([*columns.items()], {"study": json.dumps(identity)})
    with _workers(options, executor) as pool:
        sample = partial(draw_machine, read, model.W)
        frame = draw_all(sample, read.seed, n, schema, pool, options.results).to_pandas()
    runs = [1, *range(len(read.planes) + 2, len(read.planes) + 2 + read.corrections)]
    met = [int((frame["runs_needed"] <= count).sum()) for count in runs]
    intervals = [binomtest(count, n).proportion_ci() for count in met]  # exact (Clopper and Pearson)
    low, high = zip(*intervals, strict=True)
    shown = "{:.4f}".format
    table = Table(
        "corrections",
        (
            Column("corrections", range(len(runs))),
            Column("runs", runs),
            Column("met", met),
            Column("probability", [count / n for count in met], shown),
            Column("low", low, shown),
            Column("high", high, shown),
        ),
    )
    head = f"The limit is met by {100 * met[0] / n:.4g} % as built"
    if read.corrections:
        head += f" and {100 * met[-1] / n:.4g} % after at most {counted(read.corrections, 'correction')}"
    reasons = frame["why"].value_counts().to_dict()
    notes = [f"{count} of {n} were not balanced: {why}" for why, count in reasons.items()]
    coverage = {}
    for name, warned in (("silent", False), ("warned", True)):
        held = frame["held"][frame["warned"] == warned]
        good, count = int((held == 1).sum()), len(held)  # unknown where there is no region
        coverage[name] = {"held": good, "corrections": count}
        if count:
            words = f"first corrections with {'a' if warned else 'no'} warning: {good} of {count}"
            notes.append(f"{words} of the 95 % regions hold the true one")
    return Outcome(
        result=frame,
        sentences=(f"{head}, of {counted(n, 'drawn machine')}.",),
        tables=(table,),
        file=table,
        keys={
            "kind": "balance",
            "samples": n,
            "seed": read.seed,
            "warnings": list(model.warnings),
            "probability": met[-1] / n,
            "interval": [low[-1], high[-1]],
            "rows": table.records,
            "coverage": coverage,
            "not_balanced": reasons,
        },
        warnings=tuple(model.warnings),
        notes=tuple(notes),
        title="Study of machines",
        provenance=made,
    )


def _workers(options: StudyOptions, executor: Executor | None) -> AbstractContextManager[Executor]:
    """Who draws: a Dask cluster, an executor that is given, or own processes."""
    from rotorid.base.worker_processes import worker_pool

    if not options.scheduler:
        return nullcontext(executor) if executor else worker_pool(options.workers)
    try:
        from distributed import Client

        return Client(options.scheduler, timeout=10).get_executor()  # type: ignore[no-untyped-call, no-any-return]
    except ImportError as error:
        raise ValueError("--scheduler needs Dask: pip install dask[distributed]") from error
    except (OSError, ValueError) as error:
        words = f"--scheduler {options.scheduler}: no cluster answers there ({error})"
        raise ValueError(words) from error
