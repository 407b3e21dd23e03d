"""The engine of studies: samples by number, in chunks on any executor, a Parquet file a chunk.

Sample k draws from `default_rng([seed, k])`, so that neither the executor nor a break changes a byte. What a
sample raises is told with its number; any other failure of a future is the executor's: a worker that died.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rotorid.base.logs import progress
from rotorid.base.versions import SCHEMA_VERSION
from rotorid.base.worker_processes import single_threads, worker_pool

ATTEMPTS = 3
AHEAD, AHEAD_ELSEWHERE = 4, 256
"""Chunks at an executor, for each worker or at a given one; so much and no more is in memory."""
Row = dict[str, Any]
Chunk = tuple[int, int]
"""First sample, and the one after the last."""


class SampleError(ValueError):
    """What a sample raised, with its number."""


@dataclass(frozen=True)
class Task:
    """What every worker gets: a function of data and a random generator, at the top of a module.

    Attributes
    ----------
    sample, data, seed
        `sample(data, default_rng([seed, k]))` is the row of sample k.
    columns
        Types of Arrow by the names of the row, without the sample's number.
    chunk
        Samples in a file.
    """

    sample: Callable[[Any, np.random.Generator], Row]
    data: Any
    seed: int
    columns: Mapping[str, str]
    chunk: int


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
    """Write the parts that are missing in the folder.

    Raises
    ------
    SampleError
        Of the first sample that fails.
    ValueError
        For samples on which workers die again and again.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    schema = pa.schema([("sample", "int64"), *task.columns.items()], {"schema_version": str(SCHEMA_VERSION)})
    begun, seen, done = time.perf_counter(), 0, 0

    def missing() -> Iterator[Chunk]:
        nonlocal seen
        for first in range(0, samples, task.chunk):
            chunk = first, min(first + task.chunk, samples)
            if rows_in(part(folder, task, chunk)) < chunk[1] - first:
                yield chunk
            else:
                seen += chunk[1] - first

    with single_threads(), closing(_Underway(task, missing(), workers, executor)) as work:
        for chunk, rows in work.finished():
            file = part(folder, task, chunk)
            with file.with_suffix(".tmp").open("wb") as new:  # by name, a colon would make it an address
                pq.write_table(pa.Table.from_pylist(rows, schema), new)
            file.with_suffix(".tmp").replace(file)
            done, seen = done + len(rows), seen + len(rows)
            left = (time.perf_counter() - begun) * (samples - seen) / done
            progress.info("%d of %d samples, about %.0f s left", seen, samples, left)


def part(folder: Path, task: Task, chunk: Chunk) -> Path:
    """The file of a chunk."""
    return folder / f"part-{chunk[0] // task.chunk:06d}.parquet"


def rows_in(file: Path) -> int:
    """How many samples a part has; 0 where there is none, or none that can be read."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        with file.open("rb") as there:
            return int(pq.read_metadata(there).num_rows)
    except (OSError, pa.ArrowInvalid):
        return 0


@dataclass
class _Underway:
    """Chunks at an executor, a bounded number of them; those of workers that died are done again.

    After a death the chunks that were under way run one by one, so that the guilty one is found.
    """

    task: Task
    chunks: Iterator[Chunk]
    workers: int
    given: Executor | None

    def __post_init__(self) -> None:
        self.pool = self.given or worker_pool(self.workers)
        self.running: dict[Future[list[Row]], tuple[Chunk, int]] = {}
        self.waiting: list[tuple[Chunk, int]] = []

    def finished(self) -> Iterator[tuple[Chunk, list[Row]]]:
        """Chunks with their rows, as they are done."""
        while self._submit():
            lost = []
            for future in wait(self.running, return_when=FIRST_COMPLETED).done:
                chunk, tries = self.running.pop(future)
                error = future.exception()
                if error is None:
                    yield chunk, future.result()
                elif isinstance(error, SampleError):
                    raise error
                else:
                    lost.append((chunk, tries + 1, error))
            if any(isinstance(error, BrokenExecutor) for *_, error in lost) and self.given is None:
                lost += [(chunk, tries + 1, lost[0][2]) for chunk, tries in self.running.values()]
                self._renew()
            for one in lost:
                self._again(*one)

    def _submit(self) -> bool:
        """Hand over as much as there may be; whether anything is under way."""
        width = AHEAD * self.workers if self.given is None else AHEAD_ELSEWHERE
        if self.waiting or any(tries for _, tries in self.running.values()):
            width = 1
        while len(self.running) < width:
            if not self.waiting and (new := next(self.chunks, None)) is not None:
                self.waiting.append((new, 0))
            if not self.waiting:
                break
            try:
                future = self.pool.submit(run_chunk, self.task, *self.waiting[0][0])
            except BrokenExecutor as error:
                if self.given is not None:
                    raise ValueError(f"the executor takes no more work: {error}") from error
                if self.running:  # their futures tell it
                    break
                self._renew()
            else:
                self.running[future] = self.waiting.pop(0)
        return bool(self.running)

    def _again(self, chunk: Chunk, tries: int, error: BaseException) -> None:
        if tries >= ATTEMPTS:
            raise ValueError(
                f"a worker died {tries} times on the samples {chunk[0]} to {chunk[1] - 1}: "
                f"{type(error).__name__}; the memory may be too small for so many workers"
            )
        self.waiting.append((chunk, tries))

    def _renew(self) -> None:
        self.running.clear()
        self.pool.shutdown()
        self.pool = worker_pool(self.workers)

    def close(self) -> None:
        """Leave nothing at the executor."""
        for future in self.running:
            future.cancel()
        if self.given is None:
            self.pool.shutdown(cancel_futures=True)
