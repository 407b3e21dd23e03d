"""What a person waits for in the worksheet, in a real browser that is open already.

`python -m benchmarks.worksheet`, in the environment of the tests, with Chromium. Limits stand in place of a
peer. The page is ready when it shows the cells of turbo_job, counted from the start of the process, as is its
first answer. An update is the time from leaving a changed cell to the moment at which other corrections stand
in the page, measured there; the largest of 20 counts. The last row is a person: from the start of the process
in an empty folder to the answer of Brüel & Kjær's two-plane example, by keyboard alone, with 0.25 s for a key
(each Tab on the way, too) and 1 s to look for the next field.
"""

from __future__ import annotations

import shutil
import statistics
import sys
import tempfile
import time
from contextlib import ExitStack, closing, contextmanager
from functools import partial
from pathlib import Path

from benchmarks.peers import ROOT
from benchmarks.timing import Row, relative_difference
from rotorid.commands.balance import BalanceOptions, balance

sys.path[:0] = [str(ROOT / "tests" / "helpers")]
SAMPLES = ROOT / "sample_data"
READY, ANSWER, UPDATE, PERSON = 1.0, 3.0, 0.3, 180.0
STROKE, FIELD, UPDATES, STARTS = 0.25, 1.0, 20, 5
CELL = '[id="runs|baseline|1220|probe 1|1|phase_deg"]'
CORRECTIONS = '#answer [data-key^="corrections."]'

# Milliseconds from the end of typing to the first other correction, for every change.
_WATCH = """
window.took = [];
const mass = '#answer [data-key="corrections.0.mass"]';
const now = () => document.querySelector(mass)?.textContent;
let last = now(), begun = 0;
document.addEventListener('change', () => begun = performance.now(), true);
new MutationObserver(() => {
  if (!now() || now() === last) return;
  last = now();
  window.took.push(performance.now() - begun);
}).observe(document.getElementById('answer'), {subtree: true, childList: true, characterData: true});
"""


@contextmanager
def opened(folder: Path, sample: str = "", **pace: float):
    """A copy of a job, or an empty folder, in a window that shows it."""
    from browser import Browser
    from worksheet.served import Served
    from worksheet.window import Window

    job = Path(tempfile.mkdtemp(dir=folder))
    if sample:
        shutil.copytree(SAMPLES / sample, job, dirs_exist_ok=True)
    with ExitStack() as stack:
        browser = stack.enter_context(closing(Browser(tempfile.mkdtemp(dir=folder))))
        browser.resize(1366, 768)
        served = stack.enter_context(closing(Served(job / "job.toml" if sample else job)))
        window = Window(browser, **pace)
        window.open(served.address)
        yield served, window


def starts(folder: Path) -> tuple[float, float]:
    """Seconds to the page and to the first answer, the shortest of some."""
    found = []
    for _ in range(STARTS):
        with opened(folder, "turbo_job") as (served, window):
            window.wait(lambda w=window: w.texts(CELL), "the cells")
            ready = time.perf_counter() - served.begun
            window.wait(lambda w=window: w.texts(CORRECTIONS), "an answer")
            found.append((ready, time.perf_counter() - served.begun))
    return min(one[0] for one in found), min(one[1] for one in found)


def updates(folder: Path) -> list[float]:
    """Seconds from a changed cell to other corrections."""
    with opened(folder, "turbo_job") as (served, window):
        window.wait(lambda: window.texts(CORRECTIONS), "an answer")
        served.settled()
        window.driver.execute_script(_WATCH)
        took = partial(window.driver.execute_script, "return took")
        for k in range(UPDATES):
            window.type(CELL, str(90 + k))
            window.leave()
            window.wait(lambda n=k: len(took()) > n, "other corrections")
            time.sleep(FIELD)  # a person reads, too
        return [ms / 1e3 for ms in took()]


def person(folder: Path) -> tuple[float, float]:
    """Seconds to the first own answer, and how far it is from that of the sample."""
    from worksheet.typed_job import type_job

    with opened(folder, stroke=STROKE, field=FIELD) as (served, window):
        type_job(window, SAMPLES / "bk_two_plane")
        window.wait(lambda: window.texts(CORRECTIONS), "an answer")
        seconds, shown = time.perf_counter() - served.begun, window.numbers()
    told = balance(SAMPLES / "bk_two_plane" / "job.toml", BalanceOptions()).document["corrections"]
    masses = [float(shown[f"corrections.{k}.mass"]) for k in range(2)]
    return seconds, relative_difference(masses, [float(f"{row['mass']:.4g}") for row in told])


def run() -> list[Row]:
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        ready, first = starts(Path(name))
        took = updates(Path(name))
        typed, difference = person(Path(name))
    median = f"the largest of {len(took)}; median {1e3 * statistics.median(took):.0f} ms"
    rows = [("page ready", ready, READY, 0.0, ""), ("first answer", first, ANSWER, 0.0, "")]
    rows += [("update of corrections", max(took), UPDATE, 0.0, median)]
    rows += [("B&K typed by a person", typed, PERSON, difference, "")]
    return [Row(f"Worksheet, {a}", "rotorid", s, "limit", lim, d, 1e-9, 1.0, n) for a, s, lim, d, n in rows]


if __name__ == "__main__":
    for row in run():
        verdict = "" if row.agrees and row.fast_enough else "  MISSED"
        print(f"{row.task:40}{row.our_seconds:8.3f} s of {row.peer_seconds:g} s  {row.note}{verdict}")
