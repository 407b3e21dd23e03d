"""Vectors along a run-up against rota-order, and those of a long record.

The run-up of examples/vectors_accuracy.py: 1× and 2× of one channel by `find_vectors` (with standard
deviations) and by rota-order's Vold–Kalman filter, both from the tacho's samples on. Errors of both are told
against the exact answer, from 2 to 58 s at the same instants; the difference is the largest between the two,
relative to the peak. Times are those of the processor, in each one's own process.
`python -m benchmarks.vectors [SEEDS]` prints rota-order's lines of docs/vectors_accuracy.md.

The long record: eight channels of 10⁷ samples, a tacho and seven sensors, 16 bit, a run-up whose vectors are
a formula, through the whole command `rotorid vectors`; calls of `numpy.linalg.lstsq` stand beside it, its
memory stays below 0.6 GB, and the difference is the largest error relative to the peak. Making the record is
not timed.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
import wave
from pathlib import Path

import numpy as np

from benchmarks.peers import ROOT, run_peer
from benchmarks.timing import Row, against_numpy
from examples.vectors_accuracy import (
    CRITICAL,
    DAMPING,
    FIRST,
    LAST,
    MARK,
    NOISE,
    RATE,
    RIPPLE,
    RUN_OUT,
    SECONDS,
    Errors,
    Machine,
    errors,
    machine,
    peak,
    record,
    worst,
)
from rotorid.waveforms.record import TachoSettings, WaveformRecord
from rotorid.waveforms.vectors import find_vectors

ORDERS, SEEDS, REPEAT = (1, 2), 3, 5
LONG, SENSORS, PART, FULL_SCALE = 10**7, 7, 1 << 18, 200e-6
MEASURED = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(used.ru_utime + used.ru_stime, used.ru_maxrss, file=sys.stderr)
"""
"""Runs a command from a small process: the peak of a child begins with that of the process that starts it."""
LIMIT_BYTES = 0.6e9


def main(seeds: int) -> None:
    """Print what rota-order does with the records of the example."""
    print("ripple   rms %  largest %  ends %  offset °")
    for ripple in (0.0, RIPPLE):
        run = machine(ripple)
        instants, _ = ours(run, records := [record(run, seed) for seed in range(seeds)])
        theirs = rota_order(records, instants)
        for way in ("defaults", "best"):
            found = [errors(run, t, theirs[f"{way}{i}"]) for i, t in enumerate(instants)]
            print(f"{100 * ripple:4.1f} %  {worst(found)}  {way}")


