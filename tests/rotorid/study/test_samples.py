"""Samples on any executor, in one file: the same bytes, breaks, dead workers, two studies on one file."""

import logging
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np
import pytest
from studies.drawn import SCATTER, STUDY, fatal, noted, number, write

from rotorid.base.worker_processes import worker_pool
from rotorid.study import StudyOptions, samples, study
from rotorid.study.samples import draw_all

pa = pytest.importorskip("pyarrow", reason="without the extra rotorid[fleet]")
pq = pytest.importorskip("pyarrow.parquet")

NUMBERS = [float(np.random.default_rng([7, k]).standard_normal()) for k in range(12)]
SCHEMA = pa.schema([("sample", "int64"), ("x", "double")], {"study": "numbers"})


@pytest.fixture
def threads(monkeypatch):
    monkeypatch.setattr(samples, "CHUNK", 2)
    with ThreadPoolExecutor(2) as pool:
        yield pool


def drawn(sample, file, executor, count=12):
    return draw_all(sample, 7, count, SCHEMA, executor, file)["x"].to_pylist()


@pytest.mark.full
def test_one_worker_two_threads_and_dask_write_the_same_bytes(tmp_path, threads):
    distributed = pytest.importorskip("distributed", reason="without the extra rotorid[cluster]")
    file = write(tmp_path, STUDY.replace("samples", "corrections = 2\nsamples") + SCATTER)
    ways = {f"own{n}": StudyOptions(workers=n, results=tmp_path / f"own{n}.parquet") for n in (1, 2)}
    outcome = [study(file, options) for options in ways.values()]
    outcome.append(study(file, StudyOptions(results=tmp_path / "threads.parquet"), executor=threads))
    options = {"n_workers": 2, "threads_per_worker": 1, "processes": True, "dashboard_address": None}
    with distributed.LocalCluster(**options) as cluster:
        address = cluster.scheduler_address
        outcome.append(study(file, StudyOptions(scheduler=address, results=tmp_path / "dask.parquet")))
    one, *others = (p.read_bytes() for p in sorted(tmp_path.glob("*.parquet")))
    assert others == [one] * 3
    assert len({str(each.to_dict()) for each in outcome}) == 1
    assert len(set(pq.read_table(tmp_path / "own1.parquet")["ratio_0"].to_pylist())) == 60
    assert not list(tmp_path.glob("*.lock"))


@pytest.mark.full
@pytest.mark.skipif(os.name == "nt", reason="signals")
def test_a_study_that_is_killed_and_continued_is_an_unbroken_one(tmp_path, threads):
    file = write(tmp_path, STUDY.replace("= 60", "= 400") + '[scatter]\n"bearing[*].stiffness" = 20')
    small = (
        "import rotorid.study.samples as s, rotorid.cli; s.CHUNK = 20; "
        "__name__ == '__main__' and rotorid.cli.main()"
    )
    killed, unbroken = tmp_path / "killed.parquet", tmp_path / "unbroken.parquet"
    words = ["study", file, "--workers", "2", "--results", killed]
    started = subprocess.Popen([sys.executable, "-c", small, *words], stderr=subprocess.DEVNULL)
    while not killed.exists():
        time.sleep(0.01)
        assert started.poll() is None
    started.kill()
    started.wait()
    assert 0 < len(pq.read_table(killed)) < 400
    continued = study(file, StudyOptions(results=killed), executor=threads)
    assert continued.to_dict() == study(file, StudyOptions(results=unbroken), executor=threads).to_dict()
    assert killed.read_bytes() == unbroken.read_bytes()


def test_what_is_missing_after_a_break_is_drawn_and_nothing_else(tmp_path, threads):
    calls, file = tmp_path / "calls", tmp_path / "a.parquet"
    with pytest.raises(ValueError, match=r"^sample 7 \(seed 7\): ZeroDivisionError: no such bearing$"):
        drawn(partial(noted, {"calls": calls, "wrong": NUMBERS[7]}), file, threads)
    before = len(calls.read_text().split())
    for _ in range(2):
        assert drawn(partial(noted, {"calls": calls, "wrong": None}), file, threads) == NUMBERS
        assert len(calls.read_text().split()) == before + 6


def test_a_worker_that_dies_is_reported_and_the_next_call_goes_on(tmp_path, monkeypatch):
    monkeypatch.setattr(samples, "CHUNK", 2)
    sample = partial(fatal, {"flag": str(tmp_path / "died"), "deadly": NUMBERS[9]})
    died = pytest.raises(ValueError, match=r"a worker died, perhaps for want of memory; .*BrokenProcessPool")
    with worker_pool(1) as pool, died:
        drawn(sample, tmp_path / "a.parquet", pool)
    with worker_pool(1) as pool:
        assert drawn(sample, tmp_path / "a.parquet", pool) == NUMBERS


def test_more_samples_continue_a_study(tmp_path, threads):
    file, grown, at_once = write(tmp_path), tmp_path / "grown.parquet", tmp_path / "at_once.parquet"
    for count in (50, 90):
        outcome = study(file, StudyOptions(samples=count, results=grown), threads)
    assert outcome.to_dict() == study(file, StudyOptions(samples=90, results=at_once), threads).to_dict()
    assert grown.read_bytes() == at_once.read_bytes()
    fewer = study(file, StudyOptions(samples=50, results=grown), threads)
    assert (len(fewer.result), grown.read_bytes()) == (50, at_once.read_bytes())


def test_a_file_of_another_study_is_refused_as_it_is(tmp_path, threads):
    file, kept = write(tmp_path), tmp_path / "kept.parquet"

    def refused(words, results=kept):
        with pytest.raises(ValueError, match=words):
            study(file, StudyOptions(results=results), executor=threads)

    study(file, StudyOptions(results=kept), executor=threads)
    before = kept.read_bytes()
    (tmp_path / "rotor.csv").write_text((tmp_path / "rotor.csv").read_text().replace("0.04", "0.05"))
    refused("another study is kept here")
    assert kept.read_bytes() == before
    kept.write_bytes(before[:-100])
    refused("expected the samples of a study: name another file")
    refused("cannot be written", tmp_path / "none" / "a.parquet")
    assert not list(tmp_path.glob("*.lock"))


def test_a_second_study_on_the_same_file_is_refused_while_the_first_runs(tmp_path):
    file, kept = write(tmp_path), tmp_path / "kept.parquet"
    seconds = []

    class Second(ThreadPoolExecutor):
        def map(self, function, chunks):
            words = [sys.executable, "-m", "rotorid", "study", file, "--results", kept]
            seconds.append(subprocess.run(words, capture_output=True, text=True, timeout=120))
            return super().map(function, chunks)

    with Second(1) as pool:
        study(file, StudyOptions(results=kept), executor=pool)
    assert (seconds[0].returncode, seconds[0].stdout) == (2, "")
    assert seconds[0].stderr.startswith(f"rotorid: {kept}: a study is running on this file")
    assert len(pq.read_table(kept)) == 60


def test_progress_is_logged(threads, caplog):
    with caplog.at_level(logging.INFO, "rotorid.progress"):
        drawn(number, None, threads, 6)
    assert [record.getMessage() for record in caplog.records] == [f"{n} of 6 samples" for n in (2, 4, 6)]
