"""Samples on any executor, in one file: the same bytes, breaks, dead workers, two studies on one file."""

import logging
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from unittest.mock import Mock

import numpy as np
import pytest
from studies.drawn import SCATTER, STUDY, fatal, noted, task, write

import rotorid.study.results as results
from rotorid.base.worker_processes import single_threads
from rotorid.study import StudyOptions, study
from rotorid.study.results import SampleError, run

pq = pytest.importorskip("pyarrow.parquet", reason="without the extra rotorid[fleet]")

NUMBERS = [float(np.random.default_rng([7, k]).standard_normal()) for k in range(12)]


@pytest.fixture
def threads(monkeypatch):
    monkeypatch.setattr(results, "CHUNK", 2)
    with ThreadPoolExecutor(2) as pool:
        yield pool


@pytest.mark.full
def test_one_worker_two_threads_and_dask_write_the_same_bytes(tmp_path, threads):
    distributed = pytest.importorskip("distributed", reason="without the extra rotorid[cluster]")
    file = write(tmp_path, STUDY.replace("samples", "corrections = 2\nsamples") + SCATTER)
    ways = {f"own{n}": StudyOptions(workers=n, results=tmp_path / f"own{n}.parquet") for n in (1, 2)}
    found = [study(file, options) for options in ways.values()]
    found.append(study(file, StudyOptions(results=tmp_path / "threads.parquet"), executor=threads))
    options = {"n_workers": 2, "threads_per_worker": 1, "processes": True, "dashboard_address": None}
    with distributed.LocalCluster(**options) as cluster:
        address = cluster.scheduler_address
        found.append(study(file, StudyOptions(scheduler=address, results=tmp_path / "dask.parquet")))
    one, *others = (p.read_bytes() for p in sorted(tmp_path.glob("*.parquet")))
    assert others == [one] * 3
    assert len({str(each.to_dict()) for each in found}) == 1
    assert len(set(pq.read_table(tmp_path / "own1.parquet")["ratio_0"].to_pylist())) == 60
    assert not list(tmp_path.glob("*.part"))


@pytest.mark.full
@pytest.mark.skipif(os.name == "nt", reason="signals")
def test_a_study_that_is_killed_and_continued_is_an_unbroken_one(tmp_path, threads):
    """The workers end with their parent; only what is missing is drawn again."""
    file = write(tmp_path, STUDY.replace("= 60", "= 400") + '[scatter]\n"bearing[*].stiffness" = 20')
    small = "import rotorid.study.results as r, rotorid.cli; r.CHUNK = 20; rotorid.cli.main()"
    words = ["study", file, "--workers", "2", "--results", tmp_path / "killed.parquet"]
    part = tmp_path / "killed.parquet.part"
    started = subprocess.Popen([sys.executable, "-c", small, *words], stderr=subprocess.DEVNULL)
    while not part.exists() or part.stat().st_size < 20_000:
        time.sleep(0.01)
        assert started.poll() is None
    workers = subprocess.run(["pgrep", "-P", str(started.pid)], capture_output=True, text=True).stdout.split()
    started.kill()
    started.wait()
    for _ in range(100):
        if not [pid for pid in workers if os.path.exists(f"/proc/{pid}")]:
            break
        time.sleep(0.05)
    assert [pid for pid in workers if os.path.exists(f"/proc/{pid}")] == []
    assert part.exists()
    continued = study(file, StudyOptions(results=tmp_path / "killed.parquet"), executor=threads)
    unbroken = study(file, StudyOptions(results=tmp_path / "unbroken.parquet"), executor=threads)
    assert (tmp_path / "killed.parquet").read_bytes() == (tmp_path / "unbroken.parquet").read_bytes()
    assert continued.to_dict() == unbroken.to_dict()
    assert not part.exists()


