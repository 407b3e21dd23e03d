"""The picture of vectors and their tacho: what is drawn lies where closed forms say."""

from types import SimpleNamespace

import numpy as np
import pytest
from documents import check_hygiene
from matplotlib.figure import Figure

from rotorid.commands.vectors import VectorsOptions, vectors
from rotorid.samples import sample_data
from rotorid.waveforms.plots import draw_tacho
from rotorid.waveforms.record import Channel

RATE, SECONDS = 2560.0, 20.0


class OnDisk(np.ndarray):
    """Samples of which only short stretches may be read."""

    def __getitem__(self, where):
        part = np.asarray(self)[where]
        assert len(part) <= 1200
        return part


def drawn(c=0.0, **damage):
    """Picture of a shaft of 10 + c t turns a second with one pulse a turn, and what is known of it."""
    turns = np.setdiff1d(np.arange(np.floor(10 * SECONDS + c * SECONDS**2 / 2)), damage["missing"])
    pulses = SimpleNamespace(
        turns=turns,
        times=turns / 10 if not c else (np.sqrt(100 + 2 * c * turns) - 10) / c,
        turn_at=lambda t: 10 * t + c * t**2 / 2,
        level=2.0,
        **damage,
    )
    t = np.arange(int(SECONDS * RATE)) / RATE
    samples = np.where(pulses.turn_at(t) % 1 < 0.05, 5.0, 0.0).view(OnDisk)
    ax = Figure().add_subplot()
    draw_tacho(ax, Channel("tacho", samples), RATE, pulses)
    return ax, pulses


def curve(ax, label):
    (line,) = (line for line in ax.lines if line.get_label() == label)
    return line.get_xdata()


def test_a_tacho_with_damage():
    signal, pulses = drawn(0.8, missing=np.array([200.0, 250.0]), double=np.array([18.0]))
    gap = np.interp(200, pulses.turns, pulses.times)
    assert np.mean(signal.get_xlim()) == pytest.approx(gap, abs=0.01)
    assert np.diff(pulses.turn_at(np.array(signal.get_xlim()))) == pytest.approx(4.0, rel=1e-3)
    np.testing.assert_array_equal(curve(signal, f"pulses: {len(pulses.times)}"), pulses.times)
    np.testing.assert_allclose(curve(signal, "missing, bridged: 2")[0], gap)
    np.testing.assert_array_equal(curve(signal, "double, left out: 1"), [18.0])


@pytest.mark.parametrize("speeds", [None, "900,2000rpm"])
def test_vectors_stand_where_the_table_says(speeds):
    options = VectorsOptions(tacho="1", unit="um", phase="lag", speeds=speeds)
    outcome = vectors([sample_data() / "waveforms" / "run_up.wav"], options)
    [figure] = [draw() for draw in outcome.pictures.values()]
    check_hygiene(figure)
    for ax, key in zip(figure.axes, ("amplitude", "phase_deg"), strict=False):
        for container, sensor in zip(ax.containers, outcome.result[0].sensors, strict=True):
            rows = [row for row in outcome.keys["rows"] if row["sensor"] == sensor]
            x, y = container.lines[0].get_data()
            name = next(name for name in rows[0] if name.startswith(key))
            there = np.isfinite(y)
            assert there.mean() > 0.9
            np.testing.assert_allclose(x, [row["speed_rpm"] for row in rows], rtol=1e-4)
            np.testing.assert_allclose(y[there], np.array([row[name] for row in rows])[there], rtol=1e-3)
