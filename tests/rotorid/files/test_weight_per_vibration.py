"""Influence coefficients as weight per vibration: ../shared/cases/files/sensitivities, 16.98 g at 294.0°."""

from __future__ import annotations

import numpy as np
import pytest

from rotorid.files import InputError, read_influence, read_job

RUNS = "run,speed_rpm,sensor,amplitude_in_s,phase_deg\nas found,2419,prop,0.37,165\n"
FORMS = {
    "as documented": "speed_rpm,sensor,plane,influence_g_per_in_s,phase_deg\n2419,prop,spinner,45.9,309\n",
    "angle": "speed_rpm,sensor,plane,Sensitivity (g/in/s),Angle (deg)\n2419,prop,spinner,45.9,309\n",
    "vector": "speed_rpm,sensor,plane,Sensitivity [g per ips]\n2419,prop,spinner,45.9 @ 309°\n",
    "brackets": "speed_rpm,sensor,plane,Coefficient g/(in/s),angle_deg\n2419,prop,spinner,45.9,309\n",
}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("phase", "angles"), [("lead", "with rotation"), ("lag", "against rotation")])
def test_the_weight_is_that_of_the_handbook(tmp_path, form, phase, angles):
    (tmp_path / "runs.csv").write_text(RUNS)
    (tmp_path / "influence.csv").write_text(FORMS[form], encoding="utf-8")
    files = 'runs = "runs.csv"\ninfluence = "influence.csv"\n'
    (tmp_path / "job.toml").write_text(f'{files}phase = "{phase}"\nangles = "{angles}"\n')
    job = read_job(tmp_path / "job.toml")
    size, angle = job.influence.labels.weight(-job.trials.readings[0, 0, 0] / job.influence.W[0, :, 0])
    np.testing.assert_allclose([size, angle], [[0.37 * 45.9], [294.0]], rtol=1e-12)
    assert (job.influence.labels.weight_unit, job.influence.planes) == ("g", ("spinner",))


def test_an_angle_against_the_rotation_of_phases_that_lead(tmp_path):
    (tmp_path / "i.csv").write_text("# angles = against rotation\n" + FORMS["as documented"])
    found = read_influence(tmp_path / "i.csv", phase="lead").W[0, 0, 0]
    np.testing.assert_allclose(1 / found, 0.0459 / 0.0254 * np.exp(-1j * np.radians(309)), rtol=1e-12)


def test_an_acceleration_in_g_per_weight_in_g_is_as_before(tmp_path):
    (tmp_path / "i.csv").write_text("speed_rpm,sensor,plane,influence_g_per_g,phase_deg\n600,A,P,2,90\n")
    np.testing.assert_allclose(read_influence(tmp_path / "i.csv").W, [[[2j * 9.80665e3]]], rtol=1e-12)


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("600,A,P,2,90\n600,B,P,2,90\n", "one sensor, one plane and no errors"),
        ("600,A,P,2,90\n600,A,Q,2,90\n", "one sensor, one plane and no errors"),
        ("600,A,P,0,90\n", "a weight above 0"),
    ],
)
def test_of_several_it_would_be_no_influence(tmp_path, rows, words):
    (tmp_path / "i.csv").write_text("speed_rpm,sensor,plane,influence_oz_per_mil,phase_deg\n" + rows)
    with pytest.raises(InputError, match=words):
        read_influence(tmp_path / "i.csv")
