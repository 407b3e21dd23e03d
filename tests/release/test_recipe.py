"""The recipe for conda says what pyproject.toml says, in sections and fields that conda-build knows."""

import re
import tomllib
from pathlib import Path

import yaml
from packaging.requirements import Requirement

import rotorid

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
BUILD = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["build-system"]["requires"]
RECIPE = yaml.safe_load((ROOT / "recipe" / "meta.yaml").read_text(encoding="utf-8"))
KNOWN = {
    "package": {"name", "version"},
    "source": {"path", "url", "sha256", "fn", "folder", "patches", "git_url", "git_rev", "git_depth"},
    "build": {"number", "string", "noarch", "script", "entry_points", "skip", "script_env"},
    "requirements": {"build", "host", "run", "run_constrained"},
    "test": {"requires", "commands", "files", "imports", "source_files", "downstreams"},
    "about": {
        *("home", "dev_url", "doc_url", "license", "license_family", "license_file", "license_url"),
        *("summary", "description", "keywords", "tags", "identifiers", "readme"),
    },
}
"""What such a recipe needs of `FIELDS` in conda_build/metadata.py; conda-build refuses what is not there."""
LISTS = {"host", "run", "run_constrained", "imports", "commands", "entry_points"}
NAMES = {"matplotlib": "matplotlib-base", "heyoka": "heyoka.py"}
"""Of packages that conda-forge calls otherwise."""


def specs(requirements):
    """NAME >=VERSION, as conda writes it; an extra of a requirement is a package of its own there."""
    for text in requirements:
        one = Requirement(text)
        for name in (NAMES.get(one.name, one.name), *one.extras):
            yield f"{name} {one.specifier}"


def test_conda_build_knows_every_section_and_field():
    assert set(RECIPE) <= set(KNOWN)
    assert {s: set(fields) - KNOWN[s] for s, fields in RECIPE.items() if set(fields) - KNOWN[s]} == {}
    for section in RECIPE.values():
        for field, value in section.items():
            assert isinstance(value, list) == (field in LISTS), field
            assert all(isinstance(each, str) and each for each in (value if field in LISTS else ())), field
    assert RECIPE["build"]["noarch"] in ("python", "generic")
    assert re.fullmatch(r"[a-z0-9._-]+", RECIPE["package"]["name"])
    assert re.fullmatch(r"\d+\.\d+\.\d+", RECIPE["package"]["version"])  # a text, not the number 0.1
    assert (ROOT / "recipe" / RECIPE["source"]["path"]).resolve() == ROOT
    assert (ROOT / RECIPE["about"]["license_file"]).is_file()


def test_it_needs_what_the_package_needs():
    python = f"python {PROJECT['requires-python']}"
    assert RECIPE["requirements"]["run"] == [python, *specs(PROJECT["dependencies"])]
    assert RECIPE["requirements"]["host"] == [python, "pip", *specs(BUILD)]
    extras = [text for each in PROJECT["optional-dependencies"].values() for text in each]
    assert RECIPE["requirements"]["run_constrained"] == list(dict.fromkeys(specs(extras)))


def test_it_is_the_same_program():
    scripts = [f"{name} = {place}" for name, place in PROJECT["scripts"].items()]
    assert RECIPE["build"]["entry_points"] == scripts
    about = RECIPE["package"] | RECIPE["about"]
    assert [about[key] for key in ("name", "version", "license")] == [
        PROJECT[key] for key in ("name", "version", "license")
    ]
    assert about["summary"] == PROJECT["description"]


def test_every_place_says_the_same_version():
    version = PROJECT["version"]
    assert rotorid.__version__ == version
    for file, line in (("CHANGELOG.md", r"^## {}\b"), ("CITATION.cff", "^version: {}$")):
        text = (ROOT / file).read_text(encoding="utf-8")
        assert re.search(line.format(re.escape(version)), text, re.MULTILINE), file
