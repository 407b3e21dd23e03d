"""Studies: shares of regions that hold the truth."""

from concurrent.futures import ThreadPoolExecutor

from repetitions import FULL
from scipy.stats import binomtest
from studies.drawn import STUDY, write

from rotorid.study import StudyOptions, study

TWO = STUDY.replace(
    "[planes.middle]\nnode = 3\n", "corrections = 3\n[planes.left]\nnode = 2\n[planes.right]\nnode = 4\n"
).replace(
    "[unbalance.3]",
    "[sensors.other]\nnode = 2\nlimit_mm_s_rms = 1.2\n[unbalance.2]\nrms_g_mm = 360\n[unbalance.4]",
)


def run(file, **options):
    with ThreadPoolExecutor(2) as pool:
        return study(file, StudyOptions(**options), executor=pool)


def test_small_errors_within_the_model_are_covered(tmp_path):
    """The engine draws errors as the analysis takes them: 95 % of the regions hold the truth."""
    text = TWO.replace("limit_um_pp = 20", "limit_um_pp = 1").replace("corrections = 3", "corrections = 1")
    samples, errors = 400 if FULL else 200, "[readings]\namplitude_percent = 0.5\nphase_deg = 0.3\n"
    found = run(write(tmp_path, text + errors), samples=samples)
    first = found.result["held"].dropna()
    good, n = int(first.sum()), len(first)
    assert n > 0.975 * samples
    low, high = binomtest(good, n).proportion_ci(0.999)
    assert low < 0.95 < high
