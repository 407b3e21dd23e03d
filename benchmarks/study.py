"""Studies on one worker, two workers and Dask: times, and whether the bytes are equal.

Run `python -m benchmarks.study [samples]` on an idle machine; 10,000 machines as built by default.
"""

import sys
import tempfile
import time
from pathlib import Path

from rotorid.samples import sample_data
from rotorid.study import StudyOptions, study


def main(samples: int = 10_000) -> None:
    from distributed import Client, LocalCluster

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        text = (sample_data() / "study" / "study.toml").read_text(encoding="utf-8")
        text = text.replace("../rotor23.csv", (sample_data() / "rotor23.csv").as_posix())
        (folder / "study.toml").write_text(
            text.replace("corrections = 3", "corrections = 0"), encoding="utf-8"
        )

        def timed(way: str, workers: int, **executor: object) -> tuple[float, bytes]:
            options = StudyOptions(samples=samples, workers=workers, results=folder / f"{way}.parquet")
            start = time.perf_counter()
            study(folder / "study.toml", options, **executor)
            return time.perf_counter() - start, options.results.read_bytes()

        one, two = timed("one worker", 1), timed("two workers", 2)
        cluster = LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None)
        with cluster, Client(cluster) as client:
            client.run(lambda: __import__("rotorid.study"))
            dask = timed("Dask", 2, executor=client.get_executor())
        print(f"seconds of one worker, two, Dask with two: {one[0]:.2f}, {two[0]:.2f}, {dask[0]:.2f}")
        print("bytes equal" if one[1] == two[1] == dask[1] else "BYTES DIFFER")


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
