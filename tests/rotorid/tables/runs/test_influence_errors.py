"""Stored coefficients keep what is known of their errors."""

from dataclasses import replace

import numpy as np
import pytest
from balancing_data import GRAM, complex_normal, synthetic
from tables_data import complaints, replaced, the_only, write_csv

import fem
from balancing import (
    Gaussian,
    Labels,
    Reading,
    ReadingErrors,
    RunScatter,
    Trials,
    correct,
    estimate_influence,
    model_influence,
    with_parameters,
)
from rotorid.regression import stretch
from rotorid.tables import (
    influence_frame,
    job_from_files,
    read_influence,
    write_influence,
    write_table,
)
from rotorid.tables.runs.influence_comments import error_comments
from rotorid.tables.runs.influence_errors import BASELINE

ERRORS = ReadingErrors(amplitude=0.03, phase=np.radians(2.0), floor=1e-7)
LABELS = Labels("um_pp", 2e6, "g", 1e3)


def trials(labels=LABELS, errors=ERRORS, **options):
    return synthetic(np.random.default_rng(5), labels=labels, errors=errors, **options)[0]


def round_trip(path, influence, **options):
    write_influence(path, influence)
    return read_influence(path, **options)


@pytest.mark.parametrize("suffix", [".csv", ".xlsx"])
@pytest.mark.parametrize("phase", ["lead", "lag"])
@pytest.mark.parametrize("weight", [("g", 1e3), ("g_mm", 1e6)])
def test_covariance_and_errors_come_back(tmp_path, suffix, phase, weight):
    labels = replace(LABELS, phase=phase, weight_unit=weight[0], weight_scale=weight[1])
    influence = estimate_influence(trials(labels))
    again = round_trip(tmp_path / f"influence{suffix}", influence)
    std = np.sqrt(np.einsum("scii->sci", influence.channels()))
    scale = std[..., None] * std[..., None, :]
    np.testing.assert_allclose(again.channels() / scale, influence.channels() / scale, atol=4e-15)
    np.testing.assert_allclose(again.baseline, influence.baseline, rtol=1e-14)
    np.testing.assert_allclose(again.W, influence.W, rtol=1e-14)
    assert (again.reading.source, again.labels) == ("stated", labels)
    errors = again.reading.errors
    np.testing.assert_allclose(
        [errors.amplitude, errors.phase, errors.floor], [0.03, np.radians(2.0), 1e-7], rtol=1e-15
    )


def test_phases_that_lag_turn_the_covariance_too(tmp_path):
    influence = estimate_influence(trials())
    path = tmp_path / "influence.csv"
    write_influence(path, influence)
    path.write_text(path.read_text().replace("# phase = lead\n", ""))
    again = read_influence(path, phase="lag")
    np.testing.assert_allclose(again.W, influence.W.conj(), rtol=1e-14)
    flip = np.diag([1.0, -1.0, 1.0, -1.0])
    expected = flip @ influence.channels()[..., 2:, 2:] @ flip
    np.testing.assert_allclose(
        again.channels()[..., 2:, 2:], expected, rtol=1e-9, atol=1e-14 * abs(expected).max()
    )


def test_degrees_of_freedom_and_source(tmp_path):
    rng = np.random.default_rng(3)
    made = trials(errors=None)
    noisy = made.mean * (1 + 0.02 * rng.standard_normal((3, *made.mean.shape)))
    influence = estimate_influence(replace(made, readings=noisy))
    assert influence.reading.source == "repeats"
    again = round_trip(tmp_path / "influence.csv", influence)
    assert again.reading[1::2] == influence.reading[1::2]
    assert again.reading.errors.amplitude == pytest.approx(influence.reading.errors.amplitude, rel=1e-15)


def baseline_of(made):
    return Trials(
        made.runs[:1],
        made.speeds,
        made.sensors,
        (),
        made.mean[:1],
        np.zeros((1, 0)),
        made.errors,
        made.labels,
    )


def test_stored_errors_of_a_reading_are_those_of_a_run_that_states_none(tmp_path):
    made = trials()
    influence = estimate_influence(made)
    bare = replace(baseline_of(made), errors=None)
    stored = correct(round_trip(tmp_path / "influence.csv", influence), bare)
    assert stored.influence.reading.errors.amplitude == pytest.approx(0.03, rel=1e-15)
    assert stored.influence.reading.source == "stated"
    expected = correct(influence, baseline_of(made))
    np.testing.assert_allclose(stored.mass_std, expected.mass_std, rtol=0.25)  # drawn otherwise


