"""How long a store of 10⁶ vectors takes, and how much memory: `python -m benchmarks.fleet [SHARE]`.

Trees are drawn (not timed): (a) 1,250 jobs of 800 vectors, (b) 12,500 jobs of 80 vectors, or a share of
these. Each job has a baseline, two trial runs and a check run with its weights, at four sensors. Then
`rotorid fleet add` runs on two processes, once more on what is known, and `fleet show`. Memory is the largest
sum of what all processes hold at once; the processor's time is that of all of them. The limits are 60 s and
1 GB.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

TREES = {"a: 1,250 jobs of 800 vectors": (1250, 50), "b: 12,500 jobs of 80 vectors": (12500, 5)}
SENSORS, MACHINES_PER_TYPE, SEED = 4, 250, 20261125
JOB = 'runs = "runs.csv"\nweights = "weights.csv"\ncheck = "check.csv"\ncheck_weights = "check_weights.csv"\n'
HEADER = "run,speed_rpm,sensor,amplitude_um_pp,phase_deg\n"
MOUNTED = np.array([[0, 0], [10, 0], [0, 10]])


def main(share: float) -> None:
    for name, (jobs, speeds) in TREES.items():
        with tempfile.TemporaryDirectory() as folder:
            draw(Path(folder, "tree"), max(1, round(share * jobs)), speeds)
            print(name, f"× {share:g}" if share != 1 else "")
            for words in (["add", "F", "tree", "--workers", "2"], ["add", "F", "tree"], ["show", "F"]):
                seconds, own, size, said = measure(["fleet", *words], folder)
                told = f"{seconds:6.1f} s ({own:.1f} s of the processor)  {size / 1e6:5.0f} MB"
                print(f"  {' '.join(words):<24} {told}  {said}", flush=True)
            stored = sum(file.stat().st_size for file in Path(folder, "F").rglob("*.parquet"))
            print(f"  tables of {stored / 1e6:.1f} MB", flush=True)


def draw(tree: Path, jobs: int, speeds: int) -> None:
    """Jobs of machines of a type, in whose coefficients each differs by a few percent."""
    rng = np.random.default_rng(SEED)

    def noise(*shape: int) -> np.ndarray:
        return rng.normal(size=shape) + 1j * rng.normal(size=shape)

    for i in range(jobs):
        if i % MACHINES_PER_TYPE == 0:
            common = 2 * noise(speeds, SENSORS, 2)
        folder = tree / f"type {i // MACHINES_PER_TYPE + 1}" / f"machine {i + 1}"
        folder.mkdir(parents=True)
        W, bare = common * (1 + 0.03 * noise(*common.shape)), 20 * noise(speeds, SENSORS)
        proposed = -np.linalg.lstsq(W.reshape(-1, 2), bare.ravel(), rcond=None)[0]
        lines = {"runs": HEADER, "check": HEADER}
        for run, mounted in enumerate([*MOUNTED, proposed]):
            read = (bare + W @ mounted) * (1 + 0.005 * noise(*bare.shape))
            for (s, c), z in np.ndenumerate(read):
                phase = np.degrees(np.angle(z)) % 360
                row = f"{run},{1000 + 20 * s},S{c},{abs(z):.3f},{phase:.1f}\n"
                lines["check" if run == len(MOUNTED) else "runs"] += row
        for name, text in lines.items():
            (folder / f"{name}.csv").write_text(text)
        (folder / "job.toml").write_text(JOB + 'phase = "lead"\nangles = "with rotation"\n')
        (folder / "weights.csv").write_text("run,plane,mass_g,angle_deg\n1,A,10,0\n2,B,10,0\n")
        rows = (
            f"3,{p},{abs(w):.3f},{np.degrees(np.angle(w)):.1f}\n" for p, w in zip("AB", proposed, strict=True)
        )
        (folder / "check_weights.csv").write_text("run,plane,mass_g,angle_deg\n" + "".join(rows))


def measure(words: list[str], folder: str) -> tuple[float, float, float, str]:
    """Seconds, those of the processor, bytes of memory, and the first line that it prints."""
    begun, used, largest = time.perf_counter(), processor(), 0.0
    process = subprocess.Popen(
        [sys.executable, "-m", "rotorid", *words], cwd=folder, stdout=subprocess.PIPE, text=True
    )

    def watch() -> None:
        nonlocal largest
        while process.poll() is None:
            largest = max(largest, sum(map(resident, [process.pid, *children(process.pid)])))
            time.sleep(0.1)

    watcher = threading.Thread(target=watch)
    watcher.start()
    said = process.communicate()[0]
    watcher.join()
    return time.perf_counter() - begun, processor() - used, largest, said.partition("\n")[0]


def processor() -> float:
    """Seconds of all processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def children(process: int) -> list[int]:
    listed = subprocess.run(
        ["ps", "-o", "pid=", "--ppid", str(process)], capture_output=True, text=True, check=False
    )
    return [int(word) for word in listed.stdout.split()]


def resident(process: int) -> float:
    try:
        pages = Path(f"/proc/{process}/statm").read_text().split()[1]
    except OSError:  # it has ended
        return 0.0
    return float(pages) * 4096


if __name__ == "__main__":
    main(float(sys.argv[1]) if sys.argv[1:] else 1.0)
