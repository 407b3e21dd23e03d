"""Pictures of balancing: what is drawn is what the result says, with units and letters that can be read."""

from __future__ import annotations

import numpy as np
import pytest
from documents import check_hygiene

from rotorid.commands.balance import balance
from rotorid.samples import sample_data

TURBO = sample_data() / "turbo_job"


@pytest.fixture(scope="module")
def turbo():
    found = balance(TURBO / "job.toml")
    return found, found.figure()


@pytest.fixture(scope="module")
def checked():
    found = balance(TURBO / "checked.toml")
    return found, found.figure()


def named(ax, label):
    """The only line of this name."""
    [line] = [line for line in ax.lines if line.get_label() == label]
    return line


def test_corrections_before_and_after_have_one_legend_and_units_in_words(turbo):
    found, figure = turbo
    check_hygiene(figure)
    *_, before, closer = figure.axes
    assert before.get_ylabel() == "vibration,\nµm pp"
    # linear: what is left needs a scale of its own, and has it
    for ax in (before, closer):
        assert ax.get_yscale() == "linear"
        assert ax.get_ylim()[0] == 0
    assert closer.get_ylim()[1] < 0.1 * before.get_ylim()[1]
    result = found.result
    sizes = np.abs(result.before).ravel() * 2e6
    assert [bar.get_height() for bar in before.patches] == pytest.approx(sizes)
    for ax in (before, closer):
        dots = named(ax, "predicted, with 95 % of a check run")
        assert dots.get_ydata() == pytest.approx(np.abs(result.after).ravel() * 2e6)
        band = np.array(ax.collections[0].get_segments())[:, :, 1]
        reach = result.within.ravel()
        assert band[:, 1] == pytest.approx(dots.get_ydata() + reach)
        assert band[:, 0] == pytest.approx(np.maximum(dots.get_ydata() - reach, 0))
        assert band.max() < ax.get_ylim()[1], "the whole band is in the picture"


def test_a_checked_job_draws_what_is_mounted_the_trim_and_what_it_leaves(checked):
    found, figure = checked
    check_hygiene(figure)
    left, scale = found.left, found.result.labels.weight_scale
    for polar, weights in zip(figure.axes, (left.trim,), strict=False):
        ends = [line.get_xydata()[-1] for line in polar.lines if line.get_linewidth() == 2]
        assert [size * np.exp(1j * angle) for angle, size in ends] == pytest.approx(weights * scale)
    shown = {
        "predicted, with 95 % of a check run": found.check.predicted[-1],
        "achieved": found.check.achieved[-1],
        "predicted with the trim, with 95 %": left.after,
    }
    for ax in figure.axes[1:]:
        marks = [named(ax, label) for label in shown]
        for line, vectors in zip(marks, shown.values(), strict=True):
            assert line.get_ydata() == pytest.approx(np.abs(vectors).ravel() * 2e6)
        assert np.diff([line.get_xdata() for line in marks], axis=0).min() > 0.25, "one hides another"
    again = left.correction.influence
    assert left.after == pytest.approx(again.baseline + again.W @ (left.there + left.trim))
