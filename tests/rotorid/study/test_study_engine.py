"""Chunks on any executor: the same bytes, dead workers, breaks, memory."""

import logging
import os
import struct
import subprocess
import sys
import time
import weakref
from concurrent.futures import Executor, Future, ThreadPoolExecutor

import numpy as np
import pytest
from studies.drawn import SCATTER, STUDY, fatal, kept, noted, task, write

import rotorid.study.chunks as chunks
from rotorid.base.worker_processes import single_threads
from rotorid.study import StudyOptions, study
from rotorid.study.chunks import AHEAD_ELSEWHERE, SampleError, rows_in, run_study

pq = pytest.importorskip("pyarrow.parquet", reason="without the extra rotorid[fleet]")

NUMBERS = [float(np.random.default_rng([7, k]).standard_normal()) for k in range(12)]

SMALL = "import sys, rotorid.cli; sys.modules['rotorid.study.studies'].MACHINES = 50; rotorid.cli.main()"
"""The command line with small parts."""


def numbers(folder):
    return [x for part in sorted(folder.glob("part-*")) for x in pq.read_table(part)["x"].to_pylist()]


@pytest.fixture
def threads():
    with ThreadPoolExecutor(2) as pool:
        yield pool


@pytest.mark.full
def test_one_worker_two_threads_and_dask_write_the_same_bytes(tmp_path, monkeypatch, threads):
    distributed = pytest.importorskip("distributed", reason="without the extra rotorid[cluster]")

    monkeypatch.setattr(sys.modules["rotorid.study.studies"], "MACHINES", 20)
    file = write(tmp_path, STUDY.replace("samples", "corrections = 2\nsamples") + SCATTER)
    found = [study(file, StudyOptions(workers=n, results=tmp_path / f"own{n}")) for n in (1, 2)]
    found.append(study(file, StudyOptions(results=tmp_path / "threads"), executor=threads))
    options = {"n_workers": 2, "threads_per_worker": 1, "processes": True, "dashboard_address": None}
    with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
        found.append(study(file, StudyOptions(results=tmp_path / "dask"), executor=client.get_executor()))
    one, *others = (kept(tmp_path / name) for name in ("own1", "own2", "threads", "dask"))
    assert list(one) == [f"part-{k:06d}.parquet" for k in range(3)]
    assert others == [one] * 3
    assert len({str(each.to_dict()) for each in found}) == 1
    ratios = np.concatenate([pq.read_table(p)["ratio_0"] for p in sorted((tmp_path / "own1").glob("part*"))])
    assert len(set(ratios)) == 60


@pytest.mark.full
@pytest.mark.skipif(os.name == "nt", reason="signals")
def test_a_study_that_is_killed_and_continued_is_an_unbroken_one(tmp_path, threads, monkeypatch):
    """The workers end with their parent."""
    file = write(tmp_path, STUDY.replace("= 60", "= 400") + '[scatter]\n"bearing[*].stiffness" = 20')
    monkeypatch.setattr(sys.modules["rotorid.study.studies"], "MACHINES", 50)
    words = [file, "--workers", "2", "--results", tmp_path / "killed"]
    started = subprocess.Popen([sys.executable, "-c", SMALL, "study", *words], stderr=subprocess.DEVNULL)
    while not kept(tmp_path / "killed"):
        time.sleep(0.02)
        assert started.poll() is None
    workers = subprocess.run(["pgrep", "-P", str(started.pid)], capture_output=True, text=True).stdout.split()
    assert len(workers) >= 2
    started.kill()
    started.wait()
    left = kept(tmp_path / "killed")
    assert len(left) < 8
    for _ in range(100):
        if not [pid for pid in workers if os.path.exists(f"/proc/{pid}")]:
            break
        time.sleep(0.05)
    assert [pid for pid in workers if os.path.exists(f"/proc/{pid}")] == []
    continued = study(file, StudyOptions(results=tmp_path / "killed"), executor=threads)
    unbroken = study(file, StudyOptions(results=tmp_path / "unbroken"), executor=threads)
    assert kept(tmp_path / "killed") == kept(tmp_path / "unbroken")
    assert continued.to_dict() == unbroken.to_dict()


