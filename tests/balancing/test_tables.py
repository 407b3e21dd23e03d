"""What tables of results are made of: units, rounding, and errors in words."""

import numpy as np
import pytest

from balancing import Labels, Reading, ReadingErrors, RunErrors
from balancing.tables import (
    degrees,
    error_document,
    error_words,
    largest_readings,
    reading_names,
    rms,
    small,
    vector_columns,
)

LABELS = Labels("um_pp", 2e6, "g", 1e3, "lag", "against rotation")
RUN = RunErrors(np.array([[0.03, 0.04, 0.0, 0.0]]), np.ones(1), "estimated", 2e-6)


def test_numbers_and_what_is_nothing():
    assert rms([3, 4j]) == pytest.approx(np.sqrt(12.5))
    assert degrees(359.97) == "0.0°"
    assert small(1e-12, 1.0) == "0"
    assert small(0.01234, 1.0) == "0.0123"


def test_vectors_are_written_as_the_job_counts():
    size, phase = vector_columns(LABELS, "after", np.array([[1e-6 * np.exp(0.5j), 1e-12]]), 1e-3)
    assert (size.name, phase.name) == ("after", "after_phase_deg")
    assert size.values.tolist() == pytest.approx([2.0, 0.0])
    assert phase.values[0] == pytest.approx(360 - np.degrees(0.5))
    assert np.isnan(phase.values[1])


def test_the_largest_readings_are_named_with_what_they_were():
    before, after = np.array([[3e-6, 2e-6]]), np.array([[1e-6, 2e-7]])
    words = largest_readings(Labels("um", 1e6), np.array([100 * np.pi]), ("DE", "NDE"), before, after)
    assert words == ", µm peak: DE at 3000 rpm 3.00 → 1.00; NDE at 3000 rpm 2.00 → 0.200."
    assert reading_names(Labels(), ("DE",), np.array([100 * np.pi])) == ("sensor 'DE' at 3000 rpm",)


def test_errors_in_words_and_numbers():
    reading = Reading(ReadingErrors(0.02, np.deg2rad(1.5), 1e-7), "repeats", (), 12.0)
    words = error_words(reading, RUN, LABELS)
    assert "2 % of the amplitude, 1.5°, 0.2" in words
    assert "from run to run: 3 % of each sensor alone, 4 % common to the run (estimated)" in words
    assert words.endswith("Degrees of freedom: 12.")
    document = error_document(reading, RUN, LABELS)
    assert document["phase_deg"] == pytest.approx(1.5)
    assert document["between_runs"]["percent"] == pytest.approx(5.0)
    assert document["between_runs"]["rms"] == pytest.approx(0.05 * 4)
    assert document["between_runs"]["common_share"] == pytest.approx(0.64)