def test_what_is_missing_after_a_break_is_drawn_and_nothing_else(tmp_path, threads):
    calls = tmp_path / "calls"
    data = {"calls": str(calls), "wrong": NUMBERS[7]}
    with pytest.raises(SampleError, match=r"^sample 7 \(seed 7\): ZeroDivisionError: no such bearing$"):
        run(task(noted, data), 12, tmp_path / "a.parquet", threads, 1)
    before = len(calls.read_text().split())
    frame = run(task(noted, {**data, "wrong": None}), 12, tmp_path / "a.parquet", threads, 1)
    assert frame["x"].tolist() == NUMBERS
    assert len(calls.read_text().split()) == before + 6
    run(task(noted, {**data, "wrong": None}), 12, tmp_path / "a.parquet", threads, 1)
    assert len(calls.read_text().split()) == before + 6


def test_a_worker_that_dies_is_told_and_the_next_call_goes_on(tmp_path, monkeypatch):
    monkeypatch.setattr(results, "CHUNK", 2)
    data = {"flag": str(tmp_path / "died"), "deadly": NUMBERS[9], "always": False}
    with pytest.raises(ValueError, match=r"a worker died, perhaps for want of memory; .*BrokenProcessPool"):
        run(task(fatal, data), 12, tmp_path / "a.parquet", None, 1)
    assert run(task(fatal, data), 12, tmp_path / "a.parquet", None, 1)["x"].tolist() == NUMBERS


def test_more_samples_continue_a_study(tmp_path, threads):
    file = write(tmp_path)
    for samples in (50, 90):
        grown = study(file, StudyOptions(samples=samples, results=tmp_path / "grown.parquet"), threads)
    at_once = study(file, StudyOptions(samples=90, results=tmp_path / "at_once.parquet"), threads)
    assert (tmp_path / "grown.parquet").read_bytes() == (tmp_path / "at_once.parquet").read_bytes()
    assert grown.to_dict() == at_once.to_dict()
    fewer = study(file, StudyOptions(samples=50, results=tmp_path / "grown.parquet"), threads)
    assert fewer.to_dict() == study(file, StudyOptions(samples=50), threads).to_dict()


def test_a_study_that_breaks_before_its_file_is_written_loses_nothing(tmp_path, threads, monkeypatch):
    file = tmp_path / "x.parquet"
    monkeypatch.setattr(results, "write_files", Mock(side_effect=OSError("disk full")))
    with pytest.raises(OSError, match="full"):
        run(task(), 12, file, threads, 1)
    monkeypatch.undo()
    assert not file.exists()
    run(task(), 12, file, threads, 1)
    assert len(pq.read_table(file)) == 12
    assert not list(tmp_path.glob("*.part"))


def test_a_file_of_another_study_is_refused_as_it_is(tmp_path, threads):
    file, kept = write(tmp_path), tmp_path / "kept.parquet"
    study(file, StudyOptions(results=kept), executor=threads)
    before = kept.read_bytes()
    with pytest.raises(ValueError, match="another study is kept here"):
        study(file, StudyOptions(seed=2, results=kept), executor=threads)
    (tmp_path / "rotor.csv").write_text((tmp_path / "rotor.csv").read_text().replace("0.04", "0.05"))
    with pytest.raises(ValueError, match="another study is kept here"):
        study(file, StudyOptions(results=kept), executor=threads)
    assert kept.read_bytes() == before
    kept.write_bytes(before[:-100])
    with pytest.raises(ValueError, match="no study is kept here, but something else"):
        study(file, StudyOptions(results=kept), executor=threads)
    with pytest.raises(ValueError, match=r"must end in \.parquet"):
        study(file, StudyOptions(results=tmp_path), executor=threads)
    with pytest.raises(ValueError, match="cannot be written"):
        study(file, StudyOptions(results=tmp_path / "none" / "a.parquet"), executor=threads)
    assert not list(tmp_path.glob("*.part"))


def test_a_second_study_on_the_same_file_is_refused_while_the_first_runs(tmp_path, threads):
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


def test_progress_is_told(threads, caplog):
    with caplog.at_level(logging.INFO, "rotorid.progress"):
        run(task(), 6, None, threads, 1)
    assert [record.getMessage() for record in caplog.records] == [f"{n} of 6 samples" for n in (2, 4, 6)]


def test_the_environment_is_restored(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "5")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    before = dict(os.environ)
    with single_threads():
        assert os.environ["OMP_NUM_THREADS"] == os.environ["MKL_NUM_THREADS"] == "1"
    assert dict(os.environ) == before
