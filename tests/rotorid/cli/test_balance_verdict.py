"""`rotorid balance` with a tolerance, limits, and check runs that refine."""

from __future__ import annotations

import numpy as np
import pytest

from rotorid.samples import sample_data

TURBO = sample_data() / "turbo_job"


def test_check_runs_refine_the_coefficients(cli):
    plain = cli("balance", TURBO / "checked.toml", "--json").json
    refined = cli("balance", TURBO / "checked.toml", "--refine", "--json")
    assert refined.code == 0, refined.err
    found = refined.json
    for a, b in zip(plain["residuals"], found["residuals"], strict=True):  # the errors of the prediction
        assert np.trace(b["after_covariance"]) < 0.5 * np.trace(a["after_covariance"])
    assert found["mounted_in_last_run"]["run"] == "check"
    for mounted, add, total in zip(
        found["mounted_in_last_run"]["weights"], found["add_to_mounted"], found["corrections"], strict=True
    ):
        z = [w["mass"] * np.exp(1j * np.deg2rad(w["angle_deg"])) for w in (mounted, add, total)]
        assert z[0] + z[1] == pytest.approx(z[2], abs=1e-6)
    outcome = cli("balance", TURBO / "job.toml", "--refine")
    assert outcome.code == 2
    assert "no check runs" in outcome.err


def test_the_judgement_is_that_of_the_check_run_where_there_is_one(cli):
    text = cli("balance", TURBO / "checked.toml").out
    assert text.startswith("Trim; rms 0.413 → 0.316 µm pp, below 0.33 in 95 of 100 check runs. ")
    first, table = " ".join(text.partition("\n\n")[0].split()), text.split("\n\n")[1]
    assert first.endswith("As predicted: with the weights rms 28.4 → 0.413 µm pp (0.382 predicted).")
    assert "Mount these weights" not in text
    assert "add 13.65 g·mm at 154.5°" in table
    bare = "left      423.0  168.9°"
    assert bare not in text
    assert bare in cli("balance", TURBO / "checked.toml", "--table").out
    refined = cli("balance", TURBO / "checked.toml", "--refine").out
    assert refined.startswith("Trim; ")
    assert "add 13.65 g·mm at 154.5°" in refined
    assert "Mount" not in refined