def test_a_model_keeps_its_error(tmp_path):
    supports = (fem.Support(1, 1e7, 1e4), fem.Support(5, 1e7, 1e4))
    rotor = fem.Rotor(np.full(4, 0.25), 0.05, supports=supports)
    model = model_influence(
        rotor, {"A": 2, "B": 4}, {"x": 1, "y": (5, 90.0)}, [100.0, 300.0], relative_error=0.1
    )
    again = round_trip(tmp_path / "influence.csv", model)
    np.testing.assert_allclose(again.channels(), model.channels(), rtol=1e-14)
    assert (again.reading, again.labels) == (Reading(), model.labels)
    model = with_parameters(model, 0.2j * model.W[None], 0.1)
    again = round_trip(tmp_path / "influence.csv", model)
    covariance = model.channels()
    np.testing.assert_allclose(again.channels(), covariance, rtol=1e-12, atol=1e-14 * covariance.max())
    assert_same_columns(again, model)


def assert_same_columns(one, other):
    """As covariances of all readings together; the columns themselves may be turned."""
    F, G = (stretch(each.columns().reshape(len(each.columns()), -1, 1))[..., 0] for each in (one, other))
    np.testing.assert_allclose(F.T @ F, G.T @ G, atol=1e-12 * np.abs(G.T @ G).max())


@pytest.mark.parametrize("phase", ["lead", "lag"])
@pytest.mark.parametrize("job", ["stated", "estimated", "assumed"])
def test_storing_keeps_everything_that_is_known_of_errors(tmp_path, phase, job):
    made, W, Y0 = synthetic(
        np.random.default_rng(6), labels=replace(LABELS, phase=phase), errors=ERRORS, sensors=2, speeds=2
    )
    rng = np.random.default_rng(7)
    if job != "assumed":
        T = np.vstack((made.weights, made.weights))
        Y = (Y0 + np.einsum("scp,rp->rsc", W, T)) * (1 + 0.03 * complex_normal(rng, (len(T), 1, 1)))
        Y *= 1 + 0.01 * complex_normal(rng, (len(T), 2, 2))
        made = replace(made, runs=tuple("abcdefgh"[: len(T)]), weights=T, readings=Y)
    influence = estimate_influence(made if job == "stated" else replace(made, errors=None))
    again = round_trip(tmp_path / "influence.csv", influence)
    old, new = influence.run_errors, again.run_errors
    kept = old.probability > 1e-4
    np.testing.assert_allclose(new.sizes, old.sizes[kept], rtol=1e-5)
    np.testing.assert_allclose(new.probability, old.probability[kept], rtol=1e-2)
    assert (new.origin, new.evenly) == (old.origin, old.evenly)
    assert new.level == pytest.approx(old.level, rel=1e-14)
    assert (again.reading.source, again.reading.dof) == (influence.reading.source, influence.reading.dof)
    assert_same_columns(again, influence)
    stored, whole = correct(again), correct(influence)
    np.testing.assert_allclose(stored.weights, whole.weights, rtol=1e-7)
    # the same sizes of errors, drawn otherwise
    np.testing.assert_allclose(stored.mass_std, whole.mass_std, rtol=0.25)
    assert stored.check_rms == pytest.approx(whole.check_rms, rel=0.1)
    # the same reading read again, from a table of one run
    bare = replace(baseline_of(made), readings=influence.baseline[None], errors=None)
    later = correct(again, bare)
    np.testing.assert_allclose(later.draws, stored.draws, rtol=1e-6, atol=1e-9 * abs(stored.draws).max())
    # another one has errors of its own
    other = correct(again, replace(bare, readings=bare.readings * (1 + 1e-6)))
    assert abs(other.draws - stored.draws).max() > 1e-3 * abs(stored.draws).max()


