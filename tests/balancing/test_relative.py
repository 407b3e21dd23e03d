"""Unknown trial weights: what publications print, what is kept of a known one, and what is refused."""

import numpy as np
import pytest

from rotorid.commands.balance import BalanceOptions, balance
from rotorid.samples import sample_data

LEAST_SQUARES = BalanceOptions(method="least-squares")
PRINTED = {
    # Brüel & Kjær 17-227, one plane: 2 g, then 2.012 g at 329.2°
    ("3.4@116", "1.8@42"): (2.012 / 2, 329.2 - 360, 5e-4),
    # Acoem, a vector approach to single plane balancing: 35°; 9 was drawn for 8.6
    ("7@160", "5@70"): (7 / 8.6, -35.5, 1e-3),
    # Rotating Machinery: Practical Solutions, p. 71 to 74: sides 3.5 and 5, 60° between them
    ("3.5@60", "5@120"): (3.5 / np.sqrt(3.5**2 + 25 - 17.5), 77.0, 1e-6),
}
B_AND_K = ("3.4@116", "1.8@42")


def job(folder, weights, readings=B_AND_K, more=""):
    """A job with rows of weights after the heading."""
    rows = [f"{run},600,A,{reading.replace('@', ',')}" for run, reading in zip("btu", readings, strict=False)]
    (folder / "runs.csv").write_text("\n".join(["run,speed_rpm,sensor,amplitude,phase_deg", *rows]))
    (folder / "weights.csv").write_text("\n".join(["run,plane,mass_g,angle_deg", *weights]))
    text = 'runs = "runs.csv"\nweights = "weights.csv"\nphase = "lead"\nangles = "with rotation"\n'
    (folder / "job.toml").write_text(text + more)
    return folder / "job.toml"


@pytest.mark.parametrize("readings", PRINTED)
def test_ratio_and_angle_as_printed(tmp_path, readings):
    times, turn, digits = PRINTED[readings]
    outcome = balance(job(tmp_path, ["t,1,?,?"], readings), LEAST_SQUARES)
    (row,) = outcome.to_dict()["corrections"]
    assert row["times_trial"] == pytest.approx(times, abs=digits)
    assert row["turn_deg"] == pytest.approx(turn, abs=0.05)
    assert row["mass"] is row["angle_deg"] is row["mass_std"] is None
    way = f"{abs(row['turn_deg']):.0f}° {'with' if turn > 0 else 'against'} the rotation and take {times:.3g}"
    assert outcome.answer.judgement.startswith(f"Move the trial weight by {way}")


def test_weights_left_in_as_published():
    """Feese and Grazier: 11.1 at 35° became 15.33 at 2.9°, 3.7 at 135° 6.617 at 112.9°, to 0.2 %."""
    rows = balance(sample_data() / "left_in" / "unknown.toml", LEAST_SQUARES).to_dict()["corrections"]
    np.testing.assert_allclose([r["times_trial"] for r in rows], [15.33 / 11.1, 6.617 / 3.7], rtol=2e-3)
    np.testing.assert_allclose([r["turn_deg"] for r in rows], [2.9 - 35, 112.9 - 135], atol=0.1)


@pytest.mark.parametrize(("mass", "angle"), [("?", "40"), ("2", "?")])
def test_what_is_known_of_the_trial_weight_is_known_of_the_correction(tmp_path, mass, angle):
    (was,) = balance(job(tmp_path, ["t,1,2,40"]), LEAST_SQUARES).to_dict()["corrections"]
    document = balance(job(tmp_path, [f"t,1,{mass},{angle}"]), LEAST_SQUARES).to_dict()
    (row,) = document["corrections"]
    assert document["relative_to_trial_weight"] == (["mass", "angle"] if angle == "?" else ["mass"])
    assert row["times_trial"] == pytest.approx(was["mass"] / 2)
    assert row["mass"] == (None if mass == "?" else pytest.approx(was["mass"]))
    assert row["angle_deg"] == (None if angle == "?" else pytest.approx(was["angle_deg"]))


@pytest.mark.parametrize(
    ("weights", "words"),
    [
        (["t,1,?,?", "u,1,?,?"], "not determined"),
        (["t,1,?,0", "u,1,5,90"], r"\? too"),
        (["t,1,7,?", "u,1,5,?"], "not determined"),
    ],
)
def test_what_is_not_determined_is_refused_in_one_message(tmp_path, weights, words):
    with pytest.raises(ValueError, match=words) as error:
        balance(job(tmp_path, weights, (*B_AND_K, "3@20")))
    assert "\n" not in str(error.value)


def test_what_needs_known_weights_is_refused(tmp_path):
    for option in ({"split": True}, {"max_mass": "5g"}, {"grade": "G2.5"}, {"ridge": 0.1}, {"refine": True}):
        with pytest.raises(ValueError, match="not known"):
            balance(job(tmp_path, ["t,1,?,?"]), BalanceOptions(**option))
    for limit in ("max_mass_g = 5", "forbidden_deg = [[0, 90]]"):
        with pytest.raises(ValueError, match=r"\?"):
            balance(job(tmp_path, ["t,1,?,?"], more=f"[planes.1]\n{limit}\n"))
    placed = balance(job(tmp_path, ["t,1,?,0"], more="[planes.1]\nforbidden_deg = [[0, 90]]\n"))
    assert placed.to_dict()["limits"]["forbidden_deg"] == {"1": [[0, 90]]}
