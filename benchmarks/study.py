"""Studies on one worker, two workers and Dask: times, and whether the bytes are equal.

Run `python -m benchmarks.study [samples [runs]]` on an idle machine; 10,000 samples as built by default.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path

from rotorid.samples import sample_data
from rotorid.study import StudyOptions, study


def main(samples: int = 10_000, runs: int = 0) -> None:
    """Print a line for each way."""
    from distributed import Client, LocalCluster

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        text = (sample_data() / "study" / "study.toml").read_text(encoding="utf-8")
        text = text.replace("../rotor23.csv", (sample_data() / "rotor23.csv").as_posix())
        file = folder / "study.toml"
        file.write_text(text.replace("corrections = 3", f"corrections = {runs}"), encoding="utf-8")
        seconds, bytes_of = {}, {}

        def timed(way: str, workers: int, **executor: object) -> None:
            options = StudyOptions(samples=samples, workers=workers, results=folder / f"{way}.parquet")
            begun = time.perf_counter()
            study(file, options, **executor)
            seconds[way] = time.perf_counter() - begun
            bytes_of[way] = (folder / f"{way}.parquet").read_bytes()
            same = bytes_of[way] == bytes_of["one worker"]
            each = 1e3 * seconds[way] / samples
            ratio = seconds["one worker"] / seconds[way]
            print(
                f"{way:<12}{seconds[way]:8.2f} s  {each:7.3f} ms a sample  {ratio:5.2f} times one", end="  "
            )
            print("bytes equal" if same else "BYTES DIFFER", flush=True)

        print(f"{samples} samples, at most {runs} corrections; load {os.getloadavg()[0]:.2f} before")
        timed("one worker", 1)
        timed("two workers", 2)
        cluster = LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None)
        with cluster, Client(cluster) as client:
            client.run(lambda: __import__("rotorid.study.samples"))
            timed("Dask", 2, executor=client.get_executor())
        print(f"Dask takes {seconds['Dask'] / seconds['two workers']:.2f} times what two own workers do")


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
