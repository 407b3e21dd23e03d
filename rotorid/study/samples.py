"""The samples of a study: drawn by any executor, kept in one Parquet file.

Sample k draws from `default_rng([seed, k])`, and the file is written from all of them in their order, so that
neither the executor nor a break changes a byte. It is written now and then, and at the end of every run, also
of one that breaks; what is missing is drawn by the next.

A machine is drawn, read as built, and balanced until its readings meet the limit. The first runs are the bare
rotor and a trial in each plane; each check run joins them in the next fit, as in `balancing.refine`.
"""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing import Trials, UndeterminedError, correct, estimate_influence
from fem import InfluenceCoefficients, Rotor, influence
from fem.parameters import with_parameters
from rotorid.base.arrays import ComplexArray
from rotorid.base.logs import progress
from rotorid.base.worker_processes import single_threads
from rotorid.files.disk import write_files
from rotorid.fleet.jobs import arrow, parquet, read_parquet
from rotorid.study.study_file import Study

if TYPE_CHECKING:
    import pyarrow as pa

TRIAL = 0.5
"""By how much a trial moves one reading, by the rotor as its file has it: a share of the largest as built."""
UNDETERMINED = "the readings do not determine a correction"
UNSTABLE = "the drawn rotor is unstable, and has no steady response"
CHUNK = 250
"""Samples that a worker draws before it gives them back: some seconds of work."""
KEPT = 10.0
"""Seconds of work that are lost at most where nobody can write any more, as in a power failure."""
Row = dict[str, Any]
Sample = Callable[[np.random.Generator], Row]


class SampleError(ValueError):
    """What a sample raised, with its number."""


def draw(sample: Sample, seed: int, numbers: list[int]) -> list[Row]:
    """Rows of samples by their numbers."""
    rows = []
    for k in numbers:
        try:
            rows.append({"sample": k, **sample(np.random.default_rng([seed, k]))})
        except Exception as error:
            raise SampleError(f"sample {k} (seed {seed}): {type(error).__name__}: {error}") from error
    return rows


def draw_all(
    sample: Sample, seed: int, samples: int, schema: pa.Schema, pool: Executor, file: Path | None = None
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
    file
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

    pa = arrow("a study")
    with _alone(file) if file else nullcontext():
        rows = _read(file, schema) if file and file.exists() else {}
        missing, due = [k for k in range(samples) if k not in rows], time.monotonic() + KEPT
        chunks = [missing[k : k + CHUNK] for k in range(0, len(missing), CHUNK)]
        try:
            with single_threads():
                for drawn in pool.map(partial(draw, sample, seed), chunks):
                    rows |= {row["sample"]: row for row in drawn}
                    progress.info("%d of %d samples", len(rows), samples)
                    if time.monotonic() > due:
                        kept()
                        due = time.monotonic() + KEPT
        except (SampleError, OSError):
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
        locked = "locked" in str(error)
        why = (
            "a study is running on this file: wait for its end" if locked else f"cannot be written ({error})"
        )
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


def nominal(study: Study) -> InfluenceCoefficients:
    """Coefficients (S, C, P + U) of the rotor as its file has it; refuses an unstable one."""
    model = _influence(study, study.rotor)
    if model.windows:
        raise ValueError("the rotor itself is unstable at the speeds of the study: it has no steady response")
    if not model.W[..., : len(study.planes)].any(axis=(0, 1)).all():
        raise ValueError("no sensor sees one of the planes: there is no trial unbalance for it")
    return model


def _influence(study: Study, rotor: Rotor) -> InfluenceCoefficients:
    """Of unbalance in the planes and at the drawn nodes, in shares of the limits."""
    places = [*study.planes.values(), *study.nodes]
    model = influence(rotor, places, list(study.sensors.values()), study.speeds)
    return replace(model, W=model.W * study.gains[..., None])


def draw_machine(study: Study, W: ComplexArray, rng: np.random.Generator) -> Row:
    """Largest readings over the limit, as built and after each correction; `runs_needed` to meet it.

    `W` is that of `nominal`. `held`: the 95 % region of the first weights holds the true ones, those of the
    same weighing of readings without errors; `warned`: this correction had a warning.
    """
    P, stated = len(study.planes), (study.errors, study.run_errors)
    trial = TRIAL / np.abs(W[..., :P]).max(axis=(0, 1))
    normal = rng.standard_normal(len(study.scatter))
    unbalance = study.unbalance * _normal(rng, len(study.nodes))
    if study.scatter:
        each = zip(normal, study.scatter.items(), strict=True)
        values = {path: value * float(np.exp(spread * x)) for x, (path, (value, spread)) in each}
        model = _influence(study, with_parameters(study.rotor, values))
        if model.windows:
            return {"why": UNSTABLE}
        W = model.W
    W, bare = W[..., :P], W[..., P:] @ unbalance
    row, mounted, readings = Row(), [np.zeros(P, complex)], list[ComplexArray]()
    for k in range(study.corrections + 1):
        readings.append(_read_sensors(study, bare + W @ mounted[-1], rng))
        row[f"ratio_{k}"] = ratio = float(np.abs(readings[-1]).max())
        if ratio <= 1:
            return row | {"runs_needed": len(readings)}
        if k == study.corrections:
            break
        if k == 0:
            mounted += [*np.diag(ratio * trial)]
            readings += [_read_sensors(study, bare + W @ weights, rng) for weights in mounted[1:]]
        runs, names = tuple(map(str, range(len(readings)))), (tuple(study.sensors), tuple(study.planes))
        trials = Trials(runs, study.speeds, *names, np.array(readings), np.array(mounted))
        try:
            estimate = estimate_influence(replace(trials, errors=study.errors, run_errors=study.run_errors))
            correction = correct(estimate)
            if k == 0 and any(stated):
                true = correct(replace(estimate, W=W, baseline=bare)).weights
                held = bool(correction.region().holds(true)) if correction.region_known else None
                row |= {"held": held, "warned": bool(correction.warnings)}
        except UndeterminedError:
            return row | {"why": UNDETERMINED}
        mounted.append(correction.weights)
    return row


def _read_sensors(study: Study, Y: ComplexArray, rng: np.random.Generator) -> ComplexArray:
    """What the sensors of a run say of (S, C), with the errors of the run and of the readings."""
    if study.run_errors:
        common, single = _normal(rng), _normal(rng, *Y.shape)
        Y = Y * (1 + study.run_errors.relative * (common + single) / np.sqrt(2))
    if study.errors:
        a, b = rng.standard_normal((2, *Y.shape))
        Y = Y * (1 + study.errors.amplitude * a) * np.exp(1j * study.errors.phase * b)
        Y = Y + study.errors.floor * _normal(rng, *Y.shape)
    return Y


def _normal(rng: np.random.Generator, *shape: int) -> ComplexArray:
    """Complex, of variance 1 in each direction."""
    return np.asarray(rng.standard_normal(shape) + 1j * rng.standard_normal(shape))
