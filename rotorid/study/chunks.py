"""The engine of studies: samples by number, in chunks on any executor, a Parquet file a chunk.

Sample k draws from `default_rng([seed, k])`, so that neither the executor nor a break changes a byte. What a
sample raises is told with its number; any other failure of a future is the executor's: a worker that died.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import closing
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rotorid.base.logs import progress
from rotorid.base.versions import SCHEMA_VERSION
from rotorid.base.worker_processes import single_threads, worker_pool

if TYPE_CHECKING:
    import pandas as pd

ATTEMPTS = 3
AHEAD, AHEAD_ELSEWHERE = 4, 256
"""Chunks at an executor, for each worker or at a given one; so much and no more is in memory."""
Row = dict[str, Any]


class SampleError(ValueError):
    """What a sample raised, with its number."""


@dataclass(frozen=True)
class Task:
    """What every worker gets: `sample(data, default_rng([seed, k]))` is the row of sample k."""

    sample: Callable[[Any, np.random.Generator], Row]
    data: Any
    seed: int
    columns: Mapping[str, str]
    """Types of Arrow by the names of the row, without the sample's number; a row may lack some."""
    chunk: int
    """Samples in a file."""


class Chunk(NamedTuple):
    """First sample, the one after the last, and their file."""

    first: int
    last: int
    file: Path


Done = tuple[Chunk, list[Row]]
"""A chunk with its rows."""


def chunks(task: Task, samples: int, folder: Path) -> Iterator[Chunk]:
    """All of a study."""
    for number, first in enumerate(range(0, samples, task.chunk)):
        yield Chunk(first, min(first + task.chunk, samples), folder / f"part-{number:06d}.parquet")


def run_chunk(task: Task, first: int, last: int) -> list[Row]:
    """The rows of samples, numbered from 0."""
    rows = []
    for k in range(first, last):
        try:
            rows.append({"sample": k, **task.sample(task.data, np.random.default_rng([task.seed, k]))})
        except Exception as error:
            raise SampleError(f"sample {k} (seed {task.seed}): {type(error).__name__}: {error}") from error
    return rows


def run_study(task: Task, samples: int, folder: Path, workers: int, executor: Executor | None) -> None:
    """Write the parts that are missing in the folder; refuse samples on which workers die again and again."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    schema = pa.schema([("sample", "int64"), *task.columns.items()], {"schema_version": str(SCHEMA_VERSION)})
    begun, seen, done = time.perf_counter(), 0, 0

    def missing() -> Iterator[Chunk]:
        nonlocal seen
        for chunk in chunks(task, samples, folder):
            if rows_in(chunk.file) < chunk.last - chunk.first:
                yield chunk
            else:
                seen += chunk.last - chunk.first

    with single_threads(), closing(_Workers(task, workers, executor).finished(missing())) as finished:
        for (*_, file), rows in finished:
            with file.with_suffix(".tmp").open("wb") as new:  # by name, a colon would make it an address
                pq.write_table(pa.Table.from_pylist(rows, schema), new, write_page_checksum=True)
            file.with_suffix(".tmp").replace(file)
            done, seen = done + len(rows), seen + len(rows)
            left = (time.perf_counter() - begun) * (samples - seen) / done
            progress.info("%d of %d samples, about %.0f s left", seen, samples, left)


def rows_in(file: Path) -> int:
    """How many samples a part has; 0 where there is none, or none that can be read."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        with file.open("rb") as there:
            return int(pq.read_table(there, page_checksum_verification=True).num_rows)
    except (OSError, pa.ArrowException):
        return 0


def read_parts(task: Task, samples: int, folder: Path) -> Iterator[pd.DataFrame]:
    """The rows of one part after the other."""
    import pyarrow.parquet as pq

    for first, last, part in chunks(task, samples, folder):
        with part.open("rb") as file:
            yield pq.read_table(file).slice(0, last - first).to_pandas()


class _Workers:
    """A given executor, or own processes, which are replaced where one has died."""

    def __init__(self, task: Task, workers: int, given: Executor | None) -> None:
        self.task, self.workers, self.given = task, workers, given
        self.pool = worker_pool(workers) if given is None else given

    def finished(self, chunks: Iterator[Chunk]) -> Generator[Done, None, None]:
        """Chunks with their rows as they are done, a bounded number of them under way."""
        try:
            width = AHEAD * self.workers if self.given is None else AHEAD_ELSEWHERE
            yield from self._finished(chunks, width)
        finally:
            if self.given is None:
                self.pool.shutdown(cancel_futures=True)

    def _finished(self, chunks: Iterator[Chunk], width: int, tries: int = 1) -> Iterator[Done]:
        """A death ends all that is under way in a pool: each runs again alone; the guilty one is found."""
        running: dict[Future[list[Row]], Chunk] = {}
        try:
            while True:
                for chunk in islice(chunks, width - len(running)):
                    running[self._submit(chunk)] = chunk
                if not running:
                    return
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    chunk = running.pop(future)
                    rows = _rows(future, chunk, tries)
                    if rows is None:
                        yield from self._finished(iter([chunk]), 1, tries + 1)
                    else:
                        yield chunk, rows
        finally:
            for future in running:
                future.cancel()

    def _submit(self, chunk: Chunk) -> Future[list[Row]]:
        try:
            return self.pool.submit(run_chunk, self.task, chunk.first, chunk.last)
        except BrokenExecutor as error:
            if self.given is not None:
                raise ValueError(f"the executor takes no more work: {error}") from error
        self.pool.shutdown()
        self.pool = worker_pool(self.workers)
        return self._submit(chunk)


def _rows(future: Future[list[Row]], chunk: Chunk, tries: int) -> list[Row] | None:
    """Rows of a chunk, None where its worker died; what a sample raised is raised."""
    try:
        return future.result()
    except SampleError:
        raise
    except Exception as error:
        if tries < ATTEMPTS:
            return None
        raise ValueError(
            f"a worker died {tries} times on the samples {chunk.first} to {chunk.last - 1}: "
            f"{type(error).__name__}; the memory may be too small for so many workers"
        ) from error
