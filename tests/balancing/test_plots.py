"""Pictures: what is drawn stands where it is mounted, as large as it is; angles run as stated."""

from dataclasses import replace

import numpy as np
import pytest
from balancing_data import bruel_kjaer, limits_by_name, synthetic
from documents import check_hygiene
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from balancing import Labels, ReadingErrors, correct, estimate_influence, trial_from_force
from balancing.holes import equal_holes, from_list, mounting
from balancing.plots import (
    correction_figure,
    draw_disc,
    trial_figure,
)

GRAMS = Labels(weight_unit="g", weight_scale=1e3)
AGAINST = replace(GRAMS, angles="against rotation")
HOLES = from_list(equal_holes(8), [0.01, 0.04], taken=[0.02, *[0.0] * 7])
COUNTS = np.zeros((8, 2), dtype=int)
COUNTS[2, 0] = COUNTS[5, 1] = 1
MOUNTED = mounting(HOLES, COUNTS, HOLES.pieces)


def disc(*of, **options):
    return draw_disc(Figure().add_subplot(), "A", *of, **options)


def texts(ax):
    return {t.get_text(): complex(*t.get_position()) for t in ax.texts}


def circles(ax, colour):
    """Centres and radii of the filled circles of one grey."""
    drawn = [p for p in ax.patches if isinstance(p, Circle) and p.get_fill()]
    grey = [p for p in drawn if np.isclose(p.get_facecolor()[0], colour)]
    return [(complex(*p.center), p.radius) for p in grey]


def test_weights_stand_in_their_holes_with_area_by_mass():
    ax = disc(HOLES, MOUNTED, GRAMS, weight=0.03j)
    (small, r1), (large, r2) = circles(ax, 0.2)
    assert np.degrees(np.angle([small, large])) == pytest.approx([90, -135])
    assert (r2 / r1) ** 2 == pytest.approx(4)
    ((taken, r3),) = circles(ax, 0.85)
    assert np.angle(taken) == pytest.approx(0)
    assert (r3 / r2) ** 2 == pytest.approx(0.5)
    assert {*"12345678", "3: 10", "6: 40"} <= set(texts(ax))
    assert ax.get_title() == "A: add, g"


def test_angles_are_written_as_the_job_counts_them():
    same, mirrored = (texts(disc(HOLES, MOUNTED, labels)) for labels in (GRAMS, AGAINST))
    assert same["60°"] == pytest.approx(np.conj(mirrored["60°"]))
    assert same["60°"].imag > 0.9
    assert "90°" not in same, "a weight stands there, and its text"
    assert same["3"] == pytest.approx(mirrored["3"])
    behind = texts(disc(HOLES, MOUNTED, replace(GRAMS, rotation="clockwise", view="free end")))
    assert behind["3"] == pytest.approx(np.conj(same["3"]))
    turns = [text.split()[0] for text in (*same, *behind) if "rotation" in text]
    assert sorted(turns) == ["↺", "↻"]


@pytest.mark.parametrize(("angles", "direction"), [("with rotation", 1), ("against rotation", -1)])
def test_angles_of_the_weights_run_as_the_job_counts_them(angles, direction):
    labels = Labels("um_pp", 1e6, "g", 1e3, "lag", angles)
    figure = correction_figure(correct(estimate_influence(bruel_kjaer(labels=labels))))
    assert figure.axes[0].get_theta_direction() == direction


def test_limits_arcs_and_many_readings():
    rng = np.random.default_rng(2)
    trials, _, _ = synthetic(rng, planes=3, sensors=9, speeds=14, errors=ReadingErrors(0.02, 0.02))
    influence = estimate_influence(trials)
    limits = limits_by_name(influence, max_weight={"A": 1e3}, forbidden={"B": [(0.5, 1.0)]})
    figure = correction_figure(correct(influence, limits=limits))
    names = {text.get_text() for text in figure.legends[0].get_texts()}
    assert {"dashed circles: largest weights", "thick arcs: nothing can be mounted"} < names
    [arc] = [line for line in figure.axes[0].lines if line.get_linewidth() == 5 and len(line.get_xdata())]
    assert np.ptp(arc.get_xdata()) == pytest.approx(1.0)


def test_trial_weights():
    weight = trial_from_force("A", 300.0, 0.2, 1e4, labels=GRAMS)
    figure = trial_figure([replace(weight, angle=angle, angle_reach=0.5) for angle in (0.3, 2.0)])
    check_hygiene(figure)
    tips = [line for line in figure.axes[0].lines if line.get_marker() in ("o", "s")]
    assert [line.get_xdata()[-1] for line in tips] == pytest.approx([0.3, 2.0])
