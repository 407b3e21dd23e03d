"""`rotorid.commands.demo` from Python: files, commands and the documents of whoever runs them."""

from rotorid.commands.demo import DemoOptions, demo, samples
from rotorid.commands.demo_samples import SAMPLES


def test_files_are_written_and_commands_told(tmp_path, cli):
    made = demo(tmp_path / "d", DemoOptions(sample="identification"))
    document = made.document
    assert {entry["file"] for entry in document["provenance"]["inputs"]} == {
        str(path) for path in (tmp_path / "d").rglob("*") if path.is_file()
    }
    assert document["provenance"]["options"] == {"sample": "identification"}
    typed = [heading.partition("\n")[2].replace(" \\\n    ", " ") for heading, _ in made.told()]
    assert typed == [f"$ {command}" for command in document["commands"]]
    assert made.to_frame()["command"].tolist() == document["commands"]
    ran = made.run(lambda words: {"words": words, "provenance": None}).to_dict()
    assert [ran[step.key] for step in made.sample.steps] == [{"words": words} for words in made.commands]


def test_the_list(cli):
    assert samples().to_frame()["name"].tolist() == list(SAMPLES)
    assert samples().summary() == cli("demo", "--list").out.rstrip("\n")