def ours(run: Machine, records: list[WaveformRecord]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Instants and vectors of 1× of each record."""
    found = [find_vectors(one, TachoSettings(), ORDERS) for one in records]
    return [one.times for one in found], [one.vectors[:, 0, 0] for one in found]


def rota_order(records: list[WaveformRecord], instants: list[np.ndarray]) -> dict[str, np.ndarray]:
    """Its vectors at these instants, "WAY and number of the record", and "seconds"."""
    data = {"rate": np.array(RATE), "records": np.array(len(records))}
    for i, (one, t) in enumerate(zip(records, instants, strict=True)):
        data |= {f"tacho{i}": one.tacho.samples, f"samples{i}": one.sensors[0].samples, f"times{i}": t}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "records.npz"
        np.savez(file, **data)
        run_peer("rota-order", Path(__file__).with_name("vectors_peer.py"), file)
        return dict(np.load(file))


def words(found: list[Errors]) -> str:
    rms, largest, _, offset = worst(found).split()
    return f"{rms}, {largest}, {offset}°"


def against_rota_order() -> Row:
    run = machine()
    records = [record(run, seed) for seed in range(SEEDS)]
    instants, vectors = ours(run, records)
    theirs = rota_order(records, instants)
    times, differences = [], []
    for _ in range(REPEAT):
        start = time.process_time()
        ours(run, records[:1])
        times.append(time.process_time() - start)
    for i, (t, own) in enumerate(zip(instants, vectors, strict=True)):
        inside = (t > 2) & (t < SECONDS - 2)
        differences.append(np.abs(own - theirs[f"best{i}"])[inside].max() / peak(run))
    its, defaults = (
        [errors(run, t, theirs[f"{way}{i}"]) for i, t in enumerate(instants)] for way in ("best", "defaults")
    )
    own = [errors(run, t, one) for t, one in zip(instants, vectors, strict=True)]
    return Row(
        task="Vectors of 1× and 2×, run-up of 307,200 samples",
        ours="find_vectors",
        our_seconds=min(times),
        peer="rota-order 0.3.0",
        peer_seconds=float(theirs["seconds"]),
        difference=float(max(differences)),
        allowed=0.02,
        required_ratio=1.0,
        note=f"errors in % of the peak, rms and largest, and phase: {words(own)}; "
        f"its {words(its)}, with its defaults {words(defaults)}",
    )


def steady_answer(t: np.ndarray) -> np.ndarray:
    """The vector of the long record."""
    ratio = (FIRST + (LAST - FIRST) * t * RATE / LONG) / CRITICAL
    return 3e-6 * ratio**2 / (1 - ratio**2 + 2j * DAMPING * ratio) + RUN_OUT


def write_long_record(file: Path) -> None:
    """As a WAV file, in parts; sensor c leads by c rad."""
    rng = np.random.default_rng(1)
    with wave.open(str(file), "wb") as out:
        out.setparams((1 + SENSORS, 2, int(RATE), LONG, "NONE", ""))
        for start in range(0, LONG, PART):
            t = np.arange(start, min(LONG, start + PART)) / RATE
            turns = FIRST * t + (LAST - FIRST) * RATE / LONG / 2 * t**2
            lead = np.multiply.outer(
                steady_answer(t) * np.exp(2j * np.pi * turns), np.exp(1j * np.arange(SENSORS))
            )
            x = lead.real + NOISE * rng.standard_normal(lead.shape)
            pulse = np.where(turns % 1 < MARK, 0.5, 0.0)
            counts = np.round(np.column_stack((pulse, x / FULL_SCALE)) * 2**15)
            out.writeframes(counts.astype("<i2").tobytes())


def long_record() -> Row:
    with tempfile.TemporaryDirectory() as folder:
        file, answer = Path(folder) / "long.wav", Path(folder) / "answer.json"
        write_long_record(file)
        command = [sys.executable, "-m", "rotorid", "vectors", str(file), "--tacho", "1", "--unit", "um"]
        with answer.open("w") as out, (Path(folder) / "usage").open("w+") as usage:
            started = [sys.executable, "-c", MEASURED, *command, "--json"]
            subprocess.run(started, cwd=ROOT, stdout=out, stderr=usage, check=True)
            usage.seek(0)
            seconds, peak_rss = map(float, usage.read().splitlines()[-1].split())
        rows = json.loads(answer.read_text())["rows"]
    memory = peak_rss * (1 if sys.platform == "darwin" else 1024)
    if memory > LIMIT_BYTES:
        raise RuntimeError(
            f"rotorid vectors took {memory / 1e6:.0f} MB for the long record, more than 600 MB"
        )
    t = np.array([row["time_s"] for row in rows])
    lead = np.array([int(row["sensor"]) - 2 + 0.0 for row in rows])
    found = np.array([row["amplitude_um"] * np.exp(1j * np.radians(row["phase_deg"])) for row in rows])
    exact = steady_answer(t) * np.exp(1j * lead)
    return against_numpy(
        "Vectors of 1×, 8 channels of 10⁷ samples, WAV",
        seconds,
        5000,
        float(np.abs(found * FULL_SCALE - exact).max() / np.abs(exact).max()),
        0.0025,
        f"processor time of the whole process; peak memory {memory / 1e6:.0f} MB, of 600 MB",
    )


def run() -> list[Row]:
    return [against_rota_order(), long_record()]


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10)