def test_what_a_person_may_delete(tmp_path):
    influence = estimate_influence(trials())
    influence = estimate_influence(replace(trials(), run_errors=RunScatter(0.02)))
    frame = influence_frame(influence)
    said = [
        f"# {line}"
        for line in error_comments(influence, influence.labels)
        if not line.startswith("errors.runs")
    ]
    cut = frame[[name for name in frame if not name.startswith("common_")]]
    for name, left in {
        "columns": cut,
        "rows": frame[frame.plane != BASELINE],
        "both": cut[cut.plane != BASELINE],
        "all": frame[list(frame)[:5]][frame.plane != BASELINE],
    }.items():
        path = tmp_path / f"{name}.csv"
        write_table(path, left)
        path.write_text("\n".join(said) + "\n" + path.read_text())
        again = read_influence(path)
        np.testing.assert_allclose(again.W, influence.W, rtol=1e-14)
        assert again.has_baseline == (name == "columns")
        assert again.known_errors == (name != "all")
        assert correct(again, baseline_of(trials())).weights.shape == (2,)


def test_job_with_sensors_in_another_order(tmp_path):
    made = trials()
    influence = estimate_influence(made)
    write_influence(tmp_path / "influence.csv", influence)
    lines = [["run", "speed_rad_s", "sensor", "amplitude_um_pp", "phase_deg"]]
    for c in (3, 1):
        size, phase = LABELS.vibration(made.mean[0, 1, c])
        lines.append(["now", 200.4, f"s{c}", float(size), float(phase)])
    write_csv(tmp_path / "now.csv", lines)
    job = job_from_files([tmp_path / "now.csv"], influence=tmp_path / "influence.csv")
    assert job.influence.sensors == job.trials.sensors == ("s3", "s1")
    np.testing.assert_array_equal(job.influence.speeds, job.trials.speeds)
    np.testing.assert_allclose(job.influence.W, influence.W[1:2, [3, 1]], rtol=1e-9)
    expected = influence.channels()[1][[3, 1]][None, ..., 2:, 2:]
    np.testing.assert_allclose(
        job.influence.channels()[..., 2:, 2:], expected, rtol=1e-9, atol=1e-12 * abs(expected).max()
    )


def test_without_errors_nothing_is_added(tmp_path):
    known = estimate_influence(trials())
    nothing = np.full(known.baseline.shape, np.nan)
    influence = replace(known, baseline=nothing, errors=Gaussian.none(*known.W.shape))
    assert list(influence_frame(influence).columns) == [
        "speed_rad_s",
        "sensor",
        "plane",
        "influence_um_pp_per_g",
        "phase_deg",
    ]
    again = round_trip(tmp_path / "influence.csv", influence)
    assert (again.known_errors, again.reading) == (False, Reading())
    assert "error" not in (tmp_path / "influence.csv").read_text()


def test_exact_zero_reading_has_no_correlations(tmp_path):
    made = synthetic(np.random.default_rng(5), sensors=2, speeds=1, labels=LABELS)[0]
    readings = made.readings.copy()
    readings[..., 1] = 0.0
    influence = estimate_influence(replace(made, readings=readings, errors=ReadingErrors(0.02, 0.02)))
    again = round_trip(tmp_path / "influence.csv", influence)
    assert not again.channels()[0, 1].any()
    assert again.channels()[0, 0].any()


def test_notes_are_written_and_mean_nothing(tmp_path):
    influence = estimate_influence(trials())
    path = tmp_path / "influence.csv"
    write_influence(path, influence, notes=["machine: feed pump 3", "from 5 runs"])
    assert "# machine: feed pump 3\n# from 5 runs\n" in path.read_text()
    assert read_influence(path).reading.errors is not None
    for note in ("phase = lag", "errors: none to speak of", "the phases lag"):
        with pytest.raises(ValueError, match="would be read as a statement"):
            write_influence(path, influence, notes=[note])


def without_baseline(influence):
    return replace(influence, baseline=np.full(influence.baseline.shape, np.nan))


@pytest.fixture
def table(tmp_path):
    """A stored table of one reading as a list of lines, and a reader."""
    made, _, _ = synthetic(
        np.random.default_rng(1), sensors=1, speeds=1, weights=np.vstack((np.zeros(2), np.eye(2))) * GRAM
    )
    made = replace(made, labels=LABELS, errors=ReadingErrors(0.03, 0.02))
    frame = influence_frame(without_baseline(estimate_influence(made)))
    lines = [list(frame.columns), *frame.to_numpy(dtype=object).tolist()]

    def read(changed=lines, comments=()):
        path = write_csv(tmp_path / "influence.csv", changed)
        path.write_text("".join(f"# {c}\n" for c in comments) + path.read_text())
        return read_influence(path)

    return lines, read


