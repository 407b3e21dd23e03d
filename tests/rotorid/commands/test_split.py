"""`rotorid.commands.split`: from Python as from the command line."""

import cmath
import math

import numpy as np
import pytest
from documents import same

from rotorid.commands.split import SplitOptions, split

WEIGHT = cmath.rect(0.035, math.radians(120))


def test_arrays_are_lists():
    listed = split(WEIGHT, SplitOptions(holes=[0.0, 90.0, 200.0], pieces=[0.01, 0.02]))
    arrays = split(WEIGHT, SplitOptions(holes=np.array([0.0, 90.0, 200.0]), pieces=np.array([0.01, 0.02])))
    assert arrays.document["provenance"]["options"] == listed.document["provenance"]["options"]
    same(arrays.document, listed.document)


@pytest.mark.parametrize(
    ("args", "options"),
    [
        (
            "--holes 24 --pieces 10g,20g --taken 9:10g --per-hole 2",
            SplitOptions(holes=24, pieces=[0.01, 0.02], taken={"9": 0.01}, per_hole=2),
        ),
        ("--holes 0,40,75,200", SplitOptions(holes=[0, 40, 75, 200])),
        ("--two 20g,30g --angles againstrotation", SplitOptions(two=[0.02, 0.03], angles="against rotation")),
        ("--drill 16mm --radius 100mm", SplitOptions(drill=0.016, radius=0.1)),
    ],
)
def test_from_python_as_from_the_command_line(cli, args, options):
    words = [word.replace("against", "against ") for word in args.split()]
    printed = cli("split", "35g@120", *words, "--json").json
    weight = WEIGHT.conjugate() if "against" in options.angles else WEIGHT
    found = split(weight, options).document
    given = printed["provenance"]["options"]
    named = {word[2:].replace("-", "_") for word in words if word.startswith("--")}
    assert set(given) == {"vector"} | named
    assert given["vector"] == "35g@120"
    same(found, printed)
