"""`rotorid trial-weight`."""

import numpy as np
import pytest

from rotorid.samples import sample_data

FORCE = ("--load", "500kg", "--speed", "3000rpm", "--radius", "200mm")
ANGLE = ("--reading-phase", "120", "--lag", "below")
BK = sample_data() / "bk_two_plane" / "job.toml"


@pytest.fixture
def weights(cli):
    def run(*args):
        outcome = cli("trial-weight", *args, "--json")
        assert outcome.code == 0, outcome.err
        return outcome.json["trial_weights"]

    return run


def test_radius_of_the_job(weights, tmp_path):
    for name in ("runs.csv", "weights.csv"):
        (tmp_path / name).write_bytes((BK.parent / name).read_bytes())
    job = tmp_path / "job.toml"
    text = BK.read_text()
    plain = weights(BK, "--plane", "1", "--radius", "100mm")[0]
    assert plain["radius_m"] == pytest.approx(0.1)
    assert plain["force_N"] == pytest.approx(plain["mass"] * 1e-3 * 0.1 * (100 * np.pi) ** 2)
    job.write_text(text + "\n[planes.1]\nradius_mm = 100\n")
    (moved,) = weights(job, "--plane", "1", "--radius", "125mm")
    assert moved["mass"] == pytest.approx(0.8 * plain["mass"])
    assert moved["expected"] == plain["expected"]
    assert moved["force_N"] == pytest.approx(plain["force_N"])


def test_amount_from_the_load(weights):
    (found,) = weights(*FORCE)
    (half,) = weights(*FORCE, "--share", "20")
    assert half["mass"] == pytest.approx(2 * found["mass"])
    (pounds,) = weights("--load", "1102.31131lbf", "--speed", "50Hz", "--radius", "7.874015748in")
    assert pounds["mass"] == pytest.approx(24.8405, rel=1e-4)
    (kilo,) = weights("--load", "2.5kN", "--speed", "314.159265rad_s", "--radius", "0.2m")
    assert kilo["mass"] == pytest.approx(1e3 * 250 / (0.2 * 314.159265**2))


def test_angle_from_phase_and_lag(weights):
    (found,) = weights(*FORCE, *ANGLE)
    assert found["angle_deg"] == pytest.approx(345)  # 120 + 45 + 180
    assert found["angle_reach_deg"] == pytest.approx(45)
    # the same shaft and sensor, all written the other way
    (other,) = weights(
        *FORCE, "--reading-phase", "240", "--lag", "45", "--phase", "lag", "--angles", "against"
    )
    assert other["angle_deg"] == pytest.approx(15)
    (placed,) = weights(*FORCE, *ANGLE, "--sensor-angle", "30")
    assert placed["angle_deg"] == pytest.approx(15)
    (at,) = weights(*FORCE, "--reading-phase", "120", "--lag", "at")
    assert at["angle_deg"] == pytest.approx(30)


def test_lead_is_not_assumed_without_a_word(cli):
    words = "lead is assumed"
    assert words in cli("trial-weight", *FORCE, *ANGLE).out
    assert words not in cli("trial-weight", *FORCE, *ANGLE, "--phase", "lead").out
    assert words not in cli("trial-weight", *FORCE).out


def test_angle_and_expected_change_from_a_job(weights):
    found = weights(BK)
    # the coefficients, in g and in the numbers of the application note
    names = [row["plane"] for row in found]
    assert len(names) == 2
    for row in found:
        change = [r["change"] for r in row["expected"]]
        assert max(change) == pytest.approx(0.4 * 13.5, rel=1e-6)
        before = np.hypot(*[r["before"] for r in row["expected"]])
        after = np.hypot(*[r["after"] for r in row["expected"]])
        assert after < before
    (first,) = weights(BK, "--plane", names[0])
    # the trial run of the note, 2.5 g at another angle, changed reading 1: from 7.2 at 238° to 4.9 at 114°
    shift = abs(4.9 * np.exp(1j * np.deg2rad(114)) - 7.2 * np.exp(1j * np.deg2rad(238)))
    assert first["expected"][0]["change"] == pytest.approx(shift * first["mass"] / 2.5)
