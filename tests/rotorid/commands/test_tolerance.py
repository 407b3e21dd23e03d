"""`rotorid.commands.tolerance`: from Python as from the command line."""

import math

import pytest
from documents import same

from rotorid.commands.tolerance import ToleranceOptions, tolerance

USUAL = {"mass": 500.0, "speed": 100 * math.pi, "grade": 2.5}


@pytest.mark.parametrize(
    ("args", "options"),
    [
        ((), {}),
        (("--planes", "left,right"), {"planes": {"left": None, "right": None}}),
        (
            ("--planes", "left=100mm,right=600mm", "--bearings", "0mm,700mm", "--centre", "320mm"),
            {"planes": {"left": 0.1, "right": 0.6}, "bearings": (0.0, 0.7), "centre": 0.32},
        ),
    ],
)
def test_from_python_as_from_the_command_line(cli, args, options):
    usual = ("--mass", "500kg", "--speed", "3000rpm", "--grade", "G2.5")
    printed = cli("tolerance", *usual, *args, "--json").json
    found = tolerance(ToleranceOptions(**USUAL, **options))
    same(found.document, printed)
    assert set(printed["provenance"]["options"]) == set(found.provenance["options"]) == {*USUAL, *options}
