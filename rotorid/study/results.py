"""The samples of a study: drawn by any executor, kept in one Parquet file.

Sample k draws from `default_rng([seed, k])`, and the file is written from all of them in their order, so that
neither the executor nor a break changes a byte. Until then they are in a journal beside the file, an SQLite
database that only one process can hold: the lock of the file, and what is left of a study that broke off.
"""

from __future__ import annotations

import io
import json
import sqlite3
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from contextlib import ExitStack, closing, contextmanager, nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.logs import progress
from rotorid.base.worker_processes import single_threads, worker_pool
from rotorid.files.disk import write_files

if TYPE_CHECKING:
    import pandas as pd

CHUNK = 250
"""Samples that a worker draws before it gives them back: some seconds of work."""
Row = dict[str, Any]


class SampleError(ValueError):
    """What a sample raised, with its number."""


@dataclass(frozen=True)
class Task:
    """What every worker gets: `sample(data, default_rng([seed, k]))` is the row of sample k.

    `columns` are types of Arrow by the names of the row, which may lack some;
    `identity` says which study it is.
    """

    sample: Callable[[Any, np.random.Generator], Row]
    data: Any
    seed: int
    columns: Mapping[str, str]
    identity: str


def draw(task: Task, numbers: range | list[int]) -> list[tuple[int, str]]:
    """Samples by their numbers, with their rows as JSON."""
    rows = []
    for k in numbers:
        try:
            rows.append((k, json.dumps(task.sample(task.data, np.random.default_rng([task.seed, k])))))
        except Exception as error:
            raise SampleError(f"sample {k} (seed {task.seed}): {type(error).__name__}: {error}") from error
    return rows


def run(task: Task, samples: int, file: Path | None, executor: Executor | None, workers: int) -> pd.DataFrame:
    """All samples, of which those are drawn that the file, or what is left of a broken study, does not have.

    Parameters
    ----------
    task, samples
        Which, and how many.
    file
        The Parquet file that keeps them; None: nothing does.
    executor, workers
        Who draws; None: so many own processes.

    Raises
    ------
    ValueError
        For a file of another study or of one that is running, a sample that fails, and workers that die.
    """
    pool = nullcontext(executor) if executor else worker_pool(workers)
    with _journal(task, file) as journal:
        there = {number for (number,) in journal.execute("SELECT sample FROM samples")}
        missing = [k for k in range(samples) if k not in there]
        chunks = [missing[k : k + CHUNK] for k in range(0, len(missing), CHUNK)]
        try:
            if chunks:
                with single_threads(), pool as who:
                    for rows in who.map(partial(draw, task), chunks):
                        with journal:
                            journal.executemany("INSERT INTO samples VALUES (?, ?)", rows)
                        there.update(number for number, _ in rows)
                        progress.info("%d of %d samples", len(there), samples)
        except (SampleError, sqlite3.Error):
            raise
        except Exception as error:  # of the executor
            words = "a worker died, perhaps for want of memory; the same command goes on with --results"
            raise ValueError(f"{words} ({type(error).__name__}: {error})") from error
        kept = journal.execute("SELECT sample, row FROM samples ORDER BY sample").fetchall()
        table = _table(task, [{"sample": number, **json.loads(row)} for number, row in kept])
        if file is not None:  # also when nothing was missing: a study may break just before this
            write_files({file: _parquet(table)})
    if file is not None:
        _beside(file).unlink(missing_ok=True)
    frame: pd.DataFrame = table.slice(0, samples).to_pandas()
    return frame


@contextmanager
def _journal(task: Task, file: Path | None) -> Iterator[sqlite3.Connection]:
    """Samples so far by number, which nobody else can read or write meanwhile."""
    name = ":memory:" if file is None else str(_beside(file))
    ended = _read(task, file) if file is not None and file.exists() else []
    with ExitStack() as stack:
        try:
            journal = stack.enter_context(closing(sqlite3.connect(name, timeout=0)))
            journal.execute("PRAGMA locking_mode = EXCLUSIVE")
            with journal:
                journal.execute("CREATE TABLE IF NOT EXISTS samples (sample INTEGER PRIMARY KEY, row TEXT)")
                journal.execute("CREATE TABLE IF NOT EXISTS study (identity TEXT PRIMARY KEY)")
                journal.execute("INSERT OR IGNORE INTO study VALUES (?)", [task.identity])
                if journal.execute("SELECT count(*) FROM study").fetchone() != (1,):
                    raise _another(file)
                journal.executemany("INSERT OR IGNORE INTO samples VALUES (?, ?)", ended)
        except sqlite3.OperationalError as error:
            why = f"cannot be written ({error})"
            if "locked" in str(error):
                why = "a study is running on this file: wait for its end"
            raise ValueError(f"{file}: {why}, or name another") from error
        except sqlite3.DatabaseError as error:
            raise ValueError(f"{name}: this is no study that broke off; remove it") from error
        yield journal


def _beside(file: Path) -> Path:
    return file.with_name(f"{file.name}.part")


def _another(file: Path | None) -> ValueError:
    return ValueError(
        f"{file}: another study is kept here (its file, its rotor, the seed or the version of rotorid "
        "differs): name another file"
    )


def _read(task: Task, file: Path) -> list[tuple[int, str]]:
    """Samples of a study that has ended."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(io.BytesIO(file.read_bytes()), page_checksum_verification=True)
    except (OSError, pa.ArrowException) as error:
        raise ValueError(f"{file}: no study is kept here, but something else: name another file") from error
    if (table.schema.metadata or {}).get(b"study") != task.identity.encode():
        raise _another(file)
    return [(row.pop("sample"), json.dumps(row)) for row in table.to_pylist()]


def _table(task: Task, rows: list[Row]) -> Any:  # noqa: ANN401 - of pyarrow
    import pyarrow as pa

    return pa.Table.from_pylist(
        rows, pa.schema([("sample", "int64"), *task.columns.items()], {"study": task.identity})
    )


def _parquet(table: Any) -> bytes:  # noqa: ANN401 - of pyarrow
    import pyarrow.parquet as pq

    buffer = io.BytesIO()
    pq.write_table(table, buffer, write_page_checksum=True)
    return buffer.getvalue()