BAD_CELLS = [
    ("std_re_um_pp_per_g", -1.0, "a standard deviation of 0 or more"),
    ("std_im_um_pp_per_g", "nan", "a finite number"),
    ("std_im_um_pp_per_g", "", "a number"),
    ("correlation_re_im_B", 1.5, "a correlation from -1 to 1"),
    ("correlation_re_re_A", 0.5, "1, the correlation of a number with itself"),
]


@pytest.mark.parametrize(("column", "value", "words"), BAD_CELLS)
def test_bad_cells(table, column, value, words):
    lines, read = table
    the_only(
        complaints(read, replaced(lines, 2, column, value)), "influence.csv", 2, column, str(value), words
    )


def test_correlations_that_are_not_symmetric(table):
    lines, read = table
    problem = complaints(read, replaced(lines, 3, "correlation_im_re_A", 0.125))
    place = "the same correlation as in row 2, column correlation_re_im_B: "
    the_only(problem, "influence.csv", 3, "correlation_im_re_A", "0.125", place)


def test_correlations_that_cannot_stand_together(table):
    lines, read = table
    for (row, a, plane), value in {
        (2, "re", "B"): 0.9,
        (2, "im", "B"): 0.9,
        (3, "re", "A"): 0.9,
        (3, "im", "A"): 0.9,
    }.items():
        for b in ("re", "im"):
            sign = -1 if (a, b) == ("im", "im") else 1
            lines = replaced(lines, row, f"correlation_{a}_{b}_{plane}", sign * value)
    problems = complaints(read, lines)
    the_only(problems, "influence.csv", 2, "correlation_re_re_B", "0.9", "are no covariance")


def test_wrong_unit_and_missing_column(table):
    lines, read = table
    words = "the unit of the coefficients, um_pp_per_g, not um_per_g"
    name = "std_re_um_per_g"
    problem = complaints(read, replaced(lines, 1, "std_re_um_pp_per_g", name))
    the_only(problem, "influence.csv", 1, name, name, words)
    at = lines[0].index("correlation_re_im_B")
    problem = complaints(read, [line[:at] + line[at + 1 :] for line in lines])
    the_only(problem, "influence.csv", 1, "correlation_re_im_B", None, "a column correlation_re_im_B")


BAD_COMMENTS = [
    ("Errors: phase_deg: 2", "# errors.KEY = VALUE with one of the keys"),
    ("errors: two percent", "# errors.KEY = VALUE with one of the keys"),
    ("errors.phase = 2", "did you mean 'phase_deg'?"),
    ("errors.phase_deg = two", "a number"),
    ("errors.floor = -1", "a number of 0 or more"),
    ("errors.reading_degrees_of_freedom = 0", "a number above 0"),
    ("errors.run_percent = 1 2", "a number"),
    ('errors.runs = {"source": "stated"}', "JSON with source, level, evenly"),
    (
        'errors.runs = {"source": "stated", "level": 1, "evenly": 0, "own_percent": [1], '
        '"common_percent": [1], "weights_percent": [1], '
        '"unbalance_percent": [-1], "probability": [1]}',
        "of 0 or more",
    ),
    ("errors.source = guessed", "one of 'stated', 'repeats'"),
    ("errors.source = repeats", "an error of a reading above 0 with it"),
]


@pytest.mark.parametrize(("comment", "words"), BAD_COMMENTS)
def test_bad_comments_are_named_with_their_row(table, comment, words):
    lines, read = table
    the_only(
        complaints(read, lines, ["phase = lead", comment]), "influence.csv", 2, None, f"# {comment}", words
    )


def test_a_comment_twice(table):
    lines, read = table
    problems = complaints(read, lines, ["errors.floor = 1", "errors.floor = 2"])
    the_only(problems, "influence.csv", 2, None, "# errors.floor = 2", "errors.floor once")


def test_written_by_hand(table):
    lines, read = table
    said = read(lines, ["errors.amplitude_percent = 3", "errors.phase_deg = 2", "errors.floor = 4"])
    assert said.reading == Reading(ReadingErrors(0.03, np.radians(2.0), 2e-6), "stated")
    said = read(
        lines,
        ["errors.amplitude_percent = 3", "errors.run_percent = 2", "errors.reading_degrees_of_freedom = 9"],
    )
    np.testing.assert_allclose(said.run_errors.sizes, [[0.02 / 2**0.5, 0.02 / 2**0.5, 0, 0]])
    assert (said.run_errors.origin, said.reading.dof) == ("stated", 9)