def test_a_worker_that_dies_once_is_replaced_and_its_samples_repeated(tmp_path):
    data = {"flag": str(tmp_path / "died"), "deadly": NUMBERS[5], "always": False}
    run_study(task(fatal, data), 12, tmp_path, 2, None)
    assert (tmp_path / "died").exists()
    assert numbers(tmp_path) == NUMBERS


@pytest.mark.full
def test_samples_that_kill_every_worker_are_named(tmp_path):
    data = {"flag": str(tmp_path / "died"), "deadly": NUMBERS[5], "always": True}
    with pytest.raises(ValueError, match=r"a worker died 3 times on the samples 4 to 5: BrokenProcessPool"):
        run_study(task(fatal, data), 12, tmp_path, 2, None)


class Losing(Executor):
    """Runs what it is given at once; of some submissions the worker is lost, or they are cancelled."""

    def __init__(self, lost, cancelled=()):
        self.lost, self.cancelled, self.submitted = lost, cancelled, []

    def submit(self, function, *args):
        future = Future()
        self.submitted.append(args[1])
        if len(self.submitted) in self.lost:
            future.set_exception(ConnectionError("worker lost"))
        elif len(self.submitted) in self.cancelled:
            future.cancel()
            future.set_running_or_notify_cancel()
        else:
            future.set_result(function(*args))
        return future


def test_a_given_executor_that_loses_workers_gets_their_samples_again(tmp_path):
    pool = Losing({1, 7}, cancelled={4})
    run_study(task(), 12, tmp_path, 1, pool)
    assert numbers(tmp_path) == NUMBERS
    assert sorted(pool.submitted) == sorted([*range(0, 12, 2), *(pool.submitted[k - 1] for k in (1, 4, 7))])
    with pytest.raises(ValueError, match=r"died 3 times on the samples 12 to 13: ConnectionError"):
        run_study(task(), 14, tmp_path, 1, Losing({1, 2, 3}))


def test_what_a_sample_raises_is_told_with_its_number_and_not_repeated(tmp_path, threads):
    data = {"calls": str(tmp_path / "calls"), "wrong": NUMBERS[3]}
    with pytest.raises(SampleError, match=r"^sample 3 \(seed 7\): ZeroDivisionError: no such bearing$"):
        run_study(task(noted, data), 12, tmp_path, 1, threads)
    assert (tmp_path / "calls").read_text().split().count(str(NUMBERS[3])) == 1


def test_more_samples_continue_a_study_and_a_damaged_part_is_made_anew(tmp_path, threads, monkeypatch):
    monkeypatch.setattr(sys.modules["rotorid.study.studies"], "MACHINES", 20)
    file = write(tmp_path)
    for samples in (50, 90):
        grown = study(file, StudyOptions(samples=samples, results=tmp_path / "grown"), executor=threads)
    at_once = study(file, StudyOptions(samples=90, results=tmp_path / "at once"), executor=threads)
    assert kept(tmp_path / "grown") == kept(tmp_path / "at once")
    assert grown.to_dict() == at_once.to_dict()
    fewer = study(file, StudyOptions(samples=50, results=tmp_path / "grown"), executor=threads)
    assert fewer.to_dict() == study(file, StudyOptions(samples=50), executor=threads).to_dict()
    part = tmp_path / "grown" / "part-000001.parquet"
    part.write_bytes(part.read_bytes()[:-100])
    other = part.with_name("part-000002.parquet")
    whole = other.read_bytes()
    value = whole.index(struct.pack("<d", pq.read_table(other)["ratio_0"][3].as_py()))  # a readable one
    other.write_bytes(whole[:value] + bytes([whole[value] ^ 1]) + whole[value + 1 :])
    assert rows_in(part) == rows_in(other) == 0
    study(file, StudyOptions(samples=90, results=tmp_path / "grown"), executor=threads)
    assert kept(tmp_path / "grown") == kept(tmp_path / "at once")


