"""`rotorid.commands.unbalance`: from Python as from the command line."""

import pytest

from rotorid import read_rotor
from rotorid.commands.unbalance import UnbalanceOptions, unbalance
from rotorid.samples import sample_data

JOB = sample_data() / "model_job" / "job.toml"


@pytest.mark.parametrize("stations", [[6, 12, 19], [12], [4, 6, 8, 10, 12, 14, 16, 18, 19, 20]])
def test_the_picture_shows_the_rotor_under_the_stations_and_whole_regions(stations):
    """As figure 3 of [S]: each station has a vector, and a line with its name at its place in the rotor."""
    outcome = unbalance(JOB, UnbalanceOptions(stations=stations))
    figure = outcome.figure()
    figure.canvas.draw()
    above, below = figure.axes
    assert (below.get_xlabel(), below.get_ylabel()) == ("position, m", "radius, mm")
    rotor = read_rotor(JOB.with_name("rotor.csv"))
    assert len(above.get_xticks()) == len(stations)
    names = {text.get_text(): text.xy[0] for text in below.texts}
    assert names == {str(node): rotor.positions[node - 1] for node in stations}
    assert [line.get_xdata()[0] for line in below.lines[-len(stations) :]] == [*names.values()]
    inside = above.get_window_extent()
    regions = [line for line in above.get_lines() if len(line.get_xdata()) > 2]
    assert len(regions) == len(stations)
    for line in regions:
        x, y = above.transData.transform(line.get_xydata()).T
        assert inside.x0 <= x.min() <= x.max() <= inside.x1
        assert inside.y0 <= y.min() <= y.max() <= inside.y1
