"""Peak memory of each command beside the size of its data, as a table: `make memory`.

Each command runs on a large input and on a small one of the same kind; the difference of both peaks is what
the data cost, since imports and the interpreter are in both. The size of the data is that of their numbers
as arrays of float64 (of a model that of its matrices, of a study that of its readings). With words, only the
rows whose command line has one of them.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import tempfile
import wave
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
SAMPLES = ROOT / "sample_data"
ROWS = 100_000
RUNS = "run,speed_rpm,sensor,amplitude_um_pp,phase_deg"
SECONDS = 900
"""Of one command."""


def write_table(path: Path, header: str, *columns: np.ndarray) -> int:
    """Write a CSV file of numbers; the size of these."""
    np.savetxt(path, np.column_stack(columns), "%.9g", ",", header=header, comments="")
    return sum(column.nbytes for column in columns)


def readings(folder: Path) -> int:
    """A runs table of 10⁵ rows, 5 runs at 100 speeds with 200 sensors, and its weights."""
    rng, lines = np.random.default_rng(1), [RUNS]
    W = rng.normal(size=(2, 5, 100, 200)) @ np.diag(np.ones(200))
    runs = 20 * (W[0, 0] + 1j * W[1, 0]) + 10 * (W[0] + 1j * W[1]) * np.arange(5).clip(max=1)[:, None, None]
    for (r, s, c), z in np.ndenumerate(runs):
        phase = np.degrees(np.angle(z)) % 360
        lines.append(f"run {r},{1000 + 10 * s},probe {c},{abs(z):.3f},{phase:.1f}")
    (folder / "runs.csv").write_text("\n".join(lines) + "\n")
    weights = "".join(f"run {r},plane {r},10,0\n" for r in range(1, 5))
    (folder / "weights.csv").write_text(f"run,plane,mass_g,angle_deg\n{weights}")
    return 8 * 5 * runs.size


def channels(seconds: float) -> tuple[np.ndarray, list[np.ndarray]]:
    """Times, and a tacho and three probes of a shaft at 3,000 rpm."""
    t = np.arange(int(seconds * 26_000)) / 26_000
    turn = 50.0 * t % 1.0
    probes = (0.3 * np.cos(2 * np.pi * (turn + k / 3)) for k in range(3))
    return t, [np.where(turn < 0.05, 0.9, 0.0), *probes]


def record_wav(folder: Path) -> int:
    """A WAV file of 50 MB."""
    data = np.round(32767 * np.column_stack(channels(240.0)[1])).astype("<i2")
    with wave.open(str(folder / "record.wav"), "wb") as file:
        file.setparams((4, 2, 26_000, 0, "NONE", ""))
        file.writeframes(data.tobytes())
    return 8 * data.size


def record_csv(folder: Path) -> int:
    """A CSV file of 50 MB, and the beginning of it."""
    for name, seconds in (("short.csv", 1.0), ("record.csv", 38.0)):
        t, columns = channels(seconds)
        size = write_table(folder / name, "t_s,tacho,A_um,B_um,C_um", t, *columns)
    return size


def rotor(folder: Path) -> int:
    """The rotor of 23 elements with each element in 20 parts; the size of its two matrices."""
    head, *rows = (SAMPLES / "rotor23.csv").read_text().splitlines()
    lines, names = [head], head.split(",")
    for row in rows:
        cells = dict(zip(names, row.split(","), strict=True))
        length = float(cells["length_m"])
        for part in range(20 if length else 1):
            lost = () if part == 0 else ("mass", "inertia", "support")
            more = {name: "" for name in names if any(word in name for word in lost)}
            lines.append(",".join((cells | more | {"length_m": f"{length / 20:.9g}"}).values()))
    (folder / "rotor.csv").write_text("\n".join(lines) + "\n")
    return 2 * 8 * (2 * len(lines)) ** 2


def amplitudes(folder: Path) -> int:
    """A measurement table of 10⁵ rows."""
    w, rng = np.linspace(1.0, 100.0, ROWS), np.random.default_rng(2)
    X = 10.0 / (2000.0 - 10.0 * w**2 + 12j * w) * (1 + 0.01 * rng.normal(size=ROWS))
    header = "frequency_rad_s,F_re,X_re,X_im"
    return write_table(folder / "amplitudes.csv", header, w, np.full(ROWS, 10.0), X.real, X.imag)


def decay(folder: Path) -> int:
    """A time record of 10⁵ samples, and a model of it."""
    t, rng = np.linspace(0.0, 50.0, ROWS), np.random.default_rng(3)
    x = np.exp(-0.05 * t) * np.cos(2.0 * t) + 0.001 * rng.normal(size=ROWS)
    write_table(folder / "few.csv", "t_s,x", t[:: ROWS // 100], x[:: ROWS // 100])
    (folder / "decay.toml").write_text(
        'estimate = {c = 3.9, d = 0.12, v0 = 0.0}\n[states]\nx = "v"\nv = "-c*x - d*v"\n'
        '[initial]\nx = 1.0\nv = "v0"\n[outputs]\nx = "x"\n'
    )
    return write_table(folder / "decay.csv", "t_s,x", t, x)


def sweep(folder: Path) -> int:
    """Vectors of a run-up at 10⁵ speeds."""
    speed = np.linspace(300.0, 3000.0, ROWS)
    H = 40 * speed**2 / (1500.0**2 - speed**2 + 90j * speed)
    rows = [
        f"up,{v:.4f},A,{abs(h):.3f},{np.degrees(np.angle(h)) % 360:.2f}"
        for v, h in zip(speed, H, strict=True)
    ]
    for name, step in (("sweep.csv", 1), ("few_speeds.csv", ROWS // 100)):
        (folder / name).write_text("\n".join([RUNS, *rows[::step]]) + "\n")
    return 8 * 5 * ROWS


def study(folder: Path) -> int:
    """The sample study; the size of 4 readings in 5 states of its 1,000 rotors."""
    text = (SAMPLES / "study/study.toml").read_text().replace("../", f"{SAMPLES}/")
    (folder / "study.toml").write_text(text)
    return 8 * 2 * 4 * 5 * 1_000


JOB = f"{SAMPLES}/turbo_job/runs.csv {SAMPLES}/turbo_job/weights.csv"
TASK = f"{SAMPLES}/identify/task_5_1"
ROTOR = f"{SAMPLES}/rotor23.csv"
WAV = f"{SAMPLES}/waveforms/as_found.wav"
CASES: Sequence[tuple[str, str, str, Callable[[Path], int]]] = (
    ("balance FILE --errors 2,2", "runs.csv weights.csv", JOB, readings),
    ("vectors FILE --tacho 1 --unit um", "record.wav", WAV, record_wav),
    ("vectors FILE --tacho tacho", "record.csv", "short.csv", record_csv),
    ("runup FILE --phase lead", "sweep.csv", "few_speeds.csv", sweep),
    (f"identify {TASK}/model.toml FILE", "amplitudes.csv", f"{TASK}/data.csv", amplitudes),
    ("fit decay.toml FILE", "decay.csv", "few.csv", decay),
    ("critical FILE -n 4", "rotor.csv", ROTOR, rotor),
    ("campbell FILE --speeds 50:650:150 -n 4", "rotor.csv", ROTOR, rotor),
    ("influence FILE --planes 7 --sensors 2 --speeds 100:600:5", "rotor.csv", ROTOR, rotor),
    ("reduce FILE --nodes 7,12,18 --modes 2", "rotor.csv", ROTOR, rotor),
    ("study study.toml --samples FILE", "1000", "20", study),
)
"""Command, its large and its small input, and what writes the former and gives the size of its numbers."""


def peak(command: str, folder: Path) -> int | str:
    """Peak resident memory of a command, bytes; or why there is none."""
    environment = os.environ | {"PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    words = ["timeout", str(SECONDS), sys.executable, "-m", "rotorid", *shlex.split(command)]
    with (folder / "messages").open("w+") as messages:
        process = subprocess.Popen(
            words, cwd=folder, env=environment, stdout=subprocess.DEVNULL, stderr=messages
        )
        _, status, usage = os.wait4(process.pid, 0)  # with its children
        messages.seek(0)
        if os.waitstatus_to_exitcode(status) == 124:
            return f"more than {SECONDS} s"
        return messages.read()[-200:].strip() if status else 1024 * usage.ru_maxrss


@cache
def size_of(write: str, folder: str) -> int:
    """The size of what a function writes, by a process of its own: children begin at the peak of this one."""
    return int(subprocess.check_output([sys.executable, __file__, "--write", write, folder]))


def main(wanted: Sequence[str]) -> None:
    """Measure and print."""
    if wanted[:1] == ["--write"]:
        print(globals()[wanted[1]](Path(wanted[2])))
        return
    print("|command|data, MB|peak above a small input's, MB|ratio|\n|---|--:|--:|--:|")
    with tempfile.TemporaryDirectory(prefix="memory") as name:
        for command, large, small, write in CASES:
            shown = command.replace("FILE", large).replace(f"{SAMPLES}/", "")
            if wanted and not any(word in shown for word in wanted):
                continue
            size = size_of(write.__name__, name)
            most, base = (peak(command.replace("FILE", each), Path(name)) for each in (large, small))
            if isinstance(most, str) or isinstance(base, str):
                print(
                    f"|{shown}|{size / 1e6:.3g}|{most if isinstance(most, str) else base}||",
                    flush=True,
                )
                continue
            more = most - base
            print(f"|{shown}|{size / 1e6:.3g}|{more / 1e6:.3g}|{more / size:.1f}|", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
