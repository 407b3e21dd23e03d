import subprocess
import sys

import matplotlib as mpl
import numpy as np
import pytest
from fem_rotors import rotor23, uniform

import fem
from fem.plots import new_axes

mpl.use("Agg")


@pytest.fixture(autouse=True)
def _closed_figures():
    from matplotlib import pyplot as plt

    yield
    plt.close("all")


def labels(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_drawing_is_to_scale_and_shows_bores_masses_and_supports():
    rotor = fem.Rotor(
        [0.1, 0.3, 0.2],
        [0.05, 0.12, 0.06],
        [0.0, 0.08, 0.0],
        discs=[fem.Disc(2, 10.0), fem.Disc(3, 30.0)],
        supports=[fem.Support(1, 1e7), fem.Support(4, 1e7, 1e3)],
    )
    ax = fem.draw_rotor(rotor)
    boxes = [patch.get_bbox().bounds for patch in ax.patches]
    np.testing.assert_allclose(boxes[1], (0.1, -60.0, 0.3, 120.0))
    np.testing.assert_allclose(boxes[3], (0.1, -40.0, 0.3, 80.0))
    assert labels(ax) == ["masses, 10 to 30 kg", "support", "damped support"]
    masses, stiff, damped = ax.collections
    assert masses.get_sizes()[1] == pytest.approx(3 * masses.get_sizes()[0])
    np.testing.assert_allclose(stiff.get_offsets(), [[0.0, -25.0]])
    np.testing.assert_allclose(damped.get_offsets(), [[0.6, -30.0]])
    assert ax.get_xlabel() == "position, m"
    assert ax.get_ylabel() == "radius, mm"
    ax.figure.canvas.draw()


def test_drawing_as_scenery_leaves_labels_alone():
    ax = new_axes()
    assert fem.draw_rotor(rotor23(), ax, height=0.5) is ax
    assert ax.get_legend() is None
    assert ax.get_ylabel() == ""
    assert max(patch.get_height() for patch in ax.patches) == pytest.approx(1.0)


def test_mode_shapes_are_drawn_over_the_rotor():
    modes = fem.critical_speeds(rotor23(1e4), n=3)
    ax = new_axes()
    assert modes.plot(ax) is ax
    lines = ax.get_lines()[:3]
    for line, shape in zip(lines, modes.shapes.T, strict=True):
        x, y = line.get_data()
        assert np.abs(y).max() == pytest.approx(1.0)
        at_nodes = np.interp(modes.positions, x, y)
        np.testing.assert_allclose(at_nodes / at_nodes[0], shape / shape[0], rtol=1e-9)
    assert len(ax.patches) == 23
    assert sum("rad/s" in label for label in labels(ax)) == 3
    assert {"masses, 21 to 30 kg", "damped supports"} <= set(labels(ax))
    ax.figure.canvas.draw()


def test_rigid_modes_are_named():
    assert "1: rigid body" in labels(fem.critical_speeds(uniform(6), n=3).plot())


def test_amplitudes_over_speed():
    rotor = rotor23(2e4)
    speeds = np.linspace(1, 700, 50)
    response = fem.unbalance_response(rotor, {12: 1e-3}, speeds)
    ax = response.plot()
    assert labels(ax)[:2] == ["node 2", "node 22"]
    np.testing.assert_allclose(ax.get_lines()[0].get_ydata(), 1e6 * np.abs(response.at(2)))
    assert labels(response.plot(nodes=[5])) == ["node 5"]
    W = fem.influence(rotor, [7], [2, 22], speeds)
    ax = W.plot()
    assert labels(ax) == ["sensor 2, plane 7", "sensor 22, plane 7"]
    np.testing.assert_allclose(ax.get_lines()[1].get_ydata(), np.abs(W.W[:, 1, 0]))
    ax.figure.canvas.draw()
    assert fem.influence(rotor, [7], [2], 100.0).plot().get_lines()[0].get_marker() == "o"


def test_import_loads_neither_matplotlib_nor_scipy():
    code = "import sys, fem; print([m for m in ('matplotlib', 'scipy', 'pandas') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