def test_a_folder_of_another_study_is_refused_as_it_is(tmp_path, threads):
    file = write(tmp_path)
    study(file, StudyOptions(results=tmp_path / "kept"), executor=threads)
    before = kept(tmp_path / "kept")
    with pytest.raises(ValueError, match="another study is kept here"):
        study(file, StudyOptions(seed=2, results=tmp_path / "kept"), executor=threads)
    (tmp_path / "rotor.csv").write_text((tmp_path / "rotor.csv").read_text().replace("0.04", "0.05"))
    with pytest.raises(ValueError, match="another study is kept here"):
        study(file, StudyOptions(results=tmp_path / "kept"), executor=threads)
    assert kept(tmp_path / "kept") == before
    (tmp_path / "kept" / "_study.json").write_text("of another program")
    with pytest.raises(ValueError, match="another study is kept here"):
        study(file, StudyOptions(results=tmp_path / "kept"), executor=threads)
    with pytest.raises(ValueError, match="no study is kept here, but other files"):
        study(file, StudyOptions(results=tmp_path), executor=threads)


def test_a_second_study_into_the_same_folder_is_refused_while_the_first_runs(tmp_path, threads):
    file, folder = write(tmp_path), tmp_path / "kept"

    class Second(Losing):
        """Tries the same study in another process before the first of its own samples."""

        def submit(self, function, *args):
            words = [sys.executable, "-m", "rotorid", "study", file, "--results", folder]
            self.second = subprocess.run(words, capture_output=True, text=True, timeout=120)
            return super().submit(function, *args)

    executor = Second(set())
    study(file, StudyOptions(results=folder), executor=executor)
    assert (executor.second.returncode, executor.second.stdout) == (2, "")
    assert executor.second.stderr.startswith(f"rotorid: {folder}: a study is running here")
    first = kept(folder)
    study(file, StudyOptions(results=folder), executor=threads)
    assert kept(folder) == first


class Rows(list):
    """Rows that can be watched."""

    __hash__ = object.__hash__


class Watching(Losing):
    """Counts the futures and rows that are alive, and the parts that were looked for in advance."""

    def __init__(self, monkeypatch):
        super().__init__(set())
        self.alive, self.looked, self.most, self.ahead = weakref.WeakSet(), 0, 0, 0
        monkeypatch.setattr(chunks, "rows_in", self.look)

    def look(self, file):
        self.looked += 1
        return rows_in(file)

    def submit(self, function, *args):
        future = super().submit(lambda *args: Rows(function(*args)), *args)
        self.alive.update([future, future.result()])
        self.most = max(self.most, len(self.alive))
        self.ahead = max(self.ahead, self.looked - len(self.submitted))
        return future


def test_neither_the_chunks_to_come_nor_those_that_are_done_are_kept(tmp_path, monkeypatch):
    pool = Watching(monkeypatch)
    run_study(task(chunk=1), 1200, tmp_path, 1, pool)
    assert len(pool.submitted) == pool.looked == 1200
    assert pool.ahead == 0
    assert pool.most <= 2 * (AHEAD_ELSEWHERE + 1)  # futures and rows; the last that is done, too


def test_progress_tells_the_time_that_is_left(tmp_path, caplog):
    with caplog.at_level(logging.INFO, "rotorid.progress"):
        run_study(task(), 6, tmp_path, 1, Losing(set()))
    said = [record.getMessage() for record in caplog.records]
    assert [line.partition(",")[0] for line in said] == [f"{n} of 6 samples" for n in (2, 4, 6)]
    assert said[-1].endswith("about 0 s left")


def test_the_environment_is_restored(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "5")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    before = dict(os.environ)
    with single_threads():
        assert os.environ["OMP_NUM_THREADS"] == os.environ["MKL_NUM_THREADS"] == "1"
    assert dict(os.environ) == before
