"""Pictures of balancing: what is drawn is what the result says, with units and letters that can be read."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from documents import check_hygiene, legends_of

from balancing.plots.correction_polar import overview
from rotorid.samples import sample_data
from rotorid.workflows.balance import BalanceOptions, balance
from rotorid.workflows.split import SplitOptions, split
from rotorid.workflows.tolerance import ToleranceOptions, tolerance
from rotorid.workflows.trial_weight import trial_weight
from rotorid.workflows.unbalance import UnbalanceOptions, unbalance

TURBO, MODEL = sample_data() / "turbo_job", sample_data() / "model_job" / "job.toml"
RIGID = {
    "planes": "left,right",
    "grade": "G6.3",
    "rotor_mass": "558kg",
    "service_speed": "4500rpm",
    "positions": "left=600mm,right=2500mm",
    "bearings": "200mm,3000mm",
    "centre": "1500mm",
}


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


def by_face(ax, face):
    return [line for line in ax.lines if line.get_mfc() == face and len(line.get_xdata())]


def test_corrections_before_and_after_have_one_legend_and_units_in_words(turbo):
    found, figure = turbo
    check_hygiene(figure)
    weights, vectors, before, closer = figure.axes
    assert weights.get_title() == "Weights on the bare rotor, g·mm"
    assert vectors.get_title() == "probe 4 at 5400 rpm, µm pp\nphase as lead"
    assert before.get_ylabel() == "vibration, µm pp"
    [legend] = legends_of(figure)
    words = [text.get_text() for text in legend.get_texts()]
    assert words[:3] == [
        "left: 423.0 g·mm at 168.9°",
        "middle: 304.1 g·mm at 277.8°",
        "right: 448.1 g·mm at 11.7°",
    ]
    assert {"before", "predicted, with 95 % of a check run", "closed lines: 95 % regions"} <= set(words)
    assert figure.get_suptitle() == "Mount: rms 28.4 µm pp before, 0.314 µm pp predicted"
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
        reach = result.within(result.after_covariance)
        assert band[:, 1] == pytest.approx(dots.get_ydata() + reach)
        assert band[:, 0] == pytest.approx(np.maximum(dots.get_ydata() - reach, 0))
        assert band.max() < ax.get_ylim()[1], "the whole band is in the picture"


def test_trial_weights_and_their_readings_are_hollow(turbo):
    found, figure = turbo
    weights, vectors = figure.axes[:2]
    tried = by_face(weights, "none")
    assert [line.get_ydata()[0] for line in tried] == pytest.approx([800, 800, 800])
    assert [line.get_color() for line in tried] == [line.get_color() for line in weights.lines[:6:2]]
    assert [line.get_marker() for line in tried] == ["o", "s", "^"]
    trials, shown = found.job.trials, by_face(vectors, "none")
    assert len(shown) == 3
    for r, line in enumerate(shown, start=1):
        size, phase = trials.labels.vibration(trials.readings[0, r, 4, 3])
        assert line.get_ydata() == pytest.approx([59.7, size], rel=1e-3)
        assert np.degrees(line.get_xdata()[1]) % 360 == pytest.approx(phase)


@pytest.mark.full
def test_a_reading_that_may_grow_is_hollow_and_limits_are_drawn():
    found = balance(sample_data() / "left_in" / "job.toml", BalanceOptions(max_mass="4g", limit=("1.5",)))
    figure = found.figure()
    without = ("vibration", "probe 4 at 3600 rpm\nphase as lead")  # the readings of this job have no unit
    check_hygiene(figure, unitless=without)
    amplitudes = figure.axes[2]
    result = found.result
    reach = result.within(result.after_covariance)
    worse = (np.abs(result.after).ravel() * result.labels.vibration_scale + reach) >= np.abs(
        result.before
    ).ravel() * result.labels.vibration_scale
    assert worse.tolist() == [True, True, False, False]
    hollow = named(amplitudes, "perhaps no better than before")
    assert hollow.get_mfc() == "white"
    assert hollow.get_xdata() == pytest.approx([0, 1])
    assert len(named(amplitudes, "predicted, with 95 % of a check run").get_xdata()) == 2
    limits = next(c for c in amplitudes.collections if c.get_label() == "limit")
    assert np.array(limits.get_segments())[:, :, 1] == pytest.approx(np.full((4, 2), 1.5))
    assert len(figure.axes) == 3, "what is left is large enough to be read: no second scale"


def test_a_checked_job_draws_what_was_achieved(checked):
    found, figure = checked
    check_hygiene(figure)
    assert figure.get_suptitle() == (
        "As predicted: rms 28.4 µm pp before, 0.382 µm pp predicted, 0.413 µm pp achieved"
    )
    check = found.check
    for ax in figure.axes[2:]:
        stars = named(ax, "achieved")
        dots = named(ax, "predicted, with 95 % of a check run")
        assert stars.get_marker() == "*"
        assert stars.get_ydata() == pytest.approx(np.abs(check.achieved).ravel() * 2e6)
        assert dots.get_ydata() == pytest.approx(np.abs(check.predicted).ravel() * 2e6)
        assert (stars.get_xdata() - dots.get_xdata()).min() > 0.3, "one does not hide the other"


def test_speeds_stand_in_the_unit_of_the_job():
    found = balance(TURBO / "job.toml").result
    found = replace(found, labels=replace(found.labels, speed_unit="Hz"))
    figure = overview(found)
    assert figure.axes[1].get_title().startswith("probe 4 at 90 Hz")
    [upper] = figure.axes[2].child_axes
    assert upper.get_xlabel() == "speed, Hz"
    assert upper.get_xticklabels()[2].get_text() == "60"


@pytest.mark.full
def test_grade_shows_the_rotor_with_residuals_far_below_their_tolerance():
    found = balance(TURBO / "checked.toml", BalanceOptions(**RIGID))
    figure = found.figure()
    check_hygiene(figure)
    ax = figure.axes[2]
    assert ax.get_yscale() == "log"
    assert ax.get_ylabel() == "residual unbalance, g·mm (log scale)"
    assert [t.get_text() for t in ax.get_xticklabels()] == [
        "bearing A\n200 mm",
        "plane left\n600 mm",
        "plane right\n2500 mm",
        "bearing B\n3000 mm",
    ]
    rows = {f"{row.kind} {row.name}": row for row in found.verdict.rows}
    order = [rows[name] for name in ("bearing A", "plane left", "plane right", "bearing B")]
    assert [bar.get_height() for bar in ax.patches] == pytest.approx([row.limit * 1e6 for row in order])
    shown = [line for line in ax.lines if line.get_label() == "residual unbalance"]
    sizes = [line.get_ydata()[0] for line in shown]
    assert sizes == pytest.approx([row.size * 1e6 for row in order])
    assert min(sizes) < 0.001 * order[0].limit * 1e6
    low, high = ax.get_ylim()
    for size in sizes:
        assert np.log(size / low) > 0.05 * np.log(high / low), "well above the axis"
    assert [line.get_mfc() for line in shown] == [line.get_color() for line in shown]
    unknown = [t.get_text() for t in ax.texts if "pass" in t.get_text()]
    assert unknown[1].startswith("2.8 at 300°")


def test_an_undecided_residual_is_hollow():
    options = BalanceOptions(planes="left,right", grade="G1", rotor_mass="20kg", service_speed="9000rpm")
    found = balance(TURBO / "job.toml", options)
    words = [row.verdict for row in found.verdict.rows if row.kind == "plane"]
    assert "not decidable" in words
    figure = found.figure()
    check_hygiene(figure)
    drawn = [line for line in figure.axes[2].lines if line.get_label() == "residual unbalance"]
    for word, line in zip(words, drawn, strict=True):
        assert (line.get_mfc() == "white") == (word == "not decidable")
    # nothing is predicted to be left, so no angle is told, but how much it may be
    assert "up to 11\nnot decidable" in [text.get_text() for text in figure.axes[2].texts]


def test_permissible_unbalance_along_the_shaft():
    options = ToleranceOptions(
        mass="500kg",
        speed="3000rpm",
        grade="G2.5",
        planes="left=100mm,right=600mm",
        bearings="0mm,700mm",
        centre="320mm",
    )
    figure = tolerance(options).figure()
    check_hygiene(figure)
    [ax] = figure.axes
    assert [bar.get_height() for bar in ax.patches] == pytest.approx([2160, 2228, 1751, 1819], rel=1e-3)
    assert ax.get_title() == "G2.5, whole rotor: 3979 g·mm"
    alone = tolerance(ToleranceOptions(mass="500kg", speed="3000rpm", grade="G2.5")).figure()
    check_hygiene(alone)
    assert [t.get_text() for t in alone.axes[0].get_xticklabels()] == ["whole rotor"]


def test_trade_off_has_a_larger_scale_for_its_end():
    found = balance(TURBO / "job.toml", BalanceOptions(trade_off=True))
    figure = found.figure()
    check_hygiene(figure)
    upper, closer, lower = figure.axes
    assert lower.get_ylabel() == "weight, g·mm"
    assert upper.get_ylabel() == "vibration after, µm pp"
    last = found.curve.rms[-1] * 2e6
    assert last < 0.01 * upper.get_ylim()[1]
    assert last > 0.05 * closer.get_ylim()[1]
    for ax in (upper, closer):
        line = named(ax, "rms (made as small as possible)")
        assert line.get_ydata() == pytest.approx(found.curve.rms * 2e6)


def test_choices_of_planes_from_zero_on_a_linear_scale():
    found = balance(TURBO / "job.toml", BalanceOptions(best_planes=2))
    figure = found.figure()
    check_hygiene(figure)
    ax = figure.axes[2]
    assert [t.get_text() for t in ax.get_yticklabels()] == ["left, right", "middle, right", "left, middle"]
    assert ax.get_xlim()[0] == 0
    assert ax.get_xscale() == "linear"
    assert [bar.get_width() for bar in ax.patches] == pytest.approx(found.subsets.expected * 2e6)
    assert named(ax, "rms predicted").get_xdata() == pytest.approx(found.subsets.rms * 2e6)
    assert ax.get_xlabel() == "vibration, µm pp; before: rms 28.4"
    assert found.subsets.largest.max() * 2e6 < ax.get_xlim()[1] < 10, "what was before does not hide the rest"


def test_all_trial_weights_stand_in_one_picture():
    found = trial_weight(MODEL)
    figure = found.figure()
    check_hygiene(figure)
    [ax] = figure.axes
    for line, one in zip(ax.lines, found.weights, strict=True):
        size, angle = one.labels.weight(one.amount * np.exp(1j * one.angle))
        assert line.get_ydata()[1] == pytest.approx(float(size))
        assert np.degrees(line.get_xdata()[1]) == pytest.approx(float(angle))
        assert size < ax.get_rmax()
    assert len({line.get_marker() for line in ax.lines}) == 3


def test_unbalance_is_a_vector_at_each_station():
    found = unbalance(MODEL, UnbalanceOptions("6,12,19", model_error=2.0))
    figure = found.figure()
    check_hygiene(figure)
    [ax] = figure.axes
    assert ax.get_ylabel() == "unbalance, g·mm"
    assert ax.get_aspect() == 1
    tips = [line for line in ax.lines if line.get_marker() == "o"]
    for line, u in zip(tips, found.found.unbalance, strict=True):
        x, y = line.get_xdata(), line.get_ydata()
        assert complex(x[1] - x[0], y[1]) == pytest.approx(u * 1e6)
        assert line.get_mfc() == line.get_color()
    assert ax.get_xticklabels()[1].get_text() == "12\n300\n96°"
    edges = [line for line in ax.lines if line.get_color() == "black"]
    assert len(edges) == 3
    reach = np.abs(
        (edges[0].get_xdata() - tips[0].get_xdata()[1]) + 1j * (edges[0].get_ydata() - tips[0].get_ydata()[1])
    )
    std = found.found.std[0] * 1e6
    assert 1.5 * std < reach.min() <= reach.max() < 3.5 * std


def test_unbalance_that_is_not_determined_is_hollow():
    found = unbalance(MODEL, UnbalanceOptions("6,9,12,15,18", method="modal", modes=2))
    figure = found.figure()
    check_hygiene(figure)
    tips = [line for line in figure.axes[0].lines if line.get_marker() == "o"]
    assert [line.get_mfc() for line in tips] == ["white"] * 5
    assert {line.get_linestyle() for line in tips} == {":"}
    assert not [line for line in figure.axes[0].lines if line.get_color() == "black"]


def test_drilled_holes_have_their_depth_and_the_grams_of_the_console():
    found = split("35g@120", SplitOptions(drill="8mm", depth="20mm", radius="100mm"))
    figure = found.figure()
    check_hygiene(figure)
    texts = [text.get_text() for text in figure.axes[0].texts]
    assert "5 × −7.892 g\n19.20 mm deep" in texts
    assert "each takes away 7.892 g" in found.summary()
    assert "full diameter 19.20 mm deep" in found.summary()


def test_holes_have_their_pieces_as_on_the_console():
    found = split("35g@120", SplitOptions(holes=24, pieces="10g,20g", taken="3:10g", per_hole=2))
    figure = found.figure()
    check_hygiene(figure)
    texts = [text.get_text() for text in figure.axes[0].texts]
    console = [[(one["count"], one["mass"]) for one in row["pieces"]] for row in found.to_dict()["holes"]]
    words = [" + ".join(f"{n} × {m:g}" if n > 1 else f"{m:g}" for n, m in row) + " g" for row in console]
    assert words
    assert sorted(text for text in texts if text[-2:] == " g" and "\n" not in text) == sorted(words)
    assert {str(k) for k in range(1, 25)} <= set(texts)


@pytest.mark.full
def test_of_many_holes_those_that_are_used_have_their_numbers():
    figure = split("35g@10.5", SplitOptions(holes=48, pieces="35g", first_hole=3.0)).figure()
    check_hygiene(figure)
    numbers = {text.get_text() for text in figure.axes[0].texts} & {str(k) for k in range(1, 49)}
    assert numbers == {"2"} | {str(k) for k in range(1, 49, 2)}


@pytest.mark.full
def test_forbidden_arcs_are_hatched_where_the_job_counts_them(tmp_path):
    from matplotlib.patches import Wedge

    for name in ("runs.csv", "weights.csv"):
        (tmp_path / name).write_text((TURBO / name).read_text())
    text = (
        (TURBO / "holes.toml")
        .read_text()
        .replace("[planes.left]", "[planes.left]\nforbidden_deg = [[20, 70]]")
    )
    turned = 'angles = "against rotation"\nrotation = "clockwise"\nview = "drive end"'
    for words in ('angles = "with rotation"', turned):  # drawn clockwise, and counted against it: the same
        (tmp_path / "job.toml").write_text(text.replace('angles = "with rotation"', words))
        figure = balance(tmp_path / "job.toml", BalanceOptions(split=True)).figure()
        check_hygiene(figure)
        [wedge] = [patch for patch in figure.axes[0].patches if isinstance(patch, Wedge)]
        assert (wedge.theta1 % 360, wedge.theta2 % 360) == pytest.approx((20, 70))
        assert wedge.get_hatch()
        assert any("hatched arcs" in t.get_text() for t in figure.axes[0].texts)
        assert not [patch for patch in figure.axes[1].patches if isinstance(patch, Wedge)]


def test_material_removed_is_named_at_the_place_to_work_on_and_long_names_are_cut(turbo):
    c = turbo[0].result
    planes = ("a name that is far too long for the legend of a picture", *c.planes[1:])
    gone = replace(c, planes=planes, remove=(planes[0],))
    labels = [line.get_label() for line in overview(gone).axes[0].lines]
    assert "a name that is far too …: 423.0 g·mm at 168.9°, or remove at 348.9°" in labels
    assert sum("remove" in label for label in labels) == 1
