"""Discs: what is drawn stands where it will be mounted, as large as it is."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from balancing.data.conventions import Labels
from balancing.mounting.holes import equal_holes, from_list, mounting
from balancing.plots.discs import disc, mounted_discs, seen_from

GRAMS = Labels(weight_unit="g", weight_scale=1e3)
AGAINST = Labels(weight_unit="g", weight_scale=1e3, angles="against rotation")
HOLES = from_list(equal_holes(8), [0.01, 0.04], taken=[0.02, *[0.0] * 7])
COUNTS = np.zeros((8, 2), dtype=int)
COUNTS[2, 0] = COUNTS[5, 1] = 1
MOUNTED = mounting(HOLES, COUNTS)


def axes():
    return Figure().add_subplot()


def texts(ax):
    return {t.get_text(): np.array(t.get_position()) for t in ax.texts}


def circles(ax, colour):
    """Centres and radii of the filled circles of one grey."""
    found = [p for p in ax.patches if isinstance(p, Circle)]
    grey = [p for p in found if p.get_fill() and np.isclose(p.get_facecolor()[0], colour)]
    return [(complex(*p.center), p.radius) for p in grey]


def test_weights_stand_in_their_holes_with_area_by_mass():
    ax = disc(axes(), "left", HOLES, MOUNTED, GRAMS, weight=0.03j)
    (small, r1), (large, r2) = circles(ax, 0.2)
    assert np.angle(small) == pytest.approx(np.pi / 2)
    assert np.angle(large) == pytest.approx(np.radians(225 - 360))
    assert (r2 / r1) ** 2 == pytest.approx(4)
    ((taken, r3),) = circles(ax, 0.85)
    assert np.angle(taken) == pytest.approx(0)
    assert (r3 / r2) ** 2 == pytest.approx(0.5)
    assert {str(k) for k in range(1, 9)} <= set(texts(ax))
    assert {"10 g", "40 g"} <= set(texts(ax))
    assert ax.get_title() == "left: add"


def test_removal_stands_opposite():
    ax = disc(axes(), "left", HOLES, MOUNTED, GRAMS, remove=True, weight=0.03j)
    weights = [c for c in circles(ax, 1.0) if c[1] > 0.051 and abs(c[0]) > 0.5]
    assert sorted(np.round(np.degrees([np.angle(c) for c, _ in weights]))) == [-90, 45]
    assert {"−10 g", "−40 g"} <= set(texts(ax))
    assert ax.get_title() == "left: take away"
    assert "like adding, wanted" in " ".join(texts(ax))


def test_angles_are_written_as_the_job_counts_them():
    same, mirrored = (texts(disc(axes(), "A", HOLES, MOUNTED, labels)) for labels in (GRAMS, AGAINST))
    np.testing.assert_allclose(same["60°"], mirrored["60°"] * [1, -1], atol=1e-12)
    assert same["60°"][1] > 0.9
    assert "90°" not in same, "a weight stands there, and its text"
    np.testing.assert_allclose(same["3"], mirrored["3"])
    other = replace(GRAMS, rotation="clockwise", view="free end")
    behind = texts(disc(axes(), "A", HOLES, MOUNTED, other))
    np.testing.assert_allclose(behind["3"], same["3"] * [1, -1], atol=1e-12)
    assert "turns clockwise" in seen_from(other)
    assert "counter-clockwise" in seen_from(AGAINST)
    assert "against the rotation" in seen_from(AGAINST)


def test_tolerance_is_a_circle_around_the_wanted_weight_in_its_scale():
    ax = disc(axes(), "A", HOLES, MOUNTED, GRAMS, weight=0.08j, tolerance=0.02)
    (ring,) = [p for p in ax.patches if isinstance(p, Circle) and not p.get_fill()]
    assert ring.center[0] == pytest.approx(0, abs=1e-12)
    assert ring.radius / ring.center[1] == pytest.approx(0.25)


def test_all_planes_side_by_side(tmp_path):
    correction = SimpleNamespace(
        planes=("left", "right", "fan", "coupling"),
        weights=np.array([0.03j, 0.02, -0.01, 0]),
        labels=AGAINST,
        limits=None,
        remove=("right",),
    )
    found = SimpleNamespace(mountings=(MOUNTED, None, None, None))
    fig = mounted_discs(SimpleNamespace(correction=correction, holes=(HOLES, None, None, None), found=found))
    titles = [ax.get_title() for ax in fig.axes]
    assert titles == ["left: add", "right: take away", "fan: add", "coupling: add"]
    assert "−20 g\n180.0°" in texts(fig.axes[1])
    assert fig.get_suptitle() == seen_from(AGAINST)
    fig.savefig(tmp_path / "discs.png", dpi=50)
    assert (tmp_path / "discs.png").stat().st_size > 5000
