"""Large tables: what a correction takes grows with the number of readings, not with its square."""

import tracemalloc

import numpy as np
import pytest
from large_tables import write

from balancing.coefficients.run_error_estimate import MOST, few
from balancing.correction.correction_errors import StackErrors
from rotorid.tables import job_from_files
from rotorid.workflows import balance


def test_memory_grows_with_the_readings(tmp_path):
    peaks = []
    for channels in (150, 600):
        write(tmp_path, channels)
        job = job_from_files([tmp_path / "runs.csv", tmp_path / "weights.csv"])
        tracemalloc.start()
        try:
            balance(job)
            peaks.append(tracemalloc.get_traced_memory()[1])
        finally:
            tracemalloc.stop()
    assert (
        peaks[1] < 10_000_000
    )  # one matrix of all 600 readings has 11.5 MB; the first call has imports, too


@pytest.mark.parametrize(
    ("S", "C"), [(1, 1), (3, 4), (16, 4), (17, 4), (400, 1), (1, 300), (40, 10), (5, 70)]
)
def test_the_readings_that_tell_errors_are_spread_over_speeds_and_sensors(S, C):
    speeds, sensors = few(S, C)
    assert speeds.size * sensors.size <= MOST
    if S * C <= MOST:
        assert (speeds.size, sensors.size) == (S, C)
    for chosen, number in ((speeds.ravel(), S), (sensors, C)):
        assert (chosen[0], np.unique(chosen).size) == (0, chosen.size)
        assert chosen.size == 1 or chosen[-1] == number - 1


def test_the_bound_of_a_check_run_is_that_of_the_whole_covariance(tmp_path, monkeypatch):
    """By blocks it is what the matrix of all readings gives."""
    write(tmp_path, 30, again=2)
    real, compared = StackErrors.check_rms, []

    def both(self, D, after, dof):
        from scipy.special import gammaincinv

        from balancing.coefficients.run_errors import run_columns, runs_of
        from rotorid.regression import stretch

        further = run_columns(self.run, runs_of(after[None], D[None], self.W)).common
        joint = sum(self._shared(D, further.reshape(2, -1, *after.shape)))
        n = np.arange(after.size)
        joint.reshape(len(n), 2, len(n), 2)[n, :, n] = self.check_run(D, after).reshape(-1, 2, 2)
        a = stretch(after.ravel())
        mean = a @ a + np.trace(joint)
        variance = 2 * np.sum(joint**2) + 4 * a @ joint @ a
        shape = 1 / (variance / mean**2 + (0 if dof is None else 2 / dof))
        found = real(self, D, after, dof)
        whole = np.sqrt(mean * gammaincinv(shape, 0.95) / shape / after.size)
        compared.append((found, whole))
        return found

    monkeypatch.setattr(StackErrors, "check_rms", both)
    balance(job_from_files([tmp_path / "runs.csv", tmp_path / "weights.csv"]))
    assert compared
    for found, whole in compared:
        assert found == pytest.approx(whole, rel=1e-12)
