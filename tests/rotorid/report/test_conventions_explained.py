"""The figure of the balancing sheet that says what a phase is."""

import numpy as np
import pytest

from balancing import Labels
from rotorid.report import conventions_explained


@pytest.mark.parametrize(("phase", "peak"), [("lag", 60.0), ("lead", 300.0)])
def test_the_peak_of_the_figure_stands_where_the_phase_says(phase, peak):
    line = conventions_explained.phase_figure(Labels(phase=phase)).axes[0].lines[0]
    turn, reading = line.get_data()
    inside = (turn >= 0) & (turn < 360)
    found = turn[inside][np.argmax(reading[inside])]
    assert found == pytest.approx(peak, abs=1.2)
