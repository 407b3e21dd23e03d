"""One shot by a calibrated rotor: errors beside those of drawn rotors."""

from dataclasses import replace

import numpy as np
import pytest
from repetitions import FULL, of_a_spread

import fem
from fem.parameters import with_parameters
from rotorid import read_job
from rotorid.commands.balance import balance
from rotorid.samples import sample_data

FOLDER = sample_data() / "calibration"


@pytest.fixture(scope="module")
def shot():
    return balance(FOLDER / "later.toml")


def test_errors_of_the_parameters_are_those_of_drawn_rotors(shot):
    """Columns against coefficients of rotors drawn from the covariance that the file states."""
    draws = 300 if FULL else 100
    job = read_job(FOLDER / "later.toml")
    known, influence = job.rotor.calibration, shot.influence
    random = np.random.default_rng(1)
    drawn = []
    values = np.array([fem_value(job.rotor, name) for name in known.names])
    for _ in range(draws):
        theta = dict(zip(known.names, random.multivariate_normal(values, known.covariance), strict=True))
        angles = {n: theta[n] for n in theta if n.startswith("probe")}
        places = [
            replace(place, angle=place.angle + angles[f"probe[{name}].angle"])
            for name, place in job.sensor_places.items()
        ]
        rotor = with_parameters(job.rotor, theta)
        drawn.append(fem.influence(rotor, list(job.planes), places, job.trials.speeds).W)
    spread = np.std(drawn, axis=0)
    stated = np.sqrt(np.sum(np.abs(influence.columns()[..., 1:]) ** 2, axis=0))
    np.testing.assert_allclose(stated, spread, rtol=max(0.2, of_a_spread(draws)))


def fem_value(rotor, name):
    from fem.parameters import parameter_value

    known = dict(zip(rotor.calibration.names, rotor.calibration.values, strict=True))
    return known[name] if fem.is_reading(name) else parameter_value(rotor, name)
