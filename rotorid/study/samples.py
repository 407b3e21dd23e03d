"""The samples of a study: drawn by any executor, kept in one Parquet file.

Sample k draws from `default_rng([seed, k])`, and the file is written from all of them in their order, so that
neither the executor nor a break changes a byte. It is written after each part, also by a run
that breaks; what is missing is drawn by the next.
"""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.logs import progress
from rotorid.files.disk import write_files
from rotorid.fleet.jobs import arrow, parquet, read_parquet

if TYPE_CHECKING:
    import pyarrow as pa

CHUNK, PARTS = 250, 50
"""Samples that a worker draws before it gives them back, some seconds of work; but at most so many parts."""
Row = dict[str, Any]
Sample = Callable[[np.random.Generator], Row]


def draw(sample: Sample, seed: int, numbers: list[int]) -> list[Row]:
    """Rows of samples by their numbers."""
    rows = []
    for k in numbers:
        try:
            rows.append({"sample": k, **sample(np.random.default_rng([seed, k]))})
        except Exception as error:
            raise ValueError(f"sample {k} (seed {seed}): {type(error).__name__}: {error}") from error
    return rows


def draw_all(
    sample: Sample,
    seed: int,
    samples: int,
    schema: pa.Schema,
    pool: Executor,
    results: Path | str | None = None,
) -> pa.Table:
    """All samples, of which those are drawn that the file does not have.

    Parameters
    ----------
    sample
        Draws a row, which may lack columns of the schema; every worker gets it.
    seed, samples
        Of what, and how many.
    schema
        Of the table, with `sample` first; its metadata say which study it is.
    pool
        Who draws.
    results
        The Parquet file that keeps them; None: nothing does.

    Raises
    ------
    ValueError
        For a file of another study or of one that is running, a sample that fails, and workers that die.
    """

    def kept() -> pa.Table:
        """The rows so far, which the file has then."""
        table = pa.Table.from_pylist([rows[k] for k in sorted(rows)], schema)
        if file:
            write_files({file: parquet(table)})
        return table

    pa, file = arrow("a study"), Path(results) if results else None
    with _alone(file) if file else nullcontext():
        rows = _read(file, schema) if file and file.exists() else {}
        missing, size = [k for k in range(samples) if k not in rows], max(CHUNK, samples // PARTS)
        chunks = [missing[k : k + size] for k in range(0, len(missing), size)]
        try:
            with _single_threads():
                for drawn in pool.map(partial(draw, sample, seed), chunks):
                    rows |= {row["sample"]: row for row in drawn}
                    progress.info("%d of %d samples", len(rows), samples)
                    kept()
        except (ValueError, OSError):  # of a sample, or of the file
            raise
        except Exception as error:  # of the executor
            words = "a worker died, perhaps for want of memory; the same command goes on with --results"
            raise ValueError(f"{words} ({type(error).__name__}: {error})") from error
        finally:
            table = kept()
        return table.slice(0, samples)


@contextmanager
def _alone(file: Path) -> Iterator[None]:
    """Refuse a second study on a file by a lock of SQLite, which ends with its process on every system."""
    lock = file.with_name(f"{file.name}.lock")
    try:
        held = sqlite3.connect(lock, timeout=0)
        held.execute("BEGIN EXCLUSIVE")
    except sqlite3.OperationalError as error:
        why = f"cannot be written ({error})"
        if "locked" in str(error):
            why = "a study is running on this file: wait for its end"
        raise ValueError(f"{file}: {why}, or name another") from error
    try:
        yield
    finally:
        held.close()
        lock.unlink(missing_ok=True)


def _read(file: Path, schema: pa.Schema) -> dict[int, Row]:
    """The samples of a file, by their numbers."""
    table = read_parquet(file, "the samples of a study: name another file")
    if not table.schema.equals(schema, check_metadata=True):
        raise ValueError(
            f"{file}: another study is kept here (its file, its rotor, the seed or the version of rotorid "
            "differs): name another file"
        )
    return {row["sample"]: row for row in table.to_pylist()}


@contextmanager
def _single_threads() -> Iterator[None]:
    """One thread of linear algebra in processes that start now: more change digits, and are slower."""
    before = dict(os.environ)
    os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1", MKL_NUM_THREADS="1")
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)
