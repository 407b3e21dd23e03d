"""`rotorid.commands.trial_weight`: from Python as from the command line."""

import math

import pytest
from documents import same

from rotorid.commands.trial_weight import TrialWeightOptions, trial_weight
from rotorid.files import read_job
from rotorid.samples import sample_data

RPM3000 = 100 * math.pi
BK = sample_data() / "bk_two_plane" / "job.toml"


@pytest.mark.parametrize(
    ("args", "options"),
    [
        (
            "--load 500N --speed 3000rpm --radius 0.2m --share 8",
            {"load": 500.0, "speed": RPM3000, "radius": 0.2, "share": 8},
        ),
        (
            "--load 9kN --speed 50Hz --radius 200mm --reading-phase 9 --lag below --sensor-angle 30 "
            "--phase lag",
            {"load": 9e3, "speed": RPM3000, "radius": 0.2, "reading_phase": 9, "lag": "below"}
            | {"sensor_angle": 30, "phase": "lag"},
        ),
    ],
)
def test_from_the_load(cli, args, options):
    printed = cli("trial-weight", *args.split(), "--json").json
    found = trial_weight(None, TrialWeightOptions(**options))
    same(found.document, printed)
    assert set(printed["provenance"]["options"]) == set(found.provenance["options"]) == set(options)


def test_from_a_job(cli):
    args = (
        "--plane",
        "1",
        "--radius",
        "100mm",
        "--load",
        "9N",
    )
    printed = cli("trial-weight", BK, *args, "--share", "30", "--angles", "with rotation", "--json").json
    options = {"plane": ["1"], "radius": 0.1, "load": 9, "share": 30}
    found = trial_weight(BK, TrialWeightOptions(angles="with rotation", **options))
    same(found.document, printed)
    assert found.provenance["inputs"] == printed["provenance"]["inputs"]
    assert set(printed["provenance"]["options"]) == {*options, "angles"}
    job = read_job(BK)
    same(trial_weight(job).document, trial_weight(BK).document)
    with pytest.raises(ValueError, match="stated where it is read"):
        trial_weight(job, TrialWeightOptions(phase="lag"))
