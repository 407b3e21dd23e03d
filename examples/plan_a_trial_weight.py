"""How heavy a first trial weight may be, and where it does most good.

Run `python examples/plan_a_trial_weight.py`.
"""

from __future__ import annotations

from math import degrees, pi, radians
from pathlib import Path

import numpy as np

import balancing
from balancing import expected_lag
from rotorid import read_job

JOB = Path(__file__).parents[1] / "sample_data" / "model_job" / "job.toml"
SPEED = 3000 * 2 * pi / 60  # rad/s
RADIUS, LOAD = 0.2, 500.0 * 9.80665  # m, and N of a rotor of 500 kg
IN_GRAMS = balancing.Labels(weight_unit="g", weight_scale=1e3)


def main() -> dict[str, float]:
    """Print three plans; return their amounts and angles."""
    # Nothing is known but the machine: the centrifugal force is 10 % of the load on the bearings.
    plain = balancing.trial_from_force("left", SPEED, RADIUS, LOAD, labels=IN_GRAMS)
    print(plain.summary(), end="\n\n")

    # A phase is read, 120° lead, and the rotor runs below its critical speed: opposite the heavy spot.
    aimed = balancing.trial_from_force(
        "left",
        SPEED,
        RADIUS,
        LOAD,
        phase=radians(120),
        lag=expected_lag("below"),
        labels=IN_GRAMS,
    )
    print(aimed.summary(), end="\n\n")

    # A rotor model gives coefficients: change the largest reading by 40 %, at the angle that helps most.
    job = read_job(JOB)
    assert job.rotor is not None
    influence = balancing.model_influence(
        job.rotor, job.plane_nodes, job.sensor_places, job.trials.speeds, labels=job.trials.labels
    )
    today = influence.rebased(job.trials)  # its only run, without weights
    modelled = balancing.trial_from_coefficients(today, "left")
    print(modelled.summary(), end="\n\n")

    # What such a weight would leave, from the same coefficients.
    assert modelled.expected is not None
    ratio = float(np.linalg.norm(modelled.expected) / np.linalg.norm(today.baseline))
    print(f"rms with the trial weight: {ratio:.1%} of what it was")
    assert aimed.angle is not None
    assert modelled.angle is not None
    return {
        "plain_g": 1e3 * plain.amount,
        "aimed_deg": degrees(aimed.angle),
        "modelled_g_mm": 1e6 * modelled.amount,
        "modelled_deg": degrees(modelled.angle),
        "rms_ratio": ratio,
    }


if __name__ == "__main__":
    main()
