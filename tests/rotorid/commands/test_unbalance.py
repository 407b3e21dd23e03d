"""`rotorid.commands.unbalance`: from Python as from the command line."""

from documents import same

from rotorid.commands.unbalance import UnbalanceOptions, unbalance
from rotorid.samples import sample_data

JOB = sample_data() / "model_job" / "job.toml"


def test_from_python_as_from_the_command_line(cli):
    printed = cli("unbalance", JOB, "--stations", "6,12,19", "--json").json
    found = unbalance(JOB, UnbalanceOptions(stations=[6, 12, 19]))
    same(found.document, printed)
    assert found.provenance["inputs"] == printed["provenance"]["inputs"]
    given = printed["provenance"]["options"]
    assert set(given) == set(found.provenance["options"]) == {"stations"}
