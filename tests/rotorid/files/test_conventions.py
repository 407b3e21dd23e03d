"""How a job says in which direction its angles count, and from which end the rotor is seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tables_data import RUNS, WEIGHTS, complaints, the_only, write_csv

from balancing import Labels, correct, estimate_influence
from balancing.conventions import opposite
from rotorid.files import job_from_files, read_influence, read_job, write_influence
from rotorid.files.conventions import STATED_ANGLES, resolve_angles

TABLES = 'runs = "runs.csv"\nweights = "weights.csv"\n'
CLOCKWISE = 'rotation = "clockwise"\nview = "drive end"\n'


@pytest.fixture
def folder(tmp_path):
    write_csv(tmp_path / "runs.csv", RUNS)
    write_csv(tmp_path / "weights.csv", [WEIGHTS[0], *([*line[:3], 50] for line in WEIGHTS[1:])])
    return tmp_path


@pytest.fixture
def job(folder):
    def read(text, **options):
        (folder / "job.toml").write_text(text + TABLES, encoding="utf-8")
        return read_job(folder / "job.toml", **options)

    return read


SAID = [
    ('angles = "clockwise"\nrotation = "clockwise"\n', 1),
    ('angles = "clockwise"\nrotation = "counter-clockwise"\n', -1),
    ('angles = "counter-clockwise"\nrotation = "counter-clockwise"\nview = "free end"\n', 1),
    ('angles = "counter-clockwise"\nrotation = "clockwise"\n', -1),
    ('angles = "against rotation"\n' + CLOCKWISE, -1),
    (CLOCKWISE, 1),
]


@pytest.mark.parametrize(("text", "sign"), SAID)
def test_clockwise_is_with_or_against_the_rotation(job, text, sign):
    read = job(text)
    assert read.conventions.labels.angle_sign == read.trials.labels.angle_sign == sign
    mounted = read.trials.weights[1, 0]
    assert mounted == pytest.approx(2.5e-3 * np.exp(1j * np.radians(sign * 50)), rel=1e-12)
    mass, angle = read.trials.labels.weight(mounted)
    assert (float(mass), float(angle)) == pytest.approx((2.5, 50), rel=1e-12)


def test_errors_of_weights_and_drift(job):
    errors = "{ placement_deg = 3, placement_percent = 2, drift_percent = 1, run_percent = 4 }"
    trials = job(f"errors = {errors}\n").trials
    assert trials.placement == pytest.approx((0.02, np.radians(3)))
    assert (trials.drift, trials.run_errors, trials.errors) == (0.01, (0.04, 0.0), None)


def test_the_output_says_what_the_input_said(job):
    labels = job('angles = "clockwise"\nrotation = "counter-clockwise"\nview = "free end"\n').trials.labels
    assert labels.conventions() == {
        "phase": "lead",
        "angles": "clockwise",
        "vibration_unit": "um_pp",
        "weight_unit": "g",
        "assumed": ["phase"],
        "rotation": "counter-clockwise",
        "view": "free end",
    }
    plain = job("").trials.labels.conventions()
    assert (plain["angles"], "rotation" in plain, "view" in plain) == ("with rotation", False, False)


def test_another_word_instead_of_that_of_the_job(job):
    read = job('angles = "clockwise"\n' + CLOCKWISE, angles="against rotation")
    assert (read.conventions.labels.angle_sign, read.trials.labels.angle_words) == (-1, "against rotation")
    read = job(CLOCKWISE, angles="counter-clockwise")
    assert (read.conventions.labels.angle_sign, read.trials.labels.angle_words) == (-1, "counter-clockwise")
    with pytest.raises(ValueError, match="angles that count clockwise need the direction of rotation"):
        job("", angles="clockwise")


BAD = [
    ('angles = "clockwise"\n', "rotation", None, "how the rotor turns"),
    ('view = "free end"\n', "rotation", None, "how the rotor turns"),
    ('angles = "clockwize"\n' + CLOCKWISE, "angles", "clockwize", "did you mean 'clockwise'?"),
    ('rotation = "with"\n', "rotation", "with", "'clockwise' or 'counter-clockwise'"),
    ('angles = "clockwise"\nrotation = 3\n', "rotation", "3", "'clockwise' or 'counter-clockwise'"),
    ('rotation = "clockwise"\nview = "left"\n', "view", "left", "'drive end' or 'free end'"),
]


@pytest.mark.parametrize(("text", "key", "value", "words"), BAD)
def test_what_cannot_be_understood(job, text, key, value, words):
    the_only(complaints(job, text), "job.toml", None, key, value, words)


BAD_MARKS = [
    ("[key_phasor]\n", "key_phasor.angle_deg", None, "the direction of the key phasor"),
    ("[key_phasor]\nangle_deg = 361\n", "key_phasor.angle_deg", "361", "a number up to 360"),
    ('[key_phasor]\nangle_deg = "x"\n', "key_phasor.angle_deg", "x", "a number"),
    ("[key_phasor]\nangle_deg = 3\nspeed = 2\n", "key_phasor.speed", "2", "a known key"),
]


@pytest.mark.parametrize(("text", "key", "value", "words"), BAD_MARKS)
def test_bad_key_phasors(folder, text, key, value, words):
    (folder / "job.toml").write_text(TABLES + text, encoding="utf-8")
    the_only(complaints(read_job, folder / "job.toml"), "job.toml", None, key, value, words)


def test_the_key_phasor_counts_as_the_angles_do(folder):
    for words, expected in (("", 40.0), ('angles = "against rotation"\n', -40.0)):
        (folder / "job.toml").write_text(words + TABLES + "[key_phasor]\nangle_deg = 40\n", encoding="utf-8")
        assert read_job(folder / "job.toml").key_phasor == expected
    (folder / "job.toml").write_text(TABLES, encoding="utf-8")
    assert read_job(folder / "job.toml").key_phasor == 0.0


def test_stored_coefficients_know_nothing_of_clocks(job, folder):
    influence = estimate_influence(job('angles = "counter-clockwise"\n' + CLOCKWISE).trials)
    write_influence(folder / "influence.json", influence)
    np.testing.assert_allclose(read_influence(folder / "influence.json").W, influence.W, rtol=1e-9)
    now = CLOCKWISE + 'angles = "counter-clockwise"\nruns = "runs.csv"\ninfluence = "influence.json"\n'
    (folder / "now.toml").write_text(now, encoding="utf-8")
    write_csv(folder / "runs.csv", RUNS[:3])
    found = read_job(folder / "now.toml")
    assert found.trials.labels == found.influence.labels
    assert found.trials.labels.angle_words == "counter-clockwise"
    np.testing.assert_allclose(
        correct(found.influence, found.trials).weights, correct(influence).weights, rtol=1e-9
    )


def test_files_without_a_job_cannot_say_how_the_rotor_turns(folder):
    files = [folder / "runs.csv", folder / "weights.csv"]
    with pytest.raises(ValueError, match="angles that count clockwise need the direction of rotation"):
        job_from_files(files, angles="clockwise")
    assert job_from_files(files, angles="against rotation").conventions.labels.angle_sign == -1


def test_words():
    for rotation in ("clockwise", "counter-clockwise"):
        assert resolve_angles(rotation, rotation) == "with rotation"
        assert {resolve_angles(word, rotation) for word in STATED_ANGLES[:2]} == set(STATED_ANGLES[:2])
    assert resolve_angles("clockwise", "counter-clockwise") == "against rotation"
    with pytest.raises(ValueError, match="'clockwise' or 'counter-clockwise', not 'left'"):
        resolve_angles("left", None)
    for bad in (
        {"phase": "late"},
        {"angles": "clockwise"},
        {"rotation": "left"},
        {"view": "free end"},
        {"clock": True},
    ):
        with pytest.raises(ValueError):
            Labels(**bad)


@pytest.mark.parametrize("rotation", ["clockwise", "counter-clockwise"])
@pytest.mark.parametrize("angles", ["with rotation", "against rotation"])
def test_seen_from_the_other_end(angles, rotation):
    """The picture is mirrored, the words turn round, and every number stays."""
    ours = Labels(angles=angles, rotation=rotation, view="drive end", clock=True)
    theirs = replace(ours, view="free end", rotation=opposite(rotation))
    assert theirs.rotation != ours.rotation
    assert theirs.angle_words != ours.angle_words
    assert theirs.angle_sign == ours.angle_sign
    weight = 3e-3 * np.exp(0.4j)
    assert theirs.weight(weight) == ours.weight(weight)
    # on the paper: what stands at angle a counter-clockwise stands, from behind, at −a
    np.testing.assert_array_equal(theirs.drawn([0.0, 0.4, 2.0]), -ours.drawn([0.0, 0.4, 2.0]))
    # an angle that the labels call counter-clockwise is drawn counter-clockwise
    for labels in (ours, theirs):
        _, shown = labels.weight(weight)
        turn = 1 if labels.angle_words == "counter-clockwise" else -1
        drawn = np.exp(1j * labels.drawn(np.angle(weight)))
        assert drawn == pytest.approx(np.exp(1j * turn * np.radians(shown)), rel=1e-12)
